"""What the studies of the sheared sphere measure, on profiles and runs whose answers are known."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

from fsiwork.checkpoint import Kept
from fsiwork.scene import load
from fsiwork.studies import jobs, shear
from fsiwork.studies import shear_measures as measures
from fsiwork.targets import Plan

SCENE = Path(__file__).resolve().parents[1] / "configs" / "scenes" / "sheared_sphere.yaml"


@pytest.mark.parametrize("p", [1.0, 2.0, 3.5])
def test_order_of_curves_on_three_grids(p):
    steps, curve = [1 / 32, 1 / 48, 1 / 64], np.linspace(0.5, 1.0, 7)
    assert measures.order(steps, [0.5 + h**p * curve for h in steps]) == pytest.approx(p, rel=1e-9)
    assert np.isnan(measures.order(steps, [curve, 2 * curve, 5 * curve]))


def test_a_smeared_jump_is_as_wide_as_itself_whatever_the_slopes_beside_it():
    """A jump with a kink and a slope, smeared by H_ε: width 1 and no overshoot; a wider jump, and a bump on it."""
    phi, eps = 1.2 * (shear.STATIONS - 0.47), 0.11
    q = np.clip(phi / eps, -1, 1)
    H = 0.5 * (1 + q + np.sin(np.pi * q) / np.pi)
    kink = np.concatenate([[0.0], np.cumsum(0.5 * (H[1:] + H[:-1]) * np.diff(shear.STATIONS))])
    jump, width, overshoot = measures.smeared(0.3 - 0.8 * H + 1.7 * kink - 0.9 * phi, phi, eps)
    assert (jump, width) == (pytest.approx(0.8, rel=1e-9), pytest.approx(1.0, rel=1e-9))
    assert overshoot < 1e-9
    middle = np.clip(phi / (0.7 * eps), -1, 1)
    _, narrow, over = measures.smeared(
        -middle - np.sin(np.pi * middle) / np.pi + 0.3 * np.exp(-((phi / eps + 0.75) ** 2) * 150), phi, eps
    )
    assert narrow == pytest.approx(0.7, rel=0.02)
    assert over == pytest.approx(0.15, abs=0.01)
    assert np.isnan(measures.smeared(H, phi + 5.0, eps)).all()


def test_only_the_last_crossing_of_an_axis_counts():
    eps = 0.05
    phi = np.minimum(np.abs(shear.STATIONS - 0.25) - 0.12, np.abs(shear.STATIONS - 0.75) - 0.15)
    q = np.clip((shear.STATIONS - 0.9) / eps, -1, 1)
    p = 1 - 0.5 * (1 + q + np.sin(np.pi * q) / np.pi)
    p[shear.STATIONS < 0.5] = 7.0
    jump, width, _ = measures.smeared(p, phi, eps)
    assert (jump, width) == (pytest.approx(1.0, rel=1e-9), pytest.approx(1.0, rel=1e-9))


def test_markers_start_where_the_map_has_the_lines_of_the_globe():
    points = 0.5 * shear.globe().reshape(-1, 3)
    x, y, z = shear.twisted(points, 1.3).T
    c, s = np.cos(1.3 * z), np.sin(1.3 * z)
    assert np.abs(np.stack([x * c + y * s, -x * s + y * c, z], 1) - points).max() < 1e-14  # (3.67)


def test_a_short_run_tells_everything():
    changes = {
        "box.cells": 20,
        "bodies.0.width": {"cells": 2},
        "clock.end": 0.1,
        "clock.frames": 4,
        "bodies.0.twist": 1.0,
    }
    for step in (0.01, "auto"):
        found = shear.relax(load(SCENE, changes | {"clock.step": step}), {})
        assert found["ended"] == "complete"
        assert step == "auto" or found["n_steps"] == 10
        for name in ("t", *shear.HISTORY, "created", "det_min"):
            dims, values = found[name]
            assert (dims, values.size, bool(np.isfinite(values).all())) == (("row",), 5, True), name
        assert found["t"][1] == pytest.approx([0.0, 0.025, 0.05, 0.075, 0.1], abs=0.006)
        assert -0.05 < found["created"][1][-1] < 0.01
        assert np.isfinite(found["p_x_0"]).all()
        assert "p_x_1" not in found
        assert np.abs(np.linalg.norm(found["markers_0"].reshape(-1, 3), axis=1) - 0.5).max() < 1e-12
        assert 0.0 < found["away"] < 0.05


@pytest.mark.parametrize(("step", "frame"), [(0.004, 1), ("auto", 3)])
def test_a_run_goes_on_from_what_it_kept(tmp_path, step, frame):
    """Killed at a frame and started anew: the same numbers to the last bit; a state of another scene is not taken."""
    changes = {"box.cells": 16, "bodies.0.width": {"cells": 2}, "clock": {"end": 0.2, "step": step, "frames": 4}}
    scene = load(SCENE, changes)

    class Killed(Exception):
        pass

    class Once(Kept):
        def save(self, state):
            super().save(state)
            if state()["sim/clock"][2] == frame:
                raise Killed

    path, mine = tmp_path / "run.state", {"scene": "mine"}
    whole = shear.relax(scene, {})
    with pytest.raises(Killed):
        shear.relax(scene, {}, Once(path, mine, every=0.0))
    assert Kept(path, {"scene": "another"}).load() is None
    steps = int(Kept(path, mine).load()["sim/clock"][1])
    assert 0 < steps < whole["n_steps"]
    rest = shear.relax(scene, {}, Kept(path, mine, every=0.0))
    assert rest.keys() == whole.keys()
    for name, value in whole.items():
        np.testing.assert_array_equal(np.asarray(rest[name][1] if isinstance(value, tuple) else rest[name]),
                                      np.asarray(value[1] if isinstance(value, tuple) else value), name)  # fmt: skip
    path.write_bytes(path.read_bytes()[:-100])
    assert Kept(path, mine).load() is None


def test_a_job_keeps_its_state_until_it_is_done(tmp_path, monkeypatch):
    (tmp_path / "studies").mkdir()
    (tmp_path / "scenes").symlink_to(SCENE.parent)
    small = {"box.cells": 16, "bodies.0.width": {"cells": 2}, "clock.end": 0.1, "clock.frames": 2}
    study = {"title": "short", "scene": "sheared_sphere", "kind": "call", "call": "shear.relax", "set": small}
    (tmp_path / "studies" / "short.yaml").write_text(yaml.safe_dump(study))
    (tmp_path / "book.yaml").write_text("{}")
    plan, seen = Plan(tmp_path, tmp_path / "results"), []
    monkeypatch.setattr(Kept, "save", lambda kept, state: seen.append(kept))
    (file,) = jobs.compute(plan, plan.study("short", "coarse"), "all", "coarse")
    assert json.loads(file.read_text())[0]["ended"] == "complete"
    assert len(seen) == 2
    assert seen[0].path.parent == file.parent
    seen[0].path.write_bytes(b"not a state")
    assert seen[0].load() is None
    jobs.compute(plan, plan.study("short", "coarse"), "all", "coarse")
    assert [entry.name for entry in file.parent.glob("*.state")] == []


def dataset(**changes):
    """Three refined grids whose radius errs by h², and one with layers that slide."""
    cases, t = ["n32", "n48", "n64", "free32"], np.linspace(0, 4, 81)
    cells = np.array([32, 48, 64, 32])
    radius = 0.5 + 0.1 * np.sin(t) + (2 / cells[:, None]) ** 2 * np.cos(t)
    q = np.clip((shear.STATIONS - 0.5) / 0.1, -1, 1)
    p = np.tile(1 - 0.5 * (1 + q + np.sin(np.pi * q) / np.pi), (4, 1))
    names = ("axis_x", "axis_z", "rms_box", "rms_surface", "volume", "created", "det_min")
    data = dict.fromkeys(names, (("case", "row"), radius)) | {"t": (("case", "row"), np.tile(t, (4, 1)))}
    data |= {"rms_box": (("case", "row"), np.outer(1 / cells, t)), "eps": ("case", np.full(4, 0.1))}
    for axis in "xz":
        for k in range(2):
            data[f"p_{axis}_{k}"] = (("case", "station"), p * (1.0 if k == 0 else 0.05))
            data[f"phi_{axis}_{k}"] = (("case", "station"), np.tile(shear.STATIONS - 0.5, (4, 1)))
    data["speed"] = (("case", "marker"), np.array([[1.0, 2.0], [1.0, 2.2], [1.0, 2.1], [1.0, 3.0]]))
    return {"sheared_sphere": xr.Dataset(data | changes, coords={"case": cases})}


def test_what_is_measured_of_the_refined_grids():
    data = dataset()
    assert measures.grids(data["sheared_sphere"]) == ["n32", "n48", "n64"]
    orders = measures.fig_3_22(data)
    assert orders["order_early"] == pytest.approx(2.0, rel=1e-6)
    assert orders["order_late"] == pytest.approx(2.0, rel=1e-6)
    assert measures.fig_3_19(data)["gap"] == pytest.approx(1 / 22)
    assert measures.norms(data)["rms_box_ratio"] == pytest.approx(0.75)
    found = measures.pressure(data)
    assert (found["clear"], found["width"]) == (2, pytest.approx(1.0, rel=1e-6))
    assert found["jump_x_1"] == pytest.approx(0.05, rel=1e-6)
    created = measures.fig_3_18(data)
    assert created["created"] == pytest.approx(max(created[f"created_{case}"] for case in ("n32", "n48", "n64")))
