"""The energy law (3.23) for any scene with an elastic body: what of its residual belongs to Δt, and what to Δx.

The residual is looked at in tenths of a run, so that gains and losses do not cancel; the first tenth is left out, in
which a lid may have started at once. Runs with Δt and Δt/2 differ by the part of the time step; twice the second less
the first is the part of the grid.
"""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.scene import Scene
from fsiwork.simulate import frames
from fsiwork.studies import orders

WINDOWS = 10
PREFIX = "energy_of_"
HALVINGS = (1, 2, 4)  # Δt over these; finer grids leave the first out


def balance(scene: Scene, point: dict[str, Any]) -> dict[str, Any]:
    """Residuals of a scene on the grids ``cells``, from Δt = ``step`` on; a width must be given in length.

    Returns in parts of the energy that was dissipated and set in motion: ``of_step``, what two ``steps`` (the larger
    is given) differ by on the coarsest grid, and ``of_grid``, what is left at Δt = 0 on each of the grids with
    ``sides`` cells along a side. NaN where a run diverged.
    """
    cells, step, done = [int(n) for n in point["cells"]], float(point["step"]), 0
    found: dict[int, list[np.ndarray]] = {}
    for n in cells:
        found[n] = []
        for halving in HALVINGS if n == cells[0] else HALVINGS[1:]:
            residual, turned, steps = _tenths(scene, n, step / halving)
            found[n].append(residual)
            done += steps
    first = found[cells[0]]
    return {
        "steps": (("halving",), [step / halving for halving in HALVINGS[:-1]]),
        "of_step": (("halving",), [_sum(a - b) / turned for a, b in pairwise(first)]),
        "sides": (("level",), [float(n) for n in cells]),
        "of_grid": (("level",), [_sum(2 * found[n][-1] - found[n][-2]) / turned for n in cells]),
        "turned": turned,
        "n_steps": done,
        "n_cells": cells[-1],
    }


def _sum(tenths: np.ndarray) -> float:
    return float(np.abs(tenths[1:]).sum())


def _tenths(scene: Scene, cells: int, step: float) -> tuple[np.ndarray, float, int]:
    """Residual in each tenth of a run, what was dissipated and set in motion, and the number of steps."""
    box = scene.box.model_copy(update={"cells": cells})
    clock = scene.clock.model_copy(update={"step": step, "frames": 1})
    output = scene.output.model_copy(update={"gauges_every": 1})
    parts = list(frames(scene.model_copy(update={"box": box, "clock": clock, "output": output})))
    if parts[-1].ended != "complete":
        return np.full(WINDOWS, math.nan), math.nan, parts[-1].step
    names = ("t", "energy_residual", "dissipation", "kinetic_energy")
    t, residual, dissipation, kinetic = (np.concatenate([part.gauges[name] for part in parts]) for name in names)
    ends = np.interp(np.linspace(0.0, t[-1], WINDOWS + 1), t, np.cumsum(residual))
    return np.diff(ends), float(np.trapezoid(dissipation, t) + np.ptp(kinetic)), parts[-1].step


def scenes(datasets: Mapping[str, xr.Dataset]) -> dict[str, xr.Dataset]:
    """The studies of `balance` by the name of their scene."""
    return {name.removeprefix(PREFIX): data for name, data in datasets.items() if name.startswith(PREFIX)}


def measure(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Orders of both parts for each scene, the least of them, and the largest part of a finest grid."""
    out, steps, grids, rests = {}, [], [], []
    for name, data in scenes(datasets).items():
        steps.append(_order(data["steps"].values, data["of_step"].values))
        grids.append(_order(1.0 / data["sides"].values, data["of_grid"].values))
        rests.append(float(data["of_grid"][-1]))
        out |= {f"order_step_{name}": steps[-1], f"order_grid_{name}": grids[-1]}
    least = {"scenes_order_step": float(np.min(steps)), "scenes_order_grid": float(np.min(grids))}
    return out | least | {"scenes_rest": float(np.max(rests)), "scenes": float(len(rests))}


def _order(h: np.ndarray, parts: np.ndarray) -> float:
    """Least of the successive orders; NaN where one cannot be said."""
    if not (np.isfinite(parts).all() and (parts > 0).all()):
        return math.nan
    return float(orders.observed_orders(h, parts).min())
