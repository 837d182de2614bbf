"""The sides of the box: what lies in the ghost layers of scalars and of the velocity."""

from dataclasses import dataclass

import numpy as np

from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels.edges import copy, extrapolate, put, reflect

KINDS = ("periodic", "no-slip", "free-slip", "symmetry", "wall", "inflow", "outflow")
HELD = ("no-slip", "wall", "inflow")  # the whole velocity is given


@dataclass(frozen=True)
class Side:
    """One side of the box. ``velocity`` [length/time] counts for a moving wall and an inflow (its peak).

    ``symmetry`` is free slip for the velocity, and what crosses it is its own mirror image.
    """

    kind: str
    velocity: tuple[float, ...] = ()
    profile: str = "uniform"  # of an inflow: uniform or parabolic

    def __post_init__(self):
        if self.kind not in KINDS:
            raise ValueError(f"a side is one of {', '.join(KINDS)}; got {self.kind!r}")


class Edges:
    """Ghost values for one grid; ``sides[a] = (low, high)`` for each direction a."""

    def __init__(self, grid: Grid, sides: tuple[tuple[Side, Side], ...]):
        self.grid, self.sides = grid, sides
        for a, (low, high) in enumerate(sides):
            if (low.kind == "periodic") != (high.kind == "periodic"):
                raise ValueError(f"direction {a}: both sides are periodic or none")
        self._lines = tuple(self._starts(a) for a in grid.axes)
        self._values = {
            (a, side, c): self._velocity(a, side, c) for a in grid.axes for side in (0, 1) for c in grid.axes
        }

    def periodic(self, a: int) -> bool:
        """Whether direction a is periodic."""
        return self.sides[a][0].kind == "periodic"

    def ends_pressure(self) -> tuple[tuple[str, str], ...]:
        """Ends of the pressure's Poisson problem in the words of `core.poisson`."""
        words = {"periodic": "periodic", "outflow": "dirichlet"}
        return tuple(tuple(words.get(side.kind, "neumann") for side in pair) for pair in self.sides)

    def ends_velocity(self, c: int) -> tuple[tuple[str, str], ...]:
        """Ends of the Helmholtz problem of an increment of component c (unknowns: the faces inside)."""
        ends = []
        for a, pair in enumerate(self.sides):
            held = "node" if a == c else "dirichlet"
            slip = "node" if a == c else "neumann"
            free = {"periodic": "periodic", "outflow": "neumann", "free-slip": slip, "symmetry": slip}
            ends.append(tuple(free.get(side.kind, held) for side in pair))
        return tuple(ends)

    def fill_scalar(self, q: np.ndarray, rule: str) -> None:
        """Fill the ghosts of a centre field: ``linear`` extrapolation or ``mirror`` (zero normal derivative).

        Linear but for inflow sides, which take the value of the first cell: a slope taken from within would decide
        what enters, drift, and bring φ < 0 out of nothing; so what stands at an inlet goes on coming in. At planes of
        symmetry it is mirror always.
        """
        for a, s in enumerate(self.grid.strides):
            line, n = self._lines[a], self.grid.n[a]
            if self.periodic(a):
                self._wrap(q, a)
            elif rule == "linear":
                for edge, step, side in ((0, -s, self.sides[a][0]), ((n - 1) * s, s, self.sides[a][1])):
                    if side.kind == "inflow":
                        for k in range(1, GHOSTS + 1):
                            copy(q, line, edge + k * step, edge, step, 1)
                    elif side.kind == "symmetry":
                        reflect(q, line, edge + step, edge, step, GHOSTS, 1.0, ZERO)
                    else:
                        extrapolate(q, line, edge, step, GHOSTS)
            else:
                reflect(q, line, -s, 0, -s, GHOSTS, 1.0, ZERO)
                reflect(q, line, n * s, (n - 1) * s, s, GHOSTS, 1.0, ZERO)

    def mirror(self, q: np.ndarray, odd: int | None = None) -> None:
        """Ghosts of a centre field beyond planes of symmetry alone: its image, across ``odd`` with other sign."""
        for a, s in enumerate(self.grid.strides):
            for side, (ghost, inner, step) in enumerate(((-s, 0, -s), (self.grid.n[a] * s, self._last(a), s))):
                if self.sides[a][side].kind == "symmetry":
                    reflect(q, self._lines[a], ghost, inner, step, GHOSTS, -1.0 if a == odd else 1.0, ZERO)

    def fill_pressure(self, q: np.ndarray) -> None:
        """Ghosts of the pressure: mirror, and zero on an outflow side."""
        self.fill_scalar(q, "mirror")
        for a, s in enumerate(self.grid.strides):
            for side, (ghost, inner, step) in enumerate(((-s, 0, -s), (self.grid.n[a] * s, self._last(a), s))):
                if self.sides[a][side].kind == "outflow":
                    reflect(q, self._lines[a], ghost, inner, step, GHOSTS, -1.0, ZERO)

    def fill_velocity(self, u: list[np.ndarray], outflow: bool = True) -> None:
        """Fill the boundary faces and ghosts of all components (flat face fields).

        ``outflow=False`` leaves the normal component on outflow faces as it is (after a projection).
        """
        for c, q in enumerate(u):
            for a in self.grid.axes:
                if self.periodic(a):
                    self._wrap(q, a)
                elif a == c:
                    self._fill_normal(q, a, outflow)
                else:
                    self._fill_tangential(q, a, c)

    def _fill_normal(self, q, a, outflow):
        line, s, n = self._lines[a], self.grid.strides[a], self.grid.n[a]
        for side, (face, step, count) in enumerate(((0, -s, GHOSTS), (n * s, s, GHOSTS - 1))):
            kind = self.sides[a][side].kind
            if kind == "outflow":
                if outflow:
                    copy(q, line, face, face - step, step, 1)
                reflect(q, line, face + step, face, 0, 1, 1.0, ZERO)
                for k in range(2, count + 1):
                    reflect(q, line, face + k * step, face, 0, 1, 1.0, ZERO)
            else:
                value = self._values[a, side, a]
                put(q, line, face, value)
                reflect(q, line, face + step, face - step, step, count, -1.0, value)

    def _fill_tangential(self, q, a, c):
        line, s = self._lines[a], self.grid.strides[a]
        for side, (ghost, inner, step) in enumerate(((-s, 0, -s), (self.grid.n[a] * s, self._last(a), s))):
            sign = -1.0 if self.sides[a][side].kind in HELD else 1.0
            reflect(q, line, ghost, inner, step, GHOSTS, sign, self._values[a, side, c])

    def _wrap(self, q, a):
        line, s, n = self._lines[a], self.grid.strides[a], self.grid.n[a]
        copy(q, line, -GHOSTS * s, (n - GHOSTS) * s, s, GHOSTS)
        copy(q, line, n * s, 0, s, GHOSTS)

    def _last(self, a):
        return (self.grid.n[a] - 1) * self.grid.strides[a]

    def _starts(self, a):
        """Flat index of cell 0 of every line along a, over the whole padded cross-section."""
        index = np.arange(self.grid.size).reshape(self.grid.shape)
        return np.ascontiguousarray(np.take(index, GHOSTS, axis=a).ravel())

    def _velocity(self, a, side, c):
        """Value of component c on a side, one number or one a line of the padded cross-section."""
        it = self.sides[a][side]
        if it.kind not in ("wall", "inflow") or not it.velocity:
            return ZERO
        peak = float(it.velocity[c])
        if it.profile != "parabolic":
            return np.array([peak])
        shape = np.ones(())
        for b in self.grid.axes:
            if b != a:
                low, length = self.grid.origin[b], self.grid.length[b]
                x = self.grid.points(c if c != a else None)[b].ravel() - low
                profile = np.maximum(4.0 * x * (length - x) / length**2, 0.0)
                shape = np.multiply.outer(shape, np.ones_like(profile) if self.periodic(b) else profile)
        return np.ascontiguousarray(peak * shape.ravel())


ZERO = np.zeros(1)
