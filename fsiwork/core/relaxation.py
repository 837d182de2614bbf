"""Redistancing by relaxation: ∂τ φ = S (1 - |∇φ|) from φ₀ (1.36), WENO5 and SSP-RK3; and renormalisation (1.5.2).

Lengths are in cells inside: φ₀ over Δx and over its steepness at the interface, so that the scale of φ₀ never matters.
"""

import math

import numpy as np

from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import relaxation as kernels
from fsiwork.core.levelset import gradient_norm
from fsiwork.core.transport import TABLEAUX

STEP = 0.5  # Δτ/Δx: a distance travels half a cell an iteration
ITERATIONS = 20  # without a band: 10 cells on each side
SAME = 1e-6  # largest difference of repeated ghosts from their cells, in parts of the largest value
SADDLE = 0.1  # smallest slope of a crossed cell in parts of the largest difference of its corners


def pde(grid: Grid, phi: np.ndarray, band: float | None = None) -> np.ndarray:
    """(1.36) with the smoothed sign S = φ₀/√(φ₀² + |∇φ₀|²Δx²): the interface moves a little each time, to first order.

    ``band`` [cells]: as many iterations as the distance needs to travel it, values beyond it are cut; None:
    `ITERATIONS`, nothing is cut. The ghosts of each stage: wrapped where those of φ₀ are, else linear extrapolation.
    """
    return _redistance(grid, phi, band, _smoothed)


def subcell(grid: Grid, phi: np.ndarray, band: float | None = None) -> np.ndarray:
    """(1.36) with the fix of Russo and Smereka: nodes next to the interface take their distance from φ₀ alone.

    There the distance of `beside` is held in every stage (where their relaxation would end), elsewhere S = ±1.
    Arguments as for `pde`. Stable however often it is repeated: gradients at the nodes themselves are not, they
    see the smoothing on the way out and add it to the ripple of the interface.
    """
    return _redistance(grid, phi, band, _held)


def renormalised(grid: Grid, phi: np.ndarray) -> np.ndarray:
    """φ/|∇φ| (1.5.2), flat field [length]: second order near the interface, at the price of one gradient.

    At most the diagonal of the box, which stands where φ is flat and in the ghosts beyond the first layer.
    """
    slope = np.maximum(gradient_norm(grid, phi), np.abs(phi) / phi.dtype.type(math.hypot(*grid.length)))
    return np.divide(phi, slope, out=np.zeros_like(phi), where=slope > 0)


def wraps(grid: Grid, phi: np.ndarray, a: int) -> bool:
    """Whether the ghosts of a flat field in direction a repeat its cells, see `repeated`."""
    return repeated(np.moveaxis(grid.padded(phi), a, 0), grid.n[a])


def repeated(lines: np.ndarray, n: int) -> bool:
    """Whether the ghosts before and after the ``n`` cells of the first direction repeat the cells, to rounding.

    Ghosts of one value all over say nothing: False.
    """
    ghosts = np.concatenate((lines[:GHOSTS], lines[GHOSTS + n :]))
    gap = np.abs(ghosts - np.concatenate((lines[n : n + GHOSTS], lines[GHOSTS : 2 * GHOSTS]))).max()
    return bool(gap <= SAME * np.abs(ghosts).max() < np.ptp(ghosts))


def beside(grid: Grid, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Flat indices of the corners of all cells of nodes that the interface crosses, and their distances φ/|∇φ| [cells].

    |∇φ| is the mean over the crossed cells at the corner, so that both sides of a crossing see almost the same
    slope and the zero stays. Ghosts count; at most the diagonal of a cell, second order.
    """
    cells, slope = _crossed(grid, phi)
    offsets, _ = _corners(grid)
    corners = (cells[:, None] + offsets).ravel()
    count = np.bincount(corners, minlength=grid.size)
    total = np.bincount(corners, np.repeat(slope, len(offsets)), minlength=grid.size)
    nodes = np.flatnonzero(count)
    reach = math.sqrt(grid.dim)
    return nodes, np.clip(phi[nodes] * (count[nodes] / total[nodes]), -reach, reach)


def _redistance(grid, phi, band, begin):
    if not np.isfinite(phi).all():
        return np.full_like(phi, np.nan)
    edges = Edges(grid, tuple((Side("periodic" if wraps(grid, phi, a) else "outflow"),) * 2 for a in grid.axes))
    q = phi.astype(np.float64)
    _, slope = _crossed(grid, q)
    steep = np.median(slope) if slope.size else np.abs(q).max()
    if steep > 0:
        q /= steep
    q, sign = begin(grid, q)
    q = _iterate(grid, edges, q, sign, ITERATIONS if band is None else math.ceil(band / STEP) + 2)
    if band is not None:
        np.clip(q, -band, band, out=q)
    q *= grid.h
    return q.astype(phi.dtype, copy=False)


def _corners(grid):
    """Flat offsets of the corners of the cell of nodes that starts at a node, and their places 0 or 1 on each axis."""
    places = np.array(list(np.ndindex((2,) * grid.dim)))
    return places @ np.array(grid.strides), places


def _crossed(grid, q):
    """Flat indices (of the low corner) of the cells of nodes with corners of different sign, and |∇q|Δx in them.

    In a saddle, whose mean gradient vanishes, the steepest of its differences counts.
    """
    offsets, places = _corners(grid)
    signs = np.sign(grid.padded(q))
    uneven = np.zeros([k - 1 for k in grid.shape], bool)
    low = signs[(slice(-1),) * grid.dim]
    for place in places[1:]:
        uneven |= signs[tuple(slice(p, k - 1 + p) for p, k in zip(place, grid.shape, strict=True))] != low
    cells = np.ravel_multi_index(np.nonzero(uneven), grid.shape)
    values = q[cells[:, None] + offsets]
    mean = 2 * (2 * places - 1.0) / len(offsets)
    slope = np.sqrt(((values @ mean) ** 2).sum(axis=1))
    return cells, np.maximum(slope, SADDLE * np.ptp(values, axis=1))


def _smoothed(grid, q):
    width = np.hypot(q, grid.h * gradient_norm(grid, q))
    return q, np.divide(q, width, out=np.zeros_like(q), where=width > 0)


def _held(grid, q):
    nodes, distances = beside(grid, q)
    q, sign = q.copy(), np.sign(q)
    q[nodes], sign[nodes] = distances, 0.0
    return q, sign


def _iterate(grid, edges, q, sign, iterations):
    start, n = grid.rows()
    strides = np.array(grid.strides)
    edges.fill_scalar(q, "linear")
    base, a, b = q, np.empty_like(q), np.empty_like(q)
    for _ in range(iterations):
        old = base
        for new, (c, d) in zip((a, b, a), TABLEAUX["ssp-rk3"], strict=True):
            kernels.stage(new, base, old, sign, start, n, strides, np.array([c, d, STEP]))
            edges.fill_scalar(new, "linear")
            old = new
        base, a = a, base
    return base
