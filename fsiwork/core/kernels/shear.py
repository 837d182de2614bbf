"""A membrane with shear (3.3) from the backward map Y: discrete energy at the nodes, its gradient, the force.

A node is the low corner of the cell of its index; ∇Y there are compact differences of the 8 cells around, Ȳ is
their mean. ``period`` holds the lengths of the box along periodic directions, else 0. ``numbers`` = (h, ε, radius at
rest, weight of the energy, moduli of area, shear, volume); ``law`` is a code from below. Runs as in `kernels.membrane`.
"""

import numpy as np
from numba import prange

from fsiwork.core.kernels import loop, point

QUADRATIC, LINEAR, NEO_HOOKEAN, SKALAK = range(4)  # laws of `energy`
ENERGY, AREA, SHEARED, SQUARES, LEAST_DET, LEAST1, MOST1, LEAST2, MOST2, STIFF = range(10)  # columns of `survey`
SUMS = 4  # of them, the first
TINY = 1e-30


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
    """Derivatives of D_ε E at each node of the runs: out[I, :9] by ∇Y (-D FᵀT, by rows), out[I, 9:] by Ȳ.

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
                    out[I, j] = 0.0
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
                    out[I, 3 * q + j] = -D * column[q]
            e1, e2 = 0.5 * dE2 / Z1, 0.5 * (dE1 - dE2 * Z2 / Z1) / Z1
            g = times((A[0], A[3], A[4], A[3], A[1], A[5], A[4], A[5], A[2]), f)
            c = e1 + e2 * trace
            k = transposed(F, (c * f[0] - e2 * g[0], c * f[1] - e2 * g[1], c * f[2] - e2 * g[2]))
            along = k[0] * m[0] + k[1] * m[1] + k[2] * m[2]
            for q in range(3):
                out[I, 9 + q] = slope * E * m[q] - 2.0 * D * (k[q] - along * m[q]) / distance


@point
def gradient(P, q, I, x, y, h):
    """-(compact divergence of P_q) + mean of h_q, at a centre: the derivative by Y_q of the energy over Δx³."""
    total = 0.0
    for a in range(2):
        for b in range(2):
            for c in range(2):
                J = I + a * x + b * y + c
                total += 0.125 * P[J, 9 + q]
                k = 0.25 / h
                total += k * ((1 - 2 * a) * P[J, 3 * q] + (1 - 2 * b) * P[J, 3 * q + 1] + (1 - 2 * c) * P[J, 3 * q + 2])
    return total


@point
def upwind5(q, I, s, u, h):
    """∂q as the transport by ``upwind5`` takes it; the mean of both sides where there is no velocity."""
    far, mid, close = q[I + 3 * s] - q[I - 3 * s], q[I + 2 * s] - q[I - 2 * s], q[I + s] - q[I - s]
    sixth = q[I + 3 * s] + q[I - 3 * s] - 6 * (q[I + 2 * s] + q[I - 2 * s]) + 15 * (q[I + s] + q[I - s]) - 20 * q[I]
    side = 1.0 if u > 0.0 else (-1.0 if u < 0.0 else 0.0)
    return (far - 9 * mid + 45 * close - side * sixth) / (60.0 * h)


@loop
def gradients(G0, G1, G2, P, runs, s, h):
    """Derivatives of the energy over Δx³ by the components of Y, at the centres of the runs."""
    x, y = s[0], s[1]
    for t in prange(runs.shape[0]):
        for I in range(runs[t, 0], runs[t, 0] + runs[t, 1]):
            G0[I] = gradient(P, 0, I, x, y, h)
            G1[I] = gradient(P, 1, I, x, y, h)
            G2[I] = gradient(P, 2, I, x, y, h)


@loop
def pulls(out, G0, G1, G2, Y0, Y1, Y2, u, runs, s, h):
    """Σ_q g_q ∂Y_q along stride s at centres; ``u`` [on low faces] says which side is upwind."""
    for t in prange(runs.shape[0]):
        for I in range(runs[t, 0], runs[t, 0] + runs[t, 1]):
            w = u[I] + u[I + s]
            out[I] = G0[I] * upwind5(Y0, I, s, w, h) + G1[I] * upwind5(Y1, I, s, w, h) + G2[I] * upwind5(Y2, I, s, w, h)


@loop
def to_faces(out, q, start, n, s):
    """out = mean of the two centres beside each low face."""
    for r in prange(start.size):
        I = start[r]
        o, here, low = out[I : I + n], q[I : I + n], q[I - s : I - s + n]
        for i in range(n):
            o[i] = 0.5 * (here[i] + low[i])


@point
def line(q, I):
    """(1, 2, 1)/4 along the rows."""
    return 0.25 * (q[I - 1] + q[I + 1]) + 0.5 * q[I]


@loop
def smooth(out, q, start, n, x, y, add):
    """out = add out + q filtered by (1, 2, 1)/4 once along each axis."""
    for r in prange(start.size):
        for I in range(start[r], start[r] + n):
            sides = line(q, I - x) + line(q, I + x) + line(q, I - y) + line(q, I + y)
            ends = line(q, I - x - y) + line(q, I - x + y) + line(q, I + x - y) + line(q, I + x + y)
            out[I] = add * out[I] + 0.25 * line(q, I) + 0.125 * sides + 0.0625 * ends


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
