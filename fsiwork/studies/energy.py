"""The energy law (3.23): how much of the energy the time step, the grid and the width of the band lose or make.

The residual of a step is the change of kinetic and elastic energy less power and dissipation (trapezoidal rule); it is
a gauge of every run. Totals are its sums over a run, in parts of the excess energy that the body could release.
"""

import math
from functools import cache

import numpy as np
import xarray as xr

from fsiwork import scene as scenes
from fsiwork.studies import balance, orders
from fsiwork.studies.stability import releasable


def residuals(data: xr.Dataset) -> xr.DataArray:
    """Residual of each step in parts of the excess energy, over the axes and ``row``; NaN for runs that diverged."""
    texts = np.unique(data["scene"].values.astype(str))
    if len({_released_by(text) for text in texts}) != 1:
        raise ValueError("the runs of one study must start with the same energy")
    whole = data["energy_residual"].where(data["t_step"].notnull(), 0.0)  # rows that a run does not have
    return whole.where(data["ended"] == "complete") / _excess(str(texts[0]))


@cache
def _excess(text: str) -> float:
    return releasable(scenes.loads(text))


def _released_by(text: str) -> str:
    body = scenes.loads(text).bodies[0]
    return str((body.shape, body.energy, body.stretch))


def totals(data: xr.Dataset) -> xr.DataArray:
    """Sum of the residuals of each run, with its sign, in parts of the excess energy."""
    return residuals(data).sum("row", skipna=False)


def order_of_step(data: xr.DataArray) -> float:
    """Least order in Δt: between differences of totals at successive steps, whose common limit is the grid's part."""
    data = data.sortby("step", ascending=False)
    return _least(data["step"].values[:-1], np.abs(np.diff(data.values)))


def order_of_grid(total: xr.DataArray) -> float:
    """Least order in Δx of the totals themselves between successive grids."""
    total = total.sortby("cells")
    return _least(1 / total["cells"].values, np.abs(total.values))


def _least(h: np.ndarray, error: np.ndarray) -> float:
    """Least of the successive orders; NaN where one cannot be said."""
    if error.size < 2 or not (np.isfinite(error).all() and (error > 0).all()):
        return math.nan
    return float(orders.observed_orders(h, error).min())


def measure(datasets: dict[str, xr.Dataset]) -> dict[str, float]:
    """Orders of the residual in Δt and Δx, totals for membrane and drop, and the largest residual of one step.

    The order in Δx is that of the plain Dirac function, whose force is the derivative of its energy: all of its
    residual belongs to the grid. ``rest_renormalised`` is what the renormalised one keeps on the finest grid (ε fixed):
    its energy is not exactly the one whose derivative the force is; ``order_grid_renormalised`` is the order of its
    differences between grids. Beside them stand the numbers of `balance.measure` for every scene.
    """
    steps, grids = totals(datasets["energy_steps"]), totals(datasets["energy_grids"])
    bodies = {name: datasets[f"energy_bodies_{name}"] for name in ("membrane", "drop")}
    other = grids.sel(dirac="renormalised").sortby("cells")
    changes = np.abs(np.diff(other.values))
    found = {
        "order_step": order_of_step(steps),
        "order_grid": order_of_grid(grids.sel(dirac="plain")),
        "order_grid_renormalised": _least(1 / other["cells"].values[:-1], changes),
        "rest_renormalised": float(abs(other[-1])),
    }
    found |= {f"total_{name}": float(abs(totals(data))) for name, data in bodies.items()}
    largest = [float(abs(residuals(data)).max(skipna=False)) for data in bodies.values()]
    return found | {"step_largest": float(np.max(largest))} | balance.measure(datasets)
