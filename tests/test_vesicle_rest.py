"""Vesicles at rest in space: what is measured of them against exact shapes, a short run, the measures of the figure."""

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.integrals import area_and_volume
from fsiwork.core.shapes import Ellipsoid
from fsiwork.figures import vesicles as figures
from fsiwork.scene import SceneError, load
from fsiwork.studies import jobs
from fsiwork.studies import vesicle_rest as study
from fsiwork.studies.vesicles import equilibrium
from fsiwork.targets import Plan

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
SCENE = CONFIGS / "scenes" / "vesicle_rest.yaml"
AXES = (0.5, 0.5, 0.8)


def eighth(cells=24):
    grid = Grid((cells,) * 3, 1 / cells)
    edges = Edges(grid, ((Side("symmetry"), Side("free-slip")),) * 3)
    phi = grid.sample(Ellipsoid((0.0, 0.0, 0.0), AXES).distance)
    edges.fill_scalar(phi, "linear")
    return grid, phi


def test_points_of_the_surface_lie_on_it():
    grid, phi = eighth()
    points = study.surface(grid, phi)
    value = (points**2 / np.square(AXES)).sum(axis=1)
    assert np.abs(value - 1).max() < 1e-4 and len(points) > 400
    assert (points > 0).all()  # in the eighth, and none lost beside a plane of symmetry
    assert points[:, 2].max() > 0.79 and points[:, 0].max() > 0.49


def test_roots_of_cubics_are_exact():
    where = np.linspace(0.01, 0.99, 30)
    t = np.array([-1.0, 0.0, 1.0, 2.0])[:, None]
    found = study.roots((t - where) * (1 + 0.2 * t + 0.1 * t**2))
    assert found == pytest.approx(where, abs=1e-12)


def test_the_exact_meridian_is_that_of_the_shape_equation():
    found = study.shape(None, {"volume": 0.6, "branch": "oblate"})
    r, z = found["r"][1], found["z"][1]
    assert (r[0], z[-1]) == pytest.approx((0, 0), abs=1e-12)
    middle, rise = 0.5 * (r[1:] + r[:-1]), np.diff(z)
    assert -2 * math.pi * (middle**2 * rise).sum() == pytest.approx(4 / 3 * math.pi * 0.6, rel=1e-4)
    assert 4 * math.pi * (middle * np.hypot(np.diff(r), rise)).sum() == pytest.approx(4 * math.pi, rel=1e-4)


@pytest.mark.parametrize("branch", ["prolate", "oblate"])
def test_energy_at_a_volume_nearby(branch):
    """dE/dV = p, against the shape equation there."""
    exact = xr.Dataset({name: getattr(equilibrium(0.77, branch), name) for name in ("energy", "pressure")})
    near = equilibrium(0.775, branch).energy
    assert study.exact_at(exact, 0.77, 0.775) == pytest.approx(near, rel=3e-4)
    assert abs(near / float(exact["energy"]) - 1) > 5e-3


def test_starts_of_the_study_have_their_volume_and_rest_area():
    """Area over stretch is the area without tension, 4π/(1 + σ/λ) with σ of the shape equation; volumes are nominal."""
    text = (CONFIGS / "studies" / "vesicle_rest.yaml").read_text(encoding="utf-8")
    for case, settings in yaml.safe_load(text)["axes"]["case"].items():
        branch, volume, _ = case.split("_")
        spec = load(SCENE, settings).bodies[0]
        a, b = (spec.shape.radius, spec.shape.edge) if spec.shape.kind == "tablet" else spec.shape.semi_axes[::2]
        area, inside = _tablet(a, b) if spec.shape.kind == "tablet" else _spheroid(a, b)
        assert inside == pytest.approx(4 / 3 * math.pi * float(volume), rel=1e-4), case
        tension = equilibrium(float(volume), branch).tension
        assert area / spec.stretch == pytest.approx(4 * math.pi / (1 + tension / 100), rel=2e-4), case


@pytest.mark.parametrize("size", ["coarse", "book"])
@pytest.mark.parametrize("name", ["vesicle_rest", "vesicle_shear"])
def test_runs_that_are_looked_at_by_their_steps_know_how_many(name, size):
    """With an automatic step nothing would be stepped, and nothing would seem to change."""
    plan = Plan(CONFIGS)
    runs = plan.study(name, size)
    clocks = [load(plan.scene(runs), point.overrides).clock for point in runs.points]
    assert len(clocks) >= 4 and all(clock.step != "auto" for clock in clocks)


def _tablet(R, e):
    area = 2 * math.pi * R**2 + 2 * math.pi**2 * R * e + 4 * math.pi * e**2
    return area, 2 * math.pi * R**2 * e + math.pi**2 * R * e**2 + 4 / 3 * math.pi * e**3


def _spheroid(a, c):
    t = (np.arange(2000) + 0.5) * math.pi / 4000
    area = 4 * math.pi * a * (np.sin(t) * np.hypot(a * np.cos(t), c * np.sin(t))).sum() * math.pi / 4000
    return area, 4 / 3 * math.pi * a * a * c


def test_a_run_of_some_steps_goes_downhill_and_keeps_its_volume():
    scene = load(SCENE, {"box.cells": 24, "clock.end": 0.12, "clock.step": 0.02, "bodies.0.renew": 3})
    found = study.relax(scene, {})
    energy, volume = found["energy"][1], found["volume"][1]
    assert found["ended"] == "complete" and found["n_steps"] == 6
    assert volume[0] == pytest.approx(4 / 3 * math.pi * 0.77, rel=1e-3)
    assert np.abs(volume / volume[0] - 1).max() < 2e-3
    assert found["area"][1][0] == pytest.approx(4 * math.pi, rel=1e-3)
    assert energy[0] == pytest.approx(1.611 * study.BALL, rel=0.02)  # of the spheroid, by quadrature
    assert energy[-1] < 0.97 * energy[0]
    assert len(found["r"][1]) == study.POINTS and np.hypot(found["r"][1], found["z"][1]).max() < 2.0


def made(offset=0.0, stretched=1.0):
    """Both studies as if every run had ended on the exact shape, ``offset`` further out, with a scaled energy."""
    cases, columns = [], {name: [] for name in ("t", "area", "volume", "energy", "r", "z")}
    shapes = {}
    for v in study.VOLUMES:
        for b in study.BRANCHES:
            shapes[v, b] = study.shape(None, {"volume": v, "branch": b})
            for start in ("spheroid", "plump" if b == "prolate" else "tablet"):
                cases.append(f"{b}_{v:g}_{start}")
                full = np.full(study.ROWS + 1, 1.0)
                columns["t"].append(np.linspace(0, 1, study.ROWS + 1))
                columns["area"].append(4 * math.pi * full)
                columns["volume"].append(4 / 3 * math.pi * v * full)
                columns["energy"].append(shapes[v, b]["energy"] * stretched * full)
                columns["r"].append(shapes[v, b]["r"][1] + offset)
                columns["z"].append(shapes[v, b]["z"][1])
    dims = {"t": "row", "area": "row", "volume": "row", "energy": "row", "r": "point", "z": "point"}
    data = xr.Dataset({k: (("case", dims[k]), np.array(q)) for k, q in columns.items()}, {"case": cases})
    for name, value in {"cells_a_unit": 20.0, "n_steps": 10, "cpu_seconds": 1.0}.items():
        data[name] = ("case", [value] * len(cases))
    exact = xr.Dataset(coords={"volume": list(study.VOLUMES), "branch": list(study.BRANCHES)})
    for name in ("energy", "pressure"):
        exact[name] = (("volume", "branch"), [[shapes[v, b][name] for b in study.BRANCHES] for v in study.VOLUMES])
    for name in "rz":
        table = [[shapes[v, b][name][1] for b in study.BRANCHES] for v in study.VOLUMES]
        exact[name] = (("volume", "branch", "u"), np.array(table))
    return {"vesicle_rest": data, "vesicle_shapes": exact}


@pytest.fixture(scope="module")
def ideal():
    return made()


def test_measures_of_exact_shapes(ideal):
    found = study.fig_3_16(ideal)
    assert max(found[k] for k in ("energy", "energy_measured", "starts", "settled", "volume", "area")) < 1e-6
    assert found["profile"] < 1e-6
    assert found["prolate_over_oblate"] == pytest.approx(1.4539 / 1.5254, rel=1e-3)
    assert found["oblate_over_prolate"] == pytest.approx(1.9557 / 2.0603, rel=1e-3)
    header, table = study.rows(ideal, found)
    assert len(table) == 8 and {len(row) for row in table} == {len(header)}
    assert len(figures.fig_3_16(ideal, found).subfigs) == 3


def test_measures_tell_what_is_off(ideal):
    other = made(0.02, 1.03)
    found = study.fig_3_16(other)
    assert found["energy"] == pytest.approx(3, rel=1e-6)
    assert found["profile"] == pytest.approx(2, rel=0.05)
    data = other["vesicle_rest"]
    data["energy"][0, -1] *= 1.02
    data["area"][1] *= 1.01
    found = study.fig_3_16(other)
    assert found["starts_prolate_0.77"] == found["starts"] == pytest.approx(2, rel=1e-6)
    assert found["settled"] == pytest.approx(2, rel=1e-6)
    assert found["area"] == pytest.approx(1, rel=1e-6)
    assert found["energy_measured_prolate_0.77_plump"] > 0.5  # at the volume that the larger area means
    data["energy"][2, -1] = math.nan
    assert all(math.isnan(study.fig_3_16(other)[k]) for k in ("energy", "profile", "prolate_over_oblate"))


def test_an_eighth_counts_eight_times():
    grid, phi = eighth(32)
    area, volume = area_and_volume(grid, phi)
    assert (8 * area, 8 * volume) == pytest.approx(_spheroid(0.5, 0.8), rel=1e-4)


def test_kernels_are_compiled_beforehand_for_a_box_that_32_cells_do_not_fill():
    slender = {"box.length": [1.0, 1.0, 3.0], "box.cells": 36, "bodies.0.shape.semi_axes": [0.5, 0.5, 2.0]}
    with pytest.raises(SceneError):
        load(SCENE, slender | {"box.cells": jobs.WARM_CELLS})
    assert jobs.warm([(SCENE, slender)]) == 1
