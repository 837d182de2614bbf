"""A membrane with shear (3.3) from the backward map Y: discrete energy at the nodes, its gradient, the force.

A node is the low corner of the cell of its index; ∇Y there are compact differences of the 8 cells around, Ȳ is
their mean. ``period`` holds the lengths of the box along periodic directions, else 0. ``numbers`` = (h, ε, radius at
rest, weight of the energy, moduli of area, shear, volume, slip, half-width of S_ε); ``law`` is a code of
`kernels.shear_points`. Runs as in `kernels.membrane`.
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, loop, point
from fsiwork.core.kernels.shear_points import TINY, dirac, energy, place, sliding, surface, times, transposed

# Formulas of a whole row: inlined by Numba itself, else LLVM leaves a call and no SIMD.
inline = njit(error_model="numpy", fastmath=FASTMATH, inline="always")


@point
def tension(a, b, v, l, n, f, A):
    """a(I - n⊗n) + bA - vI + l Fm⊗Fm by rows."""
    x = b * A[3] - a * n[0] * n[1] + l * f[0] * f[1]
    y = b * A[4] - a * n[0] * n[2] + l * f[0] * f[2]
    z = b * A[5] - a * n[1] * n[2] + l * f[1] * f[2]
    c = a - v
    return (
        c + b * A[0] - a * n[0] * n[0] + l * f[0] * f[0], x, y,
        x, c + b * A[1] - a * n[1] * n[1] + l * f[1] * f[1], z,
        y, z, c + b * A[2] - a * n[2] * n[2] + l * f[2] * f[2],
    )  # fmt: skip


@loop
def stress(out, Y0, Y1, Y2, runs, s, numbers, law, centre, period):
    """Derivatives of D_ε E + S_ε E_s at each node of the runs: out[:9, I] by ∇Y (-FᵀT, by rows), out[9:, I] by Ȳ.

    T = D[Σ E_i' Z_i C_i - κ(j - 1)j I] + S κ_s|v|²(Fm⊗Fm - |Fm|²n⊗n), j = det ∇Y/weight, v = ∇Yᵀm = |v|n; by Ȳ it is
    (D'E + S'E_s)m + (∂m/∂Y)ᵀk, k = -2DFᵀ[(e₁ + e₂TrA)I - e₂A]Fm + S κ_s(|v|²FᵀFm + |Fm|²∇Y v).
    """
    x, y, h, eps, radius, skin = s[0], s[1], numbers[0], numbers[1], numbers[2], numbers[8]
    for t in prange(runs.shape[0]):
        for I in range(runs[t, 0], runs[t, 0] + runs[t, 1]):
            r, w, det = place(Y0, Y1, Y2, I, x, y, h, centre, period)
            distance = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) + TINY
            D, D1 = dirac(distance - radius, eps, numbers[3])
            S, S1 = dirac(distance - radius, skin, numbers[3])
            if D == 0.0 and S == 0.0:
                for j in range(12):
                    out[j, I] = 0.0
                continue
            m = (r[0] / distance, r[1] / distance, r[2] / distance)
            F, f, n, A, trace, size, Z1, Z2 = surface(w, det, m)
            E, dE1, dE2, _, _ = energy(law, numbers[4], numbers[5], Z1, Z2)
            swollen, slid = det / numbers[3], sliding(f, size)
            E = D1 * (E + 0.5 * numbers[6] * (swollen - 1.0) ** 2) + 0.5 * S1 * numbers[7] * slid
            v = D * numbers[6] * (swollen - 1.0) * swollen
            d, l = S * numbers[7] * (1.0 + slid), S * numbers[7] * size * size
            T = tension(D * (dE1 * Z1 - dE2 * Z2) + d, D * dE2 / Z1, v + d, l, n, f, A)
            for j in range(3):
                column = transposed(F, (T[j], T[3 + j], T[6 + j]))
                for q in range(3):
                    out[3 * q + j, I] = -column[q]
            e2 = 0.5 * D * (dE1 - dE2 * Z2 / Z1) / Z1
            c = 0.5 * D * dE2 / Z1 + e2 * trace - 0.5 * l
            g = times((A[0], A[3], A[4], A[3], A[1], A[5], A[4], A[5], A[2]), f)
            k = transposed(F, (c * f[0] - e2 * g[0], c * f[1] - e2 * g[1], c * f[2] - e2 * g[2]))
            o, d = times(w, n), 0.5 * d / size
            k = (k[0] - d * o[0], k[1] - d * o[1], k[2] - d * o[2])
            along = k[0] * m[0] + k[1] * m[1] + k[2] * m[2]
            for q in range(3):
                out[9 + q, I] = E * m[q] - 2.0 * (k[q] - along * m[q]) / distance


@inline
def corners(p, I, n, x, y):
    """A field at the 8 nodes of the cells of a row, the last direction fastest."""
    J = I + x
    return (
        p[I : I + n], p[I + 1 : I + 1 + n], p[I + y : I + y + n], p[I + y + 1 : I + y + 1 + n],
        p[J : J + n], p[J + 1 : J + 1 + n], p[J + y : J + y + n], p[J + y + 1 : J + y + 1 + n],
    )  # fmt: skip


@inline
def gradient(out, P, q, I, n, x, y, h):
    """-(compact divergence of P_q) + mean of h_q at the centres of a row: derivatives by Y_q of the energy over Δx³."""
    k, o = 0.25 / h, out[I : I + n]
    a0, a1, a2, a3, a4, a5, a6, a7 = corners(P[3 * q], I, n, x, y)
    b0, b1, b2, b3, b4, b5, b6, b7 = corners(P[3 * q + 1], I, n, x, y)
    c0, c1, c2, c3, c4, c5, c6, c7 = corners(P[3 * q + 2], I, n, x, y)
    m0, m1, m2, m3, m4, m5, m6, m7 = corners(P[9 + q], I, n, x, y)
    for i in range(n):
        total = (a0[i] + a1[i]) + (a2[i] + a3[i]) - ((a4[i] + a5[i]) + (a6[i] + a7[i]))
        total += (b0[i] + b1[i]) + (b4[i] + b5[i]) - ((b2[i] + b3[i]) + (b6[i] + b7[i]))
        total += (c0[i] + c2[i]) + (c4[i] + c6[i]) - ((c1[i] + c3[i]) + (c5[i] + c7[i]))
        mean = ((m0[i] + m1[i]) + (m2[i] + m3[i])) + ((m4[i] + m5[i]) + (m6[i] + m7[i]))
        o[i] = k * total + 0.125 * mean


@loop
def gradients(G0, G1, G2, P, runs, s, h):
    """Derivatives of the energy over Δx³ by the components of Y, at the centres of the runs."""
    for t in prange(runs.shape[0]):
        gradient(G0, P, 0, runs[t, 0], runs[t, 1], s[0], s[1], h)
        gradient(G1, P, 1, runs[t, 0], runs[t, 1], s[0], s[1], h)
        gradient(G2, P, 2, runs[t, 0], runs[t, 1], s[0], s[1], h)


@inline
def pull(out, g, Y, u, I, n, s, k):
    """out += g ∂Y along stride s as the transport by ``upwind5`` takes it; the mean of both sides where u = 0."""
    o, G, low, high = out[I : I + n], g[I : I + n], u[I : I + n], u[I + s : I + s + n]
    m3, m2, m1, p0 = Y[I - 3 * s : I - 3 * s + n], Y[I - 2 * s : I - 2 * s + n], Y[I - s : I - s + n], Y[I : I + n]
    p1, p2, p3 = Y[I + s : I + s + n], Y[I + 2 * s : I + 2 * s + n], Y[I + 3 * s : I + 3 * s + n]
    for i in range(n):
        w = low[i] + high[i]
        side = 1.0 if w > 0.0 else (-1.0 if w < 0.0 else 0.0)
        sixth = (p3[i] + m3[i]) - 6.0 * (p2[i] + m2[i]) + 15.0 * (p1[i] + m1[i]) - 20.0 * p0[i]
        slope = (p3[i] - m3[i]) - 9.0 * (p2[i] - m2[i]) + 45.0 * (p1[i] - m1[i]) - side * sixth
        o[i] += k * G[i] * slope


@loop
def pulls(out, G0, G1, G2, Y0, Y1, Y2, u, runs, s, h):
    """Σ_q g_q ∂Y_q along stride s at centres; ``u`` [on low faces] says which side is upwind."""
    k = 1.0 / (60.0 * h)
    for t in prange(runs.shape[0]):
        I, n = runs[t, 0], runs[t, 1]
        out[I : I + n] = 0.0
        pull(out, G0, Y0, u, I, n, s, k)
        pull(out, G1, Y1, u, I, n, s, k)
        pull(out, G2, Y2, u, I, n, s, k)


@loop
def to_faces(out, q, start, n, s):
    """out = mean of the two centres beside each low face."""
    for r in prange(start.size):
        I = start[r]
        o, here, low = out[I : I + n], q[I : I + n], q[I - s : I - s + n]
        for i in range(n):
            o[i] = 0.5 * (here[i] + low[i])


@loop
def smooth(out, q, start, n, x, y, add):
    """out = add out + q filtered by (1, 2, 1)/4 once along each axis; across the rows first, then along them."""
    for r in prange(start.size):
        I, m = start[r] - 1, n + 2
        a, b, c = q[I - x - y : I - x - y + m], q[I - x : I - x + m], q[I - x + y : I - x + y + m]
        d, e, f = q[I - y : I - y + m], q[I : I + m], q[I + y : I + y + m]
        g, h, k = q[I + x - y : I + x - y + m], q[I + x : I + x + m], q[I + x + y : I + x + y + m]
        line = np.empty(m)
        for i in range(m):
            line[i] = 0.25 * e[i] + 0.125 * ((b[i] + d[i]) + (f[i] + h[i])) + 0.0625 * ((a[i] + c[i]) + (g[i] + k[i]))
        o, low, mid, high = out[I + 1 : I + 1 + n], line[:n], line[1 : n + 1], line[2:]
        for i in range(n):
            o[i] = add * o[i] + 0.5 * mid[i] + 0.25 * (low[i] + high[i])
