"""A membrane with shear: energy and its gradient, power of the force, invariants, a sphere at rest and in motion."""

from pathlib import Path

import numpy as np
import pytest

from fsiwork.bodies.shear import LAWS, SKIN, ShearMembrane
from fsiwork.core import energy
from fsiwork.core.edges import Edges, Side
from fsiwork.core.flow import Flow
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.invariants import area_and_shear, map_gradient
from fsiwork.core.kernels import shear_points as points
from fsiwork.core.kernels import shear_survey as surveys
from fsiwork.scene import SceneError, load, loads
from fsiwork.simulate import Simulation, step

ORIGIN = (-1.0, -1.0, -1.0)
SCENE = Path(__file__).resolve().parents[1] / "configs" / "scenes" / "sheared_sphere.yaml"


def sphere(n=16, law="quadratic", kind="no-slip", eps=0.3, radius=0.5, **more):
    grid = Grid((n,) * 3, 2 / n, ORIGIN)
    edges = Edges(grid, ((Side(kind),) * 2,) * 3)
    body = ShearMembrane(
        grid, edges, (0.0, 0.0, 0.0), radius, law, 1.3 if law != "neo-hookean" else 0.0, 0.7, eps, **more
    )
    return body, Flow(grid, edges, 1.0, 0.01)


def stored(body):
    body._fresh = False
    return float(body.survey()[surveys.ENERGY])


@pytest.mark.parametrize("law", sorted(LAWS))
def test_slopes_of_the_laws(law):
    d, at = 1e-5, (1.2, 1.4)
    E, *slopes = points.energy(LAWS[law], 1.3, 0.7, *at)
    for a, (first, second) in enumerate(((0, 2), (1, 3))):
        high, low = (
            points.energy(LAWS[law], 1.3, 0.7, *(z + s * d * (a == k) for k, z in enumerate(at))) for s in (1, -1)
        )
        assert slopes[first] == pytest.approx((high[0] - low[0]) / (2 * d), rel=1e-7)
        assert slopes[second] == pytest.approx((high[0] - 2 * E + low[0]) / d**2, rel=1e-3, abs=1e-4)
    assert points.energy(LAWS[law], 1.3, 0.7, 1.0, 1.0)[0] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("law", sorted(LAWS))
def test_the_gradient_is_that_of_the_discrete_energy(law):
    body, _ = sphere(14, law, eps=0.2, twist=1.5, inflation=1.1, volume=2.0, slip=0.5)
    random = np.random.default_rng(1)
    for Y in body.map.Y:
        Y += 0.02 * random.normal(size=Y.size)
    body._fresh = False
    g = [q.copy() for q in body.gradient()]
    along = [random.normal(size=Y.size) for Y in body.map.Y]
    start = [Y.copy() for Y in body.map.Y]
    energies = {}
    for d in (-1e-6, 1e-6):
        for Y, Y0, v in zip(body.map.Y, start, along, strict=True):
            Y[:] = Y0 + d * v
        energies[d] = stored(body)
    rate = body.grid.cell_volume * sum(float(q @ v) for q, v in zip(g, along, strict=True))
    assert abs(rate) > 0.1
    assert rate == pytest.approx((energies[1e-6] - energies[-1e-6]) / 2e-6, rel=1e-6)


def test_the_power_of_the_force_is_what_the_energy_loses():
    body, flow = sphere(16, kind="periodic")
    grid, random = body.grid, np.random.default_rng(2)
    for k, Y in enumerate(body.map.Y):
        Y += grid.sample(lambda x, y, z, k=k: 0.05 * np.sin(np.pi * (x + 2 * y - z) + k))
    body._fresh = False
    for c in grid.axes:
        grid.inside(flow.u[c])[...] = random.normal(size=grid.n)
    flow.edges.fill_velocity(flow.u)
    body.push(flow, 0.0)
    power = grid.cell_volume * sum(
        float((grid.inside(flow.force[c]) * grid.inside(flow.u[c])).sum()) for c in grid.axes
    )
    before, d, energies = body.state(), 1e-5, [stored(body)]
    for k in (1, 2):
        body.restore(before)
        body.move(flow, k * d)
        energies.append(stored(body))
    rate = (-3 * energies[0] + 4 * energies[1] - energies[2]) / (2 * d)
    assert abs(power) > 0.01
    assert power == pytest.approx(-rate, rel=1e-6)


def test_invariants_are_those_of_the_continuum():
    """Z₁ and Z₂ of an affine map, by the kernels and by `core.invariants`."""
    body, _ = sphere(12)
    M = np.array([[1.1, 0.3, -0.2], [0.1, 0.8, 0.25], [-0.15, 0.05, 1.2]])
    grid, x = body.grid, body.grid.points()
    for Y, row in zip(body.map.Y, M, strict=True):
        grid.padded(Y)[...] = sum(m * q for m, q in zip(row, x, strict=True))
    body._fresh = False
    values = body.survey()
    nodes = np.stack(np.meshgrid(*[grid.coordinate(a) - 0.5 * grid.h for a in grid.axes], indexing="ij"), -1)
    place = nodes.reshape(-1, 3) @ M.T
    distance = np.linalg.norm(place, axis=1)
    near = np.abs(distance - 0.5) < 0.3
    Z1, Z2 = area_and_shear(np.broadcast_to(M, (near.sum(), 3, 3)), place[near] / distance[near, None])
    found = values[[surveys.LEAST1, surveys.MOST1, surveys.LEAST2, surveys.MOST2]]
    assert found == pytest.approx([Z1.min(), Z1.max(), Z2.min(), Z2.max()], rel=1e-12)
    assert Z2.max() > 1.2
    assert values[surveys.LEAST_DET] == pytest.approx(np.linalg.det(M), rel=1e-12)


def test_the_prestress_is_that_of_the_book():
    """(3.67): Z₁ = 1 and Z₂ = 1 + 2t₀²(x² + y²)² for r = ½; inflation multiplies Z₁ by its square."""
    body, _ = sphere(48, eps=0.1, twist=1.0, inflation=1.1)
    g, x = body.grid, body.grid.points(ghosts=GHOSTS)
    r2 = np.broadcast_to(sum(q**2 for q in x), g.shape).ravel()
    nodes = np.flatnonzero(np.abs(np.sqrt(r2) - 0.5) < 0.01)
    at = np.stack([np.broadcast_to(q, g.shape).ravel()[nodes] for q in x], axis=1)
    Y = np.stack([q[nodes] for q in body.map.Y], axis=1)
    Z1, Z2 = area_and_shear(map_gradient(g, body.map.Y, nodes), Y)
    assert np.abs(Z1 - 1.21).max() < 1e-3
    scale = 0.25 / r2[nodes]  # Z₂ - 1 = t₀²(x² + y²)²/(2 r²) on the sphere through the node
    assert np.abs(Z2 - 1 - 2 * scale * (at[:, 0] ** 2 + at[:, 1] ** 2) ** 2).max() < 1e-3
    assert body.survey()[surveys.AREA] == pytest.approx(np.pi, rel=0.01)


def test_all_layers_may_be_strained_alike():
    """Z₂ depends on the direction alone, and is that of (3.67) on the sphere."""
    body, _ = sphere(48, eps=0.1, twist=1.0, alike=True)
    g = body.grid
    r = np.sqrt(np.broadcast_to(sum(q**2 for q in g.points()), g.shape)).ravel()
    nodes = np.flatnonzero((r > 0.35) & (r < 0.65))
    z = np.broadcast_to(g.points()[2], g.shape).ravel()[nodes]
    Z1, Z2 = area_and_shear(map_gradient(g, body.map.Y, nodes), np.stack([q[nodes] for q in body.map.Y], axis=1))
    assert np.abs(Z1 - 1).max() < 1e-3
    wanted = 2 * (0.25 - (0.5 * z / r[nodes]) ** 2) ** 2
    assert np.abs(Z2 - 1 - wanted).max() < 1e-3


def test_a_resting_sphere_stays():
    body, flow = sphere(20, eps=0.2)
    for _ in range(5):
        step(flow, (body,), 0.02)
    assert max(flow.largest(u) for u in flow.u) < 1e-12
    assert body.gauges(flow)["elastic_energy"] < 1e-20


def test_an_inflated_sphere_carries_its_pressure():
    """p inside less p outside is 2T/r, T = E₁'(1.21): energies are per area at rest."""
    body, flow = sphere(32, eps=0.15, inflation=1.1)
    for _ in range(10):
        step(flow, (body,), 0.01)
    p = flow.pressure()
    assert p[16, 16, 16] - p[1, 16, 16] == pytest.approx(2 * 1.3 * 0.21 / 0.5, rel=0.05)
    assert max(flow.largest(u) for u in flow.u) < 0.03
    found = body.gauges(flow)
    assert [found["Z1_min"], found["Z1_max"]] == pytest.approx([1.21, 1.21], rel=0.05)
    assert found["volume"] == pytest.approx(4 / 3 * np.pi * 0.125, rel=0.05)


def test_the_pressure_is_that_of_the_book_s_form():
    """A sphere inflated at rest: p = ∫2T D/r dr along a radius, T = E₁'Z₁ over the cube of the inflation (SPEC 7); the
    flow's own has a hump on the band, the gradient that is in the force."""
    body, flow = sphere(40, eps=0.2, inflation=1.3)
    for _ in range(2):
        step(flow, (body,), 1e-3)
    r = np.linspace(1e-3, 1.0, 4000)
    D = 0.5 * (1 + np.cos(np.pi * np.clip((r - 0.5) / 1.3 / body.eps, -1, 1))) / body.eps
    tension = 1.3 * 0.69 * 1.69 / 1.3**3
    wanted = np.cumsum((2 * tension * D / r)[::-1])[::-1] * (r[1] - r[0])
    line, x = (slice(20, None), 20, 20), body.grid.coordinate(0)[20:]
    sim = Simulation(load(SCENE), flow, (body,))
    off = []
    for p in (flow.pressure(), sim.fields(("p",))["p"][1]):
        off.append(p[line] - p[line][-1] - np.interp(np.sqrt(x**2 + 0.5 * body.grid.h**2), r, wanted))
    assert np.abs(off[0]).max() > 0.15 * wanted[0]
    assert np.abs(off[1]).max() < 0.04 * wanted[0]


def test_layers_that_slide_cost_energy():
    """½κ_s tan²θ S, θ between the normal and the image of the normal at rest, for an affine map; 0 for a rotation."""
    M = np.array([[1.1, 0.3, -0.2], [0.1, 0.8, 0.25], [-0.15, 0.05, 1.2]])
    turn = np.linalg.qr(M)[0]
    for A, slides in ((M, True), (turn * np.sign(np.linalg.det(turn)), False)):
        (body, _), (free, _) = sphere(15, slip=0.7, eps=0.2), sphere(15, eps=0.2)
        grid, x = body.grid, body.grid.points()
        for Y, other, row in zip(body.map.Y, free.map.Y, A, strict=True):
            grid.padded(Y)[...] = sum(m * q for m, q in zip(row, x, strict=True))
            other[:] = Y
        at = np.stack(np.meshgrid(*[grid.coordinate(a) - 0.5 * grid.h for a in grid.axes], indexing="ij"), -1)
        place = at.reshape(-1, 3) @ A.T
        distance = np.linalg.norm(place, axis=1)
        m, wide = place / distance[:, None], SKIN * body.eps
        S = 0.5 * (1 + np.cos(np.pi * np.clip((distance - 0.5) / wide, -1, 1))) / wide
        f, n = m @ np.linalg.inv(A).T, m @ A
        cos = (f * n).sum(axis=1) / np.linalg.norm(f, axis=1) / np.linalg.norm(n, axis=1)
        wanted = 0.5 * 0.7 * grid.cell_volume * float(S @ (1 / cos**2 - 1))
        assert stored(body) - stored(free) == pytest.approx(wanted, rel=1e-9, abs=1e-14)
        assert (wanted > 1e-3) == slides


def test_no_energy_out_of_nothing_and_the_axes_stay_alike():
    body, flow = sphere(20, eps=0.2, twist=2.0)
    rows = []
    for _ in range(20):
        rows.append((energy.kinetic_energy(flow), energy.dissipation(flow), body.gauges(flow)))
        step(flow, (body,), 0.01)
    stores = np.array([k + gauges["elastic_energy"] for k, _, gauges in rows])
    lost = np.array([d for _, d, _ in rows])
    made = stores - stores[0] + np.concatenate([[0.0], np.cumsum(0.005 * (lost[1:] + lost[:-1]))])
    assert rows[-1][0] > 0.01 * stores[0]
    assert made.max() < 0.01 * stores[0]
    assert made.min() > -0.1 * stores[0]
    last = rows[-1][2]
    assert last["axis_x"] == pytest.approx(last["axis_y"], rel=1e-3)
    assert min(gauges["det_min"] for *_, gauges in rows) > 0.5
    assert last["shear_mean"] < rows[0][2]["shear_mean"]


def test_a_state_goes_on_bit_for_bit():
    body, flow = sphere(16, twist=1.0)
    step(flow, (body,), 0.01)
    kept = body.state(), flow.state()
    step(flow, (body,), 0.01)
    Y = body.map.Y[0].copy()
    body.restore(kept[0])
    flow.restore(kept[1])
    step(flow, (body,), 0.01)
    assert np.array_equal(Y, body.map.Y[0])


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="law must be one of"):
        sphere(law="rubber")
    with pytest.raises(ValueError, match="not periodic"):
        sphere(kind="periodic", twist=1.0)
    grid = Grid((8, 8), 0.25)
    with pytest.raises(ValueError, match="three directions"):
        ShearMembrane(grid, Edges(grid, ((Side("no-slip"),) * 2,) * 2), (0, 0), 0.5, "linear", 1.0, 1.0, 0.3)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"bodies.0.shear": -1}, "bodies.0.shear: must be positive, got -1"),
        ({"bodies.0.slip": -1}, "bodies.0.slip: must not be negative, got -1"),
        ({"bodies.0.law": "rubber"}, "bodies.0.law: "),
        ({"bodies.0.law": "neo-hookean"}, "bodies.0.area: a neo-hookean membrane has the modulus shear alone"),
        ({"bodies.0.inflation": 0}, "bodies.0.inflation: must be positive, got 0"),
        ({"box.edges": "periodic"}, "bodies.0.twist: needs a box without periodic sides"),
        ({"bodies.0.shape.kind": "torus"}, "bodies.0.shape"),
        ({"bodies.0.shape.radius": 1.5}, "bodies.0.shape: leaves the box along x"),
        ({"bodies.0.width.cells": 0.5}, "bodies.0.width.cells: ε = "),
    ],
)
def test_bad_scenes_say_why(change, line):
    text = """
box: {length: [2, 2, 2], cells: 16, edges: walls}
fluid: {density: 1, viscosity: 0.01}
bodies:
  - {kind: shear-membrane, shape: {kind: ball, centre: [1, 1, 1], radius: 0.5}, area: 1, shear: 1, twist: 1,
     width: {cells: 2}}
clock: {end: 1, step: 0.01}
"""
    with pytest.raises(SceneError) as error:
        loads(text, change)
    assert line in str(error.value)


def run(coupling, multiple, steps):
    """Energies over a few steps at a multiple of the explicit limit, and M of the stabiliser after each."""
    body, flow = sphere(12, twist=1.0, coupling=coupling)
    limit = kernels_limit(body, flow)
    rows, held = [], []
    for _ in range(steps):
        flow.begin()
        step(flow, (body,), multiple * limit)
        rows.append(energy.kinetic_energy(flow) + stored(body))
        held.append(body._held[0])
    return rows, held


def kernels_limit(body, flow):
    return 2.8 * body.grid.h * np.sqrt(flow.density * body.eps / body.survey()[surveys.STIFF])


def test_beyond_the_explicit_limit_the_stabilised_step_loses_energy_and_the_explicit_one_makes_it():
    first = stored(sphere(12, twist=1.0)[0])
    explicit, stabilised = run("explicit", 10, 12)[0], run("stabilised", 30, 12)[0]
    assert not max(explicit) < 1.1 * first
    assert max(stabilised) <= first
    assert stabilised[-1] < 0.99 * first


def test_the_stabiliser_lowers_its_modulus_slowly_and_raises_it_at_once():
    body, flow = sphere(12, twist=1.0, coupling="stabilised")
    top = body.survey()[surveys.STIFF]
    flow.begin()
    body.push(flow, 0.1)
    assert flow.stiffness == pytest.approx(0.25 * top / body.eps)
    body._values[surveys.STIFF] = 0.1 * top
    for _ in range(4):  # looked at again on the last of them
        flow.begin()
        body.push(flow, 0.1)
    assert flow.stiffness == pytest.approx(0.25 * 0.95 * top / body.eps)
    body._values[surveys.STIFF] = 3 * top
    state = body.state()
    for _ in range(4):
        flow.begin()
        body.push(flow, 0.1)
    assert flow.stiffness == pytest.approx(0.25 * 3 * top / body.eps)
    body.restore(state)
    assert body._held[0] == pytest.approx(0.95 * top)


def test_the_longest_step_of_both_couplings():
    limits = {c: sphere(12, coupling=c) for c in ("explicit", "stabilised")}
    found = {c: body.longest_step(flow) for c, (body, flow) in limits.items()}
    body, flow = limits["explicit"]
    assert found["explicit"] == {"elastic, shear": pytest.approx(kernels_limit(body, flow))}
    ratio = body.eps / (2.8 * body.grid.h)
    assert found["stabilised"] == {"elastic, shear, accuracy": pytest.approx(ratio * kernels_limit(body, flow))}
    with pytest.raises(ValueError, match="coupling must be one of explicit, stabilised"):
        sphere(12, coupling="iterated")
