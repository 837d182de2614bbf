"""The force of a membrane as the gradient of its discrete energy: gradient, power, energy over a run, where it fits."""

import numpy as np
import pytest

from fsiwork.bodies.laws import Linear, Quadratic
from fsiwork.bodies.membrane import Membrane
from fsiwork.core import energy
from fsiwork.core.edges import Edges, Side
from fsiwork.core.flow import Flow
from fsiwork.core.grid import Grid
from fsiwork.core.shapes import Ellipsoid
from fsiwork.core.transport import Transport
from fsiwork.scene import SceneError, loads
from fsiwork.simulate import step


class Neo:
    """A law of one's own."""

    def E(self, s):
        return s**2 + s**-2 - 2.0

    def dE(self, s):
        return 2.0 * (s - s**-3)

    def ddE(self, s):
        return 2.0 + 6.0 * s**-4


LAWS = {"linear": Linear(1.3), "quadratic": Quadratic(1.7), "called": Neo()}


def membrane(n, dim=2, law="quadratic", kind="no-slip", cells=3.0, axes=(0.6, 0.4, 0.5), **more):
    grid = Grid((n,) * dim, 2 / n, (-1.0,) * dim)
    edges = Edges(grid, ((Side(kind),) * 2,) * dim)
    shape = Ellipsoid((0.05,) * dim, axes[:dim])
    options = {"stretch": 1.3, "form": "adjoint"} | more
    transport = Transport(grid, edges, "upwind5", centring=2)
    body = Membrane(grid, edges, shape.distance, LAWS[law], cells * grid.h, transport=transport, **options)
    return body, Flow(grid, edges, 1.0, 0.01)


def stored(body):
    body._fresh = False
    return body._adjoint.energy(body.phi, body._band_now())


def shaken(body, size=0.1, seed=1):
    """Noise of the grid in φ: formulas must hold for any field."""
    body.phi += size * body.grid.h * np.random.default_rng(seed).normal(size=body.phi.size)
    body._fresh = False


@pytest.mark.parametrize("dirac", ["plain", "renormalised"])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("dim", [2, 3])
def test_the_gradient_is_that_of_the_discrete_energy(dim, law, dirac):
    body, _ = membrane((48, 24)[dim - 2], dim, law, dirac=dirac, cells=2.0, axes=(0.5, 0.4, 0.45))
    shaken(body)
    gradient = body._adjoint.gradient(body.phi, body._band_now()).copy()
    along, start, energies = np.random.default_rng(2).normal(size=body.phi.size), body.phi.copy(), []
    for d in (-1e-6, 1e-6):
        body.phi[:] = start + d * along
        energies.append(stored(body))
    rate = body.grid.cell_volume * float(gradient @ along)
    assert abs(rate) > 1e-3
    assert rate == pytest.approx((energies[1] - energies[0]) / 2e-6, rel=1e-5)


@pytest.mark.parametrize(("dim", "kind"), [(2, "no-slip"), (2, "periodic"), (3, "no-slip")])
def test_the_power_of_the_force_is_what_the_energy_loses(dim, kind):
    body, flow = membrane((48, 24)[dim - 2], dim, kind=kind, cells=2.0, axes=(0.5, 0.4, 0.45))
    shaken(body)
    body.edges.fill_scalar(body.phi, "linear")
    grid, random = body.grid, np.random.default_rng(3)
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
    assert abs(power) > 1e-3
    assert power == pytest.approx(-rate, rel=1e-5)


def test_a_plane_extruded_has_the_force_of_its_plane():
    forces = []
    for dim in (2, 3):
        grid = Grid((24, 24, 8)[:dim], 1 / 12, (-1.0, -1.0, 0.0)[:dim])
        edges = Edges(grid, ((Side("periodic"),) * 2,) * dim)
        phi = np.array(grid.sample(lambda *x: 1.2 * Ellipsoid((0.0, 0.0), (0.6, 0.4)).distance(*x[:2]) + 0 * x[-1]))
        transport = Transport(grid, edges, "upwind5", centring=2)
        body = Membrane(grid, edges, phi, LAWS["quadratic"], 3 * grid.h, transport=transport, form="adjoint")
        flow = Flow(grid, edges, 1.0, 0.01)
        body.push(flow, 0.0)
        forces.append((grid, flow.force, body.gauges(flow)["elastic_energy"]))
    (flat, two, less), (solid, three, more) = forces
    for a in range(2):
        plane, layers = flat.inside(two[a]), solid.inside(three[a])
        assert np.abs(plane).max() > 1.0
        assert np.abs(layers - plane[:, :, None]).max() <= 1e-12 * np.abs(plane).max()
    assert np.abs(solid.inside(three[2])).max() < 1e-12
    assert more == pytest.approx(less * 8 / 12, rel=1e-12)


def test_it_is_the_force_of_the_other_forms_but_for_a_gradient():
    """The same power, to what the grid makes of it, in velocities without divergence."""
    found = []
    for form in ("adjoint", "divergence"):
        body, flow = membrane(128, form=form, cells=6.0)
        body.push(flow, 0.0)
        g = body.grid
        u = [g.sample(lambda x, y: x + 0 * y, face=0), g.sample(lambda x, y: -y + 0 * x, face=1)]
        found.append(sum(float((g.inside(f) * g.inside(v)).sum()) for f, v in zip(flow.force, u, strict=True)))
    assert found[0] == pytest.approx(found[1], rel=0.02)


@pytest.mark.parametrize("dirac", ["plain", "renormalised"])
def test_the_pressure_of_the_books_form_jumps_once(dirac):
    """A circle of radius ½: p inside less outside is E'/½, and without the potential there is a bump between."""
    body, flow = membrane(64, axes=(0.5, 0.5), cells=4.0, dirac=dirac)
    for _ in range(5):
        step(flow, (body,), 0.004)
    p, jump = flow.pressure(), 1.7 * 0.3 / 0.5
    shares = [(q[32:, 33] - q[-1, 33]) / jump for q in (p, p - body.potential())]
    assert shares[1][0] == pytest.approx(1.0, abs=0.03)
    assert max(shares[1].max() - 1, -shares[1].min()) < 0.05
    assert max(shares[0].max() - 1, -shares[0].min()) > 0.5


def run(form, cells):
    body, flow = membrane(32, form=form, cells=cells, stretch=1.2625)
    rows = []
    for _ in range(100):
        stores = energy.kinetic_energy(flow) + body.gauges(flow)["elastic_energy"]
        rows.append((stores, energy.dissipation(flow)))
        step(flow, (body,), 0.01)
    stores, lost = np.array(rows).T
    made = stores - stores[0] + np.concatenate([[0.0], np.cumsum(0.005 * (lost[1:] + lost[:-1]))])
    return np.abs(made).max() / stores[0], np.diff(stores).max() / stores[0]


def test_no_energy_is_made():
    residual, rise = run("adjoint", 3)
    assert rise <= 0.0
    assert residual < 3e-3
    assert run("divergence", 3)[0] > 3 * residual


def test_an_unstretched_membrane_rests():
    body, flow = membrane(32, axes=(0.5, 0.5), stretch=1.0)
    for _ in range(20):
        step(flow, (body,), 0.02)
    assert max(flow.largest(u) for u in flow.u) < 0.02
    assert body.gauges(flow)["axis_x"] == pytest.approx(0.5, abs=2e-3)


def test_a_state_goes_on_bit_for_bit():
    body, flow = membrane(24, coupling="stabilised")
    step(flow, (body,), 0.02)
    kept = body.state(), flow.state()
    step(flow, (body,), 0.02)
    phi = body.phi.copy()
    body.restore(kept[0])
    flow.restore(kept[1])
    step(flow, (body,), 0.02)
    assert np.array_equal(phi, body.phi)


def test_it_needs_the_derivative_that_it_is_adjoint_to():
    grid = Grid((8, 8), 0.25)
    edges = Edges(grid, ((Side("no-slip"),) * 2,) * 2)
    for transport in (Transport(grid, edges, "weno5"), Transport(grid, edges, "upwind5", centring=4)):
        with pytest.raises(ValueError, match="adjoint needs"):
            Membrane(grid, edges, grid.field(), LAWS["linear"], 0.5, transport=transport, form="adjoint")
    text = """
box: {length: [2, 2], cells: 16, edges: walls}
fluid: {viscosity: 0.01}
bodies:
  - {kind: membrane, shape: {kind: disc, centre: [1, 1], radius: 0.5}, energy: {kind: linear, stiffness: 1},
     width: {cells: 2}, form: adjoint}
clock: {end: 1, step: 0.01}
"""
    line = "bodies.0.form: adjoint needs transport.scheme: upwind5"
    for change in ({}, {"bodies.0.transport": {"scheme": "upwind5", "carry": "map"}}):
        with pytest.raises(SceneError) as error:
            loads(text, change)
        assert line in str(error.value)
    assert loads(text, {"bodies.0.transport": {"scheme": "upwind5"}}).bodies[0].form == "adjoint"
