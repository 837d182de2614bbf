"""A membrane with shear (3.3) from the backward map Y: discrete energy at the nodes, its gradient, the force.

A node is the low corner of the cell of its index; ∇Y there are compact differences of the 8 cells around, Ȳ is
their mean. ``period`` holds the lengths of the box along periodic directions, else 0. ``numbers`` = (h, ε, radius at
rest, weight of the energy, moduli of area, shear, volume); ``law`` is a code from below. Runs as in `kernels.membrane`.
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, loop, point

QUADRATIC, LINEAR, NEO_HOOKEAN, SKALAK = range(4)  # laws of `energy`
ENERGY, AREA, SHEARED, SQUARES, LEAST_DET, LEAST1, MOST1, LEAST2, MOST2, STIFF = range(10)  # columns of `survey`
SUMS = 4  # of them, the first
TINY = 1e-30

# Formulas of a whole row: inlined by Numba itself, else LLVM leaves a call and no SIMD.
inline = njit(error_model="numpy", fastmath=FASTMATH, inline="always")


@point
def energy(law, area, shear, Z1, Z2):
    """E(Z₁, Z₂) and its derivatives 1, 2, 11, 22."""
    a, b = Z1 - 1.0, Z2 - 1.0
    if law == QUADRATIC:
        return 0.5 * (area * a * a + shear * b * b), area * a, shear * b, area, shear
    if law == LINEAR:
        return 0.5 * area * a * a + shear * b, area * a, shear, area, 0.0
    if law == NEO_HOOKEAN:
        c = Z1**-3
        return 0.5 * shear * (2.0 * Z1 * Z2 + Z1 * c - 3.0), shear * (Z2 - c), shear * Z1, 3.0 * shear * c / Z1, 0.0
    p, q = 2.0 * (Z1 * Z2 - 1.0), Z1 * Z1 - 1.0
    s = 0.25 * shear
    return (
        s * (p * p + 2.0 * p - 2.0 * q) + 0.25 * area * q * q,
        s * (4.0 * (p + 1.0) * Z2 - 4.0 * Z1) + area * q * Z1,
        s * 4.0 * (p + 1.0) * Z1,
        s * (8.0 * Z2 * Z2 - 4.0) + area * (3.0 * Z1 * Z1 - 1.0),
        s * 8.0 * Z1 * Z1,
    )


@point
def stiffness(dE1, dE2, ddE1, ddE2, Z1, Z2):
    """Largest modulus of small waves, max(G, N) of MEASURED-coupling 6."""
    S = np.sqrt(max(Z2 * Z2 - 1.0, 0.0))
    bent = 2.0 * ddE2 * S
    x = min(1.0, dE2 / bent) if bent > 0.0 else 1.0
    G = ddE2 * S * S * (1.0 - x * x) + dE2 * (Z2 + S * x)
    A, B = dE1 * Z1 + dE2 * S, ddE1 * Z1 * Z1
    N = max(A, 0.0) if max(2.0 * A, 0.0) >= B else B * B / (4.0 * (B - A))
    return max(G, N)


@point
def corner(q, I, x, y, h):
    """Mean and gradient at a node of a field at the 8 cells around."""
    a, b, c, d = q[I - x - y - 1], q[I - x - y], q[I - x - 1], q[I - x]
    e, f, g, o = q[I - y - 1], q[I - y], q[I - 1], q[I]
    k = 0.25 / h
    low, high = (a + b) + (c + d), (e + f) + (g + o)
    return (
        0.125 * (low + high),
        k * (high - low),
        k * (((c - a) + (d - b)) + ((g - e) + (o - f))),
        k * (((b - a) + (d - c)) + ((f - e) + (o - g))),
    )


@point
def near(r, period):
    """r, or its image nearest to zero."""
    return r - period * np.round(r / period) if period > 0.0 else r


@point
def place(Y0, Y1, Y2, I, x, y, h, centre, period):
    """Ȳ - centre, ∇Y by rows, and det ∇Y at a node."""
    a, a0, a1, a2 = corner(Y0, I, x, y, h)
    b, b0, b1, b2 = corner(Y1, I, x, y, h)
    c, c0, c1, c2 = corner(Y2, I, x, y, h)
    r = near(a - centre[0], period[0]), near(b - centre[1], period[1]), near(c - centre[2], period[2])
    det = a0 * (b1 * c2 - b2 * c1) + a1 * (b2 * c0 - b0 * c2) + a2 * (b0 * c1 - b1 * c0)
    return r, (a0, a1, a2, b0, b1, b2, c0, c1, c2), det


@point
def inverse(w, det):
    """F = (∇Y)⁻¹ by rows."""
    k = 1.0 / det
    return (
        k * (w[4] * w[8] - w[5] * w[7]), k * (w[2] * w[7] - w[1] * w[8]), k * (w[1] * w[5] - w[2] * w[4]),
        k * (w[5] * w[6] - w[3] * w[8]), k * (w[0] * w[8] - w[2] * w[6]), k * (w[2] * w[3] - w[0] * w[5]),
        k * (w[3] * w[7] - w[4] * w[6]), k * (w[1] * w[6] - w[0] * w[7]), k * (w[0] * w[4] - w[1] * w[3]),
    )  # fmt: skip


@point
def times(M, v):
    """M v."""
    return (
        M[0] * v[0] + M[1] * v[1] + M[2] * v[2],
        M[3] * v[0] + M[4] * v[1] + M[5] * v[2],
        M[6] * v[0] + M[7] * v[1] + M[8] * v[2],
    )


@point
def transposed(M, v):
    """Mᵀ v."""
    return (
        M[0] * v[0] + M[3] * v[1] + M[6] * v[2],
        M[1] * v[0] + M[4] * v[1] + M[7] * v[2],
        M[2] * v[0] + M[5] * v[1] + M[8] * v[2],
    )


@point
def product(a, b, c, s):
    """a·b - c s: an entry of A = FFᵀ - Fm⊗Fm from two rows of F and two components of Fm."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] - c * s


@point
def surface(w, det, m):
    """F, Fm, n, A (00, 11, 22, 01, 02, 12), Tr A, |∇φ| for |∇φ₀| = 1, Z₁, Z₂ (3.38)-(3.41)."""
    F = inverse(w, det)
    f, v = times(F, m), transposed(w, m)
    size = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) + TINY
    n = (v[0] / size, v[1] / size, v[2] / size)
    p, q, r = (F[0], F[1], F[2]), (F[3], F[4], F[5]), (F[6], F[7], F[8])
    A = (
        product(p, p, f[0], f[0]), product(q, q, f[1], f[1]), product(r, r, f[2], f[2]),
        product(p, q, f[0], f[1]), product(p, r, f[0], f[2]), product(q, r, f[1], f[2]),
    )  # fmt: skip
    trace = A[0] + A[1] + A[2]
    Z1 = size / abs(det)
    return F, f, n, A, trace, size, Z1, max(0.5 * trace / Z1, 1.0)


@loop
def stress(out, Y0, Y1, Y2, runs, s, numbers, law, centre, period):
    """Derivatives of D_ε E at each node of the runs: out[:9, I] by ∇Y (-D FᵀT, by rows), out[9:, I] by Ȳ.

    T = Σ E_i' Z_i C_i - κ(j - 1)j I, j = det ∇Y/weight; by Ȳ it is D'Em + D(∂m/∂Y)ᵀk, k = -2Fᵀ[(e₁ + e₂TrA)I - e₂A]Fm.
    """
    x, y, h, eps, radius = s[0], s[1], numbers[0], numbers[1], numbers[2]
    for t in prange(runs.shape[0]):
        for I in range(runs[t, 0], runs[t, 0] + runs[t, 1]):
            r, w, det = place(Y0, Y1, Y2, I, x, y, h, centre, period)
            distance = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) + TINY
            phi = (distance - radius) / eps
            if abs(phi) >= 1.0:
                for j in range(12):
                    out[j, I] = 0.0
                continue
            m = (r[0] / distance, r[1] / distance, r[2] / distance)
            F, f, n, A, trace, _, Z1, Z2 = surface(w, det, m)
            E, dE1, dE2, _, _ = energy(law, numbers[4], numbers[5], Z1, Z2)
            D = numbers[3] * 0.5 * (1.0 + np.cos(np.pi * phi)) / eps
            slope = -numbers[3] * 0.5 * np.pi * np.sin(np.pi * phi) / (eps * eps)
            a, b, change = dE1 * Z1 - dE2 * Z2, dE2 / Z1, det / numbers[3] - 1.0
            E += 0.5 * numbers[6] * change * change
            v = numbers[6] * change * (1.0 + change)
            T = (
                a * (1.0 - n[0] * n[0]) + b * A[0] - v, b * A[3] - a * n[0] * n[1], b * A[4] - a * n[0] * n[2],
                b * A[3] - a * n[0] * n[1], a * (1.0 - n[1] * n[1]) + b * A[1] - v, b * A[5] - a * n[1] * n[2],
                b * A[4] - a * n[0] * n[2], b * A[5] - a * n[1] * n[2], a * (1.0 - n[2] * n[2]) + b * A[2] - v,
            )  # fmt: skip
            for j in range(3):
                column = transposed(F, (T[j], T[3 + j], T[6 + j]))
                for q in range(3):
                    out[3 * q + j, I] = -D * column[q]
            e1, e2 = 0.5 * dE2 / Z1, 0.5 * (dE1 - dE2 * Z2 / Z1) / Z1
            g = times((A[0], A[3], A[4], A[3], A[1], A[5], A[4], A[5], A[2]), f)
            c = e1 + e2 * trace
            k = transposed(F, (c * f[0] - e2 * g[0], c * f[1] - e2 * g[1], c * f[2] - e2 * g[2]))
            along = k[0] * m[0] + k[1] * m[1] + k[2] * m[2]
            for q in range(3):
                out[9 + q, I] = slope * E * m[q] - 2.0 * D * (k[q] - along * m[q]) / distance


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


@loop
def survey(out, Y0, Y1, Y2, runs, s, numbers, law, centre, period):
    """One row of ``out`` a run: sums of D E, D|∇φ|, (Z₂ - 1)D|∇φ|, (det ∇Y/weight - 1)² D|∇φ|; least det ∇Y/weight,
    extremes of Z₁ and Z₂, largest stiffness, all where D_ε > 0."""
    x, y, h, eps, radius = s[0], s[1], numbers[0], numbers[1], numbers[2]
    for t in prange(runs.shape[0]):
        for j in range(SUMS):
            out[t, j] = 0.0
        out[t, LEAST_DET], out[t, LEAST1], out[t, MOST1] = np.inf, np.inf, -np.inf
        out[t, LEAST2], out[t, MOST2], out[t, STIFF] = np.inf, -np.inf, 0.0
        for I in range(runs[t, 0], runs[t, 0] + runs[t, 1]):
            r, w, det = place(Y0, Y1, Y2, I, x, y, h, centre, period)
            distance = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) + TINY
            phi = (distance - radius) / eps
            if abs(phi) >= 1.0:
                continue
            m = (r[0] / distance, r[1] / distance, r[2] / distance)
            size, Z1, Z2 = surface(w, det, m)[5:]
            E, dE1, dE2, ddE1, ddE2 = energy(law, numbers[4], numbers[5], Z1, Z2)
            D, change = 0.5 * (1.0 + np.cos(np.pi * phi)) / eps, det / numbers[3]
            E += 0.5 * numbers[6] * (change - 1.0) * (change - 1.0)
            out[t, ENERGY] += numbers[3] * D * E
            out[t, AREA] += D * size
            out[t, SHEARED] += (Z2 - 1.0) * D * size
            out[t, SQUARES] += (change - 1.0) * (change - 1.0) * D * size
            out[t, LEAST_DET] = min(out[t, LEAST_DET], change)
            out[t, LEAST1], out[t, MOST1] = min(out[t, LEAST1], Z1), max(out[t, MOST1], Z1)
            out[t, LEAST2], out[t, MOST2] = min(out[t, LEAST2], Z2), max(out[t, MOST2], Z2)
            M = numbers[3] * stiffness(dE1, dE2, ddE1, ddE2, Z1, Z2)
            out[t, STIFF] = max(out[t, STIFF], M)


@loop
def determinants(out, Y0, Y1, Y2, start, n, x, y, h, weight):
    """out[r] = Σ (det ∇Y/weight - 1)² over the nodes of a row."""
    for r in prange(start.size):
        total = 0.0
        for I in range(start[r], start[r] + n):
            _, a0, a1, a2 = corner(Y0, I, x, y, h)
            _, b0, b1, b2 = corner(Y1, I, x, y, h)
            _, c0, c1, c2 = corner(Y2, I, x, y, h)
            det = a0 * (b1 * c2 - b2 * c1) + a1 * (b2 * c0 - b0 * c2) + a2 * (b0 * c1 - b1 * c0)
            total += (det / weight - 1.0) ** 2
        out[r] = total


@loop
def distances(phi, Y0, Y1, Y2, centre, period, radius):
    """φ = |Y - centre| - radius at every centre, ghosts too."""
    for I in prange(phi.size):
        a, b, c = (
            near(Y0[I] - centre[0], period[0]),
            near(Y1[I] - centre[1], period[1]),
            near(Y2[I] - centre[2], period[2]),
        )
        phi[I] = np.sqrt(a * a + b * b + c * c) - radius
