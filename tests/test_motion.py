"""Prescribed motions: velocities against their closed forms, divergence, time; interfaces that go with them."""

import numpy as np
import pytest

from fsiwork.bodies.interface import Interface, measures
from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.motion import Deformation, Motion, Rotation, Translation, Vortex, curl
from fsiwork.core.redistance import redistance
from fsiwork.core.refinement import refined
from fsiwork.core.shapes import Ball
from fsiwork.core.transport import Transport
from fsiwork.scene import SceneError, loads
from fsiwork.simulate import build, frames

SCENE = """
box: {length: [1.0, 1.0], cells: 32}
motion: {kind: vortex}
bodies:
  - {kind: interface, shape: {kind: disc, centre: [0.5, 0.75], radius: 0.15}}
clock: {end: 0.5, step: auto, safety: 1.0, frames: 2}
output: {fields: [u, phi]}
"""


def fields(dim):
    low, length = (0.25, -1.0, 0.5)[:dim], (2.0,) * dim
    centre, speeds = (0.3, 0.4, 0.5)[:dim], (0.3, -0.7, 0.2)[:dim]
    return Vortex(low, length, 1.5), Rotation(centre, 2.0), Translation(speeds), Deformation(low, length, 0.7)


def grid(n, dim=2):
    return Grid((n,) * dim, 2.0 / n, (0.25, -1.0, 0.5)[:dim])


def walls(g, kind="no-slip"):
    return Edges(g, tuple((Side(kind), Side(kind)) for _ in g.axes))


def error(field, g):
    found = curl(g, field)
    exact = [np.broadcast_to(field.velocity(*g.points(face=a))[a], g.shape) for a in g.axes]
    return max(np.abs(g.padded(u) - v).max() for u, v in zip(found, exact, strict=True))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("which", range(4))
def test_velocity_is_the_closed_form_to_second_order_and_has_no_divergence(which, dim):
    field = fields(dim)[which]
    coarse, fine = (error(field, grid(n, dim)) for n in (16, 32))
    if which in (1, 2):
        assert coarse < 1e-12  # differences of a quadratic are exact
    else:
        assert np.log2(coarse / fine) > 1.9
        assert coarse < 0.3
    g = grid(16, dim)
    u = curl(g, field)
    divergence = sum(np.diff(g.inside(u[a], face=a), axis=a) for a in g.axes) / g.h
    assert np.abs(divergence).max() < 1e-11
    assert max(np.abs(q).max() for q in u) > 0.1


def test_the_vortex_is_that_of_the_book():
    x, y = np.array([0.2]), np.array([0.6])
    u, v = Vortex((0.0, 0.0), (1.0, 1.0)).velocity(x, y)
    assert u == pytest.approx(-(np.sin(0.2 * np.pi) ** 2) * np.sin(1.2 * np.pi))
    assert v == pytest.approx(np.sin(0.4 * np.pi) * np.sin(0.6 * np.pi) ** 2)
    w = Deformation((0.0,) * 3, (1.0,) * 3).velocity(x, y, np.array([0.3]))
    assert w[0] == pytest.approx(2 * np.sin(0.2 * np.pi) ** 2 * np.sin(1.2 * np.pi) * np.sin(0.6 * np.pi))
    assert w[2] == pytest.approx(-np.sin(0.4 * np.pi) * np.sin(1.2 * np.pi) * np.sin(0.3 * np.pi) ** 2)


def test_over_a_step_the_velocity_is_its_mean_and_then_that_of_the_moment():
    g = grid(8)
    motion = Motion(g, walls(g), Translation((1.0, 0.0)), period=2.0)
    path = 0.0
    for dt in (0.3, 0.9, 0.8):
        motion.begin(dt)
        path += motion.u[0][0] * dt
        motion.end(dt)
        assert path == pytest.approx(2.0 / np.pi * np.sin(np.pi * motion.t / 2.0), abs=1e-15)
        assert motion.u[0][0] == pytest.approx(np.cos(np.pi * motion.t / 2.0), abs=1e-15)
    assert abs(path) < 1e-15  # t = 2: back


def test_the_longest_step_is_taken_at_once_by_every_transport():
    for n in (16, 64):
        g = grid(n)
        motion, carrier = Motion(g, walls(g), fields(2)[0]), Transport(g, walls(g), "upwind5", centring=4)
        dt = motion.longest_step()["advective"]
        carrier.advance([g.field()], motion.u, dt)
        assert carrier.substeps == 1
        carrier.advance([g.field()], motion.u, 1.3 * dt)
        assert carrier.substeps == 2


@pytest.mark.parametrize("carry", ["field", "map"])
@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_an_interface_goes_round_a_periodic_box_and_comes_home(carry, dtype):
    g = Grid((32, 32), 1.0 / 32)
    edges = walls(g, "periodic")
    motion = Motion(g, edges, Translation((1.0, 0.5)))
    carrier = Transport(g, edges, "upwind5", dtype=np.dtype(dtype), centring=4)

    def distance(x, y):
        return Ball((0.5, 0.5), 0.2).distance(x % 1.0, y % 1.0)

    body = Interface(g, edges, distance, transport=carrier, carry=carry)
    first = body.gauges(motion)
    for _ in range(200):
        motion.begin(0.01)
        body.move(motion, 0.01)
    last = body.gauges(motion)
    for name, value in first.items():
        assert last[name] == pytest.approx(value, rel=5e-3 if carry == "field" else 1e-4)
    assert first["volume"] == pytest.approx(np.pi * 0.04, rel=1e-6)
    near = np.abs(g.inside(body.fields()["phi"])) < 0.05
    exact = g.inside(g.sample(distance))
    assert np.abs(g.inside(body.phi) - exact)[near].max() < (2e-3 if carry == "field" else 1e-5)


def test_a_ball_in_space_is_measured_and_carried():
    g = Grid((16,) * 3, 1.0 / 16)
    edges = walls(g)
    motion = Motion(g, edges, Rotation((0.5, 0.5, 0.5), 1.0))
    body = Interface(
        g, edges, Ball((0.5, 0.6, 0.5), 0.25).distance, transport=Transport(g, edges, "upwind5"), carry="map"
    )
    for _ in range(20):
        body.move(motion, 0.02)
    found = body.gauges(motion)
    assert found["volume"] == pytest.approx(4 / 3 * np.pi * 0.25**3, rel=1e-4)
    assert found["area"] == pytest.approx(4 * np.pi * 0.25**2, rel=1e-3)
    where = (0.5 - 0.1 * np.sin(0.4), 0.5 + 0.1 * np.cos(0.4), 0.5)
    near = np.abs(g.inside(body.phi)) < 0.1
    assert np.abs(g.inside(body.phi) - Ball(where, 0.25).distance(*g.points(ghosts=0)))[near].max() < 1e-6


def test_redistancing_is_done_every_so_many_moves_and_keeps_the_line():
    g = Grid((32, 32), 1.0 / 32)
    edges, calls = walls(g), []

    def anew(grid, phi):
        calls.append(len(calls))
        return redistance(grid, phi, "closest-cubic")

    still = Motion(g, edges, Translation((0.0, 0.0)))
    body = Interface(g, edges, lambda x, y: (x - 0.5) ** 2 + (y - 0.5) ** 2 - 0.09, transport=Transport(g, edges),
                     redistance=anew, every=3)  # fmt: skip
    for _ in range(7):
        body.move(still, 0.01)
    assert len(calls) == 2
    exact = Ball((0.5, 0.5), 0.3).distance(*g.points(ghosts=0))
    near = np.abs(exact) < 3 * g.h
    assert np.abs(g.inside(body.phi) - exact)[near].max() < 1e-4


@pytest.mark.parametrize("factor", [1, 2, 5])
def test_refinement_keeps_polynomials_of_degree_five(factor):
    for dim in (2, 3):
        g = grid(8, dim)
        fine, q = refined(g, g.sample(lambda *x: sum(c**5 for c in x) - x[0] ** 2 * x[1] ** 3), factor)
        exact = fine.sample(lambda *x: sum(c**5 for c in x) - x[0] ** 2 * x[1] ** 3)
        assert fine.n == tuple(k * factor for k in g.n)
        assert np.abs(fine.inside(q - exact)).max() < 1e-10 * np.abs(exact).max()
    with pytest.raises(ValueError, match="at least 1"):
        refined(g, g.field(), 0)


@pytest.mark.parametrize("text", ["", "period: 0.5", "transport"])
def test_a_run_goes_on_bit_for_bit_from_any_state(text):
    change = {"motion.period": 0.5} if "period" in text else {}
    if text == "transport":
        change = {"bodies.0.transport": {"scheme": "upwind5", "carry": "map"}, "output.fields": ["Y", "phi"]}
    made = loads(SCENE, change | ({} if text else {"bodies.0.redistance": {"method": "closest-cubic", "every": 4}}))
    _, middle, last = frames(made)
    sim = build(made)
    for _ in range(5):
        sim.advance()
    *_, again = frames(made, resume=sim.state())
    assert last.ended == again.ended == "complete"
    assert middle.t == 0.25
    for name, (_, q) in last.fields.items():
        assert np.array_equal(q, again.fields[name][1]), name
    assert set(last.gauges) == {"t", "dt", "volume", "length"}


def test_a_motion_that_turns_back_takes_no_longer_step_when_it_stands_still():
    made = loads(SCENE, {"motion.period": 0.5, "clock.frames": 1})
    *_, last = frames(made)
    assert last.gauges["dt"][1:].max() <= 1.0001 * last.gauges["dt"][1:].min()
    assert abs(last.gauges["volume"][-1] / last.gauges["volume"][0] - 1) < 1e-3


@pytest.mark.parametrize(
    ("path", "value", "fault"),
    [
        ("motion", None, "fluid: is required, or a motion"),
        ("fluid", {"viscosity": 1.0}, "fluid: must not stand beside a motion"),
        ("motion", {"kind": "rotation", "rate": 1, "centre": [0]}, "motion.centre: must have 2 numbers, got 1"),
        ("motion", {"kind": "translation", "velocity": [1]}, "motion.velocity: must have 2 numbers, got 1"),
        ("motion", {"kind": "vortex", "period": 0}, "motion.period: must be positive, got 0"),
        ("motion", {"kind": "vertex"}, "motion.kind: must be one of vortex, rotation, translation, deformation"),
        ("output.fields", ["u", "p"], "output.fields.1: p: needs a fluid"),
        (
            "box.edges",
            {"x": [{"kind": "inflow", "velocity": [1, 0]}, "outflow"], "y": "no-slip"},
            "box.edges: a motion gives the velocity",
        ),
        ("bodies.0.kind", "membrane", "bodies.0.energy: is required"),
        ("bodies.0.redistance", {"method": "magic"}, "bodies.0.redistance.method: must be one of pde,"),
        ("bodies.0.redistance", {"method": "pde", "every": 0}, "bodies.0.redistance.every: must be at least 1"),
        ("bodies.0.shape.radius", 0.5, "bodies.0.shape: leaves the box along y"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(path, value, fault):
    with pytest.raises(SceneError) as caught:
        loads(SCENE, {path: value})
    assert any(line.startswith(fault) for line in caught.value.faults), caught.value.faults


def test_a_map_is_not_redistanced_and_a_membrane_needs_a_fluid():
    with pytest.raises(SceneError, match="a map makes φ anew"):
        loads(SCENE, {"bodies.0.transport.carry": "map", "bodies.0.redistance": {"method": "pde"}})
    drop = {"kind": "membrane", "shape": {"kind": "disc", "centre": [0.5, 0.5], "radius": 0.2}}
    drop |= {"energy": {"kind": "linear", "stiffness": 1.0}, "width": {"cells": 2}}
    with pytest.raises(SceneError, match=r"bodies.0.kind: membrane needs a fluid"):
        loads(SCENE, {"bodies.0": drop})
    g = grid(8)
    with pytest.raises(ValueError, match="nothing to redistance"):
        Interface(g, walls(g), abs, transport=Transport(g, walls(g)), carry="map", redistance=abs)


def test_an_interface_also_goes_with_a_fluid():
    text = SCENE.replace("motion: {kind: vortex}", "fluid: {viscosity: 0.01, initial: {kind: shear, rate: 1.0}}")
    *_, last = frames(loads(text, {"clock.step": 0.01, "output.fields": ["u", "p", "phi"]}))
    assert last.ended == "complete"
    assert last.gauges["volume"][-1] == pytest.approx(np.pi * 0.15**2, rel=1e-3)
    assert {"kinetic_energy", "energy_residual", "length"} <= set(last.gauges)


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_measures_do_not_depend_on_the_scale_of_the_field(scale):
    g = Grid((24,) * 2, 1.0 / 24)
    found = measures(g, scale * g.sample(Ball((0.5, 0.5), 0.3).distance))
    assert found["length"] == pytest.approx(0.6 * np.pi, rel=1e-6)
    assert found["volume"] == pytest.approx(0.09 * np.pi, rel=1e-6)


@pytest.mark.parametrize("carry", ["field", "map"])
@pytest.mark.parametrize("radius", [0.04, 0.3])
def test_eight_cells_and_a_body_smaller_than_one_are_survived(carry, radius):
    change = {"box.cells": 8, "bodies.0.shape": {"kind": "disc", "centre": [0.5, 0.5], "radius": radius}}
    change |= {"bodies.0.transport.carry": carry, "clock.end": 0.2}
    *_, last = frames(loads(SCENE, change))
    assert last.ended == "complete"
    assert np.isfinite(last.fields["phi"][1]).all()
    assert (last.gauges["volume"] >= 0.0).all()
