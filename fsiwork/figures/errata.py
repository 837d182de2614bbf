"""Figure of the errata: residuals of the formulas as printed and as corrected."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies.errata import LINES

LEAST = 1e-17  # where a residual of zero is drawn


def errata(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """A row for each formula: its residual as printed (discs) and as corrected (squares), an order if it converges."""
    data = datasets["errata"]
    keys = [key for key in LINES if key in data["formula"].values][::-1]
    place = np.arange(len(keys))
    figure, ax = style.sheet(size=(7.4, 0.24 * len(keys) + 1.4))
    looks = (("printed", style.OKABE_ITO[1], "o", "as printed"), ("corrected", style.OKABE_ITO[0], "s", "as corrected"))
    for name, colour, marker, label in looks:
        values = np.maximum([float(data[name].sel(formula=key)) for key in keys], LEAST)
        ax.plot(values, place, marker, color=colour, label=label)
    for row, key in zip(place, keys, strict=True):
        if LINES[key].order:
            text = f"order {float(data['order'].sel(formula=key)):.2f}"
            ax.text(float(data["corrected"].sel(formula=key)) / 2, row, text, ha="right", va="center", fontsize=7.5)
    ax.axvline(1e-3, **style.REFERENCE)
    ax.axvline(1e-10, **style.REFERENCE)
    ax.set(xscale="log", xlim=(LEAST / 3, 30), xlabel="relative residual [1]; zero at the left edge")
    ax.set_yticks(place, [f"{LINES[key].where}  {LINES[key].rated}" for key in keys])
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, 1.0))
    style.note(figure, datasets, "dashed: bounds of the checks, 1e-3 and 1e-10")
    return figure
