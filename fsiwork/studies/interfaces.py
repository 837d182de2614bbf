"""Interfaces in a prescribed motion: the stretched blob of Figs 1.5 and 1.6, and bodies that must come back unharmed.

The measures of an interface that is carried as a map are those of φ₀ of the interpolated map on a finer grid: its
filaments are thinner than a cell. Without a map φ itself is interpolated.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr
from contourpy import contour_generator
from scipy.integrate import solve_ivp

from fsiwork.bodies.interface import Interface, measures
from fsiwork.core import integrals
from fsiwork.core.grid import Grid
from fsiwork.simulate import Simulation, build

FINE = 1024  # cells along a side of the grid on which lines are measured, or four times those of the run
FINE_3D = 2  # times the cells of the run
ON = 1e-6  # cells from the line to what counts as on it
POINTS = 4000  # of an outline
MARKERS = 20_000
LENGTHS = {1: 2.70816, 2: 5.08636, 3: 7.51032, 4: 10.02914, 5: 12.55006}
"""Length of the stretched circle at whole times: 4e5 markers and an integrator of eighth order (the errata's check)."""
XYZ = "xyz"


def _moments(sim: Simulation) -> Iterator[float]:
    """Times of the frames of a scene, from 0; the simulation is there when they are asked for. Raises RuntimeError."""
    yield 0.0
    while sim.frame_number < sim.scene.clock.frames:
        if fault := sim.advance():
            raise RuntimeError(fault)
        if sim.at_frame():
            sim.frame_number += 1
            yield sim.t


def _factor(grid: Grid) -> int:
    return max(4, math.ceil(FINE / max(grid.n))) if grid.dim == 2 else FINE_3D


def outline(grid: Grid, phi: np.ndarray) -> np.ndarray:
    """Points of φ = 0 in the plane, shape (`POINTS`, 2): pieces end with NaN, and so does the array."""
    lines = contour_generator(grid.coordinate(0), grid.coordinate(1), grid.inside(phi).T, name="serial").lines(0.0)
    every = max(1, math.ceil(sum(map(len, lines)) / (POINTS - 3 * len(lines) - 1)) if len(lines) < POINTS // 6 else 50)
    parts = [np.vstack([line[:-1:every], line[-1:], [[np.nan] * 2]]) for line in lines]
    points = np.vstack([*parts, np.full((POINTS, 2), np.nan)])[:POINTS]
    return np.round(points, 6)


# ------------------------------------------------------------------------------------------------------- the blob
def blob(scene, point: dict[str, Any]) -> dict[str, Any]:
    """Length and area of an interface over the frames, and its outline at the end.

    ``renormalised`` and ``length`` [length], ``area`` [length²] over ``time``; ``x``, ``y`` of the outline.
    """
    sim = build(scene)
    body, rows = sim.bodies[0], []
    for t in _moments(sim):
        phi = body.fields()["phi"]
        grid, fine = body.finer(_factor(sim.flow.grid)) if body.map else (sim.flow.grid, phi)
        rows.append((t, integrals.length(sim.flow.grid, phi, "renormalised"), *integrals.length_and_area(grid, fine)))
    points = outline(*body.finer(_factor(sim.flow.grid)))
    out = {
        name: (("time",), q) for name, q in zip(("t", "renormalised", "length", "area"), np.array(rows).T, strict=True)
    }
    out |= {name: (("outline",), points[:, a]) for a, name in enumerate("xy")}
    return out | {"n_steps": sim.steps, "n_cells": scene.box.cells}


def blob_exact(scene, point: dict[str, Any]) -> dict[str, Any]:
    """The same by markers on the circle: an integrator of eighth order, trigonometric interpolation between them."""
    field, shape = build(scene).flow.field, scene.bodies[0].shape
    angle = 2 * np.pi * np.arange(MARKERS) / MARKERS
    start = np.array(shape.centre)[:, None] + shape.radius * np.array([np.cos(angle), np.sin(angle)])
    t = np.linspace(0.0, scene.clock.end, scene.clock.frames + 1)

    def velocity(_, q):
        return np.concatenate(field.velocity(*q.reshape(2, -1)))

    found = solve_ivp(velocity, (0.0, t[-1]), start.ravel(), "DOP853", t, rtol=1e-10, atol=1e-11)
    x, y = np.moveaxis(found.y.reshape(2, MARKERS, t.size), 2, 1)
    waves = 1j * np.fft.rfftfreq(MARKERS, 1 / MARKERS)
    dx, dy = (np.fft.irfft(waves * np.fft.rfft(q), MARKERS) for q in (x, y))
    every = 2 * np.pi / MARKERS
    length, area = np.hypot(dx, dy).sum(1) * every, 0.5 * (x * dy - y * dx).sum(1) * every
    out = {name: (("time",), q) for name, q in (("t", t), ("length", length), ("area", area))}
    place = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x[-1]), np.diff(y[-1])))])
    even = np.searchsorted(place, np.linspace(0.0, place[-1], POINTS // 2)).clip(0, MARKERS - 1)
    return out | {name: (("outline",), np.round(q[-1][even], 6)) for name, q in (("x", x), ("y", y))}


def _errors(data: xr.Dataset, exact: xr.Dataset, **point) -> tuple[float, float]:
    """Errors of area and length at the end [percent]."""
    one = data.sel(point).isel(time=-1)
    return tuple(100 * (float(one[name]) / float(exact[name][-1]) - 1) for name in ("area", "length"))


def fig_1_5(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Errors of area and length at the end in percent, ``area_METHOD_N`` and ``length_METHOD_N``; sizes for the map."""
    data, exact = datasets["blob"], datasets["blob_exact"]
    out = {}
    for method in data["carried"].values:
        for n in data["cells"].values:
            for name, error in zip(("area", "length"), _errors(data, exact, carried=method, cells=n), strict=True):
                out[f"{name}_{method}_{n}"] = abs(error) if method == "map" else error
    return out


def fig_1_6(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Renormalised lengths at the end, ``METHOD_N``; the map's error in percent; the markers' against `LENGTHS`."""
    data, exact = datasets["blob"], datasets["blob_exact"]
    out = {}
    for method in ("plain", "redistanced"):
        for n in data["cells"].values:
            out[f"{method}_{n}"] = float(data["renormalised"].sel(carried=method, cells=n)[-1])
    for n in data["cells"].values:
        ours = data["length"].sel(carried="map", cells=n)
        out[f"map_{n}"] = float(100 * abs(ours / exact["length"].values - 1).max(skipna=False))
    at = [int(np.argmin(np.abs(exact["t"].values - t))) for t in LENGTHS]
    deviations = exact["length"].values[at] / np.array(list(LENGTHS.values())) - 1
    return out | {"exact_deviation": float(np.abs(deviations).max())}


# ----------------------------------------------------------------------------------------------- there and back again
def returned(scene, point: dict[str, Any]) -> dict[str, Any]:
    """An interface that the motion brings back to where it was, against how it began; the scene has an even number of
    frames.

    ``volume`` (area in the plane): relative change [percent]. ``mismatch``: what lies on the wrong side, in percent of
    the inside; ``l1``: the same over the interface's own measure [Δx]. ``shape``: mean distance of its points from the
    first interface [Δx]. ``map``: largest |Y - x| over the longest side of the box (NaN without a map). Outlines at
    the start, half way and at the end (in space silhouettes along z) as ``start_x``, ``start_y``, ``half_x`` and so on.
    """
    sim = build(scene)
    body, g = sim.bodies[0], sim.flow.grid
    first, outlines = _look(body), {}
    for _ in _moments(sim):
        for name, share in (("start", 0.0), ("half", 0.5), ("end", 1.0)):
            if sim.frame_number == share * scene.clock.frames:
                outlines[name] = _silhouette(*body.finer(_factor(g)))
    fine, was, now = first[0], first[1], _look(body)[1]
    before, after = measures(fine, was), measures(fine, now)
    off = np.abs(was) > ON * g.h  # points of the line itself count for neither side
    wrong = float(fine.inside(off & ((was < 0) != (now < 0))).mean()) * math.prod(g.length)
    surface = before["length" if g.dim == 2 else "area"]
    out = {
        "volume": 100 * (after["volume"] / before["volume"] - 1),
        "mismatch": 100 * wrong / before["volume"],
        "l1": wrong / surface / g.h,
        "shape": _mean_distance(fine, was, now) / g.h,
        "map": _strayed(body) if body.map else math.nan,
    }
    for name, points in outlines.items():
        out |= {f"{name}_{XYZ[a]}": (("outline",), points[:, a]) for a in (0, 1)}
    return out | {"n_steps": sim.steps, "n_cells": scene.box.cells}


def _look(body: Interface) -> tuple[Grid, np.ndarray]:
    fine, phi = body.finer(_factor(body.grid))
    return fine, phi.ravel()


def _silhouette(grid: Grid, phi: np.ndarray) -> np.ndarray:
    """Outline of what one sees along z."""
    if grid.dim == 2:
        return outline(grid, phi)
    plane = Grid(grid.n[:2], grid.h, grid.origin[:2])
    return outline(plane, grid.padded(phi).min(axis=2).ravel())


def _mean_distance(grid: Grid, distance: np.ndarray, phi: np.ndarray) -> float:
    """Mean of |``distance``| over the points where φ changes its sign between neighbours; NaN when there are none."""
    q, d, found = grid.inside(phi), grid.inside(distance), []
    for a in grid.axes:
        low, high = (tuple(part if b == a else slice(None) for b in grid.axes) for part in (slice(-1), slice(1, None)))
        crossed = (q[low] < 0) != (q[high] < 0)
        share = q[low][crossed] / (q[low][crossed] - q[high][crossed])
        found.append(np.abs((1 - share) * d[low][crossed] + share * d[high][crossed]))
    values = np.concatenate(found)
    return float(values.mean()) if values.size else math.nan


def _strayed(body: Interface) -> float:
    g = body.grid
    far = [np.abs(g.inside(Y) - g.points(ghosts=0)[a]).max() for a, Y in enumerate(body.map.Y)]
    return float(max(far)) / max(g.length)


def back_again(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """``QUANTITY_METHOD_N`` of the one study: |volume| and mismatch in percent, l1 and shape in Δx, map."""
    (data,) = datasets.values()
    out = {}
    for method in data["carried"].values:
        for n in data["cells"].values:
            one = data.sel(carried=method, cells=n)
            values = {name: float(one[name]) for name in ("volume", "mismatch", "l1", "shape", "map")}
            signed = {"volume_signed": values["volume"]} | values | {"volume": abs(values["volume"])}
            out |= {f"{name}_{method}_{n}": v for name, v in signed.items() if name != "map" or method == "map"}
    return out


def rows_back(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each method and N."""
    (data,) = datasets.values()
    header = ["method", "N", "change of volume [%]", "mismatch [%]", "L1 [Δx]", "shape [Δx]", "CPU seconds"]
    rows = []
    for method in data["carried"].values:
        for n in data["cells"].values:
            one = data.sel(carried=method, cells=n)
            numbers = (float(one[name]) for name in ("volume", "mismatch", "l1", "shape", "cpu_seconds"))
            rows.append([str(method), int(n), *(float(f"{v:.3g}") for v in numbers)])
    return header, rows


def enright(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """As `back_again`, and ``mismatch_ratio`` of the map between the two finest grids (NaN for one)."""
    out, (data,) = back_again(datasets), datasets.values()
    mismatch = data["mismatch"].sel(carried="map").sortby("cells").values
    return out | {"mismatch_ratio": float(mismatch[-1] / mismatch[-2]) if mismatch.size > 1 else math.nan}
