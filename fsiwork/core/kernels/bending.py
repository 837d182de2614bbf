"""Resistance to bending (3.2.4): k[Δ_ΓH + ½H(H² - 4G)], its divergence form, and its energy.

Arguments as in `kernels.membrane`: ``runs`` are pieces of rows, ``s`` three strides, the third 0 in the plane, where G
and all differences along it vanish: one source for curves and surfaces. All at centres from central differences.
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, point
from fsiwork.core.kernels.membrane import TINY, dirac

loop = njit(parallel=True, error_model="numpy", fastmath=FASTMATH - {"reassoc"}, cache=True)


@point
def gradient(q, I, a, b, c, h):
    """∂_a q, ∂_b q, ∂_c q at a centre."""
    k = 0.5 / h
    return k * (q[I + a] - q[I - a]), k * (q[I + b] - q[I - b]), k * (q[I + c] - q[I - c])


@point
def hessian(q, I, a, b, c, h):
    """Second derivatives aa, bb, cc, ab, ac, bc at a centre."""
    k, x, twice = 1.0 / (h * h), 0.25 / (h * h), 2.0 * q[I]
    return (
        k * (q[I + a] + q[I - a] - twice),
        k * (q[I + b] + q[I - b] - twice),
        k * (q[I + c] + q[I - c] - twice),
        x * ((q[I + a + b] + q[I - a - b]) - (q[I + a - b] + q[I - a + b])),
        x * ((q[I + a + c] + q[I - a - c]) - (q[I + a - c] + q[I - a + c])),
        x * ((q[I + b + c] + q[I - b - c]) - (q[I + b - c] + q[I - b + c])),
    )


@point
def across(g, d):
    """Σ (|g|² δ_ij - g_i g_j) d_ij of a gradient g and second derivatives d."""
    square = (d[1] + d[2]) * g[0] * g[0] + (d[0] + d[2]) * g[1] * g[1] + (d[0] + d[1]) * g[2] * g[2]
    return square - 2.0 * (d[3] * g[0] * g[1] + d[4] * g[0] * g[2] + d[5] * g[1] * g[2])


@loop
def mean_curvature(H, P, phi, runs, s, h):
    """H = div n, at most 2/h in size, and P = H|∇φ|."""
    a, b, c, top = s[0], s[1], s[2], 2.0 / h
    for r in prange(runs.shape[0]):
        for I in range(runs[r, 0], runs[r, 0] + runs[r, 1]):
            g = gradient(phi, I, a, b, c, h)
            g2 = g[0] * g[0] + g[1] * g[1] + g[2] * g[2] + TINY
            size = np.sqrt(g2)
            H[I] = max(-top, min(top, across(g, hessian(phi, I, a, b, c, h)) / (g2 * size)))
            P[I] = H[I] * size


@loop
def resistance(out, H, phi, runs, s, h, k):
    """out = k[Δ_ΓH + ½H(H² - 4G)] from φ and its mean curvature; Δ_Γf = (I - nn):∇∇f - H n·∇f."""
    a, b, c = s[0], s[1], s[2]
    for r in prange(runs.shape[0]):
        for I in range(runs[r, 0], runs[r, 0] + runs[r, 1]):
            g, d = gradient(phi, I, a, b, c, h), hessian(phi, I, a, b, c, h)
            g2 = g[0] * g[0] + g[1] * g[1] + g[2] * g[2] + TINY
            cofactor = (
                g[0] * g[0] * (d[1] * d[2] - d[5] * d[5])
                + g[1] * g[1] * (d[0] * d[2] - d[4] * d[4])
                + g[2] * g[2] * (d[0] * d[1] - d[3] * d[3])
                + 2.0 * g[0] * g[1] * (d[4] * d[5] - d[3] * d[2])
                + 2.0 * g[0] * g[2] * (d[3] * d[5] - d[4] * d[1])
                + 2.0 * g[1] * g[2] * (d[3] * d[4] - d[5] * d[0])
            )
            G = cofactor / (g2 * g2)
            f = gradient(H, I, a, b, c, h)
            along = (g[0] * f[0] + g[1] * f[1] + g[2] * f[2]) / np.sqrt(g2)
            spread = across(g, hessian(H, I, a, b, c, h)) / g2 - H[I] * along
            out[I] = k * (spread + 0.5 * H[I] * (H[I] * H[I] - 4.0 * G))


@point
def face_gradient(q, I, a, b, c, h):
    """∂_a q, ∂_b q, ∂_c q on the low face of a."""
    k = 0.25 / h
    return (
        (q[I] - q[I - a]) / h,
        k * ((q[I + b] - q[I - b]) + (q[I - a + b] - q[I - a - b])),
        k * ((q[I + c] - q[I - c]) + (q[I - a + c] - q[I - a - c])),
    )


@loop
def flux(V, H, P, phi, runs, s, h, k):
    """V_a = -½kH² n_a + (k/|∇φ|)(∇_ΓP)_a on low faces of a = s[0]: the divergence form is q = div V."""
    a, b, c = s[0], s[1], s[2]
    for r in prange(runs.shape[0]):
        for I in range(runs[r, 0], runs[r, 0] + runs[r, 1]):
            g, f = face_gradient(phi, I, a, b, c, h), face_gradient(P, I, a, b, c, h)
            g2 = g[0] * g[0] + g[1] * g[1] + g[2] * g[2] + TINY
            along, mean = (g[0] * f[0] + g[1] * f[1] + g[2] * f[2]) / g2, 0.5 * (H[I] + H[I - a])
            V[I] = k * (f[0] - g[0] * (along + 0.5 * mean * mean)) / np.sqrt(g2)


@loop
def add_divergence(out, V, runs, a, h):
    """out += ∂_a V_a at centres."""
    for r in prange(runs.shape[0]):
        for I in range(runs[r, 0], runs[r, 0] + runs[r, 1]):
            out[I] += (V[I + a] - V[I]) / h


@loop
def push(force, q, phi, runs, s, h, eps, renormalised):
    """F_a += q D_ε ∂_aφ on low faces of a = s[0]."""
    a, b, c = s[0], s[1], s[2]
    for r in prange(runs.shape[0]):
        for I in range(runs[r, 0], runs[r, 0] + runs[r, 1]):
            g = face_gradient(phi, I, a, b, c, h)
            size = np.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2] + TINY)
            D = dirac(0.5 * (phi[I] + phi[I - a]), size, eps, renormalised)
            force[I] += 0.5 * (q[I] + q[I - a]) * D * g[0]


@loop
def energies(out, H, phi, runs, s, h, eps, renormalised):
    """out[r] = Σ ½H²|∇φ| D_ε over a run."""
    a, b, c = s[0], s[1], s[2]
    for r in prange(runs.shape[0]):
        total = 0.0
        for I in range(runs[r, 0], runs[r, 0] + runs[r, 1]):
            g = gradient(phi, I, a, b, c, h)
            size = np.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2] + TINY)
            total += 0.5 * H[I] * H[I] * size * dirac(phi[I], size, eps, renormalised)
        out[r] = total
