"""The picture on the README's first screen: a stretched membrane relaxes (`make pictures`)."""

import sys

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style

RADIUS = np.sqrt(0.75 * 0.5)  # of the circle with the ellipse's area: the exact equilibrium
TIMES = (0.1, 0.3, 4.0)


def membrane(ds: xr.Dataset) -> Figure:
    """Pressure, flow and interface at three times, and the half-axes over time with the exact radius at rest.

    ``ds``: a run of configs/scenes/elliptic_membrane.yaml with ``u``, ``v``, ``p`` and ``phi``.
    """
    figure = Figure(figsize=(9.6, 2.9))
    places, graph = figure.subfigures(1, 2, width_ratios=(2.35, 1))
    axes = places.subplots(1, 3, sharey=True)
    frames = [ds.sel(t=t, method="nearest") for t in TIMES]
    top = float(np.abs(frames[0]["p"]).quantile(0.99)) * 1.25
    for ax, frame in zip(axes, frames, strict=True):
        image = _snapshot(ax, frame, top)
    axes[0].set(ylabel="y")
    places.colorbar(image, ax=list(axes), shrink=0.7, label="pressure p", extend="both")
    _half_axes(graph.subplots(), ds)
    return figure


def _snapshot(ax, frame: xr.Dataset, top: float):
    x, y = frame["x_c"].values, frame["y_c"].values
    u, v = frame["u"].transpose("y_c", "x_n").values, frame["v"].transpose("y_n", "x_c").values
    u, v = 0.5 * (u[:, 1:] + u[:, :-1]), 0.5 * (v[1:] + v[:-1])  # of the faces on both sides: at centres
    h = x[1] - x[0]
    extent = (x[0] - h / 2, x[-1] + h / 2, y[0] - h / 2, y[-1] + h / 2)
    p = frame["p"].transpose("y_c", "x_c").values
    image = ax.imshow(p, extent=extent, cmap=style.DIVERGING, vmin=-top, vmax=top, interpolation="bilinear")
    some = slice(5, None, 9)
    ax.quiver(x[some], y[some], u[some, some], v[some, some], color="0.1", scale=3.5, width=0.007, pivot="mid")
    ax.contour(x, y, frame["phi"].transpose("y_c", "x_c").values, levels=[0.0], colors="k", linewidths=1.8)
    ax.grid(False)
    ax.set(title=f"t = {float(frame['t']):.1f}", xlabel="x", xticks=(0, 1, 2), yticks=(0, 1, 2))
    return image


def _half_axes(ax, ds: xr.Dataset) -> None:
    ax.plot(ds["t_step"], ds["axis_x"], label="half-axis along x")
    ax.plot(ds["t_step"], ds["axis_y"], "--", label="half-axis along y")
    ax.axhline(RADIUS, label="√(ab), exact at rest", **style.REFERENCE)
    ax.set(xlabel="time t", ylabel="length", xlim=(0, float(ds["t_step"][-1])))
    ax.legend(loc="upper right")


if __name__ == "__main__":  # RUN.nc PICTURE.png
    from fsiwork.dataset import open_run

    with open_run(sys.argv[1]) as run:
        print(style.save(membrane(run), sys.argv[2]))
