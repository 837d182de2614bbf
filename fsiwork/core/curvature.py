"""Mean and Gaussian curvature of surfaces in three dimensions (7.1), their exact values on two of them, ½∫H²."""

import numpy as np

from fsiwork.core.closest import quintic
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import curvature as kernels


def curvatures(
    grid: Grid, phi: np.ndarray, order: int = 2, nodes: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """H = div n [1/length] and G = det ∇n on the surface [1/length²] of the level surface through each node.

    ``phi`` flat with its ghosts filled; ``nodes`` flat indices of cells, by default all of them; two arrays of their
    shape. ``order`` 2 or 4: central differences over one or two neighbours. 0 where φ is flat. A ball of radius R has
    H = 2/R and G = 1/R², whatever the scale of φ.

    Raises
    ------
    ValueError : another order, or a grid in the plane
    """
    if grid.dim != 3:
        raise ValueError("surfaces need three directions; in the plane there is levelset.curvature")
    if order not in (2, 4):
        raise ValueError(f"order must be 2 or 4, got {order!r}")
    if nodes is None:
        start, n = grid.rows()
        nodes = np.add.outer(start, np.arange(n)).ravel()
    mean, gauss = np.empty(nodes.size, phi.dtype), np.empty(nodes.size, phi.dtype)
    number = phi.dtype.type
    tiny = np.finfo(phi.dtype).tiny
    kernels.curvatures(mean, gauss, phi, nodes, *grid.strides, number(1 / grid.h), order == 4, tiny)
    return mean, gauss


def of_torus(radius: float, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """H and G at points, of the torus through each whose tube's middle is the circle of ``radius`` about z [length]."""
    q = np.hypot(x, y)
    d = np.hypot(z, radius - q)
    return (2 - radius / q) / d, (1 - radius / q) / d**2


def of_ellipsoid(semi_axes: tuple[float, float, float], *x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """H and G at points, of the level surface of Σ x²/a² through each, with half-axes ``semi_axes`` [length]."""
    square = [a * a for a in semi_axes]
    part = [c * c / s for c, s in zip(x, square, strict=True)]
    slope = sum(p / s for p, s in zip(part, square, strict=True))
    volume = square[0] * square[1] * square[2]
    mean = sum(p * (sum(square) - s) for p, s in zip(part, square, strict=True))
    return mean / (volume * slope**1.5), sum(part) / (volume * slope**2)


def shifted(mean: np.ndarray, gauss: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """H and G of the parallel surface at a signed ``distance`` along n from a surface with ``mean`` and ``gauss``."""
    scale = 1 + distance * mean + distance**2 * gauss
    return (mean + 2 * distance * gauss) / scale, gauss / scale


def willmore(grid: Grid, phi: np.ndarray, cells: float = 2.0) -> tuple[float, float]:
    """½∫H² over the surface φ = 0 in the box, and its area [length²], from nodes within ``cells`` of it.

    φ flat, ghosts filled, of any scale. Curvatures of the distance's level surfaces are taken back to φ = 0, of which
    each node stands for D(d)/(1 + dH + d²G) h³, D a cosine: exact but for the sum and for fourth-order differences,
    whatever ε a body has. A ball has 8π. Surfaces must lie more than ``cells`` + 2 cells from their medial axis.
    """
    d = quintic(grid, phi, cells + 3)
    start, n = grid.rows()
    nodes = np.add.outer(start, np.arange(n)).ravel()
    nodes = nodes[np.abs(d[nodes]) < cells * grid.h]
    away = d[nodes]
    mean, gauss = shifted(*curvatures(grid, d, 4, nodes), -away)
    share = 0.5 * (1 + np.cos(np.pi * away / (cells * grid.h))) / (cells * grid.h) * grid.cell_volume
    share = share / (1 + away * mean + away**2 * gauss)
    return float((0.5 * share * mean**2).sum()), float(share.sum())
