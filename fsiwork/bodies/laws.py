"""Energies of a membrane: E(r) of its stretch r = |∇φ| (current over rest area element), per rest area.

A law is any object with ``E``, ``dE`` and ``ddE``, functions of arrays of r; all are energies per area (3D) or per
length (2D). An attribute ``kind`` other than 2 names a formula that the kernels know; it must be the same one.
"""

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from fsiwork.core.kernels import membrane as kernels

LINEAR, QUADRATIC, CALLED = 0, 1, 2  # codes for the kernels


class Law(Protocol):
    """What a membrane asks of its energy."""

    def E(self, r: np.ndarray) -> np.ndarray:
        """Energy."""

    def dE(self, r: np.ndarray) -> np.ndarray:
        """Tension E'."""

    def ddE(self, r: np.ndarray) -> np.ndarray:
        """Slope of the tension E''."""


@dataclass(frozen=True)
class Quadratic:
    """E = ½ λ (r - 1)²: a membrane that resists changes of area (3.13)."""

    stiffness: float
    kind: ClassVar[int] = QUADRATIC

    def E(self, r):
        return 0.5 * self.stiffness * (r - 1.0) ** 2

    def dE(self, r):
        return self.stiffness * (r - 1.0)

    def ddE(self, r):
        return np.full_like(r, self.stiffness)


@dataclass(frozen=True)
class Linear:
    """E = λ r: surface tension, a drop (3.23)."""

    stiffness: float
    kind: ClassVar[int] = LINEAR

    def E(self, r):
        return self.stiffness * r

    def dE(self, r):
        return np.full_like(r, self.stiffness)

    def ddE(self, r):
        return np.zeros_like(r)


def modulus(A, B):
    """M(A, B), A = E'r and B = E''r²: the largest of A s² + B s(1 - s) over 0 ≤ s ≤ 1, never negative.

    A mode of wave number K has the stiffness K² (A s² + B s (1 - s)) (MEASURED-coupling 6); for a drop M = λ r, and M
    stays positive for a membrane that is unstretched (A = 0: B/4) or compressed, where E'r gives nothing.
    """
    A, B = np.broadcast_arrays(np.asarray(A, float), np.asarray(B, float))
    steep = (B > 2.0 * A) & (B > 0.0)
    return np.where(steep, B**2 / np.where(steep, 4.0 * (B - A), 1.0), np.maximum(A, 0.0))


class AtPoints:
    """A law as the kernels read it: a code and λ, or values packed in the order of a band's runs.

    Attributes
    ----------
    kind, lam : `LINEAR`, `QUADRATIC` with λ, or `CALLED`
    given : array (3, cells) of E, E', E'' at the points last asked for; unused but for `CALLED`
    """

    def __init__(self, law: Law, grid):
        self.law, self.grid = law, grid
        known = isinstance(law, Linear | Quadratic)
        self.kind, self.lam = (law.kind, float(law.stiffness)) if known else (CALLED, 0.0)
        self.given = np.zeros((3, 1 if known else grid.size))
        self._r = np.zeros(0 if known else grid.size)

    def centres(self, phi, runs, cells, strides, every=False) -> None:
        """Have E' (``every``: E and E'' too) ready at the centres of the runs."""
        self._ask(kernels.stretch_at_centres, phi, runs, cells, strides, every)

    def nodes(self, phi, runs, cells, strides, every=False) -> None:
        """Have E' (``every``: E and E'' too) ready at the nodes of the runs."""
        self._ask(kernels.stretch_at_nodes, phi, runs, cells, strides, every)

    def _ask(self, stretch, phi, runs, cells, strides, every):
        if self.kind != CALLED:
            return
        stretch(self._r, phi, runs, strides, self.grid.h)
        r = self._r[:cells]
        self.given[1, :cells] = self.law.dE(r)
        if every:
            self.given[0, :cells], self.given[2, :cells] = self.law.E(r), self.law.ddE(r)
