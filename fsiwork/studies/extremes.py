"""A membrane at the ends of its parameters: which coupling is stable at which step, which is accurate, and what (1.54)
says, with the tension s E'(s) and with the tangential stiffness s E''(s)."""

import math
import re
from collections.abc import Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from fsiwork.scene import Scene, SceneError, loads
from fsiwork.simulate import build, frames, longest_step
from fsiwork.studies.exact import step_limit
from fsiwork.studies.stability import limit, outline, releasable

COUPLINGS = ("explicit", "semi-implicit", "stabilised", "iterated")
STEPS = ("auto", 1.0, 4.0, 16.0)  # the program's own step; multiples of its limit for the explicit coupling
RUNS = tuple(product(COUPLINGS, STEPS))
ACCURATE, INACCURATE, RAISED, DIVERGED = range(4)
OUTCOMES = ("stable and accurate", "stable, inaccurate", "makes energy", "diverged")
HORIZON = 100  # time compared, in limits of the explicit coupling
LONGER = 3  # so many times longer for the program's own step, which has to last
LEAST = 100  # steps that every run has to survive; those of the bisection twice as many
FINER = 8  # steps of the reference in a limit
ERROR = 5.0  # percent of the half-axis' excursion
NOTHING = 0.01  # an excursion below this share of the half-axis counts as this share: hardly anything moves
STRAIN = 0.01  # what an unstretched membrane is taken to release is what it holds at this strain
MADE, LENGTH = 0.25, 1.01  # energy made, of what can be released; length over the first
REASON = re.compile(r"t=\S+.*(cell \(|exceeds|solver|energy)")


class Run(NamedTuple):
    """How a run went: its outcome, why (or nothing), times and half-axis along x, Δt at the end, number of steps."""

    outcome: int
    why: str
    t: np.ndarray
    axis: np.ndarray
    dt: float
    steps: int


def watched(scene: Scene, coupling: str, step: float | str, horizon: float, released: float) -> Run:
    """Run a scene to ``horizon``: `DIVERGED` by the program's own word, `RAISED` when more energy was made than a part
    of what can be ``released``, or the interface grew, which it never should (`MADE`, `LENGTH`); else `ACCURATE`."""
    body = scene.bodies[0].model_copy(update={"coupling": coupling})
    clock = scene.clock.model_copy(update={"end": horizon, "step": step, "frames": 1})
    made = scene.model_copy(update={"bodies": (body,), "clock": clock})
    parts = list(frames(made))
    rows = {name: np.concatenate([part.gauges[name] for part in parts if part.gauges]) for name in parts[0].gauges}
    end, outcome, why = parts[-1], ACCURATE, ""
    if end.ended != "complete":
        outcome, why = DIVERGED, end.ended
    elif line := _past_bounds(rows, released):
        outcome, why = RAISED, f"{line} exceeds {_broken(made, step)}"
    return Run(outcome, why, rows["t"], rows["axis_x"], float(rows["dt"][-1]), end.step)


def _past_bounds(rows: Mapping[str, np.ndarray], released: float) -> str:
    """When, and by how much, a run made energy or grew longer; nothing if it did not."""
    total, length = rows["kinetic_energy"] + rows["elastic_energy"], rows["geometric_length"]
    gained, longer = (total - total[0]) / released, length / length[0]
    bad = ~((gained <= MADE) & (longer <= LENGTH))  # true for NaN
    if not bad.any():
        return ""
    k = int(bad.argmax())
    words = f"energy made {gained[k]:.3g} of what can be released, length {longer[k]:.4g} of the first"
    return f"past the bounds at t={rows['t'][k]:.4g}: {words}; Δt = {rows['dt'][k]:.3g}"


def _broken(scene: Scene, step: float | str) -> str:
    """Names of the limits at t = 0 that a fixed step exceeds."""
    sim = build(scene)
    limits = {} if step == "auto" else longest_step(sim.flow, sim.bodies)
    return ", ".join(f"{name} {most:.3g}" for name, most in limits.items() if step > most) or "no known limit"


def held_energy(scene: Scene) -> float:
    """Energy by which motion is judged: what the membrane can release, or holds at one percent of strain."""
    body = scene.bodies[0]
    rest = outline(body.shape, scene.box)[0] / body.stretch
    return max(releasable(scene), 0.5 * body.energy.stiffness * STRAIN**2 * rest)


def deviation(run: Run, reference: Run) -> float:
    """Largest deviation of the half-axis from the reference's, percent of its excursion; NaN without a reference."""
    if run.outcome == DIVERGED or reference.outcome != ACCURATE:
        return math.nan
    within = run.t <= reference.t[-1] * (1 + 1e-9)
    wanted = np.interp(run.t[within], reference.t, reference.axis)
    excursion = max(np.ptp(reference.axis), NOTHING * reference.axis[0])
    return float(100 * np.abs(run.axis[within] - wanted).max() / excursion)


def predictions(scene: Scene) -> dict[str, float]:
    """Limits of the explicit coupling: the program's own (``predicted``), and (1.54) with sE'(s) (``tension``) and with
    sE''(s) (``tangential``) for the scene's diffusion, which is backward Euler's in two fluids."""
    sim = build(scene)
    body, fluid, h = scene.bodies[0], scene.fluid, scene.box.h
    inside = body.inside or fluid
    numbers = min(fluid.viscosity, inside.viscosity), body.width.of(h), h, min(fluid.density, inside.density)
    theta = 1.0 if body.inside else sim.flow.theta
    s, stiffness = body.stretch, body.energy.stiffness
    return {
        "predicted": min(sim.bodies[0].explicit_limits(sim.flow).values()),
        "tension": float(step_limit(stiffness * s * (s - 1), *numbers, theta=theta)),
        "tangential": float(step_limit(stiffness * s, *numbers, theta=theta)),
    }


def extreme(scene: Scene, point: dict[str, Any]) -> dict[str, Any]:
    """Every coupling at every step (`RUNS`), and the largest explicit step, of a scene with one membrane.

    ``point`` may hold ``finer`` and ``longer`` (`FINER`, `LONGER`). Returns over ``run`` the ``outcome``, the ``error``
    [% of the excursion] and the ``step`` over the predicted limit; ``why``, a line for each run that is not stable;
    the `predictions`; ``limit`` and ``found`` of the explicit coupling, see `stability.Largest`.
    """
    released, out = held_energy(scene), predictions(scene)
    predicted = out["predicted"]
    finer, longer = int(point.get("finer", FINER)), float(point.get("longer", LONGER))
    reference = watched(scene, "explicit", predicted / finer, HORIZON * predicted, released)
    runs = []
    for coupling, step in RUNS:
        dt = step if step == "auto" else step * predicted
        times = longer * HORIZON if step == "auto" else max(HORIZON, LEAST * step)
        runs.append(watched(scene, coupling, dt, times * predicted, released))
    errors = [deviation(run, reference) for run in runs]
    codes = [run.outcome or int(not e <= ERROR) for run, e in zip(runs, errors, strict=True)]
    lines = [f"{coupling}, {step}: {run.why}" for (coupling, step), run in zip(RUNS, runs, strict=True) if run.why]
    largest, more = _largest(scene, predicted, released)
    done = sum(run.steps * (2 if coupling == "iterated" else 1) for (coupling, _), run in zip(RUNS, runs, strict=True))
    return out | {
        "outcome": (("run",), codes),
        "error": (("run",), errors),
        "step": (("run",), [run.dt / predicted for run in runs]),
        "why": "\n".join(lines),
        "why_reference": reference.why,
        "limit": largest.step,
        "found": largest.found,
        "n_steps": reference.steps + done + more,
    }


def _largest(scene: Scene, predicted: float, released: float):
    """The largest stable explicit step to ten percent, from the prediction to 64 times it; and the steps that took."""
    steps = 0

    def stable(dt: float) -> bool:
        nonlocal steps
        run = watched(scene, "explicit", dt, 2 * LEAST * dt, released)
        steps += run.steps
        return not run.outcome

    return limit(stable, predicted, 64 * predicted, 0.1), steps


def together(datasets: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """The studies of one and of two fluids along one axis ``case``."""
    return xr.concat([datasets["extremes_membrane"], datasets["extremes_fluids"]], "case")


def measure(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """What a user relies on, and how safe and how sharp (1.54) is.

    ``spatial``: extremes that make energy at a small explicit step, too; the force's form is unstable there, not the
    time step, and they are left out of what follows. ``auto_diverged``, ``auto_raised``: runs of the program's own step
    (the former with all extremes). ``ratio_…``: the explicit limit over each of the `predictions`; the largest is for
    one fluid, and where a limit was found. ``unexplained``: runs that ended or made energy without a time and a place
    or limit. ``refused``: share of the bad widths that are answered with one line about that setting.
    """
    data, bad = together(datasets), datasets["extremes_refused"]
    outcome = _by_run(data["outcome"])
    stable = data["why_reference"].values == ""
    own = outcome[:, :, STEPS.index("auto")]
    out = {"spatial": float((~stable).sum()), "auto_diverged": float((own == DIVERGED).sum())}
    out["auto_raised"] = float((own[stable] == RAISED).sum())
    for k, coupling in enumerate(COUPLINGS):
        out[f"auto_accurate_{coupling.replace('-', '_')}"] = float((own[:, k] == ACCURATE).mean())
    sharp = stable & (data["found"].values == 1) & np.isin(data["case"], datasets["extremes_membrane"]["case"])
    for name in ("predicted", "tension", "tangential"):
        ratio = np.where(data["found"] < 0, 0.0, data["limit"] / data[name])
        out[f"ratio_{name}_min"] = float(ratio[stable].min())
        out[f"ratio_{name}_max"] = float(ratio[sharp].max()) if sharp.any() else math.nan
    lines = [line for text in data["why"].values for line in str(text).splitlines()]
    out["unexplained"] = float((outcome >= RAISED).sum() - sum(bool(REASON.search(line)) for line in lines))
    out["refused"] = float(((bad["lines"] == 1) & (bad["path"] == 1)).mean())
    return out


def _by_run(values: xr.DataArray) -> np.ndarray:
    """Values over case, coupling, step."""
    return values.transpose("case", "run").values.reshape(-1, len(COUPLINGS), len(STEPS))


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each run that is not stable and accurate, with the reason of those that ended or made energy."""
    data, table = together(datasets), []
    for case in data["case"].values:
        one = data.sel(case=case)
        why = dict(line.split(": ", 1) for line in str(one["why"].item()).splitlines())
        for k, (coupling, step) in enumerate(RUNS):
            if outcome := int(one["outcome"][k]):
                key, error = f"{coupling}, {step}", round(float(one["error"][k]), 2)
                numbers = [round(float(one["step"][k]), 3), "–" if math.isnan(error) else error]
                table.append([str(case), key, *numbers, OUTCOMES[outcome], why.get(key, "")])
    return ["extreme", "coupling, step", "Δt over the limit", "error [% of the excursion]", "outcome", "reason"], table


def refused(scene: Scene, point: dict[str, Any]) -> dict[str, Any]:
    """What a scene whose ε/Δx is ``width`` is answered: ``lines``, 0 if it is taken, and the ``path`` named right."""
    path = "bodies.0.width.cells"
    try:
        loads(scene.model_dump_json(), {path: float(point["width"])})
    except SceneError as error:
        return {"lines": len(error.faults), "path": float(str(error.faults[0]).startswith(path)), "why": str(error)}
    return {"lines": 0, "path": 0.0, "why": ""}
