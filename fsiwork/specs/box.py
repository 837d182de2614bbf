"""The box: its size, its cells, what happens at its sides."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, WrapValidator

from fsiwork.specs.base import Positive, Spec, Unsound, Vector, finite, one_of, sense, whole
from fsiwork.specs.faults import Fault, got, wrong

AXES = "xyz"


class Periodic(Spec):
    """What leaves on this side comes in on the other."""

    kind: Literal["periodic"] = "periodic"


class NoSlip(Spec):
    """A wall at rest."""

    kind: Literal["no-slip"] = "no-slip"


class FreeSlip(Spec):
    """No flow through, no shear stress."""

    kind: Literal["free-slip"] = "free-slip"


class Symmetry(Spec):
    """A plane of symmetry: free slip, and bodies that cross it are their own mirror images."""

    kind: Literal["symmetry"] = "symmetry"


class Wall(Spec):
    """A wall that moves in its own plane."""

    kind: Literal["wall"] = "wall"
    velocity: Vector


class Inflow(Spec):
    """Fluid comes in. ``velocity`` is the largest one: everywhere (uniform) or half-way between the sides."""

    kind: Literal["inflow"] = "inflow"
    velocity: Vector
    profile: Literal["uniform", "parabolic"] = "uniform"


class Outflow(Spec):
    """Fluid leaves at pressure zero."""

    kind: Literal["outflow"] = "outflow"


Side = one_of(Periodic, NoSlip, FreeSlip, Symmetry, Wall, Inflow, Outflow, short=True)
SideSpec = Periodic | NoSlip | FreeSlip | Symmetry | Wall | Inflow | Outflow


def _both(value):
    """One side given for both."""
    return (value, value) if isinstance(value, str | Mapping | Spec) else value


Pair = Annotated[tuple[Side, Side], BeforeValidator(_both, json_schema_input_type=tuple[Side, Side] | Side)]


class Edges(Spec):
    """The sides of the box, direction by direction: (low, high), or one word for both."""

    x: Pair
    y: Pair
    z: Pair | None = None

    @sense
    def _x(self) -> Iterator[Fault]:
        yield from self._pair("x")

    @sense
    def _y(self) -> Iterator[Fault]:
        yield from self._pair("y")

    @sense
    def _z(self) -> Iterator[Fault]:
        if self.z is not None:
            yield from self._pair("z")

    def _pair(self, axis: str) -> Iterator[Fault]:
        low, high = getattr(self, axis)
        if (low.kind == "periodic") != (high.kind == "periodic"):
            yield (axis,), f"both sides are periodic or none, got {low.kind} and {high.kind}"
        dim = 2 if self.z is None else 3
        for end, side in enumerate((low, high)):
            for text in _velocity_faults(side, AXES.index(axis), end, dim):
                yield (axis, end, "velocity"), text

    @sense
    def _through_flow(self) -> Iterator[Fault]:
        pairs = {"x": self.x, "y": self.y, "z": self.z or ()}
        where = {(axis, end): side.kind for axis, pair in pairs.items() for end, side in enumerate(pair)}
        for place, kind in where.items():
            for one, other in (("outflow", "inflow"), ("inflow", "outflow")):
                if kind == one and other not in where.values():
                    yield place, f"an {one} needs an {other}"


def _edges(value, handler):
    """One word for all sides, or direction by direction; so that faults have plain paths."""
    if isinstance(value, Mapping):
        return Edges.model_validate(dict(value))
    if isinstance(value, Edges) or (isinstance(value, str) and value in EVERYWHERE):
        return handler(value)
    raise wrong(f"must be one of {', '.join(EVERYWHERE)}, or a mapping of x, y (z); got {got(value)}")


EVERYWHERE = {"walls": NoSlip(), "periodic": Periodic(), "free-slip": FreeSlip()}


class Box(Spec):
    """A box of square (cubic) cells.

    ``cells`` counts along the longest direction: the one knob of resolution.
    """

    length: Annotated[tuple[Positive, ...], Field(min_length=2, max_length=3)]
    cells: whole(4, 100_000)
    origin: Vector = Field(default_factory=lambda data: (0.0,) * len(data["length"]))
    edges: Annotated[Literal["walls", "periodic", "free-slip"] | Edges, WrapValidator(_edges)] = "walls"

    @property
    def dim(self) -> int:
        """2 or 3."""
        return len(self.length)

    @property
    def h(self) -> float:
        """Side of a cell [length]."""
        return max(self.length) / self.cells

    @property
    def n(self) -> tuple[int, ...]:
        """Cells in each direction."""
        return tuple(round(length / self.h) for length in self.length)

    @property
    def sides(self) -> tuple[tuple[SideSpec, SideSpec], ...]:
        """(low, high) side of each direction; not there if one is missing."""
        if isinstance(self.edges, Edges):
            pairs = tuple(getattr(self.edges, AXES[a]) for a in range(self.dim))
            if None in pairs:
                raise Unsound("sides")
            return pairs
        return ((EVERYWHERE[self.edges],) * 2,) * self.dim

    @sense
    def _square(self) -> Iterator[Fault]:
        for a, length in enumerate(self.length):
            count = length / self.h
            if not finite(count) or abs(count - round(count)) > 1e-6 * count or round(count) < 4:
                yield (
                    ("length", a),
                    f"cells are square (side {self.h:.6g}): must be a whole number of them, 4 or more, got {length}",
                )

    @sense
    def _origin(self) -> Iterator[Fault]:
        if len(self.origin) != self.dim:
            yield ("origin",), f"must have {self.dim} numbers, got {len(self.origin)}"

    @sense
    def _sides(self) -> Iterator[Fault]:
        if isinstance(self.edges, Edges) and (self.edges.z is not None) != (self.dim == 3):
            yield ("edges", "z"), "is required" if self.dim == 3 else "the box has two directions, x and y"


def _velocity_faults(side: SideSpec, a: int, end: int, dim: int) -> Iterator[str]:
    """What is wrong with the velocity on the side ``end`` of direction ``a``."""
    if not isinstance(side, Wall | Inflow):
        return
    if len(side.velocity) != dim:
        yield f"must have {dim} numbers, got {len(side.velocity)}"
    elif isinstance(side, Wall) and side.velocity[a] != 0:
        yield f"a wall moves in its own plane: component {AXES[a]} must be 0, got {side.velocity[a]}"
    elif isinstance(side, Inflow) and not side.velocity[a] * (-1 if end else 1) > 0:
        yield f"an inflow points into the box: component {AXES[a]} has the wrong sign, got {side.velocity[a]}"
