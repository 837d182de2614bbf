"""Variable viscosity by constant coefficients: exact profiles, the mixture's solution as Δt falls, any contrast."""

import numpy as np
import pytest
from test_flow import WALL, advance, divergence, flow_in
from test_mixture import INLET, PERIODIC, SLIP, disc, march, stirred

from fsiwork.core import energy
from fsiwork.core.edges import Side

LID = (WALL, Side("wall", (1.0, 0.0)))


@pytest.fixture
def lagged(monkeypatch):
    """Constant coefficients whatever the contrast; a number in place of infinity restores the choice."""
    monkeypatch.setattr("fsiwork.core.flow.LAGGED", np.inf)


def gap(one, two):
    return max(np.abs(one.grid.inside(u - v)).max() for u, v in zip(one.u, two.u, strict=True))


@pytest.mark.parametrize("diffusion", ["implicit", "backward-euler"])
@pytest.mark.parametrize("sides", [(WALL, WALL), (PERIODIC, SLIP), (WALL, LID)])
def test_a_uniform_viscosity_is_the_constant_one(sides, diffusion):
    one, two = (stirred((24, 24), sides, rho=1.5, mu=0.2, diffusion=diffusion) for _ in range(2))
    advance(one, 1e-4, 1)  # without divergence div 2μD(u) is μΔu
    two.restore(one.state())
    two.edges.fill_velocity(two.u, outflow=False)
    advance(one, 0.02, 10)
    march(two, 0.02, 10, mu=lambda x, y: 0.2 + 0 * x)
    assert gap(one, two) < 1e-12


@pytest.mark.usefixtures("lagged")
@pytest.mark.parametrize("contrast", [1e-2, 1.0, 1e2])
@pytest.mark.parametrize("diffusion", ["implicit", "backward-euler"])
def test_a_jet_of_another_viscosity_leaves_the_box(contrast, diffusion):
    """Open sides: it comes to rest, and what enters leaves."""
    flow = flow_in((24, 24), (INLET, WALL), mu=1.0, diffusion=diffusion)
    march(flow, 0.02, 400, mu=lambda x, y: np.where(abs(y - 0.5) < 0.2, contrast, 1.0) + 0 * x)
    before = flow.u[0].copy()
    march(flow, 0.02, 1, mu=lambda x, y: np.where(abs(y - 0.5) < 0.2, contrast, 1.0) + 0 * x)
    assert np.abs(flow.u[0] - before).max() < 1e-3
    flux = flow.grid.inside(flow.u[0], face=0).sum(axis=1)
    assert flux == pytest.approx(np.full(25, flux[0]), rel=1e-9)


def poiseuille(n):
    """Largest error of the flow that gravity drives between plates, 1/μ = 1 + .7 cos 2πy."""
    flow = flow_in((8, n), (PERIODIC, WALL), length=8 / n, gravity=(1.0, 0.0), mu=1.0)
    march(flow, 0.5, 200, mu=lambda x, y: 1 / (1 + 0.7 * np.cos(2 * np.pi * y)) + 0 * x)
    y, k = flow.grid.coordinate(1), 2 * np.pi
    exact = 0.5 * y * (1 - y) - 0.7 * ((y - 0.5) * np.sin(k * y) / k + (np.cos(k * y) - 1) / k**2)
    return np.abs(flow.grid.inside(flow.u[0]) - exact).max()


def test_a_steady_flow_has_order_two():
    errors = [poiseuille(n) for n in (16, 32, 64)]
    assert errors[0] < 2e-3
    assert np.log2(np.divide(errors[:-1], errors[1:])).min() > 1.9


def test_two_layers_between_plates_have_the_exact_broken_profile():
    flow = flow_in((8, 32), (PERIODIC, LID), length=0.25, mu=1.0, diffusion="backward-euler")
    march(flow, 0.1, 400, mu=lambda x, y: np.where(y < 0.5, 8.0, 1.0) + 0 * x)
    y, stress = flow.grid.coordinate(1), 1 / (0.5 / 8 + 0.5)
    resistance = np.where(y < 0.5, 1 / 8, 1.0) / 32  # of half a cell each side of its centre
    edges = 0.5 * (np.where(y < 0.5, 8.0, 1.0)[1:] + np.where(y < 0.5, 8.0, 1.0)[:-1])
    profile = np.cumsum(np.concatenate([[0.5 * resistance[0]], 1 / 32 / edges]))
    profile /= profile[-1] + 0.5 * resistance[-1]
    assert np.abs(flow.grid.inside(flow.u[0]) - profile).max() < 1e-10
    jump = np.where(y < 0.5, stress * y / 8, 1 - stress * (1 - y))
    assert np.abs(flow.grid.inside(flow.u[0]) - jump).max() < 0.02
    assert energy.power(flow) == pytest.approx(energy.dissipation(flow), rel=1e-8)


@pytest.mark.parametrize("diffusion", ["implicit", "backward-euler"])
@pytest.mark.parametrize("inside", [10.0, 0.1])
def test_steps_converge_to_the_mixture(inside, diffusion, monkeypatch):
    """A decaying flow around and in a disc, against the mixture at tiny steps: first order."""
    fields = {"mu": disc(inside, 1.0)}

    def ran(dt, most):
        monkeypatch.setattr("fsiwork.core.flow.LAGGED", most)
        flow = stirred((24, 24), (WALL, WALL), mu=1.0, diffusion=diffusion)
        march(flow, 1e-4, 1, **fields)
        march(flow, dt, round(0.004 / dt), **fields)
        return flow

    exact = ran(1e-5, 0.0)
    assert exact._mixed is not None
    errors = [gap(ran(dt, 10.5), exact) for dt in (2.5e-4, 1.25e-4, 6.25e-5)]
    assert errors[0] < 0.1
    assert np.divide(errors[:-1], errors[1:]).min() > 1.5


@pytest.mark.usefixtures("lagged")
@pytest.mark.parametrize("sides", [(WALL, WALL), (PERIODIC, SLIP), (PERIODIC, WALL), (PERIODIC, PERIODIC)])
@pytest.mark.parametrize("inside", [1e-4, 1e4])
@pytest.mark.parametrize("diffusion", ["implicit", "backward-euler"])
def test_no_contrast_and_no_step_gains_energy(sides, inside, diffusion):
    """Noise in a fluid that stays where it is, 1e-4 to 1e4 times the other's viscosity, Δt over six decades."""
    random = np.random.default_rng(0)
    for dt in (1e-4, 1e-1, 1e2):
        flow = flow_in((24, 24), sides, mu=1.0, advection="none", diffusion=diffusion)
        for c in (0, 1):
            flow.grid.inside(flow.u[c])[...] = random.standard_normal((24, 24))
        flow.edges.fill_velocity(flow.u)
        march(flow, 1e-9, 1, mu=disc(inside, 1.0))
        first = energy.kinetic_energy(flow)
        flow.p[:] = flow.before[:] = 0.0
        for _ in range(10):
            march(flow, dt, 10, mu=disc(inside, 1.0))
            assert energy.kinetic_energy(flow) <= 1.0001 * first
        assert flow._mixed is None
        assert divergence(flow) < 1e-9


@pytest.mark.usefixtures("lagged")
def test_an_extruded_flow_equals_the_one_in_two_directions():
    fields = {"mu": disc(10.0, 0.1)}
    flat = stirred((16, 16), (WALL, WALL), mu=0.1, gravity=(0.0, -1.0))
    deep = stirred((16, 16, 6), (WALL, WALL, PERIODIC), mu=0.1, gravity=(0.0, -1.0, 0.0))
    march(flat, 0.01, 10, **fields)
    march(deep, 0.01, 10, **fields)
    for a in (0, 1):
        u, v = flat.grid.inside(flat.u[a]), deep.grid.inside(deep.u[a])
        assert np.abs(v - u[..., None]).max() <= 1e-12 * np.abs(u).max()
    assert np.abs(deep.grid.inside(deep.u[2])).max() < 1e-13


@pytest.mark.parametrize(("contrast", "bending", "mixed"), [(9.9, 0.0, False), (10.1, 0.0, True), (1e3, 1e-9, False)])
def test_the_choice_is_by_contrast_and_bending(contrast, bending, mixed):
    flow = flow_in((8, 8), (WALL, WALL), mu=1.0)
    flow.begin()
    flow.mixture("mu")[: flow.grid.size // 2] = contrast
    flow.bending_stiffness = bending
    flow.predict(0.01)
    flow.project(0.01)
    assert (flow._mixed is not None) == mixed
