"""Markers: the line between them, splits and joins, stretching, orders, exact lines, what is refused."""

import math

import numpy as np
import pytest

from fsiwork.core.markers import Line, carry, circle
from fsiwork.studies import markers
from fsiwork.studies.exact import ellipse_perimeter, stretched_blob
from fsiwork.studies.orders import slope


def ellipse(count, slopes, jitter=0.0):
    theta = (np.arange(count) + jitter * np.random.default_rng(3).random(count)) / count
    angle = 2 * np.pi * theta
    x = np.stack([1.5 * np.cos(angle), 0.75 * np.sin(angle)])
    return Line(theta, x, 2 * np.pi * np.stack([-2 * x[1], x[0] / 2]) if slopes else None)


@pytest.mark.parametrize("slopes", [True, False])
def test_line_between_uneven_markers_is_of_order_eight(slopes):
    counts, errors = np.array([24, 48, 96]), []
    for count in counts:
        line = ellipse(count, slopes, 0.5)
        x, _ = line.at(0.5)
        errors.append(np.abs((x[0] / 1.5) ** 2 + (x[1] / 0.75) ** 2 - 1).max())
    assert slope(1 / counts, errors) > 7.5


@pytest.mark.parametrize("slopes", [True, False])
def test_length_and_area_of_an_ellipse(slopes):
    length, area = ellipse(128, slopes, 0.4).length_and_area()
    assert length == pytest.approx(ellipse_perimeter(1.5, 0.75), rel=1e-9)
    assert area == pytest.approx(math.pi * 1.5 * 0.75, rel=1e-9)


def test_the_tangent_by_differences_is_the_carried_one():
    assert ellipse(96, False).tangent() == pytest.approx(ellipse(96, True).slope, abs=1e-6)


@pytest.mark.parametrize("slopes", [True, False])
def test_splitting_keeps_the_line_and_obeys_both_limits(slopes):
    line = ellipse(32, slopes)
    fine = line.split(0.02, 0.05)
    assert fine.chords().max() <= 0.02
    assert fine.turns().max() <= 0.05
    assert (np.diff(fine.theta) > 0).all()
    assert fine.length_and_area() == pytest.approx(line.length_and_area(), rel=1e-6)
    assert set(line.theta) <= set(fine.theta)


def test_joining_undoes_what_is_short_and_no_more():
    line = ellipse(512, True)
    less = line.join(0.1).join(0.1)
    assert less.theta.size == 128
    assert less.chords().max() < 0.1
    assert less.theta[0] == line.theta[0]
    assert less.length_and_area() == pytest.approx(line.length_and_area(), rel=1e-9)
    assert line.join(0.02, sharpest=1e-9).theta.size == 512
    assert line.split(0.05).join(0.025).theta.size <= line.theta.size


def test_joining_stops_at_eight_markers():
    line = ellipse(20, True)
    for _ in range(5):
        line = line.join(1e9)
    assert line.theta.size >= 8


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_a_strain_stretches_as_it_must(scale):
    """u = (x, -y): X = (e^t x, e^-t y), whatever the unit of length."""
    line = circle((0.0, 0.0), scale, 64)
    first = np.hypot(*line.slope)
    for k in range(40):
        line = carry(line, lambda x, t: x * [[1], [-1]], 0.025 * k, 0.025, lambda x, t: np.diag([1.0, -1.0])[..., None])
    angle = 2 * np.pi * line.theta
    assert line.x == pytest.approx(scale * np.stack([np.e * np.cos(angle), np.sin(angle) / np.e]), rel=1e-7)
    exact = np.hypot(np.e * np.sin(angle), np.cos(angle) / np.e)
    assert np.hypot(*line.slope) / first == pytest.approx(exact, rel=1e-7)
    assert line.split(0.1 * scale).length_and_area()[1] == pytest.approx(np.pi * scale**2, rel=1e-6)


def test_a_time_dependent_velocity_is_of_order_four():
    steps, errors = np.array([8, 16, 32]), []
    for n in steps:
        line = circle((0.0, 0.0), 1.0, 16, slopes=False)
        for k in range(n):
            line = carry(line, lambda x, t: np.cos(3 * t) * x, k / n, 1 / n)
        errors.append(np.abs(np.hypot(*line.x) - np.exp(np.sin(3) / 3)).max())
    assert slope(1 / steps, errors) > 3.8


@pytest.mark.parametrize("slopes", [True, False])
def test_splits_on_the_way_out_and_joins_on_the_way_back_keep_the_circle(slopes):
    line, gradient, most = circle(markers.CENTRE, 0.15, 64, slopes), markers.gradient if slopes else None, 0
    for k in range(400):
        forth = k < 200
        sign = 1 if forth else -1
        slope_of = gradient and (lambda x, t, sign=sign: sign * gradient(x))
        line = carry(line, lambda x, t, sign=sign: sign * markers.velocity(x), 0.0, 0.01, slope_of)
        line = line.split(0.02, 0.3) if forth else line.join(0.02, 0.3)
        most = max(most, line.theta.size)
    angle = 2 * np.pi * line.theta
    away = line.x - 0.15 * np.stack([np.cos(angle), np.sin(angle)]) - np.reshape(markers.CENTRE, (2, 1))
    assert np.abs(away).max() < 0.15e-5
    assert line.theta.size < 0.5 * most


def test_the_gradient_is_that_of_the_velocity():
    x, h = np.random.default_rng(1).random((2, 50)), 1e-5
    for j in range(2):
        step = h * np.eye(2)[:, j : j + 1]
        found = (markers.velocity(x + step) - markers.velocity(x - step)) / (2 * h)
        assert markers.gradient(x)[:, j] == pytest.approx(found, abs=1e-8)


@pytest.mark.parametrize("tangents", ["carried", "differences"])
def test_coarse_markers_follow_the_solver(tangents):
    found = markers.carried(None, {"longest": 0.02, "tangents": tangents})
    assert found["position_error"] < 1e-6
    assert found["stretching_error"] < 1e-5
    assert abs(found["area_error"]) < 1e-7


def test_the_blob_has_its_length():
    lines = stretched_blob((1.0, 2.0), 0.02)
    assert [line.length_and_area()[0] for line in lines] == pytest.approx(markers.LENGTHS[:2], abs=1e-5)


def test_a_kink_ends_the_splitting():
    angle = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    radius = 1 / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
    square = Line(angle / (2 * np.pi), radius * np.stack([np.cos(angle), np.sin(angle)]))
    fine = square.split(0.5, 0.2)
    assert np.isfinite(fine.x).all()
    assert fine.chords().max() <= 0.5


def test_what_is_refused():
    line = circle((0.0, 0.0), 1.0, 16)
    with pytest.raises(ValueError, match="at least 8"):
        circle((0.0, 0.0), 1.0, 7)
    with pytest.raises(ValueError, match="increase"):
        Line(line.theta[::-1], line.x)
    with pytest.raises(ValueError, match="gradient"):
        carry(line, lambda x, t: x, 0.0, 0.1)
    with pytest.raises(ValueError, match="positive"):
        line.split(0.0)
    with pytest.raises(ValueError, match="more than 1000000 markers"):
        line.split(1e-6)
    broken = Line(line.theta, np.where(line.theta == 0.5, np.nan, line.x))
    with pytest.raises(ValueError, match="2 segments of the line are not finite"):
        broken.split(0.1)
