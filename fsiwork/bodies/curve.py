"""An elastic curve in space, where two level sets meet: it reacts to its change of length (3.4), (3.58)."""

from collections.abc import Callable, Sequence

import numpy as np

from fsiwork.bodies.backward import BackwardMap
from fsiwork.bodies.body import Body
from fsiwork.bodies.laws import Law, modulus
from fsiwork.core.edges import Edges
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import curve as kernels
from fsiwork.core.transport import Transport

Levels = Callable[..., Sequence[np.ndarray]]
COUPLINGS = ("explicit", "stabilised")
STABILISER = 0.35  # as of membranes
XYZ = "xyz"


class Curve(Body):
    """The curve φ¹ = φ² = 0; its stretch Z₃ is |w|, w = ∇φ¹ × ∇φ²; energy ∫ χ E(|w|) ε⁻² ζ(φ¹/ε) ζ(φ²/ε) (SPEC 8).

    The integral is over rest length: with |w₀| the first stretch, the weight |w₀(Y)|/J of the energy has gone into
    the scale of the fields. Each thread of the tube of width ε/√Z₃ around the curve has its own stretch.

    Parameters
    ----------
    grid, edges : where, in space
    levels : (x, y, z) -> (φ¹, φ²) or (φ¹, φ², χ), already multiplied so that |w| is the first stretch; χ from 0 to 1
        says how much of the material is there: a label that goes along and ends a curve
    law : E(r), see `bodies.laws`; energy per rest length, so that E' is a force
    eps : half-width ε of both D_ε [length], in units of the fields
    transport : what carries the fields or Y
    carry : ``field`` (the fields themselves) or ``map`` (Y, and the fields = levels(Y))
    coupling : ``explicit`` or ``stabilised``

    Attributes
    ----------
    levels : the two or three flat fields at centres
    map : the backward map, or None

    Raises
    ------
    ValueError : in the plane, or an unknown word
    """

    def __init__(
        self,
        grid: Grid,
        edges: Edges,
        levels: Levels,
        law: Law,
        eps: float,
        *,
        transport: Transport,
        carry: str = "field",
        coupling: str = "explicit",
    ):
        if grid.dim != 3:
            raise ValueError("a curve where two surfaces meet needs three directions")
        for name, value, known in (("carry", carry, ("field", "map")), ("coupling", coupling, COUPLINGS)):
            if value not in known:
                raise ValueError(f"{name} must be one of {', '.join(known)}, got {value!r}")
        self.grid, self.edges, self.transport, self.law = grid, edges, transport, law
        self.eps, self.coupling, self._levels = float(eps), coupling, levels
        self.map = BackwardMap(grid, edges, transport) if carry == "map" else None
        self.levels = [grid.field(transport.dtype) for _ in levels(*grid.points())]
        self._strides, self._nodes = np.array(grid.strides), np.zeros(4096, np.int64)
        self._around = None
        self._make()

    # --- verbs ------------------------------------------------------------------------------------------------
    def push(self, flow, dt: float) -> None:
        """Add F = div(E' τ⊗τ |w| D) = (∇E'·τ τ + E' H n) |w| D (3.58) to ``flow.force``, D = χ ε⁻² ζζ."""
        nodes, found, r, D = self._tube()
        weight = self.law.dE(r) * D / r
        w = found[kernels.W :]
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            kernels.pull(flow.force[a], a, b, c, w, weight, nodes, self._strides, self.grid.h)
        if self.coupling == "stabilised":
            flow.stiffness += STABILISER * self._peaks()[0] / flow.density

    def move(self, flow, dt: float) -> None:
        """Carry the fields, or Y and then the fields = levels(Y), with ``flow.u``."""
        if self.map:
            self.map.move(flow.u, dt)
            self._make()
        else:
            self.transport.advance(self.levels, flow.u, dt, "linear")
            self._around = None

    # --- answers ----------------------------------------------------------------------------------------------
    def longest_step(self, flow) -> dict[str, float]:
        """h √(ρ/2S) with the largest stress S = E' r ε⁻²: what (1.54) is without viscosity, where S = λ/ε; and with the
        tangential modulus. For the stabilised coupling four times as much, what a membrane may take."""
        names = ("elastic (1.54)", "elastic, tangential")
        if self.coupling == "stabilised":
            names = ("elastic, accuracy", "elastic, tangential, accuracy")
        share = 4.0 if self.coupling == "stabilised" else 1.0
        return {
            name: float(share * self.grid.h * np.sqrt(0.5 * flow.density / S)) if S > 0.0 else np.inf
            for name, S in zip(names, self._peaks(), strict=True)
        }

    def state(self) -> dict[str, np.ndarray]:
        """The fields or Y."""
        return {name: q.copy() for name, q in self.fields().items() if not self.map or name.startswith("Y")}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Take back a `state`."""
        for name, q in self.fields().items():
            if name in state:
                q[:] = state[name]
        self._make() if self.map else None
        self._around = None

    def fields(self) -> dict[str, np.ndarray]:
        """φ¹, φ² (and χ) as phi_1 …, and the components of Y; flat fields at centres."""
        Y = self.map.Y if self.map else ()
        found = {f"phi_{k + 1}": q for k, q in enumerate(self.levels)}
        return found | {f"Y_{XYZ[a]}": q for a, q in enumerate(Y)}

    def gauges(self, flow) -> dict[str, float]:
        """Length ∫|w| D (the mean over the tube of its threads' lengths), rest length ∫D, elastic energy, centroid,
        mean distance from the centroid (``radius``: that of a ring), extremes of the stretch in the tube."""
        nodes, _, r, D = self._tube()
        place = np.array(np.unravel_index(nodes, self.grid.shape)) - GHOSTS
        n = np.reshape(self.grid.n, (3, 1))
        # The trapezoidal rule over the nodes of the box; a periodic side is there twice, by halves.
        share = np.prod((place >= 0) * (place <= n) * np.where((place == 0) | (place == n), 0.5, 1.0), axis=0)
        part = share * D * self.grid.cell_volume
        x = place * self.grid.h + np.reshape(self.grid.origin, (3, 1))
        length = float(part @ r)
        centre = x @ (part * r) / length if length > 0.0 else np.full(3, np.nan)
        away = np.linalg.norm(x - centre[:, None], axis=0) @ (part * r)
        inside = r[share * D > 0.0]
        out = {"length": length, "rest_length": float(part.sum()), "elastic_energy": float(part @ self.law.E(r))}
        out |= {f"centroid_{XYZ[a]}": float(centre[a]) for a in range(3)}
        out["radius"] = float(away / length) if length > 0.0 else np.nan
        least, most = (float(inside.min()), float(inside.max())) if inside.size else (np.nan, np.nan)
        return out | {"stretch_min": least, "stretch_max": most}

    # --- parts ------------------------------------------------------------------------------------------------
    def _make(self) -> None:
        x = self.map.home() if self.map else self.grid.points()
        for q, values in zip(self.levels, self._levels(*x), strict=True):
            self.grid.padded(q)[...] = values
            self.edges.fill_scalar(q, "linear")
        self._around = None

    def _tube(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Flat nodes within ε, what `kernels.sample` finds there, r = |w| and χ ε⁻² ζζ; kept until the curve moves."""
        if self._around is None:
            g, s, (first, second) = self.grid, self._strides, self.levels[:2]
            start, n = g.rows(1, 2)
            while (count := kernels.find(self._nodes, first, second, start, n, s, self.eps)) > self._nodes.size:
                self._nodes = np.zeros(2 * count, np.int64)
            nodes = self._nodes[:count].copy()
            found = np.empty((5, count))
            kernels.sample(found, first, second, nodes, s, g.h)
            r = np.maximum(np.sqrt((found[kernels.W :] ** 2).sum(0)), 1e-30)
            D = np.prod(0.5 * (1.0 + np.cos(np.pi * found[: kernels.W] / self.eps)), axis=0) / self.eps**2
            if len(self.levels) == 3:
                label = np.empty(count)
                kernels.average(label, self.levels[2], nodes, s)
                D *= np.clip(label, 0.0, 1.0)
            self._around = nodes, found, r, D
        return self._around

    def _peaks(self) -> tuple[float, float]:
        """Largest E' r D and M(E' r, E'' r²) D, never negative."""
        _, _, r, D = self._tube()
        A, B = self.law.dE(r) * r, self.law.ddE(r) * r**2
        return float((A * D).max(initial=0.0)), float((modulus(A, B) * D).max(initial=0.0))


def ring(centre: tuple[float, ...], radius: float, axis: int, stretch: float) -> Levels:
    """Levels of a circle across ``axis`` [length]: distances from its plane and from its cylinder, times √stretch."""
    others, scale = [a for a in range(3) if a != axis], np.sqrt(stretch)

    def levels(*x):
        away = np.hypot(*(x[a] - centre[a] for a in others))
        return scale * (x[axis] - centre[axis]), scale * (away - radius)

    return levels


def fibre(root: tuple[float, ...], length: float, axis: int, stretch: float, eps: float) -> Levels:
    """Levels of a straight line from ``root`` along ``axis`` [length], and χ that falls to 0 over the tube's half-width
    around its end, and to the sides, 1.5 to 2.5 half-widths away, where levels may jump (periodic sides)."""
    others, scale = [a for a in range(3) if a != axis], np.sqrt(stretch)
    width = eps / scale

    def fall(r):
        return 0.5 * (1.0 + np.cos(np.pi * np.clip(r, 0.0, 1.0)))

    def levels(*x):
        p, q = (x[a] - root[a] for a in others)
        return (
            scale * p,
            scale * q,
            fall((x[axis] - root[axis] - length) / width + 0.5) * fall(np.hypot(p, q) / width - 1.5),
        )

    return levels
