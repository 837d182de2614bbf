"""Area of the surface φ = 0 and volume inside it in one cube, Σ c_klm σ^k τ^l υ^m, by height functions.

As `kernels.heights` in the plane, with one reduction of dimension more: where one derivative keeps clear of zero, the
surface is a graph over the square of the two other directions, and exists where the polynomials on the two faces differ
in sign. That square is cut into lines, each at the zeros of the two; the lines between their zeros on its sides. A cell
without such directions is cut into eight, at most `DEPTH` times, and counted by zeros on some lines after that.
"""

import math

import numpy as np

from fsiwork.core.kernels import point
from fsiwork.core.kernels.quintic import (
    HALVES,
    LEVEL,
    POWERS,
    STEEP,
    N,
    bounds,
    bracketed,
    horner,
    ordered,
    roots,
)

DEPTH = 3
STEEPEST = 4.0  # area over its projection, at most, where no direction is clear
GAUSS, WEIGHTS = (0.5 * q for q in np.polynomial.legendre.leggauss(4))


@point
def turned(a, c, out):
    """out[l, m, k'] = Σ_k a[k', k] c[k, l, m]: one direction transformed and put last; three times, all in order."""
    for l in range(N):
        for m in range(N):
            for p in range(N):
                value = 0.0
                for k in range(N):
                    value += a[p, k] * c[k, l, m]
                out[l, m, p] = value


@point
def change(a, b, c, q, work, out):
    """out = q transformed by a, b, c along its directions."""
    turned(a, q, out)
    turned(b, out, work)
    turned(c, work, out)


@point
def steepest(c):
    """(0 empty, 1 full, 2 graph, 3 none) for a cell, and the direction in which it is a graph or best so."""
    spread, best, axis = 0.0, -math.inf, 0
    most_x = most_y = most_z = 0.0
    for k in range(N):
        for l in range(N):
            for m in range(N):
                size = abs(c[k, l, m]) * POWERS[k] * POWERS[l] * POWERS[m]
                spread += size
                most_x += 2 * k * size
                most_y += 2 * l * size
                most_z += 2 * m * size
    if 2 * abs(c[0, 0, 0]) > spread * (1 + LEVEL) or spread == 0:
        return (1 if c[0, 0, 0] <= 0 else 0), axis
    for a in range(3):
        x, y, z = most_x, most_y, most_z
        slope = abs(c[1, 0, 0])
        if a == 1:
            x, y, slope = most_y, most_x, abs(c[0, 1, 0])
        elif a == 2:
            x, z, slope = most_z, most_x, abs(c[0, 0, 1])
        clear = 2 * slope - x - STEEP * max(y, z)
        if clear > best:
            best, axis = clear, a
    return (2 if best > 0 else 3), axis


@point
def face(c, side, out):
    """out = the polynomial where the first coordinate is ``side``."""
    size = 0.0
    for l in range(N):
        for m in range(N):
            value = c[N - 1, l, m]
            for k in range(N - 2, -1, -1):
                value = value * side + c[k, l, m]
            out[l, m] = value
            size += abs(value) * POWERS[l] * POWERS[m]
    if size <= LEVEL * abs(c[1, 0, 0]):
        out[:] = 0.0


@point
def clear(p):
    """How clear of zero the derivatives of a polynomial over the square keep; infinite if it has no zero."""
    spread, least_x, most_x, least_y, most_y = bounds(p)
    if abs(p[0, 0]) >= spread:
        return math.inf, math.inf
    return least_x - STEEP * most_y, least_y - STEEP * most_x


@point
def column(plane, lines, y, below, weight, total):
    """Adds what stands over one point of the square."""
    p, tilt_y, tilt_z = lines[2], lines[3], lines[4]
    for k in range(N):
        p[k], tilt_y[k] = horner(plane[0, k], y)
        tilt_z[k] = horner(plane[1, k], y)[0]
    s = bracketed(p, -0.5, 0.5, below)
    slope, b, c = horner(p, s)[1], horner(tilt_y, s)[0], horner(tilt_z, s)[0]
    total[0] += weight * math.sqrt(1 + (b * b + c * c) / (slope * slope))
    total[1] += weight * (0.5 + s if below else 0.5 - s)


@point
def line(c, faces, z, weight, plane, lines, total):
    """Adds what stands over a line through the square."""
    low, high, ends, work = lines[0], lines[1], lines[5], lines[7:]
    for l in range(N):
        low[l], high[l] = horner(faces[0, l], z)[0], horner(faces[1, l], z)[0]
        for k in range(N):
            plane[0, k, l], plane[1, k, l] = horner(c[k, l], z)
    count = roots(low, ends, work)
    count += roots(high, ends[count:], work)
    ordered(ends, count)
    ends[count] = 0.5
    start = -0.5
    for piece in range(count + 1):
        middle, span = 0.5 * (start + ends[piece]), ends[piece] - start
        start = ends[piece]
        below, above = horner(low, middle)[0] <= 0, horner(high, middle)[0] <= 0
        if below == above:
            total[1] += weight * span if below else 0.0
            continue
        for g in range(GAUSS.size):
            column(plane, lines, middle + GAUSS[g] * span, below, weight * WEIGHTS[g] * span, total)


@point
def graph(c, faces, plane, lines, total):
    """Adds (area, inside) of a unit cell in which the surface is x(y, z), the zeros on its faces y(z), to ``total``."""
    side, ends, work = lines[0], lines[6], lines[7:]
    count = 0
    for k in range(4):
        for m in range(N):
            side[m] = horner(faces[k // 2, :, m], 0.5 - k % 2)[0]
        count += roots(side, ends[count:], work)
    ordered(ends, count)
    ends[count] = 0.5
    start = -0.5
    for piece in range(count + 1):
        middle, span = 0.5 * (start + ends[piece]), ends[piece] - start
        start = ends[piece]
        for g in range(GAUSS.size):
            line(c, faces, middle + GAUSS[g] * span, WEIGHTS[g] * span, plane, lines, total)


@point
def crossings(c, plane, lines, total):
    """Adds (area, inside) of a unit cell by all zeros on lines along x: for want of a direction to be sure of."""
    p, tilt_y, tilt_z, ends, work = lines[2], lines[3], lines[4], lines[5], lines[7:]
    for g in range(GAUSS.size**2):
        y, z, weight = GAUSS[g % 4], GAUSS[g // 4], WEIGHTS[g % 4] * WEIGHTS[g // 4]
        for k in range(N):
            for l in range(N):
                plane[0, k, l], plane[1, k, l] = horner(c[k, l], z)
            p[k], tilt_y[k] = horner(plane[0, k], y)
            tilt_z[k] = horner(plane[1, k], y)[0]
        count = roots(p, ends, work)
        ends[count] = 0.5
        start = -0.5
        for piece in range(count + 1):
            s = ends[piece]
            total[1] += weight * (s - start) if horner(p, 0.5 * (start + s))[0] <= 0 else 0.0
            start = s
            if piece < count:
                slope, a, b = abs(horner(p, s)[1]), horner(tilt_y, s)[0], horner(tilt_z, s)[0]
                most = math.sqrt(slope * slope + a * a + b * b)
                total[0] += weight * (most / slope if most < STEEPEST * slope else STEEPEST)


@point
def laid(c, axis, swap, out):
    """out = c with ``axis`` first and the two others in turn, or swapped."""
    for k in range(N):
        for l in range(N):
            for m in range(N):
                e, f = (m, l) if swap else (l, m)
                out[k, l, m] = c[k, e, f] if axis == 0 else c[e, k, f] if axis == 1 else c[e, f, k]


@point
def reduced(c, d, axis, last, faces, plane, lines, total):
    """Adds (area, inside) of a cell that is a graph over the square across ``axis``; False if that square has to be
    cut, unless it is the ``last``."""
    for swap in range(2):
        laid(c, axis, swap, d)
        face(d, -0.5, faces[0])
        face(d, 0.5, faces[1])
        low_y, low_z = clear(faces[0])
        high_y, high_z = clear(faces[1])
        y, z = min(low_y, high_y), min(low_z, high_z)
        if y <= 0 and z <= 0 and not last:
            return False
        if y >= z:
            break
    graph(d, faces, plane, lines, total)
    return True


@point
def divide(c, stack, top, first, last, work):
    """Puts those of the eight parts of a cell on the stack that lie in the halves first[a] to last[a]."""
    for i in range(first[0], last[0] + 1):
        for j in range(first[1], last[1] + 1):
            for k in range(first[2], last[2] + 1):
                change(HALVES[i], HALVES[j], HALVES[k], c, work, stack[top])
                top += 1
    return top


@point
def cell(stack, top, size, depth, total):
    """Adds (area, inside), in units of the cell's side, of the ``top`` parts on the stack to ``total``."""
    c, d, work = np.empty((N, N, N)), np.empty((N, N, N)), np.empty((N, N, N))
    faces, plane, lines, part = np.empty((2, N, N)), np.empty((2, N, N)), np.empty((9, 4 * N + 2)), np.empty(2)
    while top > 0:
        top -= 1
        c[:] = stack[top]
        side, deep = size[top], depth[top]
        kind, axis = steepest(c)
        part[:] = 0
        if kind < 2:
            part[1] = kind
        elif kind == 3 and deep == DEPTH:
            laid(c, axis, 0, d)
            crossings(d, plane, lines, part)
        elif kind == 3 or not reduced(c, d, axis, deep == DEPTH, faces, plane, lines, part):
            size[top : top + 8], depth[top : top + 8] = 0.5 * side, deep + 1
            top = divide(c, stack, top, (0, 0, 0), (1, 1, 1), work)
            continue
        total[0] += part[0] * side * side
        total[1] += part[1] * side * side * side
