"""Force of a membrane as the gradient of its discrete energy h^d Σ D_ε E(|∇φ|) over the nodes.

A node is the low corner of the cell of its index; ∇φ there are compact differences of the cells around, φ̄ is their
mean. Runs, strides, ``numbers``, ``kind`` and ``given`` (E and E' at nodes) as in `kernels.membrane`, whose point
formulas serve here. ``P[0]`` holds derivatives by φ̄, ``P[1:]`` those by the components of ∇φ.
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, loop, point
from fsiwork.core.kernels.membrane import TINY, bell, dirac, quarter_sine, tension

# Numba itself must inline this one, else LLVM leaves a call and no SIMD.
inline = njit(error_model="numpy", fastmath=FASTMATH, inline="always")


@point
def slope(r):
    """ζ'(r) = -½π sin πr on [-1, 1], else 0."""
    q = min(abs(r), 1.0)
    size = 1.5707963267948966 * quarter_sine(2.0 * min(q, 1.0 - q))
    return -size if r > 0.0 else size


@point
def stored(kind, lam, r, given):
    """E(r)."""
    return lam * r if kind == 0 else (0.5 * lam * (r - 1.0) * (r - 1.0) if kind == 1 else given)


@inline
def corners(q, I, n, a, b, c):
    """A field at the eight cells around the nodes of a row; for minus strides at the eight nodes around its cells."""
    J = I - c
    return (
        q[I : I + n], q[I - a : I - a + n], q[I - b : I - b + n], q[I - a - b : I - a - b + n],
        q[J : J + n], q[J - a : J - a + n], q[J - b : J - b + n], q[J - a - b : J - a - b + n],
    )  # fmt: skip


@loop
def slopes(P, phi, runs, s, kind, numbers, energies, tensions):
    """Derivatives of D_ε(φ̄, |∇φ|) E(|∇φ|) at the nodes of the runs."""
    a, b, c = s[0], s[1], s[2]
    h, eps, renormalised, lam = numbers[0], numbers[1], numbers[2] > 0.0, numbers[3]
    k, deep = 0.25 / h, P.shape[0] > 3
    for r in prange(runs.shape[0]):
        I, n, o = runs[r, 0], runs[r, 1], runs[r, 2]
        p0, p1, p2, p3, w0, w1, w2, w3 = corners(phi, I, n, a, b, c)
        M, A, B, C = P[0, I : I + n], P[1, I : I + n], P[2, I : I + n], P[P.shape[0] - 1, I : I + n]
        E0, E1 = energies[o:], tensions[o:]
        for i in range(n):
            ga = k * (((p0[i] - p1[i]) + (p2[i] - p3[i])) + ((w0[i] - w1[i]) + (w2[i] - w3[i])))
            gb = k * (((p0[i] - p2[i]) + (p1[i] - p3[i])) + ((w0[i] - w2[i]) + (w1[i] - w3[i])))
            gc = k * (((p0[i] - w0[i]) + (p1[i] - w1[i])) + ((p2[i] - w2[i]) + (p3[i] - w3[i])))
            mean = 0.125 * (((p0[i] + p3[i]) + (p1[i] + p2[i])) + ((w0[i] + w3[i]) + (w1[i] + w2[i])))
            g = np.sqrt(ga * ga + gb * gb + gc * gc + TINY)
            w = eps * g if renormalised else eps
            x = mean / w
            bent, E = slope(x) / (w * w), stored(kind, lam, g, E0[i] if kind == 2 else 0.0)
            along = tension(kind, lam, g, E1[i] if kind == 2 else 0.0) * bell(x) / w
            if renormalised:
                along -= E * (bell(x) / w + mean * bent) / g
            M[i], A[i], B[i] = E * bent, along * ga / g, along * gb / g
            if deep:
                C[i] = along * gc / g


@loop
def gradient(out, P, runs, s, h):
    """out = -(compact divergence of P[1:]) + mean of P[0] at the centres of the runs: derivatives of the energy by φ,
    over the volume of a cell."""
    a, b, c, k, deep = s[0], s[1], s[2], 0.25 / h, P.shape[0] > 3
    for r in prange(runs.shape[0]):
        I, n = runs[r, 0], runs[r, 1]
        o = out[I : I + n]
        m0, m1, m2, m3, v0, v1, v2, v3 = corners(P[0], I, n, -a, -b, -c)
        for i in range(n):
            o[i] = 0.125 * (((m0[i] + m1[i]) + (m2[i] + m3[i])) + ((v0[i] + v1[i]) + (v2[i] + v3[i])))
        a0, a1, a2, a3, x0, x1, x2, x3 = corners(P[1], I, n, -a, -b, -c)
        b0, b1, b2, b3, y0, y1, y2, y3 = corners(P[2], I, n, -a, -b, -c)
        for i in range(n):
            o[i] -= k * (((a1[i] - a0[i]) + (a3[i] - a2[i])) + ((x1[i] - x0[i]) + (x3[i] - x2[i])))
            o[i] -= k * (((b2[i] - b0[i]) + (b3[i] - b1[i])) + ((y2[i] - y0[i]) + (y3[i] - y1[i])))
        if deep:
            c0, c1, c2, c3, z0, z1, z2, z3 = corners(P[3], I, n, -a, -b, -c)
            for i in range(n):
                o[i] -= k * (((z0[i] - c0[i]) + (z1[i] - c1[i])) + ((z2[i] - c2[i]) + (z3[i] - c3[i])))


@loop
def pull(out, g, phi, u, runs, s, h):
    """out = g ∂φ along stride s at centres, as the transport by ``upwind5`` takes it; ``u`` [on low faces] says which
    side is upwind, the mean of both where it is 0."""
    k = 1.0 / (60.0 * h)
    for r in prange(runs.shape[0]):
        I, n = runs[r, 0], runs[r, 1]
        o, G, low, high, p0 = out[I : I + n], g[I : I + n], u[I : I + n], u[I + s : I + s + n], phi[I : I + n]
        m3, m2, m1 = phi[I - 3 * s : I - 3 * s + n], phi[I - 2 * s : I - 2 * s + n], phi[I - s : I - s + n]
        p1, p2, p3 = phi[I + s : I + s + n], phi[I + 2 * s : I + 2 * s + n], phi[I + 3 * s : I + 3 * s + n]
        for i in range(n):
            w = low[i] + high[i]
            side = 1.0 if w > 0.0 else (-1.0 if w < 0.0 else 0.0)
            sixth = (p3[i] + m3[i]) - 6.0 * (p2[i] + m2[i]) + 15.0 * (p1[i] + m1[i]) - 20.0 * p0[i]
            centred = (p3[i] - m3[i]) - 9.0 * (p2[i] - m2[i]) + 45.0 * (p1[i] - m1[i])
            o[i] = k * G[i] * (centred - side * sixth)


@loop
def energies(out, phi, runs, s, kind, numbers, given):
    """out[r] = Σ D_ε E at the nodes of a run."""
    a, b, c = s[0], s[1], s[2]
    h, eps, renormalised, lam = numbers[0], numbers[1], numbers[2] > 0.0, numbers[3]
    k = 0.25 / h
    for r in prange(runs.shape[0]):
        I, n, o = runs[r, 0], runs[r, 1], runs[r, 2]
        p0, p1, p2, p3, w0, w1, w2, w3 = corners(phi, I, n, a, b, c)
        E0, total = given[o:], 0.0
        for i in range(n):
            ga = k * (((p0[i] - p1[i]) + (p2[i] - p3[i])) + ((w0[i] - w1[i]) + (w2[i] - w3[i])))
            gb = k * (((p0[i] - p2[i]) + (p1[i] - p3[i])) + ((w0[i] - w2[i]) + (w1[i] - w3[i])))
            gc = k * (((p0[i] - w0[i]) + (p1[i] - w1[i])) + ((p2[i] - w2[i]) + (p3[i] - w3[i])))
            mean = 0.125 * (((p0[i] + p3[i]) + (p1[i] + p2[i])) + ((w0[i] + w3[i]) + (w1[i] + w2[i])))
            g = np.sqrt(ga * ga + gb * gb + gc * gc + TINY)
            E = stored(kind, lam, g, E0[i] if kind == 2 else 0.0)
            total += dirac(mean, g, eps, renormalised) * E
        out[r] = total


@loop
def excess(out, phi, runs, s, kind, numbers, energies, tensions):
    """D_ε E - |∇φ| ∂(D_ε E)/∂|∇φ| at the nodes of the runs."""
    a, b, c = s[0], s[1], s[2]
    h, eps, renormalised, lam = numbers[0], numbers[1], numbers[2] > 0.0, numbers[3]
    k = 0.25 / h
    for r in prange(runs.shape[0]):
        I, n, o = runs[r, 0], runs[r, 1], runs[r, 2]
        p0, p1, p2, p3, w0, w1, w2, w3 = corners(phi, I, n, a, b, c)
        q, E0, E1 = out[I : I + n], energies[o:], tensions[o:]
        for i in range(n):
            ga = k * (((p0[i] - p1[i]) + (p2[i] - p3[i])) + ((w0[i] - w1[i]) + (w2[i] - w3[i])))
            gb = k * (((p0[i] - p2[i]) + (p1[i] - p3[i])) + ((w0[i] - w2[i]) + (w1[i] - w3[i])))
            gc = k * (((p0[i] - w0[i]) + (p1[i] - w1[i])) + ((p2[i] - w2[i]) + (p3[i] - w3[i])))
            mean = 0.125 * (((p0[i] + p3[i]) + (p1[i] + p2[i])) + ((w0[i] + w3[i]) + (w1[i] + w2[i])))
            g = np.sqrt(ga * ga + gb * gb + gc * gc + TINY)
            w = eps * g if renormalised else eps
            E = stored(kind, lam, g, E0[i] if kind == 2 else 0.0)
            D = bell(mean / w) / w
            q[i] = D * (E - g * tension(kind, lam, g, E1[i] if kind == 2 else 0.0))
            if renormalised:
                q[i] += E * (D + mean * slope(mean / w) / (w * w))


@loop
def to_centres(out, q, runs, s):
    """out = mean of the nodes around the centres of the runs."""
    for r in prange(runs.shape[0]):
        I, n = runs[r, 0], runs[r, 1]
        o = out[I : I + n]
        m0, m1, m2, m3, v0, v1, v2, v3 = corners(q, I, n, -s[0], -s[1], -s[2])
        for i in range(n):
            o[i] = 0.125 * (((m0[i] + m1[i]) + (m2[i] + m3[i])) + ((v0[i] + v1[i]) + (v2[i] + v3[i])))
