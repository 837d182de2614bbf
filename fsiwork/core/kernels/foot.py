"""Values away from the grid's points, by tensor cubics: at the foot of a characteristic, at the nearest interface.

Places are padded indices, real numbers. ``box`` and ``joined`` hold for each direction the cells of the box and
whether it is periodic. A place outside the padded box is moved to its edge; a place that is no number gives no number.
"""

from math import floor

import numpy as np
from numba import prange

from fsiwork.core.grid import GHOSTS
from fsiwork.core.kernels import loop, point

FLAT = 0.04  # least |∇d|² of a distance that has a direction: less at the ridges of d and beyond a band


@point
def place(x, n):
    """``x`` where there are points on both sides."""
    if x < 1.0:
        x = 1.0
    if x > n + GHOSTS + 1.0:
        x = n + GHOSTS + 1.0
    return x


@point
def around(x, n, joined):
    """``x`` in the box where it is periodic."""
    return x - n * floor((x - GHOSTS) / n) if joined else x


@point
def cell(x, n):
    """Index of the point below; any will do for what is no number, whose weights carry it on."""
    return min(floor(x), n + GHOSTS) if x == x else GHOSTS


@point
def weights(x, i):
    t = x - i
    a, b, c = t + 1.0, t - 1.0, t - 2.0
    return -t * b * c / 6.0, a * b * c / 2.0, -a * t * c / 2.0, a * t * b / 6.0


@point
def at2(q, s, box, x, y):
    x, y = place(x, box[0]), place(y, box[1])
    i, j = cell(x, box[0]), cell(y, box[1])
    wx, wy = weights(x, i), weights(y, j)
    total = 0.0
    for k in range(4):
        J = (i - 1 + k) * s[0] + j
        total += wx[k] * (wy[0] * q[J - 1] + wy[1] * q[J] + wy[2] * q[J + 1] + wy[3] * q[J + 2])
    return total


@point
def at3(q, s, box, x, y, z):
    x = place(x, box[0])
    i = cell(x, box[0])
    wx = weights(x, i)
    total = 0.0
    for k in range(4):
        total += wx[k] * at2(q[(i - 1 + k) * s[0] : (i + k) * s[0]], s[1:], box[1:], y, z)
    return total


@loop
def semi_lagrangian_2d(out, q, u, v, start, n, s, box, ratio):
    """``out`` = q at the foot of the characteristic, two Runge-Kutta stages back; ``ratio`` is dt/h."""
    for r in prange(start.size):
        for I in range(start[r], start[r] + n):
            i, j = I // s[0], I % s[0]
            x = i - 0.25 * ratio * (u[I] + u[I + s[0]])
            y = j - 0.25 * ratio * (v[I] + v[I + 1])
            dx, dy = ratio * at2(u, s, box, x + 0.5, y), ratio * at2(v, s, box, x, y + 0.5)
            out[I] = at2(q, s, box, i - dx, j - dy)


@loop
def semi_lagrangian_3d(out, q, u, v, w, start, n, s, box, ratio):
    """As `semi_lagrangian_2d`."""
    for r in prange(start.size):
        for I in range(start[r], start[r] + n):
            i, j, k = I // s[0], I % s[0] // s[1], I % s[1]
            x = i - 0.25 * ratio * (u[I] + u[I + s[0]])
            y = j - 0.25 * ratio * (v[I] + v[I + s[1]])
            z = k - 0.25 * ratio * (w[I] + w[I + 1])
            dx = ratio * at3(u, s, box, x + 0.5, y, z)
            dy = ratio * at3(v, s, box, x, y + 0.5, z)
            dz = ratio * at3(w, s, box, x, y, z + 0.5)
            out[I] = at3(q, s, box, i - dx, j - dy, k - dz)


@point
def slope(q, I, a, b):
    """Difference along b at the face of stride a below I."""
    if a == b:
        return float(q[I]) - q[I - a]
    return 0.25 * (float(q[I + b]) - q[I - b] + q[I - a + b] - q[I - a - b])


@loop
def at_interface_2d(out, u, q, start, n, s, a, box, joined):
    """``out`` on the low faces of direction ``a`` = u at x - q∇q/|∇q|², the nearest point where q = 0."""
    for r in prange(start.size):
        for I in range(start[r], start[r] + n):
            gx, gy = slope(q, I, s[a], s[0]), slope(q, I, s[a], s[1])
            g = gx * gx + gy * gy
            d = 0.5 * (float(q[I]) + q[I - s[a]]) / g if g != 0.0 else 0.0
            x, y = around(I // s[0] - d * gx, box[0], joined[0]), around(I % s[0] - d * gy, box[1], joined[1])
            out[I] = at2(u, s, box, x, y)


@loop
def at_interface_3d(out, u, q, start, n, s, a, box, joined):
    """As `at_interface_2d`."""
    for r in prange(start.size):
        for I in range(start[r], start[r] + n):
            gx, gy, gz = slope(q, I, s[a], s[0]), slope(q, I, s[a], s[1]), slope(q, I, s[a], s[2])
            g = gx * gx + gy * gy + gz * gz
            d = 0.5 * (float(q[I]) + q[I - s[a]]) / g if g != 0.0 else 0.0
            x = around(I // s[0] - d * gx, box[0], joined[0])
            y = around(I % s[0] // s[1] - d * gy, box[1], joined[1])
            z = around(I % s[1] - d * gz, box[2], joined[2])
            out[I] = at3(u, s, box, x, y, z)


@point
def steepness(q, I, s):
    """4h²|∇q|² at a centre, of central differences; s[2] is 0 in the plane."""
    a, b, c = q[I + s[0]] - q[I - s[0]], q[I + s[1]] - q[I - s[1]], q[I + s[2]] - q[I - s[2]]
    return a * a + b * b + c * c


@loop
def stretches(out, q, d, start, n, s, h):
    """``out`` = |∇q|/|∇d| at the centres of the box, 0 where d is flat: both with the error of the same differences."""
    least = 4.0 * h * h * FLAT
    for r in prange(start.size):
        for I in range(start[r], start[r] + n):
            flat = steepness(d, I, s)
            out[I] = np.sqrt(steepness(q, I, s) / flat) if flat > least else 0.0


@point
def beyond(there, d, ends, reach):
    """``there`` between the two ``ends``; for |d| from reach[0] to reach[1] it goes over to the larger one."""
    there, part = min(max(there, ends[0]), ends[1]), (abs(d) - reach[0]) / (reach[1] - reach[0])
    return there + (ends[1] - there) * min(max(part, 0.0), 1.0)


@loop
def stretched_2d(out, d, stretch, start, n, s, box, joined, ends, reach, h):
    """``out`` = d times ``stretch`` at x - d∇d/|∇d|², the nearest point where d = 0; far off, and where d is flat,
    times the larger one of its ``ends``, so that nothing falls towards the edge of a band or a wall."""
    for r in prange(start.size):
        for I in range(start[r], start[r] + n):
            gx, gy = 0.5 * (d[I + s[0]] - d[I - s[0]]) / h, 0.5 * (d[I + s[1]] - d[I - s[1]]) / h
            g, there = gx * gx + gy * gy, ends[1]
            if g > FLAT:
                far = d[I] / (h * g)
                x, y = around(I // s[0] - far * gx, box[0], joined[0]), around(I % s[0] - far * gy, box[1], joined[1])
                there = at2(stretch, s, box, x, y)
            out[I] = d[I] * beyond(there, d[I], ends, reach)


@loop
def stretched_3d(out, d, stretch, start, n, s, box, joined, ends, reach, h):
    """As `stretched_2d`."""
    for r in prange(start.size):
        for I in range(start[r], start[r] + n):
            gx, gy = 0.5 * (d[I + s[0]] - d[I - s[0]]) / h, 0.5 * (d[I + s[1]] - d[I - s[1]]) / h
            gz = 0.5 * (d[I + s[2]] - d[I - s[2]]) / h
            g, there = gx * gx + gy * gy + gz * gz, ends[1]
            if g > FLAT:
                far = d[I] / (h * g)
                x = around(I // s[0] - far * gx, box[0], joined[0])
                y = around(I % s[0] // s[1] - far * gy, box[1], joined[1])
                z = around(I % s[1] - far * gz, box[2], joined[2])
                there = at3(stretch, s, box, x, y, z)
            out[I] = d[I] * beyond(there, d[I], ends, reach)
