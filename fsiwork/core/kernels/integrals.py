"""Lengths of the line φ = 0 as sums over the nodes near it: Smereka's and Towers' measures, marching squares.

All walk the nodes [low, n - low) of a field that holds more around them, and skip those without a change of sign next
to them. They add up in one fixed order.
"""

import math

from numba import njit

from fsiwork.core.kernels import FASTMATH, point

serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)


@point
def share(q, i, j, di, dj, h, order):
    """What the crossing between node (i, j) and its neighbour gives to the node, times h².

    The measure is the part of the Laplacian of u, [∂ₙu] = 1 on the line, that differences across it miss: with the
    distance d of the crossing from the neighbour d |n_a|, and at second order d²/2 [∂²ₐu] = d²/2 κ (n_b² - n_a²) more.
    """
    a, b = q[i, j], q[i + di, j + dj]
    if (a > 0) == (b > 0):
        return 0.0
    x, y = 0.5 * (q[i + 1, j] - q[i - 1, j]), 0.5 * (q[i, j + 1] - q[i, j - 1])
    slope = math.sqrt(x * x + y * y)
    if slope == 0:
        return 0.0
    nx, ny = x / slope, y / slope
    na = abs(di * nx + dj * ny)
    if order == 1:
        return h * b / (b - a) * na
    # the parabola through both ends with the mean second difference
    bend = 0.5 * (q[i - di, j - dj] - a - b + q[i + 2 * di, j + 2 * dj])
    middle, rise = 0.5 * (a + b) - 0.125 * bend, b - a
    root = math.sqrt(max(rise * rise - 2 * bend * middle, 0.0))
    s = -2 * middle / (rise + math.copysign(root, rise))  # from the middle, in units of h
    d = h * min(max(0.5 - s, 0.0), 1.0)
    xx, yy = q[i + 1, j] - 2 * a + q[i - 1, j], q[i, j + 1] - 2 * a + q[i, j - 1]
    xy = 0.25 * (q[i + 1, j + 1] - q[i + 1, j - 1] - q[i - 1, j + 1] + q[i - 1, j - 1])
    kappa = (xx * ny * ny - 2 * xy * nx * ny + yy * nx * nx) / (slope * h)
    sign = 1.0 if b > a else -1.0
    return d * (na + sign * 0.5 * d * kappa * (1 - 2 * na * na))


@serial
def smereka(q, low, h, order):
    """Length by Smereka's measure of the first or second ``order`` (1.5.3)."""
    total = 0.0
    for i in range(low, q.shape[0] - low):
        for j in range(low, q.shape[1] - low):
            for k in range(4):
                di, dj = (1 - 2 * (k % 2), 0) if k < 2 else (0, 1 - 2 * (k % 2))
                total += share(q, i, j, di, dj, h, order)
    return total


@point
def near(q, i, j, reach):
    """Whether φ changes its sign within ``reach`` nodes along the axes or one diagonally."""
    s = q[i, j] > 0
    for k in range(1, reach + 1):
        if (q[i - k, j] > 0) != s or (q[i + k, j] > 0) != s or (q[i, j - k] > 0) != s or (q[i, j + k] > 0) != s:
            return True
    if reach == 1:
        return False
    return (
        (q[i - 1, j - 1] > 0) != s
        or (q[i + 1, j - 1] > 0) != s
        or (q[i - 1, j + 1] > 0) != s
        or (q[i + 1, j + 1] > 0) != s
    )


@point
def step_function(q, i, j):
    """∇I·∇φ/|∇φ|² at a node, I = max(φ, 0): 0 inside, 1 outside."""
    x, y = q[i + 1, j] - q[i - 1, j], q[i, j + 1] - q[i, j - 1]
    ix, iy = max(q[i + 1, j], 0.0) - max(q[i - 1, j], 0.0), max(q[i, j + 1], 0.0) - max(q[i, j - 1], 0.0)
    square = x * x + y * y
    return (ix * x + iy * y) / square if square > 0 else 0.5


@point
def laplacian(a, b, c, d, o):
    return a + b + c + d - 4 * o


@serial
def towers_laplacian(q, low, h):
    """Length by (ΔI - ℋΔφ)/|∇φ| (1.5.4, corrected: divided once by |∇φ|)."""
    total = 0.0
    for i in range(low, q.shape[0] - low):
        for j in range(low, q.shape[1] - low):
            if near(q, i, j, 1):
                w, e, s, n, o = q[i - 1, j], q[i + 1, j], q[i, j - 1], q[i, j + 1], q[i, j]
                slope = 0.5 * math.sqrt((e - w) ** 2 + (n - s) ** 2)
                bent = laplacian(max(w, 0.0), max(e, 0.0), max(s, 0.0), max(n, 0.0), max(o, 0.0))
                jump = bent - step_function(q, i, j) * laplacian(w, e, s, n, o)
                total += h * jump / slope if slope > 0 else 0.0
    return total


@serial
def towers_gradient(q, low, h):
    """Length by ∇ℋ·n (1.5.4)."""
    total = 0.0
    for i in range(low, q.shape[0] - low):
        for j in range(low, q.shape[1] - low):
            if near(q, i, j, 2):
                x, y = q[i + 1, j] - q[i - 1, j], q[i, j + 1] - q[i, j - 1]
                slope = math.sqrt(x * x + y * y)
                gx = step_function(q, i + 1, j) - step_function(q, i - 1, j)
                gy = step_function(q, i, j + 1) - step_function(q, i, j - 1)
                total += 0.5 * h * (gx * x + gy * y) / slope if slope > 0 else 0.0
    return total


@point
def cut(a, b):
    """Where φ is 0 between a and b of different signs, as a part of the way."""
    return a / (a - b)


@point
def corner(o, a, b):
    """Length of the segment that cuts the corner with value ``o`` off, between its edges to ``a`` and ``b``."""
    return math.hypot(cut(o, a), cut(o, b))


@point
def squares(a, b, c, d):
    """Length of the straight pieces in a unit cell with the corners a, b, c, d in turn; the mean decides a saddle."""
    p, q, r, s = a > 0, b > 0, c > 0, d > 0
    count = p + q + r + s
    if count == 0 or count == 4:
        return 0.0
    if count == 2:
        if p == q:
            return math.hypot(1.0, cut(a, d) - cut(b, c))
        if p == s:
            return math.hypot(1.0, cut(a, b) - cut(d, c))
        if (a + b + c + d > 0) == p:
            return corner(b, a, c) + corner(d, a, c)
        return corner(a, b, d) + corner(c, b, d)
    odd = count == 1  # the corner that differs from the three others is outside
    if p == odd:
        return corner(a, b, d)
    if q == odd:
        return corner(b, a, c)
    return corner(c, b, d) if r == odd else corner(d, a, c)


@serial
def marching_squares(q, low, h):
    """Length of the straight pieces of all cells between the nodes."""
    total = 0.0
    for i in range(low, q.shape[0] - low - 1):
        for j in range(low, q.shape[1] - low - 1):
            total += squares(q[i, j], q[i + 1, j], q[i + 1, j + 1], q[i, j + 1])
    return h * total
