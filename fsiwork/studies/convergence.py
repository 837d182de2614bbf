"""The flow solver by itself: decaying vortices with an exact solution, and the lid-driven cavity.

Functions `(scene, point) -> dict` are called by studies, point by point; the measures read the studies' datasets.
"""

import math
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from fsiwork.studies import exact, orders

LOOK_EVERY = 50  # steps between two looks at whether a flow is steady


def _simulation(scene, dt: float | None = None, end: float | None = None):
    """A scene ready to advance, with another step and end if they are given."""
    from fsiwork.simulate import build  # the solver, only when it is asked for

    changed = {name: value for name, value in (("step", dt), ("end", end)) if value is not None}
    return build(scene.model_copy(update={"clock": scene.clock.model_copy(update=changed)}))


def _advance(sim, steps: int) -> bool:
    """Whether the simulation survived so many steps."""
    return not any(sim.advance() for _ in range(steps))


def _divergence(flow) -> float:
    """Largest |div u| at the centres [1/time]."""
    g = flow.grid
    return float(np.abs(sum(np.diff(g.inside(q, face=a), axis=a) for a, q in enumerate(flow.u))).max()) / g.h


def taylor_green(scene, _point: dict[str, Any]) -> dict[str, Any]:
    """Largest errors of u, v (``error_u``) and of p, mean zero, (``error_p``) against the exact solution at the end.

    ``divergence`` is the largest |div u|. Raises ValueError unless the scene starts from Taylor–Green vortices.
    """
    start = scene.fluid.initial
    if start.kind != "taylor-green":
        raise ValueError("the exact solution is that of Taylor–Green vortices")
    sim = _simulation(scene)
    alive = _advance(sim, sim.total)
    flow, g = sim.flow, sim.flow.grid
    nu = scene.fluid.viscosity / scene.fluid.density
    k = 2 * math.pi * start.waves / scene.box.length[0]

    def known(part: int, face: int | None) -> np.ndarray:
        lines = g.points(face)
        return g.sample(lambda *_: exact.taylor_green(*lines, sim.t, nu, start.amplitude, k)[part], face)

    errors = [float(np.abs(g.inside(flow.u[a] - known(a, a))).max()) for a in g.axes]
    pressure = scene.fluid.density * g.inside(known(2, None))
    error_p = float(np.abs(flow.pressure() - (pressure - pressure.mean())).max())
    out = {"error_u": max(errors), "error_p": error_p, "divergence": _divergence(flow)}
    out = out if alive else dict.fromkeys(out, math.nan)
    return out | {"n_steps": sim.steps, "n_cells": scene.box.cells}


def taylor_green_step(scene, point: dict[str, Any]) -> dict[str, Any]:
    """Largest differences of velocity and pressure from a run with the step ``point["finest"]`` on the same grid.

    All runs go on from one state, which a run with that finest step has reached at the time ``point["evolved"]``
    (default .2): what is measured is the order of the scheme, not how it starts from a pressure that is not known.
    """
    finest, evolved = float(point["finest"]), float(point.get("evolved", 0.2))
    begun = _simulation(scene, finest, evolved)
    alive = _advance(begun, begun.total)
    state, ends, taken = begun.flow.state(), [], begun.steps
    for dt in (scene.clock.step, finest):
        sim = _simulation(scene, dt, scene.clock.end)
        sim.flow.restore(state)
        sim.flow.edges.fill_velocity(sim.flow.u)
        alive = _advance(sim, sim.total) and alive
        taken += sim.steps
        ends.append([sim.flow.grid.inside(q).copy() for q in sim.flow.u] + [sim.flow.pressure().copy()])
    *velocity, pressure = (float(np.abs(a - b).max()) if alive else math.nan for a, b in zip(*ends, strict=True))
    return {"error_u": max(velocity), "error_p": pressure, "n_steps": taken, "n_cells": scene.box.cells}


def _least_order(data: xr.Dataset, name: str, axis: str) -> float:
    """Least order between neighbours along an axis of steps or of cells along a side; NaN when an error is missing."""
    data = data.sortby(axis)
    h = data[axis].values.astype(float)
    error = data[name].values
    if not (np.isfinite(error).all() and (error > 0).all() and error.size > 1):
        return math.nan
    return float(orders.observed_orders(1 / h if axis == "cells" else h, error).min())


def measure_taylor_green(datasets: dict[str, xr.Dataset]) -> dict[str, float]:
    """Least order of u and p in space and in time between successive grids or steps, and the largest divergence."""
    space, time = datasets["taylor_green_space"], datasets["taylor_green_time"]
    return {
        "order_space_u": _least_order(space, "error_u", "cells"),
        "order_space_p": _least_order(space, "error_p", "cells"),
        "order_time_u": _least_order(time, "error_u", "step"),
        "order_time_p": _least_order(time, "error_p", "step"),
        "divergence": float(space["divergence"].max(skipna=False)),
    }


# ------------------------------------------------------------------------------------------------------------- cavity
def centreline(flow) -> tuple[np.ndarray, np.ndarray]:
    """y and the velocity along x on the vertical mid-line of a box between walls, the walls' own values at both ends.

    Shapes (n + 2,). The number of cells along x must be even, so that faces lie on the line; raises ValueError if odd.
    """
    g = flow.grid
    if g.n[0] % 2:
        raise ValueError("the mid-line needs an even number of cells")
    low, high = flow.edges.sides[1]
    inner = g.inside(flow.u[0], face=0)[g.n[0] // 2]
    ends = [side.velocity[0] if side.velocity else 0.0 for side in (low, high)]
    y = g.coordinate(1)
    bottom = g.origin[1]
    return np.array([bottom, *y, bottom + g.length[1]]), np.array([ends[0], *inner, ends[1]])


def cavity(scene, point: dict[str, Any]) -> dict[str, Any]:
    """The cavity until max|Δu|/Δt < ``point["steady"]`` or t = ``point["longest"]``, against Ghia, Ghia and Shin.

    ``u`` and ``ghia`` at ``y_position`` (dim ``y_ghia``), the whole mid-line by spline at 101 points (``profile`` over
    ``y_profile``, dim ``y_fine``), ``change`` at the end and ``t_end``.
    """
    steady, longest = float(point.get("steady", 1e-6)), float(point.get("longest", 200.0))
    sim = _simulation(scene, None, longest)
    g, change = sim.flow.grid, math.inf
    while sim.steps < sim.total and not change < steady:
        if not _advance(sim, min(LOOK_EVERY, sim.total - sim.steps) - 1):
            break
        before = [q.copy() for q in sim.flow.u]
        if not _advance(sim, 1):
            break
        difference = max(np.abs(g.inside(q - p)).max() for q, p in zip(sim.flow.u, before, strict=True))
        change = float(difference) / sim.dt
    lid, length = sim.flow.edges.sides[1][1].velocity[0], scene.box.length[1]
    reynolds = round(scene.fluid.density * lid * length / scene.fluid.viscosity)
    y, u = centreline(sim.flow)
    spline = CubicSpline((y - y[0]) / length, u / lid)
    where, known = exact.cavity(reynolds)
    fine = np.linspace(0, 1, 101)
    return {
        "u": (("y_ghia",), spline(where)),
        "ghia": (("y_ghia",), known),
        "y_position": (("y_ghia",), where),
        "profile": (("y_fine",), spline(fine)),
        "y_profile": (("y_fine",), fine),
        "change": change if math.isfinite(change) else math.nan,
        "t_end": sim.t,
        "reynolds": reynolds,
        "n_steps": sim.steps,
        "n_cells": scene.box.cells,
    }


def measure_cavity(datasets: dict[str, xr.Dataset]) -> dict[str, float]:
    """Largest deviation of u from the table, case by case, and the largest change at the end of the runs."""
    data = datasets["cavity"]
    deviation = abs(data["u"] - data["ghia"]).max("y_ghia", skipna=False)
    found = {f"deviation_{case}": float(deviation.sel(case=case)) for case in data["case"].values}
    return found | {"change": float(data["change"].max(skipna=False))}
