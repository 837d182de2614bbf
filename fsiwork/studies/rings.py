"""A stretched elastic ring relaxes in a viscous fluid: two level sets against Lagrangian markers, in the same fluid and
with the same energy (3.4), (3.1)-(3.8).

Both spread the force over a tube of half-width 2 Δx at first, by the same cosine: ε = 2 Δx √stretch, the fields being
√stretch times a distance. The tube of the markers stays as wide, that of the level sets grows as the ring shrinks.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline, RegularGridInterpolator

from fsiwork.core.integrals import line_integral
from fsiwork.scene import Scene
from fsiwork.simulate import Simulation, build
from fsiwork.studies.orders import observed_orders

STRETCHES = (1.25, 1.5)
EVERY = 4  # steps between two rows
ACROSS, ALONG = np.linspace(0.2, 0.7, 51), np.linspace(-0.25, 0.25, 51)  # of a section, from the ring's centre


def relax(scene: Scene | None, point: dict[str, Any]) -> dict[str, Any]:
    """The ring of a scene to the end of its clock: radius, stretch on the curve, length, mean stretch, energies over
    time; of level sets also D and Z₃ at the end in a half-plane through the axis.

    Of level sets the radius is that of φ¹ = φ² = 0, the length their line integral, the mean that over the tube.
    """
    sim = build(scene)
    rows, ended = [_row(sim)], ""
    for step in range(sim.total):
        ended = ended or sim.advance()
        if (step + 1) % EVERY == 0:
            rows.append(dict.fromkeys(rows[0], np.nan) if ended else _row(sim))
    out = {name: (("row",), np.array([row[name] for row in rows])) for name in rows[0]}
    out["t"] = (("row",), np.arange(len(rows)) * EVERY * sim.dt)
    out |= {name: (("place",), q.ravel()) for name, q in _section(sim).items()}
    return out | {"ended": ended or "complete", "n_steps": sim.steps, "n_cells": sim.flow.grid.n[0]}


def _row(sim: Simulation) -> dict[str, float]:
    body, gauges = sim.bodies[0], sim.gauges()
    found = {name: gauges[name] for name in ("kinetic_energy", "elastic_energy", "energy_residual")}
    if not hasattr(body, "levels"):
        length, shape = gauges["length"], sim.scene.bodies[0].shape
        mean = length / float(body.rest.sum())
        radius = float(np.linalg.norm(body.X - np.array(shape.centre), axis=1).mean())
        return found | {"radius": radius, "stretch": mean, "length": length, "mean_stretch": mean}
    radius, stretch = _on_curve(sim)
    length = line_integral(sim.flow.grid, (body.levels[0], body.levels[1]), body.eps)
    mean = gauges["length"] / gauges["rest_length"]
    return found | {"radius": radius, "stretch": stretch, "length": length, "mean_stretch": mean}


def _block(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """φ¹, φ² and |w| at centres on the four rows beside the ray from the centre along x, and their x from there.

    For a ring around z in the middle of a box with an even number of cells.
    """
    grid, levels = sim.flow.grid, sim.bodies[0].levels
    k = grid.n[0] // 2
    fields = [grid.inside(q)[k - 2 :, k - 3 : k + 3, :] for q in levels[:2]]
    slopes = [np.array(np.gradient(q, grid.h)) for q in fields]
    w = np.linalg.norm(np.cross(*slopes, axis=0), axis=0)
    return np.array([*fields, w])[:, :, 2:4, :], grid.coordinate(0)[k - 2 :] - sim.scene.bodies[0].shape.centre[0]


def _on_curve(sim: Simulation) -> tuple[float, float]:
    """Radius of φ¹ = φ² = 0 and Z₃ = |w| there, by cubic splines along a ray; the rows lie h/2 beside it."""
    values, x = _block(sim)
    k, half = sim.flow.grid.n[2] // 2, 0.5 * sim.flow.grid.h
    line = values[:, :, :, k - 1 : k + 1].mean(axis=(2, 3))
    if not np.isfinite(line).all():
        return np.nan, np.nan
    roots = CubicSpline(x, line[1]).roots(extrapolate=False)
    if not roots.size:
        return np.nan, np.nan
    return float(np.hypot(roots.max(), half)), float(CubicSpline(x, line[2])(roots.max()))


def _section(sim: Simulation) -> dict[str, np.ndarray]:
    """D over its largest value and Z₃ in the half-plane at the points `ACROSS`, `ALONG`; NaN for markers."""
    shape, body = (ACROSS.size, ALONG.size), sim.bodies[0]
    if not hasattr(body, "levels"):
        return dict.fromkeys(("dirac", "z3"), np.full(shape, np.nan))
    values, x = _block(sim)
    z = sim.flow.grid.coordinate(2) - sim.scene.bodies[0].shape.centre[2]
    points = np.stack(np.meshgrid(ACROSS, ALONG, indexing="ij"), axis=-1)
    first, second, w = (RegularGridInterpolator((x, z), q)(points) for q in values.mean(axis=2))
    bells = [0.5 * (1 + np.cos(np.pi * np.clip(q / body.eps, -1, 1))) for q in (first, second)]
    return {"dirac": bells[0] * bells[1], "z3": w}


def one(data: xr.Dataset, name: str, **point: Any) -> np.ndarray:
    """A column over the rows of one ring."""
    return data[name].sel(point).values


def measure(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """By way of carrying, stretch and N, in percent: gap in radius to the markers over that radius (``gap``) and over
    the whole change (``of_change``); Z₃ on the curve against s times its circumference over the first (``z3``), and its
    mean over the tube against the line integral (``z3_length``); energy made over what could be released (``made``).
    Without N: on the finest grid, the larger of field and map. ``z3_order``, ``z3_length_order``: of the two, with a
    tube of fixed width (``fixed_1.25``), between the two finest grids."""
    data, out = datasets["curve_ring"], {}
    finest = int(data["cells"].max())
    for s in STRETCHES:
        for n in data["cells"].values:
            mark = one(data, "radius", case=f"markers_{s:g}", cells=n)
            for way in ("field", "map"):
                here, tail = {"case": f"{way}_{s:g}", "cells": n}, f"_{way}_{s:g}_{n:g}"
                radius = one(data, "radius", **here)
                apart = np.abs(radius - mark).max()
                out[f"gap{tail}"] = float(100 * np.abs(radius / mark - 1).max())
                out[f"of_change{tail}"] = float(100 * apart / (mark[0] * (1 - 1 / s)))
                out |= _kinematics(data, way, s, n)
                total = one(data, "kinetic_energy", **here) + one(data, "elastic_energy", **here)
                out[f"made{tail}"] = float(100 * np.diff(total).clip(0.0).sum() / total[0])
        for name in ("gap", "of_change", "z3", "z3_length", "made"):
            out[f"{name}_{s:g}"] = float(np.max([out[f"{name}_{way}_{s:g}_{finest}"] for way in ("field", "map")]))
    for n in data["cells"].values:
        out |= _kinematics(data, "fixed", STRETCHES[0], n)
    for name in ("z3", "z3_length"):
        errors = [out[f"{name}_fixed_{STRETCHES[0]:g}_{n:g}"] for n in data["cells"].values]
        out[f"{name}_order"] = float(observed_orders(1 / data["cells"], errors)[-1])
    return out


def _kinematics(data: xr.Dataset, way: str, s: float, n: float) -> dict[str, float]:
    """How far Z₃ is from the lengths, percent."""
    here, tail = {"case": f"{way}_{s:g}", "cells": n}, f"_{way}_{s:g}_{n:g}"
    radius, length = one(data, "radius", **here), one(data, "length", **here)
    on_curve = _percent(one(data, "stretch", **here), s * radius / radius[0])
    return {
        f"z3{tail}": on_curve,
        f"z3_length{tail}": _percent(one(data, "mean_stretch", **here), s * length / length[0]),
    }


def _percent(found: np.ndarray, exact: np.ndarray) -> float:
    return float(100 * np.abs(found / exact - 1).max())


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each stretch, N and way of carrying."""
    data = datasets["curve_ring"]
    header = ["stretch", "N", "carrier", "last radius", "gap, %", "of the change, %", "Z₃, %", "Z₃ mean, %", "CPU s"]
    table = []
    for s in STRETCHES:
        for n in data["cells"].values:
            for way in ("markers", "field", "map"):
                at = {"case": f"{way}_{s:g}", "cells": n}
                names = ("gap", "of_change", "z3", "z3_length")
                found = [float(f"{measured.get(f'{name}_{way}_{s:g}_{n:g}', 0.0):.3g}") for name in names]
                last = round(float(one(data, "radius", **at)[-1]), 4)
                table.append([s, int(n), way, last, *found, round(float(data["cpu_seconds"].sel(at)), 1)])
    return header, table
