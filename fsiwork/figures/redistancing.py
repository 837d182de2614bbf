"""Figures of redistancing: error, drift and time of the methods beside scikit-fmm."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style

# label, colour, marker, its size, dashes; the large hollow ones are seen where curves coincide
STYLES = {
    "pde": ("PDE (1.36), smoothed sign", 0, "o", 4, "-"),
    "subcell": ("PDE, subcell fix", 0, "s", 4, "--"),
    "fast-marching-1": ("fast marching, order 1", 2, "^", 4, "-"),
    "fast-marching-2": ("fast marching, order 2", 2, "v", 4, "--"),
    "fast-sweeping": ("fast sweeping", 5, "x", 6, ":"),
    "renormalisation": ("renormalisation 1.5.2", 4, "D", 4, "-"),
    "closest-cubic": ("closest point, cubic", 1, "o", 8, "-"),
    "closest-quintic": ("closest point, quintic", 1, "s", 4, "--"),
    "sweep": ("closest points, raster sweeps", 3, "P", 4, "-."),
    "scikit-fmm-1": ("scikit-fmm, order 1", 6, "o", 9, ":"),
    "scikit-fmm-2": ("scikit-fmm, order 2", 6, "s", 11, "-."),
}


def redistancing(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Error near the interface and times over N, and how far repeats move the interface."""
    data = datasets["redistancing"].sortby("cells")
    moved = datasets["redistancing_drift"].sortby("repeats")
    figure, (error, drift, time) = style.sheet(1, 3, size=(10.5, 4.9))
    for name, (label, colour, marker, size, dashes) in STYLES.items():
        look = {"color": style.OKABE_ITO[colour], "marker": marker, "linestyle": dashes, "label": label}
        look |= {"markersize": size} | ({"markerfacecolor": "none"} if size > 6 else {})
        at = data.sel({"method": name})
        if not np.isfinite(at["near"]).any():
            continue  # the peer is not installed
        error.plot(at["cells"], at["near"] * at["cells"], **look)
        time.plot(at["cells"], at["ms"], **look)
        if name in moved["method"]:
            drift.plot(moved["repeats"], moved["moved"].sel({"method": name}), **look)
    cells = np.array([64.0, 512.0])
    for order, start in ((2, 0.012), (4, 4e-5), (6, 4e-7)):
        error.plot(cells, start * (64 / cells) ** (order - 1), **style.REFERENCE)
        error.text(540, start / 8 ** (order - 1), f"{order}", fontsize=7.5, color="0.35", va="center")
    ticks = data["cells"].values
    for ax in (error, time):
        ax.set(xscale="log", yscale="log", xlabel="N, cells along a side")
        ax.set_xticks(ticks, [str(int(t)) for t in ticks])
        ax.set_xticks([], minor=True)
    error.set(ylabel="largest error within 1.2 Δx [Δx]", title="Error near the interface\n(dashed grey: orders)")
    drift.set(xscale="log", yscale="log", xlabel="times redistanced", ylabel="interface moved by [Δx]")
    drift.set_title("Drift, N = 128")
    time.set(ylabel="CPU time, one core [ms]", title="Time of one redistancing")
    handles, labels = error.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=7.5)
    text = "time is of this run's machine; bands: closest points 6 Δx, PDE 10 Δx, the rest the whole box"
    style.note(figure, datasets, text if "scikit-fmm, order 2" in labels else f"{text}; scikit-fmm is not installed")
    return figure
