"""Table 1.1: the length of a randomly turned and shifted ellipse by nine measures, for its polynomial and its distance.

Conventions that reproduce the book's columns (measured, not printed): half-axes 1.5 and 0.75, φ = x²/a² + y²/b² - 1;
Smereka's columns are means of |relative error|, the column of renormalisation is |mean of the signed error|.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.core.grid import Grid
from fsiwork.core.integrals import METHODS, length, length_and_area
from fsiwork.core.shapes import Ellipsoid
from fsiwork.studies.exact import ellipse_perimeter
from fsiwork.studies.orders import observed_orders, slope

AXES = (1.5, 0.75)
BAND = 8  # Δx of true distance on each side of the line; the widest stencil reads three

BOOK_STEPS = (0.2, 0.1, 0.05, 0.025, 0.0125, 0.00625)
BOOK = {
    "smereka-1": (9.38e-3, 2.23e-3, 8.12e-4, 2.71e-4, 7.58e-5, 3.04e-5),
    "renormalised": (1.5e-1, 5e-3, 1.3e-3, 3e-4, 8e-5, 2e-5),
    "smereka-2": (2.68e-3, 5.49e-4, 1.32e-4, 2.90e-5, 7.79e-6, 1.84e-6),
}
"""Table 1.1 as printed, Δx from 0.2 down. The first number of renormalisation cannot be right (errata, Table 1.1)."""


def sampled(field: str, step: float, turn: float, shift: tuple[float, float]) -> tuple[Grid, np.ndarray]:
    """The ellipse turned by ``turn`` [rad] about the origin, on a grid moved by ``shift`` [length].

    ``field``: quadratic, or distance (exact within `BAND` Δx of the line, ± that beyond). Raises ValueError otherwise.
    """
    if field not in ("quadratic", "distance"):
        raise ValueError(f"field must be quadratic or distance, got {field!r}")
    half = math.ceil(max(AXES) / step) + 5
    grid = Grid((2 * half, 2 * half), step, (shift[0] - half * step, shift[1] - half * step))
    x, y = grid.points()
    c, s = math.cos(turn), math.sin(turn)
    along, across = c * x + s * y, c * y - s * x
    square = (along / AXES[0]) ** 2 + (across / AXES[1]) ** 2
    if field == "quadratic":
        return grid, (square - 1).ravel()
    scaled, reach = np.sqrt(square) - 1, BAND * step
    near = np.abs(scaled) * min(AXES) <= reach  # |scaled| min(a, b) ≤ distance ≤ |scaled| max(a, b)
    phi = np.where(scaled > 0, reach, -reach)
    phi[near] = Ellipsoid((0.0, 0.0), AXES).distance(along[near], across[near])
    return grid, phi.ravel()


def draws(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Relative errors of every measure at a ``step`` for a ``field`` over ``draws`` random turns and sub-cell shifts.

    Names: the method with ``_error`` (mean of absolute values), ``_signed`` (mean), ``_largest``; ``area`` likewise.
    The draws are the same for both fields.
    """
    step, count = float(point["step"]), int(point.get("draws", 2000))
    turns = np.random.default_rng(int(point.get("seed", 1)))
    exact = ellipse_perimeter(*AXES), math.pi * math.prod(AXES)
    errors = {name: np.empty(count) for name in (*METHODS, "area")}
    for k in range(count):
        turn, *shift = turns.random(3) * (2 * math.pi, step, step)
        grid, phi = sampled(point["field"], step, turn, tuple(shift))
        for name in METHODS:
            if name != "geometric":
                errors[name][k] = length(grid, phi, name) / exact[0] - 1
        both = length_and_area(grid, phi)
        errors["geometric"][k], errors["area"][k] = both[0] / exact[0] - 1, both[1] / exact[1] - 1
    out: dict[str, Any] = {"draws": count, "n_cells": grid.n[0]}
    for name, e in errors.items():
        short = name.replace("-", "_")
        out |= {f"{short}_error": np.abs(e).mean(), f"{short}_signed": e.mean(), f"{short}_largest": np.abs(e).max()}
    return out


def column(data: xr.Dataset, method: str, field: str = "quadratic", kind: str = "error") -> xr.DataArray:
    """The errors of a method over the steps, coarse to fine; ``kind``: error, signed or largest."""
    name = f"{method.replace('-', '_')}_{kind}"
    return data[name].sel(field=field).sortby("step", ascending=False)


def book_ratio(data: xr.Dataset, method: str, steps: tuple[float, ...]) -> float:
    """Largest relative deviation from the book's column at ``steps``; NaN when one of them was not computed."""
    errors = abs(column(data, method, kind="signed" if method == "renormalised" else "error"))
    printed = dict(zip(BOOK_STEPS, BOOK[method], strict=True))
    try:
        found = [float(errors.sel(step=h, method="nearest", tolerance=1e-9)) for h in steps]
    except KeyError:
        return math.nan
    return float(np.max([abs(e / printed[h] - 1) for e, h in zip(found, steps, strict=True)]))


def table_1_1(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """How far the columns are from the book's, orders of Towers' formulas, and the geometric length on the distance."""
    data = datasets["integrals"]
    steps = tuple(h for h in BOOK_STEPS if np.isclose(data["step"].values, h, rtol=1e-9).any())
    geometric = column(data, "geometric", "distance").sel(step=[0.1, 0.05, 0.025], method="nearest", tolerance=1e-9)
    at = {"field": "distance", "step": 0.05}
    out = {
        "draws": float(data["draws"].min()),
        "smereka_1": book_ratio(data, "smereka-1", steps),
        "smereka_2": book_ratio(data, "smereka-2", steps[1:]),
        "renormalised": book_ratio(data, "renormalised", BOOK_STEPS[1:4]),
        "renormalised_fine": book_ratio(data, "renormalised", BOOK_STEPS[4:]),
        "renormalised_coarsest": book_ratio(data, "renormalised", BOOK_STEPS[:1]),
        "geometric_order": float(observed_orders(geometric["step"], geometric).min()),
        "geometric_error": float(data["geometric_error"].sel(at)),
        "geometric_largest": float(data["geometric_largest"].sel(at)),
        "area_largest": float(data["area_largest"].sel(at)),
    }
    for method in ("towers-laplacian", "towers-gradient", "one-norm", "renormalised", "plain"):
        for field in ("quadratic", "distance"):
            errors = column(data, method, field)
            out[f"{method.replace('-', '_')}_order_{field}"] = slope(errors["step"], errors)
    return out


def rows_1_1(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """Table 1.1 with the book's columns beside ours, then the mean absolute error of every measure on both fields."""
    data = datasets["integrals"]
    header = ["Δx"]
    for name in BOOK:
        header += [f"{name}, book", f"{name}, here" + (" (|signed mean|)" if name == "renormalised" else "")]
    header += [f"{name}, {field}" for field in ("quadratic", "distance") for name in METHODS]
    rows = []
    for k, step in enumerate(BOOK_STEPS):
        if not np.isclose(data["step"].values, step, rtol=1e-9).any():
            continue
        at = {"step": step, "method": "nearest"}
        row: list[object] = [step]
        for name, printed in BOOK.items():
            kind = "signed" if name == "renormalised" else "error"
            row += [printed[k], _short(column(data, name, kind=kind).sel(**at))]
        row += [_short(column(data, name, field).sel(**at)) for field in ("quadratic", "distance") for name in METHODS]
        rows.append(row)
    return header, rows


def _short(value: xr.DataArray) -> float:
    return float(f"{abs(float(value)):.3g}")
