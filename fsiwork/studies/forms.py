"""Discrete forms of a membrane's force beside each other: what each makes of the energy law (3.23), the length of the
interface and its first swing, as D_ε becomes narrow."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork import scene
from fsiwork.studies.histories import complete, history, spec, swing
from fsiwork.studies.stability import releasable

MARKERS = {"drop": (0.976, 0.51952), "membrane": (0.624, 0.51686)}  # time, half-axis; N = 256 (MEASURED-coupling 2)
WRINKLED = 1.01  # an interface this many times as long as at first is unstable (MEASURED-coupling 1)
NAMES = ("rise", "residual", "longest", "time", "axis")


def told(data: xr.Dataset, **point: Any) -> dict[str, float]:
    """Of one run: most energy over the first (``rise``), largest sum of the residuals of (3.23) in parts of the energy
    that can be released, ``longest`` interface over the first, time and value of the half-axis' first minimum."""
    if not complete(data, **point):
        return dict.fromkeys(NAMES, math.nan)
    kinetic, elastic, residual, length = (
        history(data, name, **point)[1]
        for name in ("kinetic_energy", "elastic_energy", "energy_residual", "geometric_length")
    )
    released = releasable(scene.Scene.model_validate(spec(data, **point)))
    _, time, axis = swing(data, **point)
    return {
        "rise": float((kinetic + elastic).max() / elastic[0]),
        "residual": float(np.abs(np.cumsum(residual)).max() / released),
        "longest": float(length.max() / length[0]),
        "time": time,
        "axis": axis,
    }


def every(data: xr.Dataset) -> dict[tuple[str, str, float], dict[str, float]]:
    """`told` of all runs, by law, form and width of D_ε in cells."""
    return {
        (str(law), str(form), float(width)): told(data, law=law, form=form, width=width)
        for law in data["law"].values
        for form in data["form"].values
        for width in data["width"].values
    }


def measure(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Numbers of `told` by law, form and width; ``gain_…``: by width, residual of a membrane by the form that ``auto``
    takes over that of the adjoint one."""
    found, out = every(datasets["forms_membrane"]), {}
    for (law, form, width), values in found.items():
        out |= {f"{name}_{law}_{form}_{width:g}": value for name, value in values.items()}
    for width in datasets["forms_membrane"]["width"].values:
        usual, adjoint = (found["membrane", form, float(width)]["residual"] for form in ("divergence", "adjoint"))
        out[f"gain_{width:g}"] = usual / adjoint
    return out


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each run."""
    header = ["law", "form", "ε/Δx", "most energy over the first", "residual of (3.23), of what can be released"]
    header += ["longest over the first", "first minimum, time", "half-axis"]
    table = []
    for (law, form, width), values in every(datasets["forms_membrane"]).items():
        table.append([law, form, width, *(float(f"{values[name]:.4g}") for name in NAMES)])
    return header, table
