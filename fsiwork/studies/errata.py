"""What the printed text gets wrong, chapter by chapter, each formula with its residual as printed and as corrected.

A new one needs a function that returns the residuals (see `fsiwork.studies.errata_chapter1`), a line in `LINES`, and
its key in configs/studies/errata.yaml. "Printed" means what our copy of the text shows. φ < 0 inside, n outward,
H = div n, H_ε = 1 outside. Rated A: wrong physics or instability; B: wrong number; C: typographic.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.studies import errata_chapter1 as one
from fsiwork.studies import errata_kinematics as two


@dataclass(frozen=True)
class Line:
    """An erratum. Formulas rated A or B have ``residuals``; of one that converges ``order`` is the least accepted."""

    where: str
    rated: str
    printed: str
    correct: str
    residuals: Callable[[], one.Residuals] | None = None
    order: float = 0.0


LINES: dict[str, Line] = {
    "1.6": Line("(1.6), (1.7)", "B", "dn = [h][g]⁻¹", "dn = -[h][g]⁻¹; then Tr dn = div n", one.shape_operator),
    "1.22": Line("(1.22)", "B", "H of (1.19) = div n", "up to the sign: H ≥ 0 there", one.frenet_curvature),
    "1.4.1": Line("1.4.1, E₁", "B", "c₁ is the level inside", "ℋ is 1 where φ > 0: c₁ is outside", one.levels),
    "1.29": Line(
        "(1.29)",
        "A",
        "D(α div n + β[(u₀ - c₁)² - (u₀ - c₂)²])",
        "D(β div n - α[(u₀ - c₁)² - (u₀ - c₂)²])",
        one.contours,
    ),
    "1.31": Line("below (1.31)", "B", "[p] = λH", "[p] = -λH with the bracket of (1.31)", one.pressure_jump),
    "1.32": Line("(1.32) and before", "A", "+ρ(φ)λH D∇φ", "-λH D∇φ", one.tension_force),
    "1.36": Line("(1.36)", "A", "… = -sgn φ₀", "… = +sgn φ₀", one.redistancing),
    "1.48": Line("(1.39), (1.43), (1.48)", "A", "+λ… on the right", "-λ…; (1.50) is right", one.linear_model),
    "1.54": Line("(1.48) with (1.54)", "B", "λ/(2ε)", "λ/ε, as in (1.53)", one.step_limit),
    "1.60": Line("(1.60)", "A", "(λ/ε)Δt² Δψ", "(λ/ε)Δt Δψ", one.predictor),
    "1.5": Line("1.5, estimates in 1D", "B", "(1/ε)ζ(rx/ε)", "r(1/ε)ζ(rx/ε), r = |∇φ|", one.one_dimension),
    "1.5.4": Line("1.5.4, Towers", "A", "[ΔI - ℋΔφ]/|∇φ|²", "[ΔI - ℋΔφ]/|∇φ|", one.towers, order=1.9),
    "1.12": Line("after (1.12)", "C", "τ' ∝ γ'' - (γ'·τ)τ", "γ'' - (γ''·τ)τ"),
    "1.38": Line("(1.38), last bracket", "C", "∇(…)∇d", "must contain ∇φ/|∇φ|"),
    "1.43": Line("(1.43)-(1.45)", "C", "-∂ᵢp", "+∂ᵢp; p = 0 later"),
    "1.42": Line("after (1.42), linearised H", "C", "Σ∂ⱼφ(…)", "Σ∂ᵢ[∂ⱼφ(…)]"),
    "1.13": Line(
        "Prop. 1.13, proof", "C", "βΔt/(δ + βΔt), 1/(δ + βδ)", "βΔt/(δ + βΔt)², 1/(δ + βΔt); the result holds"
    ),
    "1.14": Line("Prop. 1.14, proof", "C", "sum of roots 2 + δ + Δtβδ", "1 + δ + Δtβ(δ - 1); the result holds"),
    "table-1.1": Line(
        "Table 1.1", "B", "a number, 1.5e-1 at Δx = 0.2", "about 2e-2: see the artefact table_1_1; not a formula"
    ),
    "2.19": Line("(2.19)", "B", "(∇u τ)·τ", "f (∇u τ)·τ", two.line_integral),
    "2.18": Line("(2.18)", "C", "+[∇u]ᵀF⁻ᵀ", "-[∇u]ᵀF⁻ᵀ"),
    "2.29": Line("(2.29), text", "C", "With (1.3)", "With (2.3)"),
    "7.5": Line("7.5, last system", "A", "+div(E'∇φ⊗∇φ/|∇φ| D)", "-div(…)", two.elastic_stress),
    "7.45": Line("(7.45), (3.57), compressible", "A", "∫E₃ D₁D₂", "∫E₃ |w₀(Y)|/J D₁D₂, w = ∇φ¹×∇φ²", two.curve_energy),
    "table-7.1": Line(
        "Table 7.1, TC2", "B", "Z₂ = 1 + (1 + β)/(2β) sh²(t√β)", "1 + (1 + β)²/(2β) sh²(t√β)", two.shear_case
    ),
    "fig-7.7": Line("Fig. 7.7", "A", "Euler with WENO5", "SSP-RK3: Euler grows at every CFL", two.weno_stepping),
    "7.55": Line("(7.55)", "B", "Δt < Δx/max|u|", "Δt Σ|uᵢ|/Δxᵢ < 1 (upwind, Euler)", two.advection_limit),
    "7.1": Line("Lemma 7.1", "C", "eigenvector", "unit eigenvector"),
    "7.1.2": Line("7.1.2, torus", "C", "z² + (R - q)² = r²", "on the surface only; d beside it"),
    "7.2": Line("7.2, 7.3", "C", "right Cauchy-Green B = FFᵀ", "left"),
    "7.3.1": Line("7.3.1, text", "C", "Theorem 7.2", "Prop. 7.2"),
    "7.45-law": Line("(7.45), text", "C", "the law is the letter of the energy", "the law is E₃"),
}
"""By key; D is (1/ε)ζ(φ/ε)."""


def formulas() -> list[str]:
    """Keys of what is rated A or B and is a formula, in the order of the text."""
    return [key for key, line in LINES.items() if line.residuals]


def residual(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Relative residuals of a ``formula``: ``printed``, ``corrected``, and the observed ``order`` (NaN: none)."""
    found = LINES[point["formula"]].residuals()
    order = float(found[2]) if len(found) > 2 else math.nan
    return {"printed": float(found[0]), "corrected": float(found[1]), "order": order}


def errata(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """The least residual as printed, the largest as corrected (of those without an order), how much the orders exceed
    what is stated, and how many formulas are listed and not computed."""
    data = datasets["errata"]
    keys = [key for key in formulas() if key in data["formula"].values]
    exact = [key for key in keys if not LINES[key].order]
    above = [float(data["order"].sel(formula=key)) - LINES[key].order for key in keys if LINES[key].order]
    covered = sum(bool(np.isfinite(data[["printed", "corrected"]].sel(formula=key).to_array()).all()) for key in keys)
    listed = sum(line.rated in "AB" and key != "table-1.1" for key, line in LINES.items())
    return {
        "printed_least": float(data["printed"].min(skipna=False)),
        "corrected_largest": float(data["corrected"].sel(formula=exact).max(skipna=False)),
        "order_above": float(np.min(above)),
        "listed": float(listed),
        "missing": float(listed - covered),
    }


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """The page: every erratum, the computed ones with their residuals."""
    data = datasets["errata"]
    header = [
        "where",
        "rated",
        "printed",
        "correct",
        "residual, printed",
        "residual, corrected",
        "order",
        "what is computed",
    ]
    found = []
    for key, line in LINES.items():
        numbers = ["", "", "", ""]
        if line.residuals:
            at = data.sel(formula=key)
            numbers = [f"{float(at['printed']):.1e}", f"{float(at['corrected']):.1e}"]
            numbers.append(f"{float(at['order']):.2f}" if line.order else "")
            numbers.append(" ".join(line.residuals.__doc__.split()).partition(": ")[2])
        found.append([line.where, line.rated, line.printed, line.correct, *numbers])
    return header, found
