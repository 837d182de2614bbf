"""Resistance of an interface to bending, ℰ = ∫½kH² δ_Γ: its force in both forms (3.2.4), its energy and its limits."""

import numpy as np

from fsiwork.bodies.band import Band
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import bending as kernels

FORMS = ("pointwise", "divergence")


class Bending:
    """Adds F = k[Δ_ΓH + ½H(H² - 4G)] D_ε∇φ [force/volume] to flat face fields; in the plane G = 0.

    The gradient of the discrete energy with the transport's derivative and one filter, as `bodies.adjoint` has it, was
    tried: it makes no energy, at ε = 2 Δx and N = 128 too, where ``pointwise`` makes a third of the first; but an
    ellipse then bends back too slowly, and more so on finer grids with ε/Δx kept (half-axis at t = 0.5, bent_membrane
    with μ = 0.01, ε = 3 Δx: 0.476 and 0.489 for N = 64 and 128, against 0.461 and 0.464). It was left out.

    Parameters
    ----------
    grid : where
    modulus : k [energy] (in the plane energy times length)
    eps, renormalised : half-width of D_ε [length]; whether it is divided by |∇φ|. Four cells or more: below that the
        third derivatives of φ make noise that no Δt cures
    form : ``pointwise`` (as above) or ``divergence``: the bracket as div[-½H²n + |∇φ|⁻¹∇_Γ(H|∇φ|)]

    Raises
    ------
    ValueError : an unknown form
    """

    def __init__(self, grid: Grid, modulus: float, eps: float, renormalised: bool, form: str = "pointwise"):
        if form not in FORMS:
            raise ValueError(f"form must be one of {', '.join(FORMS)}, got {form!r}")
        self.grid, self.modulus, self.eps, self.renormalised = grid, float(modulus), float(eps), renormalised
        self.form = form
        self._H, self._P, self._q = grid.field(), grid.field(), grid.field()
        self._V = grid.field() if form == "divergence" else None
        self._s = [
            np.array([*(grid.strides[b] for b in (a, *(b for b in grid.axes if b != a))), 0][:3]) for a in grid.axes
        ]

    def resistance(self, phi: np.ndarray, band: Band) -> np.ndarray:
        """k[Δ_ΓH + ½H(H² - 4G)] at the centres of the band [force/area], flat; valid until the next call."""
        h, s, runs = self.grid.h, self._s, band.runs
        self._H.fill(0.0)
        self._P.fill(0.0)
        kernels.mean_curvature(self._H, self._P, phi, runs, s[0], h)
        if self.form == "pointwise":
            kernels.resistance(self._q, self._H, phi, runs, s[0], h, self.modulus)
            return self._q
        self._q.fill(0.0)
        for a in self.grid.axes:
            self._V.fill(0.0)
            kernels.flux(self._V, self._H, self._P, phi, runs, s[a], h, self.modulus)
            kernels.add_divergence(self._q, self._V, runs, self.grid.strides[a], h)
        return self._q

    def add(self, force: list[np.ndarray], phi: np.ndarray, band: Band) -> None:
        """Add the force of a flat φ, ghosts filled, to fields on the low faces."""
        q = self.resistance(phi, band)
        for a, s in enumerate(self._s):
            kernels.push(force[a], q, phi, band.runs, s, self.grid.h, self.eps, self.renormalised)

    def energy(self, phi: np.ndarray, band: Band) -> float:
        """∫½kH² δ_Γ."""
        kernels.mean_curvature(self._H, self._P, phi, band.runs, self._s[0], self.grid.h)
        sums = np.zeros(band.inside.shape[0])
        kernels.energies(sums, self._H, phi, band.inside, self._s[0], self.grid.h, self.eps, self.renormalised)
        return self.modulus * float(sums.sum()) * self.grid.cell_volume

    def stiffness(self, slope: float, density: float) -> float:
        """k r/(ρε), r = ``slope`` the largest |∇φ|: ω² of a mode is q⁴ times this (MEASURED-coupling 6)."""
        return self.modulus * (1.0 if self.renormalised else slope) / (density * self.eps)

    def limit(self, slope: float, density: float) -> float:
        """Longest explicit step ½Δx²√(ρε/(k r)) [time]."""
        return 0.5 * self.grid.h**2 / np.sqrt(self.stiffness(slope, density)) if self.modulus else np.inf
