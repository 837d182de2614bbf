"""Figure of the markers (1.1): the line and its stretching at t = 2."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies.markers import TIMES


def fig_1_1(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """The line at five times, coloured by the stretching at t = 2; stretching over the parameter; errors."""
    data = datasets["markers"].sortby("longest")
    one = data.sel(tangents="carried").isel(longest=0)
    figure, (left, middle, right) = style.sheet(1, 3, size=(11.5, 3.9), gridspec_kw={"width_ratios": (1.15, 1, 1)})
    _line(figure, left, one)
    middle.plot(one["theta"], one["stretch_exact"], **style.REFERENCE, label="DOP853", zorder=3)
    middle.plot(one["theta"], one["stretch"], ".", markersize=3, label="markers")
    middle.set(yscale="log", xlabel="θ, parameter on the circle [1]", ylabel="stretching |∂γ/∂θ| / |∂γ₀/∂θ| [1]")
    middle.set_title("stretching at t = 2")
    middle.legend()
    _errors(right, data)
    style.note(figure, datasets, "u = (−sin²πx sin 2πy, sin 2πx sin²πy)")
    return figure


def _line(figure: Figure, ax, one: xr.Dataset) -> None:
    lines = np.stack([one[c].values.reshape(len(TIMES), -1) for c in "xy"], axis=1)
    lines = np.concatenate([lines, lines[..., :1]], axis=2)
    for k, time in enumerate(TIMES[:-1]):
        x, y = lines[k]
        ax.plot(x, y, color="0.25", linewidth=0.9, alpha=0.35 + 0.15 * k)
        tip = int(np.argmax(y if k == 0 else 2 * x + y))
        ax.annotate(f"t = {time:g}", (x[tip], y[tip]), (2, 3), textcoords="offset points", fontsize=7)
    x, y = lines[-1]
    points = lines[-1].T
    norm = LogNorm(float(one["stretch"].min()), float(one["stretch"].max()))
    line = LineCollection(
        np.stack([points[:-1], points[1:]], axis=1), array=one["stretch"].values, norm=norm, cmap=style.SEQUENTIAL
    )
    line.set_linewidth(2.2)
    ax.add_collection(line)
    ax.plot(x[:-1:8], y[:-1:8], ".", color="black", markersize=2.5, zorder=4)
    figure.colorbar(line, ax=ax, label="stretching at t = 2 [1]", shrink=0.85)
    ax.set(xlim=(0, 1), ylim=(0, 1), aspect="equal", xlabel="x [1]", ylabel="y [1]")
    ax.set_title("markers carried to t = 2 (every eighth shown)")


def _errors(ax, data: xr.Dataset) -> None:
    for tangents, dashes in (("carried", "-"), ("differences", "--")):
        for name, colour, marker in (("position", 0, "o"), ("stretching", 1, "s")):
            errors = data[f"{name}_error"].sel(tangents=tangents)
            label = f"{name}, tangents {tangents if tangents == 'carried' else 'by differences'}"
            ax.plot(data["longest"], errors, dashes, color=style.OKABE_ITO[colour], marker=marker, label=label)
    style.band(ax, 1e-6, label="asked for: 1e-6")
    longest = data["longest"].values
    start = float(data["position_error"].sel(tangents="carried")[-1])
    ax.plot(longest, 0.3 * start * (longest / longest[-1]) ** 4, ":", color="0.35", label="order 4")
    ax.set(xscale="log", yscale="log", xlabel="longest segment [1]", ylabel="largest relative error [1]")
    ax.set_xticks(longest, [f"{q:g}" for q in longest])
    ax.set_xticks([], minor=True)
    ax.set_title("against DOP853, every marker, t ≤ 2")
    ax.set_ylim(3e-5 * float(data["position_error"].min()), None)
    ax.legend(fontsize=7, loc="lower right")
