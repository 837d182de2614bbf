"""Energy laws of a membrane and the modulus that bounds a mode's stiffness."""

import numpy as np
import pytest

from fsiwork.bodies.laws import AtPoints, Linear, Quadratic, modulus
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import interface as kernels

R = np.linspace(0.4, 3.0, 27)


@pytest.mark.parametrize("law", [Linear(2.5), Quadratic(7.0)])
def test_derivatives_belong_to_the_energy(law):
    d = 1e-5
    np.testing.assert_allclose(law.dE(R), (law.E(R + d) - law.E(R - d)) / (2 * d), atol=1e-8)
    np.testing.assert_allclose(law.ddE(R), (law.dE(R + d) - law.dE(R - d)) / (2 * d), atol=1e-8)


def test_modulus_is_the_largest_stiffness_of_a_mode():
    s = np.linspace(0.0, 1.0, 20001)
    for A in (-3.0, -0.1, 0.0, 0.3, 1.0, 4.0):
        for B in (-1.0, 0.0, 0.5, 2.0, 8.0, 9.0):
            largest = max((A * s**2 + B * s * (1 - s)).max(), 0.0)
            assert modulus(A, B) == pytest.approx(largest, abs=1e-7), (A, B)


def test_modulus_of_a_drop_of_an_unstretched_membrane_and_at_the_seam():
    assert modulus(3.0, 0.0) == 3.0  # E'r
    assert modulus(0.0, 10.0) == 2.5  # λ/4
    assert modulus(1.0, 2.0) == pytest.approx(modulus(1.0, 2.0 + 1e-9), abs=1e-8)  # continuous at B = 2A
    assert kernels.modulus(-0.5, 10.0) == pytest.approx(float(modulus(-0.5, 10.0)), rel=1e-15)
    assert kernels.modulus(2.0, 3.0) == float(modulus(2.0, 3.0))


def test_known_laws_need_no_values_at_points():
    grid = Grid((8, 8), 0.1)
    for law, kind in ((Linear(2.0), 0), (Quadratic(3.0), 1)):
        points = AtPoints(law, grid)
        assert (points.kind, points.lam) == (kind, law.stiffness)
        assert points.given.shape == (3, 1)
