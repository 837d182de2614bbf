"""The studies of interfaces in prescribed motions: small runs, exact curve, measures, figures, a slip that shows."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fsiwork.core.grid import Grid
from fsiwork.core.shapes import Ball
from fsiwork.figures import interfaces as figures
from fsiwork.scene import load
from fsiwork.studies import interfaces

SCENES = Path(__file__).resolve().parents[1] / "configs" / "scenes"
MAP = {"bodies.0.transport": {"scheme": "upwind5", "carry": "map"}, "bodies.0.redistance": None}
FIELD = {"bodies.0.transport": {"scheme": "weno5"}, "output.fields": ["phi"]}
CASES = {"plain": FIELD | {"bodies.0.redistance": None}, "map": MAP}
CASES["redistanced"] = FIELD | {"bodies.0.redistance": {"method": "closest-cubic", "every": 5}}


def scene(name, cells, **changes):
    changes = {key.replace("__", "."): value for key, value in changes.items()}
    return load(SCENES / f"{name}.yaml", {"box.cells": cells, "clock.step": "auto", "clock.safety": 1.0} | changes)


def study(rows, cells):
    """A dataset of calls over what is carried and N, as the workflow joins them."""
    points = {}
    for carried, found in rows.items():
        for n, one in zip(cells, found, strict=True):
            values = {k: v if isinstance(v, tuple) else ((), v) for k, v in one.items()}
            points[carried, n] = xr.Dataset({k: (dims, np.asarray(q, float)) for k, (dims, q) in values.items()})
    parts = [xr.concat([points[c, n] for n in cells], "cells") for c in rows]
    return xr.concat(parts, "carried").assign_coords(carried=list(rows), cells=list(cells))


def test_exact_lengths_are_those_of_another_integrator():
    found = interfaces.blob_exact(scene("blob", 32), {})
    t, length, area = (np.asarray(found[name][1]) for name in ("t", "length", "area"))
    for time, expected in interfaces.LENGTHS.items():
        assert length[np.isclose(t, time)] == pytest.approx(expected, rel=2e-6)
    assert length[0] == pytest.approx(0.3 * np.pi, rel=1e-12)
    assert np.abs(area / (np.pi * 0.15**2) - 1).max() < 1e-8


def test_a_blob_for_a_while_on_small_grids_and_its_pictures():
    changes = {"clock__end": 1.0, "clock__frames": 4}
    exact = interfaces.blob_exact(scene("blob", 32, **changes), {})
    cells, rows = (32, 64), {}
    for name, case in CASES.items():
        rows[name] = [interfaces.blob(scene("blob", n, **changes, **case), {}) for n in cells]
    data, reference = study(rows, cells), study({"exact": [exact]}, (0,)).isel(carried=0, cells=0)
    datasets = {"blob": data, "blob_exact": reference}
    errors = interfaces.fig_1_5(datasets)
    assert abs(errors["area_map_64"]) < 0.05
    assert abs(errors["length_map_64"]) < 0.05
    assert abs(errors["length_map_64"]) < abs(errors["length_map_32"])
    assert abs(errors["length_plain_64"]) > 3 * abs(errors["length_map_64"])
    x, y = (np.asarray(rows["map"][-1][name][1]) for name in "xy")
    apart = np.hypot(x[:, None] - reference["x"].values, y[:, None] - reference["y"].values).min(axis=1)
    assert np.nanmax(apart) < 0.05 / 64 + 2e-3  # markers are 1.3e-3 apart at most
    measured = errors | interfaces.fig_1_6(datasets)
    assert measured["map_64"] < 0.1
    for draw in (figures.fig_1_5, figures.fig_1_6):
        assert len(draw(datasets, measured).axes) >= 3


def test_a_turned_slot_is_exact_with_a_map_and_a_flipped_sign_shows(monkeypatch):
    changes = {"clock__frames": 2, "clock__step": 0.5}
    rows = {name: interfaces.returned(scene("zalesak", 32, **changes, **case), {}) for name, case in CASES.items()}
    datasets = {"zalesak": study({name: [row | {"cpu_seconds": 1.0}] for name, row in rows.items()}, (32,))}
    found = interfaces.back_again(datasets)
    assert found["map_map_32"] < 2e-8  # third order in time: 16 times the error of Δt = .25
    assert found["mismatch_map_32"] == 0.0
    assert 1.0 < found["mismatch_plain_32"] < 100.0
    assert found["volume_redistanced_32"] < 25.0
    assert "map_plain_32" not in found
    header, table = interfaces.rows_back(datasets, found)
    assert len(header) == len(table[0])
    assert len(table) == 3
    assert len(figures.back_again(datasets, found).axes) == 6

    from fsiwork.core import motion

    right = motion.curl
    monkeypatch.setattr(
        motion, "curl", lambda g, field: [q * sign for q, sign in zip(right(g, field), (1, -1), strict=True)]
    )
    wrong = interfaces.returned(scene("zalesak", 32, **changes, **MAP), {})
    assert not wrong["map"] < 1e-3


def test_a_vortex_that_turns_back_and_a_ball_in_space():
    flat = interfaces.returned(scene("reversed_vortex", 32, motion__period=2.0, clock__end=2.0), {})
    assert abs(flat["volume"]) < 0.1
    assert flat["mismatch"] < 0.5
    assert flat["shape"] < 0.05
    assert set("xy") == {name[-1] for name in flat if name.startswith("half_")}
    solid = interfaces.returned(scene("enright", 16, motion__period=0.5, clock__end=0.5, clock__frames=2), {})
    assert abs(solid["volume"]) < 0.5
    assert solid["mismatch"] < 2.0
    assert np.isfinite(solid["end_x"][1]).sum() > 30


def test_shapes_and_outlines_know_the_circle():
    g = Grid((32, 32), 1.0 / 32)
    distance = g.sample(Ball((0.5, 0.5), 0.3).distance)
    points = interfaces.outline(g, distance)
    assert points.shape == (interfaces.POINTS, 2)
    radii = np.hypot(*(points[np.isfinite(points[:, 0])] - 0.5).T)
    assert np.abs(radii - 0.3).max() < 2e-3
    moved = g.sample(Ball((0.5, 0.5), 0.31).distance)
    assert interfaces._mean_distance(g, distance, moved) == pytest.approx(0.01, rel=0.02)
    assert np.isnan(interfaces._mean_distance(g, distance, np.ones_like(distance)))
    assert np.isnan(interfaces.outline(g, np.ones_like(distance))).all()
