"""The ellipse of Sec. 3.5.3 by level sets (φ, and the map Y) and by markers with Peskin's coupling (3.1)-(3.8)
in the same fluid, with the same energy: when and where the long axis first turns, area, cost."""

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import xarray as xr

from fsiwork.studies.histories import history, swing

CARRIERS, LAWS = ("markers", "phi", "map"), ("drop", "membrane")


def limit(values: list[float]) -> float:
    """Value at Δx = 0 from the two finest of grids that double, both methods being of first order; NaN for one grid."""
    return 2 * values[-1] - values[-2] if len(values) > 1 else math.nan


def turns(data: xr.Dataset, carrier: str, law: str) -> dict[int, tuple[float, float]]:
    """Time and value of the first minimum of the half-axis along x, by cells."""
    cells = sorted(int(n) for n in data["cells"].values)
    return {n: swing(data, carrier=carrier, law=law, cells=n)[1:] for n in cells}


def _carriers(data: xr.Dataset) -> list[str]:
    """Those of `CARRIERS` that were run."""
    return [carrier for carrier in CARRIERS if carrier in data["carrier"].values]


def _gaps(values: Mapping[int, tuple[float, float]], others: Mapping[int, tuple[float, float]]) -> dict[int, float]:
    """How far the times are from those of the others on the same grid, percent."""
    return {n: 100 * abs(values[n][0] / others[n][0] - 1) for n in values}


def lagrangian_twin(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Per law and carrier: gap of the first minimum's time to the markers' on each grid (percent), the largest
    ratio of one grid's gap to that of the grid before, the gap of the limits; loss of area (percent); CPU seconds."""
    data, out = datasets["lagrangian_twin"], {}
    for law in LAWS:
        found = {carrier: turns(data, carrier, law) for carrier in _carriers(data)}
        ends = {carrier: limit([t for t, _ in values.values()]) for carrier, values in found.items()}
        for carrier in found:
            name, finest = f"{law}_{carrier}", max(found[carrier])
            out |= {f"{name}_time_{n}": t for n, (t, _) in found[carrier].items()}
            out[f"{name}_limit"] = ends[carrier]
            out[f"{name}_volume"] = loss(data, carrier=carrier, law=law, cells=finest)
            out[f"{name}_cpu"] = float(data["cpu_seconds"].sel(carrier=carrier, law=law, cells=finest))
            if carrier != "markers":
                gaps = _gaps(found[carrier], found["markers"])
                out |= {f"{name}_gap_{n}": gap for n, gap in gaps.items()}
                values = list(gaps.values())
                out[f"{name}_gap_ratio"] = max(b / a for a, b in pairwise(values))
                out[f"{name}_gap_limit"] = 100 * abs(ends[carrier] / ends["markers"] - 1)
    return out


def loss(data: xr.Dataset, **point) -> float:
    """Largest change of the area inside, percent of the first."""
    volume = history(data, "volume", **point)[1]
    return float(100 * np.abs(volume / volume[0] - 1).max())


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each law, carrier and grid: first minimum, gap to the markers, area, cost."""
    data = datasets["lagrangian_twin"]
    header = ["law", "carrier", "N", "time of the minimum", "half-axis there", "gap in time, %", "area, %", "CPU s"]
    table = []
    for law in LAWS:
        for carrier in _carriers(data):
            for n, (t, value) in turns(data, carrier, law).items():
                at = {"carrier": carrier, "law": law, "cells": n}
                gap = measured.get(f"{law}_{carrier}_gap_{n}", 0.0)
                cells = [round(t, 4), round(value, 5), round(gap, 2), round(loss(data, **at), 4)]
                table.append([law, carrier, n, *cells, round(float(data["cpu_seconds"].sel(at)), 1)])
    return header, table
