"""Studies read back: one labelled dataset, its axes as dimensions, and curves of it."""

import json
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from fsiwork import provenance
from fsiwork.dataset import open_study
from fsiwork.targets import Faults


def resolve(function: str, layer: str):
    """The function ``module.name`` of fsiwork/LAYER, or ``package.module:name`` anywhere. Raises `Faults`."""
    place, _, name = function.rpartition(":") if ":" in function else function.rpartition(".")
    module = place if ":" in function else f"fsiwork.{layer}.{place}"
    try:
        return getattr(import_module(module), name)
    except ModuleNotFoundError as error:
        raise Faults(f"{function}: no module {error.name}") from error
    except AttributeError:
        raise Faults(f"{function}: {module} has no function {name}") from None


def load(path: str | Path) -> xr.Dataset:
    """A study's dataset, ready for measures and figures.

    The study's axes are dimensions with coordinates. Gauges have the further dimension ``row``, and the time of a row
    is the coordinate ``t_step`` over the axes and ``row``; rows that a run does not have are NaN. ``cpu_seconds``,
    ``n_steps`` and ``n_cells`` (cells along the longest side) stand beside, from the cost file. Fields stay on the
    disk until they are used. Raises `Faults` when the file is missing.
    """
    path = Path(path)
    if not path.is_file():
        raise Faults(f"{path}: no such file; `snakemake {path}` makes it")
    data = open_study(path)
    for values in data.variables.values():
        if "x_c" not in values.dims and "x_n" not in values.dims:
            values.load()
    cost = json.loads(provenance.cost_path(path).read_text(encoding="utf-8"))
    axes = list(dict.fromkeys(axis for row in cost["points"] for axis in row["point"]))
    for name, dim in json.loads(data.attrs.pop("dims", "{}")).items():
        data[name] = data[name].rename({f"{name}_i": dim})
    return _with_cost(_with_rows(data, axes), cost["points"], axes)


def _with_rows(data: xr.Dataset, axes: list[str]) -> xr.Dataset:
    if "t_step" not in data.dims:
        return data
    if "t_step_of_run" in data:
        times = data["t_step_of_run"].rename(t_step="row")
        data = data.drop_vars([name for name in ("t_step_of_run", "t_step") if name in data.variables])
    else:
        values = np.broadcast_to(data["t_step"].values, [*(data.sizes[a] for a in axes), data.sizes["t_step"]])
        times = xr.DataArray(values.copy(), dims=(*axes, "row"))
        data = data.drop_vars("t_step")
    return data.rename_dims(t_step="row").assign_coords(t_step=times.drop_vars("row", errors="ignore"))


def _with_cost(data: xr.Dataset, points: list[dict[str, Any]], axes: list[str]) -> xr.Dataset:
    names = {"cpu_seconds": "cpu_seconds", "steps": "n_steps", "cells": "n_cells"}
    for key, name in names.items():
        table = xr.DataArray(np.full([data.sizes[a] for a in axes], np.nan), {a: data[a] for a in axes}, axes)
        for point in points:
            table.loc[point["point"]] = point[key]
        data[name] = table
    return data


def curve(data: xr.Dataset, gauge: str, **point: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a gauge at a point of a study, without the padding: two arrays of shape (rows,)."""
    one = data.sel(point)
    times, values = one["t_step"].values, one[gauge].values
    there = np.isfinite(times)
    return times[there], values[there]
