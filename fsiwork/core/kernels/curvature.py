"""Mean and Gaussian curvature of the level surfaces of φ at given nodes, from differences of second or fourth order."""

import math

from numba import prange

from fsiwork.core.kernels import loop, point


@point
def first(m2, m1, p1, p2, fourth):
    """h ∂φ."""
    return (8 * (p1 - m1) - (p2 - m2)) / 12 if fourth else 0.5 * (p1 - m1)


@point
def second(m2, m1, o, p1, p2, fourth):
    """h² ∂²φ."""
    near = (m1 - o) - (o - p1)
    return (16 * near - ((m2 - o) - (o - p2))) / 12 if fourth else near


@point
def along(q, i, s, fourth):
    return first(q[i - 2 * s], q[i - s], q[i + s], q[i + 2 * s], fourth)


@point
def twice(q, i, s, fourth):
    return second(q[i - 2 * s], q[i - s], q[i], q[i + s], q[i + 2 * s], fourth)


@point
def mixed(q, i, s, t, fourth):
    """h² ∂_s∂_t φ: the first difference along t of that along s."""
    if fourth:
        outer = first(along(q, i - 2 * t, s, True), along(q, i - t, s, True), 0.0, 0.0, True)
        return outer + first(0.0, 0.0, along(q, i + t, s, True), along(q, i + 2 * t, s, True), True)
    return 0.25 * ((q[i + s + t] - q[i - s + t]) - (q[i + s - t] - q[i - s - t]))


@loop
def curvatures(mean, gauss, q, nodes, x, y, z, c, fourth, floor):
    """``mean`` = div n and ``gauss`` = n·adj(∇²φ)n/|∇φ|² at the flat indices ``nodes``; ``c`` = 1/h."""
    for k in prange(nodes.size):
        i = nodes[k]
        a, b, d = along(q, i, x, fourth), along(q, i, y, fourth), along(q, i, z, fourth)
        xx, yy, zz = twice(q, i, x, fourth), twice(q, i, y, fourth), twice(q, i, z, fourth)
        xy, xz, yz = mixed(q, i, x, y, fourth), mixed(q, i, x, z, fourth), mixed(q, i, y, z, fourth)
        r = c / math.sqrt(a * a + b * b + d * d + floor)
        a, b, d = a * r / c, b * r / c, d * r / c
        xx, yy, zz, xy, xz, yz = xx * r, yy * r, zz * r, xy * r, xz * r, yz * r  # in units of 1/length
        bent = (yy + zz) * a * a + (xx + zz) * b * b + (xx + yy) * d * d
        mean[k] = bent - 2 * (a * b * xy + a * d * xz + b * d * yz)
        bent = (yy * zz - yz * yz) * a * a + (xx * zz - xz * xz) * b * b + (xx * yy - xy * xy) * d * d
        gauss[k] = bent + 2 * ((xz * yz - xy * zz) * a * b + (xy * yz - xz * yy) * a * d + (xy * xz - yz * xx) * b * d)
