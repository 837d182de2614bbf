"""The flow solver: exact solutions, orders as slopes, identities, and two against three directions."""

import numpy as np
import pytest

from fsiwork.core import energy
from fsiwork.core.edges import Edges, Side
from fsiwork.core.flow import Flow
from fsiwork.core.grid import Grid

WALL = Side("no-slip")


def flow_in(n, sides, rho=1.0, mu=0.1, length=1.0, **options):
    grid = Grid(n, length / n[0])
    pairs = tuple(pair if isinstance(pair, tuple) else (pair, pair) for pair in sides)
    return Flow(grid, Edges(grid, pairs), rho, mu, **options)


def advance(flow, dt, steps):
    for _ in range(steps):
        flow.begin()
        flow.predict(dt)
        flow.project(dt)


def divergence(flow):
    g = flow.grid
    total = sum(np.diff(g.inside(flow.u[a], face=a), axis=a) for a in g.axes)
    return np.abs(total).max() / g.h


def vortices(n, dt, end, side="periodic", nu=0.1, **options):
    """Largest errors of u and p of decaying vortices u = sin x cos y on [0, 2π]²."""
    flow = flow_in((n, n), (Side(side), Side(side)), mu=nu, length=2 * np.pi, **options)
    g = flow.grid

    def exact(t):
        fade = np.exp(-2 * nu * t)
        return (
            g.sample(lambda x, y: fade * np.sin(x) * np.cos(y), 0),
            g.sample(lambda x, y: -fade * np.cos(x) * np.sin(y), 1),
            g.sample(lambda x, y: fade**2 * (np.cos(2 * x) + np.cos(2 * y)) / 4),
        )

    flow.u[0][:], flow.u[1][:] = exact(0.0)[:2]
    flow.edges.fill_velocity(flow.u)
    steps = round(end / dt)
    advance(flow, dt, steps)
    u, _, p = exact(steps * dt)
    return np.abs(g.inside(flow.u[0] - u)).max(), np.abs(flow.pressure() - g.inside(p)).max(), divergence(flow)


@pytest.mark.parametrize("side", ["periodic", "free-slip"])
@pytest.mark.parametrize("options", [{}, {"diffusion": "explicit", "advection": "central"}])
def test_vortices_converge_with_order_two(side, options):
    errors = np.array([vortices(n, 0.064 / n, 0.25, side, **options) for n in (32, 64, 128)])
    slopes = np.log2(errors[:-1] / errors[1:])[:, :2]
    assert slopes.min() > 1.9
    assert errors[:, 2].max() < 1e-12


def test_velocity_and_pressure_between_walls_converge_with_order_two_in_time():
    def cavity():
        return flow_in((24, 24), (WALL, (WALL, Side("wall", (1.0, 0.0)))), mu=0.02)

    begun = cavity()
    advance(begun, 0.0005, 400)  # past the jump of the lid at t = 0

    def run(steps):
        flow = cavity()
        flow.restore(begun.state())
        flow.edges.fill_velocity(flow.u)
        advance(flow, 0.5 / steps, steps)
        return np.concatenate([flow.grid.inside(flow.u[0]), flow.pressure()])

    finest = run(1280)
    errors = np.array([np.abs(run(steps) - finest).max() for steps in (20, 40, 80)])
    assert np.log2(errors[:-1] / errors[1:]).min() > 1.9


def test_flow_between_moving_walls_is_linear_and_takes_the_power_it_dissipates():
    flow = flow_in(
        (16, 16), (Side("periodic"), (Side("wall", (-1.0, 0.0)), Side("wall", (1.0, 0.0)))), mu=1.0, advection="central"
    )
    advance(flow, 0.02, 400)
    y = flow.grid.coordinate(1)
    assert np.abs(flow.grid.inside(flow.u[0]) - (2 * y - 1)).max() < 1e-10
    assert energy.power(flow) == pytest.approx(4.0, rel=1e-10)  # μ (∂u/∂y)² per area
    assert energy.dissipation(flow) == pytest.approx(4.0, rel=1e-10)


def test_channel_from_inflow_to_outflow_is_a_parabola():
    inlet = Side("inflow", (1.0, 0.0), "parabolic")
    flow = flow_in((48, 16), ((inlet, Side("outflow")), WALL), mu=0.1, length=3.0)
    advance(flow, 0.01, 600)
    g, y = flow.grid, flow.grid.coordinate(1)
    error = np.abs(g.inside(flow.u[0], face=0) - 4 * y * (1 - y)).max()
    assert error < 0.01  # the discrete parabola at the walls: O(Δx²)
    assert divergence(flow) < 1e-11
    slope = np.diff(g.inside(flow.p).mean(1))[16:32] / g.h
    assert slope == pytest.approx(-0.8, rel=0.02)  # μ u''


@pytest.mark.parametrize("options", [{}, {"advection": "central", "diffusion": "explicit"}])
def test_an_extruded_flow_equals_the_flow_in_two_directions(options):
    def start(x, y, *_):
        return np.sin(2 * np.pi * x) ** 2 * np.sin(4 * np.pi * y)

    flat = flow_in((16, 16), (WALL, WALL), mu=0.01, **options)
    deep = flow_in((16, 16, 6), (WALL, WALL, Side("periodic")), mu=0.01, **options)
    for flow in (flat, deep):
        shape = flow.grid.shape
        flow.u[0][:] = np.broadcast_to(start(*flow.grid.points(0)), shape).ravel()
        flow.edges.fill_velocity(flow.u)
        advance(flow, 0.01, 20)
    for a in (0, 1):
        u, v = flat.grid.inside(flat.u[a]), deep.grid.inside(deep.u[a])
        assert np.abs(v - u[..., None]).max() <= 1e-12 * np.abs(u).max()
    assert np.abs(deep.grid.inside(deep.u[2])).max() < 1e-13


@pytest.mark.parametrize("name", ["upwind5", "central"])
def test_the_momentum_kernels_of_an_extruded_field_agree_bit_for_bit_but_for_rounding(name):
    random = np.random.default_rng(1)
    flat = flow_in((8, 8), (Side("periodic"), Side("periodic")), advection=name)
    deep = flow_in((8, 8, 8), (Side("periodic"),) * 3, advection=name)
    for a in (0, 1):
        flat.grid.inside(flat.u[a])[...] = random.standard_normal((8, 8))
        deep.grid.inside(deep.u[a])[...] = flat.grid.inside(flat.u[a])[..., None]
    for flow in (flat, deep):
        flow.edges.fill_velocity(flow.u)
        flow._explicit_part(0, 0.1, increment=False)
    u, v = flat.grid.inside(flat._star[0]), deep.grid.inside(deep._star[0])
    assert np.abs(v - u[..., None]).max() <= 8 * np.finfo(float).eps * np.abs(u).max()


def test_central_advection_equals_its_formula():
    flow = flow_in((8, 8), (Side("periodic"), Side("periodic")), advection="central", mu=0.0)
    random, g = np.random.default_rng(2), flow.grid
    for a in (0, 1):
        g.inside(flow.u[a])[...] = random.standard_normal((8, 8))
    flow.edges.fill_velocity(flow.u)
    flow._explicit_part(0, 1.0, increment=True)
    u, v = (g.inside(q) for q in flow.u)
    uc, vn = 0.5 * (u + np.roll(u, -1, 0)), 0.5 * (v + np.roll(v, 1, 0))
    un = 0.5 * (u + np.roll(u, 1, 1))
    expected = -((uc**2 - np.roll(uc**2, 1, 0)) + (np.roll(un * vn, -1, 1) - un * vn)) / g.h
    assert g.inside(flow._star[0]) == pytest.approx(expected, abs=1e-11)


def test_kinetic_energy_of_an_inviscid_periodic_flow_is_kept():
    flow = flow_in((32, 32), (Side("periodic"), Side("periodic")), mu=0.0, advection="central", length=2 * np.pi)
    g = flow.grid
    flow.u[0][:] = g.sample(lambda x, y: np.sin(x) * np.cos(2 * y), 0)
    flow.u[1][:] = g.sample(lambda x, y: np.cos(3 * x) + 0 * y, 1)
    flow.edges.fill_velocity(flow.u)
    advance(flow, 0.002, 1)
    before = energy.kinetic_energy(flow)
    advance(flow, 0.002, 200)
    assert energy.kinetic_energy(flow) == pytest.approx(before, rel=2e-5)


def test_dissipation_balances_the_loss_of_kinetic_energy():
    flow = flow_in((32, 32), (WALL, WALL), mu=0.05, advection="central")
    flow.u[0][:] = flow.grid.sample(lambda x, y: np.sin(np.pi * x) ** 2 * np.sin(2 * np.pi * y), 0)
    flow.edges.fill_velocity(flow.u)
    advance(flow, 5e-4, 20)
    k0, d0 = energy.kinetic_energy(flow), energy.dissipation(flow)
    advance(flow, 5e-4, 20)
    lost = k0 - energy.kinetic_energy(flow)
    assert lost == pytest.approx(0.01 * 0.5 * (d0 + energy.dissipation(flow)), rel=2e-2)


def test_a_kept_state_continues_bit_for_bit():
    flow = flow_in((16, 16), (WALL, (WALL, Side("wall", (1.0, 0.0)))), mu=0.01)
    advance(flow, 0.01, 7)
    kept = flow.state()
    advance(flow, 0.01, 5)
    expected = [u.copy() for u in flow.u]
    again = flow_in((16, 16), (WALL, (WALL, Side("wall", (1.0, 0.0)))), mu=0.01)
    again.restore(kept)
    advance(again, 0.01, 5)
    for a in (0, 1):
        assert np.array_equal(again.grid.inside(again.u[a]), flow.grid.inside(expected[a]))


def test_a_nan_is_never_the_smaller_one():
    flow = flow_in((8, 8), (WALL, WALL))
    flow.grid.inside(flow.u[0])[3, 4] = np.nan
    assert np.isnan(flow.largest(flow.u[0]))
    flow.grid.inside(flow.u[1])[3, 4] = -np.inf
    assert flow.largest(flow.u[1]) == np.inf


def test_a_sampled_field_may_be_written():
    """Also when the function gives the full shape itself."""
    grid = Grid((6, 5), 0.2)
    q = grid.sample(lambda x, y: x + y)
    q += 1.0
    assert q.reshape(grid.shape)[3, 3] == pytest.approx(1.0 + 0.1 + 0.1)
