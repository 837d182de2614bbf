"""Section 7.1: H and G of a torus and an ellipsoid by differences of second and fourth order against exact values.

Errors are the largest over the nodes within Δx of the surface, in parts of the largest exact value there; box [-1, 1]³.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.core.curvature import curvatures, of_ellipsoid, of_torus, shifted
from fsiwork.core.grid import Grid
from fsiwork.core.redistance import redistance
from fsiwork.core.shapes import Ellipsoid, Torus
from fsiwork.studies.orders import slope

RADIUS, TUBE = 0.6, 0.25
SEMI_AXES = (0.8, 0.6, 0.45)
QUANTITIES = ("mean", "gauss")


def _torus(grid: Grid):
    phi = grid.sample(Torus((0.0, 0.0, 0.0), RADIUS, TUBE).distance)
    return phi, phi, lambda nodes, x: of_torus(RADIUS, *x)


def _square(grid: Grid) -> np.ndarray:
    return grid.sample(lambda *x: sum((c / a) ** 2 for c, a in zip(x, SEMI_AXES, strict=True)))


def _quadratic(grid: Grid):
    square = _square(grid)
    return square - 1, (np.sqrt(square) - 1) * min(SEMI_AXES), lambda nodes, x: of_ellipsoid(SEMI_AXES, *x)


def _distance(grid: Grid):
    """The exact distance within 6 Δx; exact curvatures are those of the parallel surface of the foot point."""
    scaled, reach = np.sqrt(_square(grid)) - 1, 6 * grid.h
    near = np.flatnonzero(np.abs(scaled) * min(SEMI_AXES) <= reach)
    phi = np.where(scaled > 0, reach, -reach)
    phi[near] = Ellipsoid((0.0, 0.0, 0.0), SEMI_AXES).distance(*_points(grid, near))
    return phi, phi, lambda nodes, x: shifted(*of_ellipsoid(SEMI_AXES, *_foot(x)), phi[nodes])


def _redistanced(grid: Grid):
    """exp of the quadratic φ, less 1, made a distance by closest points on quintics, which would be exact for a
    polynomial; exact curvatures as those of `_distance`."""
    phi = redistance(grid, np.expm1(_square(grid) - 1), "closest-quintic")
    return phi, phi, lambda nodes, x: shifted(*of_ellipsoid(SEMI_AXES, *_foot(x)), _to_foot(x))


def _to_foot(x: list[np.ndarray]) -> np.ndarray:
    """Signed distances of points near the ellipsoid from it [length]."""
    outside = sum((c / a) ** 2 for c, a in zip(x, SEMI_AXES, strict=True)) > 1
    return np.where(outside, 1, -1) * np.sqrt(sum((c - f) ** 2 for c, f in zip(x, _foot(x), strict=True)))


def _points(grid: Grid, nodes: np.ndarray) -> list[np.ndarray]:
    """Coordinates of flat indices."""
    lines = (np.ravel(line) for line in grid.points())
    return [line[k] for line, k in zip(lines, np.unravel_index(nodes, grid.shape), strict=True)]


def _foot(x: list[np.ndarray]) -> list[np.ndarray]:
    """Nearest points of the ellipsoid to points near it: a²x/(a² + t) with Newton's method from t = 0."""
    square, t = [a * a for a in SEMI_AXES], np.zeros_like(x[0])
    for _ in range(8):
        value = sum(s * (c / (s + t)) ** 2 for c, s in zip(x, square, strict=True)) - 1
        t = t + value / sum(2 * s * c**2 / (s + t) ** 3 for c, s in zip(x, square, strict=True))
    return [c * s / (s + t) for c, s in zip(x, square, strict=True)]


SURFACES = {
    "torus": _torus,
    "ellipsoid-quadratic": _quadratic,
    "ellipsoid-distance": _distance,
    "ellipsoid-redistanced": _redistanced,
}


def surface(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Errors of H (``mean``) and G (``gauss``) of a ``surface`` with differences of an ``order`` on ``cells``³."""
    cells = int(point["cells"])
    grid = Grid((cells,) * 3, 2 / cells, (-1.0,) * 3)
    phi, distance, exact = SURFACES[point["surface"]](grid)
    start, n = grid.rows()
    inside = np.add.outer(start, np.arange(n)).ravel()
    nodes = inside[np.abs(distance[inside]) < grid.h]
    x = _points(grid, nodes)
    found, wanted = curvatures(grid, phi, int(point["order"]), nodes), exact(nodes, x)
    out: dict[str, Any] = {"nodes": nodes.size, "n_cells": cells}
    for name, a, b in zip(QUANTITIES, found, wanted, strict=True):
        out[name] = float(np.abs(a - b).max() / np.abs(b).max())
    return out


def curvature_7_1(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Orders of H and G, errors at N = 128, and of both on the quadratic φ of the ellipsoid."""
    data = datasets["curvature"]
    out = {}
    for order in (2, 4):
        for name in QUANTITIES:
            for shape in ("torus", "ellipsoid-distance", "ellipsoid-redistanced"):
                one = data[name].sel(surface=shape, order=order)
                label = f"{name}_{order}_{shape.replace('-', '_')}"
                out[f"{label}_order"] = slope(2 / one["cells"], one)
                out[f"{label}_128"] = float(one.sel(cells=128)) if 128 in one["cells"] else math.nan
    quadratic = [data[name].sel(surface="ellipsoid-quadratic").max("order", skipna=False) for name in QUANTITIES]
    worst = np.maximum(*quadratic)  # round-off of φ over Δx²: grows with the grid
    out["quadratic_128"] = float(worst.sel(cells=128)) if 128 in worst["cells"] else math.nan
    out["quadratic_largest"] = float(worst.max(skipna=False))
    return out


def rows_7_1(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each N: errors of H and G by surface and order."""
    data = datasets["curvature"]
    columns = [(shape, order, name) for shape in SURFACES for order in (2, 4) for name in QUANTITIES]
    letter = {"mean": "H", "gauss": "G"}
    header = ["N", *(f"{shape}, order {order}, {letter[name]}" for shape, order, name in columns)]
    rows = []
    for cells in sorted(int(c) for c in data["cells"].values):
        at = data.sel(cells=cells)
        values = (float(at[name].sel(surface=shape, order=order)) for shape, order, name in columns)
        rows.append([cells, *(float(f"{v:.3g}") for v in values)])
    return header, rows
