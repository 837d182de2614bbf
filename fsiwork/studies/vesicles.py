"""Shapes of vesicles at rest in space, with an axis and a mirror: the axisymmetric shape equation, spectrally.

½∫H² is stationary among the shapes of the same area and volume. The tangent's angle ψ over the arc length from pole
(u = 0) to equator (u = 1) is πu/2 + Σ a_k sin πku; with it r and z have quarter-wave series on the midpoints of u, so
that integrals are exact to rounding for smooth shapes. Solutions solve Δ_ΓH + ½H(H² - 4G) = σH - p (SPEC 6).
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

MODES, POINTS, MOST = 24, 72, 25
PATH = (0.97, 0.93, 0.88, 0.83, 0.78, 0.74, 0.7, 0.66, 0.63, 0.6, 0.575)  # volumes on the way down
TINY = 1e-30  # of the complex step
Branch = Literal["prolate", "oblate"]


@dataclass(frozen=True)
class Vesicle:
    """A shape of area 4π: lengths in units of √(area/4π), energies of k, ``r`` and ``z`` from the pole to the equator.

    ``equator`` and ``pole`` are half the widths across and along the axis; ``residual`` is what the shape equation
    lacks with the best ``tension`` σ and ``pressure`` p (inside less outside), in parts of its largest term.
    """

    volume: float
    energy: float
    r: np.ndarray
    z: np.ndarray
    equator: float
    pole: float
    tension: float
    pressure: float
    residual: float


@dataclass(frozen=True)
class _Series:
    """Midpoints u, and matrices that act on values there."""

    u: np.ndarray
    sines: np.ndarray  # sin πku of the angle's modes, shape (points, modes)
    slopes: np.ndarray  # their derivatives
    rise: np.ndarray  # ∫₀ᵘ of what is even at the pole and odd at the equator
    fall: np.ndarray  # ∫ᵤ¹ of what is odd at the pole and even at the equator
    whole: np.ndarray  # ∫₀¹ of the latter
    ends: np.ndarray  # ∫₀¹ of the former


@cache
def _series() -> _Series:
    u, k = (np.arange(POINTS) + 0.5) / POINTS, np.arange(1, MODES + 1)
    half = math.pi * (np.arange(POINTS) + 0.5)
    S, C, weight = np.sin(np.outer(u, half)), np.cos(np.outer(u, half)), 2 / POINTS / half
    angle = math.pi * np.outer(u, k)
    return _Series(
        u, np.sin(angle), math.pi * k * np.cos(angle), S * weight @ C.T, C * weight @ S.T, S @ weight,
        C @ (weight * np.sin(half)),
    )  # fmt: skip


def _curve(a: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """ψ, r and the principal curvatures ψ' and sin ψ/r for modes of shape (..., MODES), quarter length 1."""
    s = _series()
    psi = 0.5 * math.pi * s.u + a @ s.sines.T
    r = np.cos(psi) @ s.rise.T
    return psi, r, 0.5 * math.pi + a @ s.slopes.T, np.sin(psi) / r


def _energy(a: np.ndarray) -> np.ndarray:
    """½∫H²."""
    _, r, along, around = _curve(a)
    return 2 * math.pi * ((along + around) ** 2 * r) @ _series().whole


def _volume(a: np.ndarray) -> np.ndarray:
    """Volume over that of the ball of the same area."""
    psi, r, _, _ = _curve(a)
    whole = _series().whole
    area, volume = 4 * math.pi * r @ whole, 2 * math.pi * (r * r * np.sin(psi)) @ whole
    return 6 * math.sqrt(math.pi) * volume / area**1.5


def _slope(function, a: np.ndarray) -> np.ndarray:
    """Gradient by complex steps, to rounding; shape (..., MODES)."""
    return function(a[..., None, :] + 1j * TINY * np.eye(MODES)).imag / TINY


def equilibrium(volume: float, branch: Branch) -> Vesicle:
    """The shape of reduced volume ``volume`` on a branch, followed down from the sphere.

    Parameters
    ----------
    volume : volume over that of the ball of the same area, 0.55 ≤ volume < 1 (below, the poles of the oblate one meet)
    branch : ``prolate``, or ``oblate``, which is biconcave at small volumes

    Raises
    ------
    ValueError : an unknown branch, or a volume outside the range
    RuntimeError : Newton's method does not converge
    """
    if branch not in ("prolate", "oblate"):
        raise ValueError(f"branch must be prolate or oblate, got {branch!r}")
    if not 0.55 <= volume < 1:
        raise ValueError(f"volume must be in [0.55, 1), got {volume}")
    return _vesicle(_modes(float(volume), branch)[0])


@cache
def _modes(volume: float, branch: Branch) -> tuple[np.ndarray, float]:
    """Modes and dE/dv, from those of the next volume of `PATH` above, or from the first mode of a sphere."""
    above = [v for v in PATH if v > volume + 1e-9]
    if above:
        return _newton(*_modes(above[-1], branch), volume)
    a = np.zeros(MODES)
    a[0] = (1.47 if branch == "prolate" else -1.47) * math.sqrt(1 - volume)
    return _newton(a, -16 * math.pi, volume)


def _newton(a: np.ndarray, slope: float, volume: float) -> tuple[np.ndarray, float]:
    """Modes and dE/dv where ∇E = dE/dv ∇v at a volume; second derivatives by differences of exact first ones."""
    step = 1e-5 * np.eye(MODES)
    for _ in range(MOST):
        both = [_slope(f, np.concatenate([a[None], a + step, a - step])) for f in (_energy, _volume)]
        bent, constraint = both[0] - slope * both[1], both[1][0]
        second = (bent[1 : MODES + 1] - bent[MODES + 1 :]) / 2e-5
        matrix = np.block([[0.5 * (second + second.T), -constraint[:, None]], [constraint[None], np.zeros((1, 1))]])
        change = np.linalg.solve(matrix, -np.append(bent[0], _volume(a) - volume))
        a, slope = a + change[:-1], slope + change[-1]
        if np.abs(change[:-1]).max() < 1e-9:
            return a, float(slope)
    raise RuntimeError(f"no vesicle of volume {volume:g} in {MOST} steps of Newton's method")


def _vesicle(a: np.ndarray) -> Vesicle:
    s = _series()
    psi, r, along, around = _curve(a)
    unit = math.sqrt(r @ s.whole)  # √(area/4π) for a quarter of length 1
    tension, pressure, residual = _balance(r / unit, along * unit, around * unit, unit)
    return Vesicle(
        float(_volume(a)), float(_energy(a)), r / unit, s.fall @ np.sin(psi) / unit, float(s.ends @ np.cos(psi)) / unit,
        float(s.whole @ np.sin(psi)) / unit, tension, pressure, residual,
    )  # fmt: skip


def _balance(r: np.ndarray, along: np.ndarray, around: np.ndarray, unit: float) -> tuple[float, float, float]:
    """σ, p and the residual of Δ_ΓH + ½H(H² - 4G) = σH - p; H is even at both ends, a series of cosines."""
    u, k = _series().u, np.arange(POINTS)
    waves = np.cos(math.pi * np.outer(u, k))
    H, G = along + around, along * around
    h = np.linalg.solve(waves, H)
    h[POINTS // 2 :] = 0.0  # rounding, which two derivatives raise
    first = -np.sin(math.pi * np.outer(u, k)) * math.pi * k @ h * unit
    second = -waves * (math.pi * k) ** 2 @ h * unit**2
    cosine = np.sqrt(np.maximum(1 - (around * r) ** 2, 0.0)) * np.sign(np.gradient(r))
    bent = second + cosine / r * first + 0.5 * H * (H * H - 4 * G)
    (tension, pressure), *_ = np.linalg.lstsq(np.stack([H, -np.ones_like(H)], axis=1), bent, rcond=None)
    lack = np.abs(bent - tension * H + pressure).max() / np.abs(0.5 * H * (H * H - 4 * G)).max()
    return float(tension), float(pressure), float(lack)
