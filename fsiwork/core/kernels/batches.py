"""Many plane cells side by side: length and area where the line is one graph over the cell, as it nearly always is.

The common case of `kernels.heights` without branches. One flat array ``w`` holds it all, rows of `SIZE` numbers, one a
cell, at fixed places: only so the compiler sees that nothing overlaps and does several cells at a time.
"""

import math

import numpy as np

from fsiwork.core.kernels import point
from fsiwork.core.kernels.quintic import LEVEL, STEEP, TO_COEFFICIENTS, N

SIZE = 64
NODES, WORK, CELL, TURNED = (k * N * N * SIZE for k in range(4))
LOW, HIGH, P, TILT, REST = (4 * N * N * SIZE + k * N * SIZE for k in range(5))
KIND, START, SPAN, BELOW, ROOT, STEP, LENGTH, INSIDE = (REST + k * SIZE for k in range(8))
ROOM = REST + 8 * SIZE
GAUSS, WEIGHTS = (0.5 * q for q in np.polynomial.legendre.leggauss(5))
CLOSE = 1e-9  # last step of Newton's method: the next would be at round-off


@point
def transform(w):
    """From nodes to the coefficients of each cell."""
    for k in range(N):
        for m in range(N):
            to, by = WORK + (k * N + m) * SIZE, TO_COEFFICIENTS[m]
            q0, q1, q2, q3, q4, q5 = by[0], by[1], by[2], by[3], by[4], by[5]
            o = NODES + k * N * SIZE
            for b in range(SIZE):
                low = w[o + b] * q0 + w[o + SIZE + b] * q1 + w[o + 2 * SIZE + b] * q2
                w[to + b] = low + w[o + 3 * SIZE + b] * q3 + w[o + 4 * SIZE + b] * q4 + w[o + 5 * SIZE + b] * q5
    for k in range(N):
        by = TO_COEFFICIENTS[k]
        q0, q1, q2, q3, q4, q5 = by[0], by[1], by[2], by[3], by[4], by[5]
        for m in range(N):
            to, o, s = CELL + (k * N + m) * SIZE, WORK + m * SIZE, N * SIZE
            for b in range(SIZE):
                low = w[o + b] * q0 + w[o + s + b] * q1 + w[o + 2 * s + b] * q2
                w[to + b] = low + w[o + 3 * s + b] * q3 + w[o + 4 * s + b] * q4 + w[o + 5 * s + b] * q5


@point
def sort(w):
    """KIND = 0 where the line is no clear graph, 1 where it is σ(τ), 2 where it is τ(σ), -1 outside and -2 inside."""
    spread, along, across = ROOT, START, SPAN
    for b in range(SIZE):
        w[spread + b] = w[along + b] = w[across + b] = 0.0
    power = 1.0
    for k in range(N):
        p = power
        for l in range(N):
            o = CELL + (k * N + l) * SIZE
            for b in range(SIZE):
                size = abs(w[o + b]) * p
                w[spread + b] += size
                w[along + b] += 2 * k * size
                w[across + b] += 2 * l * size
            p *= 0.5
        power *= 0.5
    for b in range(SIZE):
        x = 2 * abs(w[CELL + N * SIZE + b]) - w[along + b]
        y = 2 * abs(w[CELL + SIZE + b]) - w[across + b]
        kind = 1.0 if x > STEEP * w[across + b] else 2.0 if y > STEEP * w[along + b] else 0.0
        side = -2.0 if w[CELL + b] <= 0 else -1.0
        w[KIND + b] = side if 2 * abs(w[CELL + b]) > w[spread + b] * (1 + LEVEL) else kind


@point
def upright(w):
    """The cells turned so that the line is σ(τ), φ rising along σ; and φ = σ in those of another kind."""
    for k in range(N):
        for l in range(N):
            o, t, to = CELL + (k * N + l) * SIZE, CELL + (l * N + k) * SIZE, TURNED + (k * N + l) * SIZE
            plain = 1.0 if k == 1 and l == 0 else 0.0
            for b in range(SIZE):
                kind = w[KIND + b]
                slope = w[CELL + N * SIZE + b] if kind == 1 else w[CELL + SIZE + b]
                value = w[o + b] if kind == 1 else w[t + b]
                w[to + b] = plain if kind <= 0 else value if slope > 0 else -value


@point
def sides(w):
    """The polynomials at σ = ∓1/2."""
    for l in range(N):
        o, s = TURNED + l * SIZE, N * SIZE
        for b in range(SIZE):
            even = w[o + b] + 0.25 * w[o + 2 * s + b] + 0.0625 * w[o + 4 * s + b]
            odd = 0.5 * w[o + s + b] + 0.125 * w[o + 3 * s + b] + 0.03125 * w[o + 5 * s + b]
            w[LOW + l * SIZE + b] = even - odd
            w[HIGH + l * SIZE + b] = even + odd


@point
def newton(w, p):
    """ROOT = zero of each polynomial at ``p``, from the chord, held in the cell; STEP = the last step."""
    for b in range(SIZE):
        c0, c1, c2 = w[p + b], w[p + SIZE + b], w[p + 2 * SIZE + b]
        c3, c4, c5 = w[p + 3 * SIZE + b], w[p + 4 * SIZE + b], w[p + 5 * SIZE + b]
        x = -0.5 * (c0 + 0.25 * c2 + 0.0625 * c4) / (0.5 * c1 + 0.125 * c3 + 0.03125 * c5)
        x = min(max(x, -0.5), 0.5)
        step = 0.0
        for _ in range(4):
            value = ((((c5 * x + c4) * x + c3) * x + c2) * x + c1) * x + c0
            slope = (((5 * c5 * x + 4 * c4) * x + 3 * c3) * x + 2 * c2) * x + c1
            new = min(max(x - value / slope, -0.5), 0.5)
            step = abs(new - x)
            x = new
        w[ROOT + b] = x
        w[STEP + b] = step


@point
def part(w, p, sign):
    """Where ``sign`` times the polynomial at ``p`` is positive: narrows START and SPAN (here the end); and KIND = 0
    where it is neither monotone nor clear of zero, or is zero."""
    newton(w, p)
    for b in range(SIZE):
        c0, c1, c2 = w[p + b], w[p + SIZE + b], abs(w[p + 2 * SIZE + b])
        c3, c4, c5 = abs(w[p + 3 * SIZE + b]), abs(w[p + 4 * SIZE + b]), abs(w[p + 5 * SIZE + b])
        spread = 0.5 * abs(c1) + 0.25 * c2 + 0.125 * c3 + 0.0625 * c4 + 0.03125 * c5
        clear, flat = abs(c0) > spread, abs(c0) + spread <= LEVEL * w[TURNED + N * SIZE + b]
        rising = abs(c1) > c2 + 0.75 * c3 + 0.5 * c4 + 0.3125 * c5
        known = (clear | (rising & (w[STEP + b] < CLOSE))) & (not flat)
        up, root = sign * c1 > 0, w[ROOT + b]
        start = (-0.5 if sign * c0 > 0 else 0.5) if clear else root if up else -0.5
        end = 0.5 if clear | up else root
        w[KIND + b] = w[KIND + b] if known else min(w[KIND + b], 0.0)
        w[START + b] = max(w[START + b], start)
        w[SPAN + b] = min(w[SPAN + b], end)
        w[BELOW + b] = 1 - (end - start)


@point
def stand(w, t_at, weight):
    """Adds what stands at one of Gauss's points of each piece."""
    for k in range(N):
        o = TURNED + k * N * SIZE
        for b in range(SIZE):
            t = w[START + b] + t_at * w[SPAN + b]
            c0, c1, c2 = w[o + b], w[o + SIZE + b], w[o + 2 * SIZE + b]
            c3, c4, c5 = w[o + 3 * SIZE + b], w[o + 4 * SIZE + b], w[o + 5 * SIZE + b]
            w[P + k * SIZE + b] = ((((c5 * t + c4) * t + c3) * t + c2) * t + c1) * t + c0
            w[TILT + k * SIZE + b] = (((5 * c5 * t + 4 * c4) * t + 3 * c3) * t + 2 * c2) * t + c1
    newton(w, P)
    for b in range(SIZE):
        x, span = w[ROOT + b], w[SPAN + b]
        slope = w[P + 5 * SIZE + b] * 5 * x + 4 * w[P + 4 * SIZE + b]
        slope = ((slope * x + 3 * w[P + 3 * SIZE + b]) * x + 2 * w[P + 2 * SIZE + b]) * x + w[P + SIZE + b]
        tilt = (w[TILT + 5 * SIZE + b] * x + w[TILT + 4 * SIZE + b]) * x + w[TILT + 3 * SIZE + b]
        tilt = ((tilt * x + w[TILT + 2 * SIZE + b]) * x + w[TILT + SIZE + b]) * x + w[TILT + b]
        w[LENGTH + b] += weight * span * math.sqrt(1 + (tilt / slope) ** 2)
        w[INSIDE + b] += weight * span * (0.5 + x)
        known = (w[STEP + b] < CLOSE) | (span == 0)
        w[KIND + b] = w[KIND + b] if known else min(w[KIND + b], 0.0)


@point
def measure(w):
    """LENGTH and INSIDE of each cell of side 1 from NODES; those of KIND 0 are left to others."""
    transform(w)
    sort(w)
    upright(w)
    sides(w)
    for b in range(SIZE):
        w[START + b], w[SPAN + b] = -0.5, 0.5
        w[LENGTH + b] = w[INSIDE + b] = 0.0
    part(w, LOW, -1.0)
    part(w, HIGH, 1.0)
    for b in range(SIZE):
        w[SPAN + b] = max(w[SPAN + b] - w[START + b], 0.0)
    for g in range(GAUSS.size):
        stand(w, 0.5 + GAUSS[g], WEIGHTS[g])
    for b in range(SIZE):
        kind = w[KIND + b]
        slope = w[CELL + N * SIZE + b] if kind == 1 else w[CELL + SIZE + b]
        inside = w[INSIDE + b] + w[BELOW + b]
        w[INSIDE + b] = (-1 - kind) if kind < 0 else inside if slope > 0 else 1 - inside
        w[LENGTH + b] = w[LENGTH + b] if kind > 0 else 0.0
