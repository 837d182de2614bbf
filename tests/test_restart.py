"""A map that starts anew when it is wound up: quintics between points, what pays, what it costs when it is off."""

from pathlib import Path

import numpy as np
import pytest

from fsiwork.bodies.backward import BackwardMap, Rest
from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import sampling
from fsiwork.core.transport import Transport
from fsiwork.scene import SceneError, load
from fsiwork.simulate import build

SCENE = Path(__file__).resolve().parents[1] / "configs" / "scenes" / "sheared_drop.yaml"
TREADING = {
    "box.cells": 32,
    "clock": {"end": 8.0, "step": 0.02, "frames": 1},
    "bodies.0.shape": {"kind": "ellipse", "centre": [0.0, 0.0], "semi_axes": [0.3, 0.2]},
    "bodies.0.energy": {"kind": "quadratic", "stiffness": 5.0},
    "bodies.0.coupling": "stabilised",
    "bodies.0.width.cells": 2,
    "bodies.0.transport.scheme": "upwind5",
}


def sampled(grid, q, places):
    """A flat field at places given as flat fields."""
    out = np.full(grid.size, np.nan)
    low = GHOSTS - 0.5 - np.array(grid.origin) / grid.h
    kernel = getattr(sampling, f"sample_{grid.dim}d")
    kernel(out, q, *places, *grid.rows(), np.array(grid.strides), np.array(grid.n), low, grid.h)
    return grid.inside(out)


@pytest.mark.parametrize("dim", [2, 3])
def test_quintics_are_exact_for_polynomials_of_degree_five(dim):
    grid = Grid((12, 10, 9)[:dim], 0.1, (0.3, -0.2, 0.1)[:dim])
    random = np.random.default_rng(dim)
    places = [o + random.uniform(0, n * grid.h, grid.size) for o, n in zip(grid.origin, grid.n, strict=True)]
    power = random.normal(size=(dim, 6))

    def product(*x):
        return np.prod([np.polyval(p, q) for p, q in zip(power, np.broadcast_arrays(*x), strict=True)], axis=0)

    found = sampled(grid, np.array(grid.sample(product)), places)
    assert np.abs(found - grid.inside(product(*places))).max() < 1e-11


def test_quintics_are_of_sixth_order():
    errors = []
    for n in (16, 32):
        grid = Grid((n, n), 1 / n)
        q = np.array(grid.sample(lambda x, y: np.sin(5 * x) * np.cos(4 * y)))
        x, y = np.random.default_rng(n).uniform(0, 1, (2, grid.size))
        errors.append(np.abs(sampled(grid, q, [x, y]) - grid.inside(np.sin(5 * x) * np.cos(4 * y))).max())
    assert np.log2(errors[0] / errors[1]) > 5.5


def test_a_plane_extruded_has_the_values_of_its_plane():
    plane, block = Grid((10, 8), 0.1), Grid((10, 8, 6), 0.1)
    random = np.random.default_rng(3)
    q, (x, y) = random.normal(size=plane.size), random.uniform(0, 0.8, (2, plane.size))

    def extrude(f):
        return np.repeat(f, block.shape[2])

    z = random.uniform(0, 0.6, block.size)
    found = sampled(block, extrude(q), [extrude(x), extrude(y), z])
    assert np.abs(found - sampled(plane, q, [x, y])[:, :, None]).max() < 1e-12


def test_places_that_are_far_out_or_no_number():
    grid = Grid((8, 8), 0.125)
    q = np.array(grid.sample(lambda x, y: x + 2 * y))
    x, y = np.full(grid.size, 0.5), np.full(grid.size, 99.0)
    assert sampled(grid, q, [x, y]) == pytest.approx(0.5 + 2 * (1 + 0.5 * grid.h))  # the first ghost
    assert np.isnan(sampled(grid, q, [x, np.full(grid.size, np.nan)])).all()
    assert sampled(grid, q, [x, np.full(grid.size, -np.inf)]) == pytest.approx(0.5 - grid.h)


@pytest.mark.parametrize("periodic", [True, False])
def test_a_map_that_starts_anew_keeps_its_level(periodic):
    """A turn by half a revolution in four parts: Y is x each time, and φ that of one turn, to the scheme's errors."""
    grid = Grid((48, 48), 2 / 48, (-1.0, -1.0))
    side = Side("periodic" if periodic else "free-slip")
    edges = Edges(grid, ((side, side), (side, side)))
    map = BackwardMap(grid, edges, Transport(grid, edges, "upwind5"))
    rest, phi = Rest(map, lambda x, y: np.hypot(x - 0.25, y) - 0.4, 1.5), grid.field()
    r = np.linspace(0, 1.5, 3001)
    stream = np.cumsum(r * np.cos(0.5 * np.pi * np.clip((r - 0.8) / 0.18, 0, 1)) ** 2) * r[1]  # solid up to r = 0.8

    def psi(x, y):
        return np.interp(np.hypot(x, y), r, stream)

    h = 0.5 * grid.h
    u = [
        np.array(grid.sample(lambda x, y: (psi(x, y - h) - psi(x, y + h)) / grid.h, face=0)),
        np.array(grid.sample(lambda x, y: (psi(x + h, y) - psi(x - h, y)) / grid.h, face=1)),
    ]
    for part in range(1, 5):
        for _ in range(40):
            map.move(u, np.pi / 160)
        rest.level(phi)
        before = phi.copy()
        rest.begin(phi)
        assert rest.often[0] == part
        rest.level(phi)
        assert np.abs(grid.inside(phi - before)).max() < 1e-12
    wanted = grid.inside(grid.sample(lambda x, y: np.hypot(x + 0.25, y) - 0.4))
    near = np.abs(wanted) < 0.1
    assert np.abs(grid.inside(phi) - wanted)[near].max() < 2e-3


def run(**changes):
    """A membrane that tank-treads, at its end; why it has diverged, if it has."""
    sim = build(load(SCENE, TREADING | changes))
    while sim.steps < sim.total:
        if ended := sim.advance():
            return sim, ended
    return sim, ""


def test_it_pays_when_a_membrane_tank_treads():
    """More than half a revolution: without restarts Y winds up beyond what the grid shows, and the volume is lost."""
    volume = np.pi * 0.3 * 0.2
    errors = {}
    for restart in (None, 3.0):
        sim, ended = run(**{"bodies.0.transport.restart": restart})
        assert not ended
        errors[restart] = abs(sim.gauges()["geometric_volume"] / volume - 1)
    assert sim.bodies[0]._rest.often[0] > 3
    assert errors[3.0] < 0.02
    assert errors[None] > 20 * errors[3.0]


def test_one_that_never_starts_anew_is_as_if_it_could_not():
    changes = {"clock": {"end": 0.4, "step": 0.02, "frames": 1}}
    never, off = (run(**changes, **{"bodies.0.transport.restart": r})[0] for r in (1e9, None))
    assert never.bodies[0]._rest.often[0] == 0
    assert np.array_equal(never.bodies[0].phi, off.bodies[0].phi)
    assert set(never.state()) - set(off.state()) == {"body0.rest", "body0.often"}


@pytest.mark.parametrize(
    ("scene", "changes", "line"),
    [
        ("sheared_drop", {"bodies.0.transport.restart": 1}, "bodies.0.transport.restart: must be above 1, got 1"),
        ("sheared_drop", {"bodies.0.transport": {"restart": 2}}, "bodies.0.transport.restart: is for carry: map"),
        ("sheared_drop", {"bodies.0.renew": 2}, "bodies.0.renew: is for transport.carry: field; a map makes φ anew"),
        (
            "blob",
            {"bodies.0.transport": {"carry": "map", "restart": 2}},
            "bodies.0.transport.restart: is for bodies of kind membrane",
        ),
        (
            "sheared_drop",
            {
                "bodies.0.transport.restart": 2,
                "box.edges": {"x": [{"kind": "inflow", "velocity": [1, 0]}, "outflow"], "y": "no-slip"},
            },
            "bodies.0.transport.restart: needs a box without inflow",
        ),
    ],
)
def test_where_it_does_not_fit_a_line_says_so(scene, changes, line):
    with pytest.raises(SceneError) as caught:
        load(SCENE.with_name(f"{scene}.yaml"), changes)
    assert any(fault.startswith(line) for fault in caught.value.faults), caught.value.faults
