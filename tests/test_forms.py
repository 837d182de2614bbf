"""What the study of discrete forms tells of runs whose numbers are known."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fsiwork.scene import load
from fsiwork.studies import forms
from fsiwork.studies.stability import releasable

SCENE = load(Path(__file__).resolve().parents[1] / "configs" / "scenes" / "elliptic_membrane.yaml")


def study(ended="complete"):
    """Two forms of one law at one width: a swing, energies that fall by a tenth or rise by a fifth, a residual each."""
    t = np.linspace(0, 2, 41)
    shape = ("law", "form", "width", "row")
    swing = 0.6 + 0.15 * np.cos(2 * np.pi * t / 1.6)
    data = {
        "axis_x": (shape, np.tile(swing, (1, 2, 1, 1))),
        "kinetic_energy": (shape, 0.0 * np.tile(swing, (1, 2, 1, 1))),
        "elastic_energy": (shape, np.stack([[2 - 0.1 * t], [2 + 0.2 * t]])[None]),
        "energy_residual": (shape, np.stack([[0 * t + 1e-4], [np.where(t < 1, -1e-2, 1e-2)]])[None]),
        "geometric_length": (shape, np.stack([[3 + 0 * t], [3 + 0.03 * t]])[None]),
        "ended": (shape[:3], [[[ended], ["complete"]]]),
        "scene": (shape[:3], [[[json.dumps(SCENE.model_dump(mode="json"))]] * 2]),
        "t_step": (shape, np.tile(t, (1, 2, 1, 1))),
    }
    axes = {"law": ["membrane"], "form": ["adjoint", "divergence"], "width": [3.0]}
    return {"forms_membrane": xr.Dataset(data, axes).set_coords("t_step")}


def test_measures_of_known_runs():
    found, released = forms.measure(study()), releasable(SCENE)
    assert found["rise_membrane_adjoint_3"] == pytest.approx(1.0)
    assert found["rise_membrane_divergence_3"] == pytest.approx(1.2)
    assert found["residual_membrane_adjoint_3"] == pytest.approx(41e-4 / released)
    assert found["residual_membrane_divergence_3"] == pytest.approx(0.2 / released)
    assert found["gain_3"] == pytest.approx(0.2 / 41e-4)
    assert found["longest_membrane_divergence_3"] == pytest.approx(1.02)
    assert found["time_membrane_adjoint_3"] == pytest.approx(0.8, abs=1e-3)
    assert found["axis_membrane_adjoint_3"] == pytest.approx(0.45, abs=1e-4)


def test_a_diverged_run_has_no_numbers():
    data = study("diverged at t=0.3")
    found = forms.measure(data)
    assert np.isnan([found[f"{name}_membrane_adjoint_3"] for name in forms.NAMES]).all()
    assert np.isnan(found["gain_3"])
    header, table = forms.rows(data, found)
    assert len(header) == len(table[0]) == 8
    assert table[0][:3] == ["membrane", "adjoint", 3.0] and np.isnan(table[0][3:]).all()
    assert table[1][3:6] == pytest.approx([1.2, 0.2 / releasable(SCENE), 1.02], rel=1e-3)
