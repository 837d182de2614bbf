"""Axisymmetric vesicles against the sphere, its second mode, the shape equation, spheroids and known transitions."""

import math

import numpy as np
import pytest

from fsiwork.studies import vesicles
from fsiwork.studies.vesicles import equilibrium

CASES = [(v, b) for v in (0.77, 0.6) for b in ("prolate", "oblate")]
BALL = 8 * math.pi


def spheroid(volume, branch):
    """½∫H² of the spheroid of this reduced volume, by quadrature over the parametric angle."""
    t = (np.arange(4000) + 0.5) * 0.5 * math.pi / 4000
    sin, cos = np.sin(t), np.cos(t)

    def measures(c):  # r = sin t, z = c cos t
        line = np.sqrt(cos**2 + (c * sin) ** 2)
        H = c / line**3 + c / line
        step = 0.5 * math.pi / 4000
        area = 4 * math.pi * (sin * line).sum() * step
        return (
            6 * math.sqrt(math.pi) * (4 * math.pi / 3 * c) / area**1.5,
            2 * math.pi * (H**2 * sin * line).sum() * step,
        )

    low, high = (1.0, 10.0) if branch == "prolate" else (1.0, 0.05)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if measures(middle)[0] > volume else (low, middle)
    return measures(low)[1]


def test_a_sphere_is_exact():
    zero = np.zeros(vesicles.MODES)
    assert vesicles._energy(zero) == pytest.approx(BALL, rel=1e-13)
    assert vesicles._volume(zero) == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize("branch", ["prolate", "oblate"])
def test_near_the_sphere_it_is_its_second_mode(branch):
    """½∫H² = 8π + 6Δ, Δ = 4π(v^(-2/3) - 1) the area in excess on the ball of that volume; σ → -6, p → 2σ."""
    gaps = []
    for volume in (0.999, 0.9999):
        found = equilibrium(volume, branch)
        excess = 4 * math.pi * (volume ** (-2 / 3) - 1)
        gaps.append(abs((found.energy - BALL) / excess - 6))
        assert (found.pole > found.equator) == (branch == "prolate")
    assert gaps[1] < 0.03 and gaps[1] < 0.4 * gaps[0]  # next order: √Δ
    assert found.tension == pytest.approx(-6, rel=0.01) and found.pressure == pytest.approx(-12, rel=0.01)


@pytest.mark.parametrize(("volume", "branch"), CASES)
def test_it_solves_the_shape_equation(volume, branch):
    found = equilibrium(volume, branch)
    assert found.volume == pytest.approx(volume, rel=1e-10)
    assert found.residual < 1e-7


@pytest.mark.parametrize(("volume", "branch"), CASES)
def test_area_and_volume_of_the_profile(volume, branch):
    """By the trapezoidal rule on the profile alone; pole and equator close it."""
    found = equilibrium(volume, branch)
    r, z = np.concatenate([[0.0], found.r, [found.equator]]), np.concatenate([[found.pole], found.z, [0.0]])
    line, middle = np.hypot(np.diff(r), np.diff(z)), 0.5 * (r[1:] + r[:-1])
    assert 4 * math.pi * (middle * line).sum() == pytest.approx(4 * math.pi, rel=2e-3)
    assert -2 * math.pi * (middle**2 * np.diff(z)).sum() == pytest.approx(4 * math.pi / 3 * volume, rel=5e-3)
    assert (np.diff(r) > 0).all() or branch == "prolate"


@pytest.mark.parametrize(("volume", "branch"), CASES)
def test_it_costs_less_than_a_spheroid(volume, branch):
    assert BALL < equilibrium(volume, branch).energy < spheroid(volume, branch)


def test_prolate_and_oblate_change_places_at_065():
    """0.651 (Seifert, Berndl, Lipowsky 1991, from memory)."""

    def gap(volume):
        return equilibrium(volume, "prolate").energy - equilibrium(volume, "oblate").energy

    assert gap(0.77) < 0 < gap(0.6)
    assert gap(0.655) < 0 < gap(0.648)


def test_the_oblate_one_is_biconcave():
    for volume in (0.77, 0.6):
        found = equilibrium(volume, "oblate")
        assert found.pole < 0.9 * found.z.max()
        assert found.pole > 0


@pytest.mark.parametrize(
    ("volume", "branch", "word"),
    [(1.0, "oblate", "volume"), (0.5, "prolate", "volume"), (math.nan, "prolate", "volume"), (0.8, "pear", "branch")],
)
def test_other_words_are_refused(volume, branch, word):
    with pytest.raises(ValueError, match=word):
        equilibrium(volume, branch)
