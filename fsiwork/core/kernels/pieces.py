"""Rows cut into pieces of one length: how steep a field is on each of them."""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, loop

# A maximum vectorises only when NaN may be ignored: allowed here, the field itself still carries its NaN.
peak = njit(parallel=True, error_model="numpy", fastmath=FASTMATH | {"nnan"}, cache=True)


@peak
def steepness(steep, q, start, n, s, size):
    """``steep[row, piece]``: largest |difference| of neighbours in the piece and two cells on either side of it.

    Piece b begins at cell b size, the last one so that it ends with the row; ``s`` are three strides, in 2D one twice.
    """
    for r in prange(start.size):
        I, m, x, y, z = start[r] - 2, n + 4, s[0], s[1], s[2]
        o, east, north, up = q[I : I + m], q[I + x : I + x + m], q[I + y : I + y + m], q[I + z : I + z + m]
        here, change = o[0], o[0] - o[0]  # most rows are flat
        for i in range(m):
            change += abs(o[i] - here) + abs(east[i] - here) + abs(north[i] - here) + abs(up[i] - here)
        if change == 0:
            steep[r] = 0
            continue
        d = np.empty(m, q.dtype)  # first without reductions, so that it vectorises
        for i in range(m):
            d[i] = max(abs(east[i] - o[i]), max(abs(north[i] - o[i]), abs(up[i] - o[i])))
        for b in range(steep.shape[1]):
            low = min(b * size, n - size)
            w, high = d[low + 2 : low + 2 + size], low + 2 + size
            t = w[0]
            for i in range(w.size):
                t = max(t, w[i])
            steep[r, b] = max(t, max(max(d[low], d[low + 1]), max(d[high], d[high + 1])))


@peak
def tallest(top, q, start, n):
    """Largest |q| of every piece, into ``top``."""
    for r in prange(start.size):
        o = q[start[r] : start[r] + n]
        t = abs(o[0])
        for i in range(n):
            t = max(t, abs(o[i]))
        top[r] = t


@loop
def copy(out, q, start, n):
    """out = q on the pieces."""
    for r in prange(start.size):
        out[start[r] : start[r] + n] = q[start[r] : start[r] + n]
