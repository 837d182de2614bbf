"""Numbers of the sheared sphere, Figs 3.18 to 3.24, and of the same with a pressure inside."""

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from fsiwork.studies.shear import PRESSURE, STATIONS

EARLY, LATE = 0.2, 3.0  # before the folding, and after it
CLEAR = 0.25  # a jump counts when it is at least this share of the largest one
PAIRS = [(axis, k) for axis in "xz" for k in range(len(PRESSURE))]


def grids(data: xr.Dataset) -> list[str]:
    """Cases on refined grids at the same ε, named n and the cells, coarse to fine."""
    return sorted(
        (str(case) for case in data["case"].values if str(case)[1:].isdigit()), key=lambda case: int(case[1:])
    )


def order(steps: list[float], curves: list[np.ndarray]) -> float:
    """Order p for which the root mean squares of two successive differences fall as those of h^p; NaN without one."""
    first, second = (float(np.sqrt(np.mean((a - b) ** 2))) for a, b in ((curves[0], curves[1]), (curves[1], curves[2])))

    def excess(p: float) -> float:
        return (steps[0] ** p - steps[1] ** p) / (steps[1] ** p - steps[2] ** p) - first / second

    return brentq(excess, 0.01, 12.0) if excess(0.01) * excess(12.0) < 0 else math.nan


def rise(r: np.ndarray, share: np.ndarray) -> float:
    """From the last r < 0 where a profile falling from 1 to 0 is above .9 to the first r > 0 where it is below .1."""
    high, low = np.flatnonzero((share >= 0.9) & (r < 0)), np.flatnonzero((share <= 0.1) & (r > 0))
    if not high.size or not low.size:
        return math.nan
    ends = [
        r[k] + (share[k] - c) / (share[k] - share[k + 1]) * (r[k + 1] - r[k])
        for c, k in ((0.9, high[-1]), (0.1, low[0] - 1))
    ]
    return float(abs(ends[1] - ends[0]))


def smeared(p: np.ndarray, phi: np.ndarray, eps: float) -> tuple[float, float, float]:
    """Jump of a profile across the membrane, the 10-90 % width of its rise over that of H_ε(φ), and by how much of the
    jump it leaves the range between both sides; over |φ| ≤ 2ε around the last zero of φ.

    The flow's pressure has slopes of its own on both sides, and the tangential force makes a kink, a jump of ∂_n p. So
    p is taken less a + b r + c∫H_ε dr, which has both slopes: a, b, c and the jump are fitted at ε ≤ |φ| ≤ 2ε, outside
    of the band, where the membrane's smearing is not felt.
    """
    zeros = np.flatnonzero((phi[:-1] < 0) & (phi[1:] >= 0))
    if not zeros.size:
        return math.nan, math.nan, math.nan
    k = zeros[-1]
    r = STATIONS - (STATIONS[k] - phi[k] * (STATIONS[k + 1] - STATIONS[k]) / (phi[k + 1] - phi[k]))
    q = np.clip(phi / eps, -1, 1)
    H = 0.5 * (1 + q + np.sin(np.pi * q) / np.pi)
    near = _piece(np.abs(phi) <= 2 * eps, k)
    far = near & (np.abs(phi) >= eps)
    if not (far & (r < 0)).any() or not (far & (r > 0)).any():
        return math.nan, math.nan, math.nan
    kink = np.concatenate([[0.0], np.cumsum(0.5 * (H[1:] + H[:-1]) * np.diff(r))])
    parts = np.stack([np.ones_like(r), r, kink, 1 - H], axis=1)
    found = np.linalg.lstsq(parts[far], p[far], rcond=None)[0]
    share = ((p - parts[:, :3] @ found[:3]) / found[3])[near]
    width = rise(r[near], share) / rise(r[near], (1 - H)[near])
    return float(found[3]), width, float(max(share.max() - 1, -share.min(), 0.0))


def _piece(inside: np.ndarray, k: int) -> np.ndarray:
    """The run of true values around station ``k``."""
    gaps = np.flatnonzero(~inside)
    low, high = gaps[gaps < k], gaps[gaps > k]
    piece = np.zeros_like(inside)
    piece[(low[-1] + 1 if low.size else 0) : (high[0] if high.size else inside.size)] = True
    return piece


def fig_3_18(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Most energy created and least det ∇Y over the grids, and for every run; norms and radii at the end."""
    data, out = datasets["sheared_sphere"], {}
    for case in data["case"].values:
        one = data.sel(case=case)
        out[f"created_{case}"], out[f"det_{case}"] = float(one["created"].max()), float(one["det_min"][-1])
        for name in ("axis_x", "axis_z", "rms_box", "rms_surface", "volume"):
            out[f"{name}_{case}"] = float(one[name][-1])
    out["created"] = max(out[f"created_{case}"] for case in grids(data))
    out["det"] = min(out[f"det_{case}"] for case in grids(data))
    return out


def fig_3_19(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Largest speed at the markers at t = 0.5 on each grid; by how much the two finest differ, relative."""
    data = datasets["sheared_sphere"]
    out = {f"top_{case}": float(data["speed"].sel(case=case).max()) for case in data["case"].values}
    *_, rough, fine = grids(data)
    return out | {"gap": abs(out[f"top_{fine}"] / out[f"top_{rough}"] - 1)}


def pressure(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Jump, width and overshoot of the pressure on the finest grid, on both axes and at both times; the greatest width
    and overshoot where there is a jump to speak of, and how many such there are."""
    data = datasets["sheared_sphere"]
    fine, out, jumps = data.sel(case=grids(data)[-1]), {}, {}
    for axis, k in PAIRS:
        profiles = fine[f"p_{axis}_{k}"].values, fine[f"phi_{axis}_{k}"].values
        jumps[axis, k], out[f"width_{axis}_{k}"], out[f"overshoot_{axis}_{k}"] = smeared(*profiles, float(fine["eps"]))
        out[f"jump_{axis}_{k}"] = jumps[axis, k]
    top = max(abs(jump) for jump in jumps.values())
    clear = [one for one, jump in jumps.items() if not abs(jump) < CLEAR * top]  # NaN counts, and fails
    for name in ("width", "overshoot"):
        out[name] = float(np.max([out[f"{name}_{axis}_{k}"] for axis, k in clear]))
        for axis in "xz":
            out[f"{name}_{axis}"] = float(np.max([out[f"{name}_{a}_{k}"] for a, k in clear if a == axis]))
    return out | {"clear": len(clear)}


def fig_3_22(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Orders of the radius along z, ε fixed in length: early (t ≤ 0.2) and late (t ≥ 3); differences of the two finest
    grids there, root mean square [length]."""
    data, out = datasets["sheared_sphere"], {}
    names = grids(data)
    t = data["t"].sel(case=names[-1]).values
    for name, there in (("early", t <= EARLY + 1e-9), ("late", t >= LATE - 1e-9)):
        curves = [data["axis_z"].sel(case=case).values[there] for case in names]
        out[f"order_{name}"] = order([2.0 / int(case[1:]) for case in names], curves)
        out[f"gap_{name}"] = float(np.sqrt(np.mean((curves[-1] - curves[-2]) ** 2)))
    return out


def norms(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Both norms (3.68) at the end on every grid; the largest ratio of one grid's to that of the coarser before."""
    data, out = datasets["sheared_sphere"], {}
    for name in ("rms_box", "rms_surface"):
        last = [float(data[name].sel(case=case)[-1]) for case in grids(data)]
        out |= {f"{name}_{case}": value for case, value in zip(grids(data), last, strict=True)}
        out[f"{name}_ratio"] = float(np.max([fine / rough for rough, fine in pairwise(last)]))
    return out


def inflated(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Deviation from the sphere at the end; mean of Z₂ - 1 there over its start, and the largest ratio of its greatest
    values in two successive units of time; energy created and least det ∇Y."""
    data, out = datasets["inflated_sphere"], {}
    for case in data["case"].values:
        one = data.sel(case=case)
        t, mean = one["t"].values, one["shear_mean"].values
        tops = [mean[(t >= k) & (t <= k + 1)].max() for k in range(int(np.nan_to_num(t[-1], nan=1.0)))]
        out[f"away_{case}"], out[f"mean_{case}"] = float(one["away"]), float(mean[-1])
        out[f"share_{case}"] = float(mean[-1] / mean[0])
        out[f"rise_{case}"] = float(max((b / a for a, b in pairwise(tops)), default=math.nan))
        out[f"created_{case}"], out[f"det_{case}"] = float(one["created"].max()), float(one["det_min"][-1])
    return out


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each run: energy created, det ∇Y, norms (3.68) and radii at the end, cost."""
    data = datasets["sheared_sphere"]
    names = ("created", "det", "rms_box", "rms_surface", "axis_x", "axis_z", "volume")
    table = []
    for case in data["case"].values:
        one = data.sel(case=case)
        values = [float(f"{measured[f'{name}_{case}']:.4g}") for name in names]
        table.append([str(case), int(one["n_steps"]), *values, round(float(one["cpu_seconds"]), 1)])
    return ["run", "steps", *names, "CPU s"], table


def pressure_rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each axis and time, finest grid: jump, width of the rise over that of H_ε, overshoot over the jump."""
    names = ("jump", "width", "overshoot")
    table = [
        [axis, PRESSURE[k], *(float(f"{measured[f'{name}_{axis}_{k}']:.3g}") for name in names)] for axis, k in PAIRS
    ]
    return ["axis", "t", *names], table
