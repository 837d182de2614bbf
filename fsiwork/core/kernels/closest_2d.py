"""Closest points in the plane: Newton's method on tensor Lagrange polynomials, seeds, their spreading through a band.

Positions are indices of the padded array, lengths are in cells. A *seed* is the point of the line closest to a node
next to it, with unit normal and curvature (7.1), so that any node finds its own closest point from the circle there.
"""

import numpy as np
from numba import njit

from fsiwork.core.kernels import FASTMATH, point

serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)

ROUNDS = 15  # of Newton's method; four are usual
FREE = 3  # rounds that may change the cell: the interpolant is only continuous, at its creases Newton would not settle
SETTLED = 1e-6  # last step [cells]: its square is what remains
FLAT = 0.25  # least 1 + λκ: nearer to the centre of curvature the step is not Newton's, but still downhill

SLACK = 0.5  # a seed may be farther than the linear crossing of a grid line by so much [cells]


def interpolant(p):
    """Function for value, gradient and second derivatives of the polynomial through p × p nodes around a cell."""
    nodes = np.arange(p) - (p // 2 - 1.0)
    c = np.linalg.inv(nodes[:, None] ** np.arange(p)).T.copy()  # weights of node k are Σ c[k, m] s^m

    @point
    def evaluate(q, base, stride, s, t, w):
        for k in range(p):
            f = g = f1 = g1 = f2 = g2 = 0.0
            for m in range(p - 1, -1, -1):
                f2, g2 = f2 * s + f1, g2 * t + g1
                f1, g1 = f1 * s + f, g1 * t + g
                f, g = f * s + c[k, m], g * t + c[k, m]
            w[0, k], w[1, k], w[2, k], w[3, k], w[4, k], w[5, k] = f, f1, 2 * f2, g, g1, 2 * g2
        f = fx = fy = fxx = fxy = fyy = 0.0
        for k in range(p):
            a = ax = axx = 0.0
            for m in range(p):
                v = q[base + m * stride + k]
                a += w[0, m] * v
                ax += w[1, m] * v
                axx += w[2, m] * v
            f += w[3, k] * a
            fx += w[3, k] * ax
            fxx += w[3, k] * axx
            fy += w[4, k] * a
            fxy += w[4, k] * ax
            fyy += w[5, k] * a
        return f, fx, fy, fxx, fxy, fyy

    return evaluate


cubic, quintic = interpolant(4), interpolant(6)


@point
def project(q, n, order, node, start, w):
    """Closest point of the line to ``node`` from ``start``: (x, y, normal, curvature, whether it was found).

    Each round goes to the line along ∇ψ, and along the line to the stationary point of the distance, by one cell at
    most (Newton's method for (y - x) + λ∇ψ = 0, ψ = 0).
    """
    half = order // 2
    x, y = start
    i = j = 0
    nx = ny = bend = 0.0
    for k in range(ROUNDS):
        if k < FREE:
            i, j = int(np.floor(x)), int(np.floor(y))
            i, j = min(max(i, half), n[0] - 1 - half), min(max(j, half), n[1] - 1 - half)
        base = (i - half) * n[1] + j - half
        if order == 3:
            f, fx, fy, fxx, fxy, fyy = cubic(q, base, n[1], x - i, y - j, w)
        else:
            f, fx, fy, fxx, fxy, fyy = quintic(q, base, n[1], x - i, y - j, w)
        slope = np.sqrt(fx * fx + fy * fy)
        if not slope > 0:
            break
        nx, ny = fx / slope, fy / slope
        bend = (nx * (nx * fyy - 2 * ny * fxy) + ny * ny * fxx) / slope
        twist = (nx * ny * (fyy - fxx) + (nx * nx - ny * ny) * fxy) / slope
        rx, ry = node[0] - x, node[1] - y
        off = rx * nx + ry * ny
        down = -f / slope
        along = (ry * nx - rx * ny - off * down * twist) / max(1 + off * bend, FLAT)
        size = np.sqrt(down * down + along * along)
        if not size < 1e3:
            break
        cut = 1 / max(size, 1.0)
        x += cut * (down * nx - along * ny)
        y += cut * (down * ny + along * nx)
        if size < SETTLED:
            return x, y, nx, ny, bend, 0 <= x <= n[0] - 1 and 0 <= y <= n[1] - 1
    return x, y, nx, ny, bend, False


@serial
def scan(q, n, out, far):
    """Fill ``out`` with ± far by the sign of q; the nodes next to a change of sign or with q = 0. NaN in q: -1 nodes."""
    near, count, sound = np.empty(q.size, np.int32), 0, 0.0
    for i in range(n[0]):
        row, below, above = q[i * n[1] :], q[max(i - 1, 0) * n[1] :], q[min(i + 1, n[0] - 1) * n[1] :]
        o = out[i * n[1] :]
        for j in range(n[1]):
            o[j] = -far if row[j] < 0 else far
            sound += 0 * row[j]
        for j in range(n[1]):
            minus = row[j] < 0
            change = ((below[j] < 0) ^ minus) | ((above[j] < 0) ^ minus) | (row[j] == 0)
            change |= ((row[max(j - 1, 0)] < 0) ^ minus) | ((row[min(j + 1, n[1] - 1)] < 0) ^ minus)
            if change:
                near[count] = i * n[1] + j
                count += 1
    return near[:count] if sound == 0 else near[:0], sound == 0


@serial
def seeds(q, n, near, order):
    """Seeds of the nodes ``near``, shape (nodes, 5): x, y, normal, curvature; a normal of zero where there is none.

    Newton starts at the nearest crossing of a grid line from the node, which also is the seed should it fail.
    """
    found, w = np.zeros((near.size, 5)), np.empty((6, order + 1))
    for k in range(near.size):
        i, j = near[k] // n[1], near[k] % n[1]
        v = q[near[k]]
        best, x, y = 2.0, float(i), float(j)
        for side in range(4):
            di, dj = (side - 1) * (side < 3) * ((side + 1) % 2), (side - 2) * (side % 2)
            if 0 <= i + di < n[0] and 0 <= j + dj < n[1]:
                other = q[(i + di) * n[1] + j + dj]
                part = v / (v - other)
                if (other < 0) != (v < 0) and part < best:
                    best, x, y = part, i + part * di, j + part * dj
        if v == 0:
            best, x, y = 0.0, float(i), float(j)
        found[k, 0], found[k, 1] = x, y
        x, y, nx, ny, bend, good = project(q, n, order, (i, j), (x, y), w)
        if good and (x - i) ** 2 + (y - j) ** 2 <= (best + SLACK) ** 2:
            found[k, 0], found[k, 1], found[k, 2], found[k, 3], found[k, 4] = x, y, nx, ny, bend
    return found


@serial
def spread(n, near, found, band):
    """Nodes within the band, in rings, and the nearest seed of each node of the box (-1: none).

    A queue of nodes whose seed has changed: they offer it to their four neighbours.
    """
    size = n[0] * n[1]
    seed, waiting = np.full(size, -1, np.int32), np.zeros(size, np.bool_)
    nodes, queue = np.empty(size, np.int32), np.empty(size, np.int32)
    count = tail = near.size
    head = 0
    for k in range(near.size):
        nodes[k] = queue[k] = near[k]
        seed[near[k]] = k
        waiting[near[k]] = True
    tail %= size
    held = near.size
    while held > 0:
        at = queue[head]
        head = head + 1 if head + 1 < size else 0
        held -= 1
        waiting[at] = False
        i, j, s = at // n[1], at % n[1], seed[at]
        for side in range(4):
            a, b = i + (side == 2) - (side == 0), j + (side == 3) - (side == 1)
            if not (0 <= a < n[0] and 0 <= b < n[1]):
                continue
            to = a * n[1] + b
            if seed[to] == s:
                continue
            far = (found[s, 0] - a) ** 2 + (found[s, 1] - b) ** 2
            if far > band * band + 1:
                continue
            if seed[to] < 0:
                nodes[count] = to
                count += 1
            elif far >= (found[seed[to], 0] - a) ** 2 + (found[seed[to], 1] - b) ** 2:
                continue
            seed[to] = s
            if not waiting[to]:
                waiting[to] = True
                queue[tail] = to
                tail = tail + 1 if tail + 1 < size else 0
                held += 1
    return nodes[:count].copy(), seed


@serial
def polish(q, n, order, nodes, seed, found, far, h, out):
    """Distances [length] of the nodes from Newton's method, started on the circle of their seed."""
    w = np.empty((6, order + 1))
    for at in nodes:
        i, j, k = at // n[1], at % n[1], seed[at]
        sx, sy, nx, ny, bend = found[k, 0], found[k, 1], found[k, 2], found[k, 3], found[k, 4]
        rx, ry = i - sx, j - sy
        most = np.sqrt(rx * rx + ry * ry)
        along = (ry * nx - rx * ny) / max(1 + (rx * nx + ry * ny) * bend, FLAT)
        along = min(max(along, -1.0), 1.0)
        fall = 0.5 * bend * along * along
        start = sx - along * ny - fall * nx, sy + along * nx - fall * ny
        x, y, _, _, _, good = project(q, n, order, (i, j), start, w)
        r = np.sqrt((i - x) ** 2 + (j - y) ** 2)
        if good and r < most:
            most = r
        most = min(most, far) * h
        out[at] = -most if q[at] < 0 else most
