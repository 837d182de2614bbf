"""A membrane at the ends of its parameters: runs are judged right, measures turn red, the figure says it."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.text import Text

from fsiwork import scene
from fsiwork.figures import extremes as figures
from fsiwork.simulate import build, longest_step
from fsiwork.studies import exact, extremes, scorecard
from fsiwork.targets import Plan

CONFIGS = Path(__file__).parents[1] / "configs"
PLAN = Plan(CONFIGS)


def made(**overrides):
    changes = {"box.cells": 24} | {path.replace("__", "."): value for path, value in overrides.items()}
    return scene.load(CONFIGS / "scenes" / "extreme_membrane.yaml", changes)


# ------------------------------------------------------------------------------------------------------------ runs
def test_a_run_beyond_the_limit_says_when_where_and_why():
    one = made()
    limit, released = extremes.predictions(one)["predicted"], extremes.held_energy(one)
    good = extremes.watched(one, "explicit", 0.5 * limit, 20 * limit, released)
    assert (good.outcome, good.why, good.steps) == (extremes.ACCURATE, "", 40)
    wild = extremes.watched(one, "explicit", 6 * limit, 200 * limit, released)
    assert wild.outcome == extremes.DIVERGED
    assert extremes.REASON.search(wild.why)
    assert "exceeds elastic (1.54)" in wild.why
    assert np.isnan(extremes.deviation(wild, good))
    assert extremes.deviation(good, good) == 0.0


def test_energy_out_of_nothing_is_seen():
    one = made()
    limit, released = extremes.predictions(one)["predicted"], extremes.held_energy(one)
    run = extremes.watched(one, "explicit", 0.5 * limit, 20 * limit, 1e-6 * released)
    assert run.outcome == extremes.ACCURATE  # it loses energy, however little could be released
    narrow = made(bodies__0__width__cells=1)
    run = extremes.watched(narrow, "explicit", 0.5 * limit, 40 * limit, 0.01 * released)
    assert run.outcome == extremes.RAISED
    assert extremes.REASON.search(run.why)
    assert "no known limit" in run.why  # the form is to blame, not the step


def test_deviation_is_a_share_of_the_excursion():
    t = np.linspace(0, 1, 11)
    reference = extremes.Run(0, "", t, 0.6 - 0.1 * t, 0.1, 10)
    assert extremes.deviation(extremes.Run(0, "", t, 0.6 - 0.09 * t, 0.1, 10), reference) == pytest.approx(10)
    still = extremes.Run(0, "", t, 0.6 + 0 * t, 0.1, 10)
    moved = extremes.Run(0, "", t, 0.6 + 6e-4 * t, 0.1, 10)
    assert extremes.deviation(moved, still) == pytest.approx(10)  # of a hundredth of the half-axis
    longer = extremes.Run(0, "", np.linspace(0, 2, 21), np.where(np.linspace(0, 2, 21) > 1, 9.0, 0.6), 0.1, 20)
    assert extremes.deviation(longer, still) == 0.0  # only while there is a reference


def test_predictions_are_1_54_with_either_stiffness():
    one = made(bodies__0__stretch=1.5, fluid__diffusion="backward-euler")
    found, h = extremes.predictions(one), one.box.h
    assert found["tension"] == pytest.approx(exact.step_limit(7.5, 0.01, 3 * h, h))
    assert found["tangential"] == pytest.approx(exact.step_limit(15.0, 0.01, 3 * h, h))
    mixed = extremes.predictions(made(bodies__0__inside={"density": 0.5, "viscosity": 2.0}))
    assert mixed["tangential"] == pytest.approx(exact.step_limit(12.625, 0.01, 3 * h, h, 0.5))
    hardly = extremes.predictions(made(bodies__0__stretch=1.001))
    assert hardly["tension"] > 10 * hardly["predicted"]


@pytest.mark.parametrize("stretch", [1.001, 1.05])
def test_the_own_step_of_the_book_s_predictor_serves_a_hardly_stretched_membrane(stretch):
    one = made(box__cells=40, bodies__0__stretch=stretch, bodies__0__coupling="semi-implicit")
    limit, released = extremes.predictions(one)["predicted"], extremes.held_energy(one)
    assert extremes.watched(one, "semi-implicit", "auto", 150 * limit, released).outcome == extremes.ACCURATE
    assert extremes.watched(one, "semi-implicit", 3 * limit, 150 * limit, released).outcome > extremes.INACCURATE
    sim = build(one)
    assert longest_step(sim.flow, sim.bodies)["elastic, accuracy"] == pytest.approx(limit)
    drop = build(made(bodies__0__energy={"kind": "linear", "stiffness": 1.0}, bodies__0__coupling="semi-implicit"))
    limits = drop.bodies[0].explicit_limits(drop.flow)
    assert longest_step(drop.flow, drop.bodies)["elastic, accuracy"] == pytest.approx(4 * min(limits.values()))


def test_an_extreme_has_a_number_for_every_coupling_and_step(monkeypatch):
    monkeypatch.setattr(extremes, "HORIZON", 8)
    monkeypatch.setattr(extremes, "LEAST", 8)
    found = extremes.extreme(made(), {"case": "stiffness_10", "finer": 2, "longer": 1})
    for name in ("outcome", "error", "step"):
        assert len(found[name][1]) == len(extremes.RUNS) == 16
    outcome = np.reshape(found["outcome"][1], (4, 4))
    assert outcome[0, 3] == extremes.DIVERGED
    assert outcome[:, 0].max() <= extremes.INACCURATE
    assert found["limit"] >= found["predicted"]
    assert len(found["why"].splitlines()) == (outcome > extremes.INACCURATE).sum()


def test_widths_below_a_cell_are_refused_in_one_line():
    found = extremes.refused(made(), {"width": "0.5"})
    assert (found["lines"], found["path"]) == (1, 1.0)
    assert "below the grid step" in found["why"]
    assert extremes.refused(made(), {"width": "1.0"})["lines"] == 0


# --------------------------------------------------------------------------------------------------------- measures
def study(cases, changes=None, **more):
    """A study of extremes at which all is well but the explicit coupling at 4 and 16 times its limit."""
    outcome = np.zeros((len(cases), 16), int)
    outcome[:, 2:4] = extremes.DIVERGED
    lines = [f"explicit, {step}: diverged at t=1 (step 3): |u| = 9 at cell (1, 2); it" for step in (4.0, 16.0)]
    data = {"outcome": outcome, "error": np.where(outcome == extremes.DIVERGED, np.nan, 1.0), "step": 1.0 + 0 * outcome}
    out = xr.Dataset({name: (("case", "run"), values) for name, values in data.items()}, {"case": cases})
    numbers = {"predicted": 1.0, "tension": 5.0, "tangential": 0.8, "limit": 2.0, "found": 1.0} | (changes or {})
    for name, value in numbers.items():
        out[name] = ("case", np.full(len(cases), value))
    texts = {"why": "\n".join(lines), "why_reference": ""} | more
    return out.assign({name: ("case", [value] * len(cases)) for name, value in texts.items()})


def whole(narrow=(), **changes):
    """All three studies; ``narrow``: what is special at ε = Δx."""
    special = study(["width_1"], **{"why_reference": "past the bounds at t=1: energy made 3", **dict(narrow)})
    plain = study(["stiffness_1e6", "wall_2"], changes)
    bad = xr.Dataset({"lines": ("width", [1.0, 1.0]), "path": ("width", [1.0, 1.0])}, {"width": ["0", "0.5"]})
    one = xr.concat([plain, special], "case")
    return {"extremes_membrane": one, "extremes_fluids": study(["density_1e3"], changes), "extremes_refused": bad}


def red(datasets):
    rows = scorecard.rows(PLAN.entry("extremes_membrane", "coarse"), "coarse", extremes.measure(datasets), {})
    return {row["metric"] for row in rows if not row["pass"]}


def test_checks_hold_where_all_is_well():
    assert red(whole()) == set()
    assert extremes.measure(whole())["auto_accurate_stabilised"] == 1.0


def with_outcome(run, code, where="extremes_membrane"):
    datasets = whole()
    datasets[where]["outcome"][0, run] = code
    return datasets


def test_checks_turn_red():
    own = extremes.RUNS.index(("iterated", "auto"))
    assert red(with_outcome(own, extremes.DIVERGED)) == {"auto_diverged", "unexplained"}
    assert red(with_outcome(own, extremes.RAISED, "extremes_fluids")) == {"auto_raised", "unexplained"}
    assert red(whole(limit=0.9)) == {"ratio_predicted_min"}
    assert red(whole(limit=0.5)) == {"ratio_predicted_min", "ratio_tangential_min"}
    assert red(whole(limit=6.0)) == {"ratio_predicted_max", "ratio_tension_min"}
    none = {"ratio_predicted_min", "ratio_predicted_max", "ratio_tangential_min"}
    assert red(whole(found=-1.0)) == none
    spatial = whole()
    spatial["extremes_membrane"]["why_reference"][0] = "past the bounds at t=1: energy made 3"
    assert red(spatial) == {"spatial"}
    mute = whole()
    mute["extremes_membrane"]["why"][0] = "explicit, 4.0: something\nexplicit, 16.0: something"
    assert red(mute) == {"unexplained"}
    taken = whole()
    taken["extremes_refused"]["lines"][1] = 0.0
    assert red(taken) == {"refused"}


def test_the_table_has_the_reason_of_each_divergence():
    header, rows = extremes.rows(whole(), {})
    assert len(rows) == 4 * 2
    first = dict(zip(header, rows[0], strict=True))
    assert first["extreme"] == "stiffness_1e6"
    assert first["outcome"] == "diverged"
    assert "cell (1, 2)" in first["reason"]


def test_the_figure_marks_every_outcome():
    datasets = with_outcome(5, extremes.RAISED)
    datasets["extremes_membrane"]["outcome"][1, 6] = extremes.INACCURATE
    drawn = figures.extremes_membrane(datasets, extremes.measure(datasets))
    drawn.canvas.draw()
    texts = [text.get_text() for text in drawn.findobj(Text)]
    assert [texts.count(sign) for sign in figures.SIGNS[1:]] == [1, 1, 8]
    assert any("100 % of the extremes" in text for text in texts)
    assert "semi-implicit, 16 ×" in texts
