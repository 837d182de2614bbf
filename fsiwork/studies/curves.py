"""Section 1.3: frame, curvature and torsion of a helix and of a trefoil knot given by two level sets.

The trefoil is v² + u³ = 0 on the sphere |u|² + |v|² = 1 of C², seen by stereographic projection from Im v = 1:
u = 2(x + iy)/(1 + r²), v = (2z + i(r² - 1))/(1 + r²). On it |u| and |v| are constant, |u|² + |u|³ = 1, so that
u = |u|e^(2iθ), v = i|u|^(3/2) e^(3iθ).
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from fsiwork.core.curves import Frenet, frenet, frenet_at
from fsiwork.core.grid import Grid
from fsiwork.studies.orders import slope

RISE = 0.3
POINTS = 512
CURVES = ("helix", "trefoil")
QUANTITIES = ("curvature", "torsion")


def helix() -> tuple[np.ndarray, np.ndarray]:
    """Points of the helix (cos θ, sin θ, ``RISE`` θ), θ from -4 to 4, and θ."""
    theta = np.linspace(-4.0, 4.0, POINTS)
    return np.stack([np.cos(theta), np.sin(theta), RISE * theta]), theta


def trefoil() -> tuple[np.ndarray, np.ndarray]:
    """Points of the knot, shape (3, m), at equidistant θ in [0, 2π), and θ."""
    theta = 2 * np.pi * np.arange(POINTS) / POINTS
    size = brentq(lambda s: s**2 + s**3 - 1, 0.5, 1.0, xtol=1e-15)
    u, v = size * np.exp(2j * theta), 1j * size**1.5 * np.exp(3j * theta)
    return np.stack([u.real, u.imag, v.real]) / (1 - v.imag), theta


def helix_fields(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two functions that vanish on the helix; where they are constant is a helix too."""
    return np.cos(z / RISE) - x, np.sin(z / RISE) - y


def trefoil_fields(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Real and imaginary part of v² + u³."""
    square = x * x + y * y + z * z
    u, v = 2 * (x + 1j * y) / (1 + square), (2 * z + 1j * (square - 1)) / (1 + square)
    both = v * v + u * u * u
    return both.real, both.imag


def of_helix() -> Frenet:
    """Exact, on `helix`: curvature 1/(1 + c²), torsion c/(1 + c²) with c = ``RISE``."""
    _, theta = helix()
    zero, scale = np.zeros_like(theta), 1 / np.hypot(1, RISE)
    tangent = scale * np.stack([-np.sin(theta), np.cos(theta), RISE + zero])
    normal = -np.stack([np.cos(theta), np.sin(theta), zero])
    frame = np.stack([tangent, normal, np.cross(tangent, normal, axis=0)])
    return Frenet(frame, scale**2 + zero, RISE * scale**2 + zero)


def of_trefoil() -> Frenet:
    """Exact, on `trefoil`, from three derivatives of its Fourier series: (1.11) to (1.16), error below 1e-8."""
    x, _ = trefoil()
    series = np.fft.fft(x, axis=1)
    series[np.abs(series) < 1e-14 * np.abs(series).max()] = 0  # round-off, which derivatives would blow up
    wave = 1j * np.fft.fftfreq(POINTS, 1 / POINTS)
    first, second, third = (np.fft.ifft(series * wave**k, axis=1).real for k in (1, 2, 3))
    speed, twice = np.linalg.norm(first, axis=0), np.cross(first, second, axis=0)
    size = np.linalg.norm(twice, axis=0)
    tangent, binormal = first / speed, twice / size
    frame = np.stack([tangent, np.cross(binormal, tangent, axis=0), binormal])
    return Frenet(frame, size / speed**3, (twice * third).sum(0) / size**2)


SETTING: dict[str, tuple[float, Callable, Callable, Callable]] = {
    "helix": (4.0, helix, helix_fields, of_helix),
    "trefoil": (6.0, trefoil, trefoil_fields, of_trefoil),
}
"""Side of the box (half of it along z for the trefoil), points, fields and exact frame."""


def grid_of(curve: str, cells: int) -> Grid:
    """A box about the origin, ``cells`` along x and y; flat for the trefoil. Raises ValueError for another curve."""
    if curve not in SETTING:
        raise ValueError(f"curve must be {' or '.join(SETTING)}, got {curve!r}")
    side = SETTING[curve][0]
    n = (cells, cells, cells if curve == "helix" else cells // 2)
    h = side / cells
    return Grid(n, h, tuple(-0.5 * k * h for k in n))


def curve(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """A ``curve`` by differences of an ``order`` on ``cells``: largest errors on it, in parts of the largest value.

    ``tangent`` and ``binormal``: largest |difference| of the unit vectors. ``near_`` (helix only, whose level curves
    are all the same helix): over the nodes within Δx of it.
    """
    name, order = point["curve"], int(point["order"])
    grid = grid_of(name, int(point["cells"]))
    _, points, fields, exact_of = SETTING[name]
    phi = [np.ascontiguousarray(np.broadcast_to(q, grid.shape)).ravel() for q in fields(*grid.points())]
    (x, theta), exact = points(), exact_of()
    found = frenet_at(grid, *phi, x, order)
    out: dict[str, Any] = {"n_cells": grid.n[0]}
    for label in QUANTITIES:
        a, b = getattr(found, label), getattr(exact, label)
        out[f"{label}_error"] = float(np.abs(a - b).max() / np.abs(b).max())
        out |= {label: (("point",), a), f"{label}_exact": (("point",), b)}
    for label, k in (("tangent", 0), ("binormal", 2)):
        out[f"{label}_error"] = float(np.linalg.norm(found.frame[k] - exact.frame[k], axis=0).max())
    out |= (
        _near(grid, phi, order, exact) if name == "helix" else dict.fromkeys(("near_curvature", "near_torsion"), np.nan)
    )
    return out | {axis: (("point",), q) for axis, q in zip("xyz", x, strict=True)} | {"theta": (("point",), theta)}


def _near(grid: Grid, phi: list[np.ndarray], order: int, exact: Frenet) -> dict[str, float]:
    start, n = grid.rows()
    inside = np.add.outer(start, np.arange(n)).ravel()
    nodes = inside[np.hypot(phi[0][inside], phi[1][inside]) < grid.h]
    place = np.array(np.unravel_index(nodes, grid.shape))
    far = (np.minimum(place, np.reshape(grid.shape, (3, 1)) - 1 - place) >= 6).all(0)
    found = frenet(grid, *phi, nodes[far], order)
    return {
        f"near_{label}": float(np.abs(getattr(found, label) / getattr(exact, label)[0] - 1).max())
        for label in QUANTITIES
    }


def curves(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Orders of curvature, torsion, tangent and binormal of both curves, and errors on the finest grid."""
    data = datasets["curves"].sortby("cells")
    out = {}
    for name in CURVES:
        for order in (2, 4):
            one = data.sel(curve=name, order=order)
            for label in (*QUANTITIES, "tangent", "binormal"):
                errors = one[f"{label}_error"]
                out[f"{label}_{name}_{order}_order"] = slope(1 / one["cells"], errors)
                out[f"{label}_{name}_{order}"] = float(errors.isel(cells=-1))
    for order in (2, 4):
        for label in QUANTITIES:
            errors = data[f"near_{label}"].sel(curve="helix", order=order)
            out[f"{label}_near_helix_{order}_order"] = slope(1 / data["cells"], errors)
    return out


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each N: errors of H, torsion, τ and b by curve and order."""
    data = datasets["curves"].sortby("cells")
    columns = [
        (name, order, label) for name in CURVES for order in (2, 4) for label in (*QUANTITIES, "tangent", "binormal")
    ]
    header = ["N", *(f"{name}, order {order}, {label}" for name, order, label in columns)]
    table = []
    for cells in data["cells"].values:
        at = data.sel(cells=cells)
        values = (float(at[f"{label}_error"].sel(curve=name, order=order)) for name, order, label in columns)
        table.append([int(cells), *(float(f"{v:.3g}") for v in values)])
    return header, table
