"""Variable density and viscosity: exact profiles, rest, balances, and drops over six decades of both ratios."""

from itertools import product

import numpy as np
import pytest
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu
from test_flow import WALL, advance, divergence, flow_in
from test_poisson import agree, bubble, variable_matrix

from fsiwork.bodies.laws import Linear
from fsiwork.bodies.membrane import Membrane
from fsiwork.core import energy, mixture
from fsiwork.core.edges import Side
from fsiwork.core.poisson import NotConverged, Variable
from fsiwork.core.shapes import Ball
from fsiwork.core.transport import Transport
from fsiwork.simulate import step

PERIODIC, SLIP = Side("periodic"), Side("free-slip")
RATIOS = (1e-3, 1.0, 1e3)


def immerse(flow, distance, inside, tension=1e-9, cells=3.0, **options):
    """A drop of another fluid in a box of square cells."""
    g, e = flow.grid, flow.edges
    carried = Transport(g, e, "weno5", "ssp-rk3", np.dtype(float))
    return Membrane(g, e, distance, Linear(tension), cells * g.h, transport=carried, inside=inside, **options)


def fill(flow, fields):
    """Set the slots rho and mu to functions of the coordinates."""
    for name, function in fields.items():
        q = flow.mixture(name)
        flow.grid.padded(q)[...] = function(*flow.grid.points())
        flow.edges.fill_scalar(q, "mirror")


def march(flow, dt, steps, **fields):
    """Steps with ρ and μ that stay where they are."""
    for _ in range(steps):
        flow.begin()
        fill(flow, fields)
        flow.predict(dt)
        flow.project(dt)


def disc(inside, outside, width=0.1):
    """A smooth jump across a circle."""
    return lambda x, y, *_: (
        inside + (outside - inside) / (1 + np.exp(-(np.hypot(x - 0.5, y - 0.45) - 0.25) / (width / 4)))
    )


def speed(flow):
    return max(flow.largest(u) for u in flow.u)


# --- the solver -----------------------------------------------------------------------------------------------
@pytest.mark.parametrize("ratio", [1e3, 1e-3])
@pytest.mark.parametrize("weight", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize(
    "n, ends",
    [
        ((47, 48), [("node", "node"), ("dirichlet", "dirichlet")]),
        ((33, 40), [("node", "neumann"), ("neumann", "dirichlet")]),
        ((40, 31), [("periodic", "periodic"), ("node", "node")]),
        ((32, 30), [("periodic", "periodic")] * 2),
        ((12, 9, 11), [("dirichlet", "dirichlet"), ("node", "node"), ("periodic", "periodic")]),
        ((10, 3, 12), [("neumann", "neumann")] * 3),
    ],
)
def test_a_diagonal_in_the_solver_is_the_sparse_solve(n, ends, weight, ratio):
    rng, h = np.random.default_rng(1), 1 / max(n)
    beta = [weight * b for b in bubble(n, ratio, [pair[0] == "periodic" for pair in ends])]
    diagonal = np.where(rng.random(n) < 0.5, 1.0, ratio)
    f = rng.standard_normal(n)
    solver = Variable(n, h, ends, rtol=1e-12, diagonal=True)
    q = solver.solve(beta, f, None, diagonal)
    matrix = variable_matrix(beta, ends, h) + diags_array(diagonal.ravel())
    assert agree(q, splu(matrix.tocsc()).solve(f.ravel()).reshape(n), 1e-6)  # nearly singular without a held end
    round_off = 1e-15 * abs(matrix).sum(axis=0).max() * np.linalg.norm(q)
    assert np.linalg.norm(f.ravel() - matrix @ q.ravel()) < 1e-10 * np.linalg.norm(f) + round_off
    assert solver.iterations <= 45


def test_a_diagonal_is_given_if_and_only_if_it_was_announced():
    ends, ones = [("node", "node")] * 2, np.ones((8, 8))
    faces = [np.ones((9, 8)), np.ones((8, 9))]
    for announced, diagonal in ((True, None), (False, ones), (True, np.ones((8, 9)))):
        with pytest.raises(ValueError, match="announced"):
            Variable((8, 8), 0.1, ends, diagonal=announced).solve(faces, ones, None, diagonal)


def test_a_viscous_increment_that_misses_its_tolerance_says_so():
    flow = flow_in((16, 16), (WALL, WALL), gravity=(0.0, -1.0))
    march(flow, 0.1, 1, mu=disc(10.0, 0.1), rho=disc(0.1, 1.0))
    flow._mixed._components[1].solver.most = 1
    flow.u[0][:] = flow.grid.sample(lambda x, y: np.sin(np.pi * x) * y, 0)
    with pytest.raises(NotConverged, match=r"^viscous increment of velocity component 1: .* wanted 1.0e-08$"):
        march(flow, 0.1, 1, mu=disc(10.0, 0.1), rho=disc(0.1, 1.0))


# --- exact flows ----------------------------------------------------------------------------------------------
def couette(n, jump=100.0):
    """Between plates at y = 0 and y = 1 that moves; the lower half is ``jump`` times more viscous."""
    flow = flow_in((n, n), (PERIODIC, (WALL, Side("wall", (1.0, 0.0)))), mu=1.0)
    layer = immerse(flow, lambda x, y: y - 0.5 + 0 * x, (1.0, jump), cells=1.5)
    for _ in range(40):
        step(flow, (layer,), 1.0)
    return flow


def test_two_layers_between_plates_have_the_exact_broken_profile():
    """To round-off with the smeared μ, to O(ε) with a jump; Δt is 10⁵ times the explicit limit."""
    errors = []
    for n in (32, 64):
        flow = couette(n)
        g, y = flow.grid, flow.grid.coordinate(1)
        u = g.inside(flow.u[0])
        mu = g.padded(flow.mu)[5, 2:-2]
        resistance = 1 / (0.5 * (mu[1:] + mu[:-1]))
        resistance[[0, -1]] *= 0.5
        profile = np.cumsum(resistance)[:-1] / resistance.sum()
        assert np.abs(u - profile).max() < 1e-8
        stress = 1 / (0.5 / 100 + 0.5)
        jump = np.where(y < 0.5, stress * y / 100, 1 - stress * (1 - y))
        errors.append(np.abs(u - jump).max())
        assert energy.power(flow) == pytest.approx(energy.dissipation(flow), rel=1e-8)
    assert errors[1] < 0.55 * errors[0] < 0.05


@pytest.mark.parametrize("sides", [(PERIODIC, WALL), (SLIP, WALL), (WALL, WALL)])
def test_a_heavy_fluid_below_a_light_one_stays_at_rest(sides):
    """Density ratio 1000: well-balanced, the largest velocity in 50 steps is 6e-15."""
    flow = flow_in((32, 32), sides, mu=0.01, gravity=(0.0, -1.0))
    layer = immerse(flow, lambda x, y: y - 0.5 + 0 * x, (1000.0, 1.0))
    fastest = 0.0
    for _ in range(50):
        step(flow, (layer,), 0.01)
        fastest = max(fastest, speed(flow))
    assert fastest < 1e-12
    p = flow.pressure()
    assert p[:, 0].mean() - p[:, -1].mean() == pytest.approx(1000 * 0.5 + 0.5, rel=0.05)  # half a cell short of both


@pytest.mark.parametrize("ratio", RATIOS)
def test_a_drop_at_rest_has_the_pressure_of_its_tension(ratio):
    """Parasitic currents ≤ 1e-3 and λ/R within 3 % (measured 3.3e-4 and 2.3 % at 8 cells a radius)."""
    flow = flow_in((32, 32), (WALL, WALL), mu=0.1)
    drop = immerse(flow, Ball((0.5, 0.5), 0.25).distance, (ratio, 1.0), tension=1.0)
    dt, fastest = 0.5 * min(drop.longest_step(flow).values()), 0.0
    for _ in range(100):
        step(flow, (drop,), dt)
        fastest = max(fastest, speed(flow))
    p, phi = flow.pressure(), flow.grid.inside(drop.phi)
    assert fastest <= 1e-3
    assert p[phi < -drop.eps].mean() - p[phi > drop.eps].mean() == pytest.approx(1.0 / 0.25, rel=0.03)


# --- the equations --------------------------------------------------------------------------------------------
def stirred(n, sides, **options):
    flow = flow_in(n, sides, **options)
    wave = 2 * np.pi / flow.grid.length[0]
    flow.u[0][:] = np.broadcast_to(
        np.sin(wave * flow.grid.points(0)[0]) ** 2 * np.sin(2 * wave * flow.grid.points(0)[1]), flow.grid.shape
    ).ravel()
    flow.edges.fill_velocity(flow.u)
    return flow


INLET = (Side("inflow", (1.0, 0.0), "parabolic"), Side("outflow"))


@pytest.mark.parametrize(
    "sides", [(WALL, WALL), (PERIODIC, SLIP), (WALL, (WALL, Side("wall", (1.0, 0.0)))), (INLET, WALL)]
)
@pytest.mark.parametrize("names", [("mu",), ("rho", "mu")])
def test_a_uniform_mixture_is_the_constant_fluid(sides, names, monkeypatch):
    """Backward Euler. With the Laplacian's normal part both are the same scheme, whatever Δt; with the true one of
    div 2μD (twice it) they differ by the step's own error."""
    fields = {"mu": lambda x, y: 0.2 + 0 * x, "rho": lambda x, y: 1.5 + 0 * x}
    monkeypatch.setattr("fsiwork.core.flow.LINES_UP_TO", 0.0)  # no factorisation
    monkeypatch.setattr("fsiwork.core.flow.LAGGED", 0.0)  # the mixture with μ alone, too
    ends = []
    for normal, dt in ((1.0, 0.02), (2.0, 0.004), (2.0, 0.002)):
        monkeypatch.setattr(mixture, "NORMAL", normal)
        one, two = (stirred((24, 24), sides, rho=1.5, mu=0.2, diffusion="backward-euler") for _ in range(2))
        advance(one, 1e-4, 1)  # without divergence div 2μD(u) is μΔu
        two.restore(one.state())
        two.edges.fill_velocity(two.u, outflow=False)
        steps = round(0.08 / dt)
        advance(one, dt, steps)
        march(two, dt, steps, **{name: fields[name] for name in names})
        ends.append(max(np.abs(one.grid.inside(u - v)).max() for u, v in zip(one.u, two.u, strict=True)))
    assert ends[0] < (1e-3 if sides[0] == INLET else 1e-7)  # the traction on an outflow has μ∂_y u, too
    assert ends[2] < 0.7 * ends[1] < 0.05


def test_momentum_is_kept_and_dissipation_balances_the_energy():
    """Periodic Stokes flow, ρ over 1000 and μ over 100: a fluid that stays where it is."""
    fields = {"rho": disc(1000.0, 1.0), "mu": disc(100.0, 1.0)}
    flow = stirred((32, 32), (PERIODIC, PERIODIC), mu=1.0, advection="none")
    march(flow, 1e-4, 1, **fields)  # divergence-free

    def momentum():
        g = flow.grid
        return sum((g.inside(flow.u[0]) / g.inside(flow._mixed.beta[0])).ravel()) * g.cell_volume

    m, rate, k = momentum(), energy.dissipation(flow), energy.kinetic_energy(flow)
    work = 0.0
    for _ in range(20):
        march(flow, 1e-4, 1, **fields)
        work += 0.5e-4 * (rate + energy.dissipation(flow))
        rate = energy.dissipation(flow)
    assert momentum() == pytest.approx(m, rel=1e-7)
    assert work > 0.05 * k
    assert k - energy.kinetic_energy(flow) == pytest.approx(work, rel=0.03)


def test_an_extruded_mixture_equals_the_one_in_two_directions():
    fields = {"rho": disc(0.01, 1.0), "mu": disc(10.0, 0.1)}
    flat = stirred((16, 16), (WALL, WALL), mu=0.1, gravity=(0.0, -1.0))
    deep = stirred((16, 16, 6), (WALL, WALL, PERIODIC), mu=0.1, gravity=(0.0, -1.0, 0.0))
    march(flat, 0.01, 10, **fields)
    march(deep, 0.01, 10, **fields)
    for a in (0, 1):
        u, v = flat.grid.inside(flat.u[a]), deep.grid.inside(deep.u[a])
        assert np.abs(v - u[..., None]).max() <= 1e-6 * np.abs(u).max()
    assert np.abs(deep.grid.inside(deep.u[2])).max() < 1e-9


def test_no_direction_is_preferred():
    """A drop in a cube falls alike along every axis."""
    falls = []
    for a in range(3):
        down = [-1.0 if b == a else 0.0 for b in range(3)]
        flow = flow_in((14, 14, 14), (WALL, WALL, WALL), mu=0.1, gravity=down)
        drop = immerse(flow, Ball((0.5, 0.5, 0.5), 0.25).distance, (1000.0, 10.0))
        for _ in range(3):
            step(flow, (drop,), 0.02)
        falls.append([np.moveaxis(flow.grid.inside(flow.u[b]), a, 0) for b in (a, (a + 1) % 3)])
    for main, aside in falls[1:]:
        assert np.abs(main - falls[0][0]).max() <= 1e-6 * np.abs(main).max()
        assert np.abs(aside).max() == pytest.approx(np.abs(falls[0][1]).max(), rel=1e-5)


# --- drops ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("density, viscosity, fluid", list(product(RATIOS, RATIOS, (1e-2, 10.0))))
def test_a_drop_rises_or_falls_at_any_ratio(density, viscosity, fluid):
    """|u| ≤ 3 g t: nothing falls faster than g t, and what it displaces passes it through a gap of its own width;
    Δt = .01 is up to 4·10⁷ times the explicit viscous limit h²ρ/4μ."""
    flow = flow_in((32, 32), (SLIP, WALL), mu=fluid, gravity=(0.0, -1.0))
    drop = immerse(flow, Ball((0.5, 0.5), 0.25).distance, (density, viscosity * fluid))
    for k in range(20):
        step(flow, (drop,), 0.01)
        assert speed(flow) <= 3.0 * 0.01 * (k + 1)
    assert divergence(flow) <= 1e-9
    rises = flow.grid.inside(flow.u[1])[flow.grid.inside(drop.phi) < 0].mean()
    if density != 1.0:
        assert np.sign(rises) == np.sign(1.0 - density)


@pytest.mark.parametrize("coupling", ["stabilised", "iterated"])
@pytest.mark.parametrize("density", [1e-3, 1e3])
def test_the_stabiliser_serves_mixtures(coupling, density):
    """An ellipse relaxes with ten times the explicit limit: slower, never faster than the tension allows."""
    flow = flow_in((32, 32), (WALL, WALL), mu=0.05)
    stretch = Ball((0.0, 0.0), 0.25).distance
    drop = immerse(
        flow, lambda x, y: stretch((x - 0.5) / 1.2, (y - 0.5) * 1.2), (density, 0.05), tension=1.0, coupling=coupling
    )
    dt = 10.0 * min(drop.explicit_limits(flow).values())
    before = drop.gauges(flow)["elastic_energy"]
    for _ in range(20):
        step(flow, (drop,), dt)
        stored = drop.gauges(flow)["elastic_energy"]
        assert energy.kinetic_energy(flow) + stored <= 1.01 * before
