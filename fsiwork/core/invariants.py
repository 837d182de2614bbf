"""Invariants of a surface's deformation from the backward map Y: Z₁ (area) and Z₂ (shear) of (3.38)-(3.41)."""

import numpy as np

from fsiwork.core.grid import Grid


def map_gradient(grid: Grid, Y: list[np.ndarray], nodes: np.ndarray) -> np.ndarray:
    """∇Y by central differences of fourth order, (∇Y)_ij = ∂_j Y_i, at flat indices of cells; shape (nodes, d, d).

    ``Y``: the components, flat fields at centres with two ghosts filled.
    """
    out = np.empty((nodes.size, grid.dim, grid.dim))
    for i, q in enumerate(Y):
        for j, s in enumerate(grid.strides):
            near, far = q[nodes + s] - q[nodes - s], q[nodes + 2 * s] - q[nodes - 2 * s]
            out[:, i, j] = (8.0 * near - far) / (12.0 * grid.h)
    return out


def area_and_shear(gradient: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Z₁ = √Tr Cof A and Z₂ = Tr A/(2 Z₁) at points of a surface in three dimensions; two arrays of shape (m,).

    A = B - Bn⊗Bn/(Bn·n), B = FFᵀ, F = (∇Y)⁻¹ (3.39). ``gradient``: ∇Y, shape (m, 3, 3); ``normal``: ∇φ₀ at Y, of any
    length, shape (m, 3). Z₁ ≥ 0 is the ratio of the areas, Z₂ ≥ 1 is 1 without shear.

    Raises
    ------
    numpy.linalg.LinAlgError : ∇Y is singular somewhere
    """
    F = np.linalg.inv(gradient)
    B = F @ F.transpose(0, 2, 1)
    n = np.einsum("mij,mi->mj", gradient, normal)
    n /= np.linalg.norm(n, axis=1)[:, None]
    Bn = np.einsum("mij,mj->mi", B, n)
    A = B - Bn[:, :, None] * Bn[:, None, :] / np.einsum("mi,mi->m", Bn, n)[:, None, None]
    trace = np.einsum("mii->m", A)
    cofactor = 0.5 * (trace**2 - np.einsum("mij,mji->m", A, A))
    Z1 = np.sqrt(np.maximum(cofactor, 0.0))
    return Z1, 0.5 * trace / Z1
