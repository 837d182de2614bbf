"""An elastic curve carried by Lagrangian markers: the immersed boundary method of Peskin (3.1)-(3.8), the twin of a
membrane in the plane, with the same energy in the same fluid."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from fsiwork.bodies.body import Body
from fsiwork.bodies.laws import Law, modulus
from fsiwork.core.edges import Edges
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import delta as kernels

XYZ = "xyz"
EPS = 2.0  # half-width of δ in cells: its peak is that of D_ε with this ε


class Markers(Body):
    """A closed elastic curve; its discrete energy is Σ E(r) a/s₀ over the chords, r = s₀ × chord over first chord.

    Parameters
    ----------
    grid, edges : where
    X : first positions of the markers in their order, shape (m, d) [length]
    law : E(r), see `bodies.laws`
    stretch : first ratio s₀ of current to rest length, the same everywhere

    Attributes
    ----------
    X : positions now, not wrapped where the box is periodic
    rest : rest length of each chord, shape (m,) [length]

    Raises
    ------
    ValueError : fewer than three markers, or two of them at the same place
    """

    def __init__(self, grid: Grid, edges: Edges, X: np.ndarray, law: Law, stretch: float = 1.0):
        self.grid, self.law = grid, law
        self.X = np.array(X, float)
        if self.X.shape[0] < 3 or self.X.shape[1] != grid.dim:
            raise ValueError(f"at least three markers with {grid.dim} coordinates, got shape {self.X.shape}")
        self.rest = np.linalg.norm(self._chords(), axis=1) / float(stretch)
        if not self.rest.min() > 0.0:
            raise ValueError("two neighbouring markers are at the same place")
        self._strides = np.array(grid.strides)
        self._n = np.array([-n if edges.periodic(a) else n for a, n in enumerate(grid.n)])
        self._low = [
            np.array([grid.origin[a] + (0.0 if a == c else 0.5) * grid.h for a in grid.axes]) for c in grid.axes
        ]

    # --- verbs ------------------------------------------------------------------------------------------------
    def push(self, flow, dt: float) -> None:
        """Spread the tension's difference at each marker, T = E'(r), (3.8) into (3.4)."""
        chords = self._chords()
        lengths = np.linalg.norm(chords, axis=1)
        tension = (self.law.dE(lengths / self.rest) / lengths)[:, None] * chords
        force = tension - np.roll(tension, 1, axis=0)
        for c in self.grid.axes:
            kernels.spread(flow.force[c], self.X, np.ascontiguousarray(force[:, c]), *self._where(c))

    def move(self, flow, dt: float) -> None:
        """Carry the markers with the new velocity (3.6), (3.1): midpoint rule."""
        middle = self.X + 0.5 * dt * self._velocity(flow, self.X)
        self.X += dt * self._velocity(flow, middle)

    # --- answers ----------------------------------------------------------------------------------------------
    def longest_step(self, flow) -> dict[str, float]:
        """(1.54) without viscosity, for ε = 2 Δx, with the tension E'r and with the tangential modulus; in space with
        the same over ε, the stress of a tube."""
        r = np.linalg.norm(self._chords(), axis=1) / self.rest
        A, B = self.law.dE(r) * r, self.law.ddE(r) * r**2
        tops = {"elastic (1.54)": A.max(), "elastic, tangential": modulus(A, B).max()}
        h = self.grid.h
        heavy = 0.5 * flow.density * (EPS * h) ** (self.grid.dim - 1)
        return {name: float(np.sqrt(heavy / top) * h) if top > 0.0 else np.inf for name, top in tops.items()}

    def state(self) -> dict[str, np.ndarray]:
        """Positions and rest lengths."""
        return {"X": self.X.copy(), "rest": self.rest.copy()}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Take back a `state`."""
        self.X, self.rest = state["X"].copy(), state["rest"].copy()

    def gauges(self, flow) -> dict[str, float]:
        """Area inside (``volume``), centroid, half-extents along the lines through it, length, elastic energy, extremes
        of the stretch; the first three in the plane only, of the periodic cubic spline through the markers."""
        lengths = np.linalg.norm(self._chords(), axis=1)
        r = lengths / self.rest
        out = self._enclosed() if self.grid.dim == 2 else {}
        out |= {"length": float(lengths.sum()), "elastic_energy": float((self.law.E(r) * self.rest).sum())}
        return out | {"stretch_min": float(r.min()), "stretch_max": float(r.max())}

    # --- parts ------------------------------------------------------------------------------------------------
    def _chords(self) -> np.ndarray:
        return np.roll(self.X, -1, axis=0) - self.X

    def _where(self, c: int):
        return self._low[c], self.grid.h, self._n, self._strides, GHOSTS

    def _velocity(self, flow, X: np.ndarray) -> np.ndarray:
        out = np.empty_like(X)
        column = np.empty(X.shape[0])
        for c in self.grid.axes:
            kernels.collect(column, flow.u[c], X, *self._where(c))
            out[:, c] = column
        return out

    def _enclosed(self) -> dict[str, float]:
        names = ["volume", *(f"{kind}_{x}" for x in "xy" for kind in ("centroid", "axis"))]
        if not np.isfinite(self.X).all():
            return dict.fromkeys(names, np.nan)
        curve = CubicSpline(np.arange(self.X.shape[0] + 1), np.vstack([self.X, self.X[:1]]), bc_type="periodic")
        # Three Gauss points a piece: exact for the area of a cubic, and for the first moments to order seven.
        t = (np.arange(self.X.shape[0])[:, None] + 0.5 + np.array([-0.5, 0.0, 0.5]) * np.sqrt(0.6)).ravel()
        weight = np.tile([5 / 18, 8 / 18, 5 / 18], self.X.shape[0])
        (x, y), (dx, dy) = curve(t).T, curve(t, 1).T
        turn = 0.5 * (x * dy - y * dx) * weight
        area = turn.sum()
        centre = (weight * 0.5 * x**2 * dy).sum() / area, -(weight * 0.5 * y**2 * dx).sum() / area
        out = {"volume": abs(float(area)), "centroid_x": float(centre[0]), "centroid_y": float(centre[1])}
        for a, x in enumerate("xy"):
            cuts = [float(curve(t)[a]) for t in self._cuts(curve, 1 - a, centre[1 - a])]
            out[f"axis_{x}"] = 0.5 * (max(cuts) - min(cuts)) if cuts else 0.0
        return out

    def _cuts(self, curve: CubicSpline, a: int, level: float) -> list[float]:
        """Parameters at which coordinate ``a`` of the curve crosses a level, one for each change of sign at markers."""
        above = curve(curve.x)[:, a] >= level
        where = np.flatnonzero(above[1:] != above[:-1])
        return [brentq(lambda t: float(curve(t)[a]) - level, k, k + 1, xtol=1e-12) for k in where]


def outline(distance: Callable, bounds: tuple[tuple[float, float], ...], spacing: float) -> np.ndarray:
    """Points of the line ``distance(x, y)`` = 0, about ``spacing`` apart and evenly over its length, shape (m, 2).

    The shape must be star-shaped seen from the middle of its ``bounds``: one zero on each ray from there.

    Raises
    ------
    ValueError : it is not
    """
    middle = np.array([0.5 * (low + high) for low, high in bounds])
    far = np.hypot(*(high - low for low, high in bounds))

    def on(ray: np.ndarray) -> np.ndarray:
        steps = np.linspace(0.0, far, 257)
        values = np.broadcast_to(distance(*(middle[:, None] + ray[:, None] * steps)), steps.shape)
        if values[0] >= 0.0 or np.count_nonzero(np.diff(np.sign(values))) != 1:
            raise ValueError("markers need a shape that is star-shaped seen from the middle of its bounds")
        return middle + ray * brentq(lambda s: float(distance(*(middle + ray * s))), 0.0, far, xtol=1e-14)

    angle = np.linspace(0.0, 2.0 * np.pi, 513)
    rough = np.array([on(np.array([np.cos(a), np.sin(a)])) for a in angle[:-1]])
    rough = np.vstack([rough, rough[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rough, axis=0), axis=1))])
    m = max(int(np.ceil(along[-1] / spacing)), 3)
    even = CubicSpline(along, angle)(np.arange(m) * along[-1] / m)
    return np.array([on(np.array([np.cos(a), np.sin(a)])) for a in even])
