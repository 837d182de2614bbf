"""A closed membrane in space that reacts to its change of area and to shear (3.3), by the backward map Y."""

import numpy as np

from fsiwork.bodies.backward import BackwardMap
from fsiwork.bodies.band import Band
from fsiwork.bodies.body import Body
from fsiwork.bodies.inside import Inside
from fsiwork.core.edges import Edges
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import shear as kernels
from fsiwork.core.kernels import shear_points as points
from fsiwork.core.kernels import shear_survey as surveys
from fsiwork.core.transport import Transport

LAWS = {
    "quadratic": points.QUADRATIC,
    "linear": points.LINEAR,
    "neo-hookean": points.NEO_HOOKEAN,
    "skalak": points.SKALAK,
}
SKIN = 1.4  # half-width over ε of the weight that holds layers together
LIMIT = 2.8  # explicit limit over Δx√(ρε/M) (MEASURED-coupling 6)
COUPLINGS = ("explicit", "stabilised")
STABILISER = 0.25  # c, stable to 100 times the explicit step (MEASURED-coupling 6)
IN_TIME = 1.0  # the stabilised step over ε√(ρε/M), Δt√(cM/(ρε)) = ε/2, that costs five percent (MEASURED-coupling 6)
REFRESH, LOWER = 4, 0.95  # M of the stabiliser: looked at every so many steps, lowered by no more than this factor
XYZ = "xyz"


class ShearMembrane(Body):
    """A ball's surface with the energy ∫E(Z₁, Z₂) D_ε(φ)/J₀ dx, φ = |Y - centre| - radius at rest (SPEC 7).

    The force is minus the gradient by Y of the discrete energy at the nodes, Σ_q g_q ∂_iY_q with the very derivative of
    the transport; it goes through one filter (1, 2, 1)/4, and so does the velocity that carries Y: the pair stays
    adjoint, and no energy is made but by the time step.

    Parameters
    ----------
    grid, edges : where; three directions
    centre, radius : the sphere as it stands at t = 0 [length]
    law : ``quadratic`` E₁' = λ₁(Z₁ - 1), E₂' = λ₂(Z₂ - 1) (3.65); ``linear`` the same E₁, E₂' = λ₂ (shear modulus λ₂);
        ``neo-hookean`` ½λ₂(2Z₁Z₂ + Z₁⁻² - 3); ``skalak`` ¼λ₂(I₁² + 2I₁ - 2I₂) + ¼λ₁I₂², I₁ = 2Z₁Z₂ - 2, I₂ = Z₁² - 1
    area, shear : λ₁, λ₂ [energy per area at rest]
    volume : κ [energy per area at rest] of ½κ(J₀ det ∇Y - 1)², which a flow without divergence leaves at 0: it holds
        against the transport's errors of det ∇Y, by which the discrete energy of a membrane under tension can fall
    slip : κ_s [energy per area at rest] of ½κ_s tan²θ, θ the angle between n and the image of the normal at rest: the
        layers of the band do not slide freely over each other, as they do by SPEC 7, where the middle ones bear all of
        the force; the band becomes a shell, whose resistance to bending goes with ε². Its weight S_ε is D of half-width
        `SKIN` ε, so that the edges of the band are held too
    eps : half-width ε of the plain D_ε, in lengths at rest
    twist : t₀ of (3.67) [angle/length], about the axis through the centre along z
    inflation : radius at t = 0 over that at rest; J₀ is its cube
    alike : twist by t₀ radius z/|x| in place of t₀ z: the same on the sphere, and all layers of the band are then
        strained as the sphere is; with (3.67) itself those outside are strained more
    coupling : ``explicit``, or ``stabilised`` by c M/(ρε) Δt²Δ at the new time in the predictor, as a safety net:
        steps beyond the explicit limit are stable, and inaccurate at once

    Attributes
    ----------
    map, phi : the backward map and φ(Y), flat fields at centres

    Raises
    ------
    ValueError : not three directions, an unknown law or coupling, or a twist in a box that is periodic along x, y or z
    """

    def __init__(
        self, grid: Grid, edges: Edges, centre, radius: float, law: str, area: float, shear: float, eps: float,
        *, volume: float = 0.0, slip: float = 0.0, twist: float = 0.0, inflation: float = 1.0, alike: bool = False,
        coupling: str = "explicit",
    ):  # fmt: skip
        if grid.dim != 3:
            raise ValueError(f"a membrane with shear needs three directions, got {grid.dim}")
        if law not in LAWS:
            raise ValueError(f"law must be one of {', '.join(LAWS)}, got {law!r}")
        if coupling not in COUPLINGS:
            raise ValueError(f"coupling must be one of {', '.join(COUPLINGS)}, got {coupling!r}")
        if (twist or inflation != 1.0) and any(edges.periodic(a) for a in grid.axes):
            raise ValueError("a membrane with pre-stress needs a box with walls: its Y is not periodic")
        self.grid, self.edges, self.eps, self.inflation = grid, edges, float(eps), float(inflation)
        self.weight, self._law, self.coupling = self.inflation**-3, LAWS[law], coupling
        self._held = np.zeros(2)  # M of the stabiliser, and the steps since it was looked at
        self._rest = float(radius) / self.inflation
        self._centre = np.array(centre, float)
        self._skin = SKIN * self.eps if slip else self.eps
        moduli = float(area), float(shear), float(volume), float(slip)
        self._numbers = np.array([grid.h, self.eps, self._rest, self.weight, *moduli, self._skin])
        self._period = np.array([grid.length[a] if edges.periodic(a) else 0.0 for a in grid.axes])
        self.map = BackwardMap(grid, edges, Transport(grid, edges, "upwind5", centring=2))
        if twist or inflation != 1.0:
            self._strain(float(twist), float(radius) if alike else 0.0)
        self._plan()

    # --- verbs ------------------------------------------------------------------------------------------------
    def push(self, flow, dt: float) -> None:
        """Add the force to ``flow.force``; the stabilised coupling raises ``flow.stiffness``."""
        if self.coupling == "stabilised":
            flow.stiffness += STABILISER * self._modulus() / (flow.density * self.eps)
        g, (x, y, _) = self.grid, self.grid.strides
        gradient, band = self.gradient(), self._band_now()
        for a, s in enumerate(g.strides):
            kernels.smooth(self._face, flow.u[a], *g.rows(0, 1), x, y, 0.0)
            self._q.fill(0.0)
            kernels.pulls(self._q, *gradient, *self.map.Y, self._face, band.runs, s, g.h)
            self.edges.fill_scalar(self._q, "mirror")
            kernels.to_faces(self._face, self._q, *g.rows(1, 1), s)
            kernels.smooth(flow.force[a], self._face, *g.rows(), x, y, 1.0)

    def move(self, flow, dt: float) -> None:
        """Carry Y with the filtered new velocity."""
        x, y, _ = self.grid.strides
        for a in self.grid.axes:
            kernels.smooth(self._u[a], flow.u[a], *self.grid.rows(0, 1), x, y, 0.0)
        self.map.move(self._u, dt)
        self._fresh = False

    # --- answers ----------------------------------------------------------------------------------------------
    def gradient(self) -> list[np.ndarray]:
        """Derivatives of the energy over Δx³ by the components of Y, flat centre fields; valid until the next call."""
        band = self._band_now()
        for q in self._g:
            q.fill(0.0)
        kernels.stress(self._P, *self.map.Y, band.runs, self._s, self._numbers, self._law, self._centre, self._period)
        kernels.gradients(*self._g, self._P, band.runs, self._s, self.grid.h)
        return self._g

    def potential(self) -> np.ndarray:
        """D_ε E + S_ε E_s + n·Tn, filtered as the force is: of the force, ∇(D_ε E + S_ε E_s) + div T, what is a
        gradient. Without it the pressure is that of SPEC 7, div(ΣE_i'Z_iC_iD_ε) alone."""
        g, band, (x, y, z) = self.grid, self._band_now(), self.grid.strides
        nodes, q = g.field(), g.field()
        surveys.densities(nodes, *self.map.Y, band.runs, self._s, self._numbers, self._law, self._centre, self._period)
        m = g.size - x - y - z
        q[:m] = 0.125 * sum(nodes[k : k + m] for k in (0, x, y, z, x + y, x + z, y + z, x + y + z))
        self.edges.fill_scalar(q, "mirror")
        kernels.smooth(self._q, q, *g.rows(), x, y, 0.0)
        return g.inside(self._q).copy()

    def longest_step(self, flow) -> dict[str, float]:
        """2.8 Δx √(ρε/M), M the largest modulus of small waves over the band; of the stabilised coupling, for which
        no limit is known, ε √(ρε/M)."""
        top = float(self.survey()[surveys.STIFF])
        name, length = "elastic, shear", LIMIT * self.grid.h
        if self.coupling == "stabilised":
            name, length = "elastic, shear, accuracy", IN_TIME * self.eps
        return {name: float(length * np.sqrt(flow.density * self.eps / top)) if top > 0.0 else np.inf}

    def state(self) -> dict[str, np.ndarray]:
        """Y, and what the stabiliser remembers."""
        held = {"held": self._held.copy()} if self.coupling == "stabilised" else {}
        return {f"Y_{XYZ[a]}": q.copy() for a, q in enumerate(self.map.Y)} | held

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Take back a `state`."""
        for a, q in enumerate(self.map.Y):
            q[:] = state[f"Y_{XYZ[a]}"]
        if self.coupling == "stabilised":
            self._held[:] = state["held"]
        self._fresh = False

    def fields(self) -> dict[str, np.ndarray]:
        """φ and the components of Y, flat fields at centres."""
        self._band_now()
        return {"phi": self.phi} | {f"Y_{XYZ[a]}": q for a, q in enumerate(self.map.Y)}

    def gauges(self, flow) -> dict[str, float]:
        """Volume, area, elastic energy, centroid, half-extents along the lines through it; over the band: extremes of
        Z₁, Z₂ and the least J₀ det ∇Y; the mean of Z₂ - 1 over the surface (``shear_mean``), and both norms (3.68) of
        J₀ det ∇Y - 1 (``rms_box``, ``rms_surface``)."""
        values, g = self.survey(), self.grid
        volume, centre = self._inside.volume(self.phi, self._band)
        out = {"volume": volume, "area": float(values[surveys.AREA]), "elastic_energy": float(values[surveys.ENERGY])}
        for a in g.axes:
            out[f"centroid_{XYZ[a]}"] = centre[a]
            out[f"axis_{XYZ[a]}"] = self._inside.half_extent(self.phi, centre, a) if volume > 0.0 else 0.0
        names = {"Z1_min": surveys.LEAST1, "Z1_max": surveys.MOST1, "Z2_min": surveys.LEAST2, "Z2_max": surveys.MOST2}
        out |= {name: float(values[k]) for name, k in names.items()} | {"det_min": float(values[surveys.LEAST_DET])}
        area = values[surveys.AREA] or np.nan
        out["shear_mean"] = float(values[surveys.SHEARED] / area)
        out["rms_surface"] = float(np.sqrt(values[surveys.SQUARES] / area))
        surveys.determinants(self._row, *self.map.Y, *g.rows(), *g.strides[:2], g.h, self.weight)
        return out | {"rms_box": float(np.sqrt(self._row.mean() / g.n[-1]))}

    def survey(self) -> np.ndarray:
        """Integrals and extremes over the band, columns named in `core.kernels.shear_survey`; kept until Y moves."""
        band = self._band_now()
        if self._values is None:
            table = np.zeros((band.inside.shape[0], 10))
            where = self._numbers, self._law, self._centre, self._period
            surveys.survey(table, *self.map.Y, band.inside, self._s, *where)
            values = table.max(axis=0, initial=-np.inf)
            least = [surveys.LEAST_DET, surveys.LEAST1, surveys.LEAST2]
            values[least] = table[:, least].min(axis=0, initial=np.inf)
            values[: surveys.SUMS] = table[:, : surveys.SUMS].sum(axis=0) * self.grid.cell_volume
            self._values = values
        return self._values

    # --- parts ------------------------------------------------------------------------------------------------
    def _modulus(self) -> float:
        """M of the stabiliser: raised as soon as it is looked at, every `REFRESH` steps, but lowered slowly."""
        top, since = self._held
        if since == 0:
            top = max(float(self.survey()[surveys.STIFF]), LOWER * top)
        self._held[:] = top, (since + 1) % REFRESH
        return float(top)

    def _strain(self, twist: float, radius: float) -> None:
        """Y(x, 0) by (3.67), over the inflation; with a ``radius`` all layers alike."""
        x, y, z = self.grid.points()
        x, y, z = (q - c for q, c in zip((x, y, z), self._centre, strict=True))
        height = radius * z / np.sqrt(np.maximum(x**2 + y**2 + z**2, points.TINY)) if radius else z
        cos, sin = np.cos(twist * height), np.sin(twist * height)
        for q, c, values in zip(self.map.Y, self._centre, (x * cos + y * sin, y * cos - x * sin, z), strict=True):
            self.grid.padded(q)[...] = c + values / self.inflation

    def _plan(self):
        g = self.grid
        self._P = np.zeros((12, g.size))  # pages that the band never touches cost nothing
        self._g = self._u = [g.field() for _ in g.axes]  # the gradient has served when Y moves
        self._face = g.field()
        self._q, self.phi = g.field(), g.field()
        self._band, self._inside = Band(g, self._skin, False), Inside(g, self.edges, self.eps)
        self._s, self._row = np.array(g.strides), np.zeros(g.rows()[0].size)
        self._fresh, self._values = False, None

    def _band_now(self) -> Band:
        if not self._fresh:
            surveys.distances(self.phi, *self.map.Y, self._centre, self._period, self._rest)
            self._band.find(self.phi)
            self._fresh, self._values = True, None
        return self._band
