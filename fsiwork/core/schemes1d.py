"""Ten schemes for ∂ₜq + u ∂ₓq = 0 on a line (annex 7.4), each as it is printed and by the method of lines.

A difference takes ``p``, q at the ``n`` nodes with `PAD` more at each end, and ``c``, the CFL number uΔt/Δx where its
own expansion in time is part of the scheme; it returns Δx ∂ₓq at the nodes, shape (n,), for a flow towards growing
indices. The work is NumPy on a padded copy: these are for study, `fsiwork.core.transport` carries fields.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

PAD = 4  # points beyond the ends: the widest stencil reads three

FLOOR = 1e-60  # of the smoothness indicators, above underflow of their squares

SHU_OSHER = ((1.0, 0.0), (0.25, 0.75), (2 / 3, 1 / 3))
"""SSP-RK3: each stage is b (q + Δt f(q)) + a q⁰ with (b, a)."""


def _d(p: np.ndarray, shift: int, n: int) -> np.ndarray:
    """Difference q_{i+shift} - q_{i+shift-1} at the nodes."""
    at = PAD + shift
    return p[at : at + n] - p[at - 1 : at - 1 + n]


def _smaller(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.where(np.abs(a) <= np.abs(b), a, b)


def upwind(p: np.ndarray, n: int, c: float = 0.0) -> np.ndarray:
    """First order."""
    return _d(p, 0, n)


def centred(p: np.ndarray, n: int, c: float = 0.0) -> np.ndarray:
    """Second order, neutral: unstable with Euler."""
    return 0.5 * (_d(p, 0, n) + _d(p, 1, n))


def lax_wendroff(p: np.ndarray, n: int, c: float = 0.0) -> np.ndarray:
    """Centred, less the second difference that Taylor's expansion in time asks for."""
    return centred(p, n) - 0.5 * c * (_d(p, 1, n) - _d(p, 0, n))


def beam_warming(p: np.ndarray, n: int, c: float = 0.0) -> np.ndarray:
    """Second order upwind, with the same correction taken upstream."""
    return _d(p, 0, n) + 0.5 * (1 - c) * (_d(p, 0, n) - _d(p, -1, n))


def fromm(p: np.ndarray, n: int, c: float = 0.0) -> np.ndarray:
    """Mean of Lax–Wendroff and Beam–Warming: their leading phase errors have opposite signs."""
    return 0.5 * (lax_wendroff(p, n, c) + beam_warming(p, n, c))


def eno2(p: np.ndarray, n: int, c: float = 0.0) -> np.ndarray:
    """The smaller of the two second differences next to the upstream interval."""
    return _d(p, 0, n) + 0.5 * _smaller(_d(p, 0, n) - _d(p, -1, n), _d(p, 1, n) - _d(p, 0, n))


def eno3(p: np.ndarray, n: int, c: float = 0.0) -> np.ndarray:
    """The stencil of `eno2`, extended to the side of the smaller third difference."""
    second = [_d(p, k, n) - _d(p, k - 1, n) for k in (-1, 0, 1, 2)]
    left = np.abs(second[1]) <= np.abs(second[2])
    third = [b - a for a, b in pairwise(second)]
    return (
        _d(p, 0, n)
        + 0.5 * np.where(left, second[1], second[2])
        + np.where(left, _smaller(third[0], third[1]) / 3, -_smaller(third[1], third[2]) / 6)
    )


def _parabolas(p, n):
    v = [_d(p, k, n) for k in (-2, -1, 0, 1, 2)]
    slopes = (
        v[0] / 3 - 7 / 6 * v[1] + 11 / 6 * v[2],
        -v[1] / 6 + 5 / 6 * v[2] + v[3] / 3,
        v[2] / 3 + 5 / 6 * v[3] - v[4] / 6,
    )
    rough = (
        13 / 12 * (v[0] - 2 * v[1] + v[2]) ** 2 + 0.25 * (v[0] - 4 * v[1] + 3 * v[2]) ** 2,
        13 / 12 * (v[1] - 2 * v[2] + v[3]) ** 2 + 0.25 * (v[1] - v[3]) ** 2,
        13 / 12 * (v[2] - 2 * v[3] + v[4]) ** 2 + 0.25 * (3 * v[2] - 4 * v[3] + v[4]) ** 2,
    )
    return slopes, rough, np.max([q * q for q in v], axis=0)


IDEAL = (0.1, 0.6, 0.3)


def _mean(slopes, weights):
    return sum(w * s for w, s in zip(weights, slopes, strict=True)) / sum(weights)


def upwind5(p: np.ndarray, n: int, c: float = 0.0) -> np.ndarray:
    """Fifth order, linear: the three parabolas with their ideal weights."""
    return _mean(_parabolas(p, n)[0], IDEAL)


def weno5(p: np.ndarray, n: int, c: float = 0.0) -> np.ndarray:
    """Weights of Jiang and Shu; ε = 10⁻⁶ max v² + 10⁻⁶⁰ (the printed 10⁻⁹⁹ underflows where q is flat)."""
    slopes, rough, largest = _parabolas(p, n)
    return _mean(slopes, [d / (s + 1e-6 * largest + FLOOR) ** 2 for d, s in zip(IDEAL, rough, strict=True)])


def weno_z(p: np.ndarray, n: int, c: float = 0.0) -> np.ndarray:
    """Weights of Borges et al.: fifth order at critical points too, sharper at kinks."""
    slopes, rough, _ = _parabolas(p, n)
    wide = np.abs(rough[0] - rough[2])
    return _mean(slopes, [d * (1 + (wide / (s + 1e-40)) ** 2) for d, s in zip(IDEAL, rough, strict=True)])


SCHEMES: dict[str, Callable] = {
    "upwind": upwind,
    "lax-wendroff": lax_wendroff,
    "centred": centred,
    "beam-warming": beam_warming,
    "fromm": fromm,
    "eno2": eno2,
    "eno3": eno3,
    "weno5": weno5,
    "weno-z": weno_z,
    "upwind5": upwind5,
}
ONE_STEP = ("lax-wendroff", "beam-warming", "fromm")
"""Schemes whose difference holds their own expansion in time (their argument c, the CFL number)."""


def advance(
    q: np.ndarray, courant: float, steps: int, scheme: str = "weno5", stepping: str = "euler", inflow: float = 0.0
) -> np.ndarray:
    """q after ``steps`` steps of CFL number ``courant`` = uΔt/Δx with u constant, of either sign; shape of ``q``, (n,).

    ``stepping``: euler or rk3 (SSP). Lax–Wendroff, Beam–Warming and Fromm are complete with one Euler step; with rk3
    only their differences in space are used (c = 0). Beyond the end where the flow enters q is ``inflow``, beyond the
    other it keeps the end's value.

    Raises
    ------
    ValueError : unknown scheme or stepping
    """
    if scheme not in SCHEMES:
        raise ValueError(f"scheme must be one of {', '.join(SCHEMES)}, got {scheme!r}")
    if stepping not in ("euler", "rk3"):
        raise ValueError(f"stepping must be euler or rk3, got {stepping!r}")
    difference, c, n = SCHEMES[scheme], abs(courant), q.size
    inner = c if stepping == "euler" and scheme in ONE_STEP else 0.0
    stages = ((1.0, 0.0),) if stepping == "euler" else SHU_OSHER
    q = q.astype(float)[:: -1 if courant < 0 else 1]  # the flow then runs towards growing indices
    padded = np.empty(n + 2 * PAD)
    for _ in range(steps):
        stage = q
        for b, a in stages:
            padded[:PAD], padded[PAD : PAD + n], padded[PAD + n :] = inflow, stage, stage[-1]
            stage = b * (stage - c * difference(padded, n, inner)) + a * q
        q = stage
    return np.ascontiguousarray(q[:: -1 if courant < 0 else 1])


def growth(scheme: str, courant: float, stepping: str = "euler", waves: int = 400) -> float:
    """Largest factor by which one step multiplies a Fourier mode; a linear ``scheme``, the others have no modes.

    That of ``upwind5`` is WENO5's too where q is smooth: there its weights are the ideal ones.
    Raises ValueError for a scheme that is not linear.
    """
    if scheme.startswith(("eno", "weno")):
        raise ValueError(f"{scheme} is not linear and has no modes; for WENO5 where q is smooth take upwind5")
    n = 4 * PAD
    impulse = np.zeros(n + 2 * PAD)
    impulse[PAD + n // 2] = 1.0
    c = courant if stepping == "euler" and scheme in ONE_STEP else 0.0
    # the answer to an impulse, read backwards, is the stencil
    stencil = SCHEMES[scheme](impulse, n, c)[n // 2 - PAD : n // 2 + PAD + 1][::-1]
    theta = np.linspace(0, np.pi, waves)[:, None]
    z = -courant * (stencil * np.exp(1j * theta * np.arange(-PAD, PAD + 1))).sum(axis=1)
    factor = 1 + z if stepping == "euler" else 1 + z + z * z / 2 + z**3 / 6
    return float(np.abs(factor).max())
