"""The immersed boundary method: δ, forces of a chain of markers, and a membrane at rest and in motion."""

import numpy as np
import pytest

from fsiwork.bodies.laws import Linear, Quadratic
from fsiwork.bodies.markers import Markers, outline
from fsiwork.core.edges import Edges, Side
from fsiwork.core.flow import Flow
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels.delta import collect, spread
from fsiwork.core.shapes import Ball, Ellipsoid
from fsiwork.simulate import step
from fsiwork.studies.twin import limit


def box(n=32, kind="no-slip", dim=2):
    grid = Grid((n,) * dim, 2 / n)
    return grid, Edges(grid, ((Side(kind),) * 2,) * dim)


def circle(m=100, radius=0.6, law=None, stretch=1.0, n=32):
    grid, edges = box(n)
    angle = 2 * np.pi * np.arange(m) / m
    X = 1.0 + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Markers(grid, edges, X, law or Quadratic(2.0), stretch), Flow(grid, edges, 1.0, 0.05)


@pytest.mark.parametrize("dim", [2, 3])
def test_delta_has_weight_one_and_its_two_uses_are_adjoint(dim):
    grid, _ = box(12, dim=dim)
    random = np.random.default_rng(2)
    X, f = random.uniform(0.5, 1.5, (7, dim)), random.normal(size=7)
    where = np.zeros(dim) + 0.5 * grid.h, grid.h, np.array(grid.n), np.array(grid.strides), GHOSTS
    q, seen = random.normal(size=grid.size), np.empty(7)
    spreaded = grid.field()
    spread(spreaded, X, f, *where)
    collect(seen, q, X, *where)
    assert spreaded.sum() * grid.cell_volume == pytest.approx(f.sum(), abs=1e-12)
    assert spreaded @ q * grid.cell_volume == pytest.approx(f @ seen, rel=1e-12)


def test_a_periodic_box_wraps_the_delta():
    grid, edges = box(16, "periodic")
    flow = Flow(grid, edges, 1.0, 0.05)
    angle = 2 * np.pi * np.arange(60) / 60
    X = np.stack([2.0 + 0.4 * np.cos(angle), 1.0 + 0.4 * np.sin(angle)], axis=1)
    Markers(grid, edges, X, Linear(1.0)).push(flow, 0.01)
    left, right = grid.inside(flow.force[0])[:8], grid.inside(flow.force[0])[8:]
    assert np.abs(left).max() > 0.1
    assert np.abs(right).max() > 0.1
    assert np.abs(flow.force[0]).sum() == pytest.approx(np.abs(grid.inside(flow.force[0])).sum())


def test_the_force_is_minus_the_gradient_of_the_energy():
    """The power of the force in any velocity is minus the rate of the energy of the markers that go with it."""
    body, flow = circle(m=31, stretch=1.3)
    random = np.random.default_rng(3)
    body.X += 0.02 * random.normal(size=body.X.shape)
    X, d, grid = body.X.copy(), 1e-6, flow.grid
    body.push(flow, 0.0)
    for c in grid.axes:
        flow.u[c][:] = random.normal(size=grid.size)
    power = sum(flow.force[c] @ flow.u[c] for c in grid.axes) * grid.cell_volume
    still, energies = Flow(grid, flow.edges, 1.0, 0.05), []
    for sign in (1, -1):
        body.X = X.copy()
        still.u = [sign * u for u in flow.u]
        body.move(still, d)
        energies.append(body.gauges(flow)["elastic_energy"])
    assert abs(power) > 0.1
    assert power == pytest.approx(-(energies[0] - energies[1]) / (2 * d), rel=1e-6)


def test_a_round_membrane_stays_and_carries_its_pressure():
    body, flow = circle(radius=0.5, stretch=1.2, n=48, law=Quadratic(1.0))
    for _ in range(150):
        step(flow, (body,), 0.01)
    inside, outside = flow.pressure()[24, 24], flow.pressure()[3, 3]
    assert inside - outside == pytest.approx(0.2 / 0.5, rel=0.02)  # T/R
    assert max(flow.largest(u) for u in flow.u) < 2e-3
    assert body.gauges(flow)["axis_x"] == pytest.approx(0.5, rel=2e-3)


def test_gauges_of_an_ellipse():
    shape = Ellipsoid((1.0, 1.0), (0.75, 0.5))
    X = outline(shape.distance, ((0.25, 1.75), (0.5, 1.5)), 0.02)
    assert np.abs(shape.distance(*X.T)).max() < 1e-10
    chords = np.linalg.norm(np.roll(X, -1, axis=0) - X, axis=1)
    assert chords.max() / chords.min() < 1.001
    grid, edges = box()
    found = Markers(grid, edges, X, Linear(1.0)).gauges(Flow(grid, edges, 1.0, 0.1))
    assert found["volume"] == pytest.approx(np.pi * 0.375, rel=1e-7)
    assert (found["axis_x"], found["axis_y"]) == pytest.approx((0.75, 0.5), rel=1e-7)
    assert found["length"] == pytest.approx(3.9663598973, rel=1e-3)


def test_what_cannot_be_marked_is_refused():
    grid, edges = box()
    with pytest.raises(ValueError, match="at least three markers"):
        Markers(grid, edges, np.zeros((2, 2)), Linear(1.0))
    with pytest.raises(ValueError, match="same place"):
        Markers(grid, edges, np.zeros((4, 2)), Linear(1.0))
    two = lambda x, y: np.minimum(Ball((0.5, 1.0), 0.2).distance(x, y), Ball((1.5, 1.0), 0.2).distance(x, y))  # noqa: E731
    with pytest.raises(ValueError, match="star-shaped"):
        outline(two, ((0.3, 1.7), (0.8, 1.2)), 0.1)


def test_a_state_goes_on_bit_for_bit():
    body, flow = circle(stretch=1.2)
    step(flow, (body,), 0.01)
    kept = body.state(), flow.state()
    step(flow, (body,), 0.01)
    X = body.X.copy()
    body.restore(kept[0])
    flow.restore(kept[1])
    step(flow, (body,), 0.01)
    assert np.array_equal(X, body.X)


def test_limit_of_a_sequence():
    assert limit([1.0 + 0.5**k for k in range(3)]) == pytest.approx(1.0)
    assert np.isnan(limit([1.0]))
