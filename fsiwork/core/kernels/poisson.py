"""Tridiagonal sweeps of the direct solvers: by whole rows, or along the contiguous axis eight rows at once.

Every line system is scaled to off-diagonals −1 and diagonal 2 + σ. With g = 1/w of the factorisation
w_i = d_i − 1/w_{i−1} the solve is y_i = b_i + g_{i−1} y_{i−1}, then x_i = g_i (y_i + x_{i+1}): no division, one array
of coefficients. A periodic line has the constant factor g = r, the small root of r + 1/r = 2 + σ, and the same two
recurrences run round the circle; where they start is a sum over the few rows whose power of r is not yet round-off.
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, loop, point


@loop
def factorise(g, tail, counts, sigma, blocks, ends, s, n):
    """1/w of open lines with diagonal 2 + sigma, stored until it stops changing (4 eps) along the line.

    ``g`` has the layout of the field, ``tail[0]`` the limit a column, ``counts[0, b, i]`` the columns of block ``b``
    that row ``i`` of ``g`` holds; ``ends`` = (d, w) of the two end rows, whose diagonal is d + w·sigma.
    """
    eps = 4 * np.finfo(g.dtype).eps
    for b in prange(blocks.shape[0]):
        start, column, width = blocks[b]
        w = np.empty(width)
        changing = width
        for i in range(n):
            row = g[start + i * s : start + i * s + width]
            if i == n - 1:
                changing = width
            last = 0
            for j in range(changing):
                x = sigma[column + j]
                d = ends[0] + ends[1] * x if i == 0 else (2.0 + x if i < n - 1 else ends[2] + ends[3] * x)
                before = 0.0
                if i > 0:
                    before = 1.0 / w[j]
                w[j] = d - before
                row[j] = 1.0 / w[j]
                if abs(row[j] - tail[0, column + j]) > eps * row[j]:
                    last = j + 1
            if i < n - 1:
                for j in range(last, changing):
                    w[j] = 1.0 / tail[0, column + j]
                changing = last
            counts[0, b, i] = changing


@loop
def sweep(q, g, tail, counts, blocks, scales, s, n):
    """Solve the lines of every column of ``q`` in place, along rows ``s`` apart.

    ``tail`` = (limit of g, 1/(1 − r^n), room for the sums) a column; ``counts[0]`` as in `factorise`,
    ``counts[1, b, i]`` the columns whose i-th power of r is not round-off (0 for open lines); ``scales`` = factors of
    the right-hand side in the first, the inner and the last row.
    """
    for b in prange(blocks.shape[0]):
        start, column, width = blocks[b]
        limit = tail[0, column : column + width]
        close = tail[1, column : column + width]
        seed = tail[2, column : column + width]
        seed[:] = 0
        for i in range(n - 1, -1, -1):
            c = scales[1]
            x = q[start + (n - 1 - i) * s : start + (n - 1 - i) * s + width]
            for j in range(counts[1, b, i]):
                seed[j] = c * x[j] + limit[j] * seed[j]
        c = scales[0]
        x = q[start : start + width]
        for j in range(width):
            x[j] = c * x[j] + limit[j] * close[j] * seed[j]
        for i in range(1, n):
            c = scales[1] if i < n - 1 else scales[2]
            y = x
            x = q[start + i * s : start + i * s + width]
            k = counts[0, b, i - 1]
            a = g[start + (i - 1) * s : start + (i - 1) * s + k]
            for j in range(k):
                x[j] = c * x[j] + a[j] * y[j]
            v, z, a = x[k:], y[k:], limit[k:]
            for j in range(v.size):
                v[j] = c * v[j] + a[j] * z[j]
        seed[:] = 0
        for i in range(n - 1, -1, -1):
            y = q[start + i * s : start + i * s + width]
            for j in range(counts[1, b, i]):
                seed[j] = y[j] + limit[j] * seed[j]
        for j in range(width):
            seed[j] *= limit[j] * close[j]
        y = seed
        for i in range(n - 1, -1, -1):
            x = q[start + i * s : start + i * s + width]
            k = counts[0, b, i]
            a = g[start + i * s : start + i * s + k]
            for j in range(k):
                x[j] = a[j] * (x[j] + y[j])
            v, z, a = x[k:], y[k:], limit[k:]
            for j in range(v.size):
                v[j] = a[j] * (v[j] + z[j])
            y = x


@njit(error_model="numpy", fastmath=FASTMATH, cache=True)
def singular_line(x, b, weights, periodic):
    """−x″ = b on a line of Neumann or periodic ends: the mean of b dropped, the mean of x zero (both weighted)."""
    n = b.size
    total = 0.0
    mean = 0.0
    for i in range(n):
        mean += b[i] * weights[i]
        total += weights[i]
    mean /= total
    slope = 0.0
    turn = 0.0
    if periodic:  # Σ slopes = 0
        for i in range(n):
            slope -= b[i] - mean
            turn += slope
        slope = -turn / n
    value = 0.0
    average = 0.0
    for i in range(n):
        x[i] = value
        average += value * weights[i]
        slope -= (b[i] - mean) * weights[i]
        value += slope
    average /= total
    for i in range(n):
        x[i] -= average


@loop
def transpose(out, q):
    """out[j, i] = q[i, j], in tiles that fit the first cache."""
    rows, columns = q.shape
    tile = 16
    for block in prange((columns + tile - 1) // tile):
        low = block * tile
        high = min(low + tile, columns)
        for first in range(0, rows, tile):
            last = min(first + tile, rows)
            for j in range(low, high):
                for i in range(first, last):
                    out[j, i] = q[i, j]


@loop
def lines_across(q, c, reach, blocks, s):
    """Solve the same line system on every column of ``q`` in place; lines run along rows ``s`` apart.

    ``c``, shape (4, n), holds g, the factors of the right-hand side, and the weights of the two sums that start the
    recurrences of a periodic line (over its last and its first ``reach`` rows; 0 for open lines).
    """
    n = c.shape[1]
    g = c[0]
    for b in prange(blocks.shape[0]):
        start, width = blocks[b, 0], blocks[b, 2]
        y = np.zeros(width, q.dtype)
        for i in range(n - reach, n):
            a = c[2, i]
            x = q[start + i * s : start + i * s + width]
            for j in range(width):
                y[j] += a * x[j]
        first = y
        a = g[0]
        for i in range(n):
            f = c[1, i]
            x = q[start + i * s : start + i * s + width]
            for j in range(width):
                x[j] = f * x[j] + a * y[j]
            y = x
            a = g[i]
        y = first
        y[:] = 0
        for i in range(reach):
            a = c[3, i]
            x = q[start + i * s : start + i * s + width]
            for j in range(width):
                y[j] += a * x[j]
        for i in range(n - 1, -1, -1):
            a = g[i]
            x = q[start + i * s : start + i * s + width]
            for j in range(width):
                x[j] = a * (x[j] + y[j])
            y = x


@point
def before(x, c, reach):
    """What a periodic line brings to its first point in the forward recurrence."""
    y = x[0] * 0
    for i in range(c.shape[1] - reach, c.shape[1]):
        y += c[2, i] * x[i]
    return y


@point
def behind(x, c, reach):
    """What a periodic line brings to its last point in the backward recurrence."""
    y = x[0] * 0
    for i in range(reach):
        y += c[3, i] * x[i]
    return y


@loop
def lines_along(q, c, reach):
    """The same along the contiguous axis of ``q``, shape (rows, n): eight independent chains side by side."""
    n = c.shape[1]
    g, f = c[0], c[1]
    for b in prange(q.shape[0] // 8):
        m = 8 * b
        p0, p1, p2, p3, p4, p5, p6, p7 = q[m], q[m + 1], q[m + 2], q[m + 3], q[m + 4], q[m + 5], q[m + 6], q[m + 7]
        y0, y1, y2, y3 = before(p0, c, reach), before(p1, c, reach), before(p2, c, reach), before(p3, c, reach)
        y4, y5, y6, y7 = before(p4, c, reach), before(p5, c, reach), before(p6, c, reach), before(p7, c, reach)
        a = g[0]
        for i in range(n):
            e = f[i]
            p0[i] = y0 = e * p0[i] + a * y0
            p1[i] = y1 = e * p1[i] + a * y1
            p2[i] = y2 = e * p2[i] + a * y2
            p3[i] = y3 = e * p3[i] + a * y3
            p4[i] = y4 = e * p4[i] + a * y4
            p5[i] = y5 = e * p5[i] + a * y5
            p6[i] = y6 = e * p6[i] + a * y6
            p7[i] = y7 = e * p7[i] + a * y7
            a = g[i]
        y0, y1, y2, y3 = behind(p0, c, reach), behind(p1, c, reach), behind(p2, c, reach), behind(p3, c, reach)
        y4, y5, y6, y7 = behind(p4, c, reach), behind(p5, c, reach), behind(p6, c, reach), behind(p7, c, reach)
        for i in range(n - 1, -1, -1):
            a = g[i]
            p0[i] = y0 = a * (p0[i] + y0)
            p1[i] = y1 = a * (p1[i] + y1)
            p2[i] = y2 = a * (p2[i] + y2)
            p3[i] = y3 = a * (p3[i] + y3)
            p4[i] = y4 = a * (p4[i] + y4)
            p5[i] = y5 = a * (p5[i] + y5)
            p6[i] = y6 = a * (p6[i] + y6)
            p7[i] = y7 = a * (p7[i] + y7)
    for m in range(q.shape[0] // 8 * 8, q.shape[0]):
        x = q[m]
        y = before(x, c, reach)
        a = g[0]
        for i in range(n):
            x[i] = y = f[i] * x[i] + a * y
            a = g[i]
        y = behind(x, c, reach)
        for i in range(n - 1, -1, -1):
            x[i] = y = g[i] * (x[i] + y)
