"""Vesicles on their way to rest in space (Fig. 3.16), against the axisymmetric shape equation.

An eighth of a vesicle between planes of symmetry; what it measures is of the whole. Lengths are in units of √(A/4π), A
the area that a scene is made for, energies ½∫H² in units of the bending modulus.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from fsiwork.core.curvature import willmore
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.integrals import area_and_volume
from fsiwork.simulate import build
from fsiwork.studies.vesicles import equilibrium

ROWS = 20  # times at which a vesicle is measured, and 0
POINTS = 500  # of its surface at the end
FINE = 800  # points of an exact meridian
BALL = 8 * math.pi
VOLUMES, BRANCHES = (0.77, 0.6), ("prolate", "oblate")


def roots(v: np.ndarray) -> np.ndarray:
    """Where the cubics through values ``v`` (4, m) at -1, 0, 1, 2 vanish between 0 and 1, of which v[1], v[2] differ in
    sign: Newton's method from the straight line, kept in that interval."""
    a, b, c, d = v
    cubic, square = (d - a) / 6 + (b - c) / 2, (a + c) / 2 - b
    line, t = c - a / 3 - b / 2 - d / 6, b / (b - c)
    for _ in range(6):
        t = np.clip(t - (b + t * (line + t * (square + t * cubic))) / (line + t * (2 * square + 3 * t * cubic)), 0, 1)
    return t


def surface(grid: Grid, phi: np.ndarray) -> np.ndarray:
    """Points (m, 3) of φ = 0 on the lines of centres along all directions, by cubics; φ flat, ghosts filled."""
    found, q = [], grid.padded(phi)
    cells = [slice(GHOSTS, GHOSTS + n) for n in grid.n]
    for a in grid.axes:
        four = np.stack(
            [q[*cells[:a], slice(GHOSTS + k, GHOSTS + k + grid.n[a]), *cells[a + 1 :]] for k in range(-1, 3)]
        )
        here = np.nonzero((four[1] < 0) != (four[2] < 0))
        where = np.stack([grid.origin[b] + (k + 0.5) * grid.h for b, k in enumerate(here)], axis=1)
        where[:, a] += grid.h * roots(four[:, *here])
        found.append(where)
    return np.concatenate(found)


def shape(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """The exact one of a reduced ``volume`` on a ``branch``: energy, pressure inside less outside, half-widths, and the
    meridian r, z from pole to equator by `FINE` points."""
    exact = equilibrium(float(point["volume"]), point["branch"])
    u = np.concatenate([[0.0], (np.arange(exact.r.size) + 0.5) / exact.r.size, [1.0]])
    fine = np.linspace(0, 1, FINE)
    r = CubicSpline(u, [0.0, *exact.r, exact.equator])(fine)
    z = CubicSpline(u, [exact.pole, *exact.z, 0.0])(fine)
    out = {name: getattr(exact, name) for name in ("energy", "tension", "pressure", "equator", "pole", "residual")}
    return out | {"r": (("u",), r), "z": (("u",), z)}


def relax(scene, _point: dict[str, Any]) -> dict[str, Any]:
    """Run a scene of an eighth: area, volume and ½∫H² of φ = 0 at `ROWS` times; r and z of points of it at the end.

    What a diverged run did not reach is NaN.
    """
    sim = build(scene)
    grid, body, eps = sim.flow.grid, sim.bodies[0], scene.bodies[0].width.of(sim.flow.grid.h)
    copies = 2 ** sum(side.kind == "symmetry" for pair in scene.box.sides for side in pair)
    table, row, ended = {name: np.full(ROWS + 1, math.nan) for name in ("t", "area", "volume", "energy")}, 0, ""
    while True:
        while row <= ROWS and sim.steps >= round(row * sim.total / ROWS):
            area, volume = area_and_volume(grid, body.phi)
            found = {"area": copies * area, "volume": copies * volume, "energy": copies * willmore(grid, body.phi)[0]}
            for name, value in ({"t": sim.t} | found).items():
                table[name][row] = value
            row += 1
        if sim.steps == sim.total or (ended := sim.advance()):
            break
    points = surface(grid, body.phi)
    r, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    pick = np.argsort(np.arctan2(z, r))[np.linspace(0, r.size - 1, POINTS).astype(int)]
    out = {name: (("row",), values) for name, values in table.items()}
    out |= {"r": (("point",), r[pick]), "z": (("point",), z[pick])}
    return out | {
        "ended": ended or "complete", "eps": eps, "cells_a_unit": 1 / grid.h, "n_steps": sim.steps,
        "n_cells": max(grid.n),
    }  # fmt: skip


def reduced(area, volume):
    """Volume over that of the ball of the same area."""
    return 6 * math.sqrt(math.pi) * volume / area**1.5


def cases(data: xr.Dataset, volume: float, branch: str) -> list[xr.Dataset]:
    """The runs of a branch, by the names BRANCH_VOLUME_START."""
    names = [str(case) for case in data["case"].values]
    return [data.sel(case=case) for case in names if case.startswith(f"{branch}_{volume:g}_")]


def exact_at(exact: xr.Dataset, volume: float, measured: float) -> float:
    """½∫H² of the shape equation at a ``measured`` reduced volume near that of ``exact``; dE/dV = p at a given area."""
    return float(exact["energy"]) + 4 * math.pi / 3 * float(exact["pressure"]) * (measured - volume)


def apart(one: xr.Dataset, exact: xr.Dataset) -> float:
    """Largest distance of a run's points from the exact meridian, in percent of √(A/4π)."""
    line, points = (np.stack([each["r"].values, each["z"].values], axis=1) for each in (exact, one))
    return 100 * float(cKDTree(line).query(points)[0].max())


def _run(one: xr.Dataset, exact: xr.Dataset, volume: float) -> dict[str, float]:
    """What `fig_3_16` says of a run; NaN of one that diverged."""
    energy, area, inside = (one[name].values for name in ("energy", "area", "volume"))
    v = float(reduced(area[-1], inside[-1]))
    return {
        "reduced": v,
        "energy": 100 * abs(energy[-1] / float(exact["energy"]) - 1),
        "energy_measured": 100 * abs(energy[-1] / exact_at(exact, volume, v) - 1),
        "profile": apart(one, exact) if np.isfinite(energy[-1]) else math.nan,
        "settled": 100 * abs(energy[-1] / energy[-1 - ROWS // 5] - 1),
        "volume": 100 * abs(inside[-1] / inside[0] - 1),
        "area": 100 * abs(area[-1] / (4 * math.pi) - 1),
    }


def fig_3_16(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Largest over the runs, in percent: ``energy`` and ``profile``: deviation from the shape equation at the nominal
    volume, ``energy_measured`` at the measured one; ``starts``: gap of the energies from two starts; ``settled``:
    change of the energy over the last fifth; ``volume``: change over the run; ``area``: distance from the nominal one.
    The same of each run with its name. ``prolate_over_oblate`` at 0.77, ``oblate_over_prolate`` at 0.6: the larger
    energy of one branch over the lesser of the other."""
    data, shapes, out, last = datasets["vesicle_rest"], datasets["vesicle_shapes"], {}, {}
    for volume in VOLUMES:
        for branch in BRANCHES:
            runs, exact = cases(data, volume, branch), shapes.sel(volume=volume, branch=branch)
            for one in runs:
                found = _run(one, exact, volume)
                out |= {f"{what}_{one['case'].item()}": float(value) for what, value in found.items()}
            last[volume, branch] = energies = np.array([float(one["energy"][-1]) for one in runs])
            out[f"starts_{branch}_{volume:g}"] = 100 * float(energies.max() / energies.min() - 1)
    for what in ("energy", "energy_measured", "profile", "starts", "settled", "volume", "area"):
        own = [value for name, value in out.items() if name.startswith((f"{what}_prolate", f"{what}_oblate"))]
        out[what] = float(np.max(own))  # NaN stays
    out["prolate_over_oblate"] = float(last[0.77, "prolate"].max() / last[0.77, "oblate"].min())
    out["oblate_over_prolate"] = float(last[0.6, "oblate"].max() / last[0.6, "prolate"].min())
    return out


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each run: energy against the shape equation at the nominal and the measured volume, profile, cost."""
    header = ["run", "½∫H²/8π", "exact", "[%]", "measured volume", "[%] there", "profile [% of R]", "last fifth [%]",
              "volume [%]", "area [%]", "cells/R", "steps", "CPU s"]  # fmt: skip
    data, shapes, table = datasets["vesicle_rest"], datasets["vesicle_shapes"], []
    for volume in VOLUMES:
        for branch in BRANCHES:
            exact = float(shapes["energy"].sel(volume=volume, branch=branch)) / BALL
            for one in cases(data, volume, branch):
                name = str(one["case"].item())
                numbers = [measured[f"{what}_{name}"] for what in ("energy", "reduced", *REST)]
                table.append([
                    name.replace("_", " "), round(float(one["energy"][-1]) / BALL, 4), round(exact, 4),
                    *(round(q, 4 if k == 1 else 2) for k, q in enumerate(numbers)),
                    round(float(one["cells_a_unit"]), 1), int(one["n_steps"]), round(float(one["cpu_seconds"]), 1),
                ])  # fmt: skip
    return header, table


REST = ("energy_measured", "profile", "settled", "volume", "area")
