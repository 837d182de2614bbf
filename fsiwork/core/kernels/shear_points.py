"""What a membrane with shear (3.3) is made of at a point: energy laws, ∇Y at a node, invariants."""

import numpy as np

from fsiwork.core.kernels import point

QUADRATIC, LINEAR, NEO_HOOKEAN, SKALAK = range(4)  # laws of `energy`
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


@point
def sliding(f, size):
    """tan² of the angle between Fm and n: by how much the layers of the band slide over each other."""
    return (f[0] * f[0] + f[1] * f[1] + f[2] * f[2]) * size * size - 1.0


@point
def dirac(phi, eps, weight):
    """weight D_ε(φ) by the cosine and its derivative by φ; 0 outside of |φ| < ε."""
    q = phi / eps
    if abs(q) >= 1.0:
        return 0.0, 0.0
    k = 0.5 * weight / eps
    return k * (1.0 + np.cos(np.pi * q)), -k * np.pi * np.sin(np.pi * q) / eps
