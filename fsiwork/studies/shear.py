"""The sphere of Sec. 3.6.2, sheared by (3.67), and the same with a pressure inside: radii, norms (3.68), pressure on
the axes, markers that go along, energy created, det ∇Y; on several grids with ε fixed in length."""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from scipy.ndimage import map_coordinates
from scipy.optimize import brentq

from fsiwork import simulate
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels.shear_survey import LEAST_DET

ROWS = 180  # how often gauges are kept over the run, and 0
HISTORY = ("axis_x", "axis_z", "det_min", "elastic_energy", "kinetic_energy", "rms_box", "rms_surface", "shear_mean",
           "volume", "Z1_max", "Z2_max")  # fmt: skip
PRESSURE = (0.1, 1.2)  # Figs 3.20, 3.21
STATIONS = np.linspace(0.0, 1.0, 201)
SHOTS = (0.0, 0.5, 1.0, 1.5, 3.0, 9.0)  # markers' grid
PARALLELS, MERIDIANS, AROUND = 9, 12, 49


def globe() -> np.ndarray:
    """Unit vectors of lines of constant latitude, then longitude, `AROUND` points each, shape (lines, points, 3)."""
    turn, rise = np.linspace(0, 2 * np.pi, AROUND), np.linspace(0, np.pi, AROUND)
    heights = np.pi * np.arange(1, PARALLELS + 1) / (PARALLELS + 1)
    flat = [np.stack([np.sin(p) * np.cos(turn), np.sin(p) * np.sin(turn), np.cos(p) + 0 * turn], -1) for p in heights]
    angles = 2 * np.pi * np.arange(MERIDIANS) / MERIDIANS
    up = [np.stack([np.sin(rise) * np.cos(a), np.sin(rise) * np.sin(a), np.cos(rise)], -1) for a in angles]
    return np.array(flat + up)


def twisted(points: np.ndarray, twist: float) -> np.ndarray:
    """Where (3.67) has what is at ``points`` when relaxed."""
    x, y, z = np.moveaxis(points, -1, 0)
    c, s = np.cos(twist * z), np.sin(twist * z)
    return np.stack([x * c - y * s, x * s + y * c, z], -1)


def at(grid: Grid, q: np.ndarray, points: np.ndarray, face: int | None = None, order: int = 1) -> np.ndarray:
    """A flat field at ``points`` (m, 3) by splines of an ``order``; linear ones by default."""
    where = [(points[:, a] - grid.origin[a]) / grid.h + GHOSTS - (0.0 if a == face else 0.5) for a in grid.axes]
    return map_coordinates(grid.padded(q), where, order=order, mode="nearest")


def _velocity(sim, points: np.ndarray) -> np.ndarray:
    return np.stack([at(sim.flow.grid, q, points, face=a) for a, q in enumerate(sim.flow.u)], -1)


def _carry(sim, points: np.ndarray) -> np.ndarray:
    """Markers after the last step: midpoint rule with the new velocity."""
    return points + sim.dt * _velocity(sim, points + 0.5 * sim.dt * _velocity(sim, points))


def _profiles(sim, k: int) -> dict[str, np.ndarray]:
    """Pressure and φ at `STATIONS` along x and z from the middle of the box, named with the number ``k``."""
    grid, p, out = sim.flow.grid, sim.flow.grid.field(), {}
    grid.inside(p)[...] = sim.pressure()
    sim.flow.edges.fill_scalar(p, "mirror")
    for name, axis in (("x", 0), ("z", 2)):
        points = np.zeros((STATIONS.size, 3))
        points[:, axis] = STATIONS
        out |= {f"p_{name}_{k}": at(grid, p, points), f"phi_{name}_{k}": at(grid, sim.bodies[0].phi, points)}
    return out


def _roundness(sim, radius: float) -> float:
    """Largest |r - radius|/radius of the surface over 500 directions, by the last zero of φ on each ray."""
    grid, body = sim.flow.grid, sim.bodies[0]
    k = np.arange(500) + 0.5
    z, turn = 1 - k / 250, np.pi * (1 + 5**0.5) * k
    rays = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], -1)
    r = np.linspace(0.5 * radius, 1.5 * radius, 201)
    phi = at(grid, body.phi, (rays[:, None] * r[:, None]).reshape(-1, 3), order=3).reshape(500, -1)
    inside = phi < 0
    last = inside.shape[1] - 1 - inside[:, ::-1].argmax(axis=1)
    if not inside.any(axis=1).all() or (last == inside.shape[1] - 1).any():
        return math.nan
    rows = np.arange(500)
    low, high = phi[rows, last], phi[rows, last + 1]
    found = r[last] + (r[1] - r[0]) * low / (low - high)
    return float(np.abs(found / radius - 1).max())


def relax(scene, point: dict[str, Any]) -> dict[str, Any]:
    """Run a scene with one sphere: gauges at `ROWS` times, the most energy created so far, pressure on the axes,
    markers; the largest deviation from the sphere at the end. What a diverged run did not reach is NaN."""
    sim, spec = simulate.build(scene), scene.bodies[0]
    table = {name: np.full(ROWS + 1, math.nan) for name in ("t", *HISTORY, "created")}
    out: dict[str, Any] = {}
    points = twisted(globe().reshape(-1, 3) * spec.shape.radius, spec.twist)
    total, made, least, row, ended = math.nan, 0.0, math.inf, 0, ""
    while True:
        while row <= ROWS and sim.steps >= round(row * sim.total / ROWS):
            found = sim.gauges()
            total = found["kinetic_energy"] + found["elastic_energy"] if row == 0 else total
            made, least = made + found["energy_residual"], min(least, found["det_min"])
            for name, values in table.items():
                values[row] = {**found, "created": made / total, "det_min": least}[name]
            row += 1
        for k, t in enumerate(SHOTS):
            if abs(sim.t - t) < 0.5 * sim.dt:
                out[f"markers_{k}"] = points.ravel()
                out[f"speed_{k}"] = np.linalg.norm(_velocity(sim, points), axis=1)
        for k, t in enumerate(PRESSURE):
            if abs(sim.t - t) < 0.5 * sim.dt:
                out |= _profiles(sim, k)
        if sim.steps == sim.total or (ended := sim.advance()):
            break
        points = _carry(sim, points)
        least = min(least, float(sim.bodies[0].survey()[LEAST_DET]))
    out |= {name: (("row",), values) for name, values in table.items()}
    away = math.nan if ended else _roundness(sim, spec.shape.radius)
    return out | {"away": away, "eps": spec.width.of(scene.box.h), "ended": ended or "complete", "n_steps": sim.steps}


# ---------------------------------------------------------------------------------------------------- measures
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


def smeared(p: np.ndarray, phi: np.ndarray, eps: float) -> tuple[float, float]:
    """Profiles across the membrane: the 10-90 % width of p over that of H_ε(φ), and by how much of the jump p leaves
    the range between both sides, |φ| ≤ 2ε; the sides are means over 1.5 ε ≤ |φ| ≤ 2 ε."""
    far = (np.abs(phi) >= 1.5 * eps) & (np.abs(phi) <= 2 * eps)
    if not (far & (phi < 0)).any() or not (far & (phi > 0)).any():
        return math.nan, math.nan
    inner, outer = p[far & (phi < 0)].mean(), p[far & (phi > 0)].mean()
    share, near = (p - outer) / (inner - outer), np.abs(phi) <= 2 * eps
    r = STATIONS - np.interp(0.0, phi, STATIONS)
    q = np.clip(phi / eps, -1, 1)
    wanted = rise(r, 0.5 * (1 - q - np.sin(np.pi * q) / np.pi))
    return rise(r[near], share[near]) / wanted, float(max(share[near].max() - 1, -share[near].min(), 0.0))


GRIDS = ("n32", "n48", "n64")


def fig_3_18(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Most energy created and least det ∇Y over the runs; width and overshoot of the pressure's rise on the finest
    grid; orders of the radius along z early (t ≤ .2) and late (t ≥ 3); norms and radii at the end."""
    data, out = datasets["sheared_sphere"], {}
    for case in data["case"].values:
        one = data.sel(case=case)
        out[f"created_{case}"], out[f"det_{case}"] = float(one["created"].max()), float(one["det_min"][-1])
        for name in ("axis_x", "axis_z", "rms_box", "rms_surface", "volume"):
            out[f"{name}_{case}"] = float(one[name][-1])
    out["created"] = max(out[f"created_{case}"] for case in GRIDS)
    out["det"] = min(out[f"det_{case}"] for case in GRIDS)
    fine = data.sel(case=GRIDS[-1])
    eps = float(fine["eps"])
    for axis in "xz":
        for k in range(len(PRESSURE)):
            profiles = fine[f"p_{axis}_{k}"].values, fine[f"phi_{axis}_{k}"].values
            out[f"width_{axis}_{k}"], out[f"overshoot_{axis}_{k}"] = smeared(*profiles, eps)
    for name in ("width", "overshoot"):
        out[name] = float(np.max([out[f"{name}_{axis}_{k}"] for axis in "xz" for k in range(2)]))  # NaN stays
    t, steps = fine["t"].values, [2.0 / int(case[1:]) for case in GRIDS]
    for name, there in (("early", t <= 0.2), ("late", t >= 3)):
        out[f"order_{name}"] = order(steps, [data["axis_z"].sel(case=case).values[there] for case in GRIDS])
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
