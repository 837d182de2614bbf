"""Bending without motion (3.2.4): the force of a sphere, a torus and an ellipsoid against exact values, both forms, and
Willmore's energy of spheres and tori.

The box is [-1, 1]³; forces are compared at the nodes within Δx of the surface, in parts of the largest exact value (of
2/R³ for the sphere, whose force is 0).
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.bodies.band import Band
from fsiwork.bodies.bending import Bending
from fsiwork.core.curvature import of_ellipsoid
from fsiwork.core.grid import Grid
from fsiwork.core.shapes import Ball, Torus
from fsiwork.studies.orders import slope

BALL, RADIUS, TUBE, SEMI_AXES = 0.6, 0.6, 0.25, (0.8, 0.6, 0.45)
RATIOS = np.linspace(1.25, 1.65, 9)  # R/r of the tori whose energies are compared
EPS = 4.0  # cells


def exact_torus(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Δ_ΓH + ½H(H² - 4G) of the torus through each point, R = `RADIUS`."""
    q = np.hypot(x, y)
    d, w = np.hypot(z, RADIUS - q), q
    cosine = (q - RADIUS) / d
    H, G = 1 / d + cosine / w, cosine / (d * w)
    return -RADIUS * (RADIUS * cosine + d) / (d**2 * w**3) + 0.5 * H * (H**2 - 4 * G)


def exact_ellipsoid(x: np.ndarray, y: np.ndarray, z: np.ndarray, step: float = 0.02) -> np.ndarray:
    """The same for the ellipsoid through each point, similar to `SEMI_AXES`; derivatives of the exact H by differences
    of sixth order over ``step``, which leave 1e-8."""
    point, squares = np.array([x, y, z]), np.array(SEMI_AXES)[:, None] ** 2
    unit = np.eye(3)[:, :, None] * step

    def H(p):
        return of_ellipsoid(SEMI_AXES, *p)[0]

    def first(f, p, a):
        return sum(c * (f(p + k * unit[a]) - f(p - k * unit[a])) for k, c in ((1, 45), (2, -9), (3, 1))) / (60 * step)

    g = point / squares
    n = g / np.sqrt((g**2).sum(0))
    gradient = np.array([first(H, point, a) for a in range(3)])
    second = np.array([[first(lambda p, b=b: first(H, p, b), point, a) for b in range(3)] for a in range(3)])
    mean, gauss = of_ellipsoid(SEMI_AXES, *point)
    spread = np.einsum("aam->m", second) - np.einsum("am,abm,bm->m", n, second, n) - mean * (n * gradient).sum(0)
    return spread + 0.5 * mean * (mean**2 - 4 * gauss)


def _ball(grid: Grid):
    phi = grid.sample(Ball((0.0, 0.0, 0.0), BALL).distance)
    return phi, phi, lambda *x: 0 * x[0]


def _torus(grid: Grid):
    phi = grid.sample(Torus((0.0, 0.0, 0.0), RADIUS, TUBE).distance)
    return phi, phi, exact_torus


def _ellipsoid(grid: Grid):
    square = grid.sample(lambda *x: sum((c / a) ** 2 for c, a in zip(x, SEMI_AXES, strict=True)))
    return square - 1.0, (np.sqrt(square) - 1.0) * min(SEMI_AXES), exact_ellipsoid


SURFACES = {"ball": _ball, "torus": _torus, "ellipsoid": _ellipsoid}


def force(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Largest error of the force of a ``surface`` on ``cells``³ with a ``form``."""
    cells = int(point["cells"])
    grid = Grid((cells,) * 3, 2 / cells, (-1.0,) * 3)
    phi, distance, exact = SURFACES[point["surface"]](grid)
    band = Band(grid, EPS * grid.h, True)
    band.find(phi)
    found = Bending(grid, 1.0, EPS * grid.h, True, point["form"]).resistance(phi, band)
    start, n = grid.rows()
    inside = np.add.outer(start, np.arange(n)).ravel()
    nodes = inside[np.abs(distance[inside]) < grid.h]
    lines = [np.ravel(line) for line in grid.points()]
    x = [line[k] for line, k in zip(lines, np.unravel_index(nodes, grid.shape), strict=True)]
    wanted = exact(*x)
    scale = np.abs(wanted).max() if point["surface"] != "ball" else 2 / BALL**3
    return {"error": float(np.abs(found[nodes] - wanted).max() / scale), "n_cells": cells}


def energy(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """½∫H² of a sphere and of tori with R/r from `RATIOS` on ``cells``³, and R/r where a parabola is least."""
    cells = int(point["cells"])
    grid = Grid((cells,) * 3, 2 / cells, (-1.0,) * 3)
    bending = Bending(grid, 1.0, EPS * grid.h, True)

    def of(shape) -> float:
        phi, band = grid.sample(shape.distance), Band(grid, EPS * grid.h, True)
        band.find(phi)
        return bending.energy(phi, band)

    centre = (0.0, 0.0, 0.0)
    tori = np.array([of(Torus(centre, 0.9 * ratio / (1 + ratio), 0.9 / (1 + ratio))) for ratio in RATIOS])
    return {"sphere": of(Ball(centre, BALL)), "tori": (("ratio",), tori), "least": _least(tori), "n_cells": cells}


def _least(tori: np.ndarray) -> float:
    """R/r at which the quartic through the energies is least; NaN if it is at an end."""
    fit = np.polynomial.Polynomial.fit(RATIOS, tori, 4)
    places = [r.real for r in fit.deriv().roots() if abs(r.imag) < 1e-9 and RATIOS[0] < r.real < RATIOS[-1]]
    return float(min(places, key=fit)) if places else math.nan


def exact_energy(ratio: np.ndarray) -> np.ndarray:
    """½∫H² of a torus, 2π² (R/r)²/√((R/r)² - 1); of a sphere it is 8π."""
    return 2 * np.pi**2 * ratio**2 / np.sqrt(ratio**2 - 1)


def measure(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Orders of the force by surface and form; at the finest, errors of the sphere's energy and of the least torus."""
    forces, energies = datasets["willmore_force"].sortby("cells"), datasets["willmore_energy"].sortby("cells")
    out = {}
    for surface in forces["surface"].values:
        for form in forces["form"].values:
            one = forces["error"].sel(surface=surface, form=form)
            out[f"order_{surface}_{form}"] = slope(2 / one["cells"], one)
    out["order"] = min(out.values())
    last = energies.isel(cells=-1)
    out["sphere"] = abs(float(last["sphere"]) / (8 * math.pi) - 1)
    out["least"] = abs(float(last["least"]) / math.sqrt(2) - 1)
    return out


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each surface and form: errors of the force on each grid, and the order."""
    forces = datasets["willmore_force"].sortby("cells")
    cells = [int(c) for c in forces["cells"].values]
    header, table = ["surface", "form", *(f"error, N = {n}" for n in cells), "order"], []
    for surface in forces["surface"].values:
        for form in forces["form"].values:
            errors = [float(f"{float(e):.3g}") for e in forces["error"].sel(surface=surface, form=form)]
            table.append([str(surface), str(form), *errors, round(measured[f"order_{surface}_{form}"], 2)])
    return header, table
