"""Length of the line φ = 0 and area inside it by height functions on the tensor quintic of each cell.

A cell between four nodes is the square |σ|, |τ| ≤ 1/2 with the polynomial Σ c_kl σ^k τ^l through the 6 × 6 nodes
around it. Where one derivative keeps clear of zero the line is a graph over the other direction; the ends of its pieces
are the roots on the two sides, all of them, so that a side crossed twice is seen (Saye's reduction of dimensions).
Elsewhere the cell is quartered, at most `DEPTH` times, and is straight after that.
"""

import math

import numpy as np
from numba import njit

from fsiwork.core.kernels import FASTMATH, point

serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)

N = 6  # coefficients in a direction
DEPTH = 5
STEEP = 0.5  # smallest |∂σ|/|∂τ| for a graph over τ: the integrand stays tame

NODES = np.arange(N) - 2.5
TO_COEFFICIENTS = np.linalg.inv(NODES[:, None] ** np.arange(N))
HALVES = np.array(
    [
        [[math.comb(j, k) * (side * 0.25) ** (j - k) * 0.5**k if j >= k else 0.0 for j in range(N)] for k in range(N)]
        for side in (-1, 1)
    ]
)
"""Coefficients on the lower and the upper half of an interval from those on all of it."""
GAUSS, WEIGHTS = (0.5 * q for q in np.polynomial.legendre.leggauss(5))
POWERS = 0.5 ** np.arange(N)


@point
def horner(p, x):
    """Polynomial and its derivative."""
    value, slope = p[N - 1], 0.0
    for k in range(N - 2, -1, -1):
        slope = slope * x + value
        value = value * x + p[k]
    return value, slope


@point
def bracketed(p, a, b, below):
    """The root of p in [a, b], over whose ends it changes its sign; ``below``: p(a) ≤ 0. Newton, kept inside."""
    x = 0.5 * (a + b)
    for _ in range(60):
        value, slope = horner(p, x)
        if (value <= 0) == below:
            a = x
        else:
            b = x
        new = x - value / slope if slope != 0 else a
        if not a <= new <= b:
            new = 0.5 * (a + b)
        if abs(new - x) < 1e-16:
            break
        x = new
    return x


@point
def roots(p, found, work):
    """All roots of p in [-1/2, 1/2] in order, their number: between two of them lies one of the derivative."""
    count = 0
    for order in range(N - 2, -1, -1):  # the derivative of this order
        for k in range(N):
            factor = 1.0
            for m in range(order):
                factor *= k + order - m
            work[0, k] = factor * p[k + order] if k + order < N else 0.0
        for k in range(count):
            work[1, k] = found[k]
        work[1, count] = 0.5
        ends, count, a = count + 1, 0, -0.5
        below = horner(work[0], a)[0] <= 0
        for k in range(ends):
            b = work[1, k]
            other = horner(work[0], b)[0] <= 0
            if below != other:
                found[count] = bracketed(work[0], a, b, below)
                count += 1
            a, below = b, other
    return count


@point
def change(a, q, b, work, out):
    """out = a q bᵀ, of 6 × 6 each."""
    for k in range(N):
        for m in range(N):
            value = 0.0
            for l in range(N):
                value += q[k, l] * b[m, l]
            work[k, m] = value
    for k in range(N):
        for m in range(N):
            value = 0.0
            for l in range(N):
                value += a[k, l] * work[l, m]
            out[k, m] = value


@point
def bounds(c):
    """Bounds over the cell: |ψ - c₀₀| at most, |∂σψ| at least and at most, |∂τψ| at least and at most."""
    spread = along = across = 0.0
    for k in range(N):
        for l in range(N):
            size = abs(c[k, l]) * POWERS[k] * POWERS[l]
            if k + l > 0:
                spread += size
            along += 2 * k * size
            across += 2 * l * size
    x, y = abs(c[1, 0]), abs(c[0, 1])
    return spread, 2 * x - along, along, 2 * y - across, across


@point
def graph(c, work, found, total):
    """Adds (length, inside) of a unit cell in which the line is σ(τ) to ``total``."""
    p, tilt, low, high = work[2], work[3], work[4], work[5]
    for l in range(N):
        low[l] = high[l] = 0.0
        for k in range(N):
            value = c[k, l] * POWERS[k]
            low[l] += -value if k % 2 else value
            high[l] += value
    count = roots(low, found, work)
    count += roots(high, found[count:], work)
    found[:count].sort()
    found[count] = 0.5
    start = -0.5
    for piece in range(count + 1):
        end = found[piece]
        middle, span = 0.5 * (start + end), end - start
        start = end
        inside_low, inside_high = horner(low, middle)[0] <= 0, horner(high, middle)[0] <= 0
        if inside_low == inside_high:
            total[1] += span if inside_low else 0.0
            continue
        for g in range(GAUSS.size):
            t = middle + GAUSS[g] * span
            for k in range(N):
                p[k], tilt[k] = horner(c[k], t)
            s = bracketed(p, -0.5, 0.5, inside_low)
            slope = horner(p, s)[1]
            across = horner(tilt, s)[0]
            total[0] += WEIGHTS[g] * span * math.sqrt(1 + (across / slope) ** 2)
            total[1] += WEIGHTS[g] * span * (0.5 + s if inside_low else 0.5 - s)


@point
def straight(c, total):
    """Adds (length, inside) of a unit cell in which φ counts as linear."""
    x, y = abs(c[1, 0]), abs(c[0, 1])
    x, y = max(x, y), min(x, y)
    if x == 0:
        total[1] += 1.0 if c[0, 0] <= 0 else 0.0
        return
    a = abs(c[0, 0])  # the line a = xσ + yτ, mirrored so that all are positive
    length = area = 0.0
    if a <= 0.5 * (x - y):
        length, area = math.sqrt(x * x + y * y) / x, 0.5 - a / x
    elif a < 0.5 * (x + y):
        rest = 0.5 * (x + y) - a
        length, area = rest * math.sqrt(x * x + y * y) / (x * y), 0.5 * rest * rest / (x * y)
    total[0] += length
    total[1] += area if c[0, 0] > 0 else 1 - area


@point
def bend(m, o, p):
    return abs((m - o) - (o - p))


@point
def candidates(flag, m, o, p, q):
    """Marks the cells between the rows ``o`` and ``p`` that the line may pass; the number of the others inside.

    It may where the corners have both signs, or one is closer to zero than the second differences at the corners. The
    rows start two before the first cell; no branch, so that the loop is vectorised.
    """
    full = 0
    for j in range(flag.size):
        a, b, c, d = o[j + 2], p[j + 2], o[j + 3], p[j + 3]
        least = min(min(abs(a), abs(b)), min(abs(c), abs(d)))
        both = (max(max(a, b), max(c, d)) > 0) & (min(min(a, b), min(c, d)) <= 0)
        x = max(max(bend(m[j + 2], a, b), bend(a, b, q[j + 2])), max(bend(m[j + 3], c, d), bend(c, d, q[j + 3])))
        y = max(max(bend(o[j + 1], a, c), bend(a, c, o[j + 4])), max(bend(p[j + 1], b, d), bend(b, d, p[j + 4])))
        flag[j] = both | (least <= x + y)
        full += (a <= 0) & (not flag[j])
    return full


@serial
def length_and_area(q, low, h):
    """Length of φ = 0 and area of φ < 0 over the cells between nodes [low, n - low); ``low`` is 2 or more."""
    stack, size = np.empty((4 * DEPTH + 4, N, N)), np.empty(4 * DEPTH + 4)
    depth = np.empty(4 * DEPTH + 4, np.int64)
    work, found, total, part = np.empty((N, N + 2)), np.empty(2 * N), np.zeros(2), np.empty(2)
    c, flag = np.empty((N, N)), np.empty(q.shape[1] - 2 * low - 1, np.bool_)
    full = 0
    for i in range(low, q.shape[0] - low - 1):
        full += candidates(flag, q[i - 1, low - 2 :], q[i, low - 2 :], q[i + 1, low - 2 :], q[i + 2, low - 2 :])
        for j in range(low, q.shape[1] - low - 1):
            if not flag[j - low]:
                continue
            change(TO_COEFFICIENTS, q[i - 2 : i + 4, j - 2 : j + 4], TO_COEFFICIENTS, work, stack[0])
            size[0], depth[0], top = 1.0, 0, 1
            while top > 0:
                top -= 1
                side, deep = size[top], depth[top]
                c[:] = stack[top]
                spread, least_x, most_x, least_y, most_y = bounds(c)
                part[:] = 0
                if abs(c[0, 0]) > spread:
                    part[1] = 1.0 if c[0, 0] <= 0 else 0.0
                elif least_x > STEEP * most_y:
                    graph(c, work, found, part)
                elif least_y > STEEP * most_x:
                    for k in range(N):
                        for l in range(k):
                            c[k, l], c[l, k] = c[l, k], c[k, l]
                    graph(c, work, found, part)
                elif deep == DEPTH:
                    straight(c, part)
                else:
                    for a in range(2):
                        for b in range(2):
                            change(HALVES[a], c, HALVES[b], work, stack[top])
                            size[top], depth[top] = 0.5 * side, deep + 1
                            top += 1
                total[0] += part[0] * side
                total[1] += part[1] * side * side
    return total[0] * h, (total[1] + full) * h * h
