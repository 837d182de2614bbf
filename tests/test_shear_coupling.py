"""The study of the stabilised coupling for shear: stability, steps and errors whose answers are known."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fsiwork.scene import load
from fsiwork.studies import shear_coupling as study

SCENE = Path(__file__).resolve().parents[1] / "configs" / "scenes" / "sheared_sphere.yaml"
SMALL = {"box.cells": 16, "bodies.0.width.cells": 2, "bodies.0.alike": True, "clock.end": 0.1}


def table(limits, energies, shares):
    """A study of one start on two grids: K = t, and runs that are by a share below it."""
    t, shape = np.linspace(0, 1, study.ROWS), ("start", "cells", "time")
    data = {"kinetic": (shape, np.tile(t, (1, 2, 1))), "limit": (shape[:2], [limits])}
    data |= {"energy": (("start", "cells", "multiple"), [energies])}
    data |= {f"seconds_{c}": (shape[:2], [[s, s]]) for c, s in (("explicit", 1.0), ("stabilised", 1.2))}
    for c, of in shares.items():
        data |= {f"kinetic_{c}_{k}": (shape, np.tile((1 - s) * t, (1, 2, 1))) for k, s in enumerate(of)}
    return {"coupling_shear": xr.Dataset(data, {"start": ["alike"], "cells": [32, 48]})}


SHARES = {"explicit": [0.01, 0.02, np.nan, np.nan], "stabilised": [0.1, 0.2, 0.5, 0.9]}


def test_measures_of_known_runs():
    found = study.measure(table([3.08, 2.1], [[1, 1, 1, 1], [1, 1, 1.2, 1]], SHARES))
    assert found["limit_least_alike"] == pytest.approx(0.75)
    assert found["limit_most_alike"] == pytest.approx(1.1)
    assert found["stable"] == found["stable_alike"] == 10.0
    assert found["error_stabilised_alike_0.5"] == pytest.approx(20.0)
    assert np.isnan(found["error_explicit_alike_1"])
    assert found["loss_alike"] == pytest.approx(10.0)
    assert found["cost"] == pytest.approx(1.2)


def test_what_was_not_found_is_no_number():
    found = study.measure(table([np.nan, 2.1], [[np.nan, 1, 1, 1], [1, 1, 1, 1]], SHARES))
    assert np.isnan(found["limit_least_alike"]) and np.isnan(found["limit_most_alike"])
    assert found["stable"] == 0.0


def test_rows_say_what_is_unstable():
    header, rows = study.rows(table([3.0, 2.0], np.ones((2, 4)), SHARES), {})
    assert len(rows) == 2 and len(header) == len(rows[0])
    assert rows[0][:3] == ["alike", 32, 3.0]
    assert rows[1][4:] == [1.0, 2.0, "unstable", "unstable", 10.0, 20.0, 50.0, 90.0]


def test_the_unit_follows_the_modulus():
    run = study.Run(load(SCENE, SMALL), "explicit")
    limit = run.sim.bodies[0].longest_step(run.sim.flow)["elastic, shear"]
    assert run.unit == pytest.approx(limit / 2.8, rel=1e-12)
    softer = study.Run(load(SCENE, {**SMALL, "bodies.0.area": 0.25, "bodies.0.shear": 0.25}), "explicit")
    assert softer.unit == pytest.approx(2 * run.unit, rel=1e-12)


def test_an_explicit_run_survives_below_its_limit_and_not_above():
    scene = load(SCENE, SMALL)
    good, steps = study.survives(scene, 1.4)
    assert good and steps >= study.EXPLICIT
    good, steps = study.survives(scene, 8.0)
    assert not good and steps < study.EXPLICIT


def test_far_beyond_the_limit_the_stabilised_run_is_stable_and_slow():
    scene = load(SCENE, SMALL)
    unit, times = study.Run(scene, "explicit").unit, np.linspace(0, 0.1, 6)
    exact = study.Run(scene, "explicit").until(0.5 * unit, 0.1)
    slow = study.Run(scene, "stabilised").until(100 * unit, 0.1, 8)
    assert slow.stable and slow.steps == 8
    assert exact.stable and np.isfinite(exact.kinetic(times)).all()
    assert slow.kinetic(times)[-1] < 0.1 * exact.kinetic(times)[-1]
    assert np.isnan(exact.kinetic(np.array([9.0])))


def test_a_job_tells_everything(monkeypatch):
    monkeypatch.setattr(study, "EXPLICIT", 8)
    monkeypatch.setattr(study, "STABILISED", 3)
    monkeypatch.setattr(study, "MULTIPLES", np.array([1.0, 30.0]))
    found = study.coupled(load(SCENE, SMALL), {})
    assert 1.4 < found["limit"] < 20.0
    assert found["energy"][1].shape == (2,) and (found["energy"][1] <= 1.0 + 1e-12).all()
    assert found["kinetic"][1][0] == 0.0 and np.isfinite(found["kinetic"][1]).all()
    assert {f"kinetic_stabilised_{k}" for k in range(4)} <= found.keys()
    assert 0 < found["seconds_explicit"] < 2 * found["seconds_stabilised"]
    assert found["n_cells"] == 16 and found["n_steps"] > 50
