"""Sections 1.5.1 and 1.5.2: what each way to a distance errs near the interface, moves it when repeated, and takes.

The plane level set of Russo and Smereka's kind: f (√(x²/a² + y²/b²) - 1), a = .35, b = .2, whose steepness
f = (x - .35)² + (y - .25)² + .1 varies tenfold, in the box [-½, ½]². Exact distances are those of the ellipse.
"""

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.redistance import METHODS, redistance
from fsiwork.core.relaxation import renormalised
from fsiwork.core.shapes import Ellipsoid
from fsiwork.studies.orders import slope

SEMI_AXES = (0.35, 0.2)
NEAR = 1.2  # cells on each side of the interface: its neighbours
BANDED = ("pde", "subcell", "closest-cubic", "closest-quintic", "renormalisation")  # not meant for the whole box
PEER = "scikit-fmm"
ORDERS = {"near": (64, 512), "outside": (128, 512)}  # cells: beyond 512 the quintic is round-off
TIMED = 3  # runs, of which the fastest counts

Method = Callable[[Grid, np.ndarray], np.ndarray]


def _distorted(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """The field to redistance and the exact distance, flat."""
    a, b = SEMI_AXES
    steepness = grid.sample(lambda x, y: (x - 0.35) ** 2 + (y - 0.25) ** 2 + 0.1)
    phi = steepness * grid.sample(lambda x, y: np.sqrt((x / a) ** 2 + (y / b) ** 2) - 1)
    return phi, grid.sample(Ellipsoid((0.0, 0.0), SEMI_AXES).distance)


def _grid(cells: int) -> Grid:
    return Grid((cells, cells), 1 / cells, (-0.5, -0.5))


def _method(name: str) -> Method | None:
    """What a word of the studies stands for; None when the peer is not installed."""
    if name in METHODS:
        return lambda grid, phi: redistance(grid, phi, name)
    if name == "renormalisation":
        return renormalised
    order = int(name.removeprefix(f"{PEER}-"))
    try:
        import skfmm
    except ImportError:
        return None
    return lambda grid, phi: skfmm.distance(grid.padded(phi), dx=grid.h, order=order).ravel()


def errors(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Largest errors of a ``method`` on ``cells``² within 1.2 cells of the interface, in all of the box outside
    the ellipse (no medial axis there) and in the box, and ms.

    NaN in the last two for methods of a band, and everywhere for a peer that is not installed.
    """
    cells, name = int(point["cells"]), point["method"]
    out: dict[str, Any] = {"near": np.nan, "outside": np.nan, "box": np.nan, "ms": np.nan, "n_cells": cells}
    method = _method(name)
    if method is None:
        return out
    grid = _grid(cells)
    phi, exact = _distorted(grid)
    error = np.abs(grid.inside(method(grid, phi)) - grid.inside(exact))  # compiles, too
    distance = grid.inside(exact)
    out["near"] = float(error[np.abs(distance) < NEAR * grid.h].max())
    if name not in BANDED:
        out |= {"outside": float(error[distance > 0].max()), "box": float(error.max())}
    taken = []
    for _ in range(TIMED):
        begin = time.thread_time()
        method(grid, phi)
        taken.append(time.thread_time() - begin)
    return out | {"ms": 1e3 * min(taken)}


def drift(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """How far the interface has moved [cells] after ``repeats`` of a ``method``, ghosts extrapolated between them.

    The largest |φ| on 2,000 points of the ellipse, by polynomials of fifth order through 6² nodes.
    """
    cells, method = int(point["cells"]), _method(point["method"])
    out: dict[str, Any] = {"moved": np.nan, "n_cells": cells}
    if method is None:
        return out
    grid = _grid(cells)
    edges = Edges(grid, ((Side("outflow"),) * 2,) * grid.dim)
    phi, _ = _distorted(grid)
    for _ in range(int(point["repeats"])):
        phi = method(grid, phi)
        edges.fill_scalar(phi, "linear")
    angle = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    x = [a * turn for a, turn in zip(SEMI_AXES, (np.cos(angle), np.sin(angle)), strict=True)]
    return out | {"moved": float(np.abs(_interpolated(grid, phi, x)).max() / grid.h)}


def _interpolated(grid: Grid, phi: np.ndarray, x: list[np.ndarray]) -> np.ndarray:
    """Values at points from the 6² nodes around each: nothing farther away counts, as with splines it would."""
    places, lines, weights = np.arange(6), [], []
    for c, o in zip(x, grid.origin, strict=True):
        at = (c - o) / grid.h - 0.5 + GHOSTS
        first = np.floor(at).astype(int) - 2
        t = at - first
        others = [np.delete(places, k) for k in places]
        weights.append(np.stack([np.prod((t[:, None] - m) / (k - m), axis=1) for k, m in enumerate(others)], axis=1))
        lines.append(first[:, None] + places)
    values = grid.padded(phi)[lines[0][:, :, None], lines[1][:, None, :]]
    return np.einsum("pij,pi,pj->p", values, *weights)


def redistancing(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """By method: orders over the cells of `ORDERS`, error at N = 256, and the drift after 100 repeats."""
    data, moved = datasets["redistancing"], datasets["redistancing_drift"]["moved"]
    out = {}
    for name in data["method"].values:
        at, label = data.sel({"method": name}), str(name).replace("-", "_")
        for where, suffix in (("near", "order"), ("outside", "outside_order")):
            low, high = ORDERS[where]
            error = at[where].isel(cells=np.flatnonzero((at["cells"] >= low) & (at["cells"] <= high)))
            out[f"{label}_{suffix}"] = slope(1 / error["cells"], error) if bool((error > 0).all()) else np.nan
        out[f"{label}_256"] = float(at["near"].sel(cells=256))
        if name in moved["method"]:
            out[f"{label}_drift"] = float(moved.sel({"method": name, "repeats": 100}))
    return out


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each method: orders, errors and ms at N = 256 and at the finest, drift; a dash where it has none."""
    data, moved = datasets["redistancing"].sortby("cells"), datasets["redistancing_drift"]["moved"].sortby("repeats")
    finest, repeats = int(data["cells"][-1]), [int(k) for k in moved["repeats"]]
    parts = [(256, name) for name in ("near", "outside", "box", "ms")]
    if finest != 256:
        parts.append((finest, "ms"))
    words = {"near": f"error within {NEAR} Δx", "outside": "error outside", "box": "error in the box", "ms": "ms"}
    header = ["method", "order", "order outside", *(f"{words[name]}, N = {cells}" for cells, name in parts)]
    header += [f"moved after {k} [Δx]" for k in repeats]
    lines = []
    for name in data["method"].values:
        at = data.sel({"method": name})
        label = str(name).replace("-", "_")
        values = [measured[f"{label}_order"], measured[f"{label}_outside_order"]]
        values += [float(at[variable].sel(cells=cells)) for cells, variable in parts]
        known = name in moved["method"]
        values += [float(moved.sel({"method": name, "repeats": k})) if known else np.nan for k in repeats]
        lines.append([str(name), *("–" if np.isnan(v) else float(f"{v:.3g}") for v in values)])
    return header, lines
