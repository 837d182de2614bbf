"""Sections 1.4, 1.5: orders of smeared lengths in ε and Δx, of curves in space and of areas, beside geometric ones.

Errors are means of |found/exact - 1| over random turns (in the plane) and sub-cell shifts; box [-1, 1]³ in space.
"""

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import elliprg

from fsiwork.core.grid import Grid
from fsiwork.core.integrals import area_and_volume, length, line_integral, smeared
from fsiwork.studies.exact import ellipse_perimeter
from fsiwork.studies.integrals import AXES, sampled
from fsiwork.studies.orders import slope

KINDS, SCALINGS = ("cosine", "hat"), ("plain", "renormalised")
CURVES, SURFACES = ("ellipse", "circle", "helix"), ("sphere", "ellipsoid", "torus")
MEASURES = ("renormalised", "one-norm", "area", "volume")
CELLS = 4  # ε/Δx of the curves and of the renormalised areas
RADIUS, TILT, APART, PITCH = 0.7, 0.5, 0.35, 2.0  # curves
BALL, SEMI_AXES, TORUS = 0.61, (0.8, 0.6, 0.45), (0.6, 0.25)


def smeared_ellipse(eps: float, kind: str, scaling: str) -> float:
    """∫ D_ε|∇φ| dx for φ = x²/a² + y²/b² - 1, that is what the sum would be without its grid [length].

    In x = aρ cos θ, y = bρ sin θ; between the ends of the support, and the kink of the hat, Gauss's points in ρ.
    """
    theta = np.arange(720) * (2 * math.pi / 720)
    rate = 2 * np.hypot(np.cos(theta) / AXES[0], np.sin(theta) / AXES[1])  # |∇φ|/ρ
    x, w = np.polynomial.legendre.leggauss(24)
    total = np.zeros_like(theta)
    for sign in (-1, 1):
        reach = sign * eps
        end = np.sqrt(1 + reach + 0 * rate) if scaling == "plain" else 0.5 * reach * rate + np.hypot(1, eps * rate / 2)
        for t, weight in zip(0.5 * (x + 1), 0.5 * w, strict=True):
            rho = 1 + t * (end - 1)
            width = eps if scaling == "plain" else eps * rate * rho
            r = (rho**2 - 1) / width
            zeta = 0.5 * (1 + np.cos(math.pi * r)) if kind == "cosine" else 1 - abs(r)
            total += weight * abs(end - 1) * zeta / width * rate * rho * rho
    return float(total.sum() * (2 * math.pi / 720) * math.prod(AXES))


def widths(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """``error`` of the smeared length of an ellipse with ε = ``width`` Δx, ``limit``: the same without the grid."""
    kind, scaling, step = point["kind"], point["scaling"], float(point["step"])
    eps, exact = float(point["width"]) * step, ellipse_perimeter(*AXES)
    half = math.ceil((max(AXES) * (1 + eps) + eps) / step) + 2  # ρ ≤ 1 + ε/2, or 1 + ε/b: the whole support
    errors = []
    for turn, *shift in _random(point) * (2 * math.pi, step, step):
        grid = Grid((2 * half, 2 * half), step, tuple(s - half * step for s in shift))
        phi = grid.sample(partial(_quadratic, math.cos(turn), math.sin(turn)))
        errors.append(smeared(grid, phi, eps, kind, scaling) / exact - 1)
    limit = smeared_ellipse(eps, kind, scaling) / exact - 1
    return {"error": np.abs(errors).mean(), "limit": abs(limit), "n_cells": grid.n[0]}


def _quadratic(c: float, s: float, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return ((c * x + s * y) / AXES[0]) ** 2 + ((c * y - s * x) / AXES[1]) ** 2 - 1


def steps(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """``error`` of the length of the ellipse by the hat scaled with the 1-norm, ε = Δx = ``step``."""
    step, errors = float(point["step"]), []
    for turn, *shift in _random(point) * (2 * math.pi, step, step):
        grid, phi = sampled("quadratic", step, turn, tuple(shift))
        errors.append(length(grid, phi, "one-norm") / ellipse_perimeter(*AXES) - 1)
    return {"error": np.abs(errors).mean(), "n_cells": grid.n[0]}


def _random(point: dict[str, Any]) -> np.ndarray:
    """Three numbers in [0, 1) for each of the ``draws``."""
    return np.random.default_rng(int(point.get("seed", 1))).random((int(point["draws"]), 3))


def curve(name: str, x: list[np.ndarray]) -> tuple[tuple[np.ndarray, np.ndarray], float]:
    """φ¹, φ² of slopes near 1 and the exact length of their curve.

    ``ellipse``: of a cylinder and an inclined plane; ``circle``: of two spheres; ``helix``: two strands on a cylinder,
    one turn in the box.
    """
    square = x[0] ** 2 + x[1] ** 2
    if name == "ellipse":
        fields = (square - RADIUS**2) / (2 * RADIUS), (x[2] - TILT * x[0]) / math.hypot(1, TILT)
        return fields, ellipse_perimeter(RADIUS * math.hypot(1, TILT), RADIUS)
    if name == "circle":
        along = np.array([2, 1, 2]) / 3 * APART
        fields = [
            (sum((q - s * c) ** 2 for q, c in zip(x, along, strict=True)) - RADIUS**2) / (2 * RADIUS) for s in (-1, 1)
        ]
        return tuple(fields), 2 * math.pi * math.sqrt(RADIUS**2 - APART**2)
    k = 2 * math.pi / PITCH
    fields = (square - RADIUS**2) / (2 * RADIUS), x[1] * np.cos(k * x[2]) - x[0] * np.sin(k * x[2])
    return fields, 2 * math.hypot(2 * math.pi * RADIUS, PITCH)


def surface(name: str, x: list[np.ndarray]) -> tuple[np.ndarray, float, float]:
    """φ, exact area and volume of a sphere, an ellipsoid (φ no distance) and a torus."""
    if name == "sphere":
        distance = np.sqrt(sum(q**2 for q in x)) - BALL
        return distance, 4 * math.pi * BALL**2, 4 / 3 * math.pi * BALL**3
    if name == "ellipsoid":
        scaled = np.sqrt(sum((q / a) ** 2 for q, a in zip(x, SEMI_AXES, strict=True))) - 1
        pairs = [(SEMI_AXES[a] * SEMI_AXES[b]) ** 2 for a, b in ((0, 1), (0, 2), (1, 2))]
        return scaled, 4 * math.pi * float(elliprg(*pairs)), 4 / 3 * math.pi * math.prod(SEMI_AXES)
    distance = np.hypot(np.hypot(x[0], x[1]) - TORUS[0], x[2]) - TORUS[1]
    return distance, 4 * math.pi**2 * math.prod(TORUS), 2 * math.pi**2 * TORUS[0] * TORUS[1] ** 2


def _moved(cells: int, point: dict[str, Any]):
    """The grid, and coordinates of its nodes shifted by parts of a cell, a list for each draw."""
    grid = Grid((cells,) * 3, 2 / cells, (-1.0,) * 3)
    return grid, [[q - s for q, s in zip(grid.points(), shift, strict=True)] for shift in _random(point) * grid.h]


def curves(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """``error`` of the length of a ``curve`` by the line integral with ζ of a ``kind`` and ε = 4 Δx."""
    grid, places = _moved(int(point["cells"]), point)
    errors = []
    for x in places:
        phi, exact = curve(point["curve"], x)
        flat = tuple(np.broadcast_to(q, grid.shape).ravel() for q in phi)
        errors.append(line_integral(grid, flat, CELLS * grid.h, point["kind"]) / exact - 1)
    return {"error": np.abs(errors).mean(), "n_cells": grid.n[0]}


def surfaces(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Errors of the area of a ``surface``, smeared (``renormalised``: cosine, ε = 4 Δx; ``one-norm``: hat, ε = Δx) and
    geometric (``area``), and of the geometric ``volume``."""
    grid, places = _moved(int(point["cells"]), point)
    errors = []
    for x in places:
        phi, area, volume = surface(point["surface"], x)
        q = np.broadcast_to(phi, grid.shape).ravel()
        found = area_and_volume(grid, q)
        wide = smeared(grid, q, CELLS * grid.h, "cosine", "renormalised")
        narrow = smeared(grid, q, grid.h, "hat", "one-norm")
        errors.append([wide / area - 1, narrow / area - 1, found[0] / area - 1, found[1] / volume - 1])
    means = np.abs(errors).mean(axis=0)
    return dict(zip((m.replace("-", "_") for m in MEASURES), means, strict=True)) | {"n_cells": grid.n[0]}


def order(errors: xr.DataArray) -> float:
    """Least-squares order of errors over their one dimension: ``width``, ``step`` or ``cells``; NaN if one is none."""
    (name,) = errors.dims
    x = errors[name].values.astype(float)
    values = errors.values
    return slope(1 / x if name == "cells" else x, values) if (np.isfinite(values) & (values > 0)).all() else math.nan


def dirac_order(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Observed orders; ``grid``: how far the errors in ε are from those without a grid, largest part of them."""
    by_width, by_curve, by_surface = (datasets[f"dirac_{name}"] for name in ("widths", "curves", "surfaces"))
    out = {}
    for kind in KINDS:
        found = [order(by_width["error"].sel(kind=kind, scaling=scaling)) for scaling in SCALINGS]
        out |= {f"{kind}_order_{scaling}": q for scaling, q in zip(SCALINGS, found, strict=True)}
    out["grid"] = float(abs(by_width["error"] / by_width["limit"] - 1).max(skipna=False))
    out["one_norm_order"] = order(datasets["dirac_steps"]["error"])
    for name in CURVES:
        for kind in KINDS:
            out[f"{name}_order_{kind}"] = order(by_curve["error"].sel(curve=name, kind=kind))
    for name in SURFACES:
        for measure in (m.replace("-", "_") for m in MEASURES):
            out[f"{name}_order_{measure}"] = order(by_surface[measure].sel(surface=name))
        finest = by_surface.sel(surface=name).sel(cells=by_surface["cells"].max())
        out |= {f"{name}_area_finest": float(finest["area"]), f"{name}_volume_finest": float(finest["volume"])}
    return out


def rows_order(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each case: where, its coarsest and finest errors, and the order between."""
    by_width, by_curve, by_surface = (datasets[f"dirac_{name}"] for name in ("widths", "curves", "surfaces"))
    cases = [
        (f"length of an ellipse, {kind}, {scaling}", by_width["error"].sel(kind=kind, scaling=scaling))
        for kind in KINDS
        for scaling in SCALINGS
    ]
    cases.append(("length of an ellipse, hat, 1-norm, ε = Δx", datasets["dirac_steps"]["error"]))
    cases += [
        (f"length of a curve in space, {name}, {kind}, ε = {CELLS} Δx", by_curve["error"].sel(curve=name, kind=kind))
        for name in CURVES
        for kind in KINDS
    ]
    words = {
        "renormalised": f"area, {{}}, cosine, renormalised, ε = {CELLS} Δx",
        "one-norm": "area, {}, hat, 1-norm, ε = Δx",
        "area": "area, {}, height functions",
        "volume": "volume, {}, height functions",
    }
    for name in SURFACES:
        for measure, text in words.items():
            cases.append((text.format(name), by_surface[measure.replace("-", "_")].sel(surface=name)))
    names = {"width": "ε/Δx", "step": "Δx", "cells": "N"}
    rows = []
    for text, errors in cases:
        (axis,) = errors.dims
        line = errors.sortby(axis, ascending=axis == "cells")
        ends = [f"{names[axis]} = {float(line[axis][k]):g}: {float(line[k]):.3g}" for k in (0, -1)]
        rows.append([text, *ends, float(f"{order(errors):.4g}")])
    return ["quantity", "coarsest: relative error", "finest: relative error", "order"], rows
