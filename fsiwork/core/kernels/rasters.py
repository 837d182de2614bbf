"""Nodes next to the interface, and the seed of every node: the nearest point of a list, carried over all or a band.

Points are rows (x, y, z, …) of indices of the array (n₀, n₁, n₂); in the plane n₀ = 1 and x = 0.
"""

import numpy as np
from numba import njit

from fsiwork.core.kernels import FASTMATH, point

FAR = 1e6  # cells

serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)


@point
def square(p, s, i, j, k):
    """Square of the distance of point s from a node."""
    x, y, z = p[s, 0] - i, p[s, 1] - j, p[s, 2] - k
    return x * x + y * y + z * z


@point
def line(q, n, i, j):
    """The row (i, j), or the nearest there is."""
    at = (min(max(i, 0), n[0] - 1) * n[1] + min(max(j, 0), n[1] - 1)) * n[2]
    return q[at : at + n[2]]


@serial
def scan(q, n, out, far):
    """Fill ``out`` with ± far by the sign of q; nodes next to a change of sign or with q = 0; whether q is finite."""
    near, count, sound = np.empty(q.size, np.int32), 0, 0.0
    flag, edge = np.zeros(n[2], np.uint8), np.empty(n[2] + 2)
    left, right = edge, edge[2:]
    for i in range(n[0]):
        for j in range(n[1]):
            here, o = line(q, n, i, j), line(out, n, i, j)
            south, north = line(q, n, i - 1, j), line(q, n, i + 1, j)
            below, above = line(q, n, i, j - 1), line(q, n, i, j + 1)
            edge[0], edge[n[2] + 1] = here[0], here[n[2] - 1]
            edge[1 : n[2] + 1] = here
            some = 0
            for k in range(n[2]):
                o[k] = -far if here[k] < 0 else far
                sound += 0 * here[k]
            for k in range(n[2]):
                minus = here[k] < 0
                change = ((south[k] < 0) ^ minus) | ((north[k] < 0) ^ minus) | ((below[k] < 0) ^ minus)
                change |= ((above[k] < 0) ^ minus) | ((left[k] < 0) ^ minus) | ((right[k] < 0) ^ minus)
                flag[k] = change | (here[k] == 0)
                some += flag[k]
            if some > 0:
                for k in range(n[2]):
                    if flag[k]:
                        near[count] = (i * n[1] + j) * n[2] + k
                        count += 1
    return near[:count].copy(), sound == 0


@point
def root(p, count, linear):
    """The root in [0, 1] of the polynomial Σ p_m s^m, whose signs differ there: Newton, kept inside."""
    a, b, s = 0.0, 1.0, linear
    below = p[0] < 0
    for _ in range(60):
        value = slope = 0.0
        for m in range(count - 1, -1, -1):
            slope = slope * s + value
            value = value * s + p[m]
        if (value < 0) == below:
            a = s
        else:
            b = s
        new = s - value / slope if slope != 0 else a
        if not a < new < b:
            new = 0.5 * (a + b)
        if abs(new - s) < 1e-14:
            break
        s = new
    return s


@serial
def crossings(q, n, near, c):
    """Nearest point, shape (nodes, 3), where a grid line from a node meets the interface; the node itself with q = 0.

    ``c``: coefficient m on the polynomial of node k of the line, which is k - (size/2 - 1) nodes ahead.
    """
    out, p, size = np.empty((near.size, 3)), np.empty(len(c)), len(c)
    for s in range(near.size):
        at, best = near[s], 2.0
        place = at // (n[1] * n[2]), at // n[2] % n[1], at % n[2]
        out[s, 0], out[s, 1], out[s, 2] = place
        for side in range(6):
            axis, way = side // 2, 2 * (side % 2) - 1
            ahead = place[axis] + way
            stride = way * (n[1] * n[2] if axis == 0 else n[2] if axis == 1 else 1)
            if q[at] == 0 or not 0 <= ahead < n[axis] or (q[at + stride] < 0) == (q[at] < 0):
                continue
            linear = q[at] / (q[at] - q[at + stride])
            p[:] = 0.0
            for k in range(size):
                there = min(max(place[axis] + way * (k - size // 2 + 1), 0), n[axis] - 1)
                for m in range(size):
                    p[m] += c[k, m] * q[at + (there - place[axis]) * way * stride]
            part = root(p, size, linear)
            if part < best:
                best = part
                out[s, 0], out[s, 1], out[s, 2] = place
                out[s, axis] += way * part
    return out


@point
def along(seed, at, count, step, p, i, j, k):
    """Each of ``count`` nodes from ``at`` = (i, j, k) on takes the seed of the one before it if that is nearer."""
    last = seed[at]
    x, y, z = p[last, 0], p[last, 1], p[last, 2]
    for m in range(1, count):
        k += step
        own = seed[at + m * step]
        a, b, c = p[own, 0], p[own, 1], p[own, 2]
        gain = (a - i) ** 2 - (x - i) ** 2 + ((b - j) ** 2 - (y - j) ** 2) + ((c - k) ** 2 - (z - k) ** 2)
        take = gain > 0
        last = last if take else own
        x, y, z = x if take else a, y if take else b, z if take else c
        seed[at + m * step] = last


@point
def across(seed, at, count, back, p, i, j):
    """Each of ``count`` nodes from ``at`` = (i, j, 0) on takes the nearest of its seed and those of the node ``back``
    from it and of the two beside that. (One after the other, without a branch: faster than all in one.)"""
    for shift in (0, -1, 1):
        for k in range(max(-shift, 0), count - max(shift, 0)):
            own, other = seed[at + k], seed[at + k + back + shift]
            gain = (p[own, 0] - i) ** 2 - (p[other, 0] - i) ** 2 + ((p[own, 1] - j) ** 2 - (p[other, 1] - j) ** 2)
            gain += (p[own, 2] - k) ** 2 - (p[other, 2] - k) ** 2
            seed[at + k] = other if gain > 0 else own


@serial
def sweep(n, near, found):
    """Seeds of all nodes by raster sweeps (Danielsson 1980): plane by plane up and down, in each row by row up and
    down, in each node by node to and fro."""
    rows, m = n[1] * n[2], near.size
    p = np.full((m + 1, 3), FAR, np.float32)  # the last one stands for none
    seed = np.full(n[0] * rows, m, np.int32)
    for s in range(m):
        seed[near[s]] = s
        p[s, 0], p[s, 1], p[s, 2] = found[s, 0], found[s, 1], found[s, 2]
    for turn in range(1 if n[0] == 1 else 2):
        for plane in range(n[0]):
            i = plane if turn == 0 else n[0] - 1 - plane
            if plane > 0:
                for j in range(n[1]):
                    across(seed, (i * n[1] + j) * n[2], n[2], -rows if turn == 0 else rows, p, i, j)
            for way in range(2):
                for row in range(n[1]):
                    j = row if way == 0 else n[1] - 1 - row
                    at = (i * n[1] + j) * n[2]
                    if row > 0:
                        across(seed, at, n[2], -n[2] if way == 0 else n[2], p, i, j)
                    along(seed, at, n[2], 1, p, i, j, 0)
                    along(seed, at + n[2] - 1, n[2], -1, p, i, j, n[2] - 1)
    return seed


@serial
def spread(n, near, points, band):
    """Nodes within the band [cells], in rings, and the nearest seed of every node of the array (-1: none).

    A queue of nodes whose seed has changed: they offer it to their neighbours.
    """
    rows = n[1] * n[2]
    size = n[0] * rows
    seed, waiting = np.full(size, -1, np.int32), np.zeros(size, np.bool_)
    nodes, queue = np.empty(size, np.int32), np.empty(size, np.int32)
    count = held = near.size
    head = 0
    for s in range(near.size):
        nodes[s] = queue[s] = near[s]
        seed[near[s]] = s
        waiting[near[s]] = True
    while held > 0:
        at = queue[head]
        head, held = (head + 1) % size, held - 1
        waiting[at] = False
        i, j, k, own = at // rows, at // n[2] % n[1], at % n[2], seed[at]
        for side in range(2 if n[0] == 1 else 0, 6):
            step = 2 * (side % 2) - 1
            a, b, c = i + step * (side < 2), j + step * (side // 2 == 1), k + step * (side > 3)
            if not (0 <= a < n[0] and 0 <= b < n[1] and 0 <= c < n[2]):
                continue
            to = (a * n[1] + b) * n[2] + c
            had, far = seed[to], square(points, own, a, b, c)
            if had == own or far > (band + 0.7) ** 2:
                continue
            if had < 0:
                nodes[count] = to
                count += 1
            elif far >= square(points, had, a, b, c):
                continue
            seed[to] = own
            if not waiting[to]:
                waiting[to] = True
                queue[(head + held) % size] = to
                held += 1
    return nodes[:count].copy(), seed
