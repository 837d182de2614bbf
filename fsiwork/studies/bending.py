"""The stabilised scheme for bending, which the book leaves open (its Sec. 7.5): stability and error over the step."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.scene import Scene
from fsiwork.simulate import build, frames

ROWS = 50  # times at which the half-axis is kept
RAISED = 1.1  # a run whose energy rises above this many times the first is unstable


def coupled(scene: Scene, point: dict[str, Any]) -> dict[str, Any]:
    """Half-axis along x over time for Δt = ``multiple`` times the explicit limit ½Δx²√(ρε/k); explicit below 1."""
    multiple = float(point["multiple"].removeprefix("x"))
    sim = build(_with(scene, 1.0, "explicit"))
    limit = sim.bodies[0].longest_step(sim.flow)["bending"]
    made = _with(scene, multiple * limit, "explicit" if multiple < 1 else "stabilised")
    gauges: dict[str, list[np.ndarray]] = {}
    for frame in frames(made):
        for name, values in frame.gauges.items():
            gauges.setdefault(name, []).append(values)
    t, axis, kinetic, elastic = (
        np.concatenate(gauges[name]) for name in ("t", "axis_x", "kinetic_energy", "elastic_energy")
    )
    times = np.linspace(0, scene.clock.end, ROWS)
    energy = (kinetic + elastic).max() / elastic[0]
    stable = frame.ended == "complete" and energy <= RAISED
    kept = np.interp(times, t, axis) if frame.ended == "complete" else np.full(ROWS, math.nan)
    return {
        "t": (("time",), times),
        "axis": (("time",), kept),
        "energy": float(energy),
        "stable": bool(stable),
        "step": multiple * limit,
        "n_steps": frame.step,
        "n_cells": scene.box.cells,
    }


def _with(scene: Scene, step: float, coupling: str) -> Scene:
    body = scene.bodies[0].model_copy(update={"coupling": coupling})
    clock = scene.clock.model_copy(update={"step": min(step, scene.clock.end)})
    return scene.model_copy(update={"bodies": (body,), "clock": clock})


def numbered(data: xr.Dataset) -> xr.Dataset:
    """The study with numbers for the labels of ``multiple``, sorted."""
    numbers = [float(str(name).removeprefix("x")) for name in data["multiple"].values]
    return data.assign_coords(multiple=numbers).sortby("multiple")


def errors(data: xr.Dataset) -> xr.DataArray:
    """Largest deviation of the half-axis from the explicit run's, percent of its travel."""
    explicit = data["axis"].sel(multiple=data["multiple"].min())
    travel = abs(explicit.isel(time=-1) - explicit.isel(time=0))
    return 100 * abs(data["axis"] - explicit).max("time", skipna=False) / travel


def measure(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Largest multiple up to which every run is stable, and the errors, by kind of box; the worst of the grids."""
    data = numbered(datasets["coupling_bending"])
    found, out = errors(data), {}
    for edges in ("periodic", "walls"):
        stable = data["stable"].sel(edges=edges).min("cells")
        good = np.cumprod(stable.values.astype(bool)).astype(bool)
        out[f"stable_{edges}"] = float(data["multiple"].values[good].max()) if good.any() else 0.0
        for multiple in data["multiple"].values[1:]:
            worst = found.sel(edges=edges, multiple=multiple).max("cells", skipna=False)
            out[f"error_{edges}_{multiple:g}"] = float(worst)
    return out


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each box, grid and step."""
    data = numbered(datasets["coupling_bending"])
    found = errors(data)
    header = [
        "edges",
        "N",
        "Δt over the explicit limit",
        "Δt",
        "stable",
        "error, % of travel",
        "energy over the first",
    ]
    table = []
    for edges in data["edges"].values:
        for n in data["cells"].values:
            for multiple in data["multiple"].values:
                at = {"edges": edges, "cells": n, "multiple": multiple}
                one = data.sel(at)
                step, energy = float(f"{float(one['step']):.3g}"), round(float(one["energy"]), 4)
                error = round(float(found.sel(at)), 3)
                table.append([str(edges), int(n), float(multiple), step, bool(one["stable"]), error, energy])
    return header, table
