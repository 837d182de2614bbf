"""Polynomials of degree five on a unit interval or cell, |σ| ≤ 1/2: values, bounds, all their zeros.

Coefficients Σ c_k σ^k; those through six nodes are ``TO_COEFFICIENTS`` times the values there.
"""

import math

import numpy as np

from fsiwork.core.kernels import point

N = 6  # coefficients in a direction
STEEP = 0.5  # smallest |∂σ|/|∂τ| for a graph over τ: the integrand stays tame
LEVEL = 1e-11  # of the slope: a side as flat as that lies in the line, and belongs to the inside of both its cells

NODES = np.arange(N) - 2.5
TO_COEFFICIENTS = np.linalg.inv(NODES[:, None] ** np.arange(N))
HALVES = np.array(
    [
        [[math.comb(j, k) * (side * 0.25) ** (j - k) * 0.5**k if j >= k else 0.0 for j in range(N)] for k in range(N)]
        for side in (-1, 1)
    ]
)
"""Coefficients on the lower and the upper half of an interval from those on all of it."""
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
    """The root of p in [a, b], over whose ends it changes its sign; ``below``: p(a) ≤ 0.

    Four steps of Newton's method from the chord, without a branch: enough where p is hardly bent. Else kept in a
    bracket, one by one.
    """
    low, high = horner(p, a)[0], horner(p, b)[0]
    x, step = a + (b - a) * low / (low - high), 0.0
    for _ in range(4):
        value, slope = horner(p, x)
        step = value / slope
        x = min(max(x - step, a), b)
    if abs(step) < 1e-13:
        return x
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
    spread = tilt = 0.0
    for k in range(1, N):
        size = abs(p[k]) * POWERS[k]
        spread += size
        tilt += 2 * k * size
    if abs(p[0]) > spread:
        return 0
    if 2 * abs(p[1]) > tilt:  # monotone
        below = horner(p, -0.5)[0] <= 0
        if below == (horner(p, 0.5)[0] <= 0):
            return 0
        found[0] = bracketed(p, -0.5, 0.5, below)
        return 1
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
def ordered(x, count):
    """Sorts the first few numbers; faster than a general sort of so few."""
    for k in range(1, count):
        value, m = x[k], k
        while m > 0 and x[m - 1] > value:
            x[m] = x[m - 1]
            m -= 1
        x[m] = value


@point
def sound(q):
    """Whether all numbers of a contiguous array are finite; without an array of the answers."""
    flat, total = q.ravel(), 0.0
    for k in range(flat.size):
        total += 0.0 * flat[k]
    return total == 0.0
