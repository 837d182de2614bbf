"""A prescribed velocity instead of a fluid; with ``period`` T it goes as cos(πt/T), and back after T."""

from collections.abc import Iterator
from typing import Literal

from fsiwork.specs.base import Number, Positive, Spec, Vector, one_of
from fsiwork.specs.faults import Fault


class _Motion(Spec):
    period: Positive | None = None

    def misfits(self, dim: int) -> Iterator[Fault]:
        """Fields that do not fit a box of ``dim`` directions."""
        yield from ()

    def top(self, origin: Vector, lengths: Vector) -> float:
        """Bound of Σ|u_a| [length/time] in a box of these sides from ``origin``."""
        raise NotImplementedError


class Vortex(_Motion):
    """One vortex that fills the box, as in Fig. 1.5: u = −U sin²πx sin 2πy, v = U sin 2πx sin²πy. ``speed`` is U."""

    kind: Literal["vortex"] = "vortex"
    speed: Number = 1.0

    def top(self, origin, lengths):
        """See `_Motion.top`."""
        return abs(self.speed) * (1.0 + lengths[1] / lengths[0])


class Rotation(_Motion):
    """A rigid rotation about ``centre`` in the plane of x and y, ``rate`` in radians a unit of time."""

    kind: Literal["rotation"] = "rotation"
    centre: Vector
    rate: Number

    def misfits(self, dim):
        """See `_Motion.misfits`."""
        if len(self.centre) != dim:
            yield ("centre",), f"must have {dim} numbers, got {len(self.centre)}"

    def top(self, origin, lengths):
        """See `_Motion.top`."""
        arms = [max(abs(c - o), abs(o + L - c)) for c, o, L in zip(self.centre, origin, lengths, strict=True)]
        return abs(self.rate) * (arms[0] + arms[1])


class Translation(_Motion):
    """The same ``velocity`` everywhere."""

    kind: Literal["translation"] = "translation"
    velocity: Vector

    def misfits(self, dim):
        """See `_Motion.misfits`."""
        if len(self.velocity) != dim:
            yield ("velocity",), f"must have {dim} numbers, got {len(self.velocity)}"

    def top(self, origin, lengths):
        """See `_Motion.top`."""
        return sum(map(abs, self.velocity))


class Deformation(_Motion):
    """Enright's deformation in space, sixteen vortices in the plane, in units of the box's first side."""

    kind: Literal["deformation"] = "deformation"
    speed: Number = 1.0

    def top(self, origin, lengths):
        """See `_Motion.top`."""
        return 2.0 * abs(self.speed)


Motion = one_of(Vortex, Rotation, Translation, Deformation)
