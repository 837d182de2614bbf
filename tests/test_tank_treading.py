"""The vesicle in a shear flow: moments and angle against exact ones, the threshold of tumbling, a short run."""

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fsiwork import layout
from fsiwork.figures import tank_treading as figures
from fsiwork.scene import load
from fsiwork.studies import tank_treading as study

SCENE = Path(__file__).resolve().parents[1] / "configs" / "scenes" / "vesicle.yaml"


def ellipse(a, b, turn, centre=(0.0, 0.0), points=400):
    t = 2 * np.pi * np.arange(points) / points
    x, y = a * np.cos(t), b * np.sin(t)
    c, s = math.cos(turn), math.sin(turn)
    return np.stack([centre[0] + c * x - s * y, centre[1] + s * x + c * y], axis=1)


@pytest.mark.parametrize("turn", [0.0, 0.3, -0.7, 1.5])
@pytest.mark.parametrize("way", [1, -1])
def test_moments_of_an_ellipse(turn, way):
    area, centre, second = study.moments(ellipse(0.4, 0.15, turn, (3.0, -2.0))[::way])
    assert area == pytest.approx(math.pi * 0.06, rel=1e-4)
    assert centre == pytest.approx([3.0, -2.0], abs=1e-12)
    assert np.linalg.eigvalsh(second) == pytest.approx(0.25 * area * np.array([0.15**2, 0.4**2]), rel=2e-4)
    assert study.tilt(second) == pytest.approx(math.degrees(turn), abs=1e-9)


def test_moments_of_a_triangle_are_exact():
    """∫x² = a³b/12, ∫xy = a²b²/24 about the corner."""
    a, b = 3.0, 2.0
    area, centre, second = study.moments(np.array([[0, 0], [a, 0], [0, b]], float))
    assert (area, *centre) == pytest.approx((a * b / 2, a / 3, b / 3))
    about = second + area * np.outer(centre, centre)
    assert about.ravel() == pytest.approx([a**3 * b / 12, a**2 * b**2 / 24, a**2 * b**2 / 24, a * b**3 / 12])


def test_the_first_frame_of_the_scene_has_its_angle_and_area():
    scene = load(SCENE, {"box.cells": 96, "clock.end": 0.004})
    found = study.follow(scene, {})
    assert found["angle"][1][0] == pytest.approx(math.degrees(0.38), abs=0.1)
    assert found["reduced_area"] == pytest.approx(0.7, abs=1e-3)
    assert found["reynolds"] == pytest.approx(0.0625, rel=5e-3)
    assert found["bending_number"] == pytest.approx(1, rel=0.02)
    assert (found["height"], found["eps_cells"], found["ratio"]) == (pytest.approx(12, rel=5e-3), 4, 1)
    assert found["ended"] == "complete" and np.isfinite(found["p_0"]).all()
    assert np.abs(found["line_0"].reshape(-1, 2)).max() == pytest.approx(1.5, abs=0.1)


def test_the_longest_line_is_the_outline():
    scene = load(SCENE, {"box.cells": 64})
    grid = layout.geometry(scene)
    x, y = (o + (np.arange(n) + 0.5) * grid.h for o, n in zip(grid.origin, grid.n, strict=True))
    x, y = x[:, None], y[None]
    phi = np.minimum(np.hypot(x, y) - 0.5, np.hypot(x - 1, y - 1) - 0.2)
    area, centre, _ = study.moments(study.outline(phi, grid))
    assert area == pytest.approx(math.pi / 4, rel=1e-2)
    assert centre == pytest.approx([0, 0], abs=1e-3)


def test_pictures_are_even_in_turn_or_in_time():
    steady = np.append(np.full(10, 20.0), [math.nan] * 5)
    assert study.pictures(steady) == [1, 2, 3, 4, 6, 7, 8, 9]
    t = np.linspace(0, 1, 121)
    found = study.pictures(20 - 200 * t**2)
    assert [round(200 * t[k] ** 2 / 22.5 - 0.5) for k in found] == list(range(8))


def runs(**angles):
    """A study of runs of 5 strain units at the rate 2: name a7_rN -> last angle (the first is 20), or "bad"."""
    cases = list(angles)
    t = np.linspace(0, 2.5, 11)
    kept = [20 + (0 if a == "bad" else a - 20) * np.minimum(t / 1.2, 1) for a in angles.values()]
    size = {"case": len(cases), "row": t.size}
    one = {name: (("case",), np.full(len(cases), value)) for name, value in
           {"rate": 2.0, "eps_cells": 4.0, "height": 12.0, "reynolds": 0.06, "eps": 0.1, "reduced_area": 0.7,
            "cpu_seconds": 1.0, "n_cells": 64}.items()}  # fmt: skip
    many = {name: (("case", "row"), np.ones(tuple(size.values()))) for name in ("length", "area", "least", "most")}
    own = {
        "t": (("case", "row"), np.tile(t, (len(cases), 1))),
        "angle": (("case", "row"), np.array(kept)),
        "ratio": (("case",), [float(case.split("_r")[1]) for case in cases]),
        "ended": (("case",), ["diverged at t=1" if a == "bad" else "complete" for a in angles.values()]),
    }
    return xr.Dataset(one | many | own, {"case": cases})


def test_the_threshold_is_between_steady_and_tumbling_runs():
    assert study.bracket(runs(a7_r1=22, a7_r3=9, a7_r5=-100, a7_r8=-170, a9_r9=-120), "a7") == (3, 5)
    assert study.bracket(runs(a7_r1=22, a7_r3=-30, a7_r5=9), "a7") == (1, math.inf)
    assert study.bracket(runs(a7_r1="bad", a7_r3=9, a7_r5=-95), "a7") == (0, 5)


def test_an_angle_that_drifts_is_told():
    mean, drift = study.steady(runs(a7_r1=10).isel(case=0))
    assert (mean, drift) == (pytest.approx(10), pytest.approx(0, abs=1e-9))
    moving = runs(a7_r1=10).isel(case=0)
    moving["angle"] = 20 - moving["t"]
    assert study.steady(moving) == (pytest.approx(20 - 2.0), pytest.approx(1.0))
    assert all(math.isnan(q) for q in study.steady(runs(a7_r1="bad").isel(case=0)))


def test_measures_and_rows():
    data = runs(a7_r1=22, a7_r2=15, a7_r3=9, a9_r1=31, a9_r2=25, a9_r3=20, a7_r8=-165)
    data["length"][0, 3] = 0.98
    found = study.fig_3_15({"vesicle": data})
    assert found["angle_a7_r1"] == pytest.approx(22) and found["drift"] < 0.5
    assert (found["treads"], found["tumbles"], found["turned_a7_r8"]) == (3, 8, pytest.approx(185))
    assert (found["length"], found["area"], found["length_tumbling"]) == (pytest.approx(2), 0, 0)
    header, table = study.rows({"vesicle": data}, found)
    assert [len(row) for row in table] == [len(header)] * 7
    assert table[0][2:5] == [22, 21.94, 0] and table[-1][2] == "tumbles"


def test_the_figure_has_all_pictures_and_references():
    data = runs(a7_r1=22, a7_r8=-165, a9_r1=31)
    lines = np.array([ellipse(1.6, 0.6, 0.3, points=study.AROUND).ravel()] * 3)
    w = study.WINDOW
    p = np.array([(w[:, None] * w[None]).ravel()] * 3)
    for k in range(study.SHOTS):
        data = data.assign(
            {f"t_{k}": ("case", [float(k)] * 3), f"line_{k}": (("case", "i"), lines), f"p_{k}": (("case", "j"), p)}
        )
    figure = figures.fig_3_15({"vesicle": data}, study.fig_3_15({"vesicle": data}))
    axes = [ax for part in figure.subfigs for ax in part.axes]
    assert sum(bool(ax.collections) for ax in axes) >= 12
    dashed = [line for ax in axes[-2:] for line in ax.lines if len(line.get_ydata()) == 2]
    assert sorted(line.get_ydata()[0] for line in dashed) == [21.94, 31.01]  # the last two panels
