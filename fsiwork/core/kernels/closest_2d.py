"""Closest points in the plane: Newton's method on tensor Lagrange polynomials, seeds, and distances from both.

Positions are indices of the padded array, lengths are in cells. A *seed* is the point of the line closest to a node
next to it, with unit normal and curvature (7.1), so that any node finds its own closest point from the parabola there.
"""

import numpy as np
from numba import njit

from fsiwork.core.kernels import FASTMATH, point

serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)

ROUNDS = 15  # of Newton's method; four are usual
FREE = 3  # rounds that may change the cell: the interpolant is only continuous, at its creases Newton would not settle
SETTLED = 1e-6  # last step [cells]: its square is what remains
FLAT = 0.25  # least 1 + λκ: nearer to the centre of curvature the step is not Newton's, but still downhill

REACH = 2.0  # of a seed along its parabola [cells]
NEAR = 1e-9  # by so much a closest point may be farther than the point it replaces [cells]


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
            i, j = min(max(i, half), n[0] - 2 - half), min(max(j, half), n[1] - 2 - half)
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
def seeds(q, n, near, start, order):
    """Seeds of the nodes ``near``, shape (nodes, 6): 0, x, y, normal, curvature; a normal of zero where there is none.

    Newton starts at points of grid lines, ``start``: 0, x, y; each is the seed should nothing nearer be found.
    """
    found, w = np.zeros((near.size, 6)), np.empty((6, order + 1))
    for s in range(near.size):
        i, j = float(near[s] // n[1]), float(near[s] % n[1])
        x, y = start[s, 1], start[s, 2]
        most = np.sqrt((x - i) ** 2 + (y - j) ** 2)
        found[s, 1], found[s, 2] = x, y
        x, y, nx, ny, bend, good = project(q, n, order, (i, j), (x, y), w)
        if good and np.sqrt((x - i) ** 2 + (y - j) ** 2) <= most + NEAR:
            found[s, 1:] = x, y, nx, ny, bend
    return found


@serial
def distances(q, n, order, polished, nodes, seed, found, out):
    """Distances of the nodes [cells], at most what stands in ``out``, from the parabola of their seed; at ``polished``
    cells or less by Newton's method that starts there."""
    w = np.empty((6, order + 1))
    for at in nodes:
        s, i, j, most = seed[at], float(at // n[1]), float(at % n[1]), abs(out[at])
        x, y, nx, ny, bend = found[s, 1], found[s, 2], found[s, 3], found[s, 4], found[s, 5]
        rx, ry = i - x, j - y
        far = np.sqrt(rx * rx + ry * ry)
        if nx != 0 or ny != 0:
            along = (ry * nx - rx * ny) / max(1 + (rx * nx + ry * ny) * bend, FLAT)
            along = min(max(along, -REACH), REACH)
            fall = 0.5 * bend * along * along
            x, y, good = x - along * ny - fall * nx, y + along * nx - fall * ny, True
            circle = np.sqrt((i - x) ** 2 + (j - y) ** 2)
            if circle < min(polished, most + 0.1):
                x, y, _, _, _, good = project(q, n, order, (i, j), (x, y), w)
                circle = np.sqrt((i - x) ** 2 + (j - y) ** 2)
            if good:
                far = min(far, circle)
        most = min(most, far)
        out[at] = -most if q[at] < 0 else most
