"""A vesicle in a shear flow in space (Fig. 3.17): angle, area and volume over time, outlines in the plane of shear.

Half of it is computed, beside the plane of shear, of which it is the mirror image; what is measured is of the whole.
Lengths are in units of √(A/4π), A the area that a scene is made for.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork import layout
from fsiwork.core.grid import Grid
from fsiwork.core.integrals import area_and_volume
from fsiwork.simulate import build
from fsiwork.studies.tank_treading import LAST, even, outline, steady, tilt
from fsiwork.studies.vesicle_rest import reduced

ROWS = 60  # times at which the vesicle is looked at, and 0
SHOTS = 4  # outlines of a run, the first at t = 0
SMEARED = 1.5  # cells over which the inside ends when its moments are summed: second order


def moments(grid: Grid, phi: np.ndarray) -> np.ndarray:
    """Second moments about the centroid over the volume, shape (3, 3), of the inside of φ (a distance, nearly) and of
    its mirror image across the low side of z."""
    r = np.clip(grid.inside(phi) / (SMEARED * grid.h), -1, 1)
    inside = 0.5 * (1 - r - np.sin(np.pi * r) / np.pi)
    lines = [inside.sum(axis=tuple(b for b in grid.axes if b != a)) for a in grid.axes]
    x, total = [grid.coordinate(a) for a in grid.axes], inside.sum()
    centre = [float(line @ q / total) for line, q in zip(lines, x, strict=True)]
    centre[2] = grid.origin[2]
    x = [q - c for q, c in zip(x, centre, strict=True)]
    out = np.diag([float(line @ q**2 / total) for line, q in zip(lines, x, strict=True)])
    out[0, 1] = out[1, 0] = x[0] @ inside.sum(axis=2) @ x[1] / total
    return out


def _line(grid: Grid, phi: np.ndarray) -> np.ndarray:
    """The outline in the plane of symmetry z = 0, between the first centres, in which φ is even: a cubic there."""
    layers = grid.inside(phi)
    plane = layout.Geometry(grid.n[:2], grid.h, grid.origin[:2], (False, False))
    return even(outline(1.125 * layers[..., 0] - 0.125 * layers[..., 1], plane))


def follow(scene, _point: dict[str, Any]) -> dict[str, Any]:
    """Run a scene with half a vesicle: `ROWS` rows of what it does, `SHOTS` outlines. ``angle`` in degrees to the flow;
    ``axis_1`` to ``axis_3``: half-axes of the ellipsoid of the same second moments.

    What a diverged run did not reach is NaN."""
    sim, spec, fluid = build(scene), scene.bodies[0], scene.fluid
    grid, body = sim.flow.grid, sim.bodies[0]
    table = {k: np.full(ROWS + 1, math.nan) for k in ("t", "angle", "area", "volume", "axis_1", "axis_2", "axis_3")}
    lines, row, ended = [], 0, ""
    while True:
        while row <= ROWS and sim.steps >= round(row * sim.total / ROWS):
            area, volume = area_and_volume(grid, body.phi)
            second = moments(grid, body.phi)
            axes = np.sqrt(5 * np.linalg.eigvalsh(second)[::-1])
            found = {"t": sim.t, "angle": tilt(second), "area": 2 * area, "volume": 2 * volume}
            for name, value in (found | {f"axis_{k + 1}": q for k, q in enumerate(axes)}).items():
                table[name][row] = value
            if row % (ROWS // (SHOTS - 1)) == 0:
                lines.append(_line(grid, body.phi))
            row += 1
        if sim.steps == sim.total or (ended := sim.advance()):
            break
    rate = abs(fluid.initial.rate)
    return {
        **{name: (("row",), values) for name, values in table.items()},
        **{f"line_{k}": lines[min(k, len(lines) - 1)].ravel() for k in range(SHOTS)},
        "reynolds": fluid.density * rate / fluid.viscosity,
        "capillary": fluid.viscosity * rate / spec.bending,
        "eps_cells": spec.width.of(grid.h) / grid.h,
        "cells_a_unit": 1 / grid.h,
        "height": scene.box.length[1],
        "rate": rate,
        "ended": ended or "complete",
        "n_steps": sim.steps,
        "n_cells": scene.box.cells,
    }


def small_deformation(volume: float, ratio: float = 1.0) -> float:
    """Angle [degrees] of a nearly spherical vesicle in unbounded Stokes flow, leading order in its excess area Δ:
    ½ arccos(√Δ (23 ratio + 32)/(8√(30π))) (Misbah 2006, from memory; 0 where it tumbles)."""
    excess = 4 * math.pi * (volume ** (-2 / 3) - 1)
    cosine = math.sqrt(excess) * (23 * ratio + 32) / (8 * math.sqrt(30 * math.pi))
    return 0.5 * math.degrees(math.acos(min(cosine, 1.0)))


def fig_3_17(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Largest over the runs: ``drift`` of the angle over the last two strain units, in degrees, and changes of ``area``
    and ``volume`` from the start, in percent; least ``eps_cells``. Of each run with its name these, the ``angle``, the
    ``reduced`` volume at first, and the angle of the ``theory`` of small deformation there."""
    data, out = datasets["vesicle_shear"], {}
    for case in data["case"].values:
        one = data.sel(case=case)
        area, volume = one["area"].values, one["volume"].values
        out[f"angle_{case}"], out[f"drift_{case}"] = steady(one)
        out[f"area_{case}"] = 100 * float(np.abs(area / area[0] - 1).max())  # NaN stays
        out[f"volume_{case}"] = 100 * float(np.abs(volume / volume[0] - 1).max())
        out[f"reduced_{case}"] = float(reduced(area[0], volume[0]))
        out[f"theory_{case}"] = small_deformation(out[f"reduced_{case}"])
    for what in ("drift", "area", "volume"):
        out[what] = float(np.max([out[f"{what}_{case}"] for case in data["case"].values]))
    return out | {"eps_cells": float(data["eps_cells"].min()), "strain": float(data["t"].max() * data["rate"].max())}


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each run: what it is, its angle beside that of small deformations, what it keeps, what it cost."""
    header = ["run", "reduced volume", "capillary number", "Re", "cells/R", "N", "box height/R", "angle [°]",
              f"drift over {LAST:g} strains [°]", "small deformation [°]", "half-axes/R", "area [%]", "volume [%]",
              "steps", "CPU s"]  # fmt: skip
    data, table = datasets["vesicle_shear"], []
    for case in data["case"].values:
        one = data.sel(case=case)
        axes = " × ".join(f"{float(one[f'axis_{k}'][-1]):.3f}" for k in (1, 2, 3))
        table.append([
            str(case), round(measured[f"reduced_{case}"], 3), float(one["capillary"]), float(one["reynolds"]),
            round(float(one["cells_a_unit"]), 1), int(one["n_cells"]), round(float(one["height"]), 2),
            *(round(measured[f"{what}_{case}"], 2) for what in ("angle", "drift", "theory")), axes,
            *(round(measured[f"{what}_{case}"], 3) for what in ("area", "volume")), int(one["n_steps"]),
            round(float(one["cpu_seconds"]), 1),
        ])  # fmt: skip
    return header, table
