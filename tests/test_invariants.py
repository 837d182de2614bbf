"""Z₁ and Z₂ of a surface's deformation, from matrices and from a carried map."""

import numpy as np
import pytest

from fsiwork.core.invariants import area_and_shear
from fsiwork.studies import invariants


def test_invariants_are_those_of_the_principal_stretches():
    """A surface in the plane z = 0, stretched by λ₁ and λ₂ in it and by anything across."""
    random = np.random.default_rng(0)
    for _ in range(20):
        one, two, across = random.uniform(0.3, 3.0, 3)
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        F = turn @ np.diag([one, two, across])
        Z1, Z2 = area_and_shear(np.linalg.inv(F)[None], np.array([[0.0, 0.0, 2.0]]))
        assert Z1[0] == pytest.approx(one * two, rel=1e-12)
        assert Z2[0] == pytest.approx(0.5 * (one / two + two / one), rel=1e-12)


@pytest.mark.parametrize("case", invariants.CASES)
def test_a_carried_map_has_the_exact_invariants(case):
    found = invariants.carried(None, {"case": case, "cells": 24})
    bound = 1e-10 if case in ("TC6", "TC7") else 1e-6
    assert found["error_z1"] <= bound
    assert found["error_z2"] <= bound


def test_a_wrong_normal_is_seen():
    F = np.array([[1.0, 0.7, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    right, wrong = (area_and_shear(np.linalg.inv(F)[None], np.array([n]))[1][0] for n in ([0, 0, 1.0], [1.0, 0, 0]))
    assert right == pytest.approx(1 + 0.5 * 0.7**2)
    assert abs(wrong - right) > 0.1
