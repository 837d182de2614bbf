"""Figure of a membrane at the ends of its parameters."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from fsiwork.figures import style
from fsiwork.studies import extremes

COLOURS = ("#F4F4EC", style.OKABE_ITO[5], style.OKABE_ITO[4], "#000000")
SIGNS = ("", "~", "+", "×")
NAMES = {
    "stiffness": "stiffness λ",
    "viscosity": "viscosity μ",
    "damped": "μ, backward\nEuler",
    "width": "ε/Δx",
    "stretch": "stretch s",
    "wall": "cells to\na wall",
    "contrast": "μ inside / outside",
    "density": "ρ inside / outside",
}
LIMITS = (
    ("tension", "(1.54) with sE'(s)", {"marker": "v", "color": style.OKABE_ITO[1]}),
    ("tangential", "(1.54) with sE''(s)", {"marker": "^", "color": style.OKABE_ITO[0]}),
    ("limit", "measured", {"marker": "o", "color": "0"}),
)


def extremes_membrane(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Above the outcome of each coupling and step at each extreme; below the explicit limit and what (1.54) says."""
    data = extremes.together(datasets)
    names, values = zip(*(str(case).rsplit("_", 1) for case in data["case"].values), strict=True)
    figure, (above, below) = style.sheet(2, 1, size=(11.4, 6.6), sharex=True, height_ratios=[1.5, 1])
    _outcomes(above, data["outcome"].transpose("run", "case").values)
    _limits(below, data)
    below.set_xticks(range(len(values)), values, rotation=60, ha="right", rotation_mode="anchor")
    first = [k for k, name in enumerate(names) if k == 0 or names[k - 1] != name]
    for low, high in zip(first, [*first[1:], len(names)], strict=True):
        above.text((low + high - 1) / 2, -0.8, NAMES[names[low]], ha="center", va="bottom", fontsize=8)
        for ax in (above, below) if low else ():
            ax.axvline(low - 0.5, color="0", linewidth=0.8)
    text = f"stable and accurate at the program's own step: {100 * measured['auto_accurate_stabilised']:.0f} % of the "
    style.note(figure, datasets, text + "extremes with the stabilised coupling")
    return figure


def _outcomes(ax, outcome: np.ndarray) -> None:
    colours = ListedColormap(COLOURS)
    ax.imshow(outcome, cmap=colours, norm=BoundaryNorm(np.arange(-0.5, 4), 4), aspect="auto", origin="upper")
    for row, column in np.argwhere(outcome > 0):
        code = int(outcome[row, column])
        ax.text(column, row, SIGNS[code], ha="center", va="center", fontsize=8, color="1" if code == 3 else "0")
    words = [f"{coupling}, {step if step == 'auto' else f'{step:g} ×'}" for coupling, step in extremes.RUNS]
    ax.set_yticks(range(len(words)), words)
    for k in range(1, len(extremes.COUPLINGS)):
        ax.axhline(k * len(extremes.STEPS) - 0.5, color="0", linewidth=0.8)
    ax.grid(False)
    ax.tick_params(length=0)
    patches = [
        Patch(facecolor=colour, edgecolor="0.5", label=f"{word}  {sign}".strip())
        for colour, word, sign in zip(COLOURS, extremes.OUTCOMES, SIGNS, strict=True)
    ]
    ax.legend(handles=patches, loc="lower right", bbox_to_anchor=(1.0, 1.09), ncols=4)


def _limits(ax, data: xr.Dataset) -> None:
    """Limits over the program's own; an arrow where no step was unstable."""
    place = np.arange(data.sizes["case"])
    for name, label, look in LIMITS:
        ax.plot(place, data[name] / data["predicted"], label=label, linestyle="none", markersize=5, **look)
    free = data["found"].values == 0
    ax.plot(place[free], 1.6 * (data["limit"] / data["predicted"])[free], linestyle="none", marker=r"$\uparrow$",
            color="0", markersize=8, label="measured, at least")  # fmt: skip
    ax.axhline(1.0, label="the program's limit", **style.REFERENCE)
    ax.set(yscale="log", ylabel="largest explicit Δt\nover the program's limit", xlim=(-0.5, place.size - 0.5))
    ax.legend(loc="upper right", ncols=5, bbox_to_anchor=(1.0, 1.17))
