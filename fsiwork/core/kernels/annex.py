"""The annex's simpler schemes for ∂t q + u·∇q = 0 at cell centres (7.4), in 2D and 3D.

The kernels of a Runge-Kutta stage write ``out = a base + b (q - dt u·∇q)`` with ``k = (a, b, b dt/2h, …)``; ``u`` is
the tuple of the velocity's components on their low faces, ``s`` the strides of all axes. The one-step kernels make the
whole step along one axis of stride ``s``, with its component ``u``. ``q`` needs three ghosts and ``out`` must share no
memory with it. Rows may overlap: every one is finished before it is written.
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, loop

CENTRED, ENO2, ENO3, LAX_WENDROFF, BEAM_WARMING, FROMM = range(6)
TWO, THREE, SIX = (np.float32(c) for c in (2, 3, 6))  # single, so that float32 fields stay float32

inline = njit(error_model="numpy", fastmath=FASTMATH, inline="always")


@inline
def smaller(a, b):
    return a if abs(a) <= abs(b) else b


@inline
def difference(scheme, m3, m2, m1, o, p1, p2, c):
    """h ∂q at ``o`` from three points upstream (m) and two downstream (p); ``c`` is the CFL number of a one-step
    scheme, whose own expansion in time is part of the difference."""
    v2, v3, v4 = m1 - m2, o - m1, p1 - o
    c2, c3 = v3 - v2, v4 - v3
    if scheme == CENTRED:
        return v3 + c3 / TWO
    if scheme == LAX_WENDROFF:
        return v3 + (c3 - c * c3) / TWO
    if scheme == BEAM_WARMING:
        return v3 + (c2 - c * c2) / TWO
    if scheme == FROMM:
        return v3 + (c2 + c3 - c * (c2 + c3)) / (TWO * TWO)
    if scheme == ENO2:
        return v3 + smaller(c2, c3) / TWO
    e1, e2, e3 = c2 - (v2 - (m2 - m3)), c3 - c2, (p2 - p1) - v4 - c3
    left, right = c2 / TWO + smaller(e1, e2) / THREE, c3 / TWO - smaller(e2, e3) / SIX
    return v3 + (left if abs(c2) <= abs(c3) else right)


@inline
def mirrored(scheme, w, m3, m2, m1, o, p1, p2, p3, c):
    """h w ∂q; where ``w`` is negative the mirrored stencil, whose sign is |w|/w (both sides are loaded by now)."""
    f = w > 0
    d = difference(
        scheme,
        m3 if f else p3,
        m2 if f else p2,
        m1 if f else p1,
        o,
        p1 if f else m1,
        p2 if f else m2,
        c,
    )
    return abs(w) * d


@inline
def stage(scheme, out, base, q, u, I, n, strides, k):
    g = np.zeros(n, q.dtype)
    for axis in range(len(u)):
        s = strides[axis]
        u0, u1 = u[axis][I : I + n], u[axis][I + s : I + s + n]
        m3, m2, m1 = q[I - 3 * s : I - 3 * s + n], q[I - 2 * s : I - 2 * s + n], q[I - s : I - s + n]
        p1, p2, p3 = q[I + s : I + s + n], q[I + 2 * s : I + 2 * s + n], q[I + 3 * s : I + 3 * s + n]
        p0 = q[I : I + n]
        for i in range(n):
            w = u0[i] + u1[i]
            g[i] += mirrored(scheme, w, m3[i], m2[i], m1[i], p0[i], p1[i], p2[i], p3[i], w)
    o, z, p0 = out[I : I + n], base[I : I + n], q[I : I + n]
    for i in range(n):
        o[i] = k[0] * z[i] + k[1] * p0[i] - k[2] * g[i]


@inline
def whole(scheme, out, q, u, I, n, s, ratio):
    """``ratio`` is dt/2h. The CFL number is that of the velocity half a step upstream, u - ½ dt u ∂u: without it a
    one-step scheme is of first order where u changes."""
    o, u0, u1 = out[I : I + n], u[I : I + n], u[I + s : I + s + n]
    m2, m1, p0 = q[I - 2 * s : I - 2 * s + n], q[I - s : I - s + n], q[I : I + n]
    p1, p2 = q[I + s : I + s + n], q[I + 2 * s : I + 2 * s + n]
    for i in range(n):
        w = ratio * (u0[i] + u1[i])
        w -= w * (ratio * (u1[i] - u0[i]))
        o[i] = p0[i] - mirrored(scheme, w, m2[i], m2[i], m1[i], p0[i], p1[i], p2[i], p2[i], abs(w))


@loop
def centred(out, base, q, u, start, n, s, k):
    for r in prange(start.size):
        stage(CENTRED, out, base, q, u, start[r], n, s, k)


@loop
def eno2(out, base, q, u, start, n, s, k):
    for r in prange(start.size):
        stage(ENO2, out, base, q, u, start[r], n, s, k)


@loop
def eno3(out, base, q, u, start, n, s, k):
    for r in prange(start.size):
        stage(ENO3, out, base, q, u, start[r], n, s, k)


@loop
def lax_wendroff(out, q, u, start, n, s, ratio):
    for r in prange(start.size):
        whole(LAX_WENDROFF, out, q, u, start[r], n, s, ratio)


@loop
def beam_warming(out, q, u, start, n, s, ratio):
    for r in prange(start.size):
        whole(BEAM_WARMING, out, q, u, start[r], n, s, ratio)


@loop
def fromm(out, q, u, start, n, s, ratio):
    for r in prange(start.size):
        whole(FROMM, out, q, u, start[r], n, s, ratio)
