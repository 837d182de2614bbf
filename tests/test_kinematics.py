"""Chapter 2: the flow and the operators against one-line NumPy, the identities' orders, and that a slip shows."""

import numpy as np
import pytest
import xarray as xr

from fsiwork.studies import flowmap as flow
from fsiwork.studies import kinematics, reynolds

RNG = np.random.default_rng(5)


@pytest.mark.parametrize("d", [2, 3])
def test_cofactors_and_determinants_are_those_of_numpy(d):
    matrix = RNG.normal(size=(d, d, 20))
    each = np.moveaxis(matrix, 2, 0)
    assert flow.determinant(matrix) == pytest.approx(np.linalg.det(each), rel=1e-12)
    wanted = np.linalg.det(each)[:, None, None] * np.linalg.inv(each).transpose(0, 2, 1)
    assert np.moveaxis(flow.cofactor(matrix), 2, 0) == pytest.approx(wanted, rel=1e-9)
    assert flow.times(matrix, matrix) == pytest.approx(np.moveaxis(each @ each, 0, 2), rel=1e-12)


def test_remark_2_8():
    """|Cof F n₀| = |F τ₀| in the plane."""
    matrix, angle = RNG.normal(size=(2, 2, 20)), RNG.random(20)
    n, tau = np.stack([np.cos(angle), np.sin(angle)]), np.stack([-np.sin(angle), np.cos(angle)])
    left, right = flow.norm(flow.times(flow.cofactor(matrix), n)), flow.norm(flow.times(matrix, tau))
    assert left == pytest.approx(right, rel=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_gradients_have_the_derivative_last(d):
    x = flow.centres(d, 8, 1)
    linear = flow.times(np.arange(1.0, d * d + 1).reshape(d, d), x)
    wanted = np.arange(1.0, d * d + 1).reshape(d, d)
    assert flow.gradient(linear, d, 1 / 8) == pytest.approx(
        np.broadcast_to(wanted.reshape(d, d, *[1] * d), (d, d, *[8] * d))
    )
    found = flow.slopes(lambda q: flow.times(wanted, q), x, 0.1)
    assert found == pytest.approx(np.broadcast_to(wanted.reshape(d, d, *[1] * d), found.shape))


@pytest.mark.parametrize("d", [2, 3])
def test_the_flow_keeps_the_box_and_comes_back(d):
    x = RNG.random((d, 50))
    there = flow.carried(x, 0.0, 0.5, 40)
    assert ((there > 0) & (there < 1)).all()
    assert flow.carried(there, 0.5, 0.0, 40) == pytest.approx(x, abs=1e-7)
    for a in range(d):
        for wall in (0.0, 1.0):
            x[a] = wall
            assert np.abs(flow.velocity(x, 0.3)[a]).max() < 1e-15


@pytest.mark.parametrize("d", [2, 3])
def test_the_potential_is_that_of_the_integrand(d):
    x, h = RNG.random((d, 30)), 1e-5
    step = np.reshape([h, *[0.0] * (d - 1)], (d, 1))
    found = (flow.potential(x + step, 0.4) - flow.potential(x - step, 0.4)) / (2 * h)
    assert found == pytest.approx(flow.scalar(x, 0.4), abs=1e-9)


@pytest.mark.parametrize("d", [2, 3])
def test_the_sides_enclose_the_box(d):
    """∮x·n ds = d |box|, and ∮n ds = 0."""
    sides = list(flow.sides(d, 8))
    assert len(sides) == 2 * d
    assert sum(s * (p.middle * p.element()).sum() for p, s in sides) == pytest.approx(d * 0.5**d, rel=1e-12)
    assert sum(s * p.element().reshape(d, -1).sum(1) for p, s in sides) == pytest.approx(np.zeros(d), abs=1e-14)


def test_elements_add_up_to_the_area():
    half = flow._patch(lambda a, b: (np.cos(np.pi * a), np.sin(np.pi * a), b), 2, 64, True)
    assert flow.norm(half.element()).sum() == pytest.approx(np.pi, rel=1e-3)


@pytest.mark.parametrize("d", [2, 3])
def test_the_finite_volumes_keep_the_mass(d):
    rho = 1 + RNG.random((12,) * d)
    after = flow.conserved(rho, 0.3, 12)
    assert after.sum() == pytest.approx(rho.sum(), rel=1e-13)
    assert np.abs(after - rho).max() > 0.01


def test_all_identities_are_of_order_two_in_the_plane():
    coarse, fine = (kinematics.identities(None, {"dimension": 2, "cells": n}) for n in (64, 128))
    for key in kinematics.IDENTITIES:
        assert np.log2(coarse[key] / fine[key]) > 1.9, key
    for key in kinematics.PRINTED:
        assert fine[key] > 1e-3


def test_all_identities_approach_order_two_in_space():
    coarse, fine = (kinematics.identities(None, {"dimension": 3, "cells": n}) for n in (16, 32))
    for key in kinematics.IDENTITIES:
        assert np.log2(coarse[key] / fine[key]) > 1.75, key


def test_a_slip_in_the_cofactor_shows(monkeypatch):
    good = reynolds.integrals(2, 32)
    monkeypatch.setattr(reynolds, "cofactor", lambda F: np.swapaxes(flow.cofactor(F), 0, 1))
    bad = reynolds.integrals(2, 32)
    for key in ("surface", "normal", "flux", "piola"):
        assert bad[key] > 10 * good[key], key


def test_what_is_not_a_number_fails():
    cells = xr.DataArray([16.0, 32.0], dims="cells")
    names = (*kinematics.IDENTITIES, *kinematics.PRINTED, "mass_drift")
    values = {name: ("cells", [1.0, 0.25]) for name in names} | {"density": ("cells", [1.0, np.nan])}
    data = xr.Dataset(values, {"cells": cells})
    measured = kinematics.kinematics(dict.fromkeys(kinematics.STUDIES.values(), data))
    assert np.isnan(measured["order_density"])
    assert np.isnan(measured["lowest_order"])
    assert measured["order_forward"] == pytest.approx(2)


@pytest.mark.parametrize("point", [{"dimension": 4, "cells": 16}, {"dimension": 2, "cells": 18}])
def test_what_is_refused(point):
    with pytest.raises(ValueError, match="multiple of 4"):
        kinematics.identities(None, point)
