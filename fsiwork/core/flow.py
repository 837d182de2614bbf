"""Incompressible Navier-Stokes on the staggered grid: predict, project; second order in space and time.

AB2 for advection, Crank-Nicolson for diffusion, incremental pressure with the rotational correction. What a body may
change between `begin` and `predict` are the slots ``rho``, ``mu``, ``force``, ``stiffness`` and ``bending_stiffness``
(the last counts for constant ρ only). With variable ρ or μ `core.mixture` does diffusion (backward Euler then, unless
explicit) and, if ρ varies, the projection; but where μ alone varies, up to `LAGGED` times or beside a stabiliser of
bending, the whole stress 2μD(u) is explicit and the implicit part keeps constant coefficients, those of the largest μ.
"""

import math

import numpy as np

from fsiwork.core.edges import Edges
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import flow as kernels
from fsiwork.core.mixture import Mixture, add_stress
from fsiwork.core.poisson import Direct, Lines
from fsiwork.core.spectral import Spectral

LINES_UP_TO = 4.0  # α/Δx² up to which the line factorisation serves (MEASURED-poisson 2); beyond it the exact solve
LAGGED = 10.0  # max μ/min μ up to which a step of constant coefficients serves: it lags so much more, and costs 1/12
ADVECTION = {"upwind5": 1.0, "central": 1.0, "none": 0.0}
THETA = {"explicit": 0.0, "implicit": 0.5, "backward-euler": 1.0}  # share of Δu at the new time


class Flow:
    """Velocity and pressure of one box.

    Parameters
    ----------
    grid, edges : where
    rho, mu : density [mass/length^d] and dynamic viscosity [mass length^(2-d)/time] of the fluid
    gravity : acceleration [length/time²], one number a direction
    advection : ``upwind5`` (linear upwind of order 5), ``central`` (keeps energy) or ``none`` (Stokes)
    diffusion : ``implicit`` (Crank-Nicolson), ``backward-euler`` (the book's (3.63): first order, damps more) or
        ``explicit`` (AB2)
    """

    def __init__(
        self, grid: Grid, edges: Edges, rho: float, mu: float, gravity=None, advection="upwind5", diffusion="implicit"
    ):
        self.grid, self.edges = grid, edges
        self.density, self.viscosity = float(rho), float(mu)
        self.gravity = tuple(gravity or (0.0,) * grid.dim)
        self.advection, self.theta = advection, THETA[diffusion]
        self.u = [grid.field() for _ in grid.axes]
        self.p, self.before = grid.field(), grid.field()
        self.dt_old = 0.0  # no history yet: the first step is Euler's
        self.guess: list[np.ndarray] | None = None  # velocity of the pass before, in iterated steps
        self.rho = self.mu = None  # None: constant
        self.stiffness = self.bending_stiffness = 0.0
        self._star = [grid.field() for _ in grid.axes]
        self._old = [grid.field() for _ in grid.axes]
        self._psi, self._minus_div = np.zeros(grid.n), np.zeros(grid.n)
        self._force = None
        self._constant = True  # the coefficients of this step's implicit part
        self._mixture: dict[str, np.ndarray] = {}
        self._mixed: Mixture | None = None
        self._solvers: dict = {}
        self._rows = [self._unknowns(c) for c in grid.axes]
        kernel = "central" if advection == "none" else advection
        self._momentum = getattr(kernels, f"momentum_{kernel}_{grid.dim}d")
        self._divergence = getattr(kernels, f"minus_divergence_{grid.dim}d")
        self.edges.fill_velocity(self.u)

    # --- slots that bodies fill -------------------------------------------------------------------------------
    @property
    def force(self) -> list[np.ndarray]:
        """Force per volume on the low faces, allocated when the first body asks, zero after `begin`."""
        if self._force is None:
            self._force = [self.grid.field() for _ in self.grid.axes]
        return self._force

    def mixture(self, name: str) -> np.ndarray:
        """The slot ``rho`` or ``mu`` as a flat centre field, the fluid's constant after `begin`."""
        if getattr(self, name) is None:
            setattr(self, name, self._uniform(name))
        return getattr(self, name)

    def viscosity_field(self) -> np.ndarray:
        """μ as a flat centre field, whether constant or not."""
        return self._uniform("mu") if self.mu is None else self.mu

    def density_field(self) -> np.ndarray:
        """ρ as a flat centre field, whether constant or not."""
        return self._uniform("rho") if self.rho is None else self.rho

    def _uniform(self, name: str) -> np.ndarray:
        q = self._mixture.get(name)
        if q is None:
            q = self._mixture[name] = self.grid.field()
        q.fill(self.density if name == "rho" else self.viscosity)
        return q

    # --- the step ---------------------------------------------------------------------------------------------
    def begin(self) -> None:
        """ρ, μ of the fluid; nothing acts yet."""
        self.rho = self.mu = None
        self.stiffness = self.bending_stiffness = 0.0
        for f in self._force or ():
            f.fill(0.0)

    def predict(self, dt: float) -> None:
        """u* of (3.63) without the new pressure: advection and forces at n, diffusion in increment form."""
        self.dt = dt
        largest = self._choose()
        if not self._constant:
            self._mixed = self._mixed or Mixture(self.grid, self.edges)
            self._mixed.prepare(self)
        elif self.mu is not None:
            for c in self.grid.axes:
                add_stress(self.grid, self.force[c], c, self.mu, self.u)
        kappa = self.theta * dt * largest / self.density + self.stiffness * dt**2
        implicit = kappa > 0.0 or self.bending_stiffness > 0.0 or (self.theta > 0.0 and not self._constant)
        for c in self.grid.axes:
            self._explicit_part(c, dt, increment=implicit)
        for c in self.grid.axes if implicit else ():
            if self._constant:
                self._implicit_part(c, kappa)
            else:
                self._mixed.increment(self, c, self._star[c])
        self.u, self._star = self._star, self.u
        self.edges.fill_velocity(self.u)
        self.dt_old, self._kappa = dt, kappa

    def project(self, dt: float) -> None:
        """Make the velocity solenoidal: div(Δt ∇ψ/ρ) = div u*, u = u* - Δt ∇ψ/ρ, p += ρψ - (κ/Δt) ρ div u*."""
        g = self.grid
        start, n = g.rows()
        self._divergence(self._minus_div.reshape(-1), *self.u, start, n, *g.strides, 1.0 / (g.h * dt))
        if self.rho is None:
            psi, weight = self._project_constant(dt), self.density
        else:
            psi, weight = self._mixed.project(self.u, self._minus_div, self._psi, dt), 1.0
        if self._constant:
            rows, gain = (psi.reshape(-1), self._minus_div.reshape(-1)), self._kappa * self.density
            kernels.update_pressure(self.p, self.before, *rows, start, n, weight, gain)
        else:
            self._mixed.update_pressure(self, psi, self._minus_div, weight)
        self.edges.fill_pressure(self.p)
        self.edges.fill_velocity(self.u, outflow=False)

    def pressure(self) -> np.ndarray:
        """Pressure at the time of the velocity (the projection's is half a step late), interior view, mean zero."""
        q = 1.5 * self.grid.inside(self.p) - 0.5 * self.grid.inside(self.before)
        return q - q.mean()

    def largest(self, q: np.ndarray) -> float:
        """Largest absolute value of a flat field over the cells; NaN if there is one."""
        start, n = self.grid.rows()
        return float(np.int64(kernels.largest(q.view(np.int64), start, n)).view(np.float64))

    def state(self) -> dict[str, np.ndarray]:
        """Copies of all that the next step reads."""
        fields = {f"u{c}": self.u[c] for c in self.grid.axes} | {f"old{c}": self._old[c] for c in self.grid.axes}
        fields |= {"p": self.p, "before": self.before, "psi": self._psi, "dt_old": np.array(self.dt_old)}
        return {name: q.copy() for name, q in fields.items()}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a `state`."""
        for c in self.grid.axes:
            self.u[c][:] = state[f"u{c}"]
            self._old[c][:] = state[f"old{c}"]
        self.p[:], self.before[:], self._psi[:] = state["p"], state["before"], state["psi"]
        self.dt_old = float(state["dt_old"])

    # --- parts ------------------------------------------------------------------------------------------------
    def _choose(self) -> float:
        """Choose between constant coefficients and `core.mixture`; the viscosity of the former's implicit part.

        θ Δt max(μ)Δ is at least half of Δt div 2μD for θ ≥ ½ where ∫2|D|² = ∫|∇u|², so any Δt and any contrast are
        stable; open sides, where it is not so, take it twice. The velocity lags by O((max μ - μ)Δt).
        """
        if self.mu is None:
            self._constant, largest = self.rho is None, self.viscosity
        else:
            mu = self.grid.inside(self.mu)
            largest = float(mu.max())
            open_sides = any(side.kind == "outflow" for pair in self.edges.sides for side in pair)
            mild = largest <= LAGGED * float(mu.min())
            self._constant = self.rho is None and (mild or self.bending_stiffness > 0.0)
            largest *= 2.0 if open_sides else 1.0
        return largest

    def _explicit_part(self, c: int, dt: float, increment: bool) -> None:
        g, h = self.grid, self.grid.h
        ratio = dt / self.dt_old if self.dt_old else 0.0
        constant = self._constant
        nu = self.viscosity / self.density if constant and self.mu is None else 0.0
        coefficients = (
            dt * (1.0 + 0.5 * ratio),
            -0.5 * dt * ratio,
            ADVECTION[self.advection] / h,
            0.0 if self.theta else nu / h**2,
            dt * nu / h**2 if self.theta else 0.0,
            dt / (self.density * h) if constant else 0.0,
            0.0 if self._force is None else dt / self.density if constant else dt,
            dt * self.gravity[c],
            0.0 if increment else 1.0,
        )
        others = [b for b in g.axes if b != c]
        carriers = [self.u[b] for b in others]
        strides = [g.strides[c], *(g.strides[b] for b in others)]
        force = self.u[c] if self._force is None else self._force[c]
        start, n = g.rows()
        self._momentum(
            self._star[c], self._old[c], self.u[c], *carriers, self.p, force, start, n, *strides, coefficients
        )

    def _implicit_part(self, c: int, kappa: float) -> None:
        """u* = u + (1 - κΔ + βΔ²)⁻¹ increment, on the faces inside; β = c_b Δt² of bodies that resist bending."""
        start, n, shape = self._rows[c]
        d = self._minus_div.reshape(-1)[: math.prod(shape)].reshape(shape)  # room that only `project` needs
        beta = self.bending_stiffness * self.dt**2
        if self.guess is not None:
            pull = -self.stiffness * (self.dt / self.grid.h) ** 2
            kernels.add_laplacian(self._star[c], self.u[c], self.guess[c], start, n, self.grid.strides, pull)
        kernels.gather(d.reshape(-1), self._star[c], start, n)
        if beta > 0.0:
            d = self._solver("spectral", c, shape).solve(d, 1.0, kappa, beta)
        elif self.stiffness == 0.0 and kappa <= LINES_UP_TO * self.grid.h**2:
            d = self._solver("lines", c, shape).solve(d, kappa)
        else:
            d = self._solver("exact", c, shape).solve(d, 1.0, kappa)
        kernels.scatter_sum(self._star[c], self.u[c], d.reshape(-1), start, n)

    def _project_constant(self, dt: float) -> np.ndarray:
        np.copyto(self._psi, self._minus_div)
        psi = self._solver("pressure").solve(self._psi)
        for c in self.grid.axes:
            self._correct(c, psi.reshape(-1), dt / self.grid.h)
        return psi

    def _correct(self, c: int, psi: np.ndarray, factor: float) -> None:
        g = self.grid
        periodic, n = self.edges.periodic(c), g.n
        start, row = g.rows()
        if c == g.dim - 1:
            kernels.correct_along(self.u[c], psi, start, row, factor, periodic)
        else:
            kernels.correct_across(self.u[c], psi, *self._neighbours(c), row, factor)
        for side in (0, 1):
            if self.edges.sides[c][side].kind == "outflow":
                face, sign = (n[c], -2.0) if side else (0, 2.0)
                inner = np.take(psi.reshape(n), -1 if side else 0, axis=c)
                u = np.take(g.inside(self.u[c], face=c), face, axis=c)
                self._plane(self.u[c], c, face)[...] = u - factor * sign * inner

    def _plane(self, q, a, index):
        view = self.grid.inside(q, face=a)
        return view[tuple(index if b == a else slice(None) for b in self.grid.axes)]

    def _neighbours(self, c: int):
        """Rows of faces across which ψ differs: padded starts, compact starts here and at the low neighbour."""
        key = ("neighbours", c)
        if key not in self._solvers:
            g = self.grid
            start, row = g.rows()
            here = np.arange(start.size).reshape(g.n[:-1])
            there = np.roll(here, 1, axis=c)
            keep = np.ones(here.shape, bool)
            if not self.edges.periodic(c):
                keep[tuple(0 if b == c else slice(None) for b in range(g.dim - 1))] = False
            self._solvers[key] = tuple(
                np.ascontiguousarray(q[keep.ravel()]) for q in (start, here.ravel() * row, there.ravel() * row)
            )
        return self._solvers[key]

    def _unknowns(self, c: int):
        """Flat starts, row length and shape of the unknown faces of component c (wall faces are given)."""
        g, periodic = self.grid, self.edges.periodic(c)
        first = [np.arange(GHOSTS + (a == c and not periodic), GHOSTS + k) for a, k in enumerate(g.n)]
        start = np.zeros((), np.int64)
        for index, s in zip(first[:-1], g.strides[:-1], strict=True):
            start = np.add.outer(start, index * s)
        return np.ascontiguousarray(start.ravel() + first[-1][0]), first[-1].size, tuple(x.size for x in first)

    def _solver(self, kind: str, c: int = 0, shape=None):
        """Solvers are planned at first use and kept."""
        key = (kind, c)
        if key not in self._solvers:
            g, e = self.grid, self.edges
            make = {
                "pressure": lambda: Direct(g.n, g.h, e.ends_pressure()),
                "exact": lambda: Direct(shape, g.h, e.ends_velocity(c)),
                "lines": lambda: Lines(shape, g.h, e.ends_velocity(c)),
                "spectral": lambda: Spectral(shape, g.h, e.ends_velocity(c)),
            }
            self._solvers[key] = make[kind]()
        return self._solvers[key]
