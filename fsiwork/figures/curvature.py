"""Figures of curvatures: errors of H and G against the grid step."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style

SURFACES = {
    "torus": ("torus, distance", style.OKABE_ITO[0], "o"),
    "ellipsoid-distance": ("ellipsoid, distance", style.OKABE_ITO[1], "s"),
    "ellipsoid-redistanced": ("ellipsoid, redistanced (quintic)", style.OKABE_ITO[3], "x"),
    "ellipsoid-quadratic": ("ellipsoid, quadratic φ", style.OKABE_ITO[2], "^"),
}


def curvature_7_1(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Largest relative errors near the surface over the cells, second order full, fourth order dashed."""
    data = datasets["curvature"].sortby("cells")
    figure, axes = style.sheet(1, 2, size=(9.0, 4.2), sharex=True, sharey=True)
    for ax, name, letter in zip(axes, ("mean", "gauss"), ("H", "G"), strict=True):
        for shape, (label, colour, marker) in SURFACES.items():
            for order, dashes in ((2, "-"), (4, "--")):
                one = data[name].sel(surface=shape, order=order)
                ax.plot(
                    one["cells"], one, color=colour, marker=marker, linestyle=dashes, label=f"{label}, order {order}"
                )
        for order, start in ((2, 0.1), (4, 2e-4)):
            cells = np.array([48.0, 128.0])
            ax.plot(cells, start * (48 / cells) ** order, **style.REFERENCE)
            ax.text(70, start * (48 / 70) ** order * 1.5, f"order {order}", fontsize=7.5, color="0.35", va="bottom")
        ax.set(xscale="log", yscale="log", xlabel="N, cells along a side", title=f"{letter}, near the surface")
        ticks = data["cells"].values
        ax.set_xticks(ticks, [str(int(t)) for t in ticks])
        ax.set_xticks([], minor=True)
    axes[0].set_ylabel("largest error / largest exact value [1]")
    axes[1].legend(loc="lower right", bbox_to_anchor=(1.0, 0.2), fontsize=7)
    style.note(figure, datasets, "nodes within Δx of the surface; box [−1, 1]³")
    return figure
