"""Measures of two bubbles that merge, Fig. 1.4."""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from fsiwork.studies.histories import complete, history, spec


def fig_1_4(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """When the bubbles merge on each grid, and how well their volume is kept.

    Surface tension is ``free`` (none) or ``pulled``; the case is ``kept`` (films of a given thickness break and φ is
    shifted), ``alone`` (φ as it is carried) or ``semi_lagrangian`` (as ``kept``, with the book's transport).
    ``merge_TENSION_CASE_N`` is the time from which there is one piece, ``merge_change_TENSION_CASE`` what it differs
    between N = 128 and 256 in percent of the larger. ``volume_CASE`` is the largest deviation of the volume of φ < 0
    from that of the two discs, ``content_CASE`` that of the mean buoyancy inside from its first value, percent.
    ``pieces_first`` is the least, ``pieces_last`` the largest number of pieces at the first and the last moment
    (``kept``).
    """
    runs, out = datasets["bubbles"], {}
    first, last = [], []
    for case in map(str, runs["case"].values):
        volumes, contents = [], []
        for word, tension in zip(("free", "pulled"), sorted(runs["tension"].values), strict=True):
            for n in (int(n) for n in sorted(runs["cells"].values)):
                point = {"tension": tension, "case": case, "cells": n}
                out[f"merge_{word}_{case}_{n}"] = merging(runs, **point)
                volumes.append(volume_deviation(runs, **point))
                pieces, content = (history(runs, gauge, **point)[1] for gauge in ("pieces", "content"))
                contents.append(100 * np.abs(content / content[0] - 1).max())
                if case == "kept":
                    first.append(pieces[0])
                    last.append(pieces[-1])
            times = [out[f"merge_{word}_{case}_{n}"] for n in (128, 256)]
            out[f"merge_change_{word}_{case}"] = 100 * abs(times[1] - times[0]) / max(times)
        out |= {f"volume_{case}": float(np.max(volumes)), f"content_{case}": float(np.max(contents))}
    return out | {"pieces_first": float(np.min(first)), "pieces_last": float(np.max(last))}


def volume_deviation(runs: xr.Dataset, **point) -> float:
    """Largest deviation of the volume over a run from that of the discs of its scene, percent; NaN if it broke off."""
    discs = math.pi * sum(part["shape"]["radius"] ** 2 for part in spec(runs, **point)["bodies"][0]["parts"])
    volume = history(runs, "volume", **point)[1]
    return 100 * float(np.abs(volume / discs - 1).max()) if complete(runs, **point) else math.nan


def merging(runs: xr.Dataset, **point) -> float:
    """Time from which there is one piece until the end; NaN if there were not two before, or more at the end."""
    t, pieces = history(runs, "pieces", **point)
    apart = np.flatnonzero(pieces != 1.0)
    if not (apart.size and pieces[0] == 2.0 and apart[-1] + 1 < t.size):
        return math.nan
    return float(t[apart[-1] + 1])
