"""What is measured of a membrane with shear: sums and extremes over its band, det ∇Y, energy density, φ.

Arguments as in `kernels.shear`.
"""

import numpy as np
from numba import prange

from fsiwork.core.kernels import loop
from fsiwork.core.kernels.shear_points import TINY, corner, dirac, energy, near, place, sliding, stiffness, surface

ENERGY, AREA, SHEARED, SQUARES, LEAST_DET, LEAST1, MOST1, LEAST2, MOST2, STIFF = range(10)  # columns of `survey`
SUMS = 4  # of them, the first


@loop
def survey(out, Y0, Y1, Y2, runs, s, numbers, law, centre, period):
    """One row of ``out`` a run: sums of D E, D|∇φ|, (Z₂ - 1)D|∇φ|, (det ∇Y/weight - 1)² D|∇φ|; least det ∇Y/weight,
    extremes of Z₁ and Z₂, largest stiffness, all where D_ε > 0."""
    x, y, h, eps, radius = s[0], s[1], numbers[0], numbers[1], numbers[2]
    for t in prange(runs.shape[0]):
        for j in range(SUMS):
            out[t, j] = 0.0
        out[t, LEAST_DET], out[t, LEAST1], out[t, MOST1] = np.inf, np.inf, -np.inf
        out[t, LEAST2], out[t, MOST2], out[t, STIFF] = np.inf, -np.inf, 0.0
        for I in range(runs[t, 0], runs[t, 0] + runs[t, 1]):
            r, w, det = place(Y0, Y1, Y2, I, x, y, h, centre, period)
            distance = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) + TINY
            D, _ = dirac(distance - radius, eps, 1.0)
            S, _ = dirac(distance - radius, numbers[8], 0.5 * numbers[3] * numbers[7])
            if D == 0.0 and S == 0.0:
                continue
            m = (r[0] / distance, r[1] / distance, r[2] / distance)
            _, f, _, _, _, size, Z1, Z2 = surface(w, det, m)
            slid = sliding(f, size)
            out[t, ENERGY] += S * slid
            if D == 0.0:
                continue
            E, dE1, dE2, ddE1, ddE2 = energy(law, numbers[4], numbers[5], Z1, Z2)
            change = det / numbers[3]
            out[t, ENERGY] += numbers[3] * D * (E + 0.5 * numbers[6] * (change - 1.0) * (change - 1.0))
            out[t, AREA] += D * size
            out[t, SHEARED] += (Z2 - 1.0) * D * size
            out[t, SQUARES] += (change - 1.0) * (change - 1.0) * D * size
            out[t, LEAST_DET] = min(out[t, LEAST_DET], change)
            out[t, LEAST1], out[t, MOST1] = min(out[t, LEAST1], Z1), max(out[t, MOST1], Z1)
            out[t, LEAST2], out[t, MOST2] = min(out[t, LEAST2], Z2), max(out[t, MOST2], Z2)
            M = numbers[3] * max(stiffness(dE1, dE2, ddE1, ddE2, Z1, Z2), numbers[7] * (1.0 + slid))
            out[t, STIFF] = max(out[t, STIFF], M)


@loop
def determinants(out, Y0, Y1, Y2, start, n, x, y, h, weight):
    """out[r] = Σ (det ∇Y/weight - 1)² over the nodes of a row."""
    for r in prange(start.size):
        total = 0.0
        for I in range(start[r], start[r] + n):
            _, a0, a1, a2 = corner(Y0, I, x, y, h)
            _, b0, b1, b2 = corner(Y1, I, x, y, h)
            _, c0, c1, c2 = corner(Y2, I, x, y, h)
            det = a0 * (b1 * c2 - b2 * c1) + a1 * (b2 * c0 - b0 * c2) + a2 * (b0 * c1 - b1 * c0)
            total += (det / weight - 1.0) ** 2
        out[r] = total


@loop
def distances(phi, Y0, Y1, Y2, centre, period, radius):
    """φ = |Y - centre| - radius at every centre, ghosts too."""
    for I in prange(phi.size):
        a, b, c = (
            near(Y0[I] - centre[0], period[0]),
            near(Y1[I] - centre[1], period[1]),
            near(Y2[I] - centre[2], period[2]),
        )
        phi[I] = np.sqrt(a * a + b * b + c * c) - radius


@loop
def densities(out, Y0, Y1, Y2, runs, s, numbers, law, centre, period):
    """out = D E + S E_s + n·Tn at each node of the runs.

    The force is ∇(D E + S E_s) + div T; with n·Tn I taken out of T, what is left of T is tension, and drag between
    layers.
    """
    x, y, h, eps, radius = s[0], s[1], numbers[0], numbers[1], numbers[2]
    for t in prange(runs.shape[0]):
        for I in range(runs[t, 0], runs[t, 0] + runs[t, 1]):
            r, w, det = place(Y0, Y1, Y2, I, x, y, h, centre, period)
            distance = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) + TINY
            out[I] = 0.0
            D, _ = dirac(distance - radius, eps, numbers[3])
            S, _ = dirac(distance - radius, numbers[8], numbers[3])
            if D == 0.0 and S == 0.0:
                continue
            m = (r[0] / distance, r[1] / distance, r[2] / distance)
            _, f, _, _, _, size, Z1, Z2 = surface(w, det, m)
            E = energy(law, numbers[4], numbers[5], Z1, Z2)[0]
            j = det / numbers[3]
            # ½κ(j - 1)² - κ(j - 1)j, and ½κ_s tan² - κ_s tan²
            out[I] = D * (E - 0.5 * numbers[6] * (j * j - 1.0)) - 0.5 * S * numbers[7] * sliding(f, size)
