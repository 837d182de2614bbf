"""Frames, gauges and clocks of a run; stopping and going on; what a step allocates."""

import itertools
import tracemalloc
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fsiwork import simulate
from fsiwork.core import levelset
from fsiwork.scene import load
from fsiwork.simulate import build, frames

SCENES = Path(__file__).resolve().parents[1] / "configs" / "scenes"
SMALL = {"box.cells": 24, "clock.step": 0.01, "clock.end": 0.12, "clock.frames": 4}
WIDE = {"bodies.0.width": {"cells": 2}}


def scene(name="elliptic_membrane", **changes):
    """A scene at a small size; double underscores in ``changes`` stand for dots."""
    given = {path.replace("__", "."): value for path, value in changes.items()}
    return load(SCENES / f"{name}.yaml", SMALL | given)


def test_frames_come_at_their_times_with_the_rows_since_the_one_before():
    found = list(frames(scene()))
    assert [f.t for f in found] == pytest.approx([0.0, 0.03, 0.06, 0.09, 0.12], rel=1e-15)
    assert [f.step for f in found] == [0, 3, 6, 9, 12]
    assert [f.ended for f in found] == ["", "", "", "", "complete"]
    assert [len(f.gauges["t"]) for f in found] == [1, 3, 3, 3, 3]
    t = np.concatenate([f.gauges["t"] for f in found])
    assert np.array_equal(t, 0.12 * (np.arange(13) / 12))
    assert found[-1].t == 0.12
    assert all(set(f.gauges) == set(found[0].gauges) for f in found)
    assert {"volume", "length", "kinetic_energy", "elastic_energy", "dissipation", "axis_x"} <= set(found[0].gauges)


def test_a_frame_has_the_fields_that_the_scene_asks_for():
    made = scene("sheared_drop", output__fields=["u", "p", "phi", "Y", "vorticity", "rho", "mu"])
    fields = list(frames(made))[-1].fields
    assert list(fields) == ["u", "v", "p", "phi", "Y_x", "Y_y", "vorticity", "rho", "mu"]
    faces = {name: face for name, (face, _) in fields.items() if face is not None}
    assert faces == {"u": 0, "v": 1}
    shapes = {name: q.shape for name, (_, q) in fields.items()}
    assert shapes["u"] == (24, 12)  # periodic: n faces
    assert shapes["v"] == (24, 13)  # between walls: n + 1
    assert {shape for name, shape in shapes.items() if name not in "uv"} == {(24, 12)}
    assert fields["p"][1].mean() == pytest.approx(0.0, abs=1e-13)
    assert np.ptp(fields["rho"][1]) == 0.0


def test_the_number_of_steps_is_rounded_up_and_t_ends_at_the_end():
    made = scene(clock__step=0.05)  # 0.12 / 0.05 = 2.4
    found = list(frames(made))
    assert (found[-1].step, found[-1].t, found[-1].ended) == (3, 0.12, "complete")
    assert len(found) == 4  # more frames than steps: one a step
    assert np.concatenate([f.gauges["dt"] for f in found[1:]]) == pytest.approx(0.04)


def test_geometric_gauges_in_space_on_request():
    plain, asked = (next(frames(scene("drop_3d", output__geometric=on))).gauges for on in (False, True))
    assert set(asked) - set(plain) == {"geometric_volume", "geometric_area"}
    assert asked["geometric_volume"][0] == pytest.approx(4 / 3 * np.pi * 0.6 * 0.5 * 0.5, rel=1e-4)
    assert abs(asked["volume"][0] / asked["geometric_volume"][0] - 1) > 0.01  # what smearing over 3 of 24 cells adds


def test_gauges_every_so_many_steps_and_at_frames():
    found = list(frames(scene(output__gauges_every=4, clock__frames=2)))
    assert [round(t / 0.01) for f in found for t in f.gauges["t"]] == [0, 4, 6, 8, 12]


@pytest.mark.parametrize(("name", "end"), [("elliptic_membrane", 0.1), ("cavity", 0.7), ("taylor_green", 0.7)])
def test_automatic_steps_hit_the_frames_to_the_bit(name, end):
    made = scene(name, clock__step="auto", clock__end=end, clock__frames=3)
    sim, limits = build(made), []
    assert sim.advance() == ""
    limits = sim.limits
    found = list(frames(made))
    assert [f.t for f in found] == [0.0, end * (1 / 3), end * (2 / 3), end]
    steps = np.concatenate([f.gauges["dt"] for f in found[1:]])
    assert steps[0] <= 0.5 * min(limits.values()) * (1 + 1e-12)
    assert np.ptp(steps) > 0.0  # looked at anew
    assert steps.sum() == pytest.approx(end, rel=1e-13)


def test_limits_have_names():
    def names(name, **changes):
        sim = build(scene(name, clock__step="auto", **changes))
        sim.advance()
        return {key: value for key, value in sim.limits.items() if np.isfinite(value)}

    moving = names("taylor_green", fluid__diffusion="explicit")
    assert set(moving) == {"advective", "viscous"}
    assert moving["advective"] == pytest.approx(0.5 * (2 * np.pi / 24) / 2.0, rel=0.02)  # u and v reach 1
    assert moving["viscous"] == pytest.approx((2 * np.pi / 24) ** 2 / 0.8)
    assert names("cavity")["advective"] == pytest.approx(0.5 / 24)  # the lid's, while the fluid is at rest
    assert "elastic (1.54)" in names("elliptic_membrane", bodies__0__coupling="explicit")
    assert "elastic, accuracy" in names("elliptic_membrane")


def test_the_time_allowed_ends_a_run_and_its_state_goes_on():
    made = scene()
    whole = list(frames(made))
    first = list(frames(made, max_seconds=0.0))
    assert [f.ended[:11] for f in first] == ["", "stopped at "]
    assert "t=0 (step 0)" in first[-1].ended
    assert_same(list(frames(made, resume=first[-1].state())), whole[1:])


RUNS = {
    "membrane": ("elliptic_membrane", {}),
    "automatic step": ("elliptic_membrane", {"clock.step": "auto"}),
    "iterated": ("elliptic_membrane", {"bodies.0.coupling": "iterated"}),
    "stabilised map": ("elliptic_membrane", {"bodies.0.coupling": "stabilised", "bodies.0.transport.carry": "map"}),
    "variable density": ("rising_drop", WIDE),
    "walls, map": ("sheared_drop", {"output.gauges_every": 4}),
    "adjoint": ("elliptic_membrane", {"bodies.0.form": "adjoint", "bodies.0.transport.scheme": "upwind5"}),
    "restarted map": ("sheared_drop", {"bodies.0.transport.restart": 1.02, "bodies.0.renew": 2}),
    "lines drawn anew": (
        "sheared_drop",
        {"bodies.0.transport.carry": "field", "bodies.0.renew": 3, "output.fields": ["phi"]},
    ),
    "two bodies": ("two_drops", WIDE),
    "lid, explicit": ("cavity", {"fluid.diffusion": "explicit"}),
    "three directions": ("drop_3d", {"box.cells": 16, "clock.end": 0.04, "clock.frames": 2, "output.gauges_every": 3}),
}


@pytest.mark.parametrize("run", RUNS)
def test_stopped_after_any_step_a_run_goes_on_bit_for_bit(run, monkeypatch):
    name, changes = RUNS[run]
    made = load(SCENES / f"{name}.yaml", SMALL | changes)
    whole = list(frames(made))
    assert whole[-1].ended == "complete"
    for step in range(1, whole[-1].step, max(1, whole[-1].step // 6)):
        ticks = itertools.count()  # one when the run begins, one before each step
        monkeypatch.setattr(simulate, "time", SimpleNamespace(monotonic=lambda ticks=ticks: next(ticks)))
        *before, stopped = frames(made, max_seconds=step)
        assert stopped.ended.startswith("stopped") and stopped.step == step
        assert_same(list(frames(made, resume=stopped.state())), whole[len(before) :])


def assert_same(found, expected):
    """Frames equal to the last bit, with the rows of gauges that the first was still owed."""
    assert [(f.t, f.step, f.ended) for f in found] == [(f.t, f.step, f.ended) for f in expected]
    for a, b in zip(found, expected, strict=True):
        assert list(a.fields) == list(b.fields)
        for name, (_, q) in a.fields.items():
            assert np.array_equal(q, b.fields[name][1]), name
        assert list(a.gauges) == list(b.gauges)
        for name, q in a.gauges.items():
            assert np.array_equal(q, b.gauges[name], equal_nan=True), name


@pytest.mark.parametrize("name", ["elliptic_membrane", "rising_drop"])
def test_a_state_has_no_more_than_what_decides(name):
    """Everything else in the simulation may be spoilt: the next step does not read it."""
    made = scene(name, **({"bodies__0__width": {"cells": 2}} if name == "rising_drop" else {}))
    one, other = build(made), build(made)
    for _ in range(3):
        assert one.advance() == ""
    for _ in range(5):
        assert other.advance() == ""  # another past, with another history of velocities and guesses
    other.restore(one.state())
    for sim in (one, other):
        for _ in range(3):
            sim.advance()
    ours, theirs = one.state(), other.state()
    assert ours.keys() == theirs.keys()
    for key, q in ours.items():
        assert np.array_equal(q, theirs[key], equal_nan=True), key


def test_two_bodies_are_arrays_and_their_fields_are_numbered():
    found = list(frames(scene("two_drops", bodies__0__width={"cells": 2}, bodies__1__width={"cells": 2})))
    last = found[-1]
    assert {("phi", 0), ("phi", 1)} < set(last.fields)
    assert last.gauges["volume"].shape == (3, 2)
    assert last.gauges["kinetic_energy"].shape == (3,)
    x = last.gauges["centroid_x"]
    assert np.abs(x - [0.55, 1.45]).max() < 0.01  # the drops stay in the order of the scene


def test_mirrored_bodies_move_alike():
    """Left and right drop change places under x → 2 - x: no body is favoured by its number."""
    drop = {"kind": "membrane", "energy": {"kind": "linear", "stiffness": 1.0}, "width": {"cells": 2}}
    axes = {"kind": "ellipse", "semi_axes": [0.3, 0.2]}
    bodies = [drop | {"shape": axes | {"centre": [x, 0.5]}} for x in (0.55, 1.45)]
    last = list(frames(load(SCENES / "two_drops.yaml", SMALL | {"bodies": bodies})))[-1]
    (_, left), (_, right) = last.fields["phi", 0], last.fields["phi", 1]
    assert np.abs(left - right[::-1]).max() < 1e-12
    assert last.gauges["volume"][:, 0] == pytest.approx(last.gauges["volume"][:, 1], rel=1e-12)


def test_the_residual_of_a_viscous_decay_is_that_of_the_trapezoidal_rule():
    residuals = []
    for dt in (0.04, 0.02):
        found = list(frames(scene("taylor_green", clock__step=dt, clock__end=0.4, fluid__advection="central")))
        gauges = {name: np.concatenate([f.gauges[name] for f in found]) for name in found[0].gauges}
        assert np.abs(gauges["energy_residual"][1:]).max() < 1e-4 * dt * gauges["dissipation"][0]
        assert gauges["energy_residual"][0] == 0.0
        residuals.append(abs(gauges["energy_residual"].sum()) / gauges["kinetic_energy"][0])
    assert residuals[1] < 2e-6
    assert np.all(gauges["power"] == 0.0)


@pytest.mark.parametrize("coupling", ["explicit", "semi-implicit", "stabilised"])
def test_a_step_and_its_gauges_allocate_a_few_rows_and_never_a_field(coupling):
    sim = build(scene(box__cells=256, bodies__0__coupling=coupling, clock__step=0.0005))
    for _ in range(2):  # plans its solvers, fills the history
        sim.advance()
        sim.gauges()
    grid = sim.flow.grid
    peak = max(_largest_allocation(action) for action in (sim.advance, sim.gauges))
    assert peak < 8 * (8 * grid.shape[-1]) < 8 * grid.size / 30


def _largest_allocation(action) -> int:
    """Growth of the traced memory at its peak [bytes], the arrays of NumPy included."""
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        action()
        return tracemalloc.get_traced_memory()[1] - before
    finally:
        tracemalloc.stop()


def test_density_and_viscosity_of_a_frame_belong_to_its_interface():
    made = scene("rising_drop", clock__end=0.5, clock__step=0.05, bodies__0__width={"cells": 2})
    for frame in frames(made):
        phi, rho, mu = (frame.fields[name][1] for name in ("phi", "rho", "mu"))
        ramp = levelset.heaviside(phi.ravel(), 2 * made.box.h).reshape(phi.shape)
        assert np.abs(rho - (0.1 + 0.9 * ramp)).max() < 1e-12
        assert np.abs(mu - (0.001 + 0.009 * ramp)).max() < 1e-13
    assert frame.gauges["centroid_y"][-1] > 0.5 + 0.5 * made.box.h  # it has moved, so that it matters when
