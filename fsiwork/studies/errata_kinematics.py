"""Printed formulas of Chapters 2 and 7 against what they must satisfy: residuals as printed and as corrected.

Conventions and exact derivatives as in `fsiwork.studies.errata_chapter1`.
"""

import numpy as np
from numpy.polynomial.polynomial import polyval2d
from scipy.linalg import expm

from fsiwork.core import schemes1d
from fsiwork.studies.errata_chapter1 import PHI, TEST, H, Residuals, Ring, cut_off


def _velocity(x: np.ndarray) -> np.ndarray:
    """A compressible flow in space; x of shape (3, points), complex allowed."""
    return np.array([0.3 * x[0] + np.sin(x[1]), 0.2 * x[0] * x[2] - 0.1 * x[1], np.cos(x[0]) + 0.4 * x[1] * x[2]])


def line_integral() -> Residuals:
    """(2.19): d/dt ∫f dl over a closed curve that moves with u, by a complex step in time, against its right side."""
    count = 128
    angle = 2 * np.pi * np.arange(count) / count
    curve = np.array([np.cos(angle), np.sin(angle), 0.3 * np.sin(2 * angle)])
    wave = 1j * np.fft.fftfreq(count, 1 / count)

    def f(x, t):
        return 2 + np.sin(x[0]) * x[1] + x[2] ** 2 * np.cos(t) + t * x[0]

    def along(q):  # d/dθ, spectral
        return np.fft.ifft(wave * np.fft.fft(q)).real

    u = _velocity(curve)
    tangent = along(curve)
    length = np.sqrt((tangent**2).sum(axis=0))
    stretched = tangent + 1j * H * along(u)
    moved = f(curve + 1j * H * u, 1j * H) * np.sqrt((stretched**2).sum(axis=0))
    exact = moved.imag.sum() / H
    tau = tangent / length
    stretch = (_velocity(curve + 1j * H * tau).imag / H * tau).sum(axis=0)  # (∇u τ)·τ
    carried = f(curve + 1j * H * u, 1j * H).imag / H  # ∂ₜf + u·∇f
    sides = [((carried + factor * stretch) * length).sum() for factor in (1.0, f(curve, 0.0))]
    return tuple(abs(side - exact) / abs(exact) for side in sides)


def elastic_stress() -> Residuals:
    """7.5, last system: the stress ±E'∇φ⊗∇φ/|∇φ| (1/ε)ζ must do the work that ∫E(|∇φ|)(1/ε)ζ gains, E = ½(r - 1)²."""
    ring = Ring()
    phi, g = polyval2d(ring.x, ring.y, PHI), ring.gradient(PHI)
    rate, change = ring.carried(TEST)
    _, grad = ring.velocity(TEST)
    slope = np.sqrt(sum((q + 1j * H * d) ** 2 for q, d in zip(g, change, strict=True)))
    gained = ring.sum(0.5 * (slope - 1) ** 2 * cut_off(phi + 1j * H * rate)).imag / H
    r = slope.real
    power = ring.sum((r - 1) * cut_off(phi) * sum(g[i] * grad[i][j] * g[j] for i in (0, 1) for j in (0, 1)) / r)
    return tuple(abs(sign * power - gained) / abs(gained) for sign in (1, -1))


def curve_energy() -> Residuals:
    """(7.45), (3.57): an energy of 1 for each rest length cannot change in a flow, however compressible it is.

    The flow is Y = (x/1.3 + 0.1 sin y, y/0.9, z/1.2 + 0.05 sin z); the curve a great circle, as φ¹ = z + 0.3x,
    φ² = ½(r² - 1). Without a weight, and with |∇φ₀¹ × ∇φ₀²|(Y)/J.
    """
    line = np.linspace(-1.75, 1.75, 110)
    x, y, z = np.meshgrid(line, line, line, indexing="ij", sparse=True)

    def energies(a, b, c, inverse):
        cut = np.exp(-((c + 0.3 * a) ** 2 + 0.25 * (a * a + b * b + c * c - 1) ** 2) / 0.09**2)
        cross = np.sqrt(b * b + (0.3 * c - a) ** 2 + 0.09 * b * b)  # |(0.3, 0, 1) × (a, b, c)|
        return np.array([cut.sum(), (cut * cross * inverse).sum()])

    rest = energies(x, y, z, 1.0)
    inverse = (1 / 1.2 + 0.05 * np.cos(z)) / (1.3 * 0.9)  # det ∇Y = 1/J
    moved = energies(x / 1.3 + 0.1 * np.sin(y), y / 0.9, z / 1.2 + 0.05 * np.sin(z), inverse)
    return tuple(float(q) for q in np.abs(moved / rest - 1))


def shear_case() -> Residuals:
    """Table 7.1, TC2: Z₂ = Tr A/(2Z₁) of the plane z = 0 in u = (βy, x, 0), F = exp(t∇u), for four β."""
    worst = np.zeros(2)
    t = 0.8
    for beta in (0.5, 1.0, 2.0, -0.4):
        gradient = np.array([[0, beta, 0], [1, 0, 0], [0, 0, 0]], float)
        left = expm(t * gradient) @ expm(t * gradient).T
        normal = np.array([0.0, 0.0, 1.0])
        a = left - np.outer(left @ normal, left @ normal) / (normal @ left @ normal)
        area = np.sqrt(0.5 * (np.trace(a) ** 2 - np.trace(a @ a)))
        exact = np.trace(a) / (2 * area)
        wave = (np.sinh(t * np.sqrt(complex(beta))) ** 2).real
        found = [1 + factor / (2 * beta) * wave for factor in (1 + beta, (1 + beta) ** 2)]
        worst = np.maximum(worst, np.abs(np.array(found) / exact - 1))
    return tuple(float(q) for q in worst)


def weno_stepping() -> Residuals:
    """Fig. 7.7: growth in a step of the worst mode under WENO5 with its ideal weights, CFL 0.2, Euler and SSP-RK3."""
    return tuple(max(schemes1d.growth("upwind5", 0.2, stepping) - 1, 0.0) for stepping in ("euler", "rk3"))


def advection_limit() -> Residuals:
    """(7.55): growth under upwind and Euler in the plane, u = (1, 1), just below Δt = Δx/max|u| and Σ|uᵢ|Δt/Δx = 1."""
    angle = np.linspace(0, np.pi, 401)
    wave = 1 - np.exp(-1j * angle)
    found = []
    for courant in (0.999, 0.4995):
        found.append(max(float(np.abs(1 - courant * np.add.outer(wave, wave)).max()) - 1, 0.0))
    return tuple(found)
