"""Transport beyond the WENO family: the annex's schemes, semi-Lagrangian steps, a narrow band, 1.5.1's velocity."""

import numpy as np
import pytest

from fsiwork.build import parts
from fsiwork.core import levelset, schemes1d
from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.pieces import Pieces
from fsiwork.core.transport import SPLIT, Transport
from fsiwork.scene import Scene

ORDERS = {
    "centred": 1.9, "eno2": 1.8, "eno3": 2.7,
    "lax-wendroff": 1.9, "beam-warming": 1.8, "fromm": 1.9, "semi-lagrangian": 2.7,
}  # fmt: skip


def edges(grid, kind="no-slip"):
    return Edges(grid, ((Side(kind),) * 2,) * grid.dim)


def sample(grid, function, face=None, dtype=np.float64):
    return grid.sample(function, face, dtype).copy()  # ours to write to


def vortex(grid):
    """Divergence-free and smooth on the unit square, at rest on its sides; constant in z."""
    flow = (
        lambda x, y, *z: -(np.sin(np.pi * x) ** 2) * np.sin(2 * np.pi * y) + 0 * sum(z),
        lambda x, y, *z: np.sin(np.pi * y) ** 2 * np.sin(2 * np.pi * x) + 0 * sum(z),
        lambda x, y, *z: 0 * (x + y + sum(z)),
    )
    return [sample(grid, f, face=a) for a, f in zip(grid.axes, flow, strict=False)]


def hill(x, y, *z):
    return np.exp(-(np.sin(np.pi * (x - 0.5)) ** 2 + np.sin(np.pi * (y - 0.7)) ** 2) / (np.pi * 0.2) ** 2) + 0 * sum(z)


def disc(x, y, *z):
    return np.hypot(x - 0.5, y - 0.7) - 0.15 + 0 * sum(z)


def joined_disc(x, y):
    """In a box of 1 by 50/64, the ends joined."""
    return np.hypot((x + 0.4) % 1 - 0.5, (y + 0.1) % (50 / 64) - 25 / 64) - 0.15


def sheared(scheme, n, drift=0.3, time=0.5):
    """Mean error in a shear flow with a drift, whose characteristics are known."""
    grid = Grid((n, n), 1 / n)
    transport = Transport(grid, edges(grid, "periodic"), scheme, centring=4)
    u = [sample(grid, lambda x, y: drift + 0 * (x + y), 0), sample(grid, lambda x, y: np.sin(2 * np.pi * x) + 0 * y, 1)]
    q, steps = sample(grid, hill), 2 * n
    for _ in range(steps):
        transport.advance([q], u, time / steps)

    def exact(x, y):
        home = x - drift * time
        return hill(home, y + (np.cos(2 * np.pi * x) - np.cos(2 * np.pi * home)) / (2 * np.pi * drift))

    return np.abs(grid.inside(q) - grid.inside(sample(grid, exact))).mean()


@pytest.mark.parametrize("scheme", ORDERS)
def test_order_in_a_drifting_shear(scheme):
    assert np.log2(sheared(scheme, 48) / sheared(scheme, 96)) > ORDERS[scheme]


@pytest.mark.parametrize("scheme", [s for s in ORDERS if s != "semi-lagrangian"])
@pytest.mark.parametrize("speed", [1.0, -1.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_along_one_axis_it_is_the_annex(scheme, speed, axis):
    n = [4, 4, 4]
    n[axis] = 24
    grid = Grid(n, 0.1)
    q = sample(grid, lambda *x: np.clip(np.abs(x[axis] - 1.0) - 0.4, -1.0, 0.5) + 0 * sum(x))
    u = [grid.field() + speed * (a == axis) for a in grid.axes]
    line = np.moveaxis(grid.inside(q), axis, 0)[:, 0, 0].copy()
    transport = Transport(grid, edges(grid), scheme)
    transport.advance([q], u, 0.03)
    p = np.pad(line, schemes1d.PAD, mode="reflect", reflect_type="odd")
    if speed < 0:
        p = p[::-1]
    stepping, halves = ("euler", 1 + (axis < 2)) if scheme in SPLIT else ("rk3", 1)  # Strang: the last axis is whole
    wanted = schemes1d.advance(p, 0.3 / halves, halves, scheme, stepping)[:: -1 if speed < 0 else 1]
    found = np.moveaxis(grid.inside(q), axis, 0)
    inner = slice(9, -9)  # as the ends are filled otherwise there
    wanted = np.broadcast_to(wanted[schemes1d.PAD : -schemes1d.PAD, None, None], found.shape)
    np.testing.assert_allclose(found[inner], wanted[inner], rtol=0, atol=1e-14)


@pytest.mark.parametrize("n", [(20, 17), (9, 10, 11)])
def test_semi_lagrangian_moves_cubics_exactly_and_far(n):
    grid = Grid(n, 0.1)
    speed = (0.9, -0.7, 0.3)[: grid.dim]
    u, time = [grid.field() + c for c in speed], 0.09  # 1.7 cells in one step: beyond what the other schemes take

    def cubic(*x):
        return x[0] ** 3 - 2 * x[1] ** 3 + x[0] ** 2 * x[1] ** 2 + x[-1] ** 3

    q = sample(grid, cubic)

    class Known:
        """Ghosts stay as sampled."""

        def fill_scalar(self, q, rule):
            pass

    transport = Transport(grid, Known(), "semi-lagrangian")
    transport.advance([q], u, time)
    assert transport.substeps == 1
    exact = sample(grid, lambda *x: cubic(*(c - time * v for c, v in zip(x, speed, strict=True))))
    np.testing.assert_allclose(grid.inside(q), grid.inside(exact), atol=1e-12)


@pytest.mark.parametrize("scheme", ["semi-lagrangian", "eno3", "fromm"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_extruded_field_gives_the_plane_result(scheme, axis):
    n = (19, 22)
    plane, deep = Grid(n, 1 / 20), Grid((*n[:axis], 5, *n[axis:]), 1 / 20)
    rng = np.random.default_rng(1)
    q, *u = (rng.uniform(-1, 1, plane.size) for _ in range(3))

    def extrude(field):
        full = np.broadcast_to(np.expand_dims(plane.padded(field), axis), deep.shape)
        return np.ascontiguousarray(full).ravel()

    q3, u3 = extrude(q), [extrude(c) for c in u]
    u3.insert(axis, deep.field())
    Transport(plane, edges(plane), scheme).advance([q], u, 0.02)
    Transport(deep, edges(deep), scheme).advance([q3], u3, 0.02)
    # Strang's halves fall on other axes in 3D
    reach = 0.5 if scheme in SPLIT and axis == 2 else 1e-13
    assert np.abs(np.moveaxis(deep.inside(q3), axis, 0) - plane.inside(q)).max() <= reach


# --- band -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("n", "kind"), [((67, 81), "no-slip"), ((64, 50), "periodic"), ((24, 20, 34), "no-slip")])
@pytest.mark.parametrize("scheme", ["weno5", "weno-z", "upwind1", "eno3", "fromm", "semi-lagrangian"])
def test_one_step_of_a_band_is_that_of_the_clipped_field(n, kind, scheme):
    grid = Grid(n, 1 / max(n))
    u = vortex(grid)
    q = sample(grid, joined_disc if kind == "periodic" else disc)
    band, whole = (Transport(grid, edges(grid, kind), scheme, band=b) for b in (6, None))
    band.advance([q], u, 0.0)  # clips
    level = np.abs(grid.inside(q)).max()
    assert level == pytest.approx(6 * grid.h, rel=0.02)
    wanted = q.copy()
    dt = 0.3 * grid.h
    band.advance([q], u, dt)
    whole.advance([wanted], u, dt)
    assert band.substeps == whole.substeps == 1
    found, wanted = grid.inside(q), grid.inside(wanted)
    near = np.abs(wanted) < level - 3 * grid.h
    assert near.sum() > 50
    np.testing.assert_allclose(found[near], wanted[near], rtol=0, atol=1e-15)
    # at the edge only what is nearly flat stays behind
    assert np.abs(found - wanted).max() < 0.02 * level
    assert band._pieces.start.size * band._pieces.n < 0.8 * grid.cells


def test_a_band_follows_the_interface_as_the_whole_field_does():
    grid = Grid((128, 128), 1 / 128)
    u, steps, time = vortex(grid), 128, 0.5
    whole, narrow = sample(grid, disc), sample(grid, disc)
    full, band = Transport(grid, edges(grid)), Transport(grid, edges(grid), band=6)
    for _ in range(steps):
        full.advance([whole], u, time / steps)
        band.advance([narrow], u, time / steps)
    assert np.abs(grid.inside(whole) - sample(grid, disc).reshape(grid.shape)[3:-3, 3:-3]).max() > 10 * grid.h
    whole, narrow = grid.inside(whole), grid.inside(narrow)
    near = np.abs(whole) < grid.h
    assert np.abs(whole - narrow)[near].max() < 0.05 * grid.h
    assert ((whole < 0) != (narrow < 0)).sum() == 0


def test_pieces_are_where_the_field_is_not_flat():
    for n in ((40, 50), (14, 22, 35), (8, 8), (8, 17)):
        grid = Grid(n, 1 / 20)
        rng = np.random.default_rng(5)
        q = grid.field() + 1.0
        grid.inside(q)[tuple(rng.integers(0, k) for k in n)] = 0.5
        edges(grid).fill_scalar(q, "mirror")
        found = Pieces(grid, 3)
        found.find(q)
        marked = np.zeros(grid.size, bool)
        around = np.zeros(grid.size, bool)
        for flags, starts in ((marked, found.start), (around, found.around)):
            for I in starts:
                flags[I : I + found.n] = True
        p = grid.padded(q)
        rough = sum(np.abs(np.roll(p, -1, a) - p) for a in grid.axes) > 0
        assert grid.inside(marked)[grid.inside(rough.ravel())].all()
        for a in grid.axes:  # a stencil's three cells on either side
            for k in (-3, -2, -1, 1, 2, 3):
                reached = np.zeros(n, bool)
                there = np.moveaxis(grid.inside(marked), a, 0)
                np.moveaxis(reached, a, 0)[...] = np.roll(there, k, 0)
                assert grid.inside(around)[reached].all()


def test_a_scene_may_ask_for_a_band_of_an_interface_only():
    def scene(body):
        box = {"length": [1.0, 1.0], "cells": 32, "edges": "walls"}
        motion = {"kind": "vortex"}
        shape = {"kind": "disc", "centre": [0.5, 0.7], "radius": 0.15}
        clock, output = {"end": 0.1, "step": 0.01}, {"fields": ["phi"]}
        return {"box": box, "motion": motion, "bodies": [body | {"shape": shape}], "clock": clock, "output": output}

    body = {"kind": "interface", "transport": {"scheme": "eno3", "band": 6}}
    found = parts(Scene.model_validate(scene(body)))[1][0].transport
    assert (found.scheme, found._pieces.band) == ("eno3", 6.0)
    kept = Scene.model_validate(scene({"kind": "interface", "transport": {"from_interface": True}}))
    assert len(parts(kept)[1][0].transport._ahead) == 2
    for wrong in (
        {"kind": "interface", "transport": {"from_interface": True, "carry": "map"}},
        {"kind": "interface", "transport": {"from_interface": True, "scheme": "fromm"}},
        {"kind": "membrane", "energy": {"kind": "linear", "stiffness": 1.0}, "width": {"cells": 3}}
        | {"transport": {"from_interface": True}},
    ):
        with pytest.raises(ValueError, match="from_interface"):
            Scene.model_validate(scene(wrong))
    for wrong in (
        {"kind": "interface", "transport": {"band": 2}},
        {"kind": "interface", "transport": {"band": 6, "carry": "map"}},
        {"kind": "membrane", "energy": {"kind": "linear", "stiffness": 1.0}, "width": {"cells": 3}}
        | {"transport": {"band": 6}},
    ):
        with pytest.raises(ValueError, match="band"):
            Scene.model_validate(scene(wrong))


def test_a_band_clips_only_what_is_high():
    grid = Grid((64, 64), 1 / 64)
    q = sample(grid, disc)
    low = np.clip(q, -4 / 64, 4 / 64)
    found = Pieces(grid, 6)
    found.find(kept := low.copy())
    np.testing.assert_array_equal(kept, low)
    found.find(q)
    assert np.abs(q).max() == pytest.approx(6 / 64, rel=2e-3)


# --- 1.5.1 ----------------------------------------------------------------------------------------------------
def slopes(grid, q, cells):
    """Least and largest |∇φ| within so many cells of the interface."""
    norm = grid.inside(levelset.gradient_norm(grid, q))
    near = norm[np.abs(grid.inside(q)) < cells * grid.h]
    return near.min(), near.max()


@pytest.mark.parametrize("n", [(96, 96), (64, 64, 5)])
def test_velocity_of_the_interface_keeps_a_distance_where_that_at_the_point_does_not(n):
    grid = Grid(n, 1 / n[0])
    u, steps, time = vortex(grid), n[0] // 2, 0.15
    plain, kept = sample(grid, disc), sample(grid, disc)
    local = Transport(grid, edges(grid), "weno-z")
    ahead = Transport(grid, edges(grid), "weno-z", from_interface=True)
    for _ in range(steps):
        local.advance([plain], u, time / steps)
        ahead.advance([kept], u, time / steps)
    lost, found = slopes(grid, plain, 2), slopes(grid, kept, 2)
    assert lost[0] < 0.8 and lost[1] > 1.3
    assert found[0] > 0.97 and found[1] < 1.03
    plain, kept = grid.inside(plain), grid.inside(kept)
    on_it = np.abs(plain) < 0.1 * grid.h
    assert on_it.any() and np.abs(kept[on_it]).max() < 0.2 * grid.h
    assert ((plain < 0) != (kept < 0)).mean() < 1e-3


def test_velocity_of_the_interface_is_the_books():
    grid = Grid((32, 32), 1 / 32)
    transport = Transport(grid, edges(grid, "periodic"), from_interface=True)
    u, q = vortex(grid), sample(grid, lambda x, y: (x - 0.4) * 0.6 + (y - 0.5) * 0.8)
    found = transport._ahead_of(u, q, *grid.rows())
    x, y = grid.points(0)
    d = (x - 0.4) * 0.6 + (y - 0.5) * 0.8
    x, y = x - 0.6 * d, y - 0.8 * d
    wanted = -(np.sin(np.pi * x) ** 2) * np.sin(2 * np.pi * y)
    assert np.abs(grid.inside(found[0], 0) - grid.inside(wanted.ravel(), 0)).max() < 3e-4


def test_what_does_not_go_together_is_refused():
    grid = Grid((8, 8), 0.1)
    for words in ({"scheme": "fromm"}, {"scheme": "semi-lagrangian"}, {"centring": 4}):
        with pytest.raises(ValueError, match="from_interface"):
            Transport(grid, edges(grid), from_interface=True, **words)
    for band in (2, float("nan"), -1):
        with pytest.raises(ValueError, match="band"):
            Transport(grid, edges(grid), band=band)
