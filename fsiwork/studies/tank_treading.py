"""A vesicle in a shear flow (Fig. 3.15): angle, length and area over time, outlines, the pressure around it.

It tank-treads at a steady angle to the flow, or tumbles when the fluid inside is too viscous.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.ndimage import map_coordinates

from fsiwork import layout
from fsiwork.simulate import frames

ROWS = 120  # times at which the vesicle is looked at, and 0
SHOTS = 8  # pictures of a run
AROUND = 160  # points of an outline
WINDOW = np.linspace(-2.6, 2.6, 66)  # of the pressure, in radii √(A/π)
LAST = 2.0  # strain units over which the angle is a mean
DRIFT = 0.5  # degrees that a steady angle may go through in these
HALF_TURN = 180.0
REFERENCE = {
    "a7_r1": 21.94, "a7_r2": 15.14, "a7_r3": 8.52,
    "a9_r1": 31.01, "a9_r2": 25.35, "a9_r3": 19.94,
}  # fmt: skip
"""Angles in degrees by reduced area and viscosity ratio: boundary integral, unbounded Stokes flow, bending number 1."""


def outline(phi: np.ndarray, grid: layout.Geometry) -> np.ndarray:
    """The longest closed line φ = 0 of a field of shape (n_x, n_y), points of shape (m, 2)."""
    found = layout.contour(phi.T, grid)
    points = np.stack([found["x"], found["y"]], axis=1)
    pieces = [points[found["piece"] == k] for k in np.unique(found["piece"])]
    return max(pieces, key=len)


def moments(points: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Area, centroid and second moments about it, shape (2, 2), of the polygon through ``points`` (m, 2); exact."""
    middle = points.mean(axis=0)
    a, b = points - middle, np.roll(points - middle, -1, axis=0)
    twice = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]
    area = 0.5 * twice.sum()
    centre = ((a + b) * twice[:, None]).sum(axis=0) / (6 * area)
    pairs = [2 * np.einsum("mi,mj->mij", p, p) for p in (a, b)] + [np.einsum("mi,mj->mij", a, b)]
    pairs.append(pairs[-1].swapaxes(1, 2))
    second = (sum(pairs) * twice[:, None, None]).sum(axis=0) / 24 - area * np.outer(centre, centre)
    return abs(area), middle + centre, second * np.sign(area)


def tilt(second: np.ndarray) -> float:
    """Angle of the long axis to x [degrees], in (-90, 90]."""
    return math.degrees(0.5 * math.atan2(2 * second[0, 1], second[0, 0] - second[1, 1]))


def even(points: np.ndarray) -> np.ndarray:
    """The line through ``points`` by `AROUND` points, evenly along it, shape (AROUND, 2)."""
    closed = np.concatenate([points, points[:1]])
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    at = np.linspace(0.0, s[-1], AROUND)
    return np.stack([np.interp(at, s, closed[:, k]) for k in (0, 1)], axis=1)


def _around(p: np.ndarray, grid: layout.Geometry, radius: float) -> np.ndarray:
    """A centre field (n_x, n_y) on the square of `WINDOW` about the middle of the box, linear between centres."""
    x, y = (o + 0.5 * n * grid.h + radius * WINDOW for o, n in zip(grid.origin, grid.n, strict=True))
    where = np.meshgrid((x - grid.origin[0]) / grid.h - 0.5, (y - grid.origin[1]) / grid.h - 0.5, indexing="ij")
    return map_coordinates(p, where, order=1, mode="nearest")


def follow(scene, point: dict[str, Any]) -> dict[str, Any]:
    """Run a scene with one vesicle: `ROWS` rows of what it does, `SHOTS` outlines and pressures.

    ``angle`` is continuous, in degrees; lengths are in radii √(A/π), of which ``cells`` and ``height`` of the box, too.
    What a diverged run did not reach is NaN.
    """
    grid, spec = layout.geometry(scene), scene.bodies[0]
    scene = scene.model_copy(update={"clock": scene.clock.model_copy(update={"frames": ROWS})})
    table = {name: np.full(ROWS + 1, math.nan) for name in ("t", "angle", "length", "area", "least", "most")}
    radius, lines, pressures = 0.0, [], []
    for row, frame in enumerate(frames(scene)):
        if frame.fields:
            line = outline(frame.fields["phi"][1], grid)
            area, _, second = moments(line)
            radius = radius or math.sqrt(area / math.pi)
            gauge = {name: float(frame.gauges[name][-1]) for name in NAMES.values()}
            found = {"t": frame.t, "angle": tilt(second)} | {name: gauge[key] for name, key in NAMES.items()}
            for name, value in found.items():
                table[name][row] = value
            lines.append(even(line) / radius)
            pressures.append(_around(frame.fields["p"][1], grid, radius))
    table["angle"][: len(lines)] = np.unwrap(table["angle"][: len(lines)], period=HALF_TURN)
    out: dict[str, Any] = {name: (("row",), values) for name, values in table.items()}
    for k, row in enumerate(pictures(table["angle"])):
        picture = min(row, len(lines) - 1)
        out |= {
            f"t_{k}": table["t"][picture],
            f"line_{k}": lines[picture].ravel(),
            f"p_{k}": pressures[picture].ravel(),
        }
    fluid, rate = scene.fluid, abs(scene.fluid.initial.rate)
    out |= {
        "reynolds": fluid.density * rate * radius**2 / fluid.viscosity,
        "bending_number": fluid.viscosity * rate * radius**3 / spec.bending,
        "ratio": spec.inside.viscosity / fluid.viscosity,
        "reduced_area": 4 * math.pi * table["area"][0] / table["length"][0] ** 2,
        "eps_cells": spec.width.of(grid.h) / grid.h,
        "eps": spec.width.of(grid.h) / radius,
        "height": scene.box.length[1] / radius,
        "width": scene.box.length[0] / radius,
        "rate": rate,
    }
    return out | {"ended": frame.ended, "n_steps": frame.step, "n_cells": scene.box.cells}


NAMES = {"length": "geometric_length", "area": "geometric_volume", "least": "stretch_min", "most": "stretch_max"}


def pictures(angle: np.ndarray) -> list[int]:
    """Rows of `SHOTS` pictures: evenly over half a turn if there is one, else over time."""
    turned = np.abs(angle - angle[0])
    if np.nanmax(turned) >= HALF_TURN:
        return [int(np.nanargmin(np.abs(turned - (k + 0.5) * HALF_TURN / SHOTS))) for k in range(SHOTS)]
    last = int(np.isfinite(angle).sum()) - 1
    return [round((k + 1) * last / SHOTS) for k in range(SHOTS)]


# ---------------------------------------------------------------------------------------------------- measures
def steady(one: xr.Dataset) -> tuple[float, float]:
    """Mean and range [degrees] of the angle over the last `LAST` strain units; NaN of a run that diverged."""
    if str(one["ended"].item()) != "complete":
        return math.nan, math.nan
    strain = one["t"].values * float(one["rate"])
    angle = one["angle"].values[strain >= strain[-1] - LAST - 1e-9]
    return float(angle.mean()), float(np.ptp(angle))


def tumbles(one: xr.Dataset) -> bool:
    """Whether the long axis has gone past the perpendicular to the flow."""
    return float(np.nanmin(one["angle"])) < -90.0


def change(values: np.ndarray) -> float:
    """Largest deviation from the first value, in percent."""
    return 100 * float(np.nanmax(np.abs(values / values[0] - 1)))


def bracket(data: xr.Dataset, start: str) -> tuple[float, float]:
    """The threshold of tumbling: the largest viscosity ratio up to which all runs with names that ``start`` so are
    steady at an angle above 0 (0 if none is), and the least one that tumbles (infinite if none does)."""
    runs = sorted((float(data["ratio"].sel(case=k)), k) for k in data["case"].values if str(k).startswith(start))
    slow = 0.0
    for ratio, case in runs:
        mean, drift = steady(data.sel(case=case))
        if not (mean > 0 and drift < DRIFT):
            break
        slow = ratio
    return slow, min((ratio for ratio, case in runs if tumbles(data.sel(case=case))), default=math.inf)


def fig_3_15(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """``angle_CASE`` and ``drift_CASE`` where there is a reference, and the largest ``drift``; ``treads`` and
    ``tumbles``, see `bracket`; ``turned_CASE``: how far it went round, in degrees; largest changes of ``length`` and
    ``area`` of these and of the others, ``…_tumbling``, in percent; the least ``eps_cells`` and box ``height`` [radii],
    the largest ``reynolds`` number."""
    data, out = datasets["vesicle"], {}
    for case in data["case"].values:
        one = data.sel(case=case)
        out[f"turned_{case}"] = float(np.nanmax(np.abs(one["angle"] - one["angle"][0])))
        if case in REFERENCE:
            out[f"angle_{case}"], out[f"drift_{case}"] = steady(one)
    out["drift"] = float(np.max([value for name, value in out.items() if name.startswith("drift_")]))
    out["treads"], out["tumbles"] = bracket(data, "a7")
    for name in ("length", "area"):
        changes = {str(case): change(data[name].sel(case=case).values) for case in data["case"].values}
        out[name] = max(value for case, value in changes.items() if case in REFERENCE)
        out[f"{name}_tumbling"] = max((value for case, value in changes.items() if case not in REFERENCE), default=0.0)
    out |= {name: float(data[name].min()) for name in ("eps_cells", "height")}
    return out | {"reynolds": float(data["reynolds"].max())}


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each run."""
    header = ["reduced area", "viscosity ratio", "angle [°]", "reference [°]", "drift [°]", "turned [°]", "length [%]"]
    header += [
        "area [%]",
        "stretch, least",
        "stretch, most",
        "Re",
        "N",
        "ε [Δx]",
        "ε/R",
        "box height/R",
        "end",
        "CPU s",
    ]
    data, table = datasets["vesicle"], []
    for case in data["case"].values:
        one = data.sel(case=case)
        angles = [round(measured.get(f"{name}_{case}", math.nan), 2) for name in ("angle", "drift")]
        angle, drift = angles if case in REFERENCE else ("tumbles" if tumbles(one) else "–", "–")
        table.append([
            round(float(one["reduced_area"]), 3), float(one["ratio"]), angle, REFERENCE.get(case, "–"), drift,
            round(measured[f"turned_{case}"], 1), round(change(one["length"].values), 2),
            round(change(one["area"].values), 3), round(float(np.nanmin(one["least"])), 3),
            round(float(np.nanmax(one["most"])), 3), round(float(one["reynolds"]), 4), int(one["n_cells"]),
            float(one["eps_cells"]), round(float(one["eps"]), 3), round(float(one["height"]), 1),
            round(float(np.nanmax(one["t"])), 1), round(float(one["cpu_seconds"]), 1),
        ])  # fmt: skip
    return header, table
