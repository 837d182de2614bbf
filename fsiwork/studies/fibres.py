"""A tethered elastic fibre in a shear flow (3.4): its root on the bottom, its free end by a label χ(Y)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import RectBivariateSpline

from fsiwork.core.grid import GHOSTS
from fsiwork.scene import Scene
from fsiwork.simulate import Simulation, build

PLACES = 101  # labels along the fibre, root and end included
CASES = ("soft", "stiff")


def sway(scene: Scene | None, point: dict[str, Any]) -> dict[str, Any]:
    """The fibre of a scene to the end of its clock, looked at ``rows`` times: positions of its labels, its length by
    them and by the integral over the tube, elastic energy, largest velocity."""
    sim, rows = build(scene), int(point["rows"])
    looks, ended = [_look(sim)], ""
    for step in range(sim.total):
        ended = ended or sim.advance()
        if (step + 1) % (sim.total // rows) == 0:
            looks.append({k: np.full_like(q, np.nan) for k, q in looks[0].items()} if ended else _look(sim))
    scalars = ("length", "smeared", "elastic_energy", "speed")
    out = {name: (("row",), np.array([float(look[name]) for look in looks])) for name in scalars}
    out |= {name: (("place",), np.concatenate([look[name] for look in looks])) for name in ("x", "y")}
    out["t"] = (("row",), np.arange(len(looks)) * (sim.total // rows) * sim.dt)
    return out | {"ended": ended or "complete", "n_steps": sim.steps, "n_cells": max(sim.flow.grid.n)}


def _look(sim: Simulation) -> dict[str, np.ndarray]:
    gauges = sim.bodies[0].gauges(sim.flow)
    x, y = trace(sim)
    return {
        "x": x,
        "y": y,
        "length": np.hypot(np.diff(x), np.diff(y)).sum(),
        "smeared": np.float64(gauges["length"]),
        "elastic_energy": np.float64(gauges["elastic_energy"]),
        "speed": np.float64(max(sim.flow.largest(u) for u in sim.flow.u)),
    }


def trace(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Where the labels of the fibre are now [length]: the inverse of Y in the plane z = root, by Newton from the label
    before, root first; both of shape (`PLACES`,), NaN from where it fails. For a fibre along y in a box symmetric in z.
    """
    grid, shape, Y = sim.flow.grid, sim.scene.bodies[0].shape, sim.bodies[0].map.Y
    k = GHOSTS + round((shape.root[2] - grid.origin[2]) / grid.h)
    nodes = [grid.coordinate(a, ghosts=GHOSTS) for a in (0, 1)]
    maps = [RectBivariateSpline(*nodes, grid.padded(Y[a])[:, :, k - 1 : k + 1].mean(axis=2)) for a in (0, 1)]
    found = np.full((2, PLACES), np.nan)
    place = np.array(shape.root[:2])
    for i, label in enumerate(shape.root[1] + np.linspace(0.0, shape.length, PLACES)):
        for _ in range(20):
            miss = np.array([float(m.ev(*place)) for m in maps]) - (shape.root[0], label)
            slopes = np.array([[float(m.ev(*place, dx=1)), float(m.ev(*place, dy=1))] for m in maps])
            if not np.isfinite(slopes).all() or np.linalg.det(slopes) == 0.0:
                return found[0], found[1]
            place = place - np.linalg.solve(slopes, miss)
            if np.abs(miss).max() < 1e-10:
                break
        else:
            return found[0], found[1]
        found[:, i] = place
    return found[0], found[1]


def measure(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """By case: largest change of the length by labels and of the integral over the tube, percent of the first; place of
    the end at last, and the angle to the flow of the straight line from the root's place to it [degrees]; how far
    label 0 slid along the wall, which holds it by u = 0 alone; largest velocity."""
    data, out = datasets["curve_fibre"], {}
    for case in CASES:
        one = data.sel(case=case)
        for name in ("length", "smeared"):
            q = one[name].values
            out[f"{name}_{case}"] = float(100 * np.abs(q / q[0] - 1).max())
        x, y = paths(data, case)
        out[f"end_x_{case}"], out[f"end_y_{case}"] = float(x[-1, -1] - x[0, 0]), float(y[-1, -1])
        out[f"root_{case}"] = float(np.abs(x[:, 0] - x[0, 0]).max())
        out[f"angle_{case}"] = float(np.degrees(np.arctan2(y[-1, -1], x[-1, -1] - x[0, 0])))
        out[f"speed_{case}"] = float(one["speed"].max(skipna=False))
    return out


def paths(data: xr.Dataset, case: str) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the labels by row, shape (rows, `PLACES`)."""
    x, y = (data[name].sel(case=case).values.reshape(-1, PLACES) for name in ("x", "y"))
    return x, y


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each stiffness."""
    names = ("length", "smeared", "end_x", "end_y", "angle", "root")
    header = [
        "fibre",
        "length by labels, %",
        "by the integral, %",
        "end x − root",
        "end y",
        "angle, degrees",
        "root slid",
    ]
    return header, [[case, *(float(f"{measured[f'{name}_{case}']:.4g}") for name in names)] for case in CASES]
