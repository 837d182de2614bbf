"""One Runge-Kutta stage of ∂t q + u·∇q = 0 at cell centres, all axes in one pass.

A stage writes ``out = a base + b (q - dt u·∇q)`` on the rows. ``out`` must share no memory with ``base`` or
``q`` (the loop would fall back to scalar code). The velocity is on the low faces and is averaged to the
centres here; ``q`` needs three ghosts. ``s`` holds the strides of all axes but the last, whose stride is 1;
``k = (a, b, b dt/2h, r2, e)`` with ``r2`` and ``e`` the scale and the floor of the smoothness indicators 12 S
(only their ratio matters), all of the dtype of ``q``.
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, loop

UPWIND1, UPWIND5, WENO5, WENO_Z = range(4)

# Whole numbers (only: 1/3 would be rounded) in single precision, so that float32 fields stay float32.
TWO, THREE, SIX, NINE, THIRTEEN, FIFTEEN, FORTY_FIVE, SIXTY = (np.float32(c) for c in (2, 3, 6, 9, 13, 15, 45, 60))

# Numba itself must inline these: LLVM leaves the longest formula a call, and a loop with a call has no SIMD.
inline = njit(error_model="numpy", fastmath=FASTMATH, inline="always")

# A maximum vectorises only when NaN may be ignored: allowed here, the field itself still carries its NaN.
peak = njit(parallel=True, error_model="numpy", fastmath=FASTMATH | {"nnan"}, cache=True)


@inline
def difference(scheme, m3, m2, m1, o, p1, p2, r2, e):
    """h ∂q at ``o`` from three points upstream (m) and two downstream (p).

    Weighted mean of three parabolas with the weights of Jiang and Shu for `WENO5`, of Borges et al. for `WENO_Z`; put
    over one denominator: one division. With the ideal weights (1, 6, 3)/10 it is linear: `ideal`.
    """
    v2 = m1 - m2
    v3 = o - m1
    if scheme == UPWIND1:
        return v3
    v4 = p1 - o
    c2 = v3 - v2
    c3 = v4 - v3
    e1 = c2 - (v2 - (m2 - m3))
    e2 = c3 - c2
    e3 = (p2 - p1) - v4 - c3
    middle = v3 + (c2 + c3 + c3) / SIX
    left = e1 - e2
    right = e2 - e3
    f1 = c2 + c2 + e1
    f2 = c2 + c3
    f3 = c3 + c3 - e3
    s1 = r2 * (THIRTEEN * e1 * e1 + THREE * f1 * f1) + e
    s2 = r2 * (THIRTEEN * e2 * e2 + THREE * f2 * f2) + e
    s3 = r2 * (THIRTEEN * e3 * e3 + THREE * f3 * f3) + e
    a1 = s1 * s1
    a2 = s2 * s2
    a3 = s3 * s3
    if scheme == WENO5:
        w1 = a2 * a3
        w2 = SIX * a1 * a3
        w3 = THREE * a1 * a2
    else:
        t = (s1 - s3) * (s1 - s3)
        w1 = (a1 + t) * (a2 * a3)
        w2 = SIX * (a2 + t) * (a1 * a3)
        w3 = THREE * (a3 + t) * (a1 * a2)
    return middle + (TWO * w1 * left + w3 * right) / (SIX * (w1 + w2 + w3))


@inline
def ideal(u, m3, m2, m1, o, p1, p2, p3):
    """h u ∂q with the ideal weights, both sides at once: the centred sixth-order one, less |u|/60 sixth differences."""
    a, b, c, d, e, f = m3 - o, m2 - o, m1 - o, p1 - o, p2 - o, p3 - o
    slope = (f - a) - NINE * (e - b) + FORTY_FIVE * (d - c)
    return (u * slope - abs(u) * ((f + a) - SIX * (e + b) + FIFTEEN * (d + c))) / SIXTY


@inline
def along(scheme, u, m3, m2, m1, o, p1, p2, p3, r2, e):
    """h u ∂q of one axis; where the velocity is negative the mirrored stencil, whose sign is |u|/u.

    Both sides are loaded by now: a choice between loads would turn them into gathers.
    """
    if scheme == UPWIND5:
        return ideal(u, m3, m2, m1, o, p1, p2, p3)
    f = u > 0
    d = difference(
        scheme,
        m3 if f else p3,
        m2 if f else p2,
        m1 if f else p1,
        o,
        p1 if f else m1,
        p2 if f else m2,
        r2,
        e,
    )
    return abs(u) * d


@inline
def row2(scheme, out, base, q, u, v, I, n, s, k):
    x = s[0]
    a, b, c, r2, e = k[0], k[1], k[2], k[3], k[4]
    o, z = out[I : I + n], base[I : I + n]
    u0, u1, v0, v1 = u[I : I + n], u[I + x : I + x + n], v[I : I + n], v[I + 1 : I + 1 + n]
    xm3, xm2, xm1 = q[I - 3 * x : I - 3 * x + n], q[I - 2 * x : I - 2 * x + n], q[I - x : I - x + n]
    xp1, xp2, xp3 = q[I + x : I + x + n], q[I + 2 * x : I + 2 * x + n], q[I + 3 * x : I + 3 * x + n]
    m3, m2, m1, p0 = q[I - 3 : I - 3 + n], q[I - 2 : I - 2 + n], q[I - 1 : I - 1 + n], q[I : I + n]
    p1, p2, p3 = q[I + 1 : I + 1 + n], q[I + 2 : I + 2 + n], q[I + 3 : I + 3 + n]
    for i in range(n):
        g = along(scheme, u0[i] + u1[i], xm3[i], xm2[i], xm1[i], p0[i], xp1[i], xp2[i], xp3[i], r2, e)
        g += along(scheme, v0[i] + v1[i], m3[i], m2[i], m1[i], p0[i], p1[i], p2[i], p3[i], r2, e)
        o[i] = a * z[i] + b * p0[i] - c * g


@inline
def row3(scheme, out, base, q, u, v, w, I, n, s, k):
    x, y = s[0], s[1]
    a, b, c, r2, e = k[0], k[1], k[2], k[3], k[4]
    o, z = out[I : I + n], base[I : I + n]
    u0, u1, v0, v1 = u[I : I + n], u[I + x : I + x + n], v[I : I + n], v[I + y : I + y + n]
    w0, w1 = w[I : I + n], w[I + 1 : I + 1 + n]
    xm3, xm2, xm1 = q[I - 3 * x : I - 3 * x + n], q[I - 2 * x : I - 2 * x + n], q[I - x : I - x + n]
    xp1, xp2, xp3 = q[I + x : I + x + n], q[I + 2 * x : I + 2 * x + n], q[I + 3 * x : I + 3 * x + n]
    ym3, ym2, ym1 = q[I - 3 * y : I - 3 * y + n], q[I - 2 * y : I - 2 * y + n], q[I - y : I - y + n]
    yp1, yp2, yp3 = q[I + y : I + y + n], q[I + 2 * y : I + 2 * y + n], q[I + 3 * y : I + 3 * y + n]
    m3, m2, m1, p0 = q[I - 3 : I - 3 + n], q[I - 2 : I - 2 + n], q[I - 1 : I - 1 + n], q[I : I + n]
    p1, p2, p3 = q[I + 1 : I + 1 + n], q[I + 2 : I + 2 + n], q[I + 3 : I + 3 + n]
    for i in range(n):
        g = along(scheme, u0[i] + u1[i], xm3[i], xm2[i], xm1[i], p0[i], xp1[i], xp2[i], xp3[i], r2, e)
        g += along(scheme, v0[i] + v1[i], ym3[i], ym2[i], ym1[i], p0[i], yp1[i], yp2[i], yp3[i], r2, e)
        g += along(scheme, w0[i] + w1[i], m3[i], m2[i], m1[i], p0[i], p1[i], p2[i], p3[i], r2, e)
        o[i] = a * z[i] + b * p0[i] - c * g


@loop
def upwind1_2d(out, base, q, u, v, start, n, s, k):
    for r in prange(start.size):
        row2(UPWIND1, out, base, q, u, v, start[r], n, s, k)


@loop
def upwind1_3d(out, base, q, u, v, w, start, n, s, k):
    for r in prange(start.size):
        row3(UPWIND1, out, base, q, u, v, w, start[r], n, s, k)


@loop
def upwind5_2d(out, base, q, u, v, start, n, s, k):
    for r in prange(start.size):
        row2(UPWIND5, out, base, q, u, v, start[r], n, s, k)


@loop
def upwind5_3d(out, base, q, u, v, w, start, n, s, k):
    for r in prange(start.size):
        row3(UPWIND5, out, base, q, u, v, w, start[r], n, s, k)


@loop
def weno5_2d(out, base, q, u, v, start, n, s, k):
    for r in prange(start.size):
        row2(WENO5, out, base, q, u, v, start[r], n, s, k)


@loop
def weno5_3d(out, base, q, u, v, w, start, n, s, k):
    for r in prange(start.size):
        row3(WENO5, out, base, q, u, v, w, start[r], n, s, k)


@loop
def weno_z_2d(out, base, q, u, v, start, n, s, k):
    for r in prange(start.size):
        row2(WENO_Z, out, base, q, u, v, start[r], n, s, k)


@loop
def weno_z_3d(out, base, q, u, v, w, start, n, s, k):
    for r in prange(start.size):
        row3(WENO_Z, out, base, q, u, v, w, start[r], n, s, k)


@peak
def steepest_2d(top, q, start, n, s):
    """Largest |difference| of neighbours, h |∂q| in every row, into ``top``."""
    for r in prange(start.size):
        I, x = start[r], s[0]
        o, east, north = q[I : I + n], q[I + x : I + x + n], q[I + 1 : I + 1 + n]
        t = abs(o[0] - east[0])
        for i in range(n):
            t = max(t, max(abs(east[i] - o[i]), abs(north[i] - o[i])))
        top[r] = t


@peak
def steepest_3d(top, q, start, n, s):
    """Largest |difference| of neighbours, h |∂q| in every row, into ``top``."""
    for r in prange(start.size):
        I, x, y = start[r], s[0], s[1]
        o, east, north, up = q[I : I + n], q[I + x : I + x + n], q[I + y : I + y + n], q[I + 1 : I + 1 + n]
        t = abs(o[0] - east[0])
        for i in range(n):
            t = max(t, max(abs(east[i] - o[i]), max(abs(north[i] - o[i]), abs(up[i] - o[i]))))
        top[r] = t


@loop
def sharpen(out, u, start, n, s):
    """out = u - (u_low - 2 u + u_high)/8 on low faces: the average of two of them is of fourth order."""
    for r in prange(start.size):
        I = start[r]
        o, q, lo, hi = out[I : I + n], u[I : I + n], u[I - s : I - s + n], u[I + s : I + s + n]
        for i in range(n):
            o[i] = q[i] - 0.125 * (lo[i] - 2.0 * q[i] + hi[i])


@peak
def fastest_2d(top, u, v, start, n, s):
    """Largest |u| + |v| at the centres of every row, into ``top``."""
    for r in prange(start.size):
        I, x = start[r], s[0]
        u0, u1, v0, v1 = u[I : I + n], u[I + x : I + x + n], v[I : I + n], v[I + 1 : I + 1 + n]
        t = abs(u0[0] + u1[0])
        for i in range(n):
            t = max(t, abs(u0[i] + u1[i]) + abs(v0[i] + v1[i]))
        top[r] = t / 2


@peak
def fastest_3d(top, u, v, w, start, n, s):
    """Largest |u| + |v| + |w| at the centres of every row, into ``top``."""
    for r in prange(start.size):
        I, x, y = start[r], s[0], s[1]
        u0, u1, v0, v1 = u[I : I + n], u[I + x : I + x + n], v[I : I + n], v[I + y : I + y + n]
        w0, w1 = w[I : I + n], w[I + 1 : I + 1 + n]
        t = abs(u0[0] + u1[0])
        for i in range(n):
            t = max(t, abs(u0[i] + u1[i]) + abs(v0[i] + v1[i]) + abs(w0[i] + w1[i]))
        top[r] = t / 2
