"""What is known without a simulation: exact solutions, published tables and linear theory.

One module serves tests, tables and checks, so that a reference number is written down once, beside its source.
Lengths, times and masses are those of the scene; densities are 1 unless an argument says otherwise.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.optimize import newton as secant
from scipy.special import ellipe, ive, kve

from fsiwork.core.markers import Line, carry, circle
from fsiwork.core.motion import Vortex

# Ghia, Ghia and Shin (1982): u on the vertical mid-line of the lid-driven cavity (lid y = 1 moves with u = 1).
GHIA_Y = (0.9766, 0.9531, 0.8516, 0.7344, 0.6172, 0.5, 0.4531, 0.2813, 0.1719, 0.1016, 0.0547)
GHIA_U = {
    100: (0.84123, 0.68717, 0.23151, 0.00332, -0.13641, -0.20581, -0.21090, -0.15662, -0.10150, -0.06434, -0.03717),
    1000: (0.65928, 0.46604, 0.33304, 0.18719, 0.05702, -0.06080, -0.10648, -0.27805, -0.38289, -0.29730, -0.18109),
}


class Mode(NamedTuple):
    """A damped oscillation e^(-gamma t) cos(omega t): both in 1/time."""

    omega: float
    gamma: float


class Equilibrium(NamedTuple):
    """A circular membrane at rest: radius [length], stretch [1], pressure inside minus outside."""

    radius: float
    stretch: float
    pressure_jump: float


def taylor_green(x, y, t=0.0, nu=0.0, amplitude=1.0, wavenumber=1.0):
    """Taylor–Green vortices: (u, v, p) at points x, y and time t, for density 1.

    u = -A cos kx sin ky e^(-2νk²t), v = A sin kx cos ky e^(-2νk²t), p = -A²/4 (cos 2kx + cos 2ky) e^(-4νk²t): exact
    for the Navier–Stokes equations, periodic with period 2π/k. Arrays of any shapes that broadcast.
    """
    k = wavenumber
    decay = amplitude * np.exp(-2 * nu * k**2 * np.asarray(t))
    u = -decay * np.cos(k * x) * np.sin(k * y)
    v = decay * np.sin(k * x) * np.cos(k * y)
    p = -0.25 * decay**2 * (np.cos(2 * k * x) + np.cos(2 * k * y))
    return u, v, p


def cavity(reynolds: int) -> tuple[np.ndarray, np.ndarray]:
    """Points y and velocity u on x = 1/2 of the unit lid-driven cavity, by Ghia, Ghia and Shin (1982); Re 100 or 1000.

    Raises KeyError for another Reynolds number.
    """
    return np.array(GHIA_Y), np.array(GHIA_U[reynolds])


def stretched_blob(times: tuple[float, ...], longest: float = 0.01) -> list[Line]:
    """The line of Figs 1.5 and 1.6 at increasing ``times``: the circle about (1/2, 3/4), radius 0.15, in the vortex
    u = (-sin²πx sin 2πy, sin 2πx sin²πy) of the unit square, by markers at most ``longest`` apart.

    ``length_and_area()`` of each: with the default relative errors below 1e-7 and 1e-8 up to t = 5.
    """
    vortex, line, now, lines = (
        Vortex((0.0, 0.0), (1.0, 1.0)),
        circle((0.5, 0.75), 0.15, max(32, int(1 / longest)), False),
        0.0,
        [],
    )
    for time in times:
        steps = int(np.ceil((time - now) / (0.5 * longest) - 1e-9))
        for k in range(steps):
            dt = (time - now) / steps
            line = carry(line, lambda x, t: np.stack(vortex.velocity(*x)), now + k * dt, dt).split(longest, 0.3)
        now = time
        lines.append(line.split(longest, 0.3))
    return lines


def ellipse_perimeter(a: float, b: float) -> float:
    """Perimeter of an ellipse with semi-axes a and b [length], by the complete elliptic integral E."""
    large, small = max(a, b), min(a, b)
    return 4 * large * float(ellipe(1 - (small / large) ** 2))


def ellipse_stretch(a: float, b: float, rest_radius: float) -> float:
    """Stretch [1] of a membrane of rest circumference 2π ``rest_radius`` laid uniformly on an ellipse."""
    return ellipse_perimeter(a, b) / (2 * np.pi * rest_radius)


def membrane_equilibrium(area: float, rest_radius: float, stiffness: float = 1.0) -> Equilibrium:
    """Where an elastic loop with E = ½λ(s-1)² (3.13) ends when it encloses ``area`` [length²]: a circle.

    The pressure inside is higher by E'(s)/R = λ(s-1)/R (section 3.2, tension over radius).
    """
    radius = float(np.sqrt(area / np.pi))
    stretch = radius / rest_radius
    return Equilibrium(radius, stretch, stiffness * (stretch - 1) / radius)


def membrane_energy(stretch: float, rest_radius: float, stiffness: float = 1.0) -> float:
    """Energy ½λ(s-1)² 2π R₀ of a uniformly stretched loop of rest radius R₀ (energy per rest length, SPEC 5)."""
    return 0.5 * stiffness * (stretch - 1) ** 2 * 2 * np.pi * rest_radius


def lamb_frequency(tension: float, radius: float, n: int = 2, densities: tuple[float, float] = (1.0, 1.0)) -> float:
    """Lamb's inviscid frequency of mode n of a round two-dimensional drop: ω² = (n³-n)σ/((ρ_i+ρ_e)R³)."""
    return float(np.sqrt((n**3 - n) * tension / (sum(densities) * radius**3)))


def drop_mode(sigma: float, radius: float, mu: float, rho: float = 1.0, n: int = 2) -> Mode:
    """Small oscillation, mode n, of a drop of tension σ in an unbounded fluid of the same density and viscosity."""
    return _interface_mode(sigma, 0.0, radius, mu, rho, n)


def membrane_mode(stiffness: float, stretch: float, radius: float, mu: float, rho: float = 1.0, n: int = 2) -> Mode:
    """The same for a membrane E = ½λ(s-1)² at uniform ``stretch``: tension λ(s-1), and λs against further stretch."""
    return _interface_mode(stiffness * (stretch - 1), stiffness * stretch, radius, mu, rho, n)


def _interface_mode(tension: float, modulus: float, radius: float, mu: float, rho: float, n: int) -> Mode:
    """Oscillating root of the dispersion relation; raises ArithmeticError if the iteration does not arrive at one.

    It starts from Lamb's inviscid root and brings the viscosity up in steps, so that the root followed is the one that
    continues the inviscid oscillation.
    """
    start = complex(0, lamb_frequency(tension, radius, n, (rho, rho)))
    steps = np.geomspace(min(mu, 1e-5 * rho * abs(start) * radius**2), mu, 12)
    for viscosity in steps:
        start, ok = secant(
            _dispersion,
            start,
            x1=start * (1 + 1e-4) - 1e-4,
            args=(tension, modulus, radius, viscosity, rho, n),
            tol=1e-13,
            maxiter=100,
            full_output=True,
            disp=False,
        )
        if not ok.converged or not np.isfinite(start):
            raise ArithmeticError(f"no oscillating mode found for viscosity {viscosity:g}")
    return Mode(float(abs(start.imag)), float(-start.real))


def _dispersion(s, tension, modulus, radius, mu, rho, n):
    """Residual of the balance of normal forces for a perturbation e^(inθ + st), tangential forces balanced.

    Streamfunction f(r), f(R) = 1: (1-b)(r/R)^n + b I_n(kr)/I_n(kR) inside, (1-d)(R/r)^n + d K_n(kr)/K_n(kR) outside,
    k² = ρs/μ. Both sides share f and f' = g at R. Radial displacement n/(R s), strain n(1/R - g)/(R s) up to the
    factor i. The jump of f'' is k²(d-b), and pressure comes from the irrotational parts alone: -ρs(1-b) and ρs(1-d).
    """
    z = np.sqrt(rho * s / mu + 0j) * radius  # principal root: the outer layer decays
    inner = (z * ive(n - 1, z) / ive(n, z) - n) / radius  # k I'/I; the scalings of the two cancel
    outer = -(z * kve(n - 1, z) / kve(n, z) + n) / radius
    q = n / radius
    stiff = modulus * n**2 / (radius**2 * rho * s**2)
    # tangential balance (d - b) + stiff (1/R - g) = 0 with b = (g - q)/(inner - q), d = (g + q)/(outer + q)
    slope = 1 / (outer + q) - 1 / (inner - q) - stiff
    g = -(q / (outer + q) + q / (inner - q) + stiff / radius) / slope
    b, d = (g - q) / (inner - q), (g + q) / (outer + q)
    normal = tension * n * (n**2 - 1) / radius**3 + modulus * n / radius**2 * (1 / radius - g)
    return rho * s**2 * (2 - b - d) + normal


def step_limit(lam, mu, eps, dx, rho=1.0, *, directions: int = 2, peak: float = 1.0, theta: float = 1.0):
    """Largest stable Δt of the explicit scheme (1.53): (1.54), [με + √(μ²ε² + ½ρλεΔx²)]/λ.

    ``directions`` is the dimension of the interface: 2 gives (1.54), 1 replaces ½ by 1 (a flow in the plane).
    ``peak`` is ζ(0): 1 for the coefficient λ/ε of (1.53), ½ for the λ/(2ε) of (1.48). Both necessary and sufficient on
    grids with an even number of points (ERRATA 3). For a membrane λ is the tension s E'(s). Arrays broadcast.

    ``theta`` weighs the new time in the diffusion, θ ≥ ½: μ becomes (2θ-1)μ (from r = -1 in the quadratic of one mode),
    so that Crank–Nicolson, θ = ½, gains nothing from viscosity; backward Euler is the θ = 1 of (1.53).
    """
    width = np.asarray(eps) / peak
    viscous = (2 * theta - 1) * mu * width
    return (viscous + np.sqrt(viscous**2 + rho * lam * width * np.asarray(dx) ** 2 / directions)) / lam


def step_limit_old_velocity(lam, mu, eps):
    """Limit με/λ when φ is moved with uⁿ instead of uⁿ⁺¹: none at μ = 0 (ERRATA 3)."""
    return mu * np.asarray(eps) / lam


def damped_mode(t, a) -> Mode:
    """Fit c + e^(-γt)(A cos ωt + B sin ωt) to samples a(t), shape (n,), n ≥ 8: least squares from Prony's start.

    Samples need not be equidistant. Prony's linear prediction is tried at several lags, the best is refined; only
    ω and γ are searched, c, A and B follow linearly (variable projection). Raises ValueError for too few or non-finite
    samples.
    """
    t, a = np.asarray(t, float), np.asarray(a, float)
    if t.size < 8 or not (np.isfinite(a).all() and np.isfinite(t).all()):
        raise ValueError("a fit needs at least eight finite samples")
    t = t - t[0]
    scale = t[-1]

    def residual(q):
        phase = np.exp(-q[1] / scale * t)
        basis = np.stack([np.ones_like(t), phase * np.cos(q[0] / scale * t), phase * np.sin(q[0] / scale * t)], 1)
        return basis @ np.linalg.lstsq(basis, a, rcond=None)[0] - a

    starts = [np.array(q) * scale for q in _prony(t, a)]
    best = min(starts, key=lambda q: float(np.sum(residual(q) ** 2)))
    fit = least_squares(residual, best, x_scale=np.maximum(np.abs(best), 0.1), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return Mode(abs(float(fit.x[0])) / scale, float(fit.x[1]) / scale)


def _prony(t: np.ndarray, a: np.ndarray) -> list[tuple[float, float]]:
    """Guesses (ω, γ) from a(t+τ) = p a(t) + q a(t-τ) + c by least squares, for a range of lags τ."""
    even = np.linspace(0, t[-1], max(t.size, 64))
    a = np.interp(even, t, a)
    guesses = [(2 * np.pi / t[-1] * waves, 1 / t[-1]) for waves in (0.5, 1, 2, 4)]
    for lag in np.unique(np.geomspace(1, even.size // 3, 20).astype(int)):
        table = np.stack([a[lag:-lag], a[: -2 * lag], np.ones(even.size - 2 * lag)], 1)
        p, q, _ = np.linalg.lstsq(table, a[2 * lag :], rcond=None)[0]
        root = np.log(np.roots([1, -p, -q]).astype(complex)) / (even[lag] - even[0])
        if root.size and np.isfinite(root).all() and abs(root[0].imag) > 0:
            guesses.append((abs(root[0].imag), -root[0].real))
    return guesses
