"""Fig. 7.7: ten transport schemes on a line, as they are printed (Euler; centred: RK3) and with RK3.

200 nodes 0.05 apart, CFL 0.2, 500 steps: a profile is carried over half of [0, 10]. The distance to [1.5, 3.5] clipped
at +1 has three kinks, the Gaussian none. L1 is the mean over the nodes.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.core import schemes1d

NODES, STEP, COURANT, TIME = 200, 0.05, 0.2, 5.0
PRINTED = ("upwind", "lax-wendroff", "centred", "beam-warming", "fromm", "eno2", "eno3", "weno5")
"""The eight schemes of the book's figure; WENO-Z and linear upwind 5 are ours."""

L1, LINF, OVERSHOOT = "l1", "linf", "overshoot"
REFERENCE = {
    ("distance", "printed", L1): dict(
        zip(PRINTED, (4e-2, 9.8e-3, 1.3e-2, 1e-2, 2.9e-3, 3.1e-3, 7.8e-4, 5.8e-4), strict=True)
    ),
    ("distance", "printed", LINF): dict(zip(PRINTED[:5], (0.36, 0.093, 0.092, 0.107, 0.067), strict=True)),
    ("distance", "printed", OVERSHOOT): dict(zip(PRINTED[1:5], (0.042, 0.052, 0.042, 0.016), strict=True)),
    ("distance", "rk3", L1): {"eno2": 8.7e-3, "eno3": 3.9e-3, "weno5": 2.1e-3, "weno-z": 1.7e-3, "upwind5": 1.1e-3},
    ("distance", "rk3", OVERSHOOT): {"upwind5": 0.007},
    ("gaussian", "printed", L1): dict(
        zip(PRINTED, (3.5e-2, 3e-3, 3.2e-3, 4.5e-3, 7.9e-4, 4.6e-3, 1.26e-2, 1.1e-2), strict=True)
    ),
    ("gaussian", "printed", OVERSHOOT): {"weno5": 0.09},
    ("gaussian", "rk3", L1): {"eno2": 5.5e-3, "eno3": 3.9e-4, "weno5": 1.4e-5, "weno-z": 3.7e-6, "upwind5": 3.8e-6},
}
"""Errors by (profile, stepping, error) and scheme as the trials of section 7.4 measured them, in two figures."""
MONOTONE = {"printed": ("upwind", "eno2", "eno3", "weno5"), "rk3": ("upwind", "eno2", "eno3", "weno5", "weno-z")}
"""Schemes that leave the distance between its bounds."""


def profile(name: str, x: np.ndarray, shift: float = 0.0) -> np.ndarray:
    """The ``distance`` to [1.5, 3.5] clipped at +1, or a ``gaussian`` about 2.5 of width 0.5, moved by ``shift``.

    Raises ValueError for another name.
    """
    y = x - shift
    if name == "distance":
        return np.minimum(np.abs(y - 2.5) - 1.0, 1.0)
    if name == "gaussian":
        return np.exp(-((y - 2.5) ** 2) / (2 * 0.5**2))
    raise ValueError(f"profile must be distance or gaussian, got {name!r}")


def carried(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """A ``profile`` carried by a ``scheme`` to t = 5, ``stepping`` printed or rk3: the result and its errors.

    ``printed`` is Euler, and RK3 for the centred scheme as in the book.
    """
    scheme, name = point["scheme"], point["profile"]
    stepping = "rk3" if point["stepping"] == "rk3" or scheme == "centred" else "euler"
    x = STEP * np.arange(NODES)
    before, exact = profile(name, x), profile(name, x, TIME)
    steps = round(TIME / (COURANT * STEP))
    q = schemes1d.advance(before, COURANT, steps, scheme, stepping, inflow=1.0 if name == "distance" else 0.0)
    return {
        "q": (("x",), q),
        "exact": (("x",), exact),
        "position": (("x",), x),
        L1: float(np.abs(q - exact).mean()),
        LINF: float(np.abs(q - exact).max()),
        OVERSHOOT: float(max(q.max() - before.max(), before.min() - q.min(), 0.0)),
        "n_steps": steps,
        "n_cells": NODES,
    }


def deviations(data: xr.Dataset) -> dict[tuple[str, str, str, str], float]:
    """Relative deviation of every error from `REFERENCE`, by (profile, stepping, error, scheme)."""
    found = {}
    for (name, stepping, error), numbers in REFERENCE.items():
        at = data[error].sel(profile=name, stepping=stepping)
        for scheme, expected in numbers.items():
            found[name, stepping, error, scheme] = abs(float(at.sel(scheme=scheme)) / expected - 1)
    return found


def fig_7_7(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Deviations from the measured table, what stays between its bounds, and what Euler does to WENO5.

    ``euler_growth``: of the worst Fourier mode over the 500 steps where WENO5 has its ideal weights.
    """
    data = datasets["schemes"]
    found = deviations(data)

    def largest(error: str) -> float:
        values = [value for key, value in found.items() if key[2] == error]
        return float(np.max(values))  # NaN stays NaN

    bounded = [
        float(data[OVERSHOOT].sel(profile="distance", stepping=stepping, scheme=list(schemes)).max(skipna=False))
        for stepping, schemes in MONOTONE.items()
    ]
    kinked = data[L1].sel(profile="distance", stepping="printed", scheme=list(PRINTED))
    smooth = data[L1].sel(profile="gaussian", scheme="weno5")
    steps = round(TIME / (COURANT * STEP))
    return {
        "deviation_l1": largest(L1),
        "deviation_linf": largest(LINF),
        "deviation_overshoot": largest(OVERSHOOT),
        "monotone_overshoot": float(np.max(bounded)),
        "weno5_over_next": float(kinked.sel(scheme="weno5") / kinked.drop_sel(scheme="weno5").min()),
        "euler_over_rk3": float(smooth.sel(stepping="printed") / smooth.sel(stepping="rk3")),
        "euler_growth": schemes1d.growth("upwind5", COURANT) ** steps,
        "rk3_growth": schemes1d.growth("upwind5", COURANT, "rk3") ** steps,
    }


def rows_7_7(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """The errors of Fig. 7.7: a row for each scheme, the printed stepping beside RK3; – is not in the book's figure."""
    data = datasets["schemes"]
    header = ["scheme"]
    header += [
        f"{name}, {stepping}, {error}"
        for name in ("distance", "gaussian")
        for stepping in ("printed", "RK3")
        for error in ("L1", "L∞", "overshoot")
    ]
    rows = []
    for scheme in (str(s) for s in data["scheme"].values):
        row: list[object] = [scheme]
        for name in ("distance", "gaussian"):
            for stepping in ("printed", "rk3"):
                at = data.sel(scheme=scheme, profile=name, stepping=stepping)
                known = stepping == "rk3" or scheme in PRINTED
                row += [_short(float(at[error])) if known else "–" for error in (L1, LINF, OVERSHOOT)]
        rows.append(row)
    return header, rows


def _short(value: float) -> float:
    """Three figures; round-off is 0."""
    return 0.0 if value < 1e-12 else float(f"{value:.3g}")
