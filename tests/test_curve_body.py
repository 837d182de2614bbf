"""Elastic curves in space: the force is that of the energy and sums to zero, gauges, states, what is refused."""

import numpy as np
import pytest
import xarray as xr

from fsiwork.bodies.curve import Curve, ring
from fsiwork.bodies.laws import Linear, Quadratic
from fsiwork.build import parts
from fsiwork.core.edges import Edges, Side
from fsiwork.core.flow import Flow
from fsiwork.core.grid import Grid
from fsiwork.core.integrals import line_integral
from fsiwork.core.transport import Transport
from fsiwork.scene import SceneError, loads
from fsiwork.simulate import build, step
from fsiwork.studies import rings
from fsiwork.studies.fibres import PLACES, trace

CENTRE = (1.03, 0.97, 1.02)
SCENE = """
box: {length: [2, 2, 2], cells: 16}
fluid: {density: 1, viscosity: 0.2}
bodies: [{kind: curve, shape: {kind: ring, centre: [1, 1, 1], radius: 0.5}, stretch: 1.25,
          energy: {kind: quadratic, stiffness: 1}, width: {cells: 2.2}}]
clock: {end: 0.02, step: 0.01}
"""


def curve(n=24, kind="no-slip", levels=None, eps=0.24, law=None, **options):
    grid = Grid((n,) * 3, 2 / n)
    edges = Edges(grid, (*((Side(kind),) * 2,) * 2, (Side("no-slip"),) * 2))
    levels = levels or ring(CENTRE, 0.6, 2, 1.3)
    body = Curve(
        grid, edges, levels, law or Quadratic(1.0), eps, transport=Transport(grid, edges, "upwind5"), **options
    )
    return body, Flow(grid, edges, 1.0, 0.1)


def stirred(flow):
    """A velocity without divergence, from a vector potential on the edges that vanishes on the walls."""
    g, k = flow.grid, 0.5 * np.pi

    def potential(c):
        x = [g.coordinate(a, face=a != c, ghosts=3)[: g.shape[a]] for a in g.axes]
        x, y, z = np.meshgrid(*x, indexing="ij")
        walls = [np.sin(k * q) ** 2 for a, q in enumerate((x, y, z)) if a != c]
        return walls[0] * walls[1] * (np.cos(2 * y + z), np.sin(3 * z + x), np.cos(x + y))[c]

    A = [potential(c) for c in g.axes]
    for a in g.axes:
        b, c = (a + 1) % 3, (a + 2) % 3
        curl = (np.roll(A[c], -1, b) - A[c]) - (np.roll(A[b], -1, c) - A[b])
        flow.u[a][:] = curl.ravel() / g.h
    return flow


def power_and_rate(n, axis=2):
    """Power of the force in a velocity, and minus the rate of the energy of a curve that goes with it."""
    body, flow = curve(n, levels=ring(CENTRE, 0.6, axis, 1.3), eps=0.3)
    stirred(flow)
    body.push(flow, 0.0)
    g, d = flow.grid, 1e-4
    power = sum(float(np.vdot(g.inside(flow.force[a]), g.inside(flow.u[a]))) for a in g.axes) * g.cell_volume
    state, energies = body.state(), []
    for sign in (1, -1):
        body.restore(state)
        flow.u = [sign * u for u in flow.u]
        body.move(flow, d)
        energies.append(body.gauges(flow)["elastic_energy"])
        flow.u = [sign * u for u in flow.u]
    return power, -(energies[0] - energies[1]) / (2 * d)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_force_takes_from_the_energy_what_it_gives_to_the_fluid(axis):
    power, rate = power_and_rate(32, axis)
    assert abs(rate) > 0.005
    assert power == pytest.approx(rate, rel=0.03)


def test_the_force_sums_to_zero_and_points_to_the_centre():
    body, flow = curve(law=Linear(1.0))
    body.push(flow, 0.0)
    g = flow.grid
    for a in g.axes:
        assert abs(g.inside(flow.force[a], face=a).sum()) * g.cell_volume < 1e-12
    x, y, _ = g.points(face=0)
    inward = -g.padded(flow.force[0]) * (x - CENTRE[0]) / np.hypot(x - CENTRE[0], y - CENTRE[1])
    # ∮ H |cos²| dl of the circle: π, of which spreading takes a little
    assert inward.sum() * g.cell_volume == pytest.approx(np.pi, rel=0.02)


def test_gauges_of_a_ring():
    body, flow = curve(32)
    found = body.gauges(flow)
    assert found["length"] == pytest.approx(2 * np.pi * 0.6, rel=2e-3)
    assert found["length"] == pytest.approx(line_integral(flow.grid, tuple(body.levels), body.eps), rel=2e-3)
    assert found["rest_length"] == pytest.approx(2 * np.pi * 0.6 / 1.3, rel=2e-3)
    assert found["elastic_energy"] == pytest.approx(0.5 * 0.09 * 2 * np.pi * 0.6 / 1.3, rel=0.02)
    assert [found[f"centroid_{x}"] for x in "xyz"] == pytest.approx(CENTRE, abs=1e-3)
    assert found["stretch_max"] == pytest.approx(1.3, rel=1e-6)


def test_a_periodic_box_counts_the_ring_once():
    levels = ring((1.0, 1.0, 1.0), 0.6, 2, 1.0)
    shifted = lambda x, y, z: levels((x + 1.0) % 2.0, y, z)  # noqa: E731  through the side x = 0
    body, flow = curve(24, "periodic", levels=shifted)
    body.push(flow, 0.0)
    g = flow.grid
    assert body.gauges(flow)["length"] == pytest.approx(2 * np.pi * 0.6, rel=5e-3)
    plain, still = curve(24, "periodic", levels=levels)
    plain.push(still, 0.0)
    moved = np.roll(g.inside(still.force[1]), 12, axis=0)
    assert np.abs(g.inside(flow.force[1]) - moved).max() < 1e-10 * np.abs(moved).max()


def test_a_label_ends_the_curve():
    half = lambda x, y, z: (*ring(CENTRE, 0.6, 2, 1.0)(x, y, z), 0.5 + (x - CENTRE[0]) / 0.2)  # noqa: E731
    body, flow = curve(32, levels=half)
    assert body.gauges(flow)["length"] == pytest.approx(np.pi * 0.6, rel=5e-3)
    body.push(flow, 0.0)
    assert body.longest_step(flow)["elastic, tangential"] > 0.0


@pytest.mark.parametrize("carry", ["field", "map"])
@pytest.mark.parametrize("coupling", ["explicit", "stabilised"])
def test_a_ring_relaxes_and_goes_on_from_its_state(carry, coupling):
    body, flow = curve(20, law=Quadratic(1.0), eps=0.25, carry=carry, coupling=coupling)
    first = body.gauges(flow)
    for _ in range(3):
        step(flow, (body,), 0.02)
    kept = body.state(), flow.state()
    step(flow, (body,), 0.02)
    last, levels = body.gauges(flow), [q.copy() for q in body.levels]
    assert last["length"] < first["length"]
    assert last["elastic_energy"] < first["elastic_energy"]
    body.restore(kept[0])
    flow.restore(kept[1])
    step(flow, (body,), 0.02)
    assert all(np.array_equal(a, b) for a, b in zip(levels, body.levels, strict=True))


def test_nothing_of_a_curve_in_the_box_gives_nothing():
    body, flow = curve(8, levels=lambda x, y, z: (x + 9.0, y + 9.0))
    body.push(flow, 0.0)
    assert all(not q.any() for q in flow.force)
    assert body.gauges(flow)["length"] == 0.0
    assert set(body.longest_step(flow).values()) == {np.inf}


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_any_scale_of_the_fields_gives_the_same_length(scale):
    levels = lambda *x: [scale * q for q in ring(CENTRE, 0.6, 2, 1.0)(*x)]  # noqa: E731
    body, flow = curve(16, levels=levels, eps=0.3 * scale)
    plain, _ = curve(16, levels=ring(CENTRE, 0.6, 2, 1.0), eps=0.3)
    assert body.gauges(flow)["length"] == pytest.approx(plain.gauges(flow)["length"], rel=1e-10)


def test_what_cannot_be_a_curve_is_refused():
    grid = Grid((8, 8), 0.25)
    edges = Edges(grid, ((Side("no-slip"),) * 2,) * 2)
    with pytest.raises(ValueError, match="three directions"):
        Curve(grid, edges, lambda x, y: (x, y), Linear(1.0), 0.5, transport=Transport(grid, edges))
    with pytest.raises(ValueError, match="carry must be one of"):
        curve(8, carry="points")


def test_scenes_of_rings():
    (one,) = parts(loads(SCENE))[1]
    assert one.gauges(parts(loads(SCENE))[0])["stretch_max"] == pytest.approx(1.25, rel=1e-6)
    markers = {"bodies.0": {"kind": "markers", "shape": {"kind": "ring", "centre": [1, 1, 1], "radius": 0.5},
                            "energy": {"kind": "linear", "stiffness": 1}}}  # fmt: skip
    flow, (chain,) = parts(loads(SCENE, markers))
    assert chain.gauges(flow)["length"] == pytest.approx(np.pi, rel=1e-3)
    with pytest.raises(SceneError, match=r"bodies\.0\.shape: leaves the box along x"):
        loads(SCENE, {"bodies.0.shape.radius": 1.5})
    with pytest.raises(SceneError, match="a ring has 3 directions, the box 2"):
        loads(SCENE, {"box.length": [2, 2]})
    with pytest.raises(SceneError, match="must not lie across a periodic direction"):
        loads(SCENE, {"box.edges": "periodic"})
    with pytest.raises(SceneError, match="in space markers make a ring"):
        loads(
            SCENE, {"bodies.0": {**markers["bodies.0"], "shape": {"kind": "ball", "centre": [1, 1, 1], "radius": 0.5}}}
        )


FIBRE = {"box": {"length": [2, 1, 1], "cells": 32, "edges": {"x": "periodic", "y": "no-slip", "z": "periodic"}},
         "bodies.0.shape": {"kind": "fibre", "root": [1, 0, 0.5], "length": 0.5, "along": "y"}, "bodies.0.stretch": 1.0,
         "bodies.0.width": {"length": 0.125}, "bodies.0.transport": {"carry": "map", "scheme": "upwind5"}}  # fmt: skip


def test_a_fibre_ends_and_its_labels_are_found():
    sim = build(loads(SCENE, FIBRE))
    assert sim.gauges()["length"] == pytest.approx(0.5, rel=1e-3)
    x, y = trace(sim)
    assert np.abs(x - 1.0).max() < 1e-12
    assert y == pytest.approx(np.linspace(0.0, 0.5, PLACES), abs=1e-12)
    Y, g = sim.bodies[0].map.Y, sim.flow.grid
    g.padded(Y[0])[...] -= 0.3 * g.points()[1] ** 2  # sheared: x = 1 + 0.3 y²
    x, y = trace(sim)
    assert x == pytest.approx(1.0 + 0.3 * y**2, abs=1e-9)


def test_a_fibre_needs_room():
    with pytest.raises(SceneError, match=r"the fibre needs 0\.5 to either side along z"):
        loads(SCENE, FIBRE | {"bodies.0.width": {"length": 0.2}, "bodies.0.shape.root": [1, 0, 0.4]})
    with pytest.raises(SceneError, match=r"bodies\.0\.shape: leaves the box along y"):
        loads(SCENE, FIBRE | {"bodies.0.shape.length": 1.2})


def test_measures_of_a_ring_that_follows_its_markers():
    """A gap of one percent is found as such, and Z₃ that is the length's."""
    t = np.linspace(0.0, 1.0, 5)
    names = [f"{way}_{s:g}" for s in rings.STRETCHES for way in ("field", "map", "markers")] + ["fixed_1.25"]
    cells, columns = [32, 64], ("radius", "length", "stretch", "mean_stretch", "kinetic_energy", "elastic_energy")
    data = {name: np.zeros((len(names), 2, 5)) for name in columns}
    for i, name in enumerate(names):
        way, s = name.split("_")
        for k, n in enumerate(cells):
            error = 0.0 if way == "markers" else 0.01 * (32 / n) ** 2
            radius = 0.4 * (float(s) + (1 - float(s)) * t)
            data["radius"][i, k] = radius * (1 - error * t)
            data["length"][i, k] = 2 * np.pi * data["radius"][i, k]
            data["stretch"][i, k] = data["mean_stretch"][i, k] = radius / 0.4
            data["elastic_energy"][i, k] = 1 - t
    made = xr.Dataset({k: (("case", "cells", "row"), q) for k, q in data.items()}, {"case": names, "cells": cells})
    found = rings.measure({"curve_ring": made})
    assert found["gap_field_1.25_32"] == pytest.approx(1.0)
    assert found["gap_1.5"] == pytest.approx(0.25)
    assert found["of_change_1.25"] == pytest.approx(0.25 * 0.4 / 0.1, rel=1e-6)
    assert found["z3_order"] == pytest.approx(2.0, abs=0.02)
    assert found["made_1.25"] == 0.0
