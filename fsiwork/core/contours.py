"""Active contours (1.29): the curve or surface φ = 0 that parts an image into two levels, by descent of an energy.

E = α ∫ (u₀ - c₁)² H_ε + (u₀ - c₂)² (1 - H_ε) + β ∫ |∇H_ε|, H_ε(φ) = 0 inside and 1 outside: c₁ is the mean level
outside, c₂ the one inside, and |∇H_ε| = D_ε|∇φ| the measure of the interface. The rate of descent is (1.29) with the
signs and factors of the errata, ∂ₜφ = D_ε {β div n - α [(u₀ - c₁)² - (u₀ - c₂)²]}. Here it is the exact gradient of the
discrete E, and a step is taken only when E falls by what the gradient promises. Fields are compact, of shape ``n``,
in the plane and in space alike; nothing flows through the sides.

`segment` does all of it for an image of any units, with lengths in cells.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.poisson import Direct
from fsiwork.core.redistance import redistance

PROMISE = 0.1  # part of the decrease to first order that a step must reach (Armijo)
FLAT = 1e-3  # |∇H_ε| [1/ε] below which the interface has no direction
HALVINGS = 30
SETTLED = 1e-5
SMALLEST = 8  # cells in a direction


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

    def __init__(self, grid: Grid, image: np.ndarray, smoothing: float, eps: float, method: str = "fast-sweeping"):
        if image.shape != grid.n or not np.isfinite(image).all():
            raise ValueError(f"the image must be finite and of shape {grid.n}, got {image.shape}")
        if not (smoothing > 0 and eps > 0):
            raise ValueError(f"smoothing and eps must be positive, got {smoothing} and {eps}")
        self.grid, self.image, self.beta, self.eps = grid, np.asarray(image, float), float(smoothing), float(eps)
        self.method = method
        self.step_limit = 2 * eps**2 / (np.pi * max(float(self.image.var()), 1e-300))  # the front moves by about ε
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
        r = np.clip(phi / self.eps, -1, 1)
        return 0.5 * (1 + r + np.sin(np.pi * r) / np.pi)

    def _dirac(self, phi: np.ndarray) -> np.ndarray:
        return 0.5 * (1 + np.cos(np.pi * np.clip(phi / self.eps, -1, 1))) / self.eps

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


@dataclass(frozen=True)
class Segmentation:
    """Two parts of an image: φ < 0 ``inside``; levels in the image's units; the energy after each step.

    ``energy`` [level² × cells², of the image scaled to 0 and 1] and ``fresh`` (redistanced; E may have risen) have the
    shape ``(rows,)``; ``ended`` as by `descend`.
    """

    phi: np.ndarray
    outside: float
    inside: float
    energy: np.ndarray
    fresh: np.ndarray
    steps: int
    ended: str


def segment(
    image: np.ndarray, smoothing: float = 2.5, eps: float = 3.0, steps: int = 4000, watch: Watch | None = None
) -> Segmentation:
    """Part an image of two levels, from a contour along its sides inwards.

    Parameters
    ----------
    image : shape (x, y[, z]), at least 8 cells in each direction, finite, any units
    smoothing : radius [cells] below which a disc of full contrast is taken for noise
    eps : half-width of the contour [cells]

    Raises ValueError, in one line, when nothing can be parted.
    """
    q = np.asarray(image, float)
    if q.ndim not in (2, 3) or min(q.shape) < SMALLEST:
        raise ValueError(f"at least {SMALLEST} cells in two or three directions, got {' × '.join(map(str, q.shape))}")
    if not np.isfinite(q).all():
        raise ValueError(f"{np.count_nonzero(~np.isfinite(q))} values are not finite")
    low, high = two_levels(gaussian_filter(q, smoothing))
    contours = Contours(Grid(q.shape, 1.0), (q - low) / (high - low), smoothing, eps)
    energy, fresh = [], []

    def keep(step: int, state: State, new: bool) -> None:
        energy.append(state.energy)
        fresh.append(new)
        if watch:
            watch(step, state, new)

    state, ended = descend(contours, surrounding(q.shape, min(2 * eps, min(q.shape) / 4)), steps=steps, watch=keep)
    levels = (low + (high - low) * c for c in (state.outside, state.inside))
    count = len(fresh) - sum(fresh)
    return Segmentation(state.phi, *levels, np.array(energy), np.array(fresh), count, ended)


def surrounding(n: tuple[int, ...], margin: float) -> np.ndarray:
    """Distance [cells] to the box that lies ``margin`` within the sides, negative in it (max norm outside)."""
    lines = np.meshgrid(*(np.abs(np.arange(k) + 0.5 - k / 2) - k / 2 for k in n), indexing="ij", sparse=True)
    phi = np.full(n, -np.inf)
    for line in lines:
        phi = np.maximum(phi, line + margin)
    return phi


def two_levels(q: np.ndarray) -> tuple[float, float]:
    """Mean levels below and above the threshold that parts the histogram best (Otsu 1979).

    Raises ValueError when all values are one.
    """
    first, last = float(q.min()), float(q.max())
    if not (last - first > 1e-9 * max(abs(first), abs(last)) and np.isfinite(last - first)):
        raise ValueError(f"all values are {first:.6g}: there is nothing to part")
    count, edges = np.histogram(q, 256)
    below = np.cumsum(count)[:-1]
    mean = np.cumsum(count * 0.5 * (edges[1:] + edges[:-1] - 2 * first))
    between = (mean[-1] * below / q.size - mean[:-1]) ** 2 / (below * (q.size - below))
    high = q >= edges[1 + int(np.argmax(between))]
    return float(q[~high].mean()), float(q[high].mean())


def _mean(q: np.ndarray, weight: np.ndarray) -> float:
    total = float(weight.sum())
    return float((q * weight).sum()) / total if total > 0 else 0.0


def _sides(a: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Cells below and above the inner faces of direction ``a``."""
    before = (slice(None),) * a
    return (*before, slice(None, -1)), (*before, slice(1, None))
