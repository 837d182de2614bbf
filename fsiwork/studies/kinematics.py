"""Chapter 2, identity by identity, with discrete fields: how far each is from holding, and how fast that goes to zero.

Everything refers to t = ``TIME`` and to the flow of `flowmap`. Maps come from trajectories (Runge–Kutta, order 4, steps
in proportion to the cells) or from the solver's own transport, gradients and rates from central differences over one
cell, integrals from midpoints of cells, faces and segments: an identity that holds is met with order 2.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.transport import Transport
from fsiwork.studies import flowmap as flow
from fsiwork.studies.flowmap import TIME, cofactor, determinant, interpolated, largest, shift, slopes, times
from fsiwork.studies.orders import observed_orders
from fsiwork.studies.reynolds import integrals, reynolds

IDENTITIES = {
    "inverse": ("2.2", "X(t, Y(x, t)) = x, Y by the solver's transport"),
    "forward": ("2.3", "∂ₜX = u(X, t)"),
    "backward": ("2.4", "∂ₜY + u·∇Y = 0"),
    "gradients": ("2.5", "∇_ξX = (∇_xY)⁻¹, Y by the solver's transport"),
    "jacobian": ("2.6", "∂ₜJ = J (div u)(X)"),
    "jacobian_eulerian": ("2.7", "∂ₜJ + u·∇J = J div u, J = 1/det ∇Y"),
    "volume": ("2.8", "∫f dx = ∫f(X) J dξ"),
    "surface": ("2.10", "∫f ds = ∫f(X) |Cof(∇X) n₀| ds₀"),
    "normal": ("2.11", "n = Cof(∇X) n₀ / |·|"),
    "flux": ("2.12", "∫σn ds = ∫σ(X) Cof(∇X) n₀ ds₀"),
    "curve": ("2.13", "∫f dl = ∫f(X) |∇X τ₀| dl₀"),
    "tangent": ("2.14", "τ = ∇X τ₀ / |·|"),
    "reynolds_volume": ("2.15", "d/dt ∫f dx = ∫∂ₜf + div(fu) dx"),
    "reynolds_surface": ("2.16", "d/dt ∫f ds = ∫∂ₜf + div(fu) − f (∇u n)·n ds"),
    "cofactor_rate": ("2.18", "∂ₜ∇X⁻ᵀ = −∇uᵀ∇X⁻ᵀ (sign corrected)"),
    "reynolds_curve": ("2.19", "d/dt ∫f dl = ∫∂ₜf + u·∇f + f (∇u τ)·τ dl (factor f corrected)"),
    "mass_eulerian": ("2.20", "∂ₜρ + div(ρu) = 0, ρ = ρ₀(Y) det ∇Y"),
    "mass_lagrangian": ("2.21", "∫ρ(X) J dξ = ∫ρ₀ dξ, ρ by finite volumes"),
    "density": ("2.22", "ρ(X) J = ρ₀, ρ by finite volumes"),
    "piola": ("2.28", "∫σn ds = ∫div_ξ(σ(X) Cof ∇X) dξ"),
}
"""Equation and statement of each identity. (2.18) and (2.19) as the errata have them."""
PRINTED = {"printed_2_18": "2.18", "printed_2_19": "2.19"}
STUDIES = {"plane": "kinematics_plane", "space": "kinematics_space"}


def lagrangian(d: int, cells: int) -> dict[str, float]:
    """(2.3), (2.6), (2.18): positions of the cells' centres at three times, one cell further than the box."""
    h = 1 / cells
    xi = flow.centres(d, cells, 1)
    before, x, after = (flow.carried(xi, 0.0, TIME + k * h, cells // 4) for k in (-1, 0, 1))
    inner = (slice(None), *(slice(1, -1),) * d)
    u = flow.velocity(x, TIME)[inner]
    low, here, high = (flow.gradient(q, d, h) for q in (before, x, after))
    rate = (determinant(high) - determinant(low)) / (2 * h)
    strain = slopes(lambda q: flow.velocity(q, TIME), x[inner], h)
    expansion = determinant(here) * np.trace(strain)
    turned = [cofactor(F) / determinant(F) for F in (low, here, high)]
    found, wanted = (turned[2] - turned[0]) / (2 * h), times(np.swapaxes(strain, 0, 1), turned[1])
    return {
        "forward": largest(((after - before) / (2 * h))[inner] - u, u),
        "jacobian": largest(rate - expansion, expansion),
        "cofactor_rate": largest(found + wanted, wanted),
        "printed_2_18": largest(found - wanted, wanted),
    }


def eulerian(d: int, cells: int) -> dict[str, float]:
    """(2.4), (2.7), (2.20): feet Y of the cells' centres at three times, two cells further than the box."""
    h, inner = 1 / cells, (slice(1, -1),) * d
    x = flow.centres(d, cells, 2)
    before, y, after = (flow.carried(x, TIME + k * h, 0.0, cells // 4) for k in (-1, 0, 1))
    u = flow.velocity(x, TIME)
    gradients = [flow.gradient(q, d, h) for q in (before, y, after)]
    rate = ((after - before) / (2 * h))[(slice(None), *inner)]
    moved = times(gradients[1], u[(slice(None), *inner)])
    jacobians = [1 / determinant(g) for g in gradients]
    middle = (slice(None), *(slice(2, -2),) * d)
    divergence = np.trace(slopes(lambda q: flow.velocity(q, TIME), x[middle], h))
    growth = jacobians[1][inner] * divergence
    carried = (u[middle] * flow.gradient(jacobians[1], d, h)).sum(0)
    masses = [flow.density(q[(slice(None), *inner)]) / J for q, J in zip((before, y, after), jacobians, strict=True)]
    outflow = np.trace(flow.gradient(masses[1] * u[(slice(None), *inner)], d, h))
    change = ((masses[2] - masses[0]) / (2 * h))[inner]
    return {
        "backward": largest(rate + moved, moved),
        "jacobian_eulerian": largest(((jacobians[2] - jacobians[0]) / (2 * h))[inner] + carried - growth, growth),
        "mass_eulerian": largest(change + outflow, outflow),
    }


def transported(d: int, cells: int) -> dict[str, float]:
    """(2.2), (2.5): the backward map by the solver's transport (linear upwind 5) against trajectories.

    The velocity is that of the middle of each step. Over the images of the middle half of the box along each axis.
    """
    h, steps = 1 / cells, cells
    grid = Grid((cells,) * d, h)
    edges = Edges(grid, ((Side("no-slip"), Side("no-slip")),) * d)
    y = [grid.sample(lambda *x, a=a: x[a]) for a in range(d)]
    transport = Transport(grid, edges, "upwind5")
    for k in range(steps):
        now = (k + 0.5) * TIME / steps
        u = [grid.sample(lambda *x, a=a, t=now: flow.component(x, t, a), face=a) for a in range(d)]
        transport.advance(y, u, TIME / steps)
    back = np.stack([grid.inside(q) for q in y])
    x = flow.centres(d, cells)
    xi, quarter = flow.centres(d, cells, 1), cells // 4
    deformation = flow.gradient(flow.carried(xi, 0.0, TIME, cells // 4), d, h)
    middle = (..., *(slice(quarter, -quarter),) * d)
    image = flow.carried(x[middle], 0.0, TIME, cells // 4)
    wrapped = np.pad(back, [(0, 0), *[(1, 1)] * d], mode="reflect", reflect_type="odd")
    product = times(interpolated(flow.gradient(wrapped, d, h), image), deformation[middle])
    unit = np.reshape(np.eye(d), (d, d) + (1,) * d)
    return {
        "inverse": largest((flow.carried(back, 0.0, TIME, cells // 4) - x)[middle], np.ones(1)),
        "gradients": largest(product - unit, unit),
    }


def masses(d: int, cells: int) -> dict[str, float]:
    """(2.21), (2.22): ρ by a conservative scheme on the grid, pulled back by trajectories."""
    h, quarter = 1 / cells, cells // 4
    first = flow.density(flow.centres(d, cells))
    rho = flow.conserved(first, TIME, cells)
    x = flow.carried(flow.centres(d, cells, 1), 0.0, TIME, cells // 4)
    middle = (..., *(slice(quarter, -quarter),) * d)
    pulled = (
        interpolated(rho, x[(slice(None), *(slice(1, -1),) * d)][middle]) * determinant(flow.gradient(x, d, h))[middle]
    )
    return {
        "mass_lagrangian": shift(float(first[middle].sum()), float(pulled.sum())),
        "density": largest(pulled - first[middle], first),
        "mass_drift": shift(float(first.sum()), float(rho.sum())),
    }


def identities(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Residuals of all ``IDENTITIES`` and of what is ``PRINTED`` in ``dimension`` 2 or 3 on ``cells``^d.

    Also ``mass_drift``, by how much the total mass of the conservative scheme changes: round-off. Raises ValueError for
    another dimension or cells that 4 does not divide.
    """
    d, cells = int(point["dimension"]), int(point["cells"])
    if d not in (2, 3) or cells % 4:
        raise ValueError(f"dimension must be 2 or 3 and cells a multiple of 4, got {d} and {cells}")
    out: dict[str, Any] = {"n_cells": cells}
    for part in (lagrangian, eulerian, transported, integrals, reynolds, masses):
        out |= part(d, cells)
    return out


def kinematics(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """The order of each identity between the two finest grids, the lower of plane and space; what is printed."""
    out: dict[str, float] = {}
    data = {place: datasets[name].sortby("cells") for place, name in STUDIES.items()}
    for key in IDENTITIES:
        for place, one in data.items():
            out[f"{key}_{place}"] = float(one[key][-1])
            out[f"order_{key}_{place}"] = float(observed_orders(1 / one["cells"], one[key])[-1])
        out[f"order_{key}"] = float(np.min([out[f"order_{key}_{place}"] for place in data]))
    out["lowest_order"] = float(np.min([out[f"order_{key}"] for key in IDENTITIES]))
    for key in PRINTED:
        out[key] = float(np.min([one[key].values.min() for one in data.values()]))
    out["mass_drift"] = float(np.max([one["mass_drift"].values.max() for one in data.values()]))
    return out


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each identity, then for each printed one that fails: orders and residuals on the finest grids."""
    finest = {place: int(datasets[name]["cells"].max()) for place, name in STUDIES.items()}
    header = ["equation", "identity"]
    header += [f"{what}, {cells} cells, {place}" for place, cells in finest.items() for what in ("order", "residual")]
    table: list[list] = []
    for key, (number, text) in IDENTITIES.items():
        found = ((measured[f"order_{key}_{place}"], measured[f"{key}_{place}"]) for place in finest)
        table.append([f"({number})", text, *(float(f"{q:.3g}") for pair in found for q in pair)])
    for key, number in PRINTED.items():
        errors = (float(datasets[name].sortby("cells")[key][-1]) for name in STUDIES.values())
        table.append([f"({number})", "as printed", *(q for e in errors for q in ("", float(f"{e:.3g}")))])
    return header, table
