"""Conjugate gradients with a multigrid cycle, for d q − div(β grad q) on cells that are merged in pairs.

All levels of a quantity lie behind each other in one flat buffer, each padded by one ghost layer; ``start`` are places
in that buffer. Face coefficients ``c``, shape (3, size), sit on the low face of their cell: c[0] for the contiguous
direction, c[1] for the one ``s`` apart, c[2] for the one ``t`` apart; in two dimensions t = 0 and c[2] is not read.
A fourth row, if there is one, is the diagonal coefficient d h² at centres.
Ghosts of a field stay zero, or hold the other side of a periodic box.

A row of ``levels`` is (first row, rows, n, s, t, first pair of ghosts, pairs).
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, loop

serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)

Q, R, P, AP, Z, W, D = range(7)  # rows of ``fields``: solution, residual, direction, A times it, cycle (two), Jacobi
DIAGONAL = 3  # row of ``c`` with the zero-order coefficient


@serial
def weigh(o, p, c, I, n):
    """Add the zero-order part d q of a row, if there is one."""
    if c.shape[0] > DIAGONAL:
        d = c[DIAGONAL, I : I + n]
        for i in range(n):
            o[i] += d[i] * p[i]


@serial
def balance(out, q, c, I, n, s, t):
    """One row of A q: what flows out of each cell through its faces."""
    o, p, w, e = out[I : I + n], q[I : I + n], q[I - 1 : I - 1 + n], q[I + 1 : I + 1 + n]
    f, g = q[I - s : I - s + n], q[I + s : I + s + n]
    cw, ce = c[0, I : I + n], c[0, I + 1 : I + 1 + n]
    cf, cg = c[1, I : I + n], c[1, I + s : I + s + n]
    if t == 0:
        for i in range(n):
            o[i] = cw[i] * (p[i] - w[i]) + ce[i] * (p[i] - e[i]) + cf[i] * (p[i] - f[i]) + cg[i] * (p[i] - g[i])
        weigh(o, p, c, I, n)
        return
    u, v = q[I - t : I - t + n], q[I + t : I + t + n]
    cu, cv = c[2, I : I + n], c[2, I + t : I + t + n]
    for i in range(n):
        xy = cw[i] * (p[i] - w[i]) + ce[i] * (p[i] - e[i]) + cf[i] * (p[i] - f[i]) + cg[i] * (p[i] - g[i])
        o[i] = xy + cu[i] * (p[i] - u[i]) + cv[i] * (p[i] - v[i])
    weigh(o, p, c, I, n)


@loop
def relaxation(d, c, start, n, s, t, factor):
    """d = factor / diagonal of A; 0 for a cell where it is nothing."""
    for r in prange(start.size):
        I = start[r]
        for i in range(I, I + n):
            total = c[0, i] + c[0, i + 1] + c[1, i] + c[1, i + s]
            if t > 0:
                total += c[2, i] + c[2, i + t]
            if c.shape[0] > DIAGONAL:
                total += c[DIAGONAL, i]
            d[i] = factor / total if total > 0 else 0.0


@loop
def merge_along(c, start, children, m, n, factor):
    """Faces between merged cells of the contiguous direction, m + 1 a row: factor × sums over the fine rows."""
    for k in prange(start.size):
        coarse = c[start[k] : start[k] + m + 1]
        coarse[:] = 0
        step = 1 if m == n else 2
        for j in range(children.shape[1]):
            if children[k, j] >= 0:
                fine = c[children[k, j] : children[k, j] + n + 1]
                for i in range(m):
                    coarse[i] += factor * fine[step * i]
                coarse[m] += factor * fine[n]


@loop
def merge_rows(c, start, children, m, n, factor):
    """Coefficients in rows of m: factor × sums over fine rows of n and over merged neighbours in them."""
    for k in prange(start.size):
        coarse = c[start[k] : start[k] + m]
        coarse[:] = 0
        for j in range(children.shape[1]):
            if children[k, j] < 0:
                continue
            fine = c[children[k, j] : children[k, j] + n]
            if m == n:
                for i in range(n):
                    coarse[i] += factor * fine[i]
                continue
            for i in range(n // 2):
                coarse[i] += factor * (fine[2 * i] + fine[2 * i + 1])
            if n % 2 == 1:
                coarse[m - 1] += factor * fine[n - 1]


@loop
def multiply(out, q, c, start, n, s, t, parts):
    """out = A q; ``parts`` = sums of q·out, row by row."""
    for r in prange(start.size):
        I = start[r]
        balance(out, q, c, I, n, s, t)
        o, p = out[I : I + n], q[I : I + n]
        total = 0.0
        for i in range(n):
            total += o[i] * p[i]
        parts[r] = total


@loop
def advance(fields, start, n, alpha, parts):
    """q += alpha p, r −= alpha A p, z = d r; ``parts`` = sums of r², row by row."""
    for k in prange(start.size):
        I = start[k]
        q, r, p = fields[Q, I : I + n], fields[R, I : I + n], fields[P, I : I + n]
        ap, z, d = fields[AP, I : I + n], fields[Z, I : I + n], fields[D, I : I + n]
        total = 0.0
        for i in range(n):
            q[i] += alpha * p[i]
            r[i] -= alpha * ap[i]
            z[i] = d[i] * r[i]
            total += r[i] * r[i]
        parts[k] = total


@loop
def redirect(p, z, start, n, beta):
    """p = z + beta p."""
    for k in prange(start.size):
        I = start[k]
        x, y = p[I : I + n], z[I : I + n]
        for i in range(n):
            x[i] = y[i] + beta * x[i]


@loop
def scale(z, r, d, start, n):
    """z = d r: a Jacobi sweep from zero."""
    for k in prange(start.size):
        I = start[k]
        x, y, e = z[I : I + n], r[I : I + n], d[I : I + n]
        for i in range(n):
            x[i] = e[i] * y[i]


@loop
def smooth(fields, c, start, n, s, t, parts):
    """w = z + d (r − A z); ``parts`` = sums of r·w, row by row."""
    for k in prange(start.size):
        I = start[k]
        balance(fields[W], fields[Z], c, I, n, s, t)
        w, z, r, d = fields[W, I : I + n], fields[Z, I : I + n], fields[R, I : I + n], fields[D, I : I + n]
        total = 0.0
        for i in range(n):
            w[i] = z[i] + d[i] * (r[i] - w[i])
            total += w[i] * r[i]
        parts[k] = total


@loop
def restrict(fields, c, start, children, m, n, s, t):
    """r of a coarse cell = sum of r − A z over its fine cells (``children``: starts of their rows, or −1).

    ``m`` coarse and ``n`` fine cells in the contiguous direction; w of the fine level serves as scratch.
    """
    for k in prange(start.size):
        coarse = fields[R, start[k] : start[k] + m]
        coarse[:] = 0
        for j in range(children.shape[1]):
            I = children[k, j]
            if I < 0:
                continue
            balance(fields[W], fields[Z], c, I, n, s, t)
            az, r = fields[W, I : I + n], fields[R, I : I + n]
            if m == n:
                for i in range(n):
                    coarse[i] += r[i] - az[i]
                continue
            for i in range(n // 2):
                coarse[i] += (r[2 * i] - az[2 * i]) + (r[2 * i + 1] - az[2 * i + 1])
            if n % 2 == 1:
                coarse[m - 1] += r[n - 1] - az[n - 1]


@loop
def prolong(z, w, start, children, m, n):
    """z of the fine cells += w of the coarse cell they belong to (piecewise constant)."""
    for k in prange(start.size):
        coarse = w[start[k] : start[k] + m]
        for j in range(children.shape[1]):
            I = children[k, j]
            if I < 0:
                continue
            fine = z[I : I + n]
            if m == n:
                for i in range(n):
                    fine[i] += coarse[i]
                continue
            for i in range(n // 2):
                fine[2 * i] += coarse[i]
                fine[2 * i + 1] += coarse[i]
            if n % 2 == 1:
                fine[n - 1] += coarse[m - 1]


@serial
def wrap(q, pairs, level):
    """Ghosts of a periodic box: (place, where its value is found)."""
    for k in range(level[5], level[5] + level[6]):
        q[pairs[k, 0]] = q[pairs[k, 1]]


@serial
def coarsest(fields, inverse, start, n):
    """w = A⁻¹ r on the coarsest level, by the dense inverse."""
    for k in range(start.size * n):
        total = 0.0
        for j in range(start.size * n):
            total += inverse[k, j] * fields[R, start[j // n] + j % n]
        fields[W, start[k // n] + k % n] = total


@serial
def cycle(fields, c, levels, starts, children, pairs, inverse, parts):
    """w = M r on the finest level, where z = d r already: one V(1,1) cycle, symmetric. Returns the sum of r·w."""
    z, w = fields[Z], fields[W]
    last = levels.shape[0] - 1
    for k in range(last):
        first, rows, n, s, t = levels[k, :5]
        start = starts[first : first + rows]
        below, count, m = levels[k + 1, :3]
        if k > 0:
            scale(z, fields[R], fields[D], start, n)
        wrap(z, pairs, levels[k])
        restrict(fields, c, starts[below : below + count], children[below : below + count], m, n, s, t)
    first, rows, n = levels[last, :3]
    coarsest(fields, inverse, starts[first : first + rows], n)
    for k in range(last - 1, -1, -1):
        first, rows, n, s, t = levels[k, :5]
        below, count, m = levels[k + 1, :3]
        prolong(z, w, starts[below : below + count], children[below : below + count], m, n)
        wrap(z, pairs, levels[k])
        smooth(fields, c, starts[first : first + rows], n, s, t, parts)
    if last == 0:
        for k in range(rows):
            I = starts[k]
            parts[k] = (fields[R, I : I + n] * w[I : I + n]).sum()
    return parts.sum()


@serial
def begin(fields, c, level, start, pairs, parts, limit):
    """r = f − A q, z = d r, p = 0; a guess whose residual exceeds ``limit`` = |f| is worse than zero, and dropped."""
    q, r, p = fields[Q], fields[R], fields[P]
    n, s, t = level[2:5]
    wrap(q, pairs, level)
    multiply(p, q, c, start, n, s, t, parts)
    for k in range(start.size):
        I = start[k]
        parts[k] = ((r[I : I + n] - p[I : I + n]) ** 2).sum()
    size = np.sqrt(parts.sum())
    useful = size <= limit
    for k in range(start.size):
        I = start[k]
        if useful:
            r[I : I + n] -= p[I : I + n]
        else:
            q[I : I + n] = 0
        p[I : I + n] = 0
    scale(fields[Z], r, fields[D], start, n)
    return size if useful else limit


@serial
def conjugate_gradients(fields, c, levels, starts, children, pairs, inverse, parts, limit, rtol, most):
    """Iterate from q and r = f of the finest level until |r| <= rtol·limit, limit = |f|; returns (iterations, |r|)."""
    p, ap = fields[P], fields[AP]
    rows, n, s, t = levels[0, 1:5]
    start = starts[:rows]
    size = begin(fields, c, levels[0], start, pairs, parts, limit)
    old = 1.0
    for iteration in range(most):
        if size <= rtol * limit:
            return iteration, size
        new = cycle(fields, c, levels, starts, children, pairs, inverse, parts)
        redirect(p, fields[W], start, n, new / old)
        old = new
        wrap(p, pairs, levels[0])
        multiply(ap, p, c, start, n, s, t, parts)
        advance(fields, start, n, new / parts.sum(), parts)
        size = np.sqrt(parts.sum())
        if not np.isfinite(size):
            return iteration + 1, size
    return most, size
