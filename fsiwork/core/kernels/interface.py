"""Where an interface is and what it measures: band of cells, sums over it, mixtures.

``flags[row, block]`` says whether one of the `BLOCK` cells of a block lies in the band; the rows are those of
``grid.rows(1, 1)``. ``runs``, ``s``, ``kind`` and ``numbers`` as in `kernels.membrane`, whose point formulas serve here
(the cache folder's name has the source hash, so an edit there is noticed).
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, loop, point
from fsiwork.core.kernels.membrane import TINY, dirac, ramp, tension

BLOCK = 16
LENGTH, ENERGY, LEAST, MOST, PULL, TENSION, MODULUS, PEAK = range(8)  # columns of `survey`


@loop
def mark(flags, phi, start, n, s, near, slack):
    """flags = 1 where |φ| < near + slack · root of Σ_a (steeper one-sided difference)²; slack in cells.

    One-sided: in a body thinner than cells the central gradient vanishes, these do not.
    """
    a, b, c, slack2 = s[0], s[1], s[2], slack * slack
    for r in prange(start.size):
        for m in range(flags.shape[1]):
            I, k = start[r] + m * BLOCK, min(BLOCK, n - m * BLOCK)
            p, count = phi[I : I + k], 0
            ae, aw, be, bw, ce, cw = phi[I + a :], phi[I - a :], phi[I + b :], phi[I - b :], phi[I + c :], phi[I - c :]
            for i in range(k):
                pi = p[i]
                da, db, dc = max(abs(ae[i] - pi), abs(aw[i] - pi)), max(abs(be[i] - pi), abs(bw[i] - pi)), 0.0
                dc = max(abs(ce[i] - pi), abs(cw[i] - pi))
                rest = max(abs(pi) - near, 0.0)
                count += rest * rest < slack2 * (da * da + db * db + dc * dc)
            flags[r, m] = count > 0


@njit(cache=True, error_model="numpy", fastmath=FASTMATH)
def assemble(runs, inside, flags, start, n, interior):
    """Join flagged blocks to runs, and to runs of cells of the box alone; return how many of each, and cells."""
    m, k, cells, cells_inside = 0, 0, 0, 0
    for r in range(start.size):
        b = 0
        while b < flags.shape[1]:
            if not flags[r, b]:
                b += 1
                continue
            first = b * BLOCK
            while b < flags.shape[1] and flags[r, b]:
                b += 1
            last = min(b * BLOCK, n)
            runs[m, 0], runs[m, 1], runs[m, 2] = start[r] + first, last - first, cells
            m, cells = m + 1, cells + last - first
            first, last = max(first, 1), min(last, n - 1)
            if interior[r] and last > first:
                inside[k, 0], inside[k, 1], inside[k, 2] = start[r] + first, last - first, cells_inside
                k, cells_inside = k + 1, cells_inside + last - first
    return m, k, cells, cells_inside


@point
def modulus(A, B):
    """As `bodies.laws.modulus`: the largest of A s² + B s (1 - s) over 0 ≤ s ≤ 1, and never below zero."""
    return max(A, 0.0) if max(2.0 * A, 0.0) >= B else B * B / (4.0 * (B - A))


@loop
def survey(out, phi, runs, s, kind, numbers, given):
    """One row of ``out`` a run: sums of |∇φ| D_ε and E D_ε, extremes of |∇φ| over D_ε > 0, the sum of E'|∇φ| D_ε, and
    largest |∇φ|E', M(E'|∇φ|, E''|∇φ|²) and M D_ε. ``given[0..2]``: E, E', E'' for kind 2."""
    a, b, c = s[0], s[1], s[2]
    h, eps, renormalised, lam = numbers[0], numbers[1], numbers[2] > 0.0, numbers[3]
    k = 0.5 / h
    for r in prange(runs.shape[0]):
        I, n, o = runs[r, 0], runs[r, 1], runs[r, 2]
        p, e0, e1, e2 = phi[I:], given[0, o:], given[1, o:], given[2, o:]
        ae, aw, be, bw, ce, cw = phi[I + a :], phi[I - a :], phi[I + b :], phi[I - b :], phi[I + c :], phi[I - c :]
        length, energy, least, most, pull, tense, stiff, peak = 0.0, 0.0, np.inf, 0.0, 0.0, -np.inf, 0.0, 0.0
        for i in range(n):
            ga, gb, gc = k * (ae[i] - aw[i]), k * (be[i] - bw[i]), k * (ce[i] - cw[i])
            g = np.sqrt(ga * ga + gb * gb + gc * gc + TINY)
            if abs(p[i]) >= (eps * g if renormalised else eps):
                continue
            D = dirac(p[i], g, eps, renormalised)
            E1 = tension(kind, lam, g, e1[i] if kind == 2 else 0.0)
            E0 = e0[i] if kind == 2 else (lam * g if kind == 0 else 0.5 * lam * (g - 1.0) * (g - 1.0))
            E2 = e2[i] if kind == 2 else (0.0 if kind == 0 else lam)
            M = modulus(E1 * g, E2 * g * g)
            length, energy = length + D * g, energy + D * E0
            least, most, pull = min(least, g), max(most, g), pull + D * g * E1
            tense, stiff, peak = max(tense, E1 * g), max(stiff, M), max(peak, M * D)
        out[r, LENGTH], out[r, ENERGY], out[r, LEAST], out[r, MOST] = length, energy, least, most
        out[r, PULL], out[r, TENSION], out[r, MODULUS], out[r, PEAK] = pull, tense, stiff, peak


@loop
def inside_sums(out, phi, start, n, flags, row, moments, eps):
    """out[r] = Σ χ, Σ w₀ χ, Σ w₁ χ along each row of the box, χ = 1 - H_ε(φ).

    ``row`` finds the row in ``flags``; ``moments`` (4, n + 1) are w₀, w₁ and their sums over the cells before.
    """
    for r in prange(start.size):
        p, f = phi[start[r] : start[r] + n], flags[row[r]]
        total, one, two, m = 0.0, 0.0, 0.0, 0
        while m < f.size:
            first, near = max(m * BLOCK - 1, 0), f[m]
            while m < f.size and f[m] == near:
                m += 1
            last = min(m * BLOCK - 1, n)
            count = 0
            if not near:
                for i in range(first, last):
                    count += p[i] < 0.0
            if not near and count == last - first:
                total, one = total + count, one + (moments[2, last] - moments[2, first])
                two += moments[3, last] - moments[3, first]
            elif near or count:
                for i in range(first, last):
                    chi = ramp(-p[i] / eps)
                    total, one, two = total + chi, one + moments[0, i] * chi, two + moments[1, i] * chi
        out[r, 0], out[r, 1], out[r, 2] = total, one, two


@loop
def mix(q, phi, start, n, flags, row, s, numbers, inside, mass):
    """q = inside + (q - inside) H_ε + mass D_ε at the centres of the box (3.19)."""
    a, b, c = s[0], s[1], s[2]
    h, eps, renormalised = numbers[0], numbers[1], numbers[2] > 0.0
    k = 0.5 / h
    for r in prange(start.size):
        for m in range(flags.shape[1]):
            first, last = max(m * BLOCK - 1, 0), min((m + 1) * BLOCK - 1, n)
            I = start[r]
            o, p = q[I:], phi[I:]
            ae, aw, be, bw = phi[I + a :], phi[I - a :], phi[I + b :], phi[I - b :]
            ce, cw = phi[I + c :], phi[I - c :]
            if flags[row[r], m]:
                for i in range(first, last):
                    ga, gb, gc = k * (ae[i] - aw[i]), k * (be[i] - bw[i]), k * (ce[i] - cw[i])
                    g = np.sqrt(ga * ga + gb * gb + gc * gc + TINY)
                    H = ramp(p[i] / (eps * g if renormalised else eps))
                    o[i] = inside + (o[i] - inside) * H + mass * dirac(p[i], g, eps, renormalised)
            else:
                for i in range(first, last):
                    o[i] = inside if p[i] < 0.0 else o[i]


@loop
def carry_along(out, phi, u, start, n, s, k, first):
    """out = (φ if first else out) - k u ∂φ/∂x_s, k = dt/(4h): centred; ``out`` is compact, in the box's row order."""
    for r in prange(start.size):
        I = start[r]
        o, p, e, w, west, east = out[r * n : (r + 1) * n], phi[I:], phi[I + s :], phi[I - s :], u[I:], u[I + s :]
        for i in range(n):
            o[i] = (p[i] if first else o[i]) - k * (west[i] + east[i]) * (e[i] - w[i])
