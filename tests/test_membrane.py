"""Membranes: force, energy, coupling, gauges; each against an exact result or an order."""

import tracemalloc

import numpy as np
import pytest

from fsiwork.bodies.laws import Linear, Quadratic
from fsiwork.bodies.membrane import Membrane
from fsiwork.core import levelset
from fsiwork.core.edges import Edges, Side
from fsiwork.core.flow import Flow
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import interface, membrane
from fsiwork.core.shapes import Ball, Ellipsoid
from fsiwork.core.transport import Transport
from fsiwork.studies.orders import slope

FORMS = ("normal-tangential", "divergence", "split")
OFFSET = 0.0137  # of centres: no symmetry with the grid


class Called:
    """The quadratic law, as a user would write one."""

    def E(self, r):
        return 5.0 * (r - 1.0) ** 2

    def dE(self, r):
        return 10.0 * (r - 1.0)

    def ddE(self, r):
        return 10.0 * np.ones_like(r)


def tank(n, sides="no-slip", dim=2, mu=0.01, **options):
    """Flow at rest in the box [-1, 1]^d."""
    grid = Grid((n,) * dim, 2.0 / n, (-1.0,) * dim)
    edges = Edges(grid, ((Side(sides), Side(sides)),) * dim)
    return Flow(grid, edges, 1.0, mu, **options)


def immerse(flow, phi0, law, eps, dtype=np.float64, **choices):
    transport = Transport(flow.grid, flow.edges, dtype=dtype)
    return Membrane(flow.grid, flow.edges, phi0, law, eps, transport=transport, **choices)


def ellipse(x, y):
    """Level function of the ellipse 0.6 x 0.4 with a stretch that varies along it."""
    return 1.2 * (np.sqrt((x / 0.6) ** 2 + ((y - OFFSET) / 0.4) ** 2) - 1.0) * (0.5 + 0.1 * np.sin(np.pi * x))


def push(flow, body, dt=0.01):
    flow.begin()
    body.push(flow, dt)
    return [flow.grid.inside(f, face=a).copy() for a, f in enumerate(flow.force)]


def test_bell_and_ramp_are_the_cosine_ones():
    r = np.linspace(-1.2, 1.2, 2401)
    inside = np.abs(r) < 1
    zeta = np.where(inside, 0.5 * (1 + np.cos(np.pi * r)), 0.0)
    ramp = np.where(inside, 0.5 * (1 + r + np.sin(np.pi * r) / np.pi), r > 0)
    np.testing.assert_allclose([membrane.bell(x) for x in r], zeta, atol=3e-16)
    np.testing.assert_allclose([membrane.ramp(x) for x in r], ramp, atol=3e-16)
    assert membrane.bell(1.0) == 0.0 and membrane.ramp(1.0) == 1.0 and membrane.ramp(-1.0) == 0.0


@pytest.mark.parametrize("sides", ["no-slip", "periodic"])
def test_force_of_a_closed_membrane_sums_to_zero(sides):
    flow = tank(48, sides)
    centre = 0.0 if sides == "no-slip" else 0.95  # across the seam
    body = immerse(flow, lambda x, y: ellipse(np.mod(x - centre + 1, 2) - 1, y), Quadratic(10.0), 0.15)
    push(flow, body)
    for f in flow.force:
        own = flow.grid.inside(f)
        assert np.abs(own).max() > 1.0
        assert abs(own.sum()) < 1e-11 * np.abs(own).sum()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("law", "stretch", "jump"), [(Linear(1.0), 1.0, 2.0), (Quadratic(10.0), 1.3, 6.0)])
def test_static_circle_has_the_jump_of_laplace(form, law, stretch, jump):
    """∫F·n dr = E'/R through the centre (SPEC 4, 5)."""
    flow = tank(128)
    body = immerse(flow, Ball((OFFSET, OFFSET), 0.5).distance, law, 6 * flow.grid.h, stretch=stretch, form=form)
    along = push(flow, body)[0][:64, 64].sum() * flow.grid.h
    assert along == pytest.approx(jump, rel=0.01)


def test_drop_force_is_a_gradient_where_the_curvature_is_constant():
    """With H replaced by a number the balanced form is the difference of H_ε, face by face."""
    flow = tank(32)
    body = immerse(flow, Ball((0.0, 0.0), 0.5).distance, Linear(1.0), 0.2)
    H = np.array([membrane.ramp(p / 0.2) for p in body.phi])
    K, out = np.full(flow.grid.size, 3.0), flow.grid.field()
    band = body._band_now()
    membrane.pull_balanced(out, K, body.phi, band.runs, body._pull._first[0], body._pull.numbers)
    expected = -3.0 * (H - np.roll(H, flow.grid.strides[0])) / flow.grid.h
    np.testing.assert_allclose(flow.grid.inside(out), flow.grid.inside(expected), atol=1e-13)


@pytest.mark.parametrize("other", ["normal-tangential", "split"])
def test_forms_agree_to_second_order(other):
    """Plain D_ε, ε a fixed length, a stretch that varies: the forms are the same function (SPEC 5)."""
    steps, errors = [], []
    for n in (64, 128, 256):
        flow = tank(n)
        forces = [
            push(flow, immerse(flow, flow.grid.sample(ellipse), Quadratic(10.0), 0.2, form=form, dirac="plain"))
            for form in ("divergence", other)
        ]
        difference = [a - b for a, b in zip(*forces, strict=True)]
        steps.append(flow.grid.h)
        # In the mean: ζ'' jumps at the edge of the band, where the error is of first order.
        errors.append(sum(np.abs(d).mean() for d in difference) / sum(np.abs(f).mean() for f in forces[0]))
    assert slope(steps, errors) >= 1.8
    assert errors[-1] < 0.02


def swirl(x, y):
    """Stream function of a flow that vanishes on the walls."""
    return np.cos(0.5 * np.pi * x) ** 2 * np.cos(0.5 * np.pi * y) ** 2 * (x + 0.7 * y)


@pytest.fixture(scope="module")
def loss():
    """-dℰ/dt of the ellipse in the swirl, on a grid that is finer than those under test."""
    flow, d = tank(512), 1e-4
    x, y = flow.grid.points()
    ux = (swirl(x, y + d) - swirl(x, y - d)) / (2 * d)
    uy = -(swirl(x + d, y) - swirl(x - d, y)) / (2 * d)

    def energy(t):
        phi = np.ascontiguousarray(ellipse(x - t * ux, y - t * uy)).ravel()
        return immerse(flow, phi, Quadratic(10.0), 0.2, dirac="plain").gauges(flow)["elastic_energy"]

    return -(energy(d) - energy(-d)) / (2 * d)


@pytest.mark.parametrize("form", FORMS)
def test_power_of_the_force_is_the_loss_of_elastic_energy(form, loss):
    """-dℰ/dt = ∫F·u for every solenoidal u, ℰ = ∫E(|∇φ|) D_ε with the same D_ε."""
    steps, errors = [], []
    for n in (48, 96, 192):
        flow = tank(n)
        g, h = flow.grid, flow.grid.h
        push(flow, immerse(flow, g.sample(ellipse), Quadratic(10.0), 0.2, form=form, dirac="plain"))
        xf, yf = (line.ravel() - 0.5 * h for line in g.points())
        psi = swirl(xf[:, None], yf[None, :])  # at low corners
        u = [np.zeros(g.shape), np.zeros(g.shape)]
        u[0][:, :-1], u[1][:-1] = np.diff(psi, axis=1) / h, -np.diff(psi, axis=0) / h
        power = sum((flow.force[a].reshape(g.shape) * u[a]).sum() for a in g.axes) * h**2
        steps.append(h)
        errors.append(abs(power / loss - 1.0))
    assert slope(steps, errors) >= 1.8
    assert errors[-1] < 1e-3


@pytest.mark.parametrize("dirac", ["plain", "renormalised"])
@pytest.mark.parametrize("form", FORMS)
def test_a_plane_and_its_extrusion_have_the_same_force_bit_for_bit(form, dirac):
    plane = Grid((26, 20), 0.08, (-1.04, -0.8))
    block = Grid((26, 20, 5), 0.08, (-1.04, -0.8, 0.0))
    wall, periodic = (Side("no-slip"),) * 2, (Side("periodic"),) * 2
    forces = []
    for grid, sides in ((plane, (wall, wall)), (block, (wall, wall, periodic))):
        flow = Flow(grid, Edges(grid, sides), 1.0, 0.01)
        phi = grid.sample(lambda x, y, *_: ellipse(x, y))
        body = immerse(flow, phi, Quadratic(10.0), 0.24, form=form, dirac=dirac)
        push(flow, body)
        forces.append([grid.inside(f) for f in flow.force])
    assert np.abs(forces[0][0]).max() > 1.0
    for a in (0, 1):
        np.testing.assert_array_equal(forces[1][a], np.repeat(forces[0][a][:, :, None], 5, axis=2))
    assert not forces[1][2].any()


def test_a_plane_may_lie_across_any_axes_of_a_block():
    """The same ellipse in the planes (y, z): the first axis is the idle one."""
    plane = Grid((26, 20), 0.08, (-1.04, -0.8))
    block = Grid((4, 26, 20), 0.08, (0.0, -1.04, -0.8))
    wall, periodic = (Side("no-slip"),) * 2, (Side("periodic"),) * 2
    forces = []
    for grid, sides in ((plane, (wall, wall)), (block, (periodic, wall, wall))):
        flow = Flow(grid, Edges(grid, sides), 1.0, 0.01)
        body = immerse(flow, grid.sample(lambda *x: ellipse(*x[-2:])), Quadratic(10.0), 0.24)
        push(flow, body)
        forces.append([grid.inside(f) for f in flow.force])
    for a in (0, 1):
        wanted = np.broadcast_to(forces[0][a], (4, 26, 20))
        np.testing.assert_allclose(forces[1][1 + a], wanted, atol=1e-12 * np.abs(wanted).max())


def test_sphere_under_tension():
    """[p] = 2E'/R; area and volume of the ball."""
    flow = tank(32, dim=3)
    g = flow.grid
    body = immerse(flow, Ball((0.0, 0.0, 0.0), 0.5).distance, Quadratic(10.0), 3 * g.h, stretch=1.3)
    along = push(flow, body)[0][:16, 15:17, 15:17].mean(axis=(1, 2)).sum() * g.h
    assert along == pytest.approx(2 * 3.0 / 0.5, rel=0.02)
    gauges = body.gauges(flow)
    assert gauges["area"] == pytest.approx(np.pi, rel=0.02)
    assert gauges["volume"] == pytest.approx(np.pi / 6 * (1 + 3 * (2 * 3 * g.h / 1.3) ** 2 * 0.1307), rel=1e-3)
    for a in "xyz":
        assert gauges[f"axis_{a}"] == pytest.approx(0.5, abs=1e-4)


@pytest.mark.parametrize("form", FORMS)
def test_a_law_given_as_functions_equals_the_built_in_one(form):
    flow = tank(48)
    phi = flow.grid.sample(ellipse)
    known, called = (immerse(flow, phi, law, 0.15, form=form) for law in (Quadratic(10.0), Called()))
    for a, b in zip(push(flow, known), push(flow, called), strict=True):
        np.testing.assert_allclose(b, a, atol=1e-12 * np.abs(a).max())
    np.testing.assert_allclose(called.survey(), known.survey(), rtol=1e-12)


def test_prediction_solves_its_equation():
    """(3.62) with c = E'/ρ, E' the mean over the interface, to round-off; the force is that of φ̃ and φ itself stays."""
    flow, dt = tank(32), 0.02
    g, h = flow.grid, flow.grid.h
    rng = np.random.default_rng(0)
    for u in flow.u:
        u[:] = rng.standard_normal(g.size)
    flow.edges.fill_velocity(flow.u)
    body = immerse(flow, g.sample(ellipse), Quadratic(10.0), 0.2, coupling="semi-implicit")
    before = body.phi.copy()
    force = push(flow, body, dt)
    tilde = g.padded(body.predict(flow, dt)).copy()
    phi = g.padded(body.phi)
    carried, laplacian = np.zeros(g.shape), np.zeros(g.shape)
    for a, u in enumerate(flow.u):
        u = g.padded(u)
        east, west = np.roll(phi, -1, a), np.roll(phi, 1, a)
        carried += 0.5 * (u + np.roll(u, -1, a)) * (east - west) / (2 * h)
        laplacian += (np.roll(tilde, -1, a) - 2 * tilde + np.roll(tilde, 1, a)) / h**2
    c = body.survey()[interface.PULL] / body.survey()[interface.LENGTH]
    norm = levelset.gradient_norm(g, body.phi)
    weight = g.inside(levelset.dirac(body.phi, 0.2, scaling="renormalised", grid=g) * norm)
    assert c == pytest.approx((weight * 10.0 * (g.inside(norm) - 1.0)).sum() / weight.sum())
    residual = tilde - phi + dt * carried - c * dt**2 / 0.2 * laplacian
    assert np.abs(residual[3:-3, 3:-3]).max() < 1e-12
    assert np.array_equal(body.phi, before)
    there = immerse(flow, tilde.ravel(), Quadratic(10.0), 0.2)
    there.phi[:] = tilde.ravel()
    for a, b in zip(push(flow, there), force, strict=True):
        np.testing.assert_array_equal(a, b)


def test_stabiliser_of_a_drop_and_of_a_membrane():
    """c_s = c max(M D_ε)/ρ: λ/(ρε) for a drop; at rest length the membrane keeps λ/4."""
    flow = tank(64)
    distance = Ball((0.0, 0.0), 0.5).distance
    for law, peak in ((Linear(3.0), 3.0 / 0.1), (Quadratic(8.0), 2.0 / 0.1)):
        for coupling, c in (("stabilised", 0.35), ("iterated", 0.5), ("explicit", 0.0)):
            push(flow, immerse(flow, distance, law, 0.1, coupling=coupling))
            assert flow.stiffness == pytest.approx(c * peak, rel=0.03, abs=1e-12)


def test_a_guess_moves_the_force_to_the_last_pass():
    flow = tank(48)
    body = immerse(flow, flow.grid.sample(ellipse), Quadratic(10.0), 0.15, coupling="iterated")
    there = immerse(flow, flow.grid.sample(lambda x, y: ellipse(x - 0.05, y)), Quadratic(10.0), 0.15)
    body.guess = there.state()
    assert body.passes == 2
    for a, b in zip(push(flow, body), push(flow, there), strict=True):
        np.testing.assert_array_equal(a, b)


def test_limits_on_the_step():
    """(1.54) with sE'(s); a membrane at rest length has only the tangential one."""
    flow = tank(64, mu=0.02, diffusion="backward-euler")
    h, eps, distance = flow.grid.h, 0.1, Ball((0.0, 0.0), 0.5).distance
    wanted = (0.02 * eps + np.sqrt((0.02 * eps) ** 2 + 0.5 * 2.0 * eps * h**2)) / 2.0
    drop = immerse(flow, distance, Linear(2.0), eps)
    assert drop.longest_step(flow)["elastic (1.54)"] == pytest.approx(wanted, rel=1e-3)
    rest = immerse(flow, distance, Quadratic(8.0), eps).longest_step(flow)
    assert rest["elastic (1.54)"] > 10 * rest["elastic, tangential"]
    assert rest["elastic, tangential"] == pytest.approx(wanted, rel=0.02)  # M = λ/4 = 2
    implicit = immerse(flow, distance, Linear(2.0), eps, coupling="stabilised")
    assert "elastic (1.54)" not in implicit.longest_step(flow)
    centred = tank(64, mu=0.02)  # Crank-Nicolson: the inviscid limit
    assert drop.longest_step(centred)["elastic (1.54)"] == pytest.approx(np.sqrt(0.5 * 2.0 * eps * h**2) / 2, rel=1e-3)


def test_gauges_of_an_ellipse():
    flow = tank(64)
    body = immerse(flow, Ellipsoid((0.01, OFFSET), (0.6, 0.4)).distance, Quadratic(10.0), 0.1, stretch=1.25)
    gauges = body.gauges(flow)
    assert gauges["axis_x"] == pytest.approx(0.6, abs=1e-5)
    assert gauges["axis_y"] == pytest.approx(0.4, abs=1e-5)
    assert gauges["centroid_x"] == pytest.approx(0.01, abs=1e-5)
    assert gauges["centroid_y"] == pytest.approx(OFFSET, abs=1e-5)
    assert gauges["length"] == pytest.approx(3.173171, rel=2e-3)  # 4 a times the complete elliptic integral E
    assert gauges["elastic_energy"] == pytest.approx(0.5 * 10 * 0.25**2 * 3.173171 / 1.25, rel=0.01)
    spread = (1 / 3 - 2 / np.pi**2) * (0.1 / 1.25) ** 2  # second moment of ζ: ∫1 - H_ε = area + π spread
    assert gauges["volume"] == pytest.approx(np.pi * (0.24 + spread), rel=1e-4)
    assert gauges["stretch_min"] == pytest.approx(1.25, rel=0.01)
    assert gauges["stretch_max"] == pytest.approx(1.25, rel=0.01)


def test_gauges_do_not_see_the_seam_of_a_periodic_box():
    flow, found = tank(64, "periodic"), []
    for shift in (0.0, 32 * 2 / 64):
        body = immerse(
            flow,
            lambda x, y, s=shift: np.hypot(np.mod(x - s + 1, 2) - 1 - OFFSET, np.mod(y - s + 1, 2) - 1) - 0.4,
            Quadratic(10.0),
            0.1,
            stretch=1.2,
        )
        found.append(body.gauges(flow))
    for name in ("volume", "length", "elastic_energy", "axis_x", "axis_y", "stretch_max"):
        assert found[1][name] == pytest.approx(found[0][name], rel=1e-12), name
    assert found[0]["centroid_x"] == pytest.approx(OFFSET, abs=1e-6)
    assert found[1]["centroid_x"] == pytest.approx(OFFSET - 1.0, abs=1e-6)  # 1 + OFFSET, taken back into the box


@pytest.mark.parametrize("carry", ["field", "map"])
def test_a_periodic_box_carries_the_membrane_round(carry):
    """Uniform flow through one box length: everything is back; volume is kept."""
    flow = tank(32, "periodic")
    flow.u[0][:], flow.u[1][:] = 1.0, -0.5
    body = immerse(flow, Ball((0.0, 0.0), 0.5).distance, Quadratic(10.0), 0.2, stretch=1.1, carry=carry)
    first = body.gauges(flow)
    for _ in range(64):
        body.move(flow, 4.0 / 64)
    last = body.gauges(flow)
    assert last["centroid_x"] == pytest.approx(0.0, abs=2e-3)
    assert last["centroid_y"] == pytest.approx(0.0, abs=2e-3)
    assert last["axis_x"] == pytest.approx(0.5, abs=2e-3)
    # The map is linear: it is carried exactly. The field has the cut locus of a periodic distance.
    assert last["volume"] == pytest.approx(first["volume"], rel=1e-9 if carry == "map" else 2e-3)
    if carry == "map":
        x = flow.grid.coordinate(0)
        np.testing.assert_allclose(flow.grid.inside(body.fields()["Y_x"])[:, 5], x - 4.0, atol=1e-10)


@pytest.mark.parametrize("carry", ["field", "map"])
def test_state_is_all_that_the_next_step_reads(carry):
    flow = tank(32)
    flow.u[0][:] = flow.grid.sample(lambda x, y: np.cos(3 * y), face=0)
    make = lambda: immerse(flow, Ball((0.0, 0.0), 0.5).distance, Quadratic(10.0), 0.2, stretch=1.2, carry=carry)  # noqa: E731
    body, other = make(), make()
    body.move(flow, 0.01)
    state = body.state()
    body.gauges(flow)
    body.move(flow, 0.01)
    other.restore(state)
    other.move(flow, 0.01)
    for name, q in body.state().items():
        np.testing.assert_array_equal(other.state()[name], q, err_msg=name)
    assert other.gauges(flow) == body.gauges(flow)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("radius", [-1.0, 0.0, 0.01, 0.05])
def test_a_body_thinner_than_cells_stays_finite(form, radius):
    flow = tank(32)
    body = immerse(flow, Ball((0.0, 0.0), radius).distance, Quadratic(10.0), 0.1, stretch=1.2, form=form)
    for f in push(flow, body):
        assert np.isfinite(f).all()
    gauges = body.gauges(flow)
    assert np.isfinite([gauges[k] for k in ("volume", "length", "elastic_energy", "axis_x", "axis_y")]).all()
    assert all(limit > 0.0 for limit in body.longest_step(flow).values())


def test_density_and_viscosity_of_a_mixture():
    """(3.19): inside, outside, and a layer of the surface's mass; ε is a length although |∇φ| is 2."""
    flow = tank(64, mu=0.1)
    distance = Ball((0.0, 0.0), 0.5).distance
    choices = {"stretch": 2.0, "inside": (3.0, 0.4), "surface_mass": 0.7}
    body = immerse(flow, distance, Quadratic(10.0), 0.1, **choices)
    flow.begin()
    body.blend(flow, 0.0)
    g = flow.grid
    r = g.inside(g.sample(distance)) / 0.1
    H = 0.5 * (1 + np.clip(r, -1, 1) + np.sin(np.pi * np.clip(r, -1, 1)) / np.pi)
    D = np.where(np.abs(r) < 1, 0.5 * (1 + np.cos(np.pi * r)), 0.0) / (0.1 * 2.0)
    near = np.abs(r) < 4  # the curvature of the distance changes |∇φ| by central differences a little
    np.testing.assert_allclose(g.inside(flow.rho)[near], (3.0 + (1.0 - 3.0) * H + 0.7 * D)[near], atol=0.03)
    np.testing.assert_allclose(g.inside(flow.mu)[near], (0.4 + (0.1 - 0.4) * H)[near], atol=1e-3)
    assert g.inside(flow.rho)[32, 32] == 3.0 and g.inside(flow.rho)[0, 0] == 1.0
    # Mass: m per rest area, the length over the stretch.
    extra = (g.inside(flow.rho) - 3.0 + 2.0 * H).sum() * g.h**2
    assert extra == pytest.approx(0.7 * np.pi / 2.0, rel=0.01)


def test_constant_fluids_leave_the_slots_empty():
    flow = tank(16)
    body = immerse(flow, Ball((0.0, 0.0), 0.5).distance, Linear(1.0), 0.2)
    flow.begin()
    body.blend(flow, 0.0)
    assert flow.rho is None and flow.mu is None


def test_single_precision_field():
    flow, forces = tank(48), []
    for dtype in (np.float32, np.float64):
        body = immerse(flow, Ball((0.0, 0.0), 0.5).distance, Quadratic(10.0), 0.2, dtype, stretch=1.3)
        forces.append(push(flow, body))
    assert body.phi.dtype == np.float64
    for a, b in zip(*forces, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-3 * np.abs(b).max())


@pytest.mark.parametrize("coupling", ["explicit", "semi-implicit", "stabilised"])
def test_no_field_is_allocated_in_a_step(coupling):
    flow = tank(128)
    body = immerse(flow, Ball((0.0, 0.0), 0.5).distance, Quadratic(10.0), 0.1, stretch=1.2, coupling=coupling)

    def step():
        flow.begin()
        body.push(flow, 0.01)
        body.move(flow, 0.01)
        body.gauges(flow)

    step()
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        step()
        peak = tracemalloc.get_traced_memory()[1] - before
    finally:
        tracemalloc.stop()
    assert peak < body.phi.nbytes / 2


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"form": "weak"}, "form"),
        ({"dirac": "hat"}, "dirac"),
        ({"coupling": "loose"}, "coupling"),
        ({"carry": "Y"}, "carry"),
    ],
)
def test_unknown_words_are_refused(choices, message):
    flow = tank(8)
    with pytest.raises(ValueError, match=message):
        immerse(flow, Ball((0.0, 0.0), 0.5).distance, Linear(1.0), 0.2, **choices)
    with pytest.raises(ValueError, match="map"):
        immerse(flow, flow.grid.field(), Linear(1.0), 0.2, carry="map")


def oscillate(flow, body, dt, end):
    """Total energy over the first, and the half-axis along x, at every step."""
    energy, axis = [], []
    for _ in range(round(end / dt)):
        flow.begin()
        body.push(flow, dt)
        flow.predict(dt)
        flow.project(dt)
        body.move(flow, dt)
        gauges = body.gauges(flow)
        kinetic = 0.5 * sum((flow.grid.inside(u) ** 2).sum() for u in flow.u) * flow.grid.cell_volume
        energy.append(gauges["elastic_energy"] + kinetic)
        axis.append(gauges["axis_x"])
    return np.array(energy), np.array(axis)


STRETCHED = {"law": Quadratic(10.0), "stretch": 1.262532}
DROP = {"law": Linear(1.0)}


@pytest.mark.parametrize(
    ("physics", "coupling", "dt", "least", "tolerance"),
    [
        (STRETCHED, "explicit", 0.001, 0.518, 0.015),  # markers: 0.5178 (MEASURED-coupling 2)
        (STRETCHED, "stabilised", 0.01, 0.518, 0.03),  # three times the explicit limit
        (STRETCHED, "semi-implicit", 0.002, 0.518, 0.03),
        (DROP, "explicit", 0.004, 0.519, 0.008),  # markers: 0.5193
        (DROP, "stabilised", 0.02, 0.519, 0.02),
        (DROP, "semi-implicit", 0.01, 0.519, 0.03),
    ],
)
def test_an_ellipse_swings_and_loses_energy(physics, coupling, dt, least, tolerance):
    flow = tank(64)
    shape = Ellipsoid((0.0, 0.0), (0.75, 0.5))
    body = immerse(flow, shape.distance, eps=3 * flow.grid.h, coupling=coupling, **physics)
    first = body.gauges(flow)
    energy, axis = oscillate(flow, body, dt, 1.2 if physics is DROP else 0.9)
    assert energy.max() <= 1.005 * first["elastic_energy"]
    assert axis.min() == pytest.approx(least, abs=tolerance)
    assert abs(body.gauges(flow)["volume"] / first["volume"] - 1.0) < 2e-3
