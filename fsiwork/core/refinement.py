"""A field on a finer grid of the same box, by polynomials through six points in each direction."""

import numpy as np
from scipy import sparse

from fsiwork.core.grid import GHOSTS, Grid


def refined(grid: Grid, q: np.ndarray, factor: int) -> tuple[Grid, np.ndarray]:
    """The grid with ``factor`` times as many cells a direction, and ``q`` on it, sixth order.

    ``q`` is a flat centre field with its ghosts filled; so is the result, whose ghosts lie on the polynomials of the
    outermost points. Raises ValueError for a factor below 1.
    """
    if factor < 1:
        raise ValueError(f"factor must be at least 1, got {factor}")
    fine = Grid(tuple(k * factor for k in grid.n), grid.h / factor, grid.origin)
    values = grid.padded(q)
    for a, n in enumerate(grid.n):
        lines = np.moveaxis(values, a, 0)
        new = _weights(n, factor) @ lines.reshape(lines.shape[0], -1)
        values = np.moveaxis(new.reshape(new.shape[0], *lines.shape[1:]), 0, a)
    return fine, np.ascontiguousarray(values, dtype=q.dtype).ravel()


def _weights(n: int, factor: int) -> sparse.csr_matrix:
    """From the padded coarse line to the padded fine one: Lagrange weights of six neighbours."""
    place = (np.arange(-GHOSTS, n * factor + GHOSTS) + 0.5) / factor - 0.5 + GHOSTS  # in padded coarse indices
    first = np.clip(np.floor(place).astype(int) - 2, 0, n + 2 * GHOSTS - 6)
    nodes = np.arange(6)
    t = (place - first)[:, None]
    weights = np.ones((place.size, 6))
    for k in nodes:
        for m in nodes[nodes != k]:
            weights[:, k] *= (t[:, 0] - m) / (k - m)
    columns = first[:, None] + nodes
    starts = 6 * np.arange(place.size + 1)
    return sparse.csr_matrix((weights.ravel(), columns.ravel(), starts), shape=(place.size, n + 2 * GHOSTS))
