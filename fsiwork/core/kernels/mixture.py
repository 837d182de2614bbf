"""Kernels of variable density and viscosity: 2μD(u) on the staggered grid and the coefficients of its implicit part.

μ and ρ are flat centre fields; at edges (corners, in the plane of two directions) the mean of four centres is taken.
"""

from numba import prange

from fsiwork.core.kernels import loop


@loop
def inverse_density(beta, rho, start, n, s):
    """β = 2/(ρ + ρ_low) on the low faces."""
    for r in prange(start.size):
        I = start[r]
        o, hi, lo = beta[I : I + n], rho[I : I + n], rho[I - s : I - s + n]
        for i in range(n):
            o[i] = 2.0 / (hi[i] + lo[i])


@loop
def add_viscous_normal(f, ua, mu, start, n, s, c):
    """f += c ∂_a(2μ ∂_a u_a) on the low faces; μ at centres, c = 1/h²."""
    for r in prange(start.size):
        I = start[r]
        o, q, lo, hi = f[I : I + n], ua[I : I + n], ua[I - s : I - s + n], ua[I + s : I + s + n]
        m, ml = mu[I : I + n], mu[I - s : I - s + n]
        for i in range(n):
            o[i] += 2.0 * c * (m[i] * (hi[i] - q[i]) - ml[i] * (q[i] - lo[i]))


@loop
def add_viscous_tangential(f, ua, ub, mu, start, n, sa, sb, c):
    """f += c ∂_b(μ (∂_b u_a + ∂_a u_b)) on the low faces of a; μ averaged to the edges, c = 1/h²."""
    for r in prange(start.size):
        I = start[r]
        o, q, lo, hi = f[I : I + n], ua[I : I + n], ua[I - sb : I - sb + n], ua[I + sb : I + sb + n]
        v, va, w, wa = (
            ub[I : I + n],
            ub[I - sa : I - sa + n],
            ub[I + sb : I + sb + n],
            ub[I - sa + sb : I - sa + sb + n],
        )
        m, ma, ml = mu[I : I + n], mu[I - sa : I - sa + n], mu[I - sb : I - sb + n]
        mla, mh, mha = mu[I - sa - sb : I - sa - sb + n], mu[I + sb : I + sb + n], mu[I - sa + sb : I - sa + sb + n]
        for i in range(n):
            low = 0.25 * (m[i] + ma[i] + ml[i] + mla[i]) * ((q[i] - lo[i]) + (v[i] - va[i]))
            high = 0.25 * (m[i] + ma[i] + mh[i] + mha[i]) * ((hi[i] - q[i]) + (w[i] - wa[i]))
            o[i] += c * (high - low)


@loop
def accelerate(f, p, beta, start, n, s, c):
    """f = β (f - c (p - p_low)): a force per volume becomes an acceleration on the low faces, c = 1/h."""
    for r in prange(start.size):
        I = start[r]
        o, b, hi, lo = f[I : I + n], beta[I : I + n], p[I : I + n], p[I - s : I - s + n]
        for i in range(n):
            o[i] = b[i] * (o[i] - c * (hi[i] - lo[i]))


@loop
def correct_weighted(u, psi, beta, start, n, s, c):
    """u -= c β (ψ - ψ_low) with padded ψ and a padded coefficient on the low faces."""
    for r in prange(start.size):
        I = start[r]
        q, hi, lo, b = u[I : I + n], psi[I : I + n], psi[I - s : I - s + n], beta[I : I + n]
        for i in range(n):
            q[i] -= c * b[i] * (hi[i] - lo[i])


@loop
def momentum_balance(f, diagonal, increment, beta, start, n):
    """d = 1/β = ρ on the faces and f = ρ times an increment (both compact)."""
    for r in prange(start.size):
        I = start[r]
        o, d, x, b = f[r * n : r * n + n], diagonal[r * n : r * n + n], increment[I : I + n], beta[I : I + n]
        for i in range(n):
            d[i] = 1.0 / b[i]
            o[i] = d[i] * x[i]


@loop
def centre_coefficients(out, mu, rho, start, n, c_mu, c_rho):
    """out = c_mu μ + c_rho ρ at centres (compact rows): what acts along a component's own direction."""
    for r in prange(start.size):
        I = start[r]
        o, m, d = out[r * n : r * n + n], mu[I : I + n], rho[I : I + n]
        for i in range(n):
            o[i] = c_mu * m[i] + c_rho * d[i]


@loop
def edge_coefficients(out, mu, rho, start, n, sa, sb, c_mu, c_rho):
    """out = c_mu μ + c_rho ρ on the low ab-edges (compact rows), means of four centres."""
    for r in prange(start.size):
        I = start[r]
        o = out[r * n : r * n + n]
        m, ma, mb, mab = (
            mu[I : I + n],
            mu[I - sa : I - sa + n],
            mu[I - sb : I - sb + n],
            mu[I - sa - sb : I - sa - sb + n],
        )
        d, da, db = rho[I : I + n], rho[I - sa : I - sa + n], rho[I - sb : I - sb + n]
        dab = rho[I - sa - sb : I - sa - sb + n]
        for i in range(n):
            viscous = (m[i] + ma[i]) + (mb[i] + mab[i])
            o[i] = 0.25 * (c_mu * viscous + c_rho * ((d[i] + da[i]) + (db[i] + dab[i])))


@loop
def update_pressure(p, before, psi, q, mu, rho, start, n, weight, c_mu, c_rho):
    """p_before = p; p += weight ψ + (c_mu μ + c_rho ρ) q, with q = -div u*/Δt (compact) of the rotational form."""
    for r in prange(start.size):
        I = start[r]
        o, b, x, y = p[I : I + n], before[I : I + n], psi[r * n : r * n + n], q[r * n : r * n + n]
        m, d = mu[I : I + n], rho[I : I + n]
        for i in range(n):
            b[i] = o[i]
            o[i] += weight * x[i] + (c_mu * m[i] + c_rho * d[i]) * y[i]
