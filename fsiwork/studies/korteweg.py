"""The Korteweg form (3.24)-(3.27) of a membrane's force beside the divergence form (3.16): they differ by the gradient
of E'|∇φ|D_ε, so that the velocity is the same and the pressure is not.

It holds for every energy: Σ = F(|∇φ|) ∇φ⊗∇φ D_ε with F(r) = E'(r)/r. With F = 1, E = ½r² ("fluid" below), the force
is -Δψ∇ψ, ψ' = √D_ε, that of a Korteweg fluid.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.bodies.laws import Linear, Quadratic
from fsiwork.core import levelset
from fsiwork.core.integrals import length_and_area
from fsiwork.scene import Scene
from fsiwork.simulate import Simulation, build

FORMS = ("divergence", "korteweg")
LINE = 96  # points of the pressure along y = middle, for the picture


@dataclass(frozen=True)
class Fluid:
    """E = ½ λ r², F = λ: the law of a Korteweg fluid."""

    stiffness: float

    def E(self, r: np.ndarray) -> np.ndarray:
        """Energy."""
        return 0.5 * self.stiffness * r**2

    def dE(self, r: np.ndarray) -> np.ndarray:
        """E'."""
        return self.stiffness * r

    def ddE(self, r: np.ndarray) -> np.ndarray:
        """E''."""
        return np.full_like(r, self.stiffness)


def together(scene: Scene, point: dict[str, Any]) -> dict[str, Any]:
    """The ``law`` by both forms from the same start: the difference of their velocities at the end, in parts of the
    divergence form's (root mean square and largest); that of their pressures from -E'|∇φ|D_ε, in parts of its largest
    value; that of the areas. D_ε must be the plain one."""
    if point["law"] == "fluid":
        law = Fluid(scene.bodies[0].energy.stiffness)
        scene = scene.model_copy(update={"bodies": (scene.bodies[0].model_copy(update={"energy": law}),)})
    runs = [_run(scene, form) for form in FORMS]
    one, other = ([r.flow.grid.inside(u, face=a).copy() for a, u in enumerate(r.flow.u)] for r in runs)
    square = [sum(float((c * c).mean()) for c in part) for part in (_less(other, one), one)]
    largest = [max(float(np.abs(c).max()) for c in part) for part in (_less(other, one), one)]
    p, other_p = (_pressure(r) for r in runs)
    q = _gradient_part(runs[0])
    areas = [length_and_area(r.flow.grid, r.bodies[0].phi)[1] for r in runs]
    return {
        "difference": (square[0] / square[1]) ** 0.5,
        "largest": largest[0] / largest[1],
        "pressure": float(np.abs(other_p - p + q - q.mean()).max() / q.max()),
        "area": abs(areas[1] / areas[0] - 1),
        "speed": largest[1],
        **{f"p_{form}": (("place",), _line(run)) for form, run in zip(FORMS, runs, strict=True)},
        "x": (("place",), np.linspace(0, scene.box.length[0], LINE)),
        "n_steps": runs[0].steps + runs[1].steps,
        "n_cells": scene.box.cells,
    }


def _run(scene: Scene, form: str) -> Simulation:
    """The scene to its end with this form; raises RuntimeError if it diverges."""
    body = scene.bodies[0].model_copy(update={"form": form})
    sim = build(scene.model_copy(update={"bodies": (body,)}))
    while sim.steps < sim.total:
        if fault := sim.advance():
            raise RuntimeError(f"{form}: {fault}")
    return sim


def _less(one: list[np.ndarray], other: list[np.ndarray]) -> list[np.ndarray]:
    return [a - b for a, b in zip(one, other, strict=True)]


def _pressure(sim: Simulation) -> np.ndarray:
    """p without its mean, at centres."""
    p = sim.flow.grid.inside(sim.flow.p)
    return p - p.mean()


def _gradient_part(sim: Simulation) -> np.ndarray:
    """E'|∇φ|D_ε at centres, by which the pressures differ."""
    body, grid = sim.bodies[0], sim.flow.grid
    slope = grid.inside(levelset.gradient_norm(grid, body.phi))
    energy = sim.scene.bodies[0].energy
    law = {"quadratic": Quadratic, "linear": Linear}.get(getattr(energy, "kind", ""), lambda _: energy)
    return law(energy.stiffness).dE(slope) * slope * grid.inside(levelset.dirac(body.phi, body.eps))


def _line(sim: Simulation) -> np.ndarray:
    """p - p(outside) along y = middle, at `LINE` places."""
    p, grid = sim.flow.grid.inside(sim.flow.p), sim.flow.grid
    middle = p[:, grid.n[1] // 2 - 1 : grid.n[1] // 2 + 1].mean(axis=1)
    return np.interp(np.linspace(0, grid.length[0], LINE), grid.coordinate(0) - grid.origin[0], middle - middle[0])


def korteweg(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Largest difference of the velocities over the laws at each N (percent; rms and in the largest norm) and the least
    factor by which it falls from one grid to the next, ε fixed in length; ``cells_…``: the same for ε in cells."""
    data = datasets["korteweg"].sortby("cells")
    out = {}
    for prefix, width in (("", "length"), ("cells_", "cells")):
        one = data.sel(width=width)
        for name in ("difference", "largest"):
            out |= {f"{prefix}{name}_{int(n)}": 100 * _most(one[name].sel(cells=n)) for n in one["cells"].values}
            out[f"{prefix}{name}_factor"] = float(_factors(one[name]).min(skipna=False))
    out["pressure"] = 100 * _most(data["pressure"].sel(width="length").isel(cells=-1))
    return out


def _most(values: xr.DataArray) -> float:
    return float(values.max(skipna=False))


def _factors(errors: xr.DataArray) -> xr.DataArray:
    """By how much each grid's errors are above those of the next."""
    return errors.isel(cells=slice(None, -1)) / errors.isel(cells=slice(1, None)).values


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each law, width and grid."""
    data = datasets["korteweg"].sortby("cells")
    names = ("difference", "largest", "pressure", "area")
    header = ["law", "ε", "N", "velocity, rms", "velocity, largest", "pressure", "area"]
    table = []
    for law in data["law"].values:
        for width in data["width"].values:
            for n in data["cells"].values:
                one = data.sel(law=law, width=width, cells=n)
                table.append([str(law), str(width), int(n), *(float(f"{float(one[k]):.3g}") for k in names)])
    return header, table
