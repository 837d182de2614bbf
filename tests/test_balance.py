"""The energy law for any scene: its parts are told apart, a wrong force shows."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

from fsiwork import scene
from fsiwork.bodies.pull import Pull
from fsiwork.studies import balance

CONFIGS = Path(__file__).parents[1] / "configs"
ELASTIC = {"membrane", "shear-membrane", "curve", "markers"}


def made(name="oscillating_drop", **overrides):
    changes = {"clock.end": 0.04, "bodies.0.width": {"length": 0.25}, "bodies.0.coupling": "explicit"} | overrides
    return scene.load(CONFIGS / "scenes" / f"{name}.yaml", changes)


def measured(result):
    """What `balance.measure` makes of one result."""
    data = xr.Dataset({name: value for name, value in result.items() if isinstance(value, tuple)})
    return balance.measure({"energy_of_one": data})


def test_the_residual_falls_with_step_and_grid():
    result = balance.balance(made(), {"cells": [24, 48], "step": 0.004})
    found = measured(result)
    assert found["scenes_order_step"] == pytest.approx(1.0, abs=0.1)
    assert found["scenes_order_grid"] > 1.0
    assert found["scenes_rest"] < 0.05
    assert result["n_steps"] == (10 + 20 + 40) + (20 + 40)
    assert result["of_step"][1][0] == pytest.approx(2 * result["of_step"][1][1], rel=0.1)


def test_a_force_that_is_not_the_energy_s_leaves_a_rest(monkeypatch):
    add = Pull.normal_tangential

    def stronger(self, force, phi, band):
        before = [f.copy() for f in force]
        add(self, force, phi, band)
        for f, old in zip(force, before, strict=True):
            f += 0.3 * (f - old)

    monkeypatch.setattr(Pull, "normal_tangential", stronger)
    found = measured(balance.balance(made(), {"cells": [24, 48], "step": 0.004}))
    assert found["scenes_rest"] > 0.15
    assert found["scenes_order_grid"] < 0.5


def test_a_run_that_diverges_has_no_order():
    wild = made(**{"bodies.0.energy.stiffness": 1e4})
    result = balance.balance(wild, {"cells": [24, 32], "step": 0.004})
    assert np.isnan(result["of_grid"][1]).all()
    assert np.isnan(measured(result)["scenes_order_step"])


def test_the_entry_looks_at_every_scene_with_an_elastic_body():
    book = yaml.safe_load((CONFIGS / "book.yaml").read_text(encoding="utf-8"))
    names = [name for name in book["energy_law"]["studies"] if name.startswith(balance.PREFIX)]
    for name in names:
        study = yaml.safe_load((CONFIGS / "studies" / f"{name}.yaml").read_text(encoding="utf-8"))
        assert name == f"{balance.PREFIX}{study['scene']}"
    scenes = {file.stem: scene.load(file) for file in (CONFIGS / "scenes").glob("*.yaml")}
    elastic = [name for name, made in scenes.items() if any(body.kind in ELASTIC for body in made.bodies)]
    assert sorted(names) == sorted(f"{balance.PREFIX}{name}" for name in elastic)
