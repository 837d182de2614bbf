"""What the studies of the sheared sphere measure, on profiles and runs whose answers are known."""

from pathlib import Path

import numpy as np
import pytest

from fsiwork.scene import load
from fsiwork.studies import shear

SCENE = Path(__file__).resolve().parents[1] / "configs" / "scenes" / "sheared_sphere.yaml"


@pytest.mark.parametrize("p", [1.0, 2.0, 3.5])
def test_order_of_curves_on_three_grids(p):
    steps, curve = [1 / 32, 1 / 48, 1 / 64], np.linspace(0.5, 1.0, 7)
    assert shear.order(steps, [0.5 + h**p * curve for h in steps]) == pytest.approx(p, rel=1e-9)
    assert np.isnan(shear.order(steps, [curve, 2 * curve, 5 * curve]))


def test_a_smeared_jump_is_as_wide_as_itself():
    phi = 1.2 * (shear.STATIONS - 0.47)
    eps = 0.11
    q = np.clip(phi / eps, -1, 1)
    jump = 3.0 - 2.0 * 0.5 * (1 + q + np.sin(np.pi * q) / np.pi)
    width, overshoot = shear.smeared(jump, phi, eps)
    assert width == pytest.approx(1.0, rel=1e-12)
    assert overshoot == pytest.approx(0.0, abs=1e-12)
    twice = np.clip(phi / (1.4 * eps), -1, 1)
    wide, over = shear.smeared(
        -twice - np.sin(np.pi * twice) / np.pi + 0.3 * np.exp(-((phi / eps + 1.2) ** 2) * 50), phi, eps
    )
    assert wide == pytest.approx(1.4, rel=0.01)
    assert over == pytest.approx(0.15, abs=0.01)
    assert np.isnan(shear.smeared(jump, phi + 5.0, eps)).all()


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
        "clock.step": 0.01,
        "bodies.0.twist": 1.0,
    }
    found = shear.relax(load(SCENE, changes), {})
    assert found["ended"] == "complete"
    assert found["n_steps"] == 10
    for name in ("t", *shear.HISTORY, "created"):
        dims, values = found[name]
        assert (dims, values.size, bool(np.isfinite(values).all())) == (("row",), shear.ROWS + 1, True), name
    assert found["t"][1][-1] == pytest.approx(0.1)
    assert -0.05 < found["created"][1][-1] < 0.01
    assert np.isfinite(found["p_x_0"]).all()
    assert np.abs(np.linalg.norm(found["markers_0"].reshape(-1, 3), axis=1) - 0.5).max() < 1e-12
    assert 0.0 < found["away"] < 0.05
