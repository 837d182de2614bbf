"""The stretch of a membrane in a compressible flow (3.2.3, corrected): J|∇φ|/|∇φ₀(Y)| and the energy it carries.

The velocity is prescribed, u = (1 - r²)(-a x + c k×x): it compresses and winds what lies in r < 1, and its flow map
is known in closed form. φ and Y are carried by the solver's own transport, J = 1/det ∇Y.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.bodies.laws import Law, Linear, Quadratic
from fsiwork.core import levelset
from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.invariants import map_gradient
from fsiwork.core.transport import Transport
from fsiwork.studies.orders import slope

INWARD, TURN = 0.7, 1.5  # a and c [1/time]
SIDE, END = 0.8, 0.4  # half-side of the box [length], end [time]
COURANT, EPS = 0.25, 4.0  # ε in cells, the renormalised Dirac
LAWS = {"membrane": Quadratic(1.0), "tension": Linear(1.0)}


@dataclass(frozen=True)
class Ellipsoid:
    """φ₀, as a distance (equal axes) or as the quadratic, whose |∇φ₀| is not 1."""

    centre: tuple[float, ...]
    axes: tuple[float, ...]

    def level(self, *x: np.ndarray) -> np.ndarray:
        """φ₀ [length]; the quadratic has about unit slope."""
        square = sum(((q - c) / a) ** 2 for q, c, a in zip(x, self.centre, self.axes, strict=True))
        least = min(self.axes)
        return least * (np.sqrt(square) - 1 if self._round else 0.5 * (square - 1))

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """∇φ₀ at points, shape (m, d)."""
        y = (x - self.centre) / np.square(self.axes) * min(self.axes)
        return y / np.linalg.norm(y, axis=1)[:, None] if self._round else y

    def quadrature(self, n: int = 200) -> tuple[np.ndarray, np.ndarray]:
        """Points of the surface, shape (m, d), and their weights: spectral."""
        theta = 2 * math.pi * np.arange(n) / n
        if len(self.axes) == 2:
            unit, weight = np.stack([np.cos(theta), np.sin(theta)], axis=1), np.full(n, 2 * math.pi / n)
        else:
            z, w = np.polynomial.legendre.leggauss(n // 2)
            ring, height = np.sqrt(1 - z * z)[:, None], np.broadcast_to(z[:, None], (n // 2, n))
            unit = np.stack([ring * np.cos(theta), ring * np.sin(theta), height], axis=2).reshape(-1, 3)
            weight = np.repeat(w * 2 * math.pi / n, n)
        return self.centre + unit * self.axes, weight * np.prod(self.axes) * np.linalg.norm(unit / self.axes, axis=1)

    @property
    def _round(self) -> bool:
        return len(set(self.axes)) == 1


CASES = {
    "circle": Ellipsoid((0.2, 0.1), (0.45, 0.45)),
    "ellipse": Ellipsoid((0.2, 0.1), (0.5, 0.35)),
    "sphere": Ellipsoid((0.2, 0.1, 0.05), (0.45, 0.45, 0.45)),
    "ellipsoid": Ellipsoid((0.2, 0.1, 0.05), (0.5, 0.35, 0.42)),
}


def _across(x: np.ndarray) -> np.ndarray:
    """k×x."""
    out = np.zeros_like(x)
    out[:, 0], out[:, 1] = -x[:, 1], x[:, 0]
    return out


def velocity(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """u at points, shape (m, d), and ∇u, (∇u)_ij = ∂_j u_i."""
    fall, free = 1 - (x * x).sum(1), -INWARD * x + TURN * _across(x)
    linear = -INWARD * np.eye(x.shape[1])
    linear[1, 0], linear[0, 1] = TURN, -TURN
    return fall[:, None] * free, fall[:, None, None] * linear - 2 * free[:, :, None] * x[:, None, :]


def moved(x: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Where points of shape (m, d) are a time ``t`` later, and the gradient of that map; t < 0 gives Y.

    r² obeys the logistic equation, and the angle grows by c∫(1 - r²) = -(c/2a) log(r²/r₀²).
    """
    square, e = (x * x).sum(1), math.exp(-2 * INWARD * t)
    m = 1 + square * (e - 1)
    q, angle = np.sqrt(e / m), TURN * t + 0.5 * TURN / INWARD * np.log(m)
    turn = np.broadcast_to(np.eye(x.shape[1]), (x.shape[0], x.shape[1], x.shape[1])).copy()
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -turn[:, 1, 0]
    rate = ((e - 1) / m)[:, None]  # d log m / d r²
    change = -0.5 * x * rate + 0.5 * TURN / INWARD * _across(x) * rate
    inner = q[:, None, None] * (np.eye(x.shape[1]) + change[:, :, None] * 2 * x[:, None, :])
    return np.einsum("mij,mj->mi", turn, q[:, None] * x), turn @ inner


def stretch(F: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Ratio of the surface elements by a map of gradient F, of the element with this ``normal`` (any length): the root
    of the determinant of FᵀF in the tangent plane, shape (m,)."""
    n = normal / np.linalg.norm(normal, axis=1)[:, None]
    project = np.eye(n.shape[1]) - n[:, :, None] * n[:, None, :]
    tangent = F @ project
    return np.sqrt(np.linalg.det(tangent.transpose(0, 2, 1) @ tangent + n[:, :, None] * n[:, None, :]))


def exact_energy(shape: Ellipsoid, law: Law, t: float) -> float:
    """∫E(stretch) over the surface as it was at first."""
    x, weight = shape.quadrature()
    return float(weight @ law.E(stretch(moved(x, t)[1], shape.gradient(x))))


def carried(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Errors of the stretch and of the energies at `END` for a ``case`` on ``cells`` a side."""
    cells, shape = int(point["cells"]), CASES[point["case"]]
    dim = len(shape.axes)
    grid = Grid((cells,) * dim, 2 * SIDE / cells, (-SIDE,) * dim)
    edges = Edges(grid, ((Side("free-slip"),) * 2,) * dim)
    u = [grid.sample(lambda *x, a=a: _component(x, a), face=a) for a in grid.axes]
    phi, Y = grid.sample(shape.level), [grid.sample(lambda *x, a=a: x[a]) for a in grid.axes]
    steps = math.ceil(END * sum(float(np.abs(c).max()) for c in u) / (COURANT * grid.h))
    carry = Transport(grid, edges, "upwind5", "ssp-rk3")
    for _ in range(steps):
        carry.advance([phi, *Y], u, END / steps, "linear")
    return {"n_cells": cells, "n_steps": steps} | _errors(grid, shape, phi, Y)


def _component(x: tuple[np.ndarray, ...], a: int) -> np.ndarray:
    """u_a on an open mesh."""
    turned = (-x[1], x[0], 0.0)[a]
    return (1 - sum(q * q for q in x)) * (-INWARD * x[a] + TURN * turned)


def _errors(grid: Grid, shape: Ellipsoid, phi: np.ndarray, Y: list[np.ndarray]) -> dict[str, float]:
    slopes, start_n = levelset.gradient_norm(grid, phi), grid.rows()
    inside = np.add.outer(start_n[0], np.arange(start_n[1])).ravel()
    away = np.abs(phi[inside]) / slopes[inside]
    band = inside[away < EPS * grid.h]
    near = np.abs(phi[band]) < grid.h * slopes[band]
    lines = [np.ravel(line) for line in grid.points()]
    x = np.stack([q[k] for q, k in zip(lines, np.unravel_index(band, grid.shape), strict=True)], axis=1)
    J, slope0 = _changes(grid, shape, Y, band)
    found = J * slopes[band] / slope0
    back = moved(x, -END)[0]
    wanted = stretch(moved(back, END)[1], shape.gradient(back))
    out = {"error": _largest(found / wanted, near), "without_J": _largest(slopes[band] / slope0 / wanted, near)}
    out |= {"least": float(wanted[near].min()), "most": float(wanted[near].max()), "least_J": float(J[near].min())}
    D = levelset.dirac(phi, EPS * grid.h, scaling="renormalised", grid=grid)[band] * grid.cell_volume
    gradient = np.stack([q[band] for q in levelset.gradient(grid, phi)], axis=1)
    for name, law in LAWS.items():
        energy = exact_energy(shape, law, END)
        out[f"energy_{name}"] = float(abs((law.E(found) * slope0 / J * D).sum() / energy - 1))
        out[f"printed_{name}"] = float(abs((law.E(J * slopes[band]) * D).sum() / energy - 1))
        out[f"power_{name}"] = float(abs(_power(law, found, gradient, x, D) / _rate(shape, law) - 1))
    return out


def _changes(grid: Grid, shape: Ellipsoid, Y: list[np.ndarray], nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """J = 1/det ∇Y and |∇φ₀(Y)| at flat indices."""
    home = np.stack([q[nodes] for q in Y], axis=1)
    return 1 / np.linalg.det(map_gradient(grid, Y, nodes)), np.linalg.norm(shape.gradient(home), axis=1)


def _largest(ratio: np.ndarray, near: np.ndarray) -> float:
    return float(np.abs(ratio[near] - 1).max())


def _power(law: Law, found, gradient, x, D) -> float:
    """∫E'|∇φ|(I - nn):∇u D_ε, what the flow does against the force div(E'|∇φ|(I - nn)D_ε) [energy/time]."""
    size, du = np.linalg.norm(gradient, axis=1), velocity(x)[1]
    n = gradient / size[:, None]
    spread = np.einsum("maa->m", du) - np.einsum("ma,mab,mb->m", n, du, n)
    return float((law.dE(found) * size * spread * D).sum())


def _rate(shape: Ellipsoid, law: Law, tau: float = 1e-3) -> float:
    """d/dt of the exact energy at `END`, by differences of fourth order."""
    e = {k: exact_energy(shape, law, END + k * tau) for k in (-2, -1, 1, 2)}
    return (8 * (e[1] - e[-1]) - (e[2] - e[-2])) / (12 * tau)


def compressible_stretch(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Least orders of the stretch and of the energies; at the finest, largest errors of these and of the power,
    and the least by which the printed energy of a distance (weight 1), and a stretch without J, are off."""
    data = datasets["compressible_stretch"].sortby("cells")
    last, round_ = data.isel(cells=-1), [c for c in ("circle", "sphere") if c in data["case"].values]
    quantities = {"stretch": ["error"]} | {k: [f"{k}_{law}" for law in LAWS] for k in ("energy", "power")}
    out = {f"error_{name}": max(float(last[k].max(skipna=False)) for k in of) for name, of in quantities.items()}
    for name in ("stretch", "energy"):
        of = [data[k].sel(case=c) for k in quantities[name] for c in data["case"].values]
        out[f"order_{name}"] = min(slope(1 / data["cells"], errors) for errors in of)
    out["printed"] = min(float(last[f"printed_{law}"].sel(case=round_).min(skipna=False)) for law in LAWS)
    out["without_J"] = float(last["without_J"].min(skipna=False))
    return out


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each shape and grid: range of the stretch, errors of stretch, energies and power, printed energy."""
    data = datasets["compressible_stretch"].sortby("cells")
    names = ["error", "without_J", *(f"{k}_{law}" for k in ("energy", "printed", "power") for law in LAWS)]
    header = ["shape", "N", "stretch from", "to", "J from", *(name.replace("_", " ") for name in names)]
    table = []
    for case in data["case"].values:
        for n in data["cells"].values:
            one = data.sel(case=case, cells=n)
            ranges = [round(float(one[k]), 4) for k in ("least", "most", "least_J")]
            table.append([str(case), int(n), *ranges, *(float(f"{float(one[k]):.3g}") for k in names)])
    return header, table
