"""The force of a membrane (3.18) in four discrete forms; the law says which is stable (MEASURED-coupling 2)."""

import numpy as np

from fsiwork.bodies.band import Band
from fsiwork.bodies.laws import LINEAR, AtPoints
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import korteweg
from fsiwork.core.kernels import membrane as kernels

FORMS = ("normal-tangential", "divergence", "split", "korteweg")


class Pull:
    """Adds F = (∇_ΓE' - E'H n)|∇φ| D_ε [force/volume] to flat face fields.

    Parameters
    ----------
    grid : where
    law : the energy, prepared for kernels
    form : ``normal-tangential`` (as written; balanced for a drop), ``divergence`` of E'|∇φ|(I - nn)D_ε (sums to
        zero exactly), ``split``: normal part from the curvature, tangential part from the divergence, or ``korteweg``:
        -div((E'/|∇φ|) ∇φ⊗∇φ D_ε), which is the divergence less ∇(E'|∇φ|D_ε), so that only the pressure differs
    eps, renormalised : half-width of D_ε [length]; whether it is divided by |∇φ|, so that ε stays a length
    """

    def __init__(self, grid: Grid, law: AtPoints, form: str, eps: float, renormalised: bool):
        if form not in FORMS:
            raise ValueError(f"form must be one of {', '.join(FORMS)}, got {form!r}")
        self.grid, self.law, self.renormalised = grid, law, renormalised
        self.numbers = np.array([grid.h, eps, renormalised, law.lam])
        self.add = getattr(self, form.replace("-", "_"))
        self._T = grid.field()
        self._tau = self._T if form == "divergence" else grid.field()
        self._parts = [grid.field() for _ in grid.axes] if form == "split" else []
        self._straight = self.strides(*grid.axes)
        self._first = [self.strides(a, *(b for b in grid.axes if b != a)) for a in grid.axes]
        self._pairs = [
            (a, b, self.strides(a, b, *(c for c in grid.axes if c not in (a, b))))
            for a in grid.axes
            for b in grid.axes[a + 1 :]
        ]

    def strides(self, *axes: int) -> np.ndarray:
        """Strides of the axes in this order, 0 for the direction that a plane lacks."""
        return np.array([*(self.grid.strides[a] for a in axes), 0][:3])

    def divergence(self, force: list[np.ndarray], phi: np.ndarray, band: Band) -> None:
        """F_a += Σ_b ∂_b T_ab with T at nodes."""
        law, runs, h = self.law, band.runs, self.grid.h
        law.nodes(phi, runs, band.cells, self._straight)
        for a, s in enumerate(self._first):
            kernels.stress_at_nodes(self._T, phi, runs, s, False, law.kind, self.numbers, law.given[1])
            kernels.add_normal(force[a], self._T, runs, s, h)
        self._shear(force, phi, band)

    def korteweg(self, force: list[np.ndarray], phi: np.ndarray, band: Band) -> None:
        """F_a -= Σ_b ∂_b Σ_ab, Σ = (E'/|∇φ|) ∇φ⊗∇φ D_ε (3.24), (3.27), for any law E.

        Σ_aa at centres and Σ_ab at nodes: from Σ_aa at nodes the difference to `divergence` would be a gradient of the
        grid, to rounding.
        """
        law, runs = self.law, band.runs
        law.centres(phi, runs, band.cells, self._straight)
        for a, s in enumerate(self._first):
            korteweg.normal_stress(self._tau, phi, runs, s, law.kind, self.numbers, law.given[1])
            korteweg.add_difference(force[a], self._tau, runs, s[0], self.grid.h)
        law.nodes(phi, runs, band.cells, self._straight)
        self._shear(force, phi, band)
        kernels.clear(self._tau, runs)

    def _shear(self, force, phi, band):
        law, runs, h = self.law, band.runs, self.grid.h
        for a, b, s in self._pairs:
            kernels.stress_at_nodes(self._T, phi, runs, s, True, law.kind, self.numbers, law.given[1])
            kernels.add_shear(force[a], self._T, runs, s[1], s[2], h)
            kernels.add_shear(force[b], self._T, runs, s[0], s[2], h)
        kernels.clear(self._T, runs)

    def normal_tangential(self, force: list[np.ndarray], phi: np.ndarray, band: Band) -> None:
        """F_a += (∇_ΓE' - E'H n)_a |∇φ| D_ε; for surface tension -E'H ∂_a H_ε, which a static drop balances."""
        self._bend(phi, band)
        for a, s in enumerate(self._first):
            if self.law.kind == LINEAR and not self.renormalised:
                kernels.pull_balanced(force[a], self._T, phi, band.runs, s, self.numbers)
            else:
                kernels.pull(force[a], self._T, self._tau, phi, band.runs, s, self.numbers)
        self._clear(band, self._T, self._tau)

    def split(self, force: list[np.ndarray], phi: np.ndarray, band: Band) -> None:
        """F_a += -E'H n_a |∇φ| D_ε + ((I - nn) div T)_a."""
        self.divergence(self._parts, phi, band)
        self._bend(phi, band)
        for a, s in enumerate(self._first):
            parts = [self._parts[a], *(self._parts[b] for b in self.grid.axes if b != a), self._parts[a]][:3]
            kernels.pull_split(force[a], self._T, phi, *parts, band.runs, s, self.numbers)
        self._clear(band, self._T, self._tau, *self._parts)

    def _bend(self, phi, band):
        law = self.law
        law.centres(phi, band.runs, band.cells, self._straight)
        kernels.bend(self._T, self._tau, phi, band.runs, self._straight, law.kind, self.numbers, law.given[1])

    def _clear(self, band, *scratch):
        for q in scratch:
            kernels.clear(q, band.runs)
