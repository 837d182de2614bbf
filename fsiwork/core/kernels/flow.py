"""Kernels of the staggered Navier-Stokes step. Component a sits on the low face; strides name the directions.

Every momentum kernel writes, for component ``a`` on its low faces,

    T     = -adv u·∇u_a + ν_T Δu_a                                     (kept for the next step)
    out   = base u_a + Δt (c₁ T + c₀ T_old + ν_i Δu_a - ∂_a p/ρ + f_a/ρ + g_a)

with ``k = (Δt c₁, Δt c₀, adv/h, ν_T/h², Δt ν_i/h², Δt/(ρh), Δt/ρ, Δt g_a, base)``.
``base`` 1 gives u*, 0 its increment.
"""

import numpy as np
from numba import prange

from fsiwork.core.kernels import loop, point


@point
def upwind5(v, m3, m2, m1, q, p1, p2, p3):
    """v ∂q h: the linear fifth-order upwind-biased derivative, centred part and dissipation apart."""
    centred = 0.75 * (p1 - m1) - 0.15 * (p2 - m2) + (p3 - m3) / 60.0
    smooth = ((m3 + p3) - 6.0 * (m2 + p2) + 15.0 * (m1 + p1) - 20.0 * q) / 60.0
    return v * centred - abs(v) * smooth


@loop
def momentum_upwind5_2d(out, old, ua, ub, p, f, start, n, sa, sb, k):
    """Linear upwind 5, advective form, two directions."""
    c1, c0, adv, nu_t, nu_i, dp, df, g, base = k
    for r in prange(start.size):
        I = start[r]
        q, pc, pm = ua[I : I + n], p[I : I + n], p[I - sa : I - sa + n]
        a3, a2, a1 = ua[I - 3 * sa : I - 3 * sa + n], ua[I - 2 * sa : I - 2 * sa + n], ua[I - sa : I - sa + n]
        b3, b2, b1 = ua[I - 3 * sb : I - 3 * sb + n], ua[I - 2 * sb : I - 2 * sb + n], ua[I - sb : I - sb + n]
        A1, A2, A3 = ua[I + sa : I + sa + n], ua[I + 2 * sa : I + 2 * sa + n], ua[I + 3 * sa : I + 3 * sa + n]
        B1, B2, B3 = ua[I + sb : I + sb + n], ua[I + 2 * sb : I + 2 * sb + n], ua[I + 3 * sb : I + 3 * sb + n]
        v0, v1 = ub[I : I + n], ub[I + sb : I + sb + n]
        v2, v3 = ub[I - sa : I - sa + n], ub[I - sa + sb : I - sa + sb + n]
        o, T0, F = out[I : I + n], old[I : I + n], f[I : I + n]
        for i in range(n):
            lap = A1[i] + a1[i] + B1[i] + b1[i] - 4.0 * q[i]
            v = 0.25 * ((v0[i] + v1[i]) + (v2[i] + v3[i]))
            T = nu_t * lap - adv * (
                upwind5(q[i], a3[i], a2[i], a1[i], q[i], A1[i], A2[i], A3[i])
                + upwind5(v, b3[i], b2[i], b1[i], q[i], B1[i], B2[i], B3[i])
            )
            o[i] = base * q[i] + (c1 * T + c0 * T0[i] + nu_i * lap - dp * (pc[i] - pm[i]) + df * F[i] + g)
            T0[i] = T


@loop
def momentum_upwind5_3d(out, old, ua, ub, uc, p, f, start, n, sa, sb, sc, k):
    """Linear upwind 5, advective form, three directions."""
    c1, c0, adv, nu_t, nu_i, dp, df, g, base = k
    for r in prange(start.size):
        I = start[r]
        q, pc, pm = ua[I : I + n], p[I : I + n], p[I - sa : I - sa + n]
        a3, a2, a1 = ua[I - 3 * sa : I - 3 * sa + n], ua[I - 2 * sa : I - 2 * sa + n], ua[I - sa : I - sa + n]
        b3, b2, b1 = ua[I - 3 * sb : I - 3 * sb + n], ua[I - 2 * sb : I - 2 * sb + n], ua[I - sb : I - sb + n]
        d3, d2, d1 = ua[I - 3 * sc : I - 3 * sc + n], ua[I - 2 * sc : I - 2 * sc + n], ua[I - sc : I - sc + n]
        A1, A2, A3 = ua[I + sa : I + sa + n], ua[I + 2 * sa : I + 2 * sa + n], ua[I + 3 * sa : I + 3 * sa + n]
        B1, B2, B3 = ua[I + sb : I + sb + n], ua[I + 2 * sb : I + 2 * sb + n], ua[I + 3 * sb : I + 3 * sb + n]
        D1, D2, D3 = ua[I + sc : I + sc + n], ua[I + 2 * sc : I + 2 * sc + n], ua[I + 3 * sc : I + 3 * sc + n]
        v0, v1 = ub[I : I + n], ub[I + sb : I + sb + n]
        v2, v3 = ub[I - sa : I - sa + n], ub[I - sa + sb : I - sa + sb + n]
        w0, w1 = uc[I : I + n], uc[I + sc : I + sc + n]
        w2, w3 = uc[I - sa : I - sa + n], uc[I - sa + sc : I - sa + sc + n]
        o, T0, F = out[I : I + n], old[I : I + n], f[I : I + n]
        for i in range(n):
            lap = A1[i] + a1[i] + B1[i] + b1[i] - 4.0 * q[i] + (D1[i] + d1[i] - 2.0 * q[i])
            v = 0.25 * ((v0[i] + v1[i]) + (v2[i] + v3[i]))
            w = 0.25 * ((w0[i] + w1[i]) + (w2[i] + w3[i]))
            T = nu_t * lap - adv * (
                upwind5(q[i], a3[i], a2[i], a1[i], q[i], A1[i], A2[i], A3[i])
                + upwind5(v, b3[i], b2[i], b1[i], q[i], B1[i], B2[i], B3[i])
                + upwind5(w, d3[i], d2[i], d1[i], q[i], D1[i], D2[i], D3[i])
            )
            o[i] = base * q[i] + (c1 * T + c0 * T0[i] + nu_i * lap - dp * (pc[i] - pm[i]) + df * F[i] + g)
            T0[i] = T


@point
def flux(low, mid, high, out_low, out_high):
    """h ∂(ū ū): out_* are twice the carrying velocity on the two faces of the cell around ``mid``."""
    return 0.25 * (out_high * (mid + high) - out_low * (low + mid))


@loop
def momentum_central_2d(out, old, ua, ub, p, f, start, n, sa, sb, k):
    """Central, conservative form (keeps the kinetic energy), two directions."""
    c1, c0, adv, nu_t, nu_i, dp, df, g, base = k
    for r in prange(start.size):
        I = start[r]
        q, pc, pm = ua[I : I + n], p[I : I + n], p[I - sa : I - sa + n]
        a1, A1 = ua[I - sa : I - sa + n], ua[I + sa : I + sa + n]
        b1, B1 = ua[I - sb : I - sb + n], ua[I + sb : I + sb + n]
        v0, v1 = ub[I : I + n], ub[I + sb : I + sb + n]
        v2, v3 = ub[I - sa : I - sa + n], ub[I - sa + sb : I - sa + sb + n]
        o, T0, F = out[I : I + n], old[I : I + n], f[I : I + n]
        for i in range(n):
            lap = A1[i] + a1[i] + B1[i] + b1[i] - 4.0 * q[i]
            T = nu_t * lap - adv * (
                flux(a1[i], q[i], A1[i], a1[i] + q[i], q[i] + A1[i])
                + flux(b1[i], q[i], B1[i], v0[i] + v2[i], v1[i] + v3[i])
            )
            o[i] = base * q[i] + (c1 * T + c0 * T0[i] + nu_i * lap - dp * (pc[i] - pm[i]) + df * F[i] + g)
            T0[i] = T


@loop
def momentum_central_3d(out, old, ua, ub, uc, p, f, start, n, sa, sb, sc, k):
    """Central, conservative form (keeps the kinetic energy), three directions."""
    c1, c0, adv, nu_t, nu_i, dp, df, g, base = k
    for r in prange(start.size):
        I = start[r]
        q, pc, pm = ua[I : I + n], p[I : I + n], p[I - sa : I - sa + n]
        a1, A1 = ua[I - sa : I - sa + n], ua[I + sa : I + sa + n]
        b1, B1 = ua[I - sb : I - sb + n], ua[I + sb : I + sb + n]
        d1, D1 = ua[I - sc : I - sc + n], ua[I + sc : I + sc + n]
        v0, v1 = ub[I : I + n], ub[I + sb : I + sb + n]
        v2, v3 = ub[I - sa : I - sa + n], ub[I - sa + sb : I - sa + sb + n]
        w0, w1 = uc[I : I + n], uc[I + sc : I + sc + n]
        w2, w3 = uc[I - sa : I - sa + n], uc[I - sa + sc : I - sa + sc + n]
        o, T0, F = out[I : I + n], old[I : I + n], f[I : I + n]
        for i in range(n):
            lap = A1[i] + a1[i] + B1[i] + b1[i] - 4.0 * q[i] + (D1[i] + d1[i] - 2.0 * q[i])
            T = nu_t * lap - adv * (
                flux(a1[i], q[i], A1[i], a1[i] + q[i], q[i] + A1[i])
                + flux(b1[i], q[i], B1[i], v0[i] + v2[i], v1[i] + v3[i])
                + flux(d1[i], q[i], D1[i], w0[i] + w2[i], w1[i] + w3[i])
            )
            o[i] = base * q[i] + (c1 * T + c0 * T0[i] + nu_i * lap - dp * (pc[i] - pm[i]) + df * F[i] + g)
            T0[i] = T


@loop
def gather(out, q, start, n):
    """out = q: padded rows into a compact array."""
    for r in prange(start.size):
        out[r * n : r * n + n] = q[start[r] : start[r] + n]


@loop
def scatter_sum(out, q, d, start, n):
    """out = q + d: a compact increment added to padded rows."""
    for r in prange(start.size):
        I = start[r]
        o, b, x = out[I : I + n], q[I : I + n], d[r * n : r * n + n]
        for i in range(n):
            o[i] = b[i] + x[i]


@loop
def add_laplacian(out, q, guess, start, n, strides, c):
    """out += c h² Δ(guess - q), for the difference of two passes."""
    for r in prange(start.size):
        I = start[r]
        o = out[I : I + n]
        for s in strides:
            x, lo, hi = q[I : I + n], q[I - s : I - s + n], q[I + s : I + s + n]
            y, gl, gh = guess[I : I + n], guess[I - s : I - s + n], guess[I + s : I + s + n]
            for i in range(n):
                o[i] += c * ((gl[i] + gh[i] - 2.0 * y[i]) - (lo[i] + hi[i] - 2.0 * x[i]))


@loop
def minus_divergence_2d(out, u, v, start, n, sa, sb, c):
    """out = -c h div u at centres (compact)."""
    for r in prange(start.size):
        I = start[r]
        o = out[r * n : r * n + n]
        a, A, b, B = u[I : I + n], u[I + sa : I + sa + n], v[I : I + n], v[I + sb : I + sb + n]
        for i in range(n):
            o[i] = c * ((a[i] - A[i]) + (b[i] - B[i]))


@loop
def minus_divergence_3d(out, u, v, w, start, n, sa, sb, sc, c):
    """out = -c h div u at centres (compact)."""
    for r in prange(start.size):
        I = start[r]
        o = out[r * n : r * n + n]
        a, A, b, B = u[I : I + n], u[I + sa : I + sa + n], v[I : I + n], v[I + sb : I + sb + n]
        d, D = w[I : I + n], w[I + sc : I + sc + n]
        for i in range(n):
            o[i] = c * ((a[i] - A[i]) + (b[i] - B[i]) + (d[i] - D[i]))


@loop
def correct_across(u, psi, start, here, there, n, c):
    """u -= c (ψ - ψ_low) on rows of low faces whose low neighbour is another row of the compact ψ."""
    for r in prange(start.size):
        q, hi, lo = u[start[r] : start[r] + n], psi[here[r] : here[r] + n], psi[there[r] : there[r] + n]
        for i in range(n):
            q[i] -= c * (hi[i] - lo[i])


@loop
def correct_along(u, psi, start, n, c, wrap):
    """u -= c (ψ - ψ_low) where the low neighbour lies in the same row; face 0 only if it wraps around."""
    for r in prange(start.size):
        q, x = u[start[r] : start[r] + n], psi[r * n : r * n + n]
        hi, q1 = x[1:], q[1:]
        for i in range(n - 1):
            q1[i] -= c * (hi[i] - x[i])
        if wrap:
            q[0] -= c * (x[0] - x[n - 1])


@loop
def update_pressure(p, before, psi, q, start, n, weight, gain):
    """p_before = p; p += weight ψ + gain q, with q = -div u*/Δt (compact) of the rotational form."""
    for r in prange(start.size):
        I = start[r]
        o, b, x, y = p[I : I + n], before[I : I + n], psi[r * n : r * n + n], q[r * n : r * n + n]
        for i in range(n):
            b[i] = o[i]
            o[i] += weight * x[i] + gain * y[i]


@loop
def largest(bits, start, n):
    """Largest |q| of a field seen as int64 (`q.view(np.int64)`), as bits; a NaN is the largest of all."""
    best = np.zeros(start.size, np.int64)
    for r in prange(start.size):
        x = bits[start[r] : start[r] + n]
        m = np.int64(0)
        for i in range(n):
            m = max(m, x[i] & np.int64(0x7FFFFFFFFFFFFFFF))
        best[r] = m
    return best.max()
