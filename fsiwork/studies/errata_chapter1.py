"""Printed formulas of Chapter 1 against what they must satisfy: residuals as printed and as corrected.

Each function returns (residual as printed, as corrected), relative, of a formula that ERRATA lists; one that converges
adds its observed order. Derivatives are exact: of polynomials, or by a complex step (Im f(x + ih)/h, h = 1e-30).
"""

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval2d
from scipy.special import erf

from fsiwork.core import integrals
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.studies import linear
from fsiwork.studies.orders import slope

H = 1e-30  # imaginary step
EPS = 0.06  # half-width of the Gaussian cut-off in units of φ
TENSION = 0.7
Residuals = tuple[float, ...]

PHI = np.array([[-0.5, -0.04, 0.5], [0.05, 0.1, 0.0], [0.5, 0.06, 0.0]])
"""φ = ½(x² + y² - 1) and less regular terms: coefficients of xⁱyʲ. Its line is near the unit circle, |∇φ| from 0.8 to
1.3 on it; it has no flat point where the cut-off is more than 1e-20."""
TEST = np.array([[0.3, 0.7, -0.2], [0.4, -0.5, 0.3], [-0.6, 0.2, 0.1]])
IMAGE = np.array([[0.2, -0.3, 0.5], [0.6, 0.4, 0.0], [-0.2, 0.1, 0.0]])


class Ring:
    """Points (r, θ) with r from 0.35 to 1.65: trapezium sums over smooth functions near φ = 0, exact to round-off."""

    def __init__(self, across: int = 240, around: int = 160):
        r, angle = np.linspace(0.35, 1.65, across), 2 * np.pi * np.arange(around) / around
        r, angle = np.meshgrid(r, angle, indexing="ij")
        self.x, self.y = r * np.cos(angle), r * np.sin(angle)
        self.weight = r * (1.3 / (across - 1)) * (2 * np.pi / around)

    def sum(self, q: np.ndarray):
        """∫ q."""
        return (q * self.weight).sum()

    def derivatives(self, c: np.ndarray, *orders: tuple[int, int]) -> list[np.ndarray]:
        """∂ˣ∂ʸ of a polynomial, for each pair of ``orders``."""
        return [polyval2d(self.x, self.y, polyder(polyder(c, i, axis=0), j, axis=1)) for i, j in orders]

    def gradient(self, c: np.ndarray) -> list[np.ndarray]:
        return self.derivatives(c, (1, 0), (0, 1))

    def velocity(self, stream: np.ndarray) -> tuple[list[np.ndarray], list[list[np.ndarray]]]:
        """u = (∂_y ψ, -∂_x ψ), which is free of divergence, and ∇u, rows by component."""
        x, y, xx, xy, yy = self.derivatives(stream, (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        return [y, -x], [[xy, yy], [-xx, -xy]]

    def carried(self, stream: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        """∂ₜφ = -u·∇φ and its gradient."""
        u, grad = self.velocity(stream)
        g = self.gradient(PHI)
        xx, xy, yy = self.derivatives(PHI, (2, 0), (1, 1), (0, 2))
        second = [[xx, xy], [xy, yy]]
        rate = -(u[0] * g[0] + u[1] * g[1])
        return rate, [-sum(grad[i][a] * g[i] + u[i] * second[i][a] for i in (0, 1)) for a in (0, 1)]

    def curvature(self) -> np.ndarray:
        """div ∇φ/|∇φ|."""
        x, y, xx, xy, yy = self.derivatives(PHI, (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        return (xx * y * y - 2 * x * y * xy + yy * x * x) / np.hypot(x, y) ** 3


def cut_off(phi: np.ndarray) -> np.ndarray:
    """(1/ε) ζ(φ/ε) with ζ(r) = exp(-r²)/√π; complex φ are allowed."""
    return np.exp(-((phi / EPS) ** 2)) / (np.sqrt(np.pi) * EPS)


def shape_operator() -> Residuals:
    """(1.6), (1.7): dn of a triaxial ellipsoid, exact by a complex step, against [h][g]⁻¹ and its negative."""
    a, b, c = 1.5, 1.0, 2 / 3

    def tangents(s, t):
        along = np.array([a * np.cos(s) * np.cos(t), b * np.cos(s) * np.sin(t), -c * np.sin(s)])
        return along, np.array([-a * np.sin(s) * np.sin(t), b * np.sin(s) * np.cos(t), 0 * s])

    def normal(s, t):
        n = np.cross(*tangents(s, t))
        return n / np.sqrt((n * n).sum())

    worst = np.zeros(2)
    for s, t in ((0.7, 0.4), (1.9, 2.5), (1.2, 5.0)):
        steps = ((s + 1j * H, t), (s, t + 1j * H))
        e = np.array(tangents(s, t))
        second = np.array([np.array(tangents(*q)).imag / H for q in steps])
        change = np.array([normal(*q).imag / H for q in steps])
        g, h = e @ e.T, second @ normal(s, t)
        exact = change @ e.T @ np.linalg.inv(g)  # ∂ⱼn = Σᵢ (dn)ⱼᵢ ∂ᵢγ
        printed = h @ np.linalg.inv(g)
        size = np.abs(exact).max()
        worst = np.maximum(worst, [np.abs(printed - exact).max() / size, np.abs(printed + exact).max() / size])
    return tuple(worst)


def frenet_curvature() -> Residuals:
    """(1.22): |∇τ τ| of y = sin x as a curve in space, against div n, which is negative on the arcs bent inwards."""
    x = np.linspace(0.1, 6.1, 60)

    def tangent(q):
        steepness = np.cos(q)
        return np.array([1 + 0 * q, steepness]) / np.sqrt(1 + steepness**2)

    def normal_x(q):
        return -np.cos(q) / np.sqrt(1 + np.cos(q) ** 2)

    found = np.linalg.norm(tangent(x + 1j * H * tangent(x)[0]).imag / H, axis=0)
    signed = normal_x(x + 1j * H).imag / H  # n depends on x alone
    size = np.abs(signed).max()
    return float(np.abs(found - signed).max() / size), float(np.abs(found - np.abs(signed)).max() / size)


def levels() -> Residuals:
    """1.4.1: the quotient c₁, with ℋ = 1 for φ > 0, against the level inside (as the text says) and outside."""
    ring = Ring()
    phi = polyval2d(ring.x, ring.y, PHI)
    inside, outside, weight = 1.0, 0.0, (phi > 0).astype(float)
    image = np.where(phi < 0, inside, outside)
    c1 = ring.sum(image * weight) / ring.sum(weight)
    return abs(c1 - inside), abs(c1 - outside)


def contours() -> Residuals:
    """(1.29): the rate must be minus the gradient of αE₁ + βE₂, here in the direction of a polynomial."""
    ring, alpha, beta = Ring(), 1.3, 0.4
    image, psi = polyval2d(ring.x, ring.y, IMAGE), polyval2d(ring.x, ring.y, TEST)
    phi = polyval2d(ring.x, ring.y, PHI)
    step = 1j * H
    moved = phi + step * psi
    steepness = np.sqrt(sum((g + step * p) ** 2 for g, p in zip(ring.gradient(PHI), ring.gradient(TEST), strict=True)))
    outside = 0.5 * (1 + erf(phi / EPS))
    c1 = ring.sum(image * outside) / ring.sum(outside)
    c2 = ring.sum(image * (1 - outside)) / ring.sum(1 - outside)
    heaviside = 0.5 * (1 + erf(moved / EPS))
    energy = alpha * ((image - c1) ** 2 * heaviside + (image - c2) ** 2 * (1 - heaviside))
    change = ring.sum(energy + beta * cut_off(moved) * steepness).imag / H
    force = (image - c1) ** 2 - (image - c2) ** 2
    rates = (alpha * ring.curvature() + beta * force, beta * ring.curvature() - alpha * force)
    return tuple(abs(change + ring.sum(psi * cut_off(phi) * rate)) / abs(change) for rate in rates)


def pressure_jump() -> Residuals:
    """Below (1.31): a ball at rest makes λ dA = (p_in - p_out) dV; [p] is outside less inside, as (1.31) needs it."""
    radius = 0.8 + 1j * H
    area, volume = (4 * np.pi * radius**2).imag / H, (4 / 3 * np.pi * radius**3).imag / H
    curvature = 2 / radius.real
    jumps = TENSION * curvature, -TENSION * curvature
    return tuple(abs(TENSION * area + jump * volume) / (TENSION * area) for jump in jumps)


def tension_force() -> Residuals:
    """(1.32): the force must do the work that the energy λ∫(1/ε)ζ|∇φ| loses as φ is carried, densities 1 and 10."""
    ring = Ring()
    phi = polyval2d(ring.x, ring.y, PHI)
    rate, change = ring.carried(TEST)
    step = 1j * H
    steepness = np.sqrt(sum((g + step * d) ** 2 for g, d in zip(ring.gradient(PHI), change, strict=True)))
    lost = -TENSION * ring.sum(cut_off(phi + step * rate) * steepness).imag / H
    along = -rate * TENSION * ring.curvature() * cut_off(phi)  # λ H (1/ε)ζ ∇φ·u
    density = 1 + 9 * 0.5 * (1 + erf(phi / EPS))
    return tuple(abs(ring.sum(work) - lost) / abs(lost) for work in (density * along, -along))


def redistancing() -> Residuals:
    """(1.36): the distance to a circle must be at rest."""
    x, y = np.meshgrid(np.linspace(-2, 2, 40), np.linspace(-2, 2, 40))
    r = np.hypot(x, y)
    sign = np.sign(r - 1)
    convected = sign * ((x / r) ** 2 + (y / r) ** 2)  # sgn ∇φ/|∇φ|·∇φ
    return float(np.abs(-sign - convected).max()), float(np.abs(sign - convected).max())


def linear_model() -> Residuals:
    """(1.39), (1.43), (1.48): a wave φ = a cos kx₂ without viscosity must keep its energy, ½u² + λ/(2ε) area."""
    lam, eps, u, a = 1.0, 0.1, 0.3, 1e-7  # a small: the area is that of the graph x₁ = -φ
    x = 2 * np.pi * np.arange(64) / 64
    worst = np.zeros(2)
    for k in (1, 5, 10):
        area = np.sqrt(1 + ((a + 1j * H) * k * np.sin(k * x)) ** 2).mean()
        pull = lam / (2 * eps) * area.imag / H  # change of the energy with a
        bend = lam / (2 * eps) * k * k * a  # size of λ/(2ε) Δφ, which is negative where φ is positive
        change = np.array([0.5 * u * rate + pull * -u for rate in (-bend, bend)])  # ½: mean of cos²
        worst = np.maximum(worst, np.abs(change) / (pull * u))
    return tuple(float(q) for q in worst)


def step_limit() -> Residuals:
    """(1.48) with (1.54): the largest stable step with λ/(2ε), and with λ/ε as in (1.53), against (1.54)."""
    mu, lam, width = (np.array([q]) for q in (0.01, 1.0, 1.5))
    predicted = linear.predicted((mu, lam, width), 16)
    found = [linear.spectral_limits((mu, lam, w)) * linear.predicted((mu, lam, w), 16) for w in (2 * width, width)]
    return tuple(float(np.abs(limit / predicted - 1).max()) for limit in found)


def predictor() -> Residuals:
    """(1.60): excess of the spectral radius over 1 with Δt² λ/ε, and with Δt λ/ε, at twice (1.54)."""
    case = tuple(np.array([q]) for q in (0.01, 1.0, 1.5))
    dt = 2 * linear.predicted(case, 16)
    g, d = linear.numbers(case, dt, 16)
    schemes = ("predictor-printed", "predictor-corrected")
    return tuple(max(float(linear.radius(scheme, g, d, dt).max()) - 1, 0.0) for scheme in schemes)


def one_dimension() -> Residuals:
    """1.5: ∫ (1/ε)ζ(rx/ε) dx, which must be 1, without and with the factor r = |φ'|."""
    r, eps = 3.0, 0.1
    node, weight = np.polynomial.legendre.leggauss(40)
    x, weight = node * eps / r, weight * eps / r
    whole = (weight * 0.5 * (1 + np.cos(np.pi * r * x / eps)) / eps).sum()
    return float(abs(whole - 1)), float(abs(r * whole - 1))


def towers() -> Residuals:
    """1.5.4: the length of the unit circle from φ = (r - 1)(2 + x/2), where |∇φ| is 1.5 to 2.5."""
    errors = []
    for cells in (64, 128, 256, 512):
        grid = Grid((cells, cells), 3.0 / cells, (-1.5, -1.5))
        phi = grid.sample(lambda x, y: (np.hypot(x, y) - 1) * (2 + 0.5 * x))
        errors.append(abs(integrals.length(grid, phi, "towers-laplacian") / (2 * np.pi) - 1))
    printed = abs(_towers_printed(grid, grid.padded(phi)) / (2 * np.pi) - 1)
    return printed, errors[-1], slope(1 / np.array([64, 128, 256, 512]), errors)


def _towers_printed(grid: Grid, phi: np.ndarray) -> float:
    """Sum of [ΔI - ℋΔφ]/|∇φ|², ℋ = ∇I·∇φ/|∇φ|², by central differences; without the centre of the circle, no line."""
    up = np.maximum(phi, 0)

    def central(q):
        return [(np.roll(q, -1, a) - np.roll(q, 1, a)) / (2 * grid.h) for a in (0, 1)]

    def laplacian(q):
        return sum(np.roll(q, s, a) for a in (0, 1) for s in (1, -1)) / grid.h**2 - 4 * q / grid.h**2

    square = sum(g * g for g in central(phi))
    step = sum(g * i for g, i in zip(central(phi), central(up), strict=True)) / square
    density = (laplacian(up) - step * laplacian(phi)) / square
    return float(density[GHOSTS:-GHOSTS, GHOSTS:-GHOSTS].sum() * grid.cell_volume)
