"""Curves in space from two level sets: exact frames, orders, scales, plane curves, straight lines, what is refused."""

import numpy as np
import pytest

from fsiwork.core.curves import frenet, frenet_at
from fsiwork.core.grid import Grid
from fsiwork.studies import curves
from fsiwork.studies.orders import slope


def fields(grid, function):
    return [np.ascontiguousarray(np.broadcast_to(q, grid.shape)).ravel() for q in function(*grid.points())]


def inner(grid, reach=3):
    inside = np.zeros(grid.shape, bool)
    inside[(slice(3 + reach, -3 - reach),) * 3] = True
    return np.flatnonzero(inside)


def circle(x, y, z):
    return np.sqrt(x * x + y * y) - 1, z + 0 * x


@pytest.mark.parametrize("order", [2, 4])
def test_both_curves_are_found_with_their_order(order):
    for name, expected in (("helix", order - 0.1), ("trefoil", 0.88 * order)):
        cells = (96, 144)
        found = [curves.curve(None, {"curve": name, "order": order, "cells": n}) for n in cells]
        for label in ("curvature", "torsion", "tangent", "binormal"):
            errors = [one[f"{label}_error"] for one in found]
            assert slope(1 / np.array(cells), errors) > expected, (name, label)


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize(("one", "two"), [(1.0, 1.0), (1e-12, 1e12), (-1.0, 1.0), (1.0, -1e-12)])
def test_scales_and_signs_only_turn_the_tangent(order, one, two):
    grid = Grid((20, 20, 20), 0.1, (-1.0, -1.0, -1.0))
    p, q = fields(grid, curves.helix_fields)
    nodes = inner(grid)[::37]
    a, b = frenet(grid, p, q, nodes, order), frenet(grid, one * p, two * q, nodes, order)
    sign = np.sign(one * two)
    assert b.curvature == pytest.approx(a.curvature, rel=1e-9)
    assert b.torsion == pytest.approx(a.torsion, rel=1e-9)
    assert b.frame == pytest.approx(a.frame * np.reshape([sign, 1, sign], (3, 1, 1)), abs=1e-9)


def test_a_mirrored_helix_has_the_other_torsion():
    grid = Grid((20, 20, 20), 0.1, (-1.0, -1.0, -1.0))
    nodes = inner(grid)[::37]
    right = frenet(grid, *fields(grid, curves.helix_fields), nodes, 4)
    left = frenet(grid, *fields(grid, lambda x, y, z: curves.helix_fields(x, y, -z)), nodes, 4)
    assert (right.torsion > 0).all()
    assert (left.torsion < 0).all()


def test_the_frame_is_orthonormal_and_right_handed():
    grid = curves.grid_of("trefoil", 64)
    frame = frenet(grid, *fields(grid, curves.trefoil_fields), inner(grid)[::911], 4).frame
    assert np.einsum("acm,bcm->mab", frame, frame) == pytest.approx(np.broadcast_to(np.eye(3), (frame.shape[2], 3, 3)))
    assert np.linalg.det(np.moveaxis(frame, 2, 0)) == pytest.approx(1)


def test_a_plane_circle_has_no_torsion_and_its_normal_points_inwards():
    """Remark 1.9: n = -∇φ¹/|∇φ¹| for φ² = z."""
    grid = Grid((40, 40, 12), 0.06, (-1.2, -1.2, -0.36))
    nodes = inner(grid)
    x, y, _ = (np.broadcast_to(c, grid.shape).ravel()[nodes] for c in grid.points())
    radius = np.hypot(x, y)
    near = np.abs(radius - 0.8) < 0.1
    found = frenet(grid, *fields(grid, circle), nodes[near], 4)
    assert found.curvature == pytest.approx(1 / radius[near], rel=2e-3)
    assert found.frame[1] == pytest.approx(-np.stack([x, y, 0 * x])[:, near] / radius[near], abs=2e-3)
    assert found.torsion == pytest.approx(0, abs=1e-9)


def test_a_straight_line_has_a_tangent_and_nothing_else():
    grid = Grid((8, 8, 8), 0.1)
    found = frenet(grid, *fields(grid, lambda x, y, z: (x + 2 * y + 0 * z, y - z + 0 * x)), inner(grid, 0))
    assert np.abs(found.frame[0] - np.reshape([-2, 1, 1], (3, 1)) / np.sqrt(6)).max() < 1e-12
    assert found.curvature.max() < 1e-9
    assert not found.torsion.any()
    assert not found.frame[1:].any()


def test_where_the_surfaces_do_not_cross_all_is_zero():
    grid = Grid((8, 8, 8), 0.1)
    same = frenet(grid, *fields(grid, lambda x, y, z: (x + 0 * y * z, 2 * x + 0 * y * z)), inner(grid, 0))
    flat = frenet(grid, *fields(grid, lambda x, y, z: (1 + 0 * x * y * z, y + 0 * x * z)), inner(grid, 0))
    for found in (same, flat):
        assert not found.frame.any()
        assert not found.curvature.any()
        assert not found.torsion.any()


def test_what_is_not_finite_stays_so():
    grid = Grid((12, 12, 12), 0.1, (-0.6, -0.6, -0.6))
    p, q = fields(grid, curves.helix_fields)
    p[inner(grid)[0]] = np.nan
    found = frenet(grid, p, q, inner(grid)[:3])
    assert np.isnan(found.torsion).all()
    assert np.isnan(found.curvature).all()


def test_single_precision_is_finite_and_near():
    grid = Grid((20, 20, 20), 0.1, (-1.0, -1.0, -1.0))
    p, q = fields(grid, curves.helix_fields)
    nodes = inner(grid)[::37]
    a = frenet(grid, p, q, nodes)
    b = frenet(grid, p.astype(np.float32), q.astype(np.float32), nodes)
    assert b.curvature == pytest.approx(a.curvature, rel=1e-3)
    assert b.torsion == pytest.approx(a.torsion, abs=0.02)


def test_the_knot_lies_on_its_fields_and_its_frame_obeys_frenet():
    x, theta = curves.trefoil()
    assert np.abs(curves.trefoil_fields(*x)).max() < 1e-13
    exact = curves.of_trefoil()
    away = np.fft.ifft(np.fft.fft(x, axis=1) * 1j * np.fft.fftfreq(theta.size, 1 / theta.size), axis=1).real
    turn = np.fft.ifft(
        np.fft.fft(exact.frame[2], axis=1) * 1j * np.fft.fftfreq(theta.size, 1 / theta.size), axis=1
    ).real
    found = -(turn * exact.frame[1]).sum(0) / np.linalg.norm(away, axis=0)  # (1.15)
    assert found == pytest.approx(exact.torsion, abs=1e-3)  # of 12; the series of b converges slowly


def test_what_is_refused():
    grid = Grid((8, 8, 8), 0.1)
    p, q = fields(grid, curves.helix_fields)
    with pytest.raises(ValueError, match="order must be 2 or 4"):
        frenet(grid, p, q, inner(grid), 3)
    with pytest.raises(ValueError, match="6 neighbours"):
        frenet(grid, p, q, inner(grid, 0), 4)
    with pytest.raises(ValueError, match="two cells"):
        frenet_at(grid, p, q, np.full((3, 1), 0.05))
    with pytest.raises(ValueError, match="three directions"):
        frenet(Grid((8, 8), 0.1), p, q, np.zeros(1, int))
    with pytest.raises(ValueError, match="helix or trefoil"):
        curves.grid_of("line", 8)
