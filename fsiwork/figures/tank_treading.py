"""Figure of a vesicle in a shear flow, Fig. 3.15."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import tank_treading as study

RED = "#C00000"  # as in the book
TREADS, TUMBLES = "a7_r1", "a7_r8"
LEVELS = 16  # of the pressure, and 0


def _picture(ax, one: xr.Dataset, k: int, levels: np.ndarray):
    """Pressure contours and the outline of picture ``k``; lengths in radii. Returns the contours."""
    w = study.WINDOW
    p = one[f"p_{k}"].values.reshape(w.size, w.size).T
    filled = ax.contourf(w, w, p, levels, cmap=style.DIVERGING, extend="both")
    ax.contour(w, w, p, levels, colors="0.25", linewidths=0.3, linestyles="solid")
    ax.plot(*one[f"line_{k}"].values.reshape(-1, 2).T, color=RED, linewidth=1.6)
    ax.set(xticks=[], yticks=[], aspect="equal", xlim=(w[0], w[-1]), ylim=(w[0], w[-1]))
    ax.spines[:].set_visible(True)
    ax.set_title(f"γ̇t = {float(one[f't_{k}']) * float(one['rate']):.1f}", fontsize=8, pad=2)
    return filled


def _angles(ax, data: xr.Dataset, start: str, title: str, known: bool = False) -> None:
    """Angle over time of the runs of one reduced area, or of those with a ``known`` angle; dashed: that angle."""
    cases = [str(case) for case in data["case"].values if str(case).startswith(start)]
    for k, case in enumerate(sorted(cases, key=lambda case: float(data["ratio"].sel(case=case)))):
        if known and case not in study.REFERENCE:
            continue
        one, colour = data.sel(case=case), style.OKABE_ITO[k % 7]
        ax.plot(one["t"] * float(one["rate"]), one["angle"], color=colour, label=f"{float(one['ratio']):g}")
        if case in study.REFERENCE:
            ax.axhline(study.REFERENCE[case], color=colour, linewidth=1.0, linestyle=(0, (6, 2)), alpha=0.8)
    ax.set(xlabel="strain γ̇t [1]", title=title, xlim=(0, None))
    ax.legend(title="viscosity ratio", title_fontsize=7, fontsize=7, ncols=2 if known else 1, loc="lower left")


def fig_3_15(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Above: tank-treading, and two lines of tumbling, red on pressure contours; below: angle over time of all runs."""
    data = datasets["vesicle"]
    figure = Figure(figsize=(9.6, 10.6))
    above, below = figure.subfigures(2, 1, height_ratios=(3.05, 1.15))
    axes = above.subplots(3, 4)
    treads, tumbles = data.sel(case=TREADS), data.sel(case=TUMBLES)
    shown = [(treads, k) for k in range(1, study.SHOTS, 2)] + [(tumbles, k) for k in range(study.SHOTS)]
    top = float(np.ceil(np.percentile(np.abs([one[f"p_{k}"].values for one, k in shown]), 99)))
    levels = np.linspace(-top, top, LEVELS + 1)
    filled = [_picture(ax, one, k, levels) for ax, (one, k) in zip(axes.flat, shown, strict=True)]
    for row, text in ((0, "ratio 1: tank-treading"), (1, "ratio 8: tumbling")):
        axes[row, 0].set_ylabel(text)
    above.colorbar(filled[-1], ax=axes, shrink=0.5, aspect=30, pad=0.01, label="pressure p/(μγ̇) [1]", ticks=levels[::2])
    full, close, round_ = below.subplots(1, 3)
    _angles(full, data, "a7", "reduced area 0.7")
    full.set(ylabel="angle of the long axis to the flow [°]", ylim=(-180, 40), yticks=range(-180, 31, 30))
    _angles(close, data, "a7", "0.7; dashed: boundary integral", known=True)
    close.set_ylim(0, 26)
    _angles(round_, data, "a9", "reduced area 0.9", known=True)
    round_.set_ylim(15, 34)
    words = f"box {measured['height']:.0f} R high, Re = {measured['reynolds']:.3f}, ε = {measured['eps_cells']:g} Δx"
    words += (
        f"; length within {measured['length']:.1f} % while tank-treading, {measured['length_tumbling']:.1f} % tumbling"
    )
    style.note(figure, datasets, words)
    return figure
