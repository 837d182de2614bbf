"""Distances to the closest points of the line or surface φ = 0 of a tensor polynomial through the nodes around it.

The interface is where the sign of φ (zero counts as positive) changes between neighbouring nodes, ghosts included: it
goes on through the sides of the box as the ghosts say. A direction whose ghosts are the wrapped values is periodic, and
distances are through its sides too. Errors where φ is smooth: Δx⁴ (cubic), Δx⁶ (quintic), Δx³ (sweep, beyond 6
cells); Δx at kinks.
A node with φ = 0 is on the interface whatever is around it. A field that is not finite gives NaN everywhere.
"""

import math

import numpy as np

from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import closest_2d, closest_3d, rasters
from fsiwork.core.relaxation import repeated

BAND = 6.0  # cells

WEIGHTS = {p - 1: np.linalg.inv((np.arange(p)[:, None] - (p // 2 - 1.0)) ** np.arange(p)).T.copy() for p in (4, 6)}
"""Order → coefficient of s^m [k, m] of Lagrange's polynomial of node k of a line, cell between nodes 0 and 1."""


def cubic(grid: Grid, phi: np.ndarray, band: float | None = None) -> np.ndarray:
    """Distances on tensor cubics within ``band`` cells (default 6) of φ = 0; ± band·Δx by the sign of φ beyond."""
    return _distances(grid, phi, BAND if band is None else band, 3, False)


def quintic(grid: Grid, phi: np.ndarray, band: float | None = None) -> np.ndarray:
    """Distances on tensor quintics within ``band`` cells (default 6) of φ = 0; ± band·Δx by the sign of φ beyond."""
    return _distances(grid, phi, BAND if band is None else band, 5, False)


def sweep(grid: Grid, phi: np.ndarray, band: float | None = None) -> np.ndarray:
    """Distances in all of the box: on tensor cubics near φ = 0, and beyond 6 cells from the parabola at the nearest of
    the closest points of the nodes next to φ = 0, which raster sweeps carry over the box.

    With a ``band`` [cells] cut off at ± band·Δx; without an interface ± the diagonal of the array.
    """
    return _distances(grid, phi, math.hypot(*grid.shape) if band is None else band, 3, True)


def _distances(grid, phi, band, order, everywhere):
    q, extra = _extended(grid, phi, max(grid.n) if everywhere else math.ceil(band) + GHOSTS)
    n, box = q.shape, (1,) * (3 - grid.dim) + q.shape
    kernels = closest_2d if grid.dim == 2 else closest_3d
    q, out = q.ravel(), np.empty(q.size)
    near, finite = rasters.scan(q, box, out, band)
    if not finite:
        return np.full_like(phi, np.nan)
    if near.size:
        start = rasters.crossings(q, box, near, WEIGHTS[order])
        found = kernels.seeds(q, n, near, start, order)
        if everywhere:
            nodes, seed = np.arange(q.size, dtype=np.int32), rasters.sweep(box, near, found)
        else:
            nodes, seed = rasters.spread(box, near, found, band)
        kernels.distances(q, n, order, BAND if everywhere else math.inf, nodes, seed, found, out)
    cut = tuple(slice(e, e + k) for e, k in zip(extra, grid.shape, strict=True))
    return (out.reshape(n)[cut] * grid.h).astype(phi.dtype, copy=False).ravel()


def _extended(grid: Grid, phi: np.ndarray, reach: int) -> tuple[np.ndarray, list[int]]:
    """The padded field in float64, and how many cells were added to each side of periodic directions: as many as the
    reach or half the period."""
    q = np.ascontiguousarray(grid.padded(phi), np.float64)
    extra = [0] * grid.dim
    for a, n in enumerate(grid.n):
        lines = np.moveaxis(q, a, 0)
        if repeated(lines, n):
            extra[a] = min(reach, n // 2 + 1)
            inside = np.moveaxis(lines[GHOSTS : GHOSTS + n], 0, a)
            width = [(0, 0)] * grid.dim
            width[a] = (extra[a] + GHOSTS,) * 2
            q = np.pad(inside, width, mode="wrap")
    return np.ascontiguousarray(q), extra
