"""How large a time step may be: the linear model of section 1.6, and the real step of any scene by bisection.

Functions `(scene, point) -> dict` are called by studies, point by point; `measure_1_54` reads the studies' datasets.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from fsiwork import layout
from fsiwork.studies import linear
from fsiwork.studies.exact import step_limit


def _columns(point: dict[str, Any]):
    """Columns of one case from the short names of a study's axes."""
    names = (("viscosity", 0.0), ("tension", 1.0), ("width", 1.5))
    return tuple(np.array([float(point.get(name, default))]) for name, default in names)


def spectral_limit(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """One case of the scan: ``viscosity``, ``tension``, ``width`` (ε/Δx), ``cells`` (even)."""
    case, cells = _columns(point), int(point.get("cells", 16))
    ratio, prediction = float(linear.spectral_limits(case, cells)[0]), float(linear.predicted(case, cells)[0])
    return {"limit": ratio * prediction, "predicted": prediction, "deviation": ratio - 1}


def stepping_limit(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """The same by ``steps`` time steps: ``excess`` is the limit over (1.54), less one."""
    case, cells = _columns(point), int(point.get("cells", 16))
    ratio = float(linear.stepping_limits(case, cells, int(point.get("steps", 20000)))[0])
    prediction = float(linear.predicted(case, cells)[0])
    return {"limit": ratio * prediction, "predicted": prediction, "excess": ratio - 1}


def spectral_radius(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Largest spectral radius over the modes for a ``scheme`` at ``ratio`` times (1.54)."""
    case, cells = _columns(point), int(point.get("cells", 16))
    dt = float(point["ratio"]) * linear.predicted(case, cells)
    radius = linear.radius(point["scheme"], *linear.numbers(case, dt, cells), dt)
    return {"radius": float(radius.max())}


def linear_scan(_scene=None, point: dict[str, Any] | None = None) -> dict[str, Any]:
    """All 936 cases at once: μ 0 and 1e-8…1e3, λ 1e-3…1e8, ε/Δx 0.5…10, on ``cells``² points with ``steps`` steps.

    Returns the cases (dim ``case``), their spectral ``deviation`` and stepping ``excess`` from (1.54), and the largest
    radius of the implicit, semi-implicit and printed schemes at 1e-6 to 1e8 times (1.54).
    """
    point = point or {}
    cells, steps = int(point.get("cells", 16)), int(point.get("steps", 20000))
    case = tuple(np.array(linear.CASES).T)
    names = ("viscosity", "tension", "width")
    out = {name: (("case",), column) for name, column in zip(names, case, strict=True)}
    out["deviation"] = (("case",), linear.spectral_limits(case, cells) - 1)
    out["excess"] = (("case",), linear.stepping_limits(case, cells, steps) - 1)
    for scheme, factors in (
        ("implicit", 10.0 ** np.arange(-6, 9)),
        ("semi-implicit", 10.0 ** np.arange(-6, 9)),
        ("predictor-printed", (1.5,)),
    ):
        steps_of = [factor * linear.predicted(case, cells) for factor in factors]
        radii = [linear.radius(scheme, *linear.numbers(case, dt, cells), dt[:, None]).max() for dt in steps_of]
        out[scheme.replace("-", "_") + "_radius"] = float(max(radii))
    return out


class Largest(NamedTuple):
    """Result of `limit`: the largest step seen stable, how it ended, and how many runs it took.

    ``found`` is 1 for a limit, 0 when nothing up to ``largest`` was unstable (``step`` is then ``largest``) and -1 when
    no step was stable (``step`` is NaN): an instability in space, not in time.
    """

    step: float
    found: int
    trials: int


def limit(stable: Callable[[float], bool], start: float, largest: float = 0.24, tolerance: float = 0.01) -> Largest:
    """Largest Δt for which ``stable(Δt)`` holds: search from ``start`` by factors, then bisect to ``tolerance``.

    Upwards by 1.3 as far as ``largest``, downwards by 2 as far as ``start``/256.
    """
    tried = []

    def test(dt: float) -> bool:
        tried.append(dt)
        return stable(dt)

    low = high = min(start, largest)
    if test(low):
        while low == high:
            if low >= largest:
                return Largest(largest, 0, len(tried))
            high = min(1.3 * low, largest)
            low = high if test(high) else low
    else:
        while low == high:
            if high < start / 256:
                return Largest(math.nan, -1, len(tried))
            low = high / 2
            high = high if test(low) else low
    while high > (1 + tolerance) * low:
        trial = math.sqrt(low * high)
        low, high = (trial, high) if test(trial) else (low, trial)
    return Largest(low, 1, len(tried))


def _energy(law, stretch: float) -> tuple[float, float]:
    """E(s) and E'(s) of a scene's energy law."""
    if not hasattr(law, "kind"):  # written in Python
        return float(law.E(stretch)), float(law.dE(stretch))
    if law.kind == "linear":
        return law.stiffness * stretch, law.stiffness
    return 0.5 * law.stiffness * (stretch - 1) ** 2, law.stiffness * (stretch - 1)


def outline(shape, box) -> tuple[float, float]:
    """Length and area of a scene's shape in the plane, from its zero line on 800 cells (relative error about 1e-5).

    Gauges will not do: the small difference of two energies needs more than a smeared interface gives.
    """
    from fsiwork.build import shape as built

    h = max(box.length) / 800
    fine = layout.Geometry(tuple(round(side / h) for side in box.length), h, box.origin, (False, False))
    lines = fine.coordinates()
    phi = np.broadcast_to(built(shape).distance(lines["x_c"][:, None], lines["y_c"][None, :]), fine.n).T
    line = layout.contour(phi, fine)
    length = area = 0.0
    for piece in np.unique(line["piece"]):
        x, y = (line[axis][line["piece"] == piece] for axis in "xy")
        length += float(np.hypot(np.diff(x), np.diff(y)).sum())
        area += 0.5 * float(np.sum(x[:-1] * np.diff(y) - y[:-1] * np.diff(x)))
    return length, abs(area)


def releasable(scene) -> float:
    """Elastic energy of the uniformly stretched first body of a scene above that of the circle of the same area."""
    body = scene.bodies[0]
    length, area = outline(body.shape, scene.box)
    rest = length / body.stretch
    circle = 2 * math.sqrt(math.pi * area) / rest
    return (_energy(body.energy, body.stretch)[0] - _energy(body.energy, circle)[0]) * rest


def stays_bounded(scene, dt: float, horizon: float, released: float) -> tuple[bool, int]:
    """Whether the run with steps ``dt`` is stable until ``horizon``, and the steps it took; ``released``: `releasable`.

    Unstable (MEASURED-coupling 1): kinetic energy above 1.1 times the elastic energy that can be released, or the
    interface longer than 1.01 times at first, looked at a hundred times, or a run that ends as diverged.
    """
    from fsiwork.simulate import build  # the solver, only when it is asked for

    steps = math.ceil(horizon / dt - 1e-9)
    sim = build(scene.model_copy(update={"clock": scene.clock.model_copy(update={"step": dt, "end": dt * steps})}))
    most, longest = 1.1 * released, 1.01 * float(sim.gauges()["length"])
    for n in range(1, steps + 1):
        if sim.advance():
            return False, n
        if n % max(1, steps // 100) == 0 or n == steps:
            now = sim.gauges()
            kinetic, length = float(now["kinetic_energy"]), float(now["length"])
            if not (kinetic <= most and length <= longest):  # false for NaN
                return False, n
    return True, steps


def largest_step(scene, point: dict[str, Any]) -> dict[str, Any]:
    """Largest stable Δt of the real step of a scene with one membrane or drop, to 1 %, by bisection.

    ``point`` may hold ``horizon`` (time that has to be survived, default 1), ``largest`` (where the search ends) and
    ``least_steps``: an explicit run has to survive that many steps too, for an instability grows with every step, and a
    few long ones would end before it shows.
    Beside ``limit`` and ``found`` (see `Largest`) it returns (1.54) with λ, with the tension s E'(s) in its place, and
    with that tension for the diffusion that the flow really takes: Crank–Nicolson in one fluid, else backward Euler.
    Raises ValueError for a scene without exactly one body in the plane.
    """
    if scene.box.dim != 2 or len(scene.bodies) != 1:
        raise ValueError("the largest step is searched for one membrane or drop in the plane")
    body, h = scene.bodies[0], scene.box.h
    tension = body.stretch * _energy(body.energy, body.stretch)[1]
    numbers = scene.fluid.viscosity, body.width.of(h), h, scene.fluid.density
    mixed = body.inside is not None or body.surface_mass > 0
    theta = 0.5 if scene.fluid.diffusion == "implicit" and not mixed else 1.0
    by_stiffness = float(step_limit(getattr(body.energy, "stiffness", math.nan), *numbers))
    by_tension = float(step_limit(tension, *numbers)) if tension > 0 else math.nan
    by_scheme = float(step_limit(tension, *numbers, theta=theta)) if tension > 0 else math.nan
    total, released = 0, releasable(scene)
    least_steps = float(point.get("least_steps", 0)) if body.coupling == "explicit" else 0.0

    def stable(dt: float) -> bool:
        nonlocal total
        good, steps = stays_bounded(scene, dt, max(float(point.get("horizon", 1.0)), least_steps * dt), released)
        total += steps
        return good

    result = limit(stable, float(np.nanmin([by_stiffness, by_scheme])), float(point.get("largest", 0.24)))
    return {
        "limit": result.step,
        "found": result.found,
        "trials": result.trials,
        "predicted_lambda": by_stiffness,
        "predicted_tension": by_tension,
        "predicted_scheme": by_scheme,
        "n_steps": total,
        "n_cells": scene.box.cells,
    }


def measure_1_54(datasets: dict[str, xr.Dataset]) -> dict[str, float]:
    """How sharp (1.54) is in the linear model, what the other schemes do, and where the real step ends."""
    radius = datasets["stability_schemes"]["radius"]
    drop = datasets["stability_drop"]
    excess = datasets["stability_stepping"]["excess"]
    ratio, own = ((drop["limit"] / drop[f"predicted_{by}"]).where(drop["found"] == 1) for by in ("lambda", "scheme"))
    unstable_everywhere = drop["found"] == -1

    def largest(scheme):
        return float(radius.sel(scheme=scheme).max())

    def explicit(near):
        return radius.sel(scheme="explicit").sel(ratio=near, method="nearest")

    return {
        "spectral_deviation": float(abs(datasets["stability_spectral"]["deviation"]).max(skipna=False)),
        "stepping_excess_max": float(excess.max(skipna=False)),
        "stepping_excess_min": float(excess.min(skipna=False)),
        "explicit_below": float(explicit(0.99).max()),
        "explicit_above": float(explicit(1.01).min()),
        "implicit_radius": largest("implicit"),
        "semi_implicit_radius": largest("semi-implicit"),
        "printed_radius": largest("predictor-printed"),
        "corrected_radius": largest("predictor-corrected"),
        "drop_ratio_min": 0.0 if bool(unstable_everywhere.any()) else float(ratio.min()),
        "drop_ratio_max": float(ratio.max()),
        "drop_scheme_ratio_min": 0.0 if bool(unstable_everywhere.any()) else float(own.min()),
        "drop_scheme_ratio_max": float(own.max()),
        "drop_no_limit": float((drop["found"] == 0).sum()),
    }
