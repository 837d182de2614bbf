"""Figure of curves in space: the helix and the trefoil in colours of curvature and torsion, and errors."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.colors import Normalize, SymLogNorm
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from fsiwork.figures import style
from fsiwork.studies.curves import CURVES, QUANTITIES

LABEL = {"curvature": "curvature H [1/length]", "torsion": "torsion [1/length]"}


def curves(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """The curves from the finest grid, fourth order; curvature and torsion along the knot; errors over N."""
    data = datasets["curves"].sortby("cells")
    finest = data.sel(order=4).isel(cells=-1)
    figure = Figure(figsize=(11.5, 7.2))
    helix, knot = finest.sel(curve="helix"), finest.sel(curve="trefoil")
    top = float(max(helix["curvature"].max(), knot["curvature"].max()))
    _curve(figure, 231, helix, "curvature", Normalize(0, top))
    _curve(figure, 232, knot, "curvature", Normalize(0, top))
    reach = float(abs(knot["torsion"]).max())
    _curve(figure, 233, knot, "torsion", SymLogNorm(0.1, vmin=-reach, vmax=reach))
    _along(figure.add_subplot(234), knot)
    first = figure.add_subplot(235)
    _errors(first, data, "helix")
    _errors(figure.add_subplot(236, sharey=first), data, "trefoil")
    style.note(figure, datasets, "errors in parts of the largest exact value, at 512 points of the curve")
    return figure


def _curve(figure: Figure, place: int, one: xr.Dataset, label: str, norm) -> None:
    ax = figure.add_subplot(place, projection="3d")
    x = np.stack([one[c].values for c in "xyz"], axis=1)
    x = np.concatenate([x, x[:1]]) if one["curve"] == "trefoil" else x
    cmap = style.DIVERGING if label == "torsion" else style.SEQUENTIAL
    line = Line3DCollection(np.stack([x[:-1], x[1:]], axis=1), array=one[label].values, norm=norm, cmap=cmap)
    line.set_linewidth(3.5)
    ax.add_collection3d(line)
    low, high = x.min(0), x.max(0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]), xlabel="x [1]", ylabel="y [1]")
    ax.set_zlabel("z [1]", labelpad=-2)
    ax.set_box_aspect(high - low)
    ax.tick_params(labelsize=6, pad=-1)
    ax.locator_params(nbins=4)
    ax.view_init(elev=50, azim=-70)
    ax.set_title(f"{one['curve'].item()}, {label}")
    figure.colorbar(line, ax=ax, label=LABEL[label], shrink=0.7, pad=0.16)


def _along(ax, knot: xr.Dataset) -> None:
    for label, colour in zip(QUANTITIES, style.OKABE_ITO, strict=False):
        ax.plot(knot["theta"], knot[label], color=colour, label=label)
        ax.plot(knot["theta"], knot[f"{label}_exact"], **style.REFERENCE, label="exact" if label == "torsion" else None)
    ax.set_yscale("symlog", linthresh=1.0)
    ax.set(xlabel="θ [rad]", ylabel="H, torsion [1/length]", title="along the trefoil")
    ax.legend(loc="center", bbox_to_anchor=(0.42, 0.45), facecolor="white", frameon=True, framealpha=0.9)


def _errors(ax, data: xr.Dataset, name: str) -> None:
    cells = data["cells"].values
    for order, dashes in ((2, "-"), (4, "--")):
        for k, (label, marker) in enumerate(zip(QUANTITIES, "os", strict=True)):
            errors = data[f"{label}_error"].sel(curve=name, order=order)
            ax.plot(cells, errors, dashes, color=style.OKABE_ITO[k], marker=marker, label=f"{label}, order {order}")
        start = 0.5 * float(data["curvature_error"].sel(curve=name, order=order)[0])
        ax.plot(cells, start * (cells[0] / cells) ** order, **style.REFERENCE)
        ax.annotate(f"order {order}", (cells[-1], start * (cells[0] / cells[-1]) ** order), (-4, -9), fontsize=7,
                    textcoords="offset points", ha="right", color="0.35")  # fmt: skip
    ax.set(xscale="log", yscale="log", xlabel="N, cells along a side", ylabel="largest error / largest value [1]")
    ax.set_xticks(cells, [str(int(n)) for n in cells])
    ax.set_xticks([], minor=True)
    ax.set_title(f"{name}, box {CURVES.index(name) * 2 + 4} wide")
    ax.legend(fontsize=7)
