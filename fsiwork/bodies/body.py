"""What a body may do in a step and what it can be asked; a class overrides what its physics needs."""

import numpy as np


class Body:
    """Four verbs, called in this order in a step, and six answers. All empty here, so that absence costs nothing.

    ``flow`` is a `fsiwork.core.flow.Flow`; ``dt`` [time].

    Attributes
    ----------
    passes : how often a step is taken, each pass from the same state, before it counts
    guess : `state` after the last pass of an iteration, or None
    """

    passes: int = 1
    guess: dict[str, np.ndarray] | None = None

    def blend(self, flow, dt: float) -> None:
        """Mix own density and viscosity into ``flow.rho`` and ``flow.mu`` (3.19), (5.6)."""

    def push(self, flow, dt: float) -> None:
        """Add to ``flow.force`` (force per volume on low faces) and ``flow.stiffness`` (3.63), (4.30), (6.12)."""

    def hold(self, flow, dt: float) -> None:
        """Say what holds the fluid: drag towards a velocity, a source of volume (5.14)."""

    def move(self, flow, dt: float) -> None:
        """Carry the body with the new velocity (3.64), (4.29)."""

    def potential(self) -> np.ndarray | None:
        """What the flow's pressure has more than with the book's form of the force, interior array at centres, if the
        form in use differs by a gradient; of a membrane after SPEC 5."""

    def longest_step(self, flow) -> dict[str, float]:
        """Largest stable time steps [time], by the name of what limits them."""
        return {}

    def state(self) -> dict[str, np.ndarray]:
        """Copies of all that the next step reads."""
        return {}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Take back a `state`, bit by bit."""

    def fields(self) -> dict[str, np.ndarray]:
        """What people want to see, by name: flat fields at centres."""
        return {}

    def gauges(self, flow) -> dict[str, float]:
        """Numbers of the present state, by fixed names."""
        return {}
