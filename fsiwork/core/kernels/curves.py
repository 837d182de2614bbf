"""Tangent of the curve through a node in which the level surfaces of two fields meet, and its changes along the curve.

Nested central differences of second or fourth order: τ reads the neighbours of a node, Hn = (∇τ)τ those of τ, and the
torsion those of Hn: three nodes along an axis in all, or six.
"""

import math

from numba import prange

from fsiwork.core.kernels import loop, point


@point
def along(q, i, s, fourth):
    """2h ∂q."""
    near = q[i + s] - q[i - s]
    return (8 * near - (q[i + 2 * s] - q[i - 2 * s])) / 6 if fourth else near


@point
def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@point
def unit(a):
    """a/|a|, 0 where a is 0 or too small to have a direction; scaled first, so that no square under- or overflows."""
    largest = max(abs(a[0]), abs(a[1]), abs(a[2]))
    if largest == 0:
        return a
    a = a[0] / largest, a[1] / largest, a[2] / largest
    r = 1 / math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    return a[0] * r, a[1] * r, a[2] * r


@point
def tangent(p, q, i, x, y, z, fourth):
    """(1.17); the two gradients are brought to length 1 first."""
    a = unit((along(p, i, x, fourth), along(p, i, y, fourth), along(p, i, z, fourth)))
    b = unit((along(q, i, x, fourth), along(q, i, y, fourth), along(q, i, z, fourth)))
    return unit(cross(a, b))


@point
def bend(p, q, i, x, y, z, c, fourth):
    """Hn = (∇τ)τ, (1.19); ``c`` = 1/(2h)."""
    t = tangent(p, q, i, x, y, z, fourth)
    k0, k1, k2 = 0.0, 0.0, 0.0
    for a in range(3):
        s = x if a == 0 else y if a == 1 else z
        for reach in range(1, 3 if fourth else 2):
            high = tangent(p, q, i + reach * s, x, y, z, fourth)
            low = tangent(p, q, i - reach * s, x, y, z, fourth)
            f = c * t[a] * share(reach, fourth)
            k0 += f * (high[0] - low[0])
            k1 += f * (high[1] - low[1])
            k2 += f * (high[2] - low[2])
    return k0, k1, k2


@point
def share(reach, fourth):
    """Weight of a pair of neighbours in 2h ∂."""
    return (4 / 3 if reach == 1 else -1 / 6) if fourth else 1.0


@loop
def jets(out, p, q, nodes, x, y, z, c, fourth):
    """τ, k = (∇τ)τ = Hn and (∇k)τ = H'n + H(∇n)τ at the flat indices ``nodes``: rows of ``out`` (3, 3, nodes)."""
    for m in prange(nodes.size):
        i = nodes[m]
        t, k = tangent(p, q, i, x, y, z, fourth), bend(p, q, i, x, y, z, c, fourth)
        r0, r1, r2 = 0.0, 0.0, 0.0
        for a in range(3):
            s = x if a == 0 else y if a == 1 else z
            for reach in range(1, 3 if fourth else 2):
                high = bend(p, q, i + reach * s, x, y, z, c, fourth)
                low = bend(p, q, i - reach * s, x, y, z, c, fourth)
                f = c * t[a] * share(reach, fourth)
                r0 += f * (high[0] - low[0])
                r1 += f * (high[1] - low[1])
                r2 += f * (high[2] - low[2])
        for a in range(3):
            out[0, a, m], out[1, a, m] = t[a], k[a]
        out[2, 0, m], out[2, 1, m], out[2, 2, m] = r0, r1, r2
