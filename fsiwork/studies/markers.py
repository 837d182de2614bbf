"""Fig. 1.1: markers (1.1) in the vortex of Fig. 1.5, their stretching and the line between them.

Every marker of the final line, inserted ones too, is compared with the trajectory that starts at its own parameter on
the circle, computed by scipy's DOP853 together with the tangent.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

from fsiwork.core.markers import Line, carry, circle
from fsiwork.core.motion import Vortex
from fsiwork.studies.exact import stretched_blob
from fsiwork.studies.orders import slope

CENTRE, RADIUS = (0.5, 0.75), 0.15
VORTEX = Vortex((0.0, 0.0), (1.0, 1.0))
TIMES = (0.0, 0.5, 1.0, 1.5, 2.0)
LENGTHS = (2.70816, 5.08636, 7.51032, 10.02914, 12.55006)
"""Of the blob at t = 1 to 5, by 200,000 and 400,000 markers (MEASURED-levelset 1b)."""
SHARPEST, SHOWN = 0.3, 480


def velocity(x: np.ndarray, t: float = 0.0) -> np.ndarray:
    """u of Fig. 1.5 at x, both shape (2, m)."""
    return np.stack(VORTEX.velocity(*x))


def gradient(x: np.ndarray, t: float = 0.0) -> np.ndarray:
    """∂_j u_i of it, shape (2, 2, m)."""
    (s, z), (one, two) = np.sin(2 * np.pi * x), np.sin(np.pi * x) ** 2
    c, d = np.cos(2 * np.pi * x)
    return np.pi * np.array([[-s * z, -2 * one * d], [2 * c * two, s * z]])


def trajectories(theta: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and tangents ∂γ/∂θ at ``time``, both (2, m), from parameters (m,) on the circle: DOP853 at 1e-12."""
    away = RADIUS * np.stack([np.cos(2 * np.pi * theta), np.sin(2 * np.pi * theta)])
    start = [np.reshape(CENTRE, (2, 1)) + away, 2 * np.pi * np.stack([-away[1], away[0]])]

    def rate(t, y):
        x, tangent = y.reshape(2, 2, -1)
        return np.stack([velocity(x), np.einsum("ijm,jm->im", gradient(x), tangent)]).ravel()

    x, tangent = (
        solve_ivp(rate, (0, time), np.ravel(start), "DOP853", rtol=1e-12, atol=1e-13).y[:, -1].reshape(2, 2, -1)
    )
    return x, tangent


def carried(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Markers to t = 2, at most ``longest`` apart, Δt = ``longest``/4; ``tangents`` carried or by differences.

    Largest errors against `trajectories` at t = 0.5, 1, 1.5, 2: position in radii of the circle, stretching
    |∂γ/∂θ|/|∂γ₀/∂θ| relative to its own value; and a selection of markers for the figure.
    """
    longest, slopes = float(point["longest"]), point["tangents"] == "carried"
    line = circle(CENTRE, RADIUS, max(32, int(np.ceil(2 * np.pi * RADIUS / longest))), slopes)
    lines, steps, position, stretching = [line], int(np.ceil(TIMES[1] / (0.25 * longest) - 1e-9)), [], []
    for time in TIMES[1:]:
        for _ in range(steps):
            line = carry(line, velocity, 0.0, TIMES[1] / steps, gradient if slopes else None).split(longest, SHARPEST)
        lines.append(line)
        x, tangent = trajectories(line.theta, time)
        position.append(np.hypot(*(line.x - x)).max() / RADIUS)
        stretching.append(np.abs(np.hypot(*line.tangent()) / np.hypot(*tangent) - 1).max())
    length, area = line.length_and_area()
    return {
        "position_error": float(max(position)),
        "stretching_error": float(max(stretching)),
        "length": length,
        "area_error": area / (np.pi * RADIUS**2) - 1,
        "markers": line.theta.size,
        "n_steps": steps * (len(TIMES) - 1),
        **_shown(lines, np.hypot(*tangent)),
    }


def _shown(lines: list[Line], tangent: np.ndarray) -> dict[str, Any]:
    """``SHOWN`` markers of every line, and the stretching of the last one, ours and the solver's."""
    pick = [np.linspace(0, each.theta.size, SHOWN, endpoint=False).astype(int) for each in lines]
    last, first = lines[-1], 2 * np.pi * RADIUS
    x = np.stack([each.x[:, k] for each, k in zip(lines, pick, strict=True)])
    return {
        "x": (("time_marker",), x[:, 0].ravel()),
        "y": (("time_marker",), x[:, 1].ravel()),
        "theta": (("marker",), last.theta[pick[-1]]),
        "stretch": (("marker",), np.hypot(*last.tangent())[pick[-1]] / first),
        "stretch_exact": (("marker",), tangent[pick[-1]] / first),
    }


def blob(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Length and relative error of the area of the blob at t = 1 to 5, markers at most ``longest`` apart."""
    lines = stretched_blob((1.0, 2.0, 3.0, 4.0, 5.0), float(point["longest"]))
    length, area = np.array([line.length_and_area() for line in lines]).T
    return {
        "length": (("end",), length),
        "area_error": (("end",), area / (np.pi * RADIUS**2) - 1),
        "markers": lines[-1].theta.size,
    }


def fig_1_1(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Errors of the finest markers by either tangents, orders in the distance of markers, lengths of the blob."""
    data, lines = datasets["markers"].sortby("longest"), datasets["markers_blob"].sortby("longest")
    out = {}
    for tangents in ("carried", "differences"):
        one = data.sel(tangents=tangents)
        for name in ("position", "stretching"):
            errors = one[f"{name}_error"]
            out[f"{name}_{tangents}"] = float(errors.isel(longest=0))
            out[f"{name}_{tangents}_order"] = slope(one["longest"], errors)
    out["area_error"] = float(abs(data["area_error"].isel(longest=0)).max(skipna=False))
    finest = lines.isel(longest=0)
    for k, printed in enumerate(LENGTHS):
        out[f"length_{k + 1}"] = float(finest["length"][k])
        out[f"length_{k + 1}_deviation"] = float(abs(finest["length"][k] - printed))
    out["blob_area_error"] = float(abs(finest["area_error"]).max(skipna=False))
    return out


def rows_1_1(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each distance of markers: the blob's length at t = 1 to 5, its area's error, the markers at t = 5."""
    header = ["longest segment", *(f"length, t = {k}" for k in range(1, 6)), "largest error of the area", "markers"]
    rows: list[list] = [["trial, 200 000 markers", *map(str, LENGTHS), "", 200_000]]
    for _, one in datasets["markers_blob"].sortby("longest", ascending=False).groupby("longest"):
        one = one.squeeze("longest")
        lengths = [f"{float(q):.7f}" for q in one["length"]]
        rows.append(
            [float(one["longest"]), *lengths, float(f"{float(abs(one['area_error']).max()):.2g}"), int(one["markers"])]
        )
    return header, rows
