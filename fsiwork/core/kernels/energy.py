"""Sums for the energy law (3.23): kinetic energy, dissipation, work of a body force. One partial sum a row, added in
order, so that the result does not depend on the number of threads."""

import numpy as np
from numba import prange

from fsiwork.core.kernels import loop


@loop
def squares(q, start, n, s):
    """Σ over cells of q² + q_high² of a face field: each face inside twice, a boundary face once."""
    total = np.zeros(start.size)
    for r in prange(start.size):
        I = start[r]
        x, y = q[I : I + n], q[I + s : I + s + n]
        t = 0.0
        for i in range(n):
            t += x[i] * x[i] + y[i] * y[i]
        total[r] = t
    return total.sum()


@loop
def weighted_squares(q, rho, start, n, s):
    """Σ over cells of ρ (q² + q_high²) of a face field."""
    total = np.zeros(start.size)
    for r in prange(start.size):
        I = start[r]
        x, y, w = q[I : I + n], q[I + s : I + s + n], rho[I : I + n]
        t = 0.0
        for i in range(n):
            t += w[i] * (x[i] * x[i] + y[i] * y[i])
        total[r] = t
    return total.sum()


@loop
def weighted_sum(q, rho, start, n, s):
    """Σ over cells of ρ (q + q_high) of a face field."""
    total = np.zeros(start.size)
    for r in prange(start.size):
        I = start[r]
        x, y, w = q[I : I + n], q[I + s : I + s + n], rho[I : I + n]
        t = 0.0
        for i in range(n):
            t += w[i] * (x[i] + y[i])
        total[r] = t
    return total.sum()


@loop
def normal_strain(q, mu, start, n, s):
    """Σ over cells of 2μ (h ∂_a u_a)²."""
    total = np.zeros(start.size)
    for r in prange(start.size):
        I = start[r]
        x, y, m = q[I : I + n], q[I + s : I + s + n], mu[I : I + n]
        t = 0.0
        for i in range(n):
            t += 2.0 * m[i] * (y[i] - x[i]) ** 2
        total[r] = t
    return total.sum()


@loop
def shear_strain(ua, ub, mu, start, n, sa, sb):
    """Σ over cells of μ times the mean over the cell's four ab-edges of (h ∂_b u_a + h ∂_a u_b)².

    An edge inside counts in four cells, on a side of the box in two: the weights of the discrete energy identity.
    """
    total = np.zeros(start.size)
    for r in prange(start.size):
        I = start[r]
        m = mu[I : I + n]
        t = 0.0
        for J in (I, I + sa, I + sb, I + sa + sb):
            x, xl, y, yl = ua[J : J + n], ua[J - sb : J - sb + n], ub[J : J + n], ub[J - sa : J - sa + n]
            for i in range(n):
                t += 0.25 * m[i] * ((x[i] - xl[i]) + (y[i] - yl[i])) ** 2
        total[r] = t
    return total.sum()
