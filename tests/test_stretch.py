"""The flow map of the compressing flow, the exact stretch and energies, and one small run of the study."""

import numpy as np
import pytest

from fsiwork.studies import stretch
from fsiwork.studies.orders import slope

STEP = 1e-5


@pytest.fixture(params=[2, 3])
def x(request):
    return np.random.default_rng(3).uniform(-0.6, 0.6, (20, request.param))


def differences(function, x):
    """(∇f)_ij = ∂_j f_i by central differences."""
    unit = STEP * np.eye(x.shape[1])
    return np.stack([(function(x + e) - function(x - e)) / (2 * STEP) for e in unit], axis=2)


def test_the_map_solves_the_equation_of_motion_and_goes_back(x):
    rate = (stretch.moved(x, STEP)[0] - stretch.moved(x, -STEP)[0]) / (2 * STEP)
    assert rate == pytest.approx(stretch.velocity(x)[0], abs=1e-9)
    there = stretch.moved(x, 0.4)[0]
    assert stretch.moved(stretch.moved(x, 0.1)[0], 0.3)[0] == pytest.approx(there, abs=1e-14)
    assert stretch.moved(there, -0.4)[0] == pytest.approx(x, abs=1e-14)


def test_gradients_of_map_and_velocity(x):
    assert stretch.moved(x, 0.4)[1] == pytest.approx(differences(lambda y: stretch.moved(y, 0.4)[0], x), abs=1e-8)
    assert stretch.velocity(x)[1] == pytest.approx(differences(lambda y: stretch.velocity(y)[0], x), abs=1e-8)


def test_the_flow_compresses_at_the_centre():
    J = np.linalg.det(stretch.moved(np.zeros((1, 2)), 0.4)[1])
    assert pytest.approx(np.exp(-2 * stretch.INWARD * 0.4), rel=1e-14) == J


def test_stretch_of_known_maps():
    turn, normal = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([[0.0, 0.0, 5.0]])
    assert stretch.stretch(turn[None] @ np.diag([2.0, 3.0, 7.0]), normal) == pytest.approx([6.0], rel=1e-14)
    shear = np.array([[[1.0, 2.0], [0.0, 1.0]]])  # of the line x = 0
    assert stretch.stretch(shear, np.array([[1.0, 0.0]])) == pytest.approx([np.sqrt(5)], rel=1e-14)
    random = np.random.default_rng(0).normal(size=(9, 3, 3))
    n = np.random.default_rng(1).normal(size=(9, 3))
    pulled = np.linalg.norm(np.einsum("mji,mj->mi", np.linalg.inv(random), n), axis=1) / np.linalg.norm(n, axis=1)
    assert stretch.stretch(random, n) == pytest.approx(np.abs(np.linalg.det(random)) * pulled, rel=1e-10)


@pytest.mark.parametrize(("case", "measure"), [("circle", 2 * np.pi * 0.45), ("sphere", 4 * np.pi * 0.45**2)])
def test_quadrature_and_energy_without_motion(case, measure):
    shape = stretch.CASES[case]
    x, weight = shape.quadrature()
    assert weight.sum() == pytest.approx(measure, rel=1e-13)
    assert shape.level(*x.T) == pytest.approx(0, abs=1e-15)
    assert stretch.exact_energy(shape, stretch.LAWS["tension"], 0.0) == pytest.approx(measure, rel=1e-13)
    assert stretch.exact_energy(shape, stretch.LAWS["membrane"], 0.0) == pytest.approx(0, abs=1e-28)


@pytest.mark.parametrize("case", ["ellipse", "ellipsoid"])
def test_gradient_of_the_level_and_area(case):
    shape = stretch.CASES[case]
    x, weight = shape.quadrature()
    by_differences = differences(lambda y: shape.level(*y.T)[:, None], x)[:, 0]
    assert shape.gradient(x) == pytest.approx(by_differences, abs=1e-9)
    n = shape.gradient(x) / np.linalg.norm(shape.gradient(x), axis=1)[:, None]
    volume = weight @ ((x - shape.centre) * n).sum(1) / len(shape.axes)  # divergence theorem
    assert volume == pytest.approx({2: np.pi, 3: 4 * np.pi / 3}[len(shape.axes)] * np.prod(shape.axes), rel=1e-12)


def test_tension_has_the_length_of_the_moved_line():
    shape = stretch.CASES["ellipse"]
    x = stretch.moved(shape.quadrature(4000)[0], stretch.END)[0]
    length = np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1).sum()
    assert stretch.exact_energy(shape, stretch.LAWS["tension"], stretch.END) == pytest.approx(length, rel=1e-5)


def test_errors_fall_and_the_printed_energy_stays_off():
    cells = (32, 48, 64)
    found = [stretch.carried(None, {"case": "ellipse", "cells": n}) for n in cells]
    steps = 1 / np.array(cells)
    assert slope(steps, [one["error"] for one in found]) > 1.9
    assert slope(steps, [one["energy_tension"] for one in found]) > 1.6
    assert found[-1]["energy_membrane"] < 0.003 and found[-1]["power_membrane"] < 0.005
    assert found[-1]["printed_tension"] > 0.2 and found[-1]["without_J"] > 0.5
