"""Active contours (1.29): the curve or surface φ = 0 that parts an image into two levels, by descent of an energy.

E = α ∫ (u₀ - c₁)² H_ε + (u₀ - c₂)² (1 - H_ε) + β ∫ |∇H_ε|, H_ε(φ) = 0 inside and 1 outside: c₁ is the mean level
outside, c₂ the one inside, and |∇H_ε| = D_ε|∇φ| the measure of the interface. The rate of descent is (1.29) with the
signs and factors of the errata, ∂ₜφ = D_ε {β div n - α [(u₀ - c₁)² - (u₀ - c₂)²]}. Here it is the exact gradient of the
discrete E, and a step is taken only when E falls by what the gradient promises. Fields are compact, of shape ``n``,
in the plane and in space alike; nothing flows through the sides.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.poisson import Direct
from fsiwork.core.redistance import redistance

PROMISE = 0.1  # part of the decrease to first order that a step must reach (Armijo)
FLAT = 1e-3  # |∇H_ε| [1/ε] below which the interface has no direction
HALVINGS = 30
SETTLED = 1e-5


@dataclass(frozen=True)
class State:
    """φ, its energy, and the two levels: ``outside`` (c₁) and ``inside`` (c₂)."""

    phi: np.ndarray
    energy: float
    outside: float
    inside: float


class Contours:
    """The energy of an image on a grid, its gradient, and steps that decrease it.

    Parameters
    ----------
    grid : the cells of the image
    image : u₀, shape ``grid.n``, finite
    smoothing : β/α [length × level²]: a disc of contrast 1 and a smaller radius is rubbed out; α = 1
    eps : half-width of H_ε [length]
    method : of `fsiwork.core.redistance`

    Raises
    ------
    ValueError : the image has another shape or is not finite, or a number is not positive.
    """

    def __init__(self, grid: Grid, image: np.ndarray, smoothing: float, eps: float, method: str = "closest-cubic"):
        if image.shape != grid.n or not np.isfinite(image).all():
            raise ValueError(f"the image must be finite and of shape {grid.n}, got {image.shape}")
        if not (smoothing > 0 and eps > 0):
            raise ValueError(f"smoothing and eps must be positive, got {smoothing} and {eps}")
        self.grid, self.image, self.beta, self.eps = grid, np.asarray(image, float), float(smoothing), float(eps)
        self.method = method
        self.step_limit = 8 * eps**2 / (np.pi * max(float(self.image.var()), 1e-300))  # the front moves by some ε
        self._solver = Direct(grid.n, grid.h, (("neumann", "neumann"),) * grid.dim)

    def state(self, phi: np.ndarray) -> State:
        """Levels and energy of φ; a side of the interface without cells has the level 0."""
        H = self._heaviside(phi)
        c1, c2 = _mean(self.image, H), _mean(self.image, 1 - H)
        density = (self.image - c1) ** 2 * H + (self.image - c2) ** 2 * (1 - H)
        density += self.beta * (self._slope(self._differences(H)) - FLAT / self.eps)
        return State(phi, float(density.sum() * self.grid.cell_volume), c1, c2)

    def rate(self, state: State) -> np.ndarray:
        """∂ₜφ of (1.29): minus the gradient of the discrete E to φ, for each unit of volume."""
        differences = self._differences(self._heaviside(state.phi))
        weight = 1 / self._slope(differences)
        bend = np.zeros_like(state.phi)
        for a, d in enumerate(differences):
            low, high = _sides(a)
            flux = 0.5 * (weight[low] + weight[high]) * d / self.grid.h
            bend[low] += flux
            bend[high] -= flux
        force = (self.image - state.outside) ** 2 - (self.image - state.inside) ** 2
        return self._dirac(state.phi) * (self.beta * bend - force)

    def step(self, state: State, dt: float) -> tuple[State | None, float]:
        """A step of at most ``dt`` along (1.29), diffusion implicit, after which E is smaller; and how long it was.

        The implicit part, 1 - Δt (β/ε) Δ, is positive, so that a short enough step always goes down. ``None`` when no
        step of more than 2⁻³⁰ ``dt`` does: the energy is at a minimum, up to rounding.
        """
        rate = self.rate(state)
        for _ in range(HALVINGS):
            move = self._solver.solve(rate.copy(), 1.0, dt * self.beta / self.eps)
            promised = dt * float(np.vdot(rate, move)) * self.grid.cell_volume
            found = self.state(state.phi + dt * move)
            if found.energy <= state.energy - PROMISE * promised and found.energy < state.energy:
                return found, dt
            dt /= 2
        return None, 0.0

    def distance(self, phi: np.ndarray) -> np.ndarray:
        """φ redistanced within twice ε, constant beyond; the field goes on through the sides as in a mirror."""
        padded = np.pad(phi, GHOSTS, mode="symmetric").ravel()
        found = redistance(self.grid, padded, self.method, max(2 * self.eps / self.grid.h, 4.0))
        return self.grid.inside(found).copy()

    def _heaviside(self, phi: np.ndarray) -> np.ndarray:
        r = phi / self.eps
        H = (r > 0).astype(float)
        near = np.abs(r) < 1  # a few cells: sines are dear
        H[near] = 0.5 * (1 + r[near] + np.sin(np.pi * r[near]) / np.pi)
        return H

    def _dirac(self, phi: np.ndarray) -> np.ndarray:
        D, near = np.zeros_like(phi), np.abs(phi) < self.eps
        D[near] = 0.5 * (1 + np.cos(np.pi * phi[near] / self.eps)) / self.eps
        return D

    def _differences(self, q: np.ndarray) -> list[np.ndarray]:
        return [np.diff(q, axis=a) / self.grid.h for a in self.grid.axes]

    def _slope(self, differences: list[np.ndarray]) -> np.ndarray:
        """|∇q| at the cells: root of the mean square of the differences on both sides, none through the box's sides."""
        square = np.full(self.grid.n, (FLAT / self.eps) ** 2)
        for a, d in enumerate(differences):
            low, high = _sides(a)
            square[low] += 0.5 * d * d
            square[high] += 0.5 * d * d
        return np.sqrt(square)


Watch = Callable[[int, State, bool], None]


def descend(
    contours: Contours, phi: np.ndarray, every: int = 20, steps: int = 4000, watch: Watch | None = None
) -> tuple[State, str]:
    """Follow (1.29) from φ, redistanced every ``every`` steps, until E is no longer lower than it was.

    ``watch(step, state, fresh)`` is called with the first state, after each step, and (``fresh``) after each
    redistancing, across which E may rise. Returns the last state and how it ended: ``settled`` (three stretches between
    redistancings have not lowered E by 1e-5 of itself), ``empty`` (φ has one sign), or ``stopped after N steps``.
    """
    watch = watch or (lambda step, state, fresh: None)
    state, dt = contours.state(contours.distance(phi)), contours.step_limit
    lowest, still, count = state.energy, 0, 0
    watch(0, state, True)
    while count < steps:
        for _ in range(min(every, steps - count)):
            found, taken = contours.step(state, dt)
            if found is None:
                break
            state, count = found, count + 1
            dt = min(1.5 * taken, contours.step_limit)
            watch(count, state, False)
        now = state.phi < 0
        if now.all() or not now.any():
            return state, "empty"
        still = 0 if state.energy < lowest * (1 - SETTLED) else still + 1
        if still == 3:
            return state, "settled"
        lowest = min(lowest, state.energy)
        state = contours.state(contours.distance(state.phi))
        watch(count, state, True)
    return state, f"stopped after {count} steps"


def _mean(q: np.ndarray, weight: np.ndarray) -> float:
    total = float(weight.sum())
    return float((q * weight).sum()) / total if total > 0 else 0.0


def _sides(a: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Cells below and above the inner faces of direction ``a``."""
    before = (slice(None),) * a
    return (*before, slice(None, -1)), (*before, slice(1, None))
