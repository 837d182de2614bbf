"""Redistancing: extremes that every method survives, sides, bands, space."""

import numpy as np
import pytest

from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.redistance import METHODS, redistance
from fsiwork.core.shapes import Ball, Box, Union

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
    "two interfaces a cell apart": (slab(1.3 * H), lambda d, g: d, 0.75),
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


@pytest.mark.parametrize("method", METHODS)
def test_what_lies_between_two_nodes_is_not_seen(method):
    """A slab of 0.6 cells with no node inside: φ has one sign, and every method answers as for an empty box."""
    grid = square(32)
    distance = grid.sample(slab(0.6 * H))
    assert (distance > 0).all()
    found = grid.inside(redistance(grid, distance, method))
    assert np.isfinite(found).all()
    assert (found > 0).all()
