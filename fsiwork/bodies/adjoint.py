"""The force of a membrane as the gradient of its discrete energy: no energy is made but by the time step."""

import numpy as np

from fsiwork.bodies.band import Band
from fsiwork.bodies.laws import AtPoints
from fsiwork.core.edges import Edges
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import adjoint as kernels
from fsiwork.core.kernels import shear
from fsiwork.core.kernels.membrane import clear


class Adjoint:
    """F = (∂ℰ_h/∂φ)∇φ, ℰ_h = h^d Σ D_ε E(|∇φ|) over the nodes, with the very derivative of the transport ``upwind5``.

    It goes through one filter (1, 2, 1)/4 a direction, and so must the velocity that carries φ: the pair stays adjoint
    (MEASURED-coupling 7, there for membranes with shear). It differs from (3.18) by a gradient, see `potential`.

    Parameters
    ----------
    grid, edges : where
    law : the energy, prepared for kernels
    eps, renormalised : half-width of D_ε [length]; whether it is divided by |∇φ|, so that ε stays a length
    """

    def __init__(self, grid: Grid, edges: Edges, law: AtPoints, eps: float, renormalised: bool):
        self.grid, self.edges, self.law = grid, edges, law
        self.numbers = np.array([grid.h, eps, renormalised, law.lam])
        self._P, self._g, self._q = np.zeros((grid.dim + 1, grid.size)), grid.field(), grid.field()
        self._u, self._face = [grid.field() for _ in grid.axes], grid.field()
        self._s = np.array([*grid.strides, 0][:3])
        self._across = (grid.strides[0], grid.strides[1] if grid.dim == 3 else 0)

    def gradient(self, phi: np.ndarray, band: Band) -> np.ndarray:
        """Derivatives of the energy by φ over the volume of a cell, flat at centres; valid until the next call."""
        law, runs = self.law, band.runs
        law.nodes(phi, runs, band.cells, self._s, every=True)
        kernels.slopes(self._P, phi, runs, self._s, law.kind, self.numbers, law.given[0], law.given[1])
        self._g.fill(0.0)
        kernels.gradient(self._g, self._P, runs, self._s, self.grid.h)
        for P in self._P:
            clear(P, runs)
        return self._g

    def add(self, force: list[np.ndarray], phi: np.ndarray, band: Band, u: list[np.ndarray]) -> None:
        """F on the low faces; the velocity ``u`` says which side is upwind."""
        g, gradient = self.grid, self.gradient(phi, band)
        for a, (s, c) in enumerate(zip(g.strides, self.filtered(u), strict=True)):
            self._q.fill(0.0)
            kernels.pull(self._q, gradient, phi, c, band.runs, s, g.h)
            self.edges.fill_scalar(self._q, "mirror")
            self.edges.mirror(self._q, odd=a)
            shear.to_faces(self._face, self._q, *g.rows(1, 1), s)
            shear.smooth(force[a], self._face, *g.rows(), *self._across, 1.0)

    def filtered(self, u: list[np.ndarray]) -> list[np.ndarray]:
        """The velocity that carries φ, on low faces; valid until the next call."""
        for c, q in zip(self._u, u, strict=True):
            shear.smooth(c, q, *self.grid.rows(0, 1), *self._across, 0.0)
        return self._u

    def energy(self, phi: np.ndarray, band: Band) -> float:
        """ℰ_h of a flat φ."""
        law, runs = self.law, band.inside
        law.nodes(phi, runs, band.cells_inside, self._s, every=True)
        sums = np.zeros(runs.shape[0])
        kernels.energies(sums, phi, runs, self._s, law.kind, self.numbers, law.given[0])
        return float(sums.sum()) * self.grid.cell_volume

    def potential(self, phi: np.ndarray, band: Band) -> np.ndarray:
        """D_ε E - |∇φ| ∂(D_ε E)/∂|∇φ|, which is (E - E'|∇φ|)D_ε with the plain D_ε, filtered as the force is: what the
        pressure has more than with (3.18). Interior array at centres."""
        law, runs, g = self.law, band.runs, self.grid
        law.nodes(phi, runs, band.cells, self._s, every=True)
        nodes = self._P[0]
        kernels.excess(nodes, phi, runs, self._s, law.kind, self.numbers, law.given[0], law.given[1])
        self._q.fill(0.0)
        kernels.to_centres(self._q, nodes, runs, self._s)
        clear(nodes, runs)
        self.edges.fill_scalar(self._q, "mirror")
        shear.smooth(self._face, self._q, *g.rows(), *self._across, 0.0)
        return g.inside(self._face).copy()
