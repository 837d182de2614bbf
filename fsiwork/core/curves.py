"""Curves in space in which the level surfaces of two functions meet: frame, curvature, torsion, (1.17) to (1.21)."""

from typing import NamedTuple

import numpy as np

from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import curves as kernels

STRAIGHT = 1e-6  # of 1/h: curvature below which a curve has no normal; differences of τ in round-off are far smaller


class Frenet(NamedTuple):
    """Frame τ, n, b, shape (3, 3, m): vector, component, point; curvature H ≥ 0, torsion [1/length], shape (m,)."""

    frame: np.ndarray
    curvature: np.ndarray
    torsion: np.ndarray


def frenet(grid: Grid, phi1: np.ndarray, phi2: np.ndarray, nodes: np.ndarray, order: int = 2) -> Frenet:
    """Of the curve φ¹ = const, φ² = const through each node: τ along ∇φ¹ × ∇φ², n to the centre, b = τ × n.

    Flat fields with their ghosts filled; ``nodes`` flat indices of cells, shape (m,), with 3 (``order`` 2) or 6 (4)
    cells or ghosts on every side. A right-handed helix has positive torsion, whichever way τ goes. n, b and torsion
    are 0 where the curve is straight (H below 1e-6/h), all of it where the surfaces do not cross. Any scale of the
    fields is right. Raises ValueError in the plane, for another order or for nodes too near to the side.
    """
    return _frame(_jets(grid, phi1, phi2, nodes, order), grid.h)


def _jets(grid: Grid, phi1: np.ndarray, phi2: np.ndarray, nodes: np.ndarray, order: int) -> np.ndarray:
    """τ, Hn and ∇(Hn)τ at nodes, shape (3, 3, m)."""
    if grid.dim != 3:
        raise ValueError("a curve in space needs three directions")
    if order not in (2, 4):
        raise ValueError(f"order must be 2 or 4, got {order!r}")
    place, reach = np.array(np.unravel_index(nodes, grid.shape)), 3 * order // 2
    if (place < reach).any() or (place >= np.reshape(grid.shape, (3, 1)) - reach).any():
        raise ValueError(f"nodes must have {reach} neighbours on every side for order {order}")
    found = np.empty((3, 3, np.size(nodes)))
    kernels.jets(found, phi1, phi2, np.ascontiguousarray(nodes), *grid.strides, 0.5 / grid.h, order == 4)
    return found


def frenet_at(grid: Grid, phi1: np.ndarray, phi2: np.ndarray, points: np.ndarray, order: int = 2) -> Frenet:
    """The same at points, shape (3, m) [length]: from cubic interpolation of τ, Hn and ∇(Hn)τ over the 4³ nodes around.

    Raises ValueError for points too near to the side of the box, as `frenet`.
    """
    place = (points - np.reshape(grid.origin, (3, 1))) / grid.h - 0.5
    base = np.floor(place).astype(np.int64)
    if (base < 1).any() or (base > np.reshape(grid.n, (3, 1)) - 3).any():
        raise ValueError("points must lie two cells and more inside the box")
    weights = _cubic(place - base)
    offsets = np.indices((4, 4, 4)).reshape(3, -1)
    strides = np.array(grid.strides)
    near = strides @ (base + GHOSTS - 1) + (strides @ offsets)[:, None]  # (64, m)
    weight = np.prod([weights[offsets[a], a] for a in range(3)], axis=0)
    nodes, back = np.unique(near, return_inverse=True)
    back = back.reshape(near.shape)
    jets = _jets(grid, phi1, phi2, nodes, order)
    return _frame(np.einsum("jckm,km->jcm", jets[..., back], weight), grid.h)


def _frame(jet: np.ndarray, h: float) -> Frenet:
    """(1.17) to (1.21) from τ, Hn and ∇(Hn)τ. The torsion (∇n)τ · b is ∇(Hn)τ · Hb / H²: the rest of it is along n."""
    tangent, bend, rate = jet
    bend = bend - (bend * tangent).sum(0) * tangent  # the rest is 0 but for the differences
    binormal = np.cross(tangent, bend, axis=0)
    square = (bend * bend).sum(0)
    curved = square > (STRAIGHT / h) ** 2
    inverse = np.divide(1.0, np.sqrt(square), where=curved, out=np.where(square >= 0, 0.0, np.nan))
    torsion = (rate * binormal).sum(0) * inverse**2
    return Frenet(np.stack([tangent, bend * inverse, binormal * inverse]), np.sqrt(square), torsion)


def _cubic(s: np.ndarray) -> np.ndarray:
    """Lagrange's weights of the nodes -1, 0, 1, 2 at s in [0, 1], shape (4, ...)."""
    return np.stack(
        [
            -s * (s - 1) * (s - 2) / 6,
            (s + 1) * (s - 1) * (s - 2) / 2,
            -(s + 1) * s * (s - 2) / 2,
            (s + 1) * s * (s - 1) / 6,
        ]
    )
