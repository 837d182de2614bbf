"""Table 7.1: Z₁ and Z₂ from a transported backward map against their exact values, test cases TC1 to TC7.

The velocity is prescribed and steady; Y is carried by the solver's own transport (linear upwind 5, SSP-RK3) in the box
[-1, 1]³ to t = 0.5. Lengths are half the book's: spheres and the cylinder have radius 0.5, the cube half-side 0.5.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.invariants import area_and_shear, map_gradient
from fsiwork.core.transport import Transport
from fsiwork.studies.orders import slope

TIMES = (0.125, 0.25, 0.375, 0.5)
RADIUS, KEEP = 0.5, 0.85  # nodes further out than KEEP are left out: the box's edges
SAMPLE = 1500  # nodes kept for the pictures
COURANT = 0.25
SIGNS = {"plus": 1, "minus": -1, "zero": 0}  # α of TC1, β of TC2
Points = list[np.ndarray]


@dataclass(frozen=True)
class Case:
    """``u`` and ``Z`` are functions of (x, y, z) and (x, y, z, t); ``normal`` of Y is ∇φ₀, ``level`` is φ₀."""

    u: Callable
    Z: Callable
    level: Callable
    normal: Callable


def _plane(velocity: Callable, Z: Callable) -> Case:
    return Case(velocity, Z, lambda x, y, z: z, lambda x, y, z: (0 * x, 0 * x, 1 + 0 * x))


def _stretch(alpha: float) -> Case:
    """TC1."""
    return _plane(
        lambda x, y, z: (x, alpha * y, 0 * z),
        lambda x, y, z, t: (np.exp((1 + alpha) * t) + 0 * x, np.cosh((1 - alpha) * t) + 0 * x),
    )


def _shear(beta: float) -> Case:
    """TC2, with (1 + β)² (erratum T2); β < 0: the sine, β = 0: the limit."""

    def Z(x, y, z, t):
        root = math.sqrt(abs(beta))
        wave = t**2 if beta == 0 else (np.sinh(root * t) if beta > 0 else np.sin(root * t)) ** 2 / abs(beta)
        return 1 + 0 * x, 1 + 0.5 * (1 + beta) ** 2 * wave + 0 * x

    return _plane(lambda x, y, z: (beta * y, x, 0 * z), Z)


def _sphere(x, y, z):
    return np.sqrt(x * x + y * y + z * z) - RADIUS


def _cube_normal(x, y, z):
    top = np.argmax(np.abs([x, y, z]), axis=0)
    return tuple((top == a).astype(float) for a in range(3))


def _cube(x, y, z, t):
    face = np.argmax(np.abs([x, y - t * x, z]), axis=0)
    Z1 = np.choose(face, (1.0, math.sqrt(1 + t * t), 1.0))
    return Z1, np.choose(face, (1.0, (2 + t * t) / (2 * math.sqrt(1 + t * t)), 1 + 0.5 * t * t))


def _sheared_sphere(x, y, z, t):
    D = x * x + (y - t * x) ** 2 + z * z
    Z1 = np.sqrt(1 + t * t + (t * t * (x * x - z * z) - 2 * t * x * y) / D)
    return Z1, (1 + 0.5 * t * t + (t * t * x * x - 2 * t * x * y) / (2 * D)) / Z1


def _turning(x, y, z):
    return -y * z, x * z, 0 * z


CASES = {
    **{f"TC1-{name}": _stretch(alpha) for name, alpha in SIGNS.items()},
    **{f"TC2-{name}": _shear(beta) for name, beta in SIGNS.items()},
    "TC3": Case(
        _turning,
        lambda x, y, z, t: (1 + 0 * x, 1 + 0.5 * t * t * (x * x + y * y)),
        lambda x, y, z: np.sqrt(x * x + y * y) - RADIUS,
        lambda x, y, z: (x, y, 0 * z),
    ),
    "TC4": Case(
        _turning,
        lambda x, y, z, t: (1 + 0 * x, 1 + 0.5 * t * t * (x * x + y * y) ** 2 / (x * x + y * y + z * z)),
        _sphere,
        lambda x, y, z: (x, y, z),
    ),
    "TC5": Case(
        lambda x, y, z: (x, y, z), lambda x, y, z, t: (np.exp(2 * t) + 0 * x, 1 + 0 * x), _sphere,
        lambda x, y, z: (x, y, z),
    ),
    "TC6": Case(
        lambda x, y, z: (0 * x, x, 0 * z), _cube, lambda x, y, z: np.max(np.abs([x, y, z]), axis=0) - RADIUS,
        _cube_normal,
    ),
    "TC7": Case(lambda x, y, z: (0 * x, x, 0 * z), _sheared_sphere, _sphere, lambda x, y, z: (x, y, z)),
}  # fmt: skip


def carried(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Errors of Z₁ and Z₂ at the last of `TIMES`, their means at all of them, and a sample of nodes, for a ``case`` on
    ``cells``³."""
    cells, case = int(point["cells"]), CASES[point["case"]]
    grid = Grid((cells,) * 3, 2 / cells, (-1.0,) * 3)
    edges = Edges(grid, ((Side("free-slip"),) * 2,) * 3)
    carry = Transport(grid, edges, "upwind5", "ssp-rk3")
    u = [grid.sample(lambda *x, a=a: case.u(*x)[a], face=a) for a in grid.axes]
    Y = [grid.sample(lambda *x, a=a: x[a]) for a in grid.axes]
    fastest = sum(float(np.abs(c).max()) for c in u)
    steps = math.ceil(TIMES[0] * fastest / (COURANT * grid.h))
    out: dict[str, Any] = {"n_cells": cells, "n_steps": steps * len(TIMES)}
    means: dict[str, list[float]] = {name: [] for name in ("z1", "z2", "z1_exact", "z2_exact")}
    for t in TIMES:
        for _ in range(steps):
            carry.advance(Y, u, TIMES[0] / steps, "linear")
        x, found = _near(grid, Y, case)
        exact = case.Z(*x, t)
        for name, values in zip(means, (*found, *exact), strict=True):
            means[name].append(float(values.mean()))
    for name, a, b in zip(("error_z1", "error_z2"), found, exact, strict=True):
        out[name] = float(np.abs(a / b - 1).max())
    chosen = np.random.default_rng(1).choice(x[0].size, SAMPLE, replace=x[0].size < SAMPLE)
    kept = dict(zip(("x", "y", "z", "node_z1", "node_z2"), (*x, *found), strict=True))
    out |= {name: (("time",), values) for name, values in means.items()}
    return out | {name: (("node",), values[chosen]) for name, values in kept.items()}


def _near(grid: Grid, Y: list[np.ndarray], case: Case) -> tuple[Points, tuple[np.ndarray, np.ndarray]]:
    """Places of the nodes within Δx of the surface and away from the box's edges, and Z₁, Z₂ there."""
    start, n = grid.rows()
    inside = np.add.outer(start, np.arange(n)).ravel()
    lines = [np.ravel(line) for line in grid.points()]
    x = [line[k] for line, k in zip(lines, np.unravel_index(inside, grid.shape), strict=True)]
    level = case.level(*(q[inside] for q in Y))
    keep = (np.abs(level) < grid.h) & (np.max(np.abs(x), axis=0) < KEEP)
    nodes = inside[keep]
    normal = np.stack(case.normal(*(q[nodes] for q in Y)), axis=1)
    return [c[keep] for c in x], area_and_shear(map_gradient(grid, Y, nodes), normal)


def table_7_1(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Largest relative errors of Z₁, Z₂ where Y stays linear, and least orders where it does not."""
    data = datasets["invariants"].sortby("cells")
    worst = np.maximum(data["error_z1"], data["error_z2"])

    def largest(*names: str) -> float:
        cases = [c for c in data["case"].values if str(c).split("-")[0] in names]
        return float(worst.sel(case=cases).max(skipna=False))

    out = {"linear": largest("TC1", "TC2", "TC5"), "sheared": largest("TC6", "TC7")}
    for case in ("TC3", "TC4"):
        for name in ("z1", "z2"):
            one = data[f"error_{name}"].sel(case=case)
            out[f"order_{name}_{case.lower()}"] = slope(2 / one["cells"], one)
    printed = data.sel(case="TC2-plus", cells=data["cells"].max())
    t = TIMES[-1]
    out["tc2_printed"] = abs(1 + 1.0 * math.sinh(t) ** 2 - float(printed["z2"][-1])) / float(printed["z2"][-1])
    return out


def rows_7_1(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each test case: mean Z₁ and Z₂ at the end beside the exact ones, and the errors on each grid."""
    data = datasets["invariants"].sortby("cells")
    cells = [int(c) for c in data["cells"].values]
    header = ["case", "Z1", "Z1 exact", "Z2", "Z2 exact"]
    header += [f"error of {name}, N = {n}" for n in cells for name in ("Z1", "Z2")]
    rows = []
    for case in data["case"].values:
        last = data.sel(case=case, cells=cells[-1]).isel(time=-1)
        means = [round(float(last[name]), 6) for name in ("z1", "z1_exact", "z2", "z2_exact")]
        errors = [float(data[e].sel(case=case, cells=n)) for n in cells for e in ("error_z1", "error_z2")]
        rows.append([str(case), *means, *(float(f"{error:.2g}") for error in errors)])
    return header, rows
