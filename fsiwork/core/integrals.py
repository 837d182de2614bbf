"""Length of the line φ = 0 of a plane field, by regularised, unregularised and geometric measures; area inside it.

All take a flat padded field with its three ghosts filled (see `fsiwork.core.grid.Grid`); the nodes are the cell
centres. The measures are for scale: any φ with the right zero line. A field that is not finite gives NaN.
"""

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from fsiwork.core import levelset
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import batches, heights, integrals, volumes


def _plane(grid: Grid, phi: np.ndarray) -> np.ndarray:
    if grid.dim != 2:
        raise ValueError(f"lengths are those of lines in the plane, got {grid.dim} directions")
    return np.ascontiguousarray(grid.padded(phi), dtype=np.float64)


def smeared(grid: Grid, phi: np.ndarray, eps: float, kind: str = "cosine", scaling: str = "plain") -> float:
    """Length [length] or area [length²] of φ = 0 as Σ D_ε|∇φ| h^d over the box; words and ``eps`` of `levelset.dirac`.

    Second order in ε (1.24), as long as the sum resolves it. NaN if φ is not finite.
    """
    if not np.isfinite(phi).all():
        return math.nan
    density = levelset.dirac(phi, eps, kind, scaling, grid) * levelset.gradient_norm(grid, phi)
    return float(grid.inside(density).sum() * grid.cell_volume)


def line_integral(grid: Grid, phi: tuple[np.ndarray, np.ndarray], eps: float, kind: str = "cosine") -> float:
    """Length [length] of the curve φ¹ = φ² = 0 in space as Σ ε⁻² ζ(φ¹/ε) ζ(φ²/ε) |∇φ¹ × ∇φ²| h³ over the box (1.4).

    ``eps`` in units of both φ, flat fields with one ghost filled. NaN if one of them is not finite. Raises ValueError
    unless in space, or for an unknown ``kind``.
    """
    if grid.dim != 3:
        raise ValueError(f"curves are cut out of space by two fields, got {grid.dim} directions")
    if not all(np.isfinite(q).all() for q in phi):
        return math.nan
    start, n = grid.rows()
    density = levelset.dirac(phi[0], eps, kind) * levelset.dirac(phi[1], eps, kind)
    inside = np.add.outer(start, np.arange(n)).ravel()
    near = inside[density[inside] > 0]
    first, second = (np.stack([q[near + s] - q[near - s] for s in grid.strides]) for q in phi)
    cross = np.linalg.norm(np.cross(first, second, axis=0), axis=0) / (2 * grid.h) ** 2
    return float((density[near] * cross).sum() * grid.cell_volume)


def _dirac(kind: str, scaling: str, cells: float) -> Callable[[Grid, np.ndarray], float]:
    def length(grid: Grid, phi: np.ndarray) -> float:
        return smeared(grid, _plane(grid, phi).ravel(), cells * grid.h, kind, scaling)

    return length


def _sum(kernel, *order: int) -> Callable[[Grid, np.ndarray], float]:
    def length(grid: Grid, phi: np.ndarray) -> float:
        q = _plane(grid, phi)
        return float(kernel(q, GHOSTS, grid.h, *order)) if np.isfinite(q).all() else math.nan

    return length


def _heights(grid: Grid, phi: np.ndarray) -> float:
    return length_and_area(grid, phi)[0]


METHODS: dict[str, Callable[[Grid, np.ndarray], float]] = {
    "plain": _dirac("cosine", "plain", 1.5),
    "renormalised": _dirac("cosine", "renormalised", 1.5),
    "one-norm": _dirac("hat", "one-norm", 1.0),
    "smereka-1": _sum(integrals.smereka, 1),
    "smereka-2": _sum(integrals.smereka, 2),
    "towers-laplacian": _sum(integrals.towers_laplacian),
    "towers-gradient": _sum(integrals.towers_gradient),
    "marching-squares": _sum(integrals.marching_squares),
    "geometric": _heights,
}
"""Length [length] of φ = 0 by name: D_ε|∇φ| plain, renormalised (ε = 1.5 Δx, cosine) and scaled with the 1-norm (hat,
ε = Δx) of 1.5.2; Smereka's measures (1.5.3); Towers' two (1.5.4, corrected); marching squares; height functions."""


def length(grid: Grid, phi: np.ndarray, method: str = "geometric") -> float:
    """Length of φ = 0 [length] by one of `METHODS`. Raises ValueError for another, or outside the plane."""
    if method not in METHODS:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, got {method!r}")
    return METHODS[method](grid, phi)


@cache
def _scratch() -> np.ndarray:
    """Kept: gauges are taken every step."""
    return np.empty(batches.ROOM)


def length_and_area(grid: Grid, phi: np.ndarray) -> tuple[float, float]:
    """Length of φ = 0 [length] and area of φ < 0 [length²], sixth order where φ is smooth.

    In the box and no further: exact across a periodic side; beside others as good as the ghosts of φ, of which all
    three are read. Raises ValueError outside the plane.
    """
    line, area = heights.length_and_area(_plane(grid, phi), GHOSTS - 1, grid.h, _scratch())
    return float(line), float(area)


def area_and_volume(grid: Grid, phi: np.ndarray) -> tuple[float, float]:
    """Area of the surface φ = 0 [length²] and volume of φ < 0 [length³], sixth order where φ is smooth.

    In the box and no further; φ is read in all three ghosts. Raises ValueError unless in space.
    """
    if grid.dim != 3:
        raise ValueError(f"areas are those of surfaces in space, got {grid.dim} directions")
    q = np.ascontiguousarray(grid.padded(phi), dtype=np.float64)
    surface, volume = volumes.area_and_volume(q, GHOSTS - 1, grid.h)
    return float(surface), float(volume)
