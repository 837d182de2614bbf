"""Pressure across the membrane, Figs 3.13 and 3.14: the jump against the local balance of the run's own geometry.

A membrane with energy E(s) per rest length has the tension E'(s) per present length, so that the sharp balance is

    p_in - p_out = E'(s) H - [2μ n·Dn],        [q] = q_out - q_in,   s = |∇φ| and H on the interface.

SPEC 12 prints s E'(s) in place of E'(s). At rest that gives 0.449490 λ, against the 0.367007 λ of the same table, which
E'(s)/R = λ(s - 1)/R with s = 1.224745, R = 0.612372 does give.

The layer where the force acts has half-width ε. The jump is taken between the two sides of it: on a line through the
centre, p is fitted by a straight line over 1.5 ε … 2 ε from the interface inside and outside, both are extended to the
interface, and their difference there is the jump; 2μ n·Dn likewise from the velocity.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import RectBivariateSpline
from scipy.optimize import brentq

from fsiwork.studies.histories import spec

NEAR, FAR = 1.5, 2.0  # where p is taken, in ε from the interface
ALONG = {"x": 0, "y": 1}


class Line(NamedTuple):
    """What is found on a line from the centre outwards along an axis, where it meets the interface."""

    position: float  # of the interface [length]
    stretch: float  # |∇φ|
    curvature: float  # H [1/length]
    jump: float  # p_in - p_out, extended from both sides
    balance: float  # E'(s) H - [2μ n·Dn]
    viscous: float  # [2μ n·Dn]
    fits: tuple[np.ndarray, np.ndarray]  # lines a (r - position) + b fitted to p inside and outside


def frame(data: xr.Dataset, t: float) -> xr.Dataset:
    """The fields at time ``t`` of a study without axes; raises ValueError when there is no frame within 1e-6 of it."""
    found = data.sel(t=t, method="nearest")
    if abs(float(found["t"]) - t) > 1e-6:
        raise ValueError(f"no frame at t={t:g}; the nearest is at {float(found['t']):g}")
    return found


def surface(field: xr.DataArray) -> RectBivariateSpline:
    """Bicubic spline q(x, y) through a field with dims (y, x)."""
    y, x = (field[dim].values for dim in field.dims)
    return RectBivariateSpline(x, y, field.values.T, kx=3, ky=3)


def along(spline: RectBivariateSpline, axis: str, centre: tuple[float, float], r: np.ndarray, derivative: int = 0):
    """Values (or a derivative along ``axis``) at coordinate ``r`` on the line through ``centre`` along ``axis``."""
    r = np.asarray(r, float)
    at = [np.full_like(r, c) for c in centre]
    at[ALONG[axis]] = r
    order = {"dx" if axis == "x" else "dy": derivative}
    return spline.ev(*at, **order)


def crossing(phi: RectBivariateSpline, axis: str, centre: tuple[float, float], end: float) -> float:
    """Coordinate of the first zero of φ outwards from ``centre``; raises ValueError if none is before ``end``."""
    r = np.linspace(centre[ALONG[axis]], end, 2001)
    values = along(phi, axis, centre, r)
    if values[0] >= 0 or not (values > 0).any():
        raise ValueError(f"no interface along {axis}")
    k = int(np.argmax(values > 0))
    return float(brentq(lambda q: float(along(phi, axis, centre, q)), r[k - 1], r[k]))


def curvature(phi: RectBivariateSpline, axis: str, centre: tuple[float, float], end: float, reach: float) -> float:
    """H of the interface where the line meets it: quartic fitted to the contour over ± ``reach`` across the line."""
    offsets = np.linspace(-reach, reach, 31)
    other = 1 - ALONG[axis]
    points = []
    for offset in offsets:
        moved = list(centre)
        moved[other] += offset
        points.append(crossing(phi, axis, tuple(moved), end))
    fit = np.polynomial.Polynomial.fit(offsets, points, 4).convert().coef
    return float(-2 * fit[2] / (1 + fit[1] ** 2) ** 1.5)


def across(data: xr.Dataset, t: float, axis: str) -> Line:
    """Jump and balance on the line through the centre of the box along ``axis`` ("x": y = 1) at time ``t``.

    ``data``: a study without axes with the fields p, phi, u, v (without u, v the viscous part is taken as zero).
    """
    made, now = spec(data), frame(data, t)
    body, fluid, length = made["bodies"][0], made["fluid"], made["box"]["length"]
    eps, mu = _width(body, made), float(fluid["viscosity"])
    centre = (0.5 * length[0], 0.5 * length[1])
    p, phi = surface(now["p"]), surface(now["phi"])
    end = float(now["p"]["x_c" if axis == "x" else "y_c"][-1])
    position = crossing(phi, axis, centre, end)
    gradient = phi.ev(*_at(axis, centre, position), dx=1), phi.ev(*_at(axis, centre, position), dy=1)
    stretch = math.hypot(*map(float, gradient))
    bend = curvature(phi, axis, centre, end, eps)
    inside, outside = (_fit(p, axis, centre, position, side * eps) for side in (-1, 1))
    viscous = 0.0
    if "u" in now and "v" in now:
        speed = surface(now["u" if axis == "x" else "v"])
        normal = [2 * mu * _fit(speed, axis, centre, position, side * eps, 1)[1] for side in (1, -1)]
        viscous = float(normal[0] - normal[1])
    tension = _tension(body["energy"], stretch)
    jump = float(inside[1] - outside[1])
    return Line(position, stretch, bend, jump, tension * bend - viscous, viscous, (inside, outside))


def _at(axis: str, centre: tuple[float, float], r: float) -> tuple[float, float]:
    return (r, centre[1]) if axis == "x" else (centre[0], r)


def _fit(q: RectBivariateSpline, axis: str, centre, position: float, side: float, derivative: int = 0) -> np.ndarray:
    """Slope and value at the interface of the straight line through q over 1.5 … 2 |side| beyond ``position``."""
    r = np.linspace(NEAR, FAR, 41) * side
    return np.polyfit(r, along(q, axis, centre, position + r, derivative), 1)


def _width(body: dict[str, Any], made: dict[str, Any]) -> float:
    width = body["width"]
    if width.get("length") is not None:
        return float(width["length"])
    return float(width["cells"]) * max(made["box"]["length"]) / made["box"]["cells"]


def _tension(energy: dict[str, Any], stretch: float) -> float:
    """E'(s) of the laws (3.13)."""
    return float(energy["stiffness"]) * (stretch - 1 if energy["kind"] == "quadratic" else 1.0)


def _measures(line: Line, axis: str) -> dict[str, float]:
    return {
        f"jump_over_balance_{axis}": line.jump / line.balance,
        f"jump_{axis}": line.jump,
        f"balance_{axis}": line.balance,
        f"viscous_{axis}": line.viscous,
        f"stretch_{axis}": line.stretch,
        f"curvature_{axis}": line.curvature,
        f"printed_balance_ratio_{axis}": line.jump / (line.stretch * (line.balance + line.viscous) - line.viscous),
    }


def fig_3_13(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Jump over local balance at t = 0.4 where the interface crosses x = 1 (``_y``) and y = 1 (``_x``).

    ``printed_balance_ratio_*`` is the jump over the balance with s E'(s) as SPEC 12 prints it.
    """
    moving = datasets["pressure_moving"]
    return {k: v for axis in ("x", "y") for k, v in _measures(across(moving, 0.4, axis), axis).items()}


def fig_3_14(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """The same along y = 1, and the jump at rest, t = 20, over λ; exact: 0.367007."""
    rest = across(datasets["pressure_rest"], 20.0, "x")
    stiffness = float(spec(datasets["pressure_rest"])["bodies"][0]["energy"]["stiffness"])
    return _measures(across(datasets["pressure_moving"], 0.4, "x"), "x") | {
        "rest_jump": rest.jump / stiffness,
        "rest_jump_over_balance": rest.jump / rest.balance,
    }
