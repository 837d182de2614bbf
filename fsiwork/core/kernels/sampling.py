"""A centre field at places away from its points, by tensor quintics through the six points around in each direction.

The places are lengths, one array a direction; their padded index is X/h + ``low``. A place further out than the first
ghosts is moved to them; one that is no number gives no number.
"""

from math import floor

from numba import prange

from fsiwork.core.grid import GHOSTS
from fsiwork.core.kernels import loop, point


@point
def inside(x, n):
    """``x`` where there are six points around."""
    return min(max(x, GHOSTS - 1.0), n + GHOSTS + 0.0)


@point
def below(x, n):
    """Index of the point below; any will do for what is no number, whose weights carry it on."""
    return min(floor(x), n + GHOSTS - 1) if x == x else GHOSTS


@point
def weights(t):
    """Lagrange's weights of the points -2 … 3 at t."""
    a, b, c, d, e = t + 2.0, t + 1.0, t - 1.0, t - 2.0, t - 3.0
    return (
        -b * t * c * d * e / 120.0, a * t * c * d * e / 24.0, -a * b * c * d * e / 12.0,
        a * b * t * d * e / 12.0, -a * b * t * c * e / 24.0, a * b * t * c * d / 120.0,
    )  # fmt: skip


@point
def at2(q, o, s, box, x, y):
    """Value at padded indices (x, y), real numbers, of the plane that begins at ``o``."""
    x, y = inside(x, box[0]), inside(y, box[1])
    i, j = below(x, box[0]), below(y, box[1])
    wx, wy = weights(x - i), weights(y - j)
    total = 0.0
    for k in range(6):
        J = o + (i - 2 + k) * s[0] + j
        row = wy[0] * q[J - 2] + wy[1] * q[J - 1] + wy[2] * q[J]
        total += wx[k] * (row + wy[3] * q[J + 1] + wy[4] * q[J + 2] + wy[5] * q[J + 3])
    return total


@loop
def sample_2d(out, q, X, Y, start, n, s, box, low, h):
    """``out`` = q at (X, Y)."""
    for r in prange(start.size):
        for I in range(start[r], start[r] + n):
            out[I] = at2(q, 0, s, box, X[I] / h + low[0], Y[I] / h + low[1])


@loop
def sample_3d(out, q, X, Y, Z, start, n, s, box, low, h):
    """``out`` = q at (X, Y, Z)."""
    for r in prange(start.size):
        for I in range(start[r], start[r] + n):
            x, y, z = inside(X[I] / h + low[0], box[0]), Y[I] / h + low[1], Z[I] / h + low[2]
            i = below(x, box[0])
            w = weights(x - i)
            total = 0.0
            for k in range(6):
                total += w[k] * at2(q, (i - 2 + k) * s[0], s[1:], box[1:], y, z)
            out[I] = total


@loop
def steepest(out, Y, runs, s, k):
    """out[t] = largest |∂Y| along any direction over a run, by central differences; ``k`` is 1/2h."""
    for t in prange(runs.shape[0]):
        top = 0.0
        for I in range(runs[t, 0], runs[t, 0] + runs[t, 1]):
            for d in range(s.size):
                top = max(top, abs(k * (Y[I + s[d]] - Y[I - s[d]])))
        out[t] = top
