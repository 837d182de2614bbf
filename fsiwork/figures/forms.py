"""Figure of the discrete forms of a membrane's force."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import forms

TITLES = {"membrane": "membrane, λ = 10", "drop": "drop, λ = 1"}
HIGHEST = 1.001  # a run whose energy rises above this many times the first makes energy


def forms_membrane(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """By ε/Δx, for both laws: residual of the energy law, and the first minimum of the half-axis beside the markers'.
    Hollow: the energy rises above the first, or the interface wrinkles."""
    data = datasets["forms_membrane"]
    found, widths = forms.every(data), [float(q) for q in data["width"].values]
    figure, panels = style.sheet(2, 2, size=(9.6, 6.2), sharex=True)
    for law, (top, low) in zip(TITLES, panels.T, strict=True):
        for k, form in enumerate(data["form"].values):
            runs = [found[law, str(form), width] for width in widths]
            sound = [run["longest"] <= forms.WRINKLED and run["rise"] <= HIGHEST for run in runs]
            for ax, name in ((top, "residual"), (low, "axis")):
                _line(ax, widths, [run[name] for run in runs], sound, k, str(form))
        time, axis = forms.MARKERS[law]
        low.axhline(axis, label=f"markers, N = 256 (t = {time:g})", **style.REFERENCE)
        top.set(yscale="log", title=TITLES[law], ylabel="residual of (3.23) [of the excess]")
        low.set(xscale="log", xlabel="ε [Δx]", ylabel="first minimum of the half-axis [L]", ylim=(0.42, 0.76))
        low.set_xticks(widths, [f"{width:g}" for width in widths])
        low.minorticks_off()
        low.legend(fontsize=7)
    text = f"N = {int(data['n_cells'].max())}, μ = 0.01, t ≤ 1.3; hollow: energy above the first, or wrinkles"
    style.note(figure, datasets, text)
    return figure


def _line(ax, widths: list[float], values: list[float], sound: list[bool], k: int, label: str) -> None:
    """A form's numbers: filled marks where they can be trusted, hollow ones elsewhere."""
    colour, marker = style.OKABE_ITO[k], "os^D"[k]
    ax.plot(widths, values, color=colour, linewidth=1.0)
    for good, face in ((True, colour), (False, "white")):
        x, y = (np.array(q)[np.array(sound) == good] for q in (widths, values))
        ax.plot(x, y, marker, color=colour, markerfacecolor=face)
    ax.plot([], [], marker, linestyle="-", color=colour, label=label)
