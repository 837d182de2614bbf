"""Figure of smeared Diracs: errors of lengths and areas over ε and over Δx."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies.diracs import CELLS, CURVES, KINDS, SCALINGS, SURFACES

COLOURS, MARKERS = style.OKABE_ITO[:4], "os^D"
LOOKS = {
    "renormalised": (f"cosine, ε = {CELLS} Δx", ":"),
    "one-norm": ("hat, 1-norm, ε = Δx", "-."),
    "area": ("height functions", "-"),
    "volume": ("volume, height functions", "--"),
}


def dirac_order(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Length over ε with the values without a grid; lengths of curves in space and areas of surfaces over Δx."""
    figure, axes = style.sheet(1, 3, size=(13.0, 4.6))
    for ax in axes:
        ax.set(xscale="log", yscale="log")
    _widths(axes[0], datasets["dirac_widths"])
    _curves(axes[1], datasets["dirac_curves"], datasets["dirac_steps"])
    _surfaces(axes[2], datasets["dirac_surfaces"])
    axes[0].set_ylabel("relative error [1]")
    style.note(figure, datasets, "means of |error| over random sub-cell shifts")
    return figure


def _widths(ax, data: xr.Dataset) -> None:
    """Marks are sums on the grid, lines the exact integrals of the smeared ellipse."""
    data = data.sortby("width")
    looks = zip(((k, s) for s in SCALINGS for k in KINDS), COLOURS, MARKERS, strict=True)
    for (kind, scaling), colour, marker in looks:
        one = data.sel(kind=kind, scaling=scaling)
        ax.plot(one["width"], one["limit"], color=colour)
        ax.plot(one["width"], one["error"], color=colour, marker=marker, linestyle="none", label=f"{kind}, {scaling}")
    ax.plot([], [], color="0.4", label="the same without a grid")
    _order(ax, (16, 32), 1.5e-3, 2)
    _ticks(ax, data["width"].values)
    ax.set(xlabel="ε/Δx [1], Δx fixed", title="Length of an ellipse, φ = x²/a² + y²/b² − 1")
    ax.set_ylim(1e-5, 3e-2)
    ax.legend(fontsize=7, loc="lower right")


def _curves(ax, data: xr.Dataset, steps: xr.Dataset) -> None:
    data = data.sortby("cells")
    for name, colour, marker in zip(CURVES, COLOURS, MARKERS, strict=False):
        for kind, dashes in zip(KINDS, ("-", "--"), strict=True):
            label = f"{name} in space, {kind}, ε = {CELLS} Δx"
            one = data["error"].sel(curve=name, kind=kind)
            ax.plot(2 / data["cells"], one, color=colour, marker=marker, linestyle=dashes, label=label)
    narrow = steps["error"].sortby("step")
    ax.plot(narrow["step"], narrow, color=COLOURS[3], marker="D", linestyle="-.", label="ellipse, hat, 1-norm, ε = Δx")
    _order(ax, (0.025, 0.1), 1.2e-3, 1.5)
    _order(ax, (0.02, 0.05), 9e-3, 2)
    _ticks(ax, (0.0125, 0.025, 0.05, 0.1))
    ax.set_ylim(bottom=2e-5)
    ax.set(xlabel="Δx [length]", title="Length of curves: ε⁻²ζζ|∇φ¹ × ∇φ²|, and 1-norm")
    ax.legend(fontsize=6.5, loc="lower right")


def _surfaces(ax, data: xr.Dataset) -> None:
    data = data.sortby("cells")
    for name, colour, marker in zip(SURFACES, COLOURS, MARKERS, strict=False):
        for measure, (_, dashes) in LOOKS.items():
            one = data[measure.replace("-", "_")].sel(surface=name)
            ax.plot(2 / data["cells"], one, color=colour, marker=marker, linestyle=dashes)
        ax.plot([], [], color=colour, marker=marker, linestyle="none", label=name)
    for label, dashes in LOOKS.values():
        ax.plot([], [], color="0.4", linestyle=dashes, label=label)
    _order(ax, (0.021, 0.06), 8e-3, 2)
    _order(ax, (0.021, 0.06), 1.2e-9, 6)
    _ticks(ax, (0.02, 0.03, 0.04, 0.06))
    ax.set(xlabel="Δx [length]", title="Area of surfaces, and volume inside")
    ax.set_ylim(1e-18, 1)
    ax.legend(fontsize=7, loc="lower right", ncols=2)


def _ticks(ax, values) -> None:
    ax.set_xticks(values, [f"{v:g}" for v in values])
    ax.set_xticks([], minor=True)


def _order(ax, ends: tuple[float, float], start: float, order: float) -> None:
    """A reference of an order from its low end, named at the high one."""
    x = np.array(ends, float)
    ax.plot(x, start * (x / x[0]) ** order, **style.REFERENCE)
    end = 1.1 * start * (x[1] / x[0]) ** order
    ax.text(x[1], end, f"order {order:g}", fontsize=7.5, color="0.35", ha="right", va="bottom")
