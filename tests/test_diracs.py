"""Areas and volumes of surfaces in space by height functions: exact cases, orders, surfaces hard to see, extremes."""

import math

import numpy as np
import pytest

from fsiwork.core.grid import Grid
from fsiwork.core.integrals import area_and_volume, length_and_area, line_integral, smeared
from fsiwork.core.shapes import Ball, Torus
from fsiwork.studies import diracs

EIGHT = Grid((8, 8, 8), 0.125)
CENTRE = (0.51, 0.487, 0.53)


def ball(radius, centre=CENTRE, scale=1.0):
    return EIGHT.sample(lambda *x: scale * (sum((q - c) ** 2 for q, c in zip(x, centre, strict=True)) - radius**2))


def of_ball(radius):
    return 4 * math.pi * radius**2, 4 / 3 * math.pi * radius**3


def test_area_and_volume_are_of_sixth_order():
    errors = {"ball": [], "torus": []}
    exact = of_ball(0.61), (4 * math.pi**2 * 0.6 * 0.25, 2 * math.pi**2 * 0.6 * 0.25**2)
    shapes = Ball((0.013, 0.02, -0.017), 0.61), Torus((0.013, 0.02, -0.017), 0.6, 0.25)
    for n in (16, 32, 48):
        grid = Grid((n,) * 3, 2 / n, (-1.0,) * 3)
        for name, shape, wanted in zip(errors, shapes, exact, strict=True):
            errors[name].append(np.array(area_and_volume(grid, grid.sample(shape.distance))) / wanted - 1)
    assert np.abs(errors["ball"][1]).max() < 1e-9
    slopes = np.log(np.abs(errors["torus"][0]) / np.abs(errors["torus"][2])) / math.log(3)
    assert (slopes > 5.5).all()
    assert np.abs(errors["torus"][2]).max() < 1e-6


@pytest.mark.parametrize("place", [0.47, 0.4375, 0.5, 0.03125])  # off nodes, through nodes, through faces, at the edge
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("noise", [0.0, 1e-17])
def test_planes_along_the_grid_are_exact_to_the_box(place, axis, noise):
    phi = EIGHT.sample(lambda *x: x[axis] - place + 0 * (x[0] + x[1] + x[2]))
    phi = phi + noise * np.random.default_rng(1).normal(size=phi.size)
    assert area_and_volume(EIGHT, phi) == pytest.approx((1.0, place), rel=1e-12)
    assert area_and_volume(EIGHT, -phi) == pytest.approx((1.0, 1 - place), rel=1e-12)


def test_inclined_and_crossing_planes():
    inclined = area_and_volume(EIGHT, EIGHT.sample(lambda x, y, z: x + y + z - 1.5))
    assert inclined == pytest.approx((0.75 * math.sqrt(3), 0.5), rel=1e-9)
    diagonal = area_and_volume(EIGHT, EIGHT.sample(lambda x, y, z: x - y + 0 * z))
    assert diagonal == pytest.approx((math.sqrt(2), 0.5), rel=1e-9)
    area, volume = area_and_volume(EIGHT, EIGHT.sample(lambda x, y, z: (x - 0.5) * (y - 0.5) + 0 * z))
    assert area == pytest.approx(2, rel=0.02)  # the crossing itself is a part of a cell
    assert volume == pytest.approx(0.5, rel=1e-9)


def test_two_planes_within_one_cell():
    phi = EIGHT.sample(lambda x, y, z: (x - 0.49) * (x - 0.50) + 0 * (y + z))  # between the nodes 0.4375 and 0.5625
    assert (EIGHT.inside(phi) > 0).all()
    assert area_and_volume(EIGHT, phi) == pytest.approx((2.0, 0.01), rel=1e-9)


@pytest.mark.parametrize("centre", [CENTRE, (0.4375,) * 3])
@pytest.mark.parametrize(("cells", "tolerance"), [(0.2, 5e-3), (0.5, 2e-5), (1.2, 2e-5)])
def test_a_body_smaller_than_two_cells(cells, tolerance, centre):
    """A polynomial φ, so that the interpolant is exact: what is left is the quadrature. With the centre on a node the
    signs of zeros, and so the processor, decide how cells are cut: 1.0e-5 on one, 1.2e-5 on another."""
    radius = cells * EIGHT.h
    assert area_and_volume(EIGHT, ball(radius, centre)) == pytest.approx(of_ball(radius), rel=tolerance)


@pytest.mark.parametrize("scale", [1e-12, 1e12, -1.0])
def test_the_scale_of_the_field_does_not_matter(scale):
    area, volume = area_and_volume(EIGHT, ball(0.3))
    found = area_and_volume(EIGHT, ball(0.3, scale=scale))
    assert found == pytest.approx((area, volume if scale > 0 else 1 - volume), rel=1e-9)


def test_single_precision():
    assert area_and_volume(EIGHT, ball(0.3).astype(np.float32)) == pytest.approx(of_ball(0.3), rel=1e-6)


def test_empty_full_flat_kinked_and_rough_boxes():
    assert area_and_volume(EIGHT, np.ones(EIGHT.size)) == (0, 0)
    assert area_and_volume(EIGHT, -np.ones(EIGHT.size)) == (0, pytest.approx(1.0))
    assert area_and_volume(EIGHT, np.zeros(EIGHT.size)) == (0, pytest.approx(1.0))
    kink = EIGHT.sample(lambda *x: np.maximum(np.maximum(*(abs(q - 0.5) for q in x[:2])), abs(x[2] - 0.5)) - 0.27)
    assert area_and_volume(EIGHT, kink) == pytest.approx((6 * 0.54**2, 0.54**3), rel=0.06)
    rough = area_and_volume(EIGHT, np.random.default_rng(0).normal(size=EIGHT.size))
    assert np.isfinite(rough).all()
    broken = ball(0.3).copy()
    broken[EIGHT.size // 2] = math.nan
    assert np.isnan(area_and_volume(EIGHT, broken)).all()


@pytest.mark.parametrize("shift", [0.0, 0.07, 0.5])
def test_a_body_across_a_periodic_side_is_measured_once(shift):
    """Wherever it lies in its period; ghosts are copies."""
    for n in ((24, 24), (24, 24, 24)):
        grid = Grid(n, 1 / 24)
        x = [(q - 0.5 - shift + 0.5) % 1.0 - 0.5 for q in grid.points()]
        phi = np.broadcast_to(sum(q**2 for q in x) - 0.3**2, grid.shape).ravel()
        found, exact = ((length_and_area, (0.6 * math.pi, 0.09 * math.pi)), (area_and_volume, of_ball(0.3)))[len(n) - 2]
        assert found(grid, phi) == pytest.approx(exact, rel=1e-8)


def test_the_plane_is_refused():
    grid = Grid((8, 8), 0.125)
    with pytest.raises(ValueError, match="surfaces in space"):
        area_and_volume(grid, grid.field())


@pytest.mark.parametrize("scaling", diracs.SCALINGS)
@pytest.mark.parametrize("kind", diracs.KINDS)
def test_the_smeared_ellipse_without_a_grid_is_what_sums_tend_to(kind, scaling):
    found = diracs.widths(None, {"kind": kind, "scaling": scaling, "width": 24, "step": 1 / 96, "draws": 4})
    assert found["error"] == pytest.approx(found["limit"], rel=0.05)
    if scaling == "plain":  # L(c) = L √(1 + c): half the second moment of ζ times -1/4
        moment = 1 / 3 - 2 / math.pi**2 if kind == "cosine" else 1 / 6
        assert found["limit"] == pytest.approx(moment * 0.25**2 / 8, rel=0.05)


@pytest.mark.parametrize("name", diracs.CURVES)
def test_curves_in_space_are_of_second_order(name):
    errors = [diracs.curves(None, {"curve": name, "kind": "cosine", "cells": n, "draws": 2})["error"] for n in (32, 64)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.15)
    assert errors[1] < 0.01


def test_a_line_integral_wants_space_and_numbers():
    flat = Grid((8, 8), 0.125)
    with pytest.raises(ValueError, match="cut out of space"):
        line_integral(flat, (flat.field(), flat.field()), 0.1)
    assert line_integral(EIGHT, (np.ones(EIGHT.size), np.ones(EIGHT.size)), 0.1) == 0
    assert math.isnan(line_integral(EIGHT, (np.full(EIGHT.size, math.nan), ball(0.3)), 0.1))
    assert math.isnan(smeared(EIGHT, np.full(EIGHT.size, math.inf), 0.1))
