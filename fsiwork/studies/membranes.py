"""Measures of the relaxing membrane: Table 3.1, Figs 3.11 and 3.12.

The book's D_ε is the plain one, ζ(φ/ε)/ε, and (1.54) with s E'(s) belongs to it; its ε is not given, 3 Δx fits
Table 3.1. So all use the plain D_ε and ε = 3 Δx. Only Fig. 3.11 is checked with ε = 6 Δx: at Δt = 0.01 the predictor
(3.62) smooths over Δt √(E'/ε): with 3 Δx that is 1.6 ε for N = 128, 4.4 ε for 256, and the membrane finds no rest.
"""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from fsiwork.studies.exact import membrane_equilibrium
from fsiwork.studies.histories import complete, first_minimum, history, late_mean, swing

NARROW, WIDE = 3, 6  # ε/Δx
BOOK_STEPS = {64: (3.5e-3, 1e-2), 128: (1.5e-3, 8e-3), 256: (6.5e-4, 4e-3), 512: (2e-4, 2e-3)}
"""Table 3.1 as printed: explicit and semi-implicit Δt [time] by N (ERRATA 3: the last explicit one should be 3e-4)."""
RADIUS = membrane_equilibrium(math.pi * 0.75 * 0.5, 0.5).radius


# ----------------------------------------------------------------------------------------------------- Table 3.1
def limits(data: xr.Dataset, coupling: str, dirac: str = "plain") -> xr.DataArray:
    """Largest stable steps over the cells; NaN where no step was stable, the end of the search where all were."""
    one = data.sel(coupling=coupling, dirac=dirac)
    return one["limit"].where(one["found"] >= 0).sortby("cells")


def table_3_1(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """The explicit limit against (1.54) with s E'(s), how it falls with Δx, and the smallest limits of the others.

    ``ratio_*`` and ``slope_*`` are for the plain D_ε and NaN unless a limit was found on every grid; the same with
    ``_renormalised`` for the other one.
    """
    data = datasets["membrane_limits"]
    out = {}
    for dirac, tail in (("plain", ""), ("renormalised", "_renormalised")):
        one = data.sel(coupling="explicit", dirac=dirac).sortby("cells")
        limit = one["limit"].where(one["found"] == 1).values
        ratio = limit / one["predicted_tension"].values
        slope = -np.diff(np.log(limit)) / np.diff(np.log(one["cells"].values))
        out |= {f"ratio_min{tail}": float(ratio.min()), f"ratio_max{tail}": float(ratio.max())}
        out |= {f"slope_min{tail}": float(slope.min()), f"slope_max{tail}": float(slope.max())}
        for coupling in ("semi-implicit", "stabilised"):
            out[f"{coupling.replace('-', '_')}_min{tail}"] = float(limits(data, coupling, dirac).min(skipna=False))
    out["gain_at_finest"] = float((limits(data, "semi-implicit") / limits(data, "explicit"))[-1])
    return out


def rows_3_1(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """Table 3.1: header, and a row for each N; "none up to …" where nothing was unstable."""
    data = datasets["membrane_limits"]
    header = ["N"]
    header += [f"{coupling}, {dirac} D" for dirac in ("plain", "renormalised") for coupling in COUPLINGS]
    header += ["(1.54) with λ", "(1.54) with sE'(s)", "explicit, plain D, over (1.54) with sE'(s)"]
    header += ["explicit, book", "semi-implicit, book"]
    rows = []
    for n in sorted(int(n) for n in data["cells"].values):
        at = data.sel(cells=n)
        cells = [_word(at, coupling, dirac) for dirac in ("plain", "renormalised") for coupling in COUPLINGS]
        one = at.sel(coupling="explicit", dirac="plain")
        by_stiffness, by_tension = float(one["predicted_lambda"]), float(one["predicted_tension"])
        limit = float(one["limit"]) if float(one["found"]) == 1 else math.nan
        book = BOOK_STEPS.get(n, ("–", "–"))
        rows.append([n, *cells, by_stiffness, by_tension, limit / by_tension, *book])
    return header, rows


COUPLINGS = ("explicit", "semi-implicit", "stabilised")


def _word(data: xr.Dataset, coupling: str, dirac: str) -> float | str:
    one = data.sel(coupling=coupling, dirac=dirac)
    limit, found = float(one["limit"]), float(one["found"])
    return {1.0: limit, 0.0: f"none up to {limit:g}"}.get(found, "none stable")


# ------------------------------------------------------------------------------------------- Figs 3.11 and 3.12
def axis_error(data: xr.Dataset, **point) -> float:
    """Larger deviation of the two half-axes, as means over the last 0.5 of time, from the exact circle, in percent.

    NaN for a run that did not end well or ended before t = 3.5.
    """
    found = [history(data, gauge, **point) for gauge in ("axis_x", "axis_y")]
    if not complete(data, **point) or found[0][0][-1] < 3.5:
        return math.nan
    return 100 * max(abs(late_mean(t, q) / RADIUS - 1) for t, q in found)


def _worst(errors: list[float]) -> float:
    return float(np.max(errors))  # NaN if one is


def fig_3_11(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Deviation of the final half-axes from the exact circle for each grid, in percent; ``axis_error``: of all.

    ε = 6 Δx; the same for another width with ``_width_W`` in the name.
    """
    runs = datasets["membrane_large_step"]
    out = {}
    for width in runs["width"].values:
        errors = {int(n): axis_error(runs, cells=n, width=width) for n in runs["cells"].values}
        tail = "" if width == WIDE else f"_width_{width:g}"
        out[f"axis_error{tail}"] = _worst(list(errors.values()))
        out |= {f"axis_error_{n}{tail}": error for n, error in errors.items()}
    return out


def fig_3_12(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Final half-axes of each scheme against the exact circle, and how far its first swing is from the explicit one's.

    ``axis_error_SCHEME``: in percent, over both grids and all widths; ``axis_error``: over all schemes.
    ``amplitude_difference_N`` (semi-implicit) and ``stabilised_difference_N``: first minimum of the horizontal
    half-axis against the explicit scheme's, in percent of its amplitude; ``…time_difference_N``: of its time.
    ``SCHEME_amplitude_error_N``: the larger difference of the first extremes of both half-axes, in percent of the same
    amplitude; ``stabilised_over_book_N``: one over the other. They are for ε = 3 Δx; for another width with
    ``_width_W`` in the name.
    """
    runs = datasets["membrane_schemes"]
    schemes, widths = ("explicit", "semi_implicit", "stabilised"), runs["width"].values
    out = {}
    for scheme in schemes:
        errors = [axis_error(runs, case=f"{scheme}_{n}", width=width) for n in (128, 256) for width in widths]
        out[f"axis_error_{scheme}"] = _worst(errors)
    out["axis_error"] = _worst([out[f"axis_error_{scheme}"] for scheme in schemes])
    for width in widths:
        tail = "" if width == NARROW else f"_width_{width:g}"
        out |= {f"{name}{tail}": value for name, value in _swings_apart(runs, width).items()}
    return out


def _swings_apart(runs: xr.Dataset, width: float) -> dict[str, float]:
    out = {}
    for n in (128, 256):
        start, time, low = swing(runs, case=f"explicit_{n}", width=width)
        for scheme, name in (("semi_implicit", ""), ("stabilised", "stabilised_")):
            _, other_time, other_low = swing(runs, case=f"{scheme}_{n}", width=width)
            out[f"{name or 'amplitude_'}difference_{n}"] = 100 * abs(other_low - low) / (start - low)
            out[f"{name}time_difference_{n}"] = 100 * abs(other_time - time) / time
            out[f"{scheme}_amplitude_error_{n}"] = 100 * _extremes_apart(runs, n, width, scheme) / (start - low)
        book, own = (out[f"{scheme}_amplitude_error_{n}"] for scheme in ("semi_implicit", "stabilised"))
        out[f"stabilised_over_book_{n}"] = own / book if book > 0.0 else math.nan
    return out


def _extremes_apart(runs: xr.Dataset, n: int, width: float, scheme: str) -> float:
    """Larger distance of the half-axes' first extremes (minimum along x, maximum along y) from the explicit scheme's.

    One alone will not do: the book's error of the minimum passes through zero between two grids.
    """
    apart = []
    for gauge, sign in (("axis_x", 1.0), ("axis_y", -1.0)):
        found = [history(runs, gauge, case=f"{name}_{n}", width=width) for name in (scheme, "explicit")]
        values = [first_minimum(t, sign * q)[1] for t, q in found]
        apart.append(abs(values[0] - values[1]))
    return _worst(apart)
