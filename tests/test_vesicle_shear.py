"""The vesicle in a shear flow in space: moments and outline against exact ones, theory, a short run, the measures."""

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fsiwork.core.grid import Grid
from fsiwork.core.shapes import Ellipsoid
from fsiwork.figures import vesicles as figures
from fsiwork.scene import load
from fsiwork.studies import vesicle_shear as study
from fsiwork.studies.tank_treading import tilt

SCENE = Path(__file__).resolve().parents[1] / "configs" / "scenes" / "vesicle_shear.yaml"
AXES = (0.8, 0.4, 0.6)


def half(turn, cells=32):
    """The half above z = 0 of an ellipsoid turned about z, its middle off the origin."""
    grid = Grid((2 * cells, 2 * cells, cells), 1 / cells, (-1.0, -1.0, 0.0))
    shape, c, s = Ellipsoid((0.0, 0.0, 0.0), AXES), math.cos(turn), math.sin(turn)

    def distance(x, y, z):
        x, y = x - 0.05, y + 0.02
        return shape.distance(c * x + s * y, c * y - s * x, z)

    return grid, grid.sample(distance)


@pytest.mark.parametrize("turn", [0.0, 0.4, -0.7])
def test_moments_of_half_an_ellipsoid_are_those_of_the_whole(turn):
    second = study.moments(*half(turn))
    assert np.sqrt(5 * np.linalg.eigvalsh(second)) == pytest.approx(sorted(AXES), rel=5e-3)
    assert tilt(second) == pytest.approx(math.degrees(turn), abs=0.05)
    assert second[2, 2] == pytest.approx(0.6**2 / 5, rel=1e-2)  # about the plane of symmetry


def test_the_outline_lies_in_the_plane_of_shear():
    grid, phi = half(0.4)
    x, y = study._line(grid, phi).T - np.array([[0.05], [-0.02]])
    c, s = math.cos(0.4), math.sin(0.4)
    found = ((c * x + s * y) / 0.8) ** 2 + ((c * y - s * x) / 0.4) ** 2
    assert np.abs(found - 1).max() < 0.01


def test_small_deformations():
    """45° for a sphere; tumbling at the ratio -32/23 + 120/23 √(2π/15Δ)."""
    assert study.small_deformation(1 - 1e-9) == pytest.approx(45, abs=0.01)
    excess = 4 * math.pi * (0.95 ** (-2 / 3) - 1)
    threshold = -32 / 23 + 120 / 23 * math.sqrt(2 * math.pi / 15 / excess)
    assert study.small_deformation(0.95, 0.99 * threshold) > 0 == study.small_deformation(0.95, 1.01 * threshold)
    angles = [study.small_deformation(v) for v in (0.99, 0.95, 0.9, 0.8)]
    assert angles == sorted(angles, reverse=True)
    assert angles[1] == pytest.approx(31.0, abs=0.1)


def test_a_run_of_some_steps():
    scene = load(SCENE, {"box.cells": 24, "clock.end": 0.12, "clock.step": 0.02, "bodies.0.renew": 3})
    found = study.follow(scene, {})
    assert found["ended"] == "complete" and found["n_steps"] == 6
    assert found["angle"][1][0] == pytest.approx(math.degrees(0.45), abs=0.5)
    assert found["volume"][1] == pytest.approx(np.full(study.ROWS + 1, 4 / 3 * math.pi * 0.9), rel=3e-3)
    assert found["area"][1][0] == pytest.approx(4 * math.pi, rel=1e-3)
    assert [found[f"axis_{k}"][1][0] for k in (1, 2, 3)] == pytest.approx(
        [1.513, 0.771, 0.771], rel=0.05
    )  # 6 cells a radius
    assert (found["capillary"], found["reynolds"], found["eps_cells"], found["height"]) == (1, 0.1, 4, 4)
    assert np.abs(found["line_3"].reshape(-1, 2)).max() == pytest.approx(1.4, abs=0.1)


def made(**changes):
    """Four runs at a steady angle, what is kept constant, but for ``changes`` of the first."""
    rows, cases = study.ROWS + 1, list(figures.RUNS)
    flat = {"t": np.linspace(0, 4, rows), "angle": np.full(rows, 26.0), "area": np.full(rows, 4 * math.pi)}
    flat |= {"volume": np.full(rows, 4 / 3 * math.pi * 0.9)}
    flat |= {f"axis_{k}": np.full(rows, a) for k, a in ((1, 1.5), (2, 0.8), (3, 0.75))}
    data = xr.Dataset(coords={"case": cases})
    for name, values in flat.items():
        table = np.tile(values, (len(cases), 1))
        table[0] = changes.get(name, values)
        data[name] = (("case", "row"), table)
    turn = np.linspace(0, 2 * np.pi, 40)
    for k in range(study.SHOTS):
        data[f"line_{k}"] = (("case", "i"), np.tile(np.stack([np.cos(turn), np.sin(turn)], 1).ravel(), (len(cases), 1)))
    numbers = {"capillary": 1.0, "reynolds": 0.1, "eps_cells": 4.0, "cells_a_unit": 12.0, "height": 4.0, "rate": 1.0}
    for name, value in (numbers | {"ended": "complete", "n_steps": 9, "n_cells": 48, "cpu_seconds": 1.0}).items():
        data[name] = ("case", [value] * len(cases))
    return {"vesicle_shear": data}


def test_measures_and_figure_of_steady_runs():
    data = made()
    found = study.fig_3_17(data)
    assert (found["drift"], found["area"], found["volume"], found["eps_cells"]) == (0, 0, 0, 4)
    assert (found["angle_v90"], found["reduced_v90"]) == pytest.approx((26, 0.9))
    assert found["theory_v90"] == pytest.approx(23.7, abs=0.1)
    header, table = study.rows(data, found)
    assert len(table) == 4 and {len(row) for row in table} == {len(header)}
    assert len(figures.fig_3_17(data, found).subfigs) == 2


def test_measures_tell_what_is_off():
    t = np.linspace(0, 4, study.ROWS + 1)
    area = 4 * math.pi * (1 - 0.02 * (t == t[5]))
    found = study.fig_3_17(made(angle=26 + 0.4 * t, area=area, volume=np.linspace(3.77, 3.77 * 1.03, t.size)))
    assert found["drift"] == found["drift_v90"] == pytest.approx(0.8, abs=0.03)
    assert found["drift_v95"] == 0
    assert found["area"] == pytest.approx(2) and found["volume"] == pytest.approx(3)
    lost = np.where(t > 3, np.nan, 12.0)
    assert math.isnan(study.fig_3_17(made(area=lost))["area"])
