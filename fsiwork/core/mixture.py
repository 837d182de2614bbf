"""What variable density adds to the flow: 2μD(u) partly implicit, a pressure with the coefficient 1/ρ; the stress."""

import numpy as np

from fsiwork.core.edges import Edges
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import flow as flow_kernels
from fsiwork.core.kernels import mixture as kernels
from fsiwork.core.multigrid import Variable

NORMAL = 2.0  # factor of μ ∂_aδ_a along a in the implicit part: its true one
RTOL = 1e-8  # of the viscous increments: residual relative to ρ times the explicit increment (2-norm)


class Component:
    """The implicit problem of one component: where its coefficients lie, buffers, solver."""

    def __init__(self, grid: Grid, edges: Edges, c: int):
        first = [int(a == c and not edges.periodic(a)) for a in grid.axes]
        shape = [k - low for k, low in zip(grid.n, first, strict=True)]
        self.start, self.n = _rows(grid, first, shape)
        self.f, self.diagonal = np.zeros(shape), np.zeros(shape)
        self.faces, self.places = [], []
        for a in grid.axes:  # between neighbours along a: centres if a is the own direction, else edges
            low = [first[b] - (a == b == c) for b in grid.axes]
            counts = [k + (a == b) for b, k in enumerate(shape)]
            self.faces.append(np.zeros(counts))
            self.places.append(_rows(grid, low, counts))
        name = f"viscous increment of velocity component {c}"
        self.solver = Variable(shape, grid.h, edges.ends_velocity(c), RTOL, diagonal=True, name=name)


class Mixture:
    """Momentum and pressure of a fluid with variable ρ and μ; the flow is given to every verb.

    Momentum: for every component (ρ - Δt[∂_a(2μ∂_a) + Σ_b ∂_b(μ∂_b)] - c_s Δt² div ρ∇) δ = ρ Δt (everything at n), so
    the diagonal blocks of div 2μD are implicit (θ = 1) and the cross terms, in increment form, lag by a step: since
    the diagonal minus the cross terms is positive, this is stable for every Δt. (With the Laplacian's factor 1 in
    place of NORMAL only just: measured to wobble at Re ≪ 1 and density ratio 1e-3.)

    Pressure: -div(∇ψ/ρ) = -div u*/Δt, then p += ψ - (μ + ρ c_s Δt) div u*.

    Attributes
    ----------
    beta : 1/ρ on the low faces, flat face fields
    rho, mu : flat centre fields, those of the flow since `prepare`
    """

    def __init__(self, grid: Grid, edges: Edges):
        self.grid, self.edges = grid, edges
        self.beta = [grid.field() for _ in grid.axes]
        self.rho = self.mu = self.beta[0]
        self._psi = grid.field()
        self._scratch = self._still = None  # for iterated steps only
        self._components: dict[int, Component] = {}
        self._pressure: Variable | None = None

    def prepare(self, flow) -> None:
        """Turn force, viscosity and pressure at n into an acceleration on the faces, in ``flow.force``.

        The first step of a flow without pressure starts from the one that balances the forces, so that layers at
        rest stay at rest.
        """
        g, force = self.grid, flow.force
        self.rho, self.mu = flow.density_field(), flow.viscosity_field()
        start, n = g.rows()
        wide, m = g.rows(0, 1)
        for c in g.axes:
            kernels.inverse_density(self.beta[c], self.rho, wide, m, g.strides[c])
        if not flow.dt_old and not flow.p.any():
            self._balance(flow)
        for c in g.axes:
            add_stress(g, force[c], c, self.mu, flow.u)
            kernels.accelerate(force[c], flow.p, self.beta[c], start, n, g.strides[c], 1.0 / g.h)

    def increment(self, flow, c: int, out: np.ndarray) -> None:
        """``out``, flat: the explicit increment of component c goes in, uⁿ + δ comes out on the faces inside.

        Raises `NotConverged` when the solver misses RTOL."""
        g, (c_mu, c_rho) = self.grid, self._weights(flow)
        if c not in self._components:
            self._components[c] = Component(g, self.edges, c)
        it = self._components[c]
        if flow.guess is not None and c_rho:
            self._pull(flow, c, out, c_rho)
        kernels.momentum_balance(it.f.reshape(-1), it.diagonal.reshape(-1), out, self.beta[c], it.start, it.n)
        for a, faces, (start, n) in zip(g.axes, it.faces, it.places, strict=True):
            if a == c:
                kernels.centre_coefficients(faces.reshape(-1), self.mu, self.rho, start, n, NORMAL * c_mu, c_rho)
            else:
                strides = g.strides[c], g.strides[a]
                kernels.edge_coefficients(faces.reshape(-1), self.mu, self.rho, start, n, *strides, c_mu, c_rho)
        delta = it.solver.solve(it.faces, it.f, None, it.diagonal)
        flow_kernels.scatter_sum(out, flow.u[c], delta.reshape(-1), it.start, it.n)

    def project(self, u: list[np.ndarray], minus_div: np.ndarray, psi: np.ndarray, dt: float) -> np.ndarray:
        """u -= Δt ∇ψ/ρ, where -div(∇ψ/ρ) = ``minus_div`` = -div u*/Δt; ψ (compact) is the first guess, too."""
        g = self.grid
        psi[...] = self._solve(minus_div, psi)
        g.inside(self._psi)[...] = psi
        self.edges.fill_pressure(self._psi)
        wide, m = g.rows(0, 1)
        for c in g.axes:
            kernels.correct_weighted(u[c], self._psi, self.beta[c], wide, m, g.strides[c], dt / g.h)
        return psi

    def update_pressure(self, flow, psi: np.ndarray, minus_div: np.ndarray, weight: float) -> None:
        """p += weight ψ - (μ + ρ c_s Δt) div u*: the rotational form with what was implicit at each centre."""
        start, n = self.grid.rows()
        p, before = flow.p, flow.before
        gains = self._weights(flow)
        rows = psi.reshape(-1), minus_div.reshape(-1)
        kernels.update_pressure(p, before, *rows, self.mu, self.rho, start, n, weight, *gains)

    # --- parts ------------------------------------------------------------------------------------------------
    def _weights(self, flow) -> tuple[float, float]:
        """What μ and ρ are multiplied with in the implicit operator: Δt (0 if diffusion is explicit) and c_s Δt²."""
        return (flow.dt if flow.theta else 0.0), flow.stiffness * flow.dt**2

    def _solve(self, f: np.ndarray, guess: np.ndarray | None) -> np.ndarray:
        """-div(∇ψ/ρ) = f."""
        g = self.grid
        if self._pressure is None:
            self._pressure = Variable(g.n, g.h, self.edges.ends_pressure())
        return self._pressure.solve([g.inside(self.beta[c], face=c) for c in g.axes], f, guess)

    def _balance(self, flow) -> None:
        """p with div(∇p/ρ) = div(f/ρ + gravity) and without flow through the sides."""
        g, f = self.grid, np.zeros(self.grid.n)
        for c in g.axes:
            q = np.moveaxis(g.inside(flow.force[c] * self.beta[c] + flow.gravity[c], face=c), c, 0)
            for side, end, inner in ((0, 0, 1), (1, -1, -2)):
                if self.edges.periodic(c):
                    q[-1] = q[0]
                else:
                    q[end] = q[inner] if self.edges.sides[c][side].kind == "outflow" else 0.0
            f -= np.moveaxis(np.diff(q, axis=0), 0, c) / g.h
        if f.any():
            g.inside(flow.p)[...] = self._solve(f, None)
            self.edges.fill_pressure(flow.p)
            flow.before[:] = flow.p

    def _pull(self, flow, c, out, c_rho):
        """The stabiliser acts on the difference to the pass before: out -= c_s Δt² div(ρ∇(guess - u))/ρ."""
        g = self.grid
        start, n = g.rows()
        if self._scratch is None:
            self._scratch, self._still = g.field(), g.field()
        total = self._scratch
        total.fill(0.0)
        np.subtract(flow.guess[c], flow.u[c], out=self._psi)
        factor = -c_rho * g.h**-2
        kernels.add_viscous_normal(total, self._psi, self.rho, start, n, g.strides[c], 0.5 * factor)
        for b in g.axes:
            if b != c:
                strides = g.strides[c], g.strides[b]
                kernels.add_viscous_tangential(total, self._psi, self._still, self.rho, start, n, *strides, factor)
        total *= self.beta[c]
        out += total


def add_stress(grid: Grid, out: np.ndarray, c: int, mu: np.ndarray, u: list[np.ndarray]) -> None:
    """``out`` += (div 2μD(u))_c [force/volume] on the low faces of the box; flat fields with ghosts, μ at centres."""
    start, n = grid.rows()
    factor = grid.h**-2
    kernels.add_viscous_normal(out, u[c], mu, start, n, grid.strides[c], factor)
    for b in grid.axes:
        if b != c:
            kernels.add_viscous_tangential(out, u[c], u[b], mu, start, n, grid.strides[c], grid.strides[b], factor)


def _rows(grid: Grid, first: list[int], shape: list[int]) -> tuple[np.ndarray, int]:
    """Flat starts of the rows, and their length, of a box of indices from ``first`` on."""
    start = np.zeros((), np.int64)
    for low, k, s in zip(first[:-1], shape[:-1], grid.strides[:-1], strict=True):
        start = np.add.outer(start, (GHOSTS + low + np.arange(k)) * s)
    return np.ascontiguousarray(start.ravel() + GHOSTS + first[-1]), shape[-1]
