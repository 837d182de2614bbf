"""Length of the line φ = 0 and area inside it by height functions on the tensor quintic of each cell.

A cell between four nodes is the square |σ|, |τ| ≤ 1/2 with the polynomial Σ c_kl σ^k τ^l through the 6 × 6 nodes
around it. Where one derivative keeps clear of zero the line is a graph over the other direction; the ends of its pieces
are the roots on the two sides, all of them, so that a side crossed twice is seen (Saye's reduction of dimensions).
Elsewhere the cell is quartered, at most `DEPTH` times, and is straight after that.
"""

import math

import numpy as np
from numba import njit

from fsiwork.core.kernels import FASTMATH, batches, point
from fsiwork.core.kernels.quintic import (
    HALVES,
    LEVEL,
    POWERS,
    STEEP,
    TO_COEFFICIENTS,
    N,
    bounds,
    bracketed,
    horner,
    ordered,
    roots,
    sound,
)

serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)

DEPTH = 5
GAUSS, WEIGHTS = (0.5 * q for q in np.polynomial.legendre.leggauss(5))


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
def side(c, at, out):
    """out = the polynomial where σ is ``at``."""
    size = 0.0
    for l in range(N):
        value = c[N - 1, l]
        for k in range(N - 2, -1, -1):
            value = value * at + c[k, l]
        out[l] = value
        size += abs(value) * POWERS[l]
    if size <= LEVEL * abs(c[1, 0]):
        out[:N] = 0.0


@point
def graph(c, work, found, total):
    """Adds (length, inside) of a unit cell in which the line is σ(τ) to ``total``."""
    p, tilt, low, high = work[2], work[3], work[4], work[5]
    side(c, -0.5, low)
    side(c, 0.5, high)
    count = roots(low, found, work)
    count += roots(high, found[count:], work)
    ordered(found, count)
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
        span = max(max(a, b), max(c, d)) - min(min(a, b), min(c, d))
        flag[j] = both | (least <= x + y + 10 * LEVEL * span)
        full += (a <= 0) & (not flag[j])
    return full


@point
def divide(c, stack, top, first, last, work):
    """Puts those of the four parts of a cell on the stack that lie in the halves first[a] to last[a]."""
    for a in range(first[0], last[0] + 1):
        for b in range(first[1], last[1] + 1):
            change(HALVES[a], c, HALVES[b], work, stack[top])
            top += 1
    return top


@point
def cell(stack, top, size, depth, scratch, total):
    """Adds (length, inside), in units of the cell's side, of the ``top`` parts on the stack to ``total``."""
    c, work, found, part = scratch
    while top > 0:
        top -= 1
        length, deep = size[top], depth[top]
        c[:] = stack[top]
        spread, least_x, most_x, least_y, most_y = bounds(c)
        part[:] = 0
        if abs(c[0, 0]) > spread * (1 + LEVEL):
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
            size[top : top + 4], depth[top : top + 4] = 0.5 * length, deep + 1
            top = divide(c, stack, top, (0, 0), (1, 1), work)
        total[0] += part[0] * length
        total[1] += part[1] * length * length


@point
def flush(w, count, stack, size, depth, scratch, total):
    """Adds the ``count`` cells that wait in ``w``; one by one those that are not simple."""
    for at in range(count, batches.SIZE):
        for k in range(N * N):
            w[k * batches.SIZE + at] = 1.0
    batches.measure(w)
    for at in range(count):
        if w[batches.KIND + at] == 0:
            for k in range(N * N):
                stack[0, k // N, k % N] = w[batches.CELL + k * batches.SIZE + at]
            size[0], depth[0] = 1.0, 0
            cell(stack, 1, size, depth, scratch, total)
        else:
            total[0] += w[batches.LENGTH + at]
            total[1] += w[batches.INSIDE + at]


@point
def rim(q, i, j, low, stack, size, depth, scratch, total):
    """Adds the part of a cell at the edge of the box that lies inside."""
    a, b = q.shape[0] - low - 2, q.shape[1] - low - 2
    c, work = scratch[0], scratch[1]
    change(TO_COEFFICIENTS, q[i - 2 : i + 4, j - 2 : j + 4], TO_COEFFICIENTS, work, c)
    size[:4], depth[:4] = 0.5, 1
    first, last = (int(i == low), int(j == low)), (1 - int(i == a), 1 - int(j == b))
    cell(stack, divide(c, stack, 0, first, last, work), size, depth, scratch, total)


@serial
def length_and_area(q, low, h, w):
    """Length of φ = 0 and area of φ < 0 over the cells between nodes [low, n - low), of those at the ends the inner
    halves: the box whose sides lie midway between the nodes low and low + 1. ``low`` is 2 or more. NaN if φ is
    not finite. ``w``: `batches.ROOM` numbers to work with."""
    if not sound(q):
        return math.nan, math.nan
    stack, size = np.empty((4 * DEPTH + 4, N, N)), np.empty(4 * DEPTH + 4)
    depth, total = np.empty(4 * DEPTH + 4, np.int64), np.zeros(2)
    scratch = np.empty((N, N)), np.empty((N, N + 2)), np.empty(2 * N + 1), np.empty(2)
    a, b, flag = q.shape[0] - low - 2, q.shape[1] - low - 2, np.empty(q.shape[1] - 2 * low - 1, np.bool_)
    full, waiting = 0.0, 0
    for i in range(low, a + 1):
        count = candidates(flag, q[i - 1, low - 2 :], q[i, low - 2 :], q[i + 1, low - 2 :], q[i + 2, low - 2 :])
        ends = ((q[i, low] <= 0) & (not flag[0])) + ((q[i, b] <= 0) & (not flag[b - low]))
        full += (count - 0.5 * ends) * (0.5 if i in (low, a) else 1.0)
        for j in range(low, b + 1):
            if not flag[j - low]:
                continue
            if i in (low, a) or j in (low, b):
                rim(q, i, j, low, stack, size, depth, scratch, total)
                continue
            for k in range(N):
                for l in range(N):
                    w[(k * N + l) * batches.SIZE + waiting] = q[i - 2 + k, j - 2 + l]
            waiting += 1
            if waiting == batches.SIZE:
                flush(w, waiting, stack, size, depth, scratch, total)
                waiting = 0
    flush(w, waiting, stack, size, depth, scratch, total)
    return total[0] * h, (total[1] + full) * h * h
