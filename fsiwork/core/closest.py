"""Distances to the closest points of the line or surface φ = 0 of a tensor polynomial through the nodes around it."""

import numpy as np

from fsiwork.core.grid import Grid
from fsiwork.core.kernels import closest_2d


def cubic(grid: Grid, phi: np.ndarray, band: float | None) -> np.ndarray:
    return _band(grid, phi, 6.0 if band is None else band, 3)


def quintic(grid: Grid, phi: np.ndarray, band: float | None) -> np.ndarray:
    return _band(grid, phi, 6.0 if band is None else band, 5)


def _band(grid, phi, band, order):
    q = np.ascontiguousarray(phi, np.float64)
    n = grid.shape
    out = np.empty_like(q)
    near, sound = closest_2d.scan(q, n, out, band * grid.h)
    if not sound:
        return np.full_like(phi, np.nan)
    found = closest_2d.seeds(q, n, near, order)
    nodes, seed = closest_2d.spread(n, near, found, band)
    closest_2d.polish(q, n, order, nodes, seed, found, band, grid.h, out)
    return out.astype(phi.dtype, copy=False)
