"""An elastic membrane (or a drop) immersed in the fluid: it reacts to its change of area (Chapter 3)."""

from collections.abc import Callable

import numpy as np

from fsiwork.bodies.adjoint import Adjoint
from fsiwork.bodies.backward import BackwardMap, Rest
from fsiwork.bodies.band import Band
from fsiwork.bodies.bending import Bending
from fsiwork.bodies.body import Body
from fsiwork.bodies.inside import Inside
from fsiwork.bodies.laws import LINEAR, AtPoints, Law
from fsiwork.bodies.layers import Layers
from fsiwork.bodies.pull import Pull
from fsiwork.core.edges import Edges
from fsiwork.core.grid import Grid
from fsiwork.core.integrals import length_and_area
from fsiwork.core.kernels import interface as kernels
from fsiwork.core.poisson import Direct
from fsiwork.core.transport import Transport

COUPLINGS = ("explicit", "semi-implicit", "stabilised", "iterated")
STABILISER = {"stabilised": 0.35, "iterated": 0.5}  # c ≥ 1/4 in theory; measured stable (MEASURED-coupling 1)
BENDING_STABILISER = 0.25  # stable to 300 times the explicit step, .35 a third less accurate (MEASURED-coupling 6)
BENT_IN_TIME = 10.0  # a step this often the explicit limit of bending costs one percent (MEASURED-coupling 6)
IN_TIME = 4.0  # a step this often (1.54) costs about three percent of the oscillation where it is stable
PREDICTED_IN_TIME = 1.0  # the book's predictor: at twice that a membrane makes energy, or diverges if hardly stretched
XYZ = "xyz"
SUMS = [kernels.LENGTH, kernels.ENERGY, kernels.PULL]


class Membrane(Body):
    """Interface φ = 0, φ < 0 inside, whose stretch is |∇φ|; energy ∫E(|∇φ|) D_ε (SPEC 5).

    Parameters
    ----------
    grid, edges : where
    phi0 : distance(x, y[, z]) to the interface [length], or a flat field φ (already multiplied by the stretch)
    law : E(r), see `bodies.laws`
    eps : half-width ε of D_ε [length]
    transport : what carries φ or Y
    stretch : |∇φ₀|, first ratio of current to rest area; counts for a distance only
    form, dirac : see `bodies.pull`, or ``adjoint``, see `bodies.adjoint`, which needs ``upwind5`` and centring 2;
        ``auto``: normal-tangential and plain for surface tension, else divergence and renormalised
    coupling : ``explicit`` (3.59), ``semi-implicit`` (3.62)-(3.64), ``stabilised``, ``iterated``
    carry : ``field`` (φ) or ``map`` (the backward map Y, and φ = stretch · distance(Y)); a map needs a distance
    restart : of a map, see `backward.Rest`; Y is then that of the time since it started anew
    inside : density and viscosity inside, if they differ from the fluid's
    surface_mass : mass per rest area
    bending : modulus k of ½kH² [energy]; (3.2.4), see `bodies.bending`
    renew : moves of φ, or restarts of a map, after which the lines φ = c beside the interface are drawn anew, see
        `bodies.layers`; 0: never

    Attributes
    ----------
    phi : flat field at centres
    map : the backward map, or None
    passes : 2 for ``iterated``, else 1
    guess : `state` after the last pass of an iteration; while it is set, the force is taken there

    Raises
    ------
    ValueError : an unknown word, a map without a distance, or one that is to be renewed
    """

    def __init__(
        self,
        grid: Grid,
        edges: Edges,
        phi0: np.ndarray | Callable,
        law: Law,
        eps: float,
        *,
        transport: Transport,
        stretch: float = 1.0,
        form: str = "auto",
        dirac: str = "auto",
        coupling: str = "explicit",
        carry: str = "field",
        restart: float = np.inf,
        inside: tuple[float, float] | None = None,
        surface_mass: float = 0.0,
        bending: float = 0.0,
        renew: int = 0,
    ):
        self._check(phi0, dirac, coupling, carry, renew and restart == np.inf)
        matched = (transport.scheme, transport.centring, transport.dtype, carry) == ("upwind5", 2, np.float64, "field")
        if form == "adjoint" and not matched:
            raise ValueError("the form adjoint needs a float64 field carried by upwind5 with centring 2")
        self.grid, self.edges, self.transport, self.eps = grid, edges, transport, float(eps)
        self.coupling, self.inside, self.surface_mass = coupling, inside, float(surface_mass)
        self._law = AtPoints(law, grid)
        drop = self._law.kind == LINEAR
        form = ("normal-tangential" if drop else "divergence") if form == "auto" else form
        plain = form == "normal-tangential" or (form == "adjoint" and drop)
        dirac = ("plain" if plain else "renormalised") if dirac == "auto" else dirac
        smeared = self.eps, dirac == "renormalised"
        self._adjoint = Adjoint(grid, edges, self._law, *smeared) if form == "adjoint" else None
        self._pull = self._adjoint or Pull(grid, self._law, form, *smeared)
        self._bending = Bending(grid, bending, self.eps, dirac == "renormalised") if bending else None
        self.form, self.dirac, self.passes = form, dirac, 2 if coupling == "iterated" else 1
        self._distance, self._stretch = phi0, float(stretch)
        self.phi = grid.field(transport.dtype)
        self.map = BackwardMap(grid, edges, transport) if carry == "map" else None
        self._rest = Rest(self.map, self._from_distance, restart) if self.map else None
        if callable(phi0):
            grid.padded(self.phi)[...] = self._from_distance(*grid.points())
            edges.fill_scalar(self.phi, "linear")
        else:
            self.phi[:] = phi0
            edges.fill_scalar(self.phi, "linear")
        self._layers = Layers(grid, edges, self.eps, renew)
        self._plan()

    # --- verbs ------------------------------------------------------------------------------------------------
    def blend(self, flow, dt: float) -> None:
        """Mix ρ = ρ₁ + (ρ - ρ₁) H_ε + m D_ε (3.19) and μ likewise; with renormalised D_ε, H_ε(φ/|∇φ|), so that ε is
        the same length in both."""
        if self.inside is None and not self.surface_mass:
            return
        rho, mu = self.inside or (flow.density, flow.viscosity)
        if rho != flow.density or self.surface_mass:
            self._mix(flow.mixture("rho"), rho, self.surface_mass)
        if mu != flow.viscosity:
            self._mix(flow.mixture("mu"), mu, 0.0)

    def push(self, flow, dt: float) -> None:
        """Add F[φⁿ], F[φ̃] (3.63) or F[guess] to ``flow.force``; the stabilised couplings raise ``flow.stiffness``."""
        if self.coupling in STABILISER:
            peak = self.survey()[kernels.PEAK]
            flow.stiffness += STABILISER[self.coupling] * max(peak, 0.0) / self._least_density(flow)
            if self._bending:
                flow.bending_stiffness += BENDING_STABILISER * self._bending.stiffness(*self._slope(flow))
        if self.guess is None and self.coupling != "semi-implicit":
            phi, band = self.phi, self._band_now()
        else:
            phi = self.predict(flow, dt) if self.guess is None else self.guess["phi"]
            band = self._other = self._other or Band(self.grid, self.eps, self.dirac == "renormalised")
            band.find(phi)
        self._pull.add(flow.force, phi, band, *([flow.u] if self._adjoint else []))
        if self._bending:
            self._bending.add(flow.force, phi, band)

    def move(self, flow, dt: float) -> None:
        """Carry φ, or Y and then φ = φ₀(Y), with ``flow.u`` (3.64)."""
        if self.map:
            self.map.move(flow.u, dt)
            self._rest.level(self.phi)
        else:
            u = self._adjoint.filtered(flow.u) if self._adjoint else flow.u
            self.transport.advance([self.phi], u, dt, "linear")
            self._layers.moved(self.phi)
        self._fresh = False
        if self.map and self._rest.restart < np.inf and self._rest.wound(self._band_now().inside):
            self._layers.moved(self.phi)
            self._rest.begin(self.phi)
            self._fresh = False

    # --- answers ----------------------------------------------------------------------------------------------
    def explicit_limits(self, flow) -> dict[str, float]:
        """(1.54) with T = max r E'(r) in place of λ, and with the tangential modulus M(E'r, E''r²), which still
        limits a membrane that is hardly stretched; unit of both: time."""
        values = self.survey()
        names = {"elastic (1.54)": kernels.TENSION, "elastic, tangential": kernels.MODULUS}
        return {name: self._limit(flow, float(values[column])) for name, column in names.items()}

    def longest_step(self, flow) -> dict[str, float]:
        """Limits of the explicit coupling; for the others no sharp one is known, so what a few percent allow.

        The book's predictor smooths by the tension E': it serves a drop, where that is all the stiffness there is.
        """
        limits = self.explicit_limits(flow)
        bent = {"bending": self._bending.limit(*self._slope(flow))} if self._bending else {}
        if self.coupling == "explicit":
            return limits | bent
        if self.coupling in STABILISER and bent:
            bent = {"bending, accuracy": BENT_IN_TIME * bent["bending"]}
        drop_or_stabilised = self.coupling in STABILISER or self._law.kind == LINEAR
        often = IN_TIME if drop_or_stabilised else PREDICTED_IN_TIME
        return {"elastic, accuracy": often * min(limits.values())} | bent

    def potential(self) -> np.ndarray | None:
        """Of the adjoint form, see there."""
        return self._adjoint.potential(self.phi, self._band_now()) if self._adjoint else None

    def state(self) -> dict[str, np.ndarray]:
        """φ, and Y if it is carried, with its rest; how often φ has moved if that counts."""
        rest = self._rest.state() if self.map else {}
        return {name: q.copy() for name, q in self._named().items()} | self._layers.state() | rest

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Take back a `state`."""
        for name, q in self._named().items():
            q[:] = state[name]
        self._layers.restore(state)
        if self.map:
            self._rest.put_back(state)
        self._fresh = False

    def fields(self) -> dict[str, np.ndarray]:
        """φ and the components of Y, flat fields at centres."""
        return self._named()

    def gauges(self, flow) -> dict[str, float]:
        """Volume ∫1 - H_ε(φ) (kept by the flow), length (2D) or area (3D), elastic energy, centroid, half-extents
        along the lines through it, extremes of the stretch where D_ε > 0. These are smeared; in the plane also the
        length of φ = 0 and the area of φ < 0 by height functions (five percent of a step; in space they cost two)."""
        values, measure = self.survey(), "length" if self.grid.dim == 2 else "area"
        volume, centre = self._inside.volume(self.phi, self._band_now())
        out = {"volume": volume, measure: float(values[kernels.LENGTH])}
        stored = self._adjoint.energy(self.phi, self._band_now()) if self._adjoint else values[kernels.ENERGY]
        out |= {"elastic_energy": float(stored)}
        if self._bending:
            out["bending_energy"] = self._bending.energy(self.phi, self._band_now())
            out["elastic_energy"] += out["bending_energy"]
        for a in self.grid.axes:
            out[f"centroid_{XYZ[a]}"] = centre[a]
            out[f"axis_{XYZ[a]}"] = self._inside.half_extent(self.phi, centre, a) if volume > 0.0 else 0.0
        if self.grid.dim == 2:
            out["geometric_length"], out["geometric_volume"] = length_and_area(self.grid, self.phi)
        return out | {"stretch_min": float(values[kernels.LEAST]), "stretch_max": float(values[kernels.MOST])}

    def survey(self) -> np.ndarray:
        """Integrals and extremes over the band of φ, columns named in `core.kernels.interface`; kept until φ moves."""
        band, law = self._band_now(), self._law
        if self._values is None:
            runs = band.inside
            law.centres(self.phi, runs, band.cells_inside, self._s, every=True)
            if self._table.shape[0] < runs.shape[0]:
                self._table = np.zeros((2 * runs.shape[0], 8))
            table = self._table[: runs.shape[0]]
            kernels.survey(table, self.phi, runs, self._s, law.kind, self._pull.numbers, law.given)
            self._values = np.array([0.0, 0.0, np.nan, np.nan, 0.0, 0.0, 0.0, 0.0])
            if runs.shape[0] and table[:, kernels.MOST].max() > 0.0:
                self._values[:] = table.max(axis=0)
                self._values[SUMS] = table[:, SUMS].sum(axis=0) * self.grid.cell_volume
                self._values[kernels.LEAST] = table[:, kernels.LEAST].min()
        return self._values

    def predict(self, flow, dt: float) -> np.ndarray:
        """φ̃ of (3.62), flat: (φ̃ - φ)/Δt - c(Δt/ε)Δφ̃ = -u·∇φ, ∂_nφ̃ = 0 on walls, with c = max(E', 0)/ρ.

        E' is its mean over the interface: its maximum over the band grows with the noise at the band's edges.
        """
        g = self.grid
        if self._solver is None:
            ends = [("periodic",) * 2 if self.edges.periodic(a) else ("neumann",) * 2 for a in g.axes]
            self._solver, self._right, self._tilde = Direct(g.n, g.h, tuple(ends)), np.zeros(g.n), g.field()
        start, n = g.rows()
        for a, s in enumerate(g.strides):
            kernels.carry_along(self._right.ravel(), self.phi, flow.u[a], start, n, s, 0.25 * dt / g.h, a == 0)
        values = self.survey()
        tension = values[kernels.PULL] / values[kernels.LENGTH] if values[kernels.LENGTH] > 0.0 else 0.0
        c = max(float(tension), 0.0) / self._least_density(flow)
        smoothing = c * dt**2 / self.eps
        g.inside(self._tilde)[...] = self._solver.solve(self._right, 1.0, smoothing) if smoothing else self._right
        self.edges.fill_scalar(self._tilde, "mirror")
        return self._tilde

    # --- parts ------------------------------------------------------------------------------------------------
    def _check(self, phi0, dirac, coupling, carry, renew):
        for name, value, known in (
            ("dirac", dirac, ("auto", "plain", "renormalised")),
            ("coupling", coupling, COUPLINGS),
            ("carry", carry, ("field", "map")),
        ):
            if value not in known:
                raise ValueError(f"{name} must be one of {', '.join(known)}, got {value!r}")
        if carry == "map" and not callable(phi0):
            raise ValueError("a map needs a distance (function of coordinates), not a field")
        if carry == "map" and renew:
            raise ValueError("a map makes φ anew each step: nothing to renew without restart")

    def _plan(self):
        g = self.grid
        self._band = Band(g, self.eps, self.dirac == "renormalised")
        self._other = self._solver = None
        self._fresh, self._values, self._table = False, None, np.zeros((0, 8))
        self._s = np.array([*g.strides, 0][:3])
        self._inside = Inside(g, self.edges, self.eps)

    def _named(self) -> dict[str, np.ndarray]:
        Y = self.map.Y if self.map else ()
        return {"phi": self.phi} | {f"Y_{XYZ[a]}": q for a, q in enumerate(Y)}

    def _from_distance(self, *x):
        return self._stretch * self._distance(*x)

    def _band_now(self) -> Band:
        if not self._fresh:
            self._band.find(self.phi)
            self._fresh, self._values = True, None
        return self._band

    def _mix(self, q, inside, mass):
        band, (start, n) = self._band_now(), self.grid.rows()
        numbers = self._pull.numbers
        kernels.mix(q, self.phi, start, n, band.flags, band.row, self._s, numbers, float(inside), mass)
        self.edges.fill_scalar(q, "mirror")

    def _least_density(self, flow) -> float:
        return min(flow.density, self.inside[0]) if self.inside else flow.density

    def _slope(self, flow) -> tuple[float, float]:
        return float(np.nan_to_num(self.survey()[kernels.MOST], nan=1.0)), self._least_density(flow)

    def _limit(self, flow, T: float) -> float:
        """(1.54): με + √(μ²ε² + ½ λ ε Δx² ρ), over λ, with (2θ - 1)μ in place of μ: Crank-Nicolson gains nothing by
        viscosity. A mixture is solved with θ = 1."""
        if not T > 0.0:
            return np.inf
        mu = min(flow.viscosity, self.inside[1]) if self.inside else flow.viscosity
        theta = 1.0 if self.inside or self.surface_mass else flow.theta
        damping = max(2.0 * theta - 1.0, 0.0) * mu * self.eps
        root = np.sqrt(damping**2 + 0.5 * T * self._least_density(flow) * self.eps * self.grid.h**2)
        return float((damping + root) / T)
