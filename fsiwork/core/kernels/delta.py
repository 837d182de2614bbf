"""Between points and the grid by Peskin's regularised Dirac function: (3.4) and (3.6).

δ(x) = Π_a ζ(x_a/2h)/2h with the cosine ζ, over four points a direction, whatever the dimension. A field is padded and
flat; ``low`` are the coordinates of its cell 0 (its face 0 along its own direction), ``n`` the cells a direction,
negative where the box is periodic; what falls outside the padded field is left out.
"""

import numpy as np
from numba import njit

from fsiwork.core.kernels import FASTMATH, point

REACH = 4  # points a direction
serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)


@point
def _place(x, low, h, n, strides, ghosts, k):
    """Flat index and weight h^d δ of the k-th grid point around x; index -1 outside."""
    index, weight = 0, 1.0
    for a in range(x.size):
        s = (x[a] - low[a]) / h
        i = int(np.floor(s)) - 1 + k % REACH
        k //= REACH
        weight *= 0.25 * (1.0 + np.cos(0.5 * np.pi * (s - i)))
        if n[a] < 0:
            i %= -n[a]
        elif i < -ghosts or i >= n[a] + ghosts:
            return -1, 0.0
        index += (i + ghosts) * strides[a]
    return index, weight


@serial
def spread(q, X, f, low, h, n, strides, ghosts):
    """Add points' forces ``f``, shape (m,), to ``q`` as a force per volume: q += Σ f δ(x - X)."""
    dim = X.shape[1]
    for m in range(X.shape[0]):
        for k in range(REACH**dim):
            index, weight = _place(X[m], low, h, n, strides, ghosts, k)
            if index >= 0:
                q[index] += weight * f[m] / h**dim


@serial
def collect(out, q, X, low, h, n, strides, ghosts):
    """Values of ``q`` at points: out = Σ q δ(x - X) h^d."""
    dim = X.shape[1]
    for m in range(X.shape[0]):
        total = 0.0
        for k in range(REACH**dim):
            index, weight = _place(X[m], low, h, n, strides, ghosts, k)
            if index >= 0:
                total += weight * q[index]
        out[m] = total
