"""Level-set functions at cell centres: regularised indicator and Dirac, slope, normal, curvature.

All take and return flat padded fields (see `fsiwork.core.grid.Grid`). φ < 0 inside, n = ∇φ/|∇φ| outward,
H = div n: 1/R for a disc, 2/R for a ball. The geometry is second order, of central differences, on the cells
and one ghost layer around them (φ needs two filled ghosts); elsewhere ``out`` is left as it was (0 when new).
"""

from typing import Literal

import numpy as np

from fsiwork.core.grid import Grid
from fsiwork.core.kernels import levelset as kernels


def heaviside(phi: np.ndarray, eps: float, out: np.ndarray | None = None) -> np.ndarray:
    """H_ε(φ) = ℋ(φ/ε), 0 inside and 1 outside, of half-width ε/|∇φ|, ghosts included.

    ``eps`` in units of φ. ℋ(r) = (1 + r + sin(πr)/π)/2, so that ℋ' = ζ of `dirac` (cosine, plain).
    """
    out = np.empty_like(phi) if out is None else out
    kernels.heaviside(out, phi, phi.dtype.type(eps))
    return out


def dirac(
    phi: np.ndarray,
    eps: float,
    kind: Literal["cosine", "hat"] = "cosine",
    scaling: Literal["plain", "renormalised", "one-norm"] = "plain",
    grid: Grid | None = None,
    out: np.ndarray | None = None,
) -> np.ndarray:
    """D_ε = ζ(φ/w)/w, the factor of δ_Γ ≈ D_ε |∇φ| (1.24).

    ``plain``: w = ε, of half-width ε/|∇φ| in space, all ghosts included. ``renormalised``: w = ε|∇φ|, of
    half-width ε [length] whatever the slope. ``one-norm``: w = ε|∇φ|₁, with the hat the choice that keeps the
    mass of an inclined line exact; half-width between ε and √d ε. These two need ``grid``.
    ``kind``: ζ is (1 + cos πr)/2 or 1 - |r|.

    Raises
    ------
    ValueError : unknown kind or scaling, or no grid where one is needed
    """
    if kind not in ("cosine", "hat"):
        raise ValueError(f"kind must be cosine or hat, got {kind!r}")
    if scaling not in ("plain", "renormalised", "one-norm"):
        raise ValueError(f"scaling must be plain, renormalised or one-norm, got {scaling!r}")
    eps = phi.dtype.type(eps)
    if scaling == "plain":
        out = np.empty_like(phi) if out is None else out
        (kernels.dirac_cosine if kind == "cosine" else kernels.dirac_hat)(out, phi, eps)
        return out
    if grid is None:
        raise ValueError(f"{scaling} scaling needs the grid")
    out = np.zeros_like(phi) if out is None else out
    _slope(kernels.slope if scaling == "renormalised" else kernels.slope_one, grid, phi, out)
    (kernels.dirac_cosine_scaled if kind == "cosine" else kernels.dirac_hat_scaled)(out, phi, eps)
    return out


def gradient(grid: Grid, phi: np.ndarray, out: list[np.ndarray] | None = None) -> list[np.ndarray]:
    """∇φ at centres, one flat field a direction [φ/length]."""
    out = [np.zeros_like(phi) for _ in grid.axes] if out is None else out
    for o, s in zip(out, grid.strides, strict=True):
        kernels.central(o, phi, *grid.rows(1, 1), s, phi.dtype.type(0.5 / grid.h))
    return out


def gradient_norm(grid: Grid, phi: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
    """|∇φ| at centres: the stretch of an incompressible membrane."""
    out = np.zeros_like(phi) if out is None else out
    _slope(kernels.slope, grid, phi, out)
    return out


def normal(grid: Grid, phi: np.ndarray, out: list[np.ndarray] | None = None) -> list[np.ndarray]:
    """n = ∇φ/|∇φ| at centres, one flat field a direction; 0 where φ is flat."""
    out = gradient(grid, phi, out)
    length = gradient_norm(grid, phi)
    for o in out:
        kernels.divide(o, length, *grid.rows(1, 1), np.finfo(phi.dtype).tiny)
    return out


def curvature(grid: Grid, phi: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
    """H = div n at centres [1/length] from first and second differences (1.9); 0 where φ is flat, clipped nowhere."""
    out = np.zeros_like(phi) if out is None else out
    number = phi.dtype.type
    kernels.curvature(out, phi, *grid.rows(1, 1), *_strides(grid), number(1 / grid.h), np.finfo(phi.dtype).tiny)
    return out


def _strides(grid: Grid) -> tuple[int, int, int]:
    return (*grid.strides, 0)[:3]


def _slope(kernel, grid: Grid, phi: np.ndarray, out: np.ndarray) -> None:
    kernel(out, phi, *grid.rows(1, 1), *_strides(grid), phi.dtype.type(0.5 / grid.h))
