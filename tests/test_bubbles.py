"""Bubbles: what they weigh, that they take it along, merge when their film is thin, and keep their volume."""

from types import SimpleNamespace

import numpy as np
import pytest

from fsiwork import scene, simulate
from fsiwork.bodies.bubbles import Bubbles
from fsiwork.core.edges import Edges, Side
from fsiwork.core.flow import Flow
from fsiwork.core.grid import Grid
from fsiwork.core.shapes import Ball
from fsiwork.core.transport import Transport

WALL, RING = Side("no-slip"), Side("periodic")


def made(
    n=32, dim=2, discs=((0.5, 0.25, 0.12), (0.5, 0.7, 0.15)), values=(10.0, 1.0), side=WALL, dtype=float, **options
):
    """Bubbles (x, y, radius) in a unit box, in 3D with z = 1/2."""
    grid = Grid((n,) * dim, 1.0 / n, (0.0,) * dim)
    edges = Edges(grid, ((side, side),) * dim)
    shapes = [Ball((x, y, 0.5)[:dim], r).distance for x, y, r in discs]
    options = {"boussinesq": True} | options
    transport = Transport(grid, edges, "weno5", dtype=np.dtype(dtype), centring=4)
    return Bubbles(grid, edges, shapes, values, 3.0 * grid.h, transport=transport, **options)


def flow_of(body, gravity=(0.0, -2.0, 0.0), rho=3.0):
    return Flow(body.grid, body.edges, rho, 0.01, gravity[: body.grid.dim])


def turning(body):
    """Faces of a rotation about the middle of the box, period 2π."""
    u = [body.grid.sample(lambda x, y: 0.5 - y, face=0), body.grid.sample(lambda x, y: x - 0.5, face=1)]
    return SimpleNamespace(u=[np.broadcast_to(q, body.phi.shape).copy() for q in u])


# ------------------------------------------------------------------------------------------------------- forces
@pytest.mark.parametrize("dim", [2, 3])
def test_buoyancy_lifts_with_the_displaced_weight(dim):
    body = made(32, dim)
    flow = flow_of(body)
    flow.begin()
    body.push(flow, 0.1)
    spread = (3.0 / 32) ** 2 * (1 / 3 - 2 / np.pi**2)  # ε² ∫r²ζ: ∫1 - H_ε of a disc is π(R² + spread)
    size = {2: lambda r: np.pi * (r**2 + spread), 3: lambda r: 4 / 3 * np.pi * (r**3 + 3 * r * spread)}[dim]
    total = body.grid.inside(flow.force[1], face=1).sum() * body.grid.cell_volume
    assert total == pytest.approx(3.0 * 2.0 * (10.0 * size(0.12) + size(0.15)), rel=5e-3)
    assert not flow.force[0].any()
    chi = body.grid.inside(body._share() * body.content)
    assert body.grid.inside(flow.force[1], face=1)[:, 1:-1] == pytest.approx(
        3.0 * (chi[:, 1:] + chi[:, :-1]), abs=1e-12
    )


def test_without_tension_and_gravity_nothing_moves():
    body = made(16)
    flow = flow_of(body, (0.0, 0.0, 0.0))
    for _ in range(3):
        simulate.step(flow, (body,), 0.1)
    assert all(not q.any() for q in flow.u)


def test_full_density_tends_to_boussinesq():
    """At the same lift the velocities differ by the contrast of the densities, and no more."""
    speeds = []
    for contrast in (3e-3, 3e-2):
        for boussinesq in (True, False):
            values = [10 * contrast, contrast]
            kind = {"boussinesq": True} if boussinesq else {"boussinesq": False, "viscosity": 0.01}
            body = made(32, values=values if boussinesq else [1 - q for q in values], **kind)
            flow = flow_of(body, (0.0, -1.0 / contrast, 0.0), 1.0)
            flow.theta = 1.0
            for _ in range(60):
                simulate.step(flow, (body,), 0.001)
            speeds.append(body.grid.inside(flow.u[1]).copy())
    near, far = (np.abs(a - b).max() / np.abs(a).max() for a, b in (speeds[:2], speeds[2:]))
    assert near < 0.03
    assert 5 < far / near < 15


# ------------------------------------------------------------------------------------------------ what goes along
@pytest.mark.parametrize("carry", ["field", "map"])
def test_density_goes_with_its_bubble(carry):
    body = made(48, carry=carry, values=(1000.0, 0.001))
    flow = turning(body)
    for _ in range(100):
        body.move(flow, np.pi / 2 / 100)
    content, (x, y) = body.grid.inside(body.content), (body.grid.coordinate(a) for a in (0, 1))
    x, y = x[:, None], y[None, :]
    low, high = ((x - cx) ** 2 + (y - cy) ** 2 < (0.9 * r) ** 2 for cx, cy, r in ((0.75, 0.5, 0.12), (0.3, 0.5, 0.15)))
    assert (body.grid.inside(body.phi) < 0)[low | high].all()
    assert (content[low] == 1000.0).all()
    assert (content[high] == 0.001).all()
    assert set(np.unique(content)) == {0.001, 1000.0}


def test_three_bubbles_of_two_densities_need_one_seam():
    body = made(32, discs=((0.2, 0.2, 0.1), (0.8, 0.2, 0.1), (0.5, 0.7, 0.1)), values=(2.0, 5.0, 2.0))
    assert len(body.seams) == 1
    content = body.grid.inside(body.content)
    assert (content[6, 6], content[25, 6], content[16, 22]) == (2.0, 5.0, 2.0)


def test_restored_bubbles_go_on_bit_for_bit():
    data = (scene.load("configs/scenes/bubbles.yaml", {"box.cells": 16, "clock.step": 0.01, "clock.end": 0.1}),) * 2
    one, two = (simulate.build(q) for q in data)
    for _ in range(5):
        one.advance()
    two.restore(one.state())
    for _ in range(3):
        assert not one.advance() and not two.advance()
    assert all(np.array_equal(one.state()[k], two.state()[k], equal_nan=True) for k in one.state())


# ------------------------------------------------------------------------------------------------------- merging
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(("film", "pieces"), [(0.0, 2), (0.07, 2), (0.09, 1)])
def test_a_film_breaks_below_its_thickness(dim, film, pieces):
    body = made(32, dim, discs=((0.5, 0.28, 0.15), (0.5, 0.66, 0.15)), film=film)  # 0.08 apart
    still = SimpleNamespace(u=[body.grid.field() for _ in body.grid.axes])
    assert body.pieces() == 2
    body.move(still, 0.1)
    assert body.pieces() == pieces


def test_pieces_across_a_periodic_side_are_one():
    assert made(32, discs=((0.02, 0.5, 0.1), (0.5, 0.5, 0.1)), side=WALL).pieces() == 2
    both = made(32, discs=((0.02, 0.5, 0.1), (0.97, 0.5, 0.1)))
    assert both.pieces() == 2
    both.edges = made(32, side=RING).edges
    assert both.pieces() == 1


def test_volume_is_kept():
    kept, alone = made(24, keep_volume=True), made(24)
    flow, first = turning(kept), kept.volume()
    for body in (kept, alone):
        for _ in range(60):
            body.move(flow, np.pi / 60)
    assert first == pytest.approx(np.pi * (0.12**2 + 0.15**2), rel=2e-3)
    assert abs(alone.volume() / first - 1) > 1e-4
    assert kept.volume() == pytest.approx(first, rel=1e-5)


# ------------------------------------------------------------------------------------------------------ extremes
@pytest.mark.parametrize(
    "options",
    [
        {"n": 8},
        {"discs": ((0.5, 0.5, 0.02), (0.5, 0.8, 0.01))},
        {"discs": ((0.5, 0.5, 1e-9),), "values": (1.0,)},
        {"discs": ((0.5, 0.4, 0.2), (0.5, 0.5, 0.2))},
        {"dtype": np.float32},
        {"boussinesq": False, "viscosity": 1e-5, "values": (1e-3, 1e3)},
    ],
)
def test_extremes_stay_finite(options):
    body = made(**({"n": 16} | options), film=0.05, keep_volume=True, tension=0.1)
    flow = flow_of(body)
    for _ in range(5):
        simulate.step(flow, (body,), 1e-3)
    assert all(np.isfinite(q).all() for q in (*flow.u, flow.p, *body.fields().values()))
    gauges = body.gauges(flow)
    assert np.isfinite([gauges["volume"], gauges["length"], gauges["pieces"]]).all()


def test_bad_arguments_are_refused():
    for options in ({"values": (1.0,)}, {"viscosity": 1.0}, {"boussinesq": False}, {"carry": "map", "film": 0.1}):
        with pytest.raises(ValueError, match=r"one value|viscosity|map"):
            made(8, **options)


FAULTS = {
    "bodies.0.parts.0.density=1": "bodies.0.parts.0: give either density or buoyancy, got both",
    "bodies.0.parts=[]": "bodies.0.parts: must have at least 1 items",
    "bodies.0.tension=-1": "bodies.0.tension: must not be negative, got -1",
    "bodies.0.film=.nan": "bodies.0.film: ",
    "bodies.0.viscosity=1": "bodies.0.viscosity: bubbles with a buoyancy have the viscosity of the fluid",
    "bodies.0.transport.carry=map": "bodies.0.film: needs transport.carry: field",
    "bodies.0.parts.1.shape.radius=0.9": "bodies.0.parts.1.shape: leaves the box",
    "bodies.0.parts.0.buoyancy=heavy": "bodies.0.parts.0.buoyancy: must be a number",
}


@pytest.mark.parametrize("setting", FAULTS)
def test_bad_scenes_get_one_line_each(setting):
    path, value = setting.split("=")
    with pytest.raises(scene.SceneError) as error:
        scene.load("configs/scenes/bubbles.yaml", {path: scene.parse(value)})
    assert error.value.faults[0].startswith(FAULTS[setting])
    assert "\n" not in error.value.faults[0]
