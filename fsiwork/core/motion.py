"""A prescribed motion: the velocity on the faces as the discrete curl of a vector potential, so that div u = 0 exactly.

A field of velocity w(x) is a class with ``potential(c, *x)``, component c of A with w = curl A (in the plane A has the
component along z only, c = 2, and minus the stream function is its value), and ``velocity(*x)``, the same w in closed
form. A number instead of an array stands for a constant component.
"""

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from fsiwork.core.edges import Edges
from fsiwork.core.grid import GHOSTS, Grid

Vector = tuple[float, ...]
MARGIN = 1.02  # of the speed sampled on the faces over that between them, from 16 cells a wave on
COURANT = 0.5  # Δt Σ|u_a|/h


class Field(Protocol):
    """What a prescribed velocity is made from."""

    def potential(self, c: int, *x: np.ndarray) -> Any:
        """Component c of A [length²/time] at points."""

    def velocity(self, *x: np.ndarray) -> tuple[Any, ...]:
        """curl A [length/time] at points, one component a direction."""


@dataclass(frozen=True)
class Vortex:
    """The vortex of Figs 1.5 and 1.6 in the plane z = const of a box: u = -U sin²πξ sin 2πη, v = U (L_y/L_x) sin 2πξ
    sin²πη with ξ, η from 0 to 1 along x and y."""

    origin: Vector
    length: Vector
    speed: float = 1.0

    def _unit(self, x):
        return [np.pi * (x[a] - self.origin[a]) / self.length[a] for a in (0, 1)]

    def potential(self, c, *x):
        """See `Field.potential`."""
        a, b = self._unit(x)
        return -self.speed * self.length[1] / np.pi * (np.sin(a) * np.sin(b)) ** 2 if c == 2 else 0.0

    def velocity(self, *x):
        """See `Field.velocity`."""
        a, b = self._unit(x)
        u = -self.speed * np.sin(a) ** 2 * np.sin(2 * b)
        v = self.speed * self.length[1] / self.length[0] * np.sin(2 * a) * np.sin(b) ** 2
        return (u, v, 0.0)[: len(x)]


@dataclass(frozen=True)
class Rotation:
    """A rigid rotation about an axis along z: u = -Ω(y - c_y), v = Ω(x - c_x). Differences are exact on it."""

    centre: Vector
    rate: float

    def potential(self, c, *x):
        """See `Field.potential`."""
        return -0.5 * self.rate * sum((q - o) ** 2 for q, o in zip(x[:2], self.centre, strict=False)) if c == 2 else 0.0

    def velocity(self, *x):
        """See `Field.velocity`."""
        return (-self.rate * (x[1] - self.centre[1]), self.rate * (x[0] - self.centre[0]), 0.0)[: len(x)]


@dataclass(frozen=True)
class Translation:
    """One velocity everywhere."""

    speeds: Vector

    def potential(self, c, *x):
        """See `Field.potential`."""
        u, v, *w = self.speeds
        return (0.0, w[0] * x[0] if w else 0.0, u * x[1] - v * x[0])[c]

    def velocity(self, *x):
        """See `Field.velocity`."""
        return self.speeds


@dataclass(frozen=True)
class Deformation:
    """A strong deformation of a cubic box: in space the field of LeVeque and of Enright's test, in the plane the
    sixteen vortices of Smolarkiewicz; the largest velocity along x is 2 U and U. Lengths in units of the first side."""

    origin: Vector
    length: Vector
    speed: float = 1.0

    def _unit(self, x):
        return [np.pi * (q - o) / self.length[0] for q, o in zip(x, self.origin, strict=True)]

    def potential(self, c, *x):
        """See `Field.potential`."""
        scale, q = self.speed * self.length[0] / np.pi, self._unit(x)
        if len(x) == 2:
            return -0.25 * scale * np.sin(4 * q[0]) * np.cos(4 * q[1])
        if c == 0:
            return 0.0
        other = 3 - c  # A_y: sin 2πy sin²πz, A_z: sin²πy sin 2πz
        return (1 if c == 2 else -1) * scale * (np.sin(q[0]) * np.sin(q[other])) ** 2 * np.sin(2 * q[c])

    def velocity(self, *x):
        """See `Field.velocity`."""
        q, U = self._unit(x), self.speed
        if len(x) == 2:
            return U * np.sin(4 * q[0]) * np.sin(4 * q[1]), U * np.cos(4 * q[0]) * np.cos(4 * q[1])
        one, two = [np.sin(c) ** 2 for c in q], [np.sin(2 * c) for c in q]
        return (
            2 * U * one[0] * two[1] * two[2],
            -U * two[0] * one[1] * two[2],
            -U * two[0] * two[1] * one[2],
        )


def curl(grid: Grid, field: Field) -> list[np.ndarray]:
    """Velocity on the low faces, flat with ghosts, by differences of A along the edges of each face.

    Second order; its discrete divergence is zero up to rounding.
    """
    components = range(2, 3) if grid.dim == 2 else range(3)
    A = {c: _on_edges(grid, field, c) for c in components}

    def difference(c: int, b: int) -> np.ndarray | float:
        """∂_b A_c on the faces."""
        if c not in A or b >= grid.dim:
            return 0.0
        trimmed = tuple(slice(None) if a == b else slice(0, -1) for a in grid.axes)
        return np.diff(A[c][trimmed], axis=b) / grid.h

    pairs = [((a + 1) % 3, (a + 2) % 3) for a in grid.axes]
    return [np.ascontiguousarray(difference(c, b) - difference(b, c)).ravel() for b, c in pairs]


def _on_edges(grid: Grid, field: Field, c: int) -> np.ndarray:
    """A_c on the edges along c (nodes in the plane), one more point in each direction than the padded shape."""
    lines = [
        grid.origin[a] + (np.arange(-GHOSTS, k + GHOSTS + 1) + (0.5 if a == c else 0.0)) * grid.h
        for a, k in enumerate(grid.n)
    ]
    values = field.potential(c, *np.meshgrid(*lines, indexing="ij", sparse=True))
    return np.broadcast_to(values, [line.size for line in lines])


class Motion:
    """The velocity f(t) w(x), f = 1 or cos(πt/``period``), where a `Flow` would be.

    Over a step the velocity is its mean, w ∫f dt/Δt: as w alone decides where points go, this is no approximation,
    and after a ``period`` everything is back where it was.

    Attributes
    ----------
    t : time [time]
    u : velocity on the low faces, flat with ghosts: its mean between `begin` and `end`, else that of the moment
    """

    rho = mu = guess = None  # no fluid

    def __init__(self, grid: Grid, edges: Edges, field: Field, period: float | None = None):
        self.grid, self.edges, self.field, self.period = grid, edges, field, period
        self.t = 0.0
        self._w = curl(grid, field)
        self.u = [w.copy() for w in self._w]

    def begin(self, dt: float) -> None:
        """The velocity becomes its mean over [t, t + dt]."""
        if self.period:
            phase = math.pi / self.period
            # sin b - sin a without the loss of digits
            mean = 2 * math.cos(phase * (self.t + 0.5 * dt)) * math.sin(0.5 * phase * dt) / (phase * dt)
            self._scale(mean)

    def end(self, dt: float) -> None:
        """dt later, the velocity of the moment."""
        self.t += dt
        if self.period:
            self._scale(math.cos(math.pi * self.t / self.period))

    def _scale(self, factor: float) -> None:
        for u, w in zip(self.u, self._w, strict=True):
            np.multiply(w, factor, out=u)

    def longest_step(self) -> dict[str, float]:
        """``advective``: Δt with Δt Σ|u_a|/h = ½ where and when the speed is largest [time]."""
        speed = 0.0
        for a, w in enumerate(self._w):
            faces = np.abs(self.grid.inside(w, face=a))
            low, high = ([slice(None)] * self.grid.dim for _ in range(2))
            low[a], high[a] = slice(0, -1), slice(1, None)
            speed = speed + np.maximum(faces[tuple(low)], faces[tuple(high)])
        top = MARGIN * float(np.max(speed))
        return {"advective": COURANT * self.grid.h / top if top > 0.0 else math.inf}

    def largest(self, q: np.ndarray) -> float:
        """Largest absolute value of a flat field over the cells; NaN if there is one."""
        return float(np.abs(self.grid.inside(q)).max())

    def state(self) -> dict[str, np.ndarray]:
        """The time, from which the velocity follows."""
        return {"t": np.array(self.t)}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a `state`."""
        self.t = float(state["t"])
        self.end(0.0)
