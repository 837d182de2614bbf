"""Ways to a distance: orders, drift, kernels against NumPy and exact cases, marching against its peer."""

import math

import numpy as np
import pytest

from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import relaxation as kernels
from fsiwork.core.redistance import redistance
from fsiwork.core.relaxation import beside, renormalised
from fsiwork.core.shapes import Ball, Ellipsoid
from fsiwork.studies import redistancing as study


def square(cells):
    return Grid((cells, cells), 1 / cells, (-0.5, -0.5))


def near(grid, distance):
    return np.abs(grid.inside(distance)) < 1.2 * grid.h


def ellipse(cells):
    grid = square(cells)
    distance = grid.sample(Ellipsoid((0.0, 0.0), (0.35, 0.2)).distance)
    steepness = grid.sample(lambda x, y: (x - 0.35) ** 2 + (y - 0.25) ** 2 + 0.1)
    return grid, steepness * grid.sample(lambda x, y: np.hypot(x / 0.35, y / 0.2) - 1), distance


def order(method, where):
    errors = []
    for cells in (32, 64, 128):
        grid, phi, distance = ellipse(cells)
        error = np.abs(grid.inside(method(grid, phi)) - grid.inside(distance))
        errors.append(error[where(grid, distance)].max())
    return np.polyfit(np.log([1 / 32, 1 / 64, 1 / 128]), np.log(errors), 1)[0]


def outside(grid, distance):
    return grid.inside(distance) > 0


@pytest.mark.parametrize(
    ("method", "where", "least"),
    [("pde", near, 0.9), ("subcell", near, 1.8), ("fast-marching-2", outside, 1.8), ("fast-sweeping", outside, 0.6)],
)
def test_orders(method, where, least):
    assert order(lambda grid, phi: redistance(grid, phi, method), where) > least


def test_renormalisation_is_second_order_and_bounded():
    assert order(renormalised, near) > 1.8
    grid = square(16)
    phi = np.clip(grid.sample(Ball((0.013, -0.007), 0.3).distance), -0.1, 0.1)
    assert np.abs(renormalised(grid, phi)).max() <= math.sqrt(2) * (1 + 1e-12)
    assert not renormalised(grid, grid.field()).any()
    plane = grid.sample(lambda x, y: 5 * (0.6 * x + 0.8 * y))
    assert grid.inside(renormalised(grid, plane)) == pytest.approx(grid.inside(plane) / 5, abs=1e-14)


@pytest.mark.parametrize("method", ["subcell", "fast-marching-2"])
def test_repeats_leave_the_interface(method):
    grid, phi, distance = ellipse(64)
    edges = Edges(grid, ((Side("outflow"),) * 2,) * 2)
    for _ in range(200):
        phi = redistance(grid, phi, method, 4.0)
        edges.fill_scalar(phi, "linear")
    assert np.abs(grid.inside(phi) - grid.inside(distance))[near(grid, distance)].max() < 0.05 * grid.h


def residual(grid, d):
    """|∇d| - 1 of first order upwinding, in NumPy."""
    total = 0.0
    for a in grid.axes:
        low, high = np.roll(d, 1, a), np.roll(d, -1, a)
        total = total + np.maximum(d - np.minimum(low, high), 0) ** 2
    return np.sqrt(total) / grid.h - 1


@pytest.mark.parametrize("cells", [(24, 20), (10, 12, 8)])
def test_marching_and_sweeping_solve_the_same_equations(cells):
    grid = Grid(cells, 0.1)
    centre = tuple(0.047 * n for n in cells)
    phi = grid.sample(Ball(centre, 0.31).distance) * 3
    marched, swept = (np.abs(redistance(grid, phi, m)) for m in ("fast-marching-1", "fast-sweeping"))
    assert marched == pytest.approx(swept, abs=1e-8 * grid.h)
    seeds = np.zeros(grid.shape, bool)
    for a in grid.axes:
        for k in (-1, 1):
            seeds |= np.sign(np.roll(grid.padded(phi), k, a)) != np.sign(grid.padded(phi))
    inner = (slice(1, -1),) * grid.dim
    left = np.abs(residual(grid, grid.padded(marched)))[inner][~seeds[inner]]
    assert left.max() < 1e-9


def test_marching_is_that_of_scikit_fmm():
    skfmm = pytest.importorskip("skfmm")
    grid, phi, _ = ellipse(48)
    for name in ("fast-marching-1", "fast-sweeping"):
        found = redistance(grid, phi, name)
        assert found == pytest.approx(skfmm.distance(grid.padded(phi), dx=grid.h, order=1).ravel(), abs=1e-8 * grid.h)


def test_distances_beside_a_plane_are_exact():
    grid = Grid((9, 10, 8), 0.1)
    plane = grid.sample(lambda x, y, z: 7 * (2 * x - y + 2 * z - 0.9) / 3)
    nodes, distances = beside(grid, plane)
    assert distances == pytest.approx(plane[nodes] / 7 / grid.h, abs=1e-12)
    shares = grid.padded(plane) > 0
    crossed = np.logical_or.reduce([shares[:-1] != shares[1:]]).sum()
    assert nodes.size > crossed > 0


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_one_stage_against_exact_slopes(dim, sign):
    errors = []
    for cells in (16, 32):
        grid = Grid((cells,) * dim, 1 / cells)
        q = grid.sample(lambda *x: sum(np.exp(0.7 * c) / (a + 1) for a, c in enumerate(x)))
        slope = grid.sample(lambda *x: np.sqrt(sum((0.7 * np.exp(0.7 * c) / (a + 1)) ** 2 for a, c in enumerate(x))))
        out, start = np.zeros_like(q), grid.rows()
        k = np.array([0.25, 0.75, 0.5])
        kernels.stage(out, q, q, np.full_like(q, sign), *start, np.array(grid.strides), k)
        wanted = q + 0.75 * 0.5 * sign * (1 - grid.h * slope)
        errors.append(np.abs(grid.inside(out) - grid.inside(wanted)).max() / grid.h)
    assert errors[1] < 1e-6
    assert math.log2(errors[0] / errors[1]) > 4.5


def test_the_study_reads_polynomials_of_fifth_order_exactly():
    grid = square(16)
    phi = grid.sample(lambda x, y: x**5 - 3 * x**2 * y**5 + y - 0.3)
    x, y = np.random.default_rng(5).uniform(-0.45, 0.45, (2, 50))
    found = study._interpolated(grid, phi, [x, y])
    assert found == pytest.approx(x**5 - 3 * x**2 * y**5 + y - 0.3, abs=1e-13)


def test_the_study_measures_errors_and_drift():
    found = study.errors(None, {"method": "fast-marching-2", "cells": 64})
    assert 1e-5 < found["near"] <= found["outside"] <= found["box"] < 5e-3
    assert found["ms"] > 0
    assert np.isnan(study.errors(None, {"method": "closest-cubic", "cells": 32})["box"])
    moved = [study.drift(None, {"method": "pde", "cells": 64, "repeats": k})["moved"] for k in (0, 1)]
    assert moved[0] < 1e-5 < 1e-3 < moved[1] < 0.2
