"""Shapes as data: what `fsiwork.core.shapes` builds signed distances from.

Every shape knows its support function ``reach(d)``, the largest d·x over the shape for a direction d (an
upper bound where it says so): enough to tell whether a body is inside the box.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from fsiwork.specs.base import Number, Positive, Spec, Vector, one_of, sense
from fsiwork.specs.faults import Fault


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(p * q for p, q in zip(a, b, strict=True))


class _Shape(Spec):
    divisible: ClassVar[bool] = False
    vectors: ClassVar[tuple[str, ...]] = ("centre",)  # fields with one number a direction
    dims: ClassVar[tuple[int, ...]] = (2, 3)

    def misfits(self, dim: int) -> Iterator[Fault]:
        """Fields that do not fit a box of ``dim`` directions."""
        if dim not in self.dims:
            yield ("kind",), f"a {self.kind} has {self.dims[0]} directions, the box {dim}"
            return
        for name in self.vectors:
            if len(getattr(self, name)) != dim:
                yield (name,), f"must have {dim} numbers, got {len(getattr(self, name))}"

    def reach(self, d: Sequence[float]) -> float:
        """Largest d·x over the shape."""
        raise NotImplementedError

    def bounds(self, dim: int) -> tuple[tuple[float, float], ...]:
        """(low, high) in each direction."""
        units = [tuple(float(a == b) for b in range(dim)) for a in range(dim)]
        return tuple((-self.reach(tuple(-c for c in e)), self.reach(e)) for e in units)


class Ball(_Shape):
    """A disc or a ball."""

    kind: Literal["ball", "disc"] = "ball"
    centre: Vector
    radius: Positive

    def reach(self, d):
        """See `_Shape.reach`."""
        return _dot(self.centre, d) + self.radius * math.hypot(*d)


class Ellipsoid(_Shape):
    """An ellipse or an ellipsoid along the axes (turn it with `Moved`)."""

    kind: Literal["ellipsoid", "ellipse"] = "ellipsoid"
    centre: Vector
    semi_axes: Annotated[tuple[Positive, ...], Field(max_length=3)]
    vectors: ClassVar = ("centre", "semi_axes")

    def reach(self, d):
        """See `_Shape.reach`."""
        return _dot(self.centre, d) + math.hypot(*(a * c for a, c in zip(self.semi_axes, d, strict=True)))


class Block(_Shape):
    """A rectangle or a box along the axes, with full side lengths ``lengths``."""

    kind: Literal["box"] = "box"
    centre: Vector
    lengths: Annotated[tuple[Positive, ...], Field(max_length=3)]
    vectors: ClassVar = ("centre", "lengths")

    def reach(self, d):
        """See `_Shape.reach`."""
        return _dot(self.centre, d) + 0.5 * _dot(self.lengths, [abs(c) for c in d])


class Polygon(_Shape):
    """A simple polygon in two dimensions, its corners in order."""

    kind: Literal["polygon"] = "polygon"
    points: Annotated[tuple[tuple[Number, Number], ...], Field(min_length=3, max_length=10_000)]
    vectors: ClassVar = ()
    dims: ClassVar = (2,)

    def reach(self, d):
        """See `_Shape.reach`."""
        return max(_dot(point, d) for point in self.points)


class Capsule(_Shape):
    """All points within ``radius`` of the segment from ``start`` to ``end``."""

    kind: Literal["capsule"] = "capsule"
    start: Vector
    end: Vector
    radius: Positive
    vectors: ClassVar = ("start", "end")

    def reach(self, d):
        """See `_Shape.reach`."""
        return max(_dot(self.start, d), _dot(self.end, d)) + self.radius * math.hypot(*d)


class Tablet(_Shape):
    """All points within ``edge`` of the flat disc of ``radius`` across z: a cylinder with a round rim."""

    kind: Literal["tablet"] = "tablet"
    centre: Vector
    radius: Positive
    edge: Positive
    dims: ClassVar = (3,)

    def reach(self, d):
        """See `_Shape.reach`."""
        return _dot(self.centre, d) + self.radius * math.hypot(*d[:2]) + self.edge * math.hypot(*d)


class Torus(_Shape):
    """A ring around the z direction: ``radius`` to the middle of the tube, ``tube`` the radius of the tube."""

    kind: Literal["torus"] = "torus"
    centre: Vector
    radius: Positive
    tube: Positive
    dims: ClassVar = (3,)

    @sense
    def _open(self) -> Iterator[Fault]:
        if not self.tube < self.radius:
            yield ("tube",), f"must be below the radius {self.radius}, got {self.tube}"

    def reach(self, d):
        """See `_Shape.reach`."""
        return _dot(self.centre, d) + self.radius * math.hypot(*d[:2]) + self.tube * math.hypot(*d)


class Cassini(_Shape):
    """A Cassini oval |x − f₁||x − f₂| = b², foci at centre ± a along x; in 3D turned about that axis."""

    kind: Literal["cassini"] = "cassini"
    centre: Vector
    a: Positive
    b: Positive

    @sense
    def _one_piece(self) -> Iterator[Fault]:
        if not self.b > self.a:
            yield ("b",), f"must be above a = {self.a} (one oval), got {self.b}"

    def reach(self, d):
        """Upper bound: of the box around the oval."""
        long = math.hypot(self.a, self.b)
        a2, b2 = self.a * self.a, self.b * self.b
        wide = b2 / (2 * self.a) if 2 * a2 >= b2 else math.sqrt(b2 - a2)
        return _dot(self.centre, d) + long * abs(d[0]) + wide * math.hypot(*d[1:])


class Slot(_Shape):
    """Zalesak's disc: a slot ``width`` wide cut ``depth`` deep into a disc or ball from below (−y)."""

    kind: Literal["slot"] = "slot"
    centre: Vector
    radius: Positive
    width: Positive
    depth: Positive

    @sense
    def _fits(self) -> Iterator[Fault]:
        for name in ("width", "depth"):
            if not getattr(self, name) < 2 * self.radius:
                yield (name,), f"must be below the diameter {2 * self.radius}, got {getattr(self, name)}"

    def reach(self, d):
        """Upper bound: of the disc without the slot."""
        return _dot(self.centre, d) + self.radius * math.hypot(*d)


class _Several(_Shape):
    parts: Annotated[tuple["Shape", ...], Field(min_length=1, max_length=1000)]
    vectors: ClassVar = ()

    def misfits(self, dim: int) -> Iterator[Fault]:
        """Those of the parts."""
        for i, part in enumerate(self.parts):
            for path, text in part.misfits(dim):
                yield ("parts", i, *path), text


class Union(_Several):
    """What lies in any of the parts."""

    kind: Literal["union"] = "union"

    def reach(self, d):
        """See `_Shape.reach`."""
        return max(part.reach(d) for part in self.parts)


class Intersection(_Several):
    """What lies in all of the parts."""

    kind: Literal["intersection"] = "intersection"

    def reach(self, d):
        """Upper bound: the least of the parts."""
        return min(part.reach(d) for part in self.parts)


class Minus(_Shape):
    """What lies in ``shape`` and not in ``cut``."""

    kind: Literal["minus"] = "minus"
    shape: "Shape"
    cut: "Shape"

    def misfits(self, dim: int) -> Iterator[Fault]:
        """Those of the parts."""
        for name in ("shape", "cut"):
            for path, text in getattr(self, name).misfits(dim):
                yield (name, *path), text

    def reach(self, d):
        """Upper bound: of the shape before the cut."""
        return self.shape.reach(d)


class Moved(_Shape):
    """``shape`` turned about the origin by ``angle`` [rad], then shifted; 3D turns about ``axis``."""

    kind: Literal["moved"] = "moved"
    shape: "Shape"
    shift: Vector
    angle: Number = 0.0
    axis: Vector = (0.0, 0.0, 1.0)

    @sense
    def _axis(self) -> Iterator[Fault]:
        if len(self.axis) != 3:
            yield ("axis",), f"must have 3 numbers, got {len(self.axis)}"
        elif not math.hypot(*self.axis) > 0:
            yield ("axis",), "must have a direction, got zeros"

    def misfits(self, dim: int) -> Iterator[Fault]:
        """Those of the shape and of the shift."""
        if len(self.shift) != dim:
            yield ("shift",), f"must have {dim} numbers, got {len(self.shift)}"
        for path, text in self.shape.misfits(dim):
            yield ("shape", *path), text

    def reach(self, d):
        """See `_Shape.reach`."""
        return self.shape.reach(self._turned_back(d)) + _dot(self.shift, d)

    def _turned_back(self, d: Sequence[float]) -> tuple[float, ...]:
        """Rotation by −angle (Rodrigues' formula)."""
        cos, sin = math.cos(self.angle), -math.sin(self.angle)
        size = math.hypot(*self.axis)
        k = tuple(c / size for c in self.axis) if len(d) == 3 else (0.0, 0.0, 1.0)
        v = (*d, 0.0)[:3]
        cross = (k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0])
        along = _dot(k, v) * (1 - cos)
        return tuple(v[i] * cos + cross[i] * sin + k[i] * along for i in range(len(d)))


SHAPES = (Ball, Ellipsoid, Block, Polygon, Capsule, Tablet, Torus, Cassini, Slot, Union, Intersection, Minus, Moved)
Shape = one_of(*SHAPES)
for _cls in (Union, Intersection, Minus, Moved):
    _cls.model_rebuild()
