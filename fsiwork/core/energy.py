"""The fluid's part of the energy law (3.23): kinetic energy, dissipation and the power that enters from outside."""

import numpy as np

from fsiwork.core.flow import Flow
from fsiwork.core.kernels import energy as kernels


def kinetic_energy(flow: Flow) -> float:
    """½∫ρ|u|² [mass length^(4-d)... of a box in d directions: mass velocity²]."""
    g = flow.grid
    start, n = g.rows()
    if flow.rho is None:
        total = flow.density * sum(kernels.squares(flow.u[a], start, n, g.strides[a]) for a in g.axes)
    else:
        total = sum(kernels.weighted_squares(flow.u[a], flow.rho, start, n, g.strides[a]) for a in g.axes)
    return 0.25 * g.cell_volume * float(total)


def dissipation(flow: Flow) -> float:
    """∫2μ|D(u)|² [energy/time]."""
    g = flow.grid
    start, n = g.rows()
    mu = flow.viscosity_field()
    total = sum(kernels.normal_strain(flow.u[a], mu, start, n, g.strides[a]) for a in g.axes)
    for a in g.axes:
        for b in range(a):
            total += kernels.shear_strain(flow.u[a], flow.u[b], mu, start, n, g.strides[a], g.strides[b])
    return float(total) * g.cell_volume / g.h**2


def power(flow: Flow) -> float:
    """Power of gravity, moving walls, inflow and outflow on the fluid [energy/time]."""
    g, total = flow.grid, 0.0
    start, n = g.rows()
    if flow.rho is not None:
        for a in g.axes:
            if flow.gravity[a]:
                q = kernels.weighted_sum(flow.u[a], flow.rho, start, n, g.strides[a])
                total += 0.5 * flow.gravity[a] * g.cell_volume * float(q)
    for a, pair in enumerate(flow.edges.sides):
        for high, side in enumerate(pair):
            if side.kind == "wall":
                total += _wall(flow, a, high)
            elif side.kind in ("inflow", "outflow"):
                total += _crossing(flow, a, high)
    return total


def _wall(flow: Flow, a: int, high: int) -> float:
    """∫ t·U over a moving wall: the traction μ(∂_a u_c + ∂_c u_a) times its velocity."""
    g, sign, total = flow.grid, (1.0 if high else -1.0), 0.0
    velocity = flow.edges.sides[a][high].velocity
    mu = flow.viscosity if flow.mu is None else float(np.take(g.inside(flow.mu), -1 if high else 0, axis=a).mean())
    for c in g.axes:
        if c == a or not velocity[c]:
            continue
        q = g.padded(flow.u[c])
        inner = np.take(q, g.shape[a] - 4 if high else 3, axis=a)
        ghost = np.take(q, g.shape[a] - 3 if high else 2, axis=a)
        strain = sign * ((ghost - inner) if high else (inner - ghost)) / g.h
        inside = tuple(slice(3, -3) for _ in range(g.dim - 1))
        total += mu * velocity[c] * float(strain[inside].sum()) * g.h ** (g.dim - 1)
    return total


def _crossing(flow: Flow, a: int, high: int) -> float:
    """Flux of p + ½ρ|u_n|² into the box through an open side."""
    g = flow.grid
    face = g.inside(flow.u[a], face=a)
    un = np.take(face, -1 if high else 0, axis=a)
    p = np.take(g.inside(flow.p), -1 if high else 0, axis=a)
    if flow.edges.sides[a][high].kind == "outflow":
        p = 0.0
    flux = (p + 0.5 * flow.density * un**2) * un
    return float((-flux if high else flux).sum()) * g.h ** (g.dim - 1)
