"""Planes of symmetry: a box and its eighth give the same flow and interface; what crosses them is mirrored."""

import numpy as np
import pytest
from pydantic import ValidationError

from fsiwork import scene
from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.simulate import build

SHAPE = {"kind": "ellipsoid", "centre": [0.0, 0.0, 0.0], "semi_axes": [0.8, 0.5, 0.6]}


def made(part, far="free-slip", shape=SHAPE, **body):
    """An ellipsoid that bends in a box of 20³ cells, or in the eighth of it where all coordinates are positive."""
    near = {"whole": far, "eighth": "symmetry"}[part]
    side, low = (1.0, 0.0) if part == "eighth" else (2.0, -1.0)
    membrane = {
        "kind": "membrane",
        "shape": shape,
        "energy": {"kind": "quadratic", "stiffness": 100.0},
        "bending": 1.0,
        "width": {"cells": 3},
        "coupling": "stabilised",
    }
    return scene.Scene.model_validate(
        {
            "box": {
                "length": [side] * 3,
                "cells": int(10 * side),
                "origin": [low] * 3,
                "edges": {a: [near, far] for a in "xyz"},
            },
            "fluid": {"density": 1.0, "viscosity": 0.5},
            "bodies": [membrane | body],
            "clock": {"end": 0.05, "step": 0.01, "frames": 1},
        }
    )


@pytest.mark.parametrize(
    "body",
    [
        {"coupling": "explicit"},
        {"coupling": "semi-implicit"},
        {},
        {"renew": 1},
        {"form": "adjoint", "transport": {"scheme": "upwind5"}, "renew": 2},
    ],
)
def test_an_eighth_is_the_whole(body):
    whole, eighth = (build(made(part, **body)) for part in ("whole", "eighth"))
    before = whole.bodies[0].phi.copy()
    for sim in (whole, eighth):
        for _ in range(5):
            assert sim.advance() == ""
    corner = (slice(10, None),) * 3
    for name in ("p", "phi", "u", "v", "w"):
        a = sim.flow.grid.axes["uvw".index(name)] if name in "uvw" else None
        found, other = (s.fields((name,))[name][1] for s in (eighth, whole))
        cut = tuple(slice(10, None) for _ in range(3)) if a is not None else corner
        shift = found - other[cut]
        shift -= shift.mean() if name == "p" else 0.0  # its mean over another box
        assert np.abs(shift).max() < 1e-9 * max(np.abs(other).max(), 1e-3), name
    assert np.abs(whole.bodies[0].phi - before).max() > 1e-3


def test_ghosts_at_a_plane_are_mirror_images_by_either_rule():
    grid = Grid((6, 5), 0.1)
    edges = Edges(grid, ((Side("symmetry"), Side("free-slip")), (Side("free-slip"), Side("symmetry"))))
    for rule in ("linear", "mirror"):
        q = grid.sample(lambda x, y: 3 * x**2 - y)
        edges.fill_scalar(q, rule)
        cells = grid.padded(q)
        own = slice(GHOSTS, -GHOSTS)
        assert np.array_equal(cells[:GHOSTS, own], cells[GHOSTS : 2 * GHOSTS, own][::-1])
        assert np.array_equal(cells[own, -GHOSTS:], cells[own, -2 * GHOSTS : -GHOSTS][:, ::-1])
    assert np.array_equal(cells[-GHOSTS:, own], cells[-2 * GHOSTS : -GHOSTS, own][::-1])


def test_both_ghosts_of_the_velocity_are_those_of_free_slip():
    grid = Grid((6, 5), 0.1)
    u = [np.random.default_rng(1).normal(size=grid.size) for _ in grid.axes]
    found = []
    for kind in ("symmetry", "free-slip"):
        mine = [q.copy() for q in u]
        Edges(grid, ((Side(kind),) * 2,) * 2).fill_velocity(mine)
        found.append(np.concatenate(mine))
        ends = Edges(grid, ((Side(kind),) * 2,) * 2).ends_velocity(0)
        assert ends == (("node", "node"), ("neumann", "neumann"))
    assert np.array_equal(*found)


def test_gravity_across_a_plane_of_symmetry_is_refused():
    plain = made("eighth").model_dump()
    for gravity in ([0.0, 0.0, -1.0], [0.1, 0.0, 0.0]):
        with pytest.raises(ValidationError) as caught:
            scene.Scene.model_validate(plain | {"fluid": plain["fluid"] | {"gravity": gravity}})
        axis = "xyz"[np.flatnonzero(gravity)[0]]
        fault = f"fluid.gravity: is not its own mirror image across the plane of symmetry along {axis}"
        assert scene.faults(caught.value) == [fault]


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"transport": {"carry": "map"}}, "bodies.0: at planes of symmetry only bodies that carry a field"),
        (
            {"shape": {**SHAPE, "centre": [0.1, 0.0, 0.0]}},
            "bodies.0.shape: crosses the plane of symmetry x = 0 and is not its own mirror image",
        ),
        (
            {"shape": {"kind": "moved", "shape": SHAPE, "angle": 0.4, "shift": [0.0, 0.0, 0.0]}},
            "bodies.0.shape: crosses the plane of symmetry x = 0 and is not its own mirror image",
        ),
        ({"shape": {**SHAPE, "semi_axes": [1.2, 0.5, 0.6]}}, "bodies.0.shape: leaves the box along x"),
    ],
)
def test_what_cannot_be_mirrored_is_refused(changes, fault):
    with pytest.raises(ValidationError) as caught:
        made("eighth", **changes)
    assert any(line.startswith(fault) for line in scene.faults(caught.value)), scene.faults(caught.value)
