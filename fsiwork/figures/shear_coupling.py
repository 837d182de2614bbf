"""Figure of the stabilised scheme for shear."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.bodies.shear import LIMIT
from fsiwork.figures import style
from fsiwork.studies import shear_coupling as study

STARTS = {"alike": "strained alike, t₀ = π", "printed": "(3.67), t₀ = π", "mild": "strained alike, t₀ = 1"}
STEP = r"$\sqrt{c_s}$ Δt"


def coupling_shear(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """The explicit limit by bisection; kinetic energy over time at four steps; its error over the step."""
    data = datasets["coupling_shear"]
    figure, (left, middle, right) = style.sheet(1, 3, size=(12.0, 4.0))
    for k, (start, name) in enumerate(STARTS.items()):
        left.plot(data["cells"], data["limit"].sel(start=start), "os^"[k], color=style.OKABE_ITO[k], label=name)
    style.band(left, LIMIT, 0.3 * LIMIT, "2.8, and 30 %")
    left.set(xlabel="cells N along a side", ylabel="largest explicit Δt over Δx√(ρε/M) [1]", ylim=(0, None))
    left.set(title="explicit limit", xticks=data["cells"].values)
    finest = data.sel(cells=data["cells"].max())
    one = finest.sel(start="alike")
    middle.plot(one["t"], one["kinetic"], color="black", label="explicit, a quarter of its limit")
    for k, colour in enumerate(style.shades(study.LENGTHS.size)):
        run = one[f"kinetic_stabilised_{k}"]
        middle.plot(one["t"], run, color=colour, label=f"stabilised, {STEP} = {study.LENGTHS[k]:g} ε")
    middle.set(xlabel="t [T]", ylabel="kinetic energy [M L²/T²]", title=f"strained alike, N = {int(one['n_cells'])}")
    middle.set(ylim=(0, 1.35 * float(one["kinetic"].max())))
    _errors(right, data)
    for ax in (left, middle, right):
        ax.legend(fontsize=7, loc="lower right" if ax is not middle else "upper right")
    worst = float(data["energy"].max())
    text = f"ε = 3 Δx, μ = 0.01; to {study.MULTIPLES.max():g} × 2.8 Δx√(ρε/M) energy ≤ {worst:.3f} × the first"
    style.note(figure, datasets, text)
    return figure


def _errors(ax, data: xr.Dataset) -> None:
    for n, dash in zip(data["cells"].values, ("--", "-", "-.", ":"), strict=False):
        for coupling in ("explicit", "stabilised"):
            worst = np.max([study.errors(data.sel(start=s, cells=n), coupling) for s in STARTS], axis=0)
            look = {**style.COUPLING[coupling], "linestyle": dash}
            ax.plot(study.LENGTHS, worst, label=f"{coupling}, N = {int(n)}", **look)
    ax.plot(*zip(*study.MEASURED.items(), strict=True), "k_", markersize=14, label="MEASURED-coupling 6")
    ax.set(xscale="log", yscale="log", xlabel=f"{STEP} over ε [1]", title="worst of the three starts")
    ax.set(ylabel="largest error of the kinetic energy [% of its most]")
    ax.set_xticks(study.LENGTHS, [f"{q:g}" for q in study.LENGTHS])
    ax.minorticks_off()
