"""Figures of integrals over level sets: errors of lengths against the grid step."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies.integrals import BOOK, BOOK_STEPS, column

LOOKS = {
    "plain": ("ζ(φ/ε)|∇φ|/ε, ε = 1.5 Δx", style.OKABE_ITO[6], "x", "-"),
    "renormalised": ("renormalised, ε = 1.5 Δx", style.OKABE_ITO[0], "o", "-"),
    "one-norm": ("1-norm hat, ε = Δx", style.OKABE_ITO[4], "v", "--"),
    "smereka-1": ("Smereka 1", style.OKABE_ITO[1], "s", "-"),
    "smereka-2": ("Smereka 2", style.OKABE_ITO[2], "^", "-"),
    "towers-laplacian": ("Towers, by Δ", style.OKABE_ITO[3], "D", "--"),
    "towers-gradient": ("Towers, by ∇ℋ·n", style.OKABE_ITO[5], "d", ":"),
    "marching-squares": ("marching squares", style.OKABE_ITO[6], "+", "-."),
    "geometric": ("height functions on a quintic", style.OKABE_ITO[0], "*", ":"),
}


def table_1_1(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Errors over Δx for the polynomial, with the book's columns as open marks, and for the distance."""
    data = datasets["integrals"]
    figure, axes = style.sheet(1, 2, size=(11.0, 4.6), sharex=True, sharey=True)
    for ax, field in zip(axes, ("quadratic", "distance"), strict=True):
        for name, (label, colour, marker, dashes) in LOOKS.items():
            errors = abs(column(data, name, field, "signed" if _is_signed(name, field) else "error"))
            ax.plot(errors["step"], errors, color=colour, marker=marker, linestyle=dashes, label=label)
        for order, start in ((2, 0.3), (6, 1e-5)):
            steps = np.array([0.1, 0.025])
            ax.plot(steps, start * (steps / 0.1) ** order, **style.REFERENCE)
            ax.text(
                0.045, start * 0.45**order * 2, f"order {order}", fontsize=7.5, color="0.35", ha="right", va="bottom"
            )
        ax.set(xscale="log", yscale="log", xlabel="Δx [length]", ylim=(1e-16, 1))
    for name, printed in BOOK.items():
        options = {"markerfacecolor": "none", "linestyle": "none", "markersize": 9}
        axes[0].plot(BOOK_STEPS, printed, color=LOOKS[name][1], marker=LOOKS[name][2], **options)
    axes[0].plot([], [], color="0.4", marker="o", markersize=9, markerfacecolor="none", linestyle="none", label="book")
    axes[0].set(title="φ = x²/a² + y²/b² − 1", ylabel="relative error of the length [1]")
    axes[1].set(title="φ = signed distance")
    axes[1].legend(*axes[0].get_legend_handles_labels(), loc="lower right", fontsize=7)
    text = f"{measured['draws']:,.0f} random turns and shifts; means of |error|, left renormalised: |mean error|"
    style.note(figure, datasets, text)
    return figure


def _is_signed(name: str, field: str) -> bool:
    return name == "renormalised" and field == "quadratic"
