"""Measures of the oscillating drop, Figs 3.9 and 3.10."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from fsiwork.studies.histories import complete, history, swing, unstable_from


def fig_3_9(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Whether the explicit and the semi-implicit scheme are stable at the book's step, and the bisected limit.

    ``COUPLING_unstable`` is 1 or 0 over the whole run, ``explicit_from`` when the explicit one first was; the limit
    counts when one was found, else NaN. Over ``limit_over_1_54`` stands (1.54) with λ.
    """
    runs, limit = datasets["drop_schemes"], datasets["drop_limit"]
    start = {name: unstable_from(runs, coupling=name) for name in ("explicit", "semi-implicit")}
    found = float(limit["found"]) == 1.0
    explicit = float(limit["limit"]) if found else np.nan
    return {
        "explicit_unstable": float(np.isfinite(start["explicit"])),
        "semi_implicit_unstable": float(np.isfinite(start["semi-implicit"])),
        "explicit_from": start["explicit"],
        "explicit_limit": explicit,
        "predicted_1_54": float(limit["predicted_lambda"]),
        "limit_over_1_54": explicit / float(limit["predicted_lambda"]),
        "explicit_volume": volume_deviation(runs, coupling="explicit"),
        "semi_implicit_volume": volume_deviation(runs, coupling="semi-implicit"),
    }


def volume_deviation(data: xr.Dataset, **point) -> float:
    """Largest deviation of the geometric volume from its first value, in percent; NaN if the run ended badly."""
    volume = history(data, "geometric_volume", **point)[1]
    return 100 * float(np.abs(volume / volume[0] - 1).max()) if complete(data, **point) else np.nan


def fig_3_10(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Deviation of the volume for each number of cells, and what the last refinement still changes.

    ``volume_deviation_N`` is with the book's coupling, ``volume_stabilised_N`` with the stabilised one.
    ``amplitude_difference``: first minimum of the horizontal half-axis on the two finest grids, in percent of the
    amplitude on the finest; ``time_difference``: of its time, in percent; ``axis_difference``: largest distance of the
    half-axes at the same time, in percent of √0.375 (0.6123724).
    """
    runs = datasets["drop_refinement"]
    cells = sorted(int(n) for n in runs["cells"].values)
    out = {f"volume_deviation_{n}": volume_deviation(runs, cells=n) for n in cells}
    own = datasets["drop_stabilised"]
    out |= {f"volume_stabilised_{int(n)}": volume_deviation(own, cells=int(n)) for n in own["cells"].values}
    coarse, fine = (swing(runs, cells=n) for n in cells[-2:])
    out["amplitude_difference"] = 100 * abs(coarse[2] - fine[2]) / (fine[0] - fine[2])
    out["time_difference"] = 100 * abs(coarse[1] - fine[1]) / fine[1]
    apart = [_apart(runs, axis, cells[-2], cells[-1]) for axis in ("axis_x", "axis_y")]
    out["axis_difference"] = 100 * max(apart) / np.sqrt(0.375)
    return out


def _apart(runs: xr.Dataset, gauge: str, coarse: int, fine: int) -> float:
    """Largest distance of a gauge on two grids, at the times of the finer one; NaN unless both runs ended well."""
    if not (complete(runs, cells=coarse) and complete(runs, cells=fine)):
        return np.nan
    t, q = history(runs, gauge, cells=fine)
    return float(np.abs(np.interp(t, *history(runs, gauge, cells=coarse)) - q).max())
