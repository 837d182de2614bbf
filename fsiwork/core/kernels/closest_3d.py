"""Closest points in space: Newton's method on tensor Lagrange polynomials, seeds, and distances from both.

Positions are indices of the padded array, lengths are in cells. A *seed* is the point of the surface closest to a node
next to it, with unit normal and the second fundamental form in the `frame` of that normal, so that any node finds its
own closest point from the paraboloid there.
"""

import numpy as np
from numba import njit

from fsiwork.core.kernels import FASTMATH, point

serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)

ROUNDS = 15  # of Newton's method; four are usual
FREE = 3  # rounds that may change the cell: the interpolant is only continuous, at its creases Newton would not settle
SETTLED = 1e-6  # last step [cells]: its square is what remains
FLAT = 0.25  # least eigenvalue of 1 + λκ: nearer to a focal point the step is not Newton's, but still downhill
REACH = 2.0  # of a seed along its paraboloid [cells]
NEAR = 1e-9  # by so much a closest point may be farther than the point it replaces [cells]


def interpolant(p):
    """Function for value, gradient and second derivatives (written into ``d``) of the polynomial through p³ nodes."""
    nodes = np.arange(p) - (p // 2 - 1.0)
    c = np.linalg.inv(nodes[:, None] ** np.arange(p)).T.copy()  # weights of node k are Σ c[k, m] s^m

    @point
    def evaluate(q, base, sx, sy, s, w, d):
        for a in range(3):
            for k in range(p):
                f = f1 = f2 = 0.0
                for m in range(p - 1, -1, -1):
                    f2 = f2 * s[a] + f1
                    f1 = f1 * s[a] + f
                    f = f * s[a] + c[k, m]
                w[a, 0, k], w[a, 1, k], w[a, 2, k] = f, f1, 2 * f2
        d[:] = 0.0
        for l in range(p):
            g = gy = gz = gyy = gyz = gzz = 0.0
            for m in range(p):
                at = base + l * sx + m * sy
                v = vz = vzz = 0.0
                for k in range(p):
                    v += w[2, 0, k] * q[at + k]
                    vz += w[2, 1, k] * q[at + k]
                    vzz += w[2, 2, k] * q[at + k]
                g += w[1, 0, m] * v
                gy += w[1, 1, m] * v
                gyy += w[1, 2, m] * v
                gz += w[1, 0, m] * vz
                gyz += w[1, 1, m] * vz
                gzz += w[1, 0, m] * vzz
            b, bx = w[0, 0, l], w[0, 1, l]
            d[0] += b * g
            d[1] += bx * g
            d[2] += b * gy
            d[3] += b * gz
            d[4] += w[0, 2, l] * g
            d[5] += b * gyy
            d[6] += b * gzz
            d[7] += b * gyz
            d[8] += bx * gz
            d[9] += bx * gy

    return evaluate


cubic, quintic = interpolant(4), interpolant(6)


@point
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@point
def frame(n):
    """Two unit vectors that complete the unit vector n (Duff et al. 2017)."""
    sign = 1.0 if n[2] >= 0 else -1.0
    a = -1 / (sign + n[2])
    b = n[0] * n[1] * a
    return (1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]), (b, sign + n[1] * n[1] * a, -n[1])


@point
def solve(off, form, b, c):
    """(1 + off·form)⁻¹ (b, c), the eigenvalues of the matrix lifted to FLAT where they are less."""
    k, l, m = 1 + off * form[0], off * form[1], 1 + off * form[2]
    least = 0.5 * (k + m) - np.sqrt(0.25 * (k - m) ** 2 + l * l)
    lift = max(FLAT - least, 0.0)
    k, m = k + lift, m + lift
    det = k * m - l * l
    return (m * b - l * c) / det, (k * c - l * b) / det


@point
def inside(y, n):
    return 0 <= y[0] <= n[0] - 1 and 0 <= y[1] <= n[1] - 1 and 0 <= y[2] <= n[2] - 1


@point
def project(q, n, order, node, y, w, d):
    """Closest point of the surface to ``node`` from ``y``: (point, normal, second form, whether it was found).

    Each round goes to the surface along ∇ψ, and along the surface to the stationary point of the distance, by one cell
    at most (Newton's method for (y - x) + λ∇ψ = 0, ψ = 0).
    """
    half, sx, sy = order // 2, n[1] * n[2], n[2]
    i = j = k = 0
    u, form = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for turn in range(ROUNDS):
        if turn < FREE:
            i = min(max(int(np.floor(y[0])), half), n[0] - 2 - half)
            j = min(max(int(np.floor(y[1])), half), n[1] - 2 - half)
            k = min(max(int(np.floor(y[2])), half), n[2] - 2 - half)
        base = (i - half) * sx + (j - half) * sy + k - half
        if order == 3:
            cubic(q, base, sx, sy, (y[0] - i, y[1] - j, y[2] - k), w, d)
        else:
            quintic(q, base, sx, sy, (y[0] - i, y[1] - j, y[2] - k), w, d)
        slope = np.sqrt(d[1] * d[1] + d[2] * d[2] + d[3] * d[3])
        if not slope > 0:
            break
        u = d[1] / slope, d[2] / slope, d[3] / slope
        e, f = frame(u)
        he = times(d, e, slope)
        hf = times(d, f, slope)
        form = dot(e, he), dot(e, hf), dot(f, hf)
        r = node[0] - y[0], node[1] - y[1], node[2] - y[2]
        off, down = dot(r, u), -d[0] / slope
        b, c = solve(off, form, dot(r, e) - off * down * dot(u, he), dot(r, f) - off * down * dot(u, hf))
        size = np.sqrt(down * down + b * b + c * c)
        if not size < 1e3:
            break
        y = moved(y, u, e, f, (down, b, c), 1 / max(size, 1.0))
        if size < SETTLED:
            return y, u, form, inside(y, n)
    return y, u, form, False


@point
def times(d, e, slope):
    """The matrix of second derivatives times a vector, over the slope."""
    return (
        (d[4] * e[0] + d[9] * e[1] + d[8] * e[2]) / slope,
        (d[9] * e[0] + d[5] * e[1] + d[7] * e[2]) / slope,
        (d[8] * e[0] + d[7] * e[1] + d[6] * e[2]) / slope,
    )


@point
def moved(y, u, e, f, step, cut):
    """The point y moved by a step in a frame."""
    a, b, c = cut * step[0], cut * step[1], cut * step[2]
    return (
        y[0] + a * u[0] + b * e[0] + c * f[0],
        y[1] + a * u[1] + b * e[1] + c * f[1],
        y[2] + a * u[2] + b * e[2] + c * f[2],
    )


@point
def position(at, n):
    return float(at // (n[1] * n[2])), float(at // n[2] % n[1]), float(at % n[2])


@point
def away(a, b):
    """Distance of two points."""
    return np.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@serial
def seeds(q, n, near, start, order):
    """Seeds of the nodes ``near``, shape (nodes, 9): point, normal, second form; a normal of zero where there is none.

    Newton starts at points of grid lines, ``start``; each is the seed should nothing nearer be found.
    """
    found, w, d = np.zeros((near.size, 9)), np.empty((3, 3, order + 1)), np.empty(10)
    for s in range(near.size):
        node, y = position(near[s], n), (start[s, 0], start[s, 1], start[s, 2])
        most = away(node, y)
        found[s, 0], found[s, 1], found[s, 2] = y
        y, u, form, good = project(q, n, order, node, y, w, d)
        if good and away(node, y) <= most + NEAR:
            found[s, 0], found[s, 1], found[s, 2] = y
            found[s, 3], found[s, 4], found[s, 5] = u
            found[s, 6], found[s, 7], found[s, 8] = form
    return found


@serial
def distances(q, n, order, polished, nodes, seed, found, out):
    """Distances of the nodes [cells], at most what stands in ``out``, from the paraboloid of their seed; at
    ``polished`` cells or less by Newton's method that starts there."""
    w, d = np.empty((3, 3, order + 1)), np.empty(10)
    for at in nodes:
        node, s, most = position(at, n), seed[at], abs(out[at])
        y = found[s, 0], found[s, 1], found[s, 2]
        u, form = (found[s, 3], found[s, 4], found[s, 5]), (found[s, 6], found[s, 7], found[s, 8])
        far = away(node, y)
        if u != (0.0, 0.0, 0.0):
            e, f = frame(u)
            r = node[0] - y[0], node[1] - y[1], node[2] - y[2]
            b, c = solve(dot(r, u), form, dot(r, e), dot(r, f))
            cut = REACH / max(np.sqrt(b * b + c * c), REACH)
            b, c, good = cut * b, cut * c, True
            fall = -0.5 * (form[0] * b * b + 2 * form[1] * b * c + form[2] * c * c)
            y = moved(y, u, e, f, (fall, b, c), 1.0)
            if away(node, y) < min(polished, most + 0.1):
                y, u, form, good = project(q, n, order, node, y, w, d)
            if good:
                far = min(far, away(node, y))
        most = min(most, far)
        out[at] = -most if q[at] < 0 else most
