"""Redistancing from the nodes next to the interface outwards: fast marching (a heap) and fast sweeping.

An interface counts wherever it lies in the box or its ghosts; where the ghosts are the wrapped values the field is
continued periodically, by half a period or the band. At the outer rim differences are one-sided, towards the inside.
The interface is the one of linear interpolation along the axes, except in `fast_marching_2`.
"""

import math

import numpy as np

from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import marching as kernels
from fsiwork.core.relaxation import beside, wraps

WALLS = 2  # second-order differences read two nodes on
ROUNDS = 20  # of fast sweeping; two do without obstacles, bends of the characteristics ask for more


def fast_marching_1(grid: Grid, phi: np.ndarray, band: float | None = None) -> np.ndarray:
    """Sethian's fast marching with first-order differences; error O(Δx) at and near the interface."""
    return _redistance(grid, phi, band, _linear, lambda *nodes: _march(False, band, *nodes))


def fast_marching_2(grid: Grid, phi: np.ndarray, band: float | None = None) -> np.ndarray:
    """Fast marching with second-order differences from the distances of `relaxation.beside`, of second order too.

    A node across the interface counts with its sign.
    """
    return _redistance(grid, phi, band, _parted, lambda *nodes: _march(True, band, *nodes))


def fast_sweeping(grid: Grid, phi: np.ndarray, band: float | None = None) -> np.ndarray:
    """Zhao's fast sweeping with first-order differences, until nothing moves; ``band`` only cuts the values."""
    return _redistance(grid, phi, band, _linear, _sweep)


def _redistance(grid, phi, band, seeds, spread):
    """Signed distances [length]; nodes beyond ``band``, all of them without an interface, get the farthest there is."""
    if not np.isfinite(phi).all():
        return np.full_like(phi, np.nan)
    wide, values = _continued(grid, phi, math.inf if band is None else math.ceil(band))
    inner = (slice(WALLS, -WALLS),) * grid.dim
    q = np.pad(values, WALLS)
    state = np.full(q.shape, kernels.WALL, np.int8)
    state[inner] = kernels.FAR
    strides = np.array([int(np.prod(q.shape[a + 1 :])) for a in grid.axes])
    farthest = math.hypot(*grid.shape) if band is None else float(band)
    d = np.full(q.shape, np.inf)
    front = seeds(wide, values, q, d, state, strides)
    if front.size:
        spread(q, d, state, strides, front)
    out = np.copysign(np.minimum(d, farthest) * grid.h, q)
    cut = tuple(slice(WALLS + (w - k) // 2, WALLS + (w + k) // 2) for w, k in zip(wide.shape, grid.shape, strict=True))
    return out[cut].ravel().astype(phi.dtype, copy=False)


def _continued(grid, phi, reach):
    """A grid that goes on through periodic sides by ``reach`` cells or half a period, and the padded field on it."""
    q, n = grid.padded(phi).astype(np.float64), list(grid.n)
    for a in grid.axes:
        if wraps(grid, phi, a):
            extra = int(min(reach, grid.n[a] // 2 + 1))
            inside = q[(slice(None),) * a + (slice(GHOSTS, GHOSTS + grid.n[a]),)]
            width = [(extra + GHOSTS,) * 2 if a == axis else (0, 0) for axis in grid.axes]
            q = np.pad(inside, width, mode="wrap")
            n[a] += 2 * extra
    return Grid(tuple(n), grid.h), np.ascontiguousarray(q)


def _linear(grid, values, q, d, state, strides):
    front = _front(q, state)
    kernels.linear_seeds(q.ravel(), d.ravel(), state.ravel(), strides, front)
    return front


def _parted(grid, values, q, d, state, strides):
    nodes, distances = beside(grid, values.ravel())
    index = np.unravel_index(nodes, grid.shape)
    front = np.ravel_multi_index(tuple(i + WALLS for i in index), q.shape)
    d.ravel()[front], state.ravel()[front] = np.abs(distances), kernels.SEED
    return front


def _front(q, state):
    """Flat indices of the nodes with a neighbour of another sign; zero counts as negative."""
    positive, crossed = q > 0, np.zeros(q.shape, bool)
    for a in range(q.ndim):
        low, high = (slice(None),) * a + (slice(-1),), (slice(None),) * a + (slice(1, None),)
        change = (positive[low] != positive[high]) & (state[low] == kernels.FAR) & (state[high] == kernels.FAR)
        crossed[low] |= change
        crossed[high] |= change
    return np.flatnonzero(crossed)


def _march(second, band, q, d, state, strides, front):
    reach = math.inf if band is None else float(band)
    kernels.march(q.ravel(), d.ravel(), state.ravel(), strides, front, second, reach)


def _sweep(q, d, state, strides, front):
    n = np.array((1,) * (3 - q.ndim) + q.shape)
    kernels.sweep(d.ravel(), state.ravel(), n, strides, ROUNDS)
