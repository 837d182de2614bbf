"""Measures of the flow's studies on datasets made up to known answers: right on right ones, wrong on wrong ones."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fsiwork import scene
from fsiwork.figures import energy as energy_figure
from fsiwork.figures import flows, style
from fsiwork.studies import convergence, energy, exact, modes, tradeoff

SCENES = Path(__file__).parents[1] / "configs" / "scenes"
EXCESS = {"elliptic_membrane": 0.28919163, "oscillating_drop": 0.11871248}  # energies that can be released
CELLS, STEPS = np.array([32, 64, 128]), np.array([0.1, 0.05, 0.025])


def text(name, **overrides):
    return scene.load(SCENES / f"{name}.yaml", overrides).model_dump_json()


# ---------------------------------------------------------------------------------------------------------- vortices
def vortices(space=2.0, time=2.0, divergence=1e-14):
    h = 1 / CELLS
    grids = xr.Dataset(
        {"error_u": ("cells", h**space), "error_p": ("cells", 3 * h**space), "divergence": ("cells", 0 * h)},
        {"cells": CELLS},
    )
    grids["divergence"][-1] = divergence
    steps = xr.Dataset({"error_u": ("step", STEPS**time), "error_p": ("step", 2 * STEPS**time)}, {"step": STEPS})
    return {"taylor_green_space": grids, "taylor_green_time": steps}


def test_orders_are_measured_and_a_wrong_one_shows():
    good = convergence.measure_taylor_green(vortices())
    assert good == pytest.approx(
        {"order_space_u": 2, "order_space_p": 2, "order_time_u": 2, "order_time_p": 2, "divergence": 1e-14}
    )
    assert convergence.measure_taylor_green(vortices(space=1.0))["order_space_p"] < 1.9
    assert convergence.measure_taylor_green(vortices(time=1.0))["order_time_u"] < 1.9
    assert convergence.measure_taylor_green(vortices(divergence=1e-3))["divergence"] > 1e-10


def test_one_bad_interval_or_a_missing_run_spoils_an_order():
    data = vortices()
    data["taylor_green_space"]["error_u"][2] = data["taylor_green_space"]["error_u"][1] / 2  # 2, then 1
    assert convergence.measure_taylor_green(data)["order_space_u"] == pytest.approx(1.0)
    data["taylor_green_time"]["error_u"][0] = math.nan
    data["taylor_green_space"]["divergence"][0] = math.nan
    found = convergence.measure_taylor_green(data)
    assert math.isnan(found["order_time_u"])
    assert math.isnan(found["divergence"])


def test_vortices_of_the_solver_are_near_the_exact_ones():
    overrides = {"box.cells": 32, "clock.step": 0.01, "clock.end": 0.2, "clock.frames": 1}
    found = convergence.taylor_green(scene.load(SCENES / "taylor_green.yaml", overrides), {})
    assert 0 < found["error_u"] < 2e-4
    assert 0 < found["error_p"] < 5e-3
    assert found["divergence"] < 1e-12
    with pytest.raises(ValueError, match="Taylor"):
        convergence.taylor_green(scene.load(SCENES / "cavity.yaml"), {})


def test_steps_of_the_solver_have_order_two():
    def errors(step):
        overrides = {"box.cells": 16, "clock.step": step, "clock.end": 0.4, "clock.frames": 1}
        return convergence.taylor_green_step(scene.load(SCENES / "taylor_green.yaml", overrides), {"finest": 0.0025})

    large, small = errors(0.1), errors(0.05)
    for name in ("error_u", "error_p"):
        assert 1.9 < math.log2(large[name] / small[name]) < 2.2


# ------------------------------------------------------------------------------------------------------------ cavity
def cavities(shift=0.0, change=5e-7):
    known = np.array([exact.cavity(re)[1] for re in (100, 1000)])
    wrong = known.copy()
    wrong[1, 3] += shift
    coords = {"case": ["re100", "re1000"]}
    return {
        "cavity": xr.Dataset(
            {"u": (("case", "y_ghia"), wrong), "ghia": (("case", "y_ghia"), known), "change": ("case", [1e-7, change])},
            coords,
        )
    }


def test_a_deviation_from_the_table_shows():
    assert convergence.measure_cavity(cavities()) == {"deviation_re100": 0, "deviation_re1000": 0, "change": 5e-7}
    wrong = convergence.measure_cavity(cavities(shift=-0.01, change=1e-3))
    assert wrong["deviation_re1000"] == pytest.approx(0.01)
    assert wrong["deviation_re100"] == 0
    assert wrong["change"] > 1e-6
    assert math.isnan(convergence.measure_cavity(cavities(shift=math.nan))["deviation_re1000"])


def test_a_slow_cavity_stops_where_it_is_told_and_says_that_it_is_not_steady():
    small = scene.load(SCENES / "cavity.yaml", {"box.cells": 16, "clock.step": 0.02})
    found = convergence.cavity(small, {"steady": 1e-6, "longest": 1.0})
    assert found["t_end"] == pytest.approx(1.0)
    assert found["change"] > 1e-6
    found = convergence.cavity(small, {"steady": 1e-3, "longest": 50.0})
    assert found["t_end"] < 50
    assert found["change"] < 1e-3
    assert np.abs(found["u"][1] - found["ghia"][1]).max() < 0.05
    assert found["profile"][1][[0, -1]] == pytest.approx([0, 1], abs=1e-12)


# ------------------------------------------------------------------------------------------------------ oscillations
def oscillating(name, omega, gamma, ended="complete", **overrides):
    t = np.linspace(0, 4, 801)
    wave = 1e-2 * np.exp(-gamma * t) * np.cos(omega * t)
    data = xr.Dataset({"axis_x": ("row", 0.6 + wave / 2), "axis_y": ("row", 0.6 - wave / 2)}, {"t_step": ("row", t)})
    data["n_cells"], data["cpu_seconds"], data["n_steps"] = 128.0, 2.0, 800.0
    data["ended"], data["scene"] = ended, text(name, **overrides)
    return {name: data}


def test_a_mode_is_fitted_and_a_wrong_one_shows():
    found = modes.measure_drop(oscillating("mode_drop", 3.394587, 0.246261))
    assert found["omega_over_sharp"] == pytest.approx(1, abs=1e-4)
    assert found["gamma_over_sharp"] == pytest.approx(1, abs=1e-3)
    wrong = modes.measure_drop(oscillating("mode_drop", 3.6, 0.1))
    assert abs(wrong["omega"] - 3.394587) > 0.0679
    assert abs(wrong["gamma"] - 0.246261) > 0.0616
    assert math.isnan(modes.measure_drop(oscillating("mode_drop", 3.4, 0.2, ended="diverged"))["omega"])
    found = modes.measure_membrane(oscillating("mode_membrane", 5.080916, 0.347874))
    assert found["omega_over_sharp"] == pytest.approx(1, abs=1e-4)
    assert found["omega_over_smeared"] > 1.05


@pytest.mark.parametrize("name", ["mode_drop", "mode_membrane"])
def test_the_smeared_theory_becomes_the_sharp_one_as_the_band_narrows(name):
    body = scene.load(SCENES / f"{name}.yaml").bodies[0]
    radius, mu = math.sqrt(0.375), 0.05
    law = body.energy
    if name == "mode_drop":
        sharp = exact.drop_mode(law.stiffness, radius, mu)
    else:
        sharp = exact.membrane_mode(law.stiffness, body.stretch, radius, mu)
    wide, narrow = (modes.smeared_mode(body, radius, eps, mu) for eps in (0.12, 0.03))
    assert abs(narrow.omega - sharp.omega) < 0.4 * abs(wide.omega - sharp.omega)
    assert narrow.omega == pytest.approx(sharp.omega, rel=0.06)
    assert narrow.gamma == pytest.approx(sharp.gamma, rel=0.06)


# ------------------------------------------------------------------------------------------------------------ energy
def runs(axes, total, name="elliptic_membrane", ended="complete"):
    """Ten rows, each with a tenth of the total [of the excess energy]."""
    shape = tuple(len(values) for values in axes.values())
    excess = EXCESS[name]
    rows = np.broadcast_to(np.asarray(total)[..., None] * excess / 10, (*shape, 10))
    data = xr.Dataset({"energy_residual": ((*axes, "row"), rows.copy())}, axes)
    data = data.assign_coords(t_step=((*axes, "row"), np.broadcast_to(np.linspace(0.1, 1, 10), rows.shape).copy()))
    data["ended"], data["scene"] = (tuple(axes), np.full(shape, ended)), (tuple(axes), np.full(shape, text(name)))
    data["n_cells"] = 128.0
    return data


def budget(time=1.0, space=1.0, total=0.02, ended="complete"):
    steps = np.array([1e-3, 5e-4, 2.5e-4, 1.25e-4])
    grid = (32.0 / CELLS) ** space
    return {
        "energy_steps": runs({"step": steps}, 0.07 + 5 * steps**time),
        "energy_grids": runs({"dirac": ["plain", "renormalised"], "cells": CELLS}, [0.1 * grid, 0.05 + 0.1 * grid]),
        "energy_bodies_membrane": runs({}, -total, ended=ended),
        "energy_bodies_drop": runs({}, total, "oscillating_drop"),
        "energy_of_ring": parts(steps[:2], time, space),
        "energy_of_drop_3d": parts(steps[:2], 1.0, 2.0),
    }


def parts(steps, time, space):
    """A scene's parts of the residual, falling with these orders, on 24 and 48 cells."""
    data = {"steps": ("halving", steps), "of_step": ("halving", 9 * steps**time)}
    data |= {"sides": ("level", [24.0, 48.0]), "of_grid": ("level", [0.1, 0.1 * 0.5**space])}
    return xr.Dataset(data).assign(n_cells=48.0)


def test_parts_of_the_energy_residual_are_told_apart():
    found = energy.measure(budget())
    assert found["order_step"] == pytest.approx(1.0, abs=1e-6)
    assert found["order_grid"] == pytest.approx(1.0)
    assert found["order_grid_renormalised"] == pytest.approx(1.0)
    assert found["rest_renormalised"] == pytest.approx(0.075, rel=1e-5)
    assert [found["total_membrane"], found["total_drop"]] == pytest.approx([0.02, 0.02], rel=1e-5)
    assert found["step_largest"] == pytest.approx(0.002, rel=1e-5)
    assert [found["scenes_order_step"], found["scenes_order_grid"]] == pytest.approx([1.0, 1.0])
    assert [found["order_grid_drop_3d"], found["scenes_rest"]] == pytest.approx([2.0, 0.05])


def test_a_residual_that_does_not_fall_shows():
    found = energy.measure(budget(time=0.5, space=0.1, total=0.3))
    assert found["order_step"] < 0.9
    assert found["order_grid"] < 0.9
    assert found["total_membrane"] > 0.15
    assert found["total_drop"] > 0.15
    assert found["scenes_order_step"] == pytest.approx(0.5)
    assert found["scenes_order_grid"] == pytest.approx(0.1)
    assert math.isnan(energy.measure(budget(ended="diverged at t=0.1"))["total_membrane"])


def test_runs_with_another_start_are_refused():
    data = budget()["energy_steps"]
    data["scene"][0] = text("oscillating_drop")
    with pytest.raises(ValueError, match="same energy"):
        energy.totals(data)


# ---------------------------------------------------------------------------------------------------- error over cost
def grid_of_runs(reach=1.5):
    """Errors of 10^-reach·k on grid k, whatever the step; smaller steps and better grids cost more."""
    couplings, cells, steps = ["explicit", "semi-implicit"], np.array([32, 64, 128, 256]), np.array([0.004, 0.008])
    shape, t = (2, 4, 2), np.linspace(0, 2, 41)
    error = np.broadcast_to(10 ** (-reach * np.arange(4) / 3)[None, :, None] * np.array([1.0, 2.0]), shape)
    axis = 0.6 + 0.01 * error[..., None] * np.sin(t)
    data = xr.Dataset(
        {
            "axis_x": (("coupling", "cells", "step", "row"), axis),
            "axis_y": (("coupling", "cells", "step", "row"), axis),
        },
        {"coupling": couplings, "cells": cells, "step": steps},
    )
    data = data.assign_coords(t_step=(data["axis_x"].dims, np.broadcast_to(t, axis.shape).copy()))
    dials = ("coupling", "cells", "step")
    data["ended"] = dials, np.full(shape, "complete", dtype=object)
    cpu = (cells / 32.0)[None, :, None] ** 2 * np.array([1.0, 1.5])[:, None, None] * np.array([2.0, 1.0])
    data["cpu_seconds"] = dials, cpu
    data["n_steps"] = dials, np.broadcast_to(2 / steps, shape).copy()
    data["n_cells"] = dials, np.broadcast_to(cells[None, :, None].astype(float), shape).copy()
    fine = np.linspace(0, 2, 401)
    finest = xr.Dataset(dict.fromkeys(("axis_x", "axis_y"), ("row", 0.6 + 0 * fine)), {"t_step": ("row", fine)})
    finest["n_cells"], finest["n_steps"], finest["cpu_seconds"] = 512.0, 4000.0, 100.0
    return {"tradeoff_grid": data, "tradeoff_finest": finest}


def test_the_front_is_what_no_run_dominates():
    points = [tradeoff.Run({}, error, cpu) for error, cpu in ((4, 1), (5, 2), (2, 3), (2, 4), (1, 9), (1.5, 9))]
    assert [(run.error, run.cpu) for run in tradeoff.front(points)] == [(4, 1), (2, 3), (1, 9)]
    powers = [tradeoff.Run({}, 10.0**-k, 50.0**k) for k in range(3)]
    assert tradeoff.next_digit(powers) == pytest.approx(50)
    assert math.isnan(tradeoff.next_digit(powers[:1]))


def test_length_and_reach_of_the_front():
    found = tradeoff.measure(grid_of_runs())
    assert found["front_decades"] == pytest.approx(1.5 + math.log10(2), rel=1e-6)
    assert found["front_points"] >= 4
    assert found["least_error"] == pytest.approx(100 * 0.01 * 10**-1.5 / tradeoff.RADIUS, rel=1e-3)
    assert found["book_error"] == pytest.approx(100 * 0.02 * 0.1 / tradeoff.RADIUS, rel=1e-3)
    assert found["book_cpu"] == pytest.approx(24.0)
    assert found["book_over_front"] == pytest.approx(1.5)


def test_a_short_front_diverged_runs_and_the_finest_run_itself_show():
    assert tradeoff.measure(grid_of_runs(reach=0.3))["front_decades"] < 1
    data = grid_of_runs()
    data["tradeoff_grid"]["ended"][:, 2] = "diverged at t=1"
    assert math.isnan(tradeoff.measure(data)["book_error"])
    data["tradeoff_grid"]["ended"][:] = "diverged at t=1"
    assert tradeoff.measure(data)["front_points"] == 0
    data = grid_of_runs()
    data["tradeoff_finest"]["n_cells"], data["tradeoff_finest"]["n_steps"] = 256.0, 500.0
    assert (256, 0.004) not in [(r.point["cells"], r.point["step"]) for r in tradeoff.runs(*data.values())]


# ----------------------------------------------------------------------------------------------------------- figures
def test_figures_of_made_up_data_are_drawn(tmp_path):
    oscillation = oscillating("mode_drop", 3.39, 0.25)
    full = cavities()
    fine = {"profile": (("case", "y_fine"), np.zeros((2, 5))), "y_profile": (("case", "y_fine"), np.zeros((2, 5)))}
    full["cavity"] = full["cavity"].assign(
        fine
        | {"y_position": (("case", "y_ghia"), np.tile(exact.GHIA_Y, (2, 1)))}
        | {name: ("case", [100.0, 1000.0]) for name in ("reynolds", "n_cells", "t_end")}
    )
    made = {
        "taylor_green": (vortices(), convergence.measure_taylor_green),
        "cavity": (full, convergence.measure_cavity),
        "mode_drop": (oscillation, modes.measure_drop),
        "energy_law": (budget(), energy.measure),
        "tradeoff_membrane": (grid_of_runs(), tradeoff.measure),
    }
    for name, (data, measure) in made.items():
        module = energy_figure if name == "energy_law" else flows
        path = style.save(getattr(module, name)(data, measure(data)), tmp_path / f"{name}.png")
        assert 5_000 < path.stat().st_size <= 150_000


def test_metrics_that_are_checked_are_measured():
    import yaml

    book = yaml.safe_load((SCENES.parent / "book.yaml").read_text(encoding="utf-8"))
    found = {
        "taylor_green": convergence.measure_taylor_green(vortices()),
        "cavity": convergence.measure_cavity(cavities()),
        "mode_drop": modes.measure_drop(oscillating("mode_drop", 3.4, 0.2)),
        "mode_membrane": modes.measure_membrane(oscillating("mode_membrane", 5.0, 0.3)),
        "energy_law": energy.measure(budget()),
        "tradeoff_membrane": tradeoff.measure(grid_of_runs()),
    }
    for name, metrics in found.items():
        assert {check["metric"] for check in book[name]["checks"]} <= set(metrics)
        assert json.dumps(metrics)  # plain numbers
