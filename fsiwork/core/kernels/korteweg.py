"""Normal part of the Korteweg form of a membrane's force (3.24), (3.27); its shear part is that of `kernels.membrane`.

Arguments as there, and its point formulas.
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH
from fsiwork.core.kernels.membrane import TINY, dirac, tension

loop = njit(parallel=True, error_model="numpy", fastmath=FASTMATH - {"reassoc"}, cache=True)


@loop
def normal_stress(out, phi, runs, s, kind, numbers, given):
    """-Σ_aa = -(E'/|∇φ|) (∂_aφ)² D_ε at centres, by central differences; a is the direction of s[0]."""
    a, b, c = s[0], s[1], s[2]
    h, eps, renormalised, lam = numbers[0], numbers[1], numbers[2] > 0.0, numbers[3]
    k = 0.5 / h
    for r in prange(runs.shape[0]):
        I, n, o = runs[r, 0], runs[r, 1], runs[r, 2]
        T, p, e1 = out[I : I + n], phi[I:], given[o:]
        ae, aw, be, bw, ce, cw = phi[I + a :], phi[I - a :], phi[I + b :], phi[I - b :], phi[I + c :], phi[I - c :]
        for i in range(n):
            ga, gb, gc = k * (ae[i] - aw[i]), k * (be[i] - bw[i]), k * (ce[i] - cw[i])
            g = np.sqrt(ga * ga + (gb * gb + gc * gc) + TINY)
            E1 = tension(kind, lam, g, e1[i] if kind == 2 else 0.0)
            T[i] = -E1 / g * ga * ga * dirac(p[i], g, eps, renormalised)


@loop
def add_difference(out, T, runs, a, h):
    """out_a += ∂_a T on low faces of a, T at centres."""
    k = 1.0 / h
    for r in prange(runs.shape[0]):
        I, n = runs[r, 0], runs[r, 1]
        q, e, w = out[I : I + n], T[I:], T[I - a :]
        for i in range(n):
            q[i] += k * (e[i] - w[i])
