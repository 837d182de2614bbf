"""Curves in space as data: rings and fibres."""

import math
from collections.abc import Iterator
from typing import Literal

from fsiwork.specs.base import Positive, Spec, Vector
from fsiwork.specs.faults import Fault


class Ring(Spec):
    """A circle in space; ``normal`` is the axis it lies across."""

    kind: Literal["ring"] = "ring"
    centre: Vector
    radius: Positive
    normal: Literal["x", "y", "z"] = "z"

    def misfits(self, dim: int) -> Iterator[Fault]:
        """Fields that do not fit a box of ``dim`` directions."""
        if dim != 3:
            yield ("kind",), f"a ring has 3 directions, the box {dim}"
        elif len(self.centre) != 3:
            yield ("centre",), f"must have 3 numbers, got {len(self.centre)}"

    def bounds(self, dim: int) -> tuple[tuple[float, float], ...]:
        """(low, high) in each direction."""
        reach = [0.0 if a == "xyz".index(self.normal) else self.radius for a in range(dim)]
        return tuple((c - r, c + r) for c, r in zip(self.centre, reach, strict=True))

    def points(self, spacing: float) -> list[tuple[float, float, float]]:
        """Points about ``spacing`` [length] apart, evenly around."""
        count = max(math.ceil(2 * math.pi * self.radius / spacing), 3)
        axis = "xyz".index(self.normal)
        found = []
        for k in range(count):
            angle, x = 2 * math.pi * k / count, list(self.centre)
            x[(axis + 1) % 3] += self.radius * math.cos(angle)
            x[(axis + 2) % 3] += self.radius * math.sin(angle)
            found.append(tuple(x))
        return found


class Fibre(Spec):
    """A straight line from its ``root``, ``length`` long ``along`` an axis; its end is free."""

    kind: Literal["fibre"] = "fibre"
    root: Vector
    length: Positive
    along: Literal["x", "y", "z"] = "y"

    def misfits(self, dim: int) -> Iterator[Fault]:
        """Fields that do not fit a box of ``dim`` directions."""
        if dim != 3:
            yield ("kind",), f"a fibre has 3 directions, the box {dim}"
        elif len(self.root) != 3:
            yield ("root",), f"must have 3 numbers, got {len(self.root)}"

    def bounds(self, dim: int) -> tuple[tuple[float, float], ...]:
        """(low, high) in each direction."""
        axis = "xyz".index(self.along)
        return tuple((c, c + self.length * (a == axis)) for a, c in enumerate(self.root))
