"""What accuracy costs: errors of a grid of runs against the finest one, over the CPU seconds that each took."""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from fsiwork.studies.sweep import curve

BOOK = {"coupling": "semi-implicit", "cells": 128, "step": 0.008}  # Fig. 3.12
RADIUS = math.sqrt(0.375)  # of the circle that the membrane becomes


class Run(NamedTuple):
    """One point of the study: its dials, error [percent of the final radius] and cost [CPU seconds]."""

    point: dict
    error: float
    cpu: float


def axes_error(data: xr.Dataset, finest: xr.Dataset, **point) -> float:
    """Largest difference of either half-axis from the finest run, in percent of the final radius; NaN if diverged.

    Each run is looked at on its own times; the finest run, whose steps are far smaller, is interpolated by a spline.
    """
    if not np.all(data["ended"].sel(point) == "complete"):
        return math.nan
    worst = 0.0
    for axis in ("axis_x", "axis_y"):
        times, values = curve(data, axis, **point)
        reference = CubicSpline(*curve(finest, axis))(times)
        worst = max(worst, float(np.abs(values - reference).max()))  # NaN stays: max(0, NaN) would not
        if not np.isfinite(values).all():
            return math.nan
    return 100 * worst / RADIUS


def runs(data: xr.Dataset, finest: xr.Dataset) -> list[Run]:
    """Every point of the study that ended, but none that is the finest run itself (same cells and no larger step)."""
    found = []
    reference = (int(finest["n_cells"]), float(finest["n_steps"]))
    for coupling in data["coupling"].values:
        for cells in data["cells"].values:
            for step in data["step"].values:
                point = {"coupling": str(coupling), "cells": int(cells), "step": float(step)}
                one = data.sel(point)
                error = axes_error(data, finest, **point)
                itself = int(cells) >= reference[0] and float(one["n_steps"]) >= reference[1]
                if math.isfinite(error) and not itself:
                    found.append(Run(point, error, float(one["cpu_seconds"])))
    return found


def front(points: list[Run]) -> list[Run]:
    """The points that none dominates (no other is both cheaper and more accurate), cheapest first."""
    best, kept = math.inf, []
    for run in sorted(points, key=lambda run: (run.cpu, run.error)):
        if run.error < best:
            kept.append(run)
            best = run.error
    return kept


def next_digit(points: list[Run]) -> float:
    """Factor in CPU seconds for a tenth of the error: the slope of log cost over log error along a front."""
    if len(points) < 2:
        return math.nan
    slope = np.polyfit(np.log10([run.error for run in points]), np.log10([run.cpu for run in points]), 1)[0]
    return float(10 ** -float(slope))


def measure(datasets: dict[str, xr.Dataset]) -> dict[str, float]:
    """How long the front is, how far it reaches, what a digit costs along its accurate decade, where the book stands.

    ``front_points`` counts the points of the front within one decade above the least error; ``front_decades`` is the
    whole reach of the front in powers of ten of the error.
    """
    found = runs(datasets["tradeoff_grid"], datasets["tradeoff_finest"])
    best = front(found)
    nothing = {"front_points": 0.0, "front_decades": 0.0, "cost_of_next_digit": math.nan}
    if not best:
        return nothing
    decade = [run for run in best if run.error <= 10 * best[-1].error * (1 + 1e-12)]
    book = next((run for run in found if run.point == BOOK), Run(BOOK, math.nan, math.nan))
    as_good = [run.cpu for run in best if run.error <= book.error]
    return {
        "front_points": float(len(decade)),
        "front_decades": math.log10(best[0].error / best[-1].error),
        "cost_of_next_digit": next_digit(decade),
        "least_error": best[-1].error,
        "book_error": book.error,
        "book_cpu": book.cpu,
        "book_over_front": book.cpu / min(as_good) if as_good else math.nan,
    }
