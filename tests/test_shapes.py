"""Signed distances against the distance to many points of the boundary, and to the sign of a definition."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fsiwork.core.shapes import (
    Ball,
    Box,
    Capsule,
    Cassini,
    Ellipsoid,
    Intersection,
    Minus,
    Moved,
    Polygon,
    Slot,
    Tablet,
    Torus,
    Union,
)

ANGLE = np.linspace(0, 2 * np.pi, 20_001)
CIRCLE = np.stack([np.cos(ANGLE), np.sin(ANGLE)])
STAR = ((0.9, 0.0), (0.3, 0.2), (0.2, 0.8), (-0.2, 0.2), (-0.8, -0.1), (-0.1, -0.2), (0.1, -0.9), (0.2, -0.2))


def broken_line(points):
    t = np.linspace(0, 1, 2_001)[:, None]
    return np.concatenate([np.asarray(a) * (1 - t) + np.asarray(b) * t for a, b in pairwise(points)]).T


def cassini_curve(a, b):
    c, s = np.cos(2 * ANGLE), np.sin(2 * ANGLE)
    return np.sqrt(a * a * c + np.sqrt(b**4 - a**4 * s * s)) * CIRCLE


def slot_curve(radius, width, depth):
    side, top = width / 2, depth - radius
    rim = radius * CIRCLE
    rim = rim[:, (abs(rim[0]) >= side) | (rim[1] > 0)]
    corner = -np.sqrt(radius**2 - side**2)
    return np.concatenate([rim, broken_line([(-side, corner), (-side, top), (side, top), (side, corner)])], axis=1)


CURVES = {
    "disc": (Ball((0.1, -0.2), 0.5), 0.5 * CIRCLE + [[0.1], [-0.2]]),
    "ellipse": (Ellipsoid((0.1, 0.0), (0.75, 0.5)), CIRCLE * [[0.75], [0.5]] + [[0.1], [0.0]]),
    "thin ellipse": (Ellipsoid((0.0, 0.0), (0.02, 0.9)), CIRCLE * [[0.02], [0.9]]),
    "box": (Box((0, 0.1), (1.0, 0.6)), broken_line([(-0.5, -0.2), (0.5, -0.2), (0.5, 0.4), (-0.5, 0.4), (-0.5, -0.2)])),
    "polygon": (Polygon(STAR), broken_line([*STAR, STAR[0]])),
    "polygon the other way round": (Polygon(STAR[::-1]), broken_line([*STAR, STAR[0]])),
    "oval": (Cassini((0.0, 0.0), 0.6, 0.62), cassini_curve(0.6, 0.62)),
    "round oval": (Cassini((0.0, 0.0), 0.2, 0.6), cassini_curve(0.2, 0.6)),
    "slot": (Slot((0.0, 0.0), 0.6, 0.2, 0.9), slot_curve(0.6, 0.2, 0.9)),
}


@pytest.mark.parametrize("name", CURVES)
def test_distance_in_2d_is_the_distance_to_the_nearest_point_of_the_curve(name):
    shape, curve = CURVES[name]
    x = np.random.default_rng(1).uniform(-1, 1, (2, 4_000))
    spacing = np.abs(np.diff(curve, axis=1)).max(axis=0)
    found = np.abs(shape.distance(*x))
    wanted = cKDTree(curve.T).query(x.T)[0]
    assert np.sort(spacing)[-10] < 1e-2
    # A sample is never nearer than the curve, and farther by at most half a gap.
    assert (found <= wanted + 1e-12).all()
    assert (wanted - found).max() < 0.5 * np.sort(spacing)[-10]
    far = wanted > 0.02
    assert np.abs(wanted - found)[far].max() < 2e-4


SIGNS = {
    "disc": lambda x, y: np.hypot(x - 0.1, y + 0.2) < 0.5,
    "ellipse": lambda x, y: ((x - 0.1) / 0.75) ** 2 + (y / 0.5) ** 2 < 1,
    "box": lambda x, y: (abs(x) < 0.5) & (abs(y - 0.1) < 0.3),
    "oval": lambda x, y: np.hypot(x - 0.6, y) * np.hypot(x + 0.6, y) < 0.62**2,
    "slot": lambda x, y: (np.hypot(x, y) < 0.6) & ~((abs(x) < 0.1) & (y < 0.3)),
}


@pytest.mark.parametrize("name", SIGNS)
def test_sign_is_negative_inside(name):
    x = np.random.default_rng(2).uniform(-1, 1, (2, 4_000))
    assert ((CURVES[name][0].distance(*x) < 0) == SIGNS[name](*x)).all()


def test_sign_of_a_polygon_agrees_with_its_angle_sum():
    x = np.random.default_rng(3).uniform(-1, 1, (2, 2_000))
    corners = np.array([*STAR, STAR[0]])[:, 0] + 1j * np.array([*STAR, STAR[0]])[:, 1]
    ray = corners[:, None] - (x[0] + 1j * x[1])
    turns = np.angle(ray[1:] / ray[:-1]).sum(axis=0) / (2 * np.pi)
    assert ((Polygon(STAR).distance(*x) < 0) == (abs(turns) > 0.5)).all()


@pytest.mark.parametrize("axes", [(0.75, 0.5), (0.02, 0.9), (0.8, 0.6, 0.45), (0.5, 0.5, 0.1), (0.3, 0.3, 0.3)])
def test_ellipsoid_recovers_a_normal_offset(axes):
    rng = np.random.default_rng(4)
    unit = rng.normal(size=(len(axes), 3_000))
    unit /= np.linalg.norm(unit, axis=0)
    a = np.array(axes)[:, None]
    normal = unit / a
    normal /= np.linalg.norm(normal, axis=0)
    # Inside, no farther than the least radius of curvature: there the foot point is still the nearest one.
    offset = rng.uniform(-0.9 * min(axes) ** 2 / max(axes), 1.0, unit.shape[1])
    found = Ellipsoid((0.0,) * len(axes), axes).distance(*(a * unit + offset * normal))
    assert np.abs(found - offset).max() < 1e-13


def test_oval_recovers_a_normal_offset():
    a, b = 0.076, 0.08
    x, y = cassini_curve(a, b)[:, ::7]
    left, right = (x + a) ** 2 + y * y, (x - a) ** 2 + y * y
    normal = np.stack([(x + a) / left + (x - a) / right, y / left + y / right])
    normal /= np.hypot(*normal)
    for offset in (-0.002, 1e-9, 0.01):  # the waist is concave with a radius of curvature above 0.01
        found = Cassini((0.0, 0.0), a, b).distance(x + offset * normal[0], y + offset * normal[1])
        np.testing.assert_allclose(found, offset, atol=1e-13)


def test_ellipsoid_on_its_planes_of_symmetry_and_at_its_centre():
    ellipse = Ellipsoid((0.0, 0.0), (2.0, 1.0))
    assert ellipse.distance(np.array(0.0), np.array(0.0)) == pytest.approx(-1, abs=1e-14)
    # On the long axis within the centre of curvature a - b²/a = 1.5 the nearest point lies off the axis.
    for x in (0.5, 1.0, 1.4):
        assert ellipse.distance(np.array(x), np.array(0.0)) == pytest.approx(-np.sqrt(1 - x * x / 3), abs=1e-13)
    assert ellipse.distance(np.array(1.75), np.array(0.0)) == pytest.approx(-0.25, abs=1e-13)
    assert Ellipsoid((0, 0, 0), (3, 2, 1)).distance(0.0, 0.0, 0.0) == pytest.approx(-1, abs=1e-14)


def test_three_dimensional_shapes_against_their_section():
    x, y, z = np.random.default_rng(5).uniform(-1, 1, (3, 2_000))
    across = np.hypot(y, z)
    np.testing.assert_allclose(
        Cassini((0, 0, 0), 0.5, 0.6).distance(x, y, z), Cassini((0, 0), 0.5, 0.6).distance(x, across), atol=1e-14
    )
    np.testing.assert_allclose(
        Capsule((-0.4, 0, 0), (0.4, 0, 0), 0.2).distance(x, y, z),
        Capsule((-0.4, 0), (0.4, 0), 0.2).distance(x, across),
        atol=1e-14,
    )
    np.testing.assert_allclose(
        Torus((0, 0, 0), 0.6, 0.2).distance(x, y, z), Ball((0.6, 0.0), 0.2).distance(np.hypot(x, y), z), atol=1e-14
    )
    np.testing.assert_allclose(
        Tablet((0, 0, 0), 0.4, 0.2).distance(x, y, z),
        Capsule((-0.4, 0), (0.4, 0), 0.2).distance(np.hypot(x, y), z),
        atol=1e-14,
    )
    np.testing.assert_allclose(
        Ellipsoid((0, 0, 0), (0.7, 0.3, 0.3)).distance(x, y, z),
        Ellipsoid((0, 0), (0.7, 0.3)).distance(x, across),
        atol=1e-14,
    )


def test_capsule_is_a_thick_segment():
    curve = broken_line([(-0.4, -0.1), (0.3, 0.5)])
    x = np.random.default_rng(6).uniform(-1, 1, (2, 2_000))
    wanted = cKDTree(curve.T).query(x.T)[0] - 0.2
    np.testing.assert_allclose(Capsule((-0.4, -0.1), (0.3, 0.5), 0.2).distance(*x), wanted, atol=1e-4)


def test_slot_in_3d_has_the_sign_of_a_cut_ball_and_is_a_bound():
    x, y, z = np.random.default_rng(7).uniform(-1, 1, (3, 2_000))
    found = Slot((0, 0, 0), 0.6, 0.2, 0.9).distance(x, y, z)
    inside = (np.sqrt(x * x + y * y + z * z) < 0.6) & ~((abs(x) < 0.1) & (y < 0.3))
    assert ((found < 0) == inside).all()
    flat = Slot((0, 0), 0.6, 0.2, 0.9).distance(x, y)
    at_zero = Slot((0, 0, 0), 0.6, 0.2, 0.9).distance(x, y, 0 * z)
    assert (abs(at_zero) <= abs(flat) + 1e-14).all()


def test_union_intersection_and_minus_have_exact_signs_and_never_exceed_the_distance():
    left, right = Ball((-0.2, 0.0), 0.5), Ball((0.3, 0.1), 0.4)
    x = np.random.default_rng(8).uniform(-1, 1, (2, 3_000))
    a, b = left.distance(*x) < 0, right.distance(*x) < 0
    rims = [0.5 * CIRCLE + [[-0.2], [0.0]], 0.4 * CIRCLE + [[0.3], [0.1]]]
    in_right, in_left = right.distance(*rims[0]) < 0, left.distance(*rims[1]) < 0
    cases = (
        (Union((left, right)), a | b, [rims[0][:, ~in_right], rims[1][:, ~in_left]], ~(a | b)),
        (Intersection((left, right)), a & b, [rims[0][:, in_right], rims[1][:, in_left]], a & b),
        (Minus(left, right), a & ~b, [rims[0][:, ~in_right], rims[1][:, in_left]], a & ~b),
    )
    for shape, inside, boundary, exact in cases:
        found = shape.distance(*x)
        wanted = cKDTree(np.concatenate(boundary, axis=1).T).query(x.T)[0]
        assert ((found < 0) == inside).all()
        assert (abs(found) <= wanted + 1e-12).all()
        assert np.abs(abs(found) - wanted)[exact & (wanted > 0.02)].max() < 1e-4


def test_moved_turns_then_shifts():
    shape = Moved(Capsule((0.0, 0.0), (1.0, 0.0), 0.1), (0.5, 0.25), np.pi / 2)
    assert shape.distance(0.5, 1.25) == pytest.approx(-0.1)  # the end (1, 0), turned to (0, 1), then shifted
    x = np.random.default_rng(9).uniform(-1, 1, (3, 500))
    spun = Moved(Capsule((0, 0, 0), (1, 0, 0), 0.1), (0, 0, 0), 2 * np.pi / 3, (1.0, 1.0, 1.0))
    np.testing.assert_allclose(spun.distance(*x), Capsule((0, 0, 0), (0, 1, 0), 0.1).distance(*x), atol=1e-14)


def test_every_shape_takes_an_open_mesh():
    x, y = np.linspace(-1, 1, 7)[:, None], np.linspace(-1, 1, 5)[None, :]
    for shape, _ in CURVES.values():
        full = shape.distance(*np.broadcast_arrays(x, y))
        np.testing.assert_allclose(shape.distance(x, y), full, atol=1e-14)


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError):
        Ball((0.0, 0.0), 1.0).distance(0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="b > a > 0"):
        Cassini((0.0, 0.0), 0.6, 0.5)
    with pytest.raises(ValueError, match="corners"):
        Slot((0.0, 0.0), 0.5, 0.9, 0.05)
