"""The linear model of section 1.6: u and φ coupled on a flat interface, N × N points, NΔx = 2π.

For the Fourier mode k, with α = sin²(k₁Δx/2) + sin²(k₂Δx/2), one step depends on two numbers only:
g = Δt β = 4λΔt²α/(εΔx²) and d = δ - 1 = 4μΔtα/Δx² (1.55). A case is (μ, λ, ε/Δx); cases come as three columns.
"""

from collections.abc import Callable
from itertools import product

import numpy as np
from numba import prange

from fsiwork.core.kernels import loop
from fsiwork.studies.exact import step_limit

SCHEMES = (
    "explicit",
    "crank-nicolson",
    "old-velocity",
    "implicit",
    "semi-implicit",
    "predictor-corrected",
    "predictor-printed",
)
ROUNDING = 1e-13  # a spectral radius this much above 1 is round-off; it moves a limit by half as much
CASES = tuple(product((0.0, *10.0 ** np.arange(-8, 4)), 10.0 ** np.arange(-3, 9), (0.5, 1.0, 1.5, 3.0, 6.0, 10.0)))
"""936 cases (μ, λ, ε/Δx): μ 0 and 1e-8…1e3, λ 1e-3…1e8, ε/Δx 0.5…10."""


def modes(cells: int) -> np.ndarray:
    """The different α > 0 of an N × N grid, N even (odd grids miss α = 2 and are slightly more stable)."""
    if cells < 2 or cells % 2:
        raise ValueError(f"the linear model needs an even number of points, got {cells}")
    line = np.sin(np.pi * np.arange(cells // 2 + 1) / cells) ** 2
    return np.unique(np.add.outer(line, line))[1:]


def radius(scheme: str, g, d, dt=0.0) -> np.ndarray:
    """Spectral radius of one step for modes with numbers g and d (arrays); ``dt`` for the misprint alone.

    Eigenvalues are the roots of a r² - b r + c; the discriminants are written without the cancellation of b² - 4ac.
    Schemes: (1.53); the same with half of the diffusion at the old time, or with uⁿ in the equation of φ; (1.59);
    (1.60)-(1.62) with Δt λ/ε (two names); the same with Δt² λ/ε, as printed.
    """
    if scheme == "explicit":
        a, b, c, disc = 1 + d, 2 + d - g, 1.0, d * d + g * (g - 4 - 2 * d)
    elif scheme == "crank-nicolson":
        a, b, c, disc = 1 + 0.5 * d, 2 - g, 1 - 0.5 * d, g * (g - 4) + d * d
    elif scheme == "old-velocity":
        a, b, c, disc = 1 + d, 2 + d, 1 + g, d * d - 4 * (1 + d) * g
    elif scheme == "implicit":
        a, b, c, disc = 1 + d + g, 2 + d, 1.0, d * d - 4 * g
    elif scheme in ("semi-implicit", "predictor-corrected", "predictor-printed"):
        printed = scheme == "predictor-printed"
        kappa = 1 + dt * g if printed else 1 + g
        q, c = g / kappa, ((1 + dt * g - g) if printed else 1.0) / kappa
        a, b, disc = 1 + d, 2 + d - 2 * q, d * d - 4 * q * c
    else:
        raise ValueError(f"no scheme {scheme!r}: one of {', '.join(SCHEMES)}")
    real = (np.abs(b) + np.sqrt(np.maximum(disc, 0))) / (2 * a)
    return np.where(disc >= 0, real, np.sqrt(np.abs(c / a)))


def numbers(case, dt, cells):
    """g and d, shape (cases, modes), of time steps dt, shape (cases,), for columns μ, λ, ε/Δx."""
    mu, lam, width = case
    dx = 2 * np.pi / cells
    alpha = modes(cells)
    return np.multiply.outer(4 * lam * dt**2 / (width * dx**3), alpha), np.multiply.outer(4 * mu * dt / dx**2, alpha)


def predicted(case, cells: int) -> np.ndarray:
    """(1.54) for columns μ, λ, ε/Δx."""
    mu, lam, width = case
    dx = 2 * np.pi / cells
    return step_limit(lam, mu, width * dx, dx)


def _largest_factor(stable: Callable[[np.ndarray], np.ndarray], cases: int, passes: int) -> np.ndarray:
    """Largest stable factor of each case in [1/2, 2], by bisection; the first trial is 1, the prediction itself."""
    low, high = np.full(cases, 0.5), np.full(cases, 2.0)
    for _ in range(passes):
        trial = np.sqrt(low * high)
        good = stable(trial)
        low, high = np.where(good, trial, low), np.where(good, high, trial)
    return low


def spectral_limits(case, cells: int = 16) -> np.ndarray:
    """Largest Δt over (1.54) at which the spectral radius of (1.53) is 1; columns μ, λ, ε/Δx, shape (cases,)."""
    limit = predicted(case, cells)

    def stable(factor):
        return radius("explicit", *numbers(case, factor * limit, cells)).max(axis=-1) <= 1 + ROUNDING

    return _largest_factor(stable, limit.size, 60)


def stepping_limits(case, cells: int = 16, steps: int = 20000, passes: int = 18) -> np.ndarray:
    """The same by advancing (1.53) itself: unstable is what grows by more than 10 in the second half of ``steps``."""
    limit = predicted(case, cells)

    def stable(factor):
        growth = np.empty(limit.shape)
        march(growth, *numbers(case, factor * limit, cells), steps // 2)
        return growth <= 100.0  # of squares; not a number is not stable

    return _largest_factor(stable, limit.size, passes)


@loop
def march(growth, g, d, half):
    """Sum of squares of all modes over the second ``half`` steps, over that of the first, for every case (row)."""
    for c in prange(g.shape[0]):
        gain, inverse = g[c], 1.0 / (1.0 + d[c])
        u, phi = np.ones(gain.size), np.ones(gain.size)  # u stands for Δt u
        sums = np.zeros(2)
        for part in range(2):
            total = 0.0
            for _ in range(half):
                for i in range(gain.size):
                    u[i] = (u[i] + gain[i] * phi[i]) * inverse[i]
                    phi[i] = phi[i] - u[i]
                    total += u[i] * u[i] + phi[i] * phi[i]
            sums[part] = total
        growth[c] = sums[1] / sums[0]
