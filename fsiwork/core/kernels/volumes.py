"""Area of the surface φ = 0 and volume inside it: the cells that it may pass, each a cube between eight nodes."""

import math

import numpy as np
from numba import njit

from fsiwork.core.kernels import FASTMATH, point
from fsiwork.core.kernels.cubes import DEPTH, cell, change, divide
from fsiwork.core.kernels.quintic import LEVEL, TO_COEFFICIENTS, N, sound

serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)


@point
def gather(rows, q, i, j):
    """The largest and least φ, least |φ| and largest Σ|second difference| of the four nodes at (i, j) to (i+1, j+1)."""
    most, least, near, bent = rows[0], rows[1], rows[2], rows[3]
    most[:], least[:], near[:], bent[:] = -np.inf, np.inf, np.inf, 0.0
    for corner in range(4):
        e, f = i + corner // 2, j + corner % 2
        o, w, x, s, n = q[e, f], q[e - 1, f], q[e + 1, f], q[e, f - 1], q[e, f + 1]
        for k in range(1, o.size - 1):
            v = o[k]
            bend = abs((w[k] - v) - (v - x[k])) + abs((s[k] - v) - (v - n[k])) + abs((o[k - 1] - v) - (v - o[k + 1]))
            most[k], least[k] = max(most[k], v), min(least[k], v)
            near[k], bent[k] = min(near[k], abs(v)), max(bent[k], bend)


@point
def candidates(flag, rows, low, n):
    """Marks the cells of a row that the surface may pass; how many of the others are inside, those at its ends half.

    It may where the corners have both signs, or one is closer to zero than the second differences at the corners.
    """
    most, least, near, bent = rows[0], rows[1], rows[2], rows[3]
    full = 0
    for k in range(low, n - low - 1):
        top, bottom = max(most[k], most[k + 1]), min(least[k], least[k + 1])
        reach = max(bent[k], bent[k + 1]) + 10 * LEVEL * (top - bottom)
        flag[k] = ((top > 0) & (bottom <= 0)) | (min(near[k], near[k + 1]) <= reach)
        full += (top <= 0) & (not flag[k])
    ends = ((most[low] <= 0) & (not flag[low])) + ((most[n - low - 2] <= 0) & (not flag[n - low - 2]))
    return full - 0.5 * ends


@serial
def area_and_volume(q, low, h):
    """Area of φ = 0 and volume of φ < 0 over the cells between nodes [low, n - low), of those at the ends the inner
    halves: the box whose sides lie midway between the nodes low and low + 1. ``low`` is 2 or more. NaN if φ is
    not finite."""
    if not sound(q):
        return math.nan, math.nan
    count = 7 * DEPTH + 16
    stack, size, depth = np.empty((count, N, N, N)), np.empty(count), np.empty(count, np.int64)
    c, work, total = np.empty((N, N, N)), np.empty((N, N, N)), np.zeros(2)
    rows, flag = np.empty((4, q.shape[2])), np.empty(q.shape[2], np.bool_)
    a, b, t = q.shape[0] - low - 2, q.shape[1] - low - 2, q.shape[2] - low - 2
    full = 0.0
    for i in range(low, a + 1):
        for j in range(low, b + 1):
            gather(rows, q, i, j)
            share = (0.5 if i in (low, a) else 1.0) * (0.5 if j in (low, b) else 1.0)
            full += share * candidates(flag, rows, low, q.shape[2])
            for k in range(low, t + 1):
                if not flag[k]:
                    continue
                nodes = q[i - 2 : i + 4, j - 2 : j + 4, k - 2 : k + 4]
                change(TO_COEFFICIENTS, TO_COEFFICIENTS, TO_COEFFICIENTS, nodes, work, stack[0])
                size[0], depth[0], top = 1.0, 0, 1
                if i in (low, a) or j in (low, b) or k in (low, t):
                    c[:] = stack[0]
                    size[:8], depth[:8] = 0.5, 1
                    first = (int(i == low), int(j == low), int(k == low))
                    last = (1 - int(i == a), 1 - int(j == b), 1 - int(k == t))
                    top = divide(c, stack, 0, first, last, work)
                cell(stack, top, size, depth, total)
    return total[0] * h * h, (total[1] + full) * h**3
