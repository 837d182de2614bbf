"""The fluid and how it starts."""

from typing import Literal

from fsiwork.specs.base import NotNegative, Number, Positive, Spec, Vector, one_of, whole


class Rest(Spec):
    """Velocity zero."""

    kind: Literal["rest"] = "rest"


class TaylorGreen(Spec):
    """Decaying vortices: u = −A cos kx sin ky, v = A sin kx cos ky, k = 2π waves / length of the direction."""

    kind: Literal["taylor-green"] = "taylor-green"
    amplitude: Number = 1.0
    waves: whole(1, 10_000) = 1


class Shear(Spec):
    """u = rate · (y − middle of the box)."""

    kind: Literal["shear"] = "shear"
    rate: Number


Initial = one_of(Rest, TaylorGreen, Shear, short=True)


class Fluid(Spec):
    """An incompressible Newtonian fluid: ρ [mass/lengthᵈ], μ, gravity [length/time²] (empty: none)."""

    density: Positive = 1.0
    viscosity: NotNegative
    gravity: Vector = ()
    advection: Literal["none", "central", "upwind5"] = "upwind5"
    diffusion: Literal["implicit", "backward-euler", "explicit"] = "implicit"
    initial: Initial = Rest()


class Inside(Spec):
    """The other fluid, inside a membrane or drop."""

    density: Positive
    viscosity: NotNegative
