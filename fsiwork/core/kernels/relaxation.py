"""One Runge-Kutta stage of ∂τ q = S (1 - |∇q|) at cell centres (1.36), Godunov's upwinding of fifth-order differences.

A stage writes ``out = a base + b (q + dτ S (1 - |∇q|))`` on the rows, lengths in cells. ``out`` must share no memory
with ``base`` or ``q``; ``q`` needs three ghosts. ``s`` holds the strides of all axes; ``k = (a, b, dτ)``; float64.
"""

from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, loop

FLOOR = 1e-6  # of the smoothness indicators; the field is scaled to a slope of one

# Numba itself must inline these: LLVM leaves the longest formula a call, and a loop with a call has no SIMD.
inline = njit(error_model="numpy", fastmath=FASTMATH, inline="always")


@inline
def weighted(v1, v2, v3, v4, v5):
    """Slope at the node between differences ``v3`` (upstream) and ``v4``, weights of Jiang and Shu, one division."""
    c2 = v3 - v2
    c3 = v4 - v3
    e1 = c2 - (v2 - v1)
    e2 = c3 - c2
    e3 = (v5 - v4) - c3
    f1 = c2 + c2 + e1
    f2 = c2 + c3
    f3 = c3 + c3 - e3
    a1 = (13.0 * e1 * e1 + 3.0 * f1 * f1) / 12.0 + FLOOR
    a2 = (13.0 * e2 * e2 + 3.0 * f2 * f2) / 12.0 + FLOOR
    a3 = (13.0 * e3 * e3 + 3.0 * f3 * f3) / 12.0 + FLOOR
    a1 *= a1
    a2 *= a2
    a3 *= a3
    w1 = a2 * a3
    w2 = 6.0 * a1 * a3
    w3 = 3.0 * a1 * a2
    return v3 + (c2 + c3 + c3) / 6.0 + (2.0 * w1 * (e1 - e2) + w3 * (e2 - e3)) / (6.0 * (w1 + w2 + w3))


@inline
def row(out, base, q, sign, start, n, s, k):
    o, z, g, p0 = out[start : start + n], base[start : start + n], sign[start : start + n], q[start : start + n]
    a, b, step = k[0], k[1], k[2]
    o[:] = 0.0
    for axis in range(s.size):
        t = s[axis]
        m3, m2, m1 = q[start - 3 * t :][:n], q[start - 2 * t :][:n], q[start - t :][:n]
        p1, p2, p3 = q[start + t :][:n], q[start + 2 * t :][:n], q[start + 3 * t :][:n]
        for i in range(n):
            d1 = m2[i] - m3[i]
            d2 = m1[i] - m2[i]
            d3 = p0[i] - m1[i]
            d4 = p1[i] - p0[i]
            d5 = p2[i] - p1[i]
            d6 = p3[i] - p2[i]
            low = weighted(d1, d2, d3, d4, d5)
            high = weighted(d6, d5, d4, d3, d2)
            up = g[i] > 0
            low = low if up else -low
            high = -high if up else high
            low = low if low > 0 else 0.0
            high = high if high > 0 else 0.0
            o[i] += low * low if low > high else high * high
    for i in range(n):
        o[i] = a * z[i] + b * (p0[i] + step * g[i] * (1.0 - o[i] ** 0.5))


@loop
def stage(out, base, q, sign, start, n, s, k):
    for r in prange(start.size):
        row(out, base, q, sign, start[r], n, s, k)
