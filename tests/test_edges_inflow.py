"""What comes in at an inflow side: φ as it stands there, never φ < 0 out of nothing; Y as of the fluid outside."""

import numpy as np
import pytest

from fsiwork import scene, simulate
from fsiwork.bodies.backward import BackwardMap
from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.transport import Transport

WALL, OUT = Side("no-slip"), Side("outflow")


def channel(n=32, high=False, axis=0, dim=2):
    """Grid, edges and velocity of a uniform flow along an axis, from its low or its high side."""
    sign = -1.0 if high else 1.0
    inlet = Side("inflow", tuple(sign * (a == axis) for a in range(dim)))
    grid = Grid((n,) * dim, 1.0 / n, (0.0,) * dim)
    pairs = [(Side("free-slip"),) * 2 for _ in range(dim)]
    pairs[axis] = (OUT, inlet) if high else (inlet, OUT)
    u = [grid.field() for _ in range(dim)]
    u[axis][:] = sign
    return grid, Edges(grid, tuple(pairs)), u


@pytest.mark.parametrize("high", [False, True])
@pytest.mark.parametrize("axis", [0, 1])
def test_ghosts_are_the_first_cell_at_an_inflow_and_go_on_linearly_elsewhere(axis, high):
    grid, edges, _ = channel(8, high, axis)
    q = grid.sample(lambda x, y: 3.0 * x - 2.0 * y).copy()
    exact = np.moveaxis(grid.padded(q).copy(), axis, 0)
    edges.fill_scalar(q, "linear")
    found = np.moveaxis(grid.padded(q), axis, 0)
    core = slice(GHOSTS, -GHOSTS)
    inlet, outlet = (slice(-GHOSTS, None), slice(None, GHOSTS)) if high else (slice(None, GHOSTS), slice(-GHOSTS, None))
    first = found[-GHOSTS - 1 if high else GHOSTS]
    assert np.array_equal(found[inlet][:, core], np.broadcast_to(first[core], (GHOSTS, grid.n[1 - axis])))
    assert found[outlet][:, core] == pytest.approx(exact[outlet][:, core], abs=1e-13)


@pytest.mark.parametrize("scheme", ["weno5", "upwind5", "upwind1"])
@pytest.mark.parametrize("high", [False, True])
def test_what_falls_towards_the_inlet_does_not_turn_negative(scheme, high):
    """φ falls to 0.05 at the inlet: extrapolated, φ < 0 would come in from t = 0.05 / slope on."""
    grid, edges, u = channel(32, high)
    phi = grid.sample(lambda x, y: 0.05 + 0.5 * ((1.0 - x) if high else x) + 0.0 * y).copy()
    carrier = Transport(grid, edges, scheme)
    for _ in range(100):
        carrier.advance([phi], u, 0.01, "linear")
    last = grid.inside(phi)[-1 if high else 0]
    assert grid.inside(phi).min() > 0.04
    assert last == pytest.approx(0.05 + 0.5 * 0.5 / 32, abs=0.5 * 0.5 / 32)  # to half a cell


@pytest.mark.parametrize("high", [False, True])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_map_of_a_uniform_flow_is_exact(axis, high):
    grid, edges, u = channel(16, high, axis)
    back = BackwardMap(grid, edges, Transport(grid, edges, "weno5"))
    start = [Y.copy() for Y in back.Y]
    for _ in range(60):
        back.move(u, 0.05)
    for a, (Y, first) in enumerate(zip(back.Y, start, strict=True)):
        gone = 3.0 * (-1.0 if high else 1.0) * (a == axis)
        assert grid.inside(Y) == pytest.approx(grid.inside(first) - gone, abs=1e-10)


@pytest.mark.parametrize("carry", ["field", "map"])
def test_a_heavy_drop_held_in_a_stream_brings_no_other(carry):
    """Before, φ < 0 came in along the walls from t = 1.5 on."""
    inlet = {"kind": "inflow", "velocity": [1.0, 0.0], "profile": "parabolic"}
    drop = {"kind": "membrane", "shape": {"kind": "disc", "centre": [0.6, 0.5], "radius": 0.2}, "width": {"cells": 1.5}}
    drop |= {"energy": {"kind": "linear", "stiffness": 1.0}, "inside": {"density": 1000.0, "viscosity": 0.02}}
    drop |= {"coupling": "explicit", "transport": {"carry": carry}}
    data = {
        "box": {"length": [2.0, 1.0], "cells": 24, "edges": {"x": [inlet, "outflow"], "y": "no-slip"}},
        "fluid": {"density": 1.0, "viscosity": 0.02},
        "bodies": [drop],
        "clock": {"end": 2.25, "step": "auto", "frames": 1},
    }
    for frame in simulate.frames(scene.Scene.model_validate(data)):
        phi = frame.fields["phi"][1]
    assert frame.ended == "complete"
    assert phi[:3].min() > 0.2  # at first 0.38 in the middle of the inlet
