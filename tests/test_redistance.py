"""Redistancing: extremes that every method survives, exact cases, orders, drift, sides; kernels against NumPy."""

import math

import numpy as np
import pytest

from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import relaxation as kernels
from fsiwork.core.redistance import METHODS, redistance
from fsiwork.core.relaxation import beside, renormalised
from fsiwork.core.shapes import Ball, Box, Ellipsoid, Union
from fsiwork.studies import redistancing as study

CLASSICAL = ("pde", "subcell", "fast-marching-1", "fast-marching-2", "fast-sweeping")
MARCHING = ("fast-marching-1", "fast-marching-2", "fast-sweeping")

REFUSED: dict[tuple[str, str], str] = {}
"""(method, case) that may be refused, with the words of its one line. Nobody needs it so far."""


def square(cells, length=1.0):
    return Grid((cells, cells), length / cells, (-length / 2, -length / 2))


def slab(width):
    return lambda x, y: np.abs(x + 0 * y) - width / 2


H = 1 / 32
DISC = Ball((0.013, -0.007), 0.3).distance

# name -> (distance, φ of the distance and its grid, largest error within 1.2 cells of the interface [cells])
CASES = {
    "flat regions": (DISC, lambda d, g: np.clip(d, -2.5 * g.h, 2.5 * g.h), 0.4),
    "kinks": (Box((0.011, 0.007), (0.5, 0.4)).distance, lambda d, g: d, 0.75),
    # the grid joins them by a neck of two cells
    "two discs that touch": (Union((Ball((-0.2, 0.0), 0.2), Ball((0.2, 0.0), 0.2))).distance, lambda d, g: d, 1.6),
    "through nodes": (lambda x, y: x + 0.5 * H + 0 * y, lambda d, g: 3.0 * d, 1e-6),
    "two interfaces in a cell": (slab(1.3 * H), lambda d, g: d, 0.75),
    "smaller than two cells": (Ball((0.4 * H, 0.5 * H), 0.9 * H).distance, lambda d, g: d, 0.75),
    "steep and shallow": (DISC, lambda d, g: d * (0.1 + 4 * (g.sample(lambda x, y: x + y) + 1.1) ** 2), 0.4),
}


def answer(method, case, grid, phi, band=None):
    """The result, or None where the table allows a refusal and there is one."""
    if (method, case) not in REFUSED:
        return redistance(grid, phi, method, band)
    with pytest.raises(ValueError, match=REFUSED[method, case]) as caught:
        redistance(grid, phi, method, band)
    assert "\n" not in str(caught.value)
    return None


def near(grid, distance, cells=1.2):
    return np.abs(grid.inside(distance)) < cells * grid.h


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", CASES)
def test_extremes_are_finite_and_right(method, case):
    shape, change, most = CASES[case]
    grid = square(32)
    distance = grid.sample(shape)
    phi = change(distance, grid)
    out = answer(method, case, grid, phi)
    if out is None:
        return
    assert np.isfinite(out).all()
    error = np.abs(grid.inside(out) - grid.inside(distance)) / grid.h
    assert error[near(grid, distance)].max() <= most
    least = 0.6 * grid.h if method == "pde" else 1e-9  # its interface moves, at kinks over nodes
    inside, outside = grid.inside(distance) < -least, grid.inside(distance) > least
    assert (grid.inside(out)[inside] < 0).all() and (grid.inside(out)[outside] > 0).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("field", ["one value", "a slope"])
def test_without_an_interface_the_sign_stays(method, sign, field):
    grid = square(16)
    phi = sign * grid.sample(lambda x, y: 2.0 + (x + y if field == "a slope" else 0 * (x + y)))
    out = answer(method, "empty", grid, phi)
    assert out is None or (np.isfinite(out).all() and (out * sign > 0).all())


@pytest.mark.parametrize("method", METHODS)
def test_zero_everywhere_stays_zero_or_small(method):
    grid = square(16)
    out = answer(method, "zero", grid, grid.field())
    assert out is None or np.isfinite(out).all()


@pytest.mark.parametrize("method", METHODS)
def test_eight_cells(method):
    grid = square(8)
    distance = grid.sample(Ball((0.01, 0.02), 0.25).distance)
    out = answer(method, "N = 8", grid, distance * 5)
    if out is not None:
        assert np.abs(grid.inside(out) - grid.inside(distance))[near(grid, distance)].max() < 0.4 * grid.h


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_the_scale_of_phi_does_not_matter(method, scale):
    grid = square(32)
    phi = grid.sample(DISC) * grid.sample(lambda x, y: 1 + x)
    out = answer(method, f"times {scale:g}", grid, phi * scale)
    if out is not None:
        assert out == pytest.approx(redistance(grid, phi, method), abs=1e-7 * grid.h)


@pytest.mark.parametrize("method", METHODS)
def test_single_precision(method):
    grid = square(32)
    phi = grid.sample(DISC)
    out = answer(method, "float32", grid, phi.astype(np.float32))
    if out is not None:
        assert out.dtype == np.float32
        distance = redistance(grid, phi, method)
        assert np.abs(out - distance)[np.abs(phi) < 5 * grid.h].max() < 1e-3 * grid.h


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_no_number_shows(method, value):
    grid = square(16)
    phi = grid.sample(DISC).copy()
    phi[grid.size // 2 + 3] = value
    assert np.isnan(redistance(grid, phi, method)).all()


@pytest.mark.parametrize("method", METHODS)
def test_a_band_cuts(method):
    grid = square(32)
    distance = grid.sample(DISC)
    out = redistance(grid, 2 * distance, method, 3.0)
    assert np.abs(grid.inside(out)).max() <= 3.0 * grid.h * (1 + 1e-12)
    assert np.abs(grid.inside(out) - grid.inside(distance))[near(grid, distance, 2.0)].max() < 0.4 * grid.h


@pytest.mark.parametrize("method", METHODS)
def test_space_too(method):
    grid = Grid((16, 18, 20), 1 / 16, (-0.5, -0.56, -0.6))
    distance = grid.sample(Ball((0.013, -0.007, 0.01), 0.3).distance)
    out = redistance(grid, distance * grid.sample(lambda x, y, z: 1.5 + x + y), method)
    error = np.abs(grid.inside(out) - grid.inside(distance))
    assert np.isfinite(out).all()
    assert error[near(grid, distance)].max() < 0.45 * grid.h


def periodic(grid, shape):
    phi = grid.sample(shape).copy()
    Edges(grid, ((Side("periodic"),) * 2,) * 2).fill_scalar(phi, "linear")
    return phi


@pytest.mark.parametrize("method", METHODS)
def test_through_periodic_sides(method):
    grid = square(32)
    distance = periodic(grid, lambda x, y: 0.08 - np.abs((x - 0.47 + 0.5) % 1.0 - 0.5) + 0 * y)
    out = redistance(grid, 2 * distance, method)
    assert np.abs(grid.inside(out) - grid.inside(distance))[near(grid, distance)].max() < 0.02 * grid.h


@pytest.mark.parametrize("method", MARCHING)
def test_the_far_side_of_a_periodic_box(method):
    grid = square(16)
    distance = periodic(grid, lambda x, y: 0.25 - np.abs((x - 0.45 + 0.5) % 1.0 - 0.5) + 0 * y)
    out = redistance(grid, distance.copy(), method)
    assert grid.inside(out) == pytest.approx(grid.inside(distance), abs=0.3 * grid.h)


def test_a_wrong_method_and_band_are_one_line():
    grid = square(8)
    with pytest.raises(ValueError, match="method must be one of pde, subcell"):
        redistance(grid, grid.field(), "pd")
    with pytest.raises(ValueError, match="band must be positive"):
        redistance(grid, grid.field(), "pde", 0.0)


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
    phi = np.clip(grid.sample(DISC), -0.1, 0.1)
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
