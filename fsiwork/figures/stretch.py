"""Figure of the stretch in a compressible flow: the flow and a membrane in it, errors of stretch and energy."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import stretch


def compressible_stretch(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Left: the ellipse before and after, coloured by its stretch. Middle: largest error of J|∇φ|/|∇φ₀(Y)|. Right:
    errors of the energies with the corrected weight and with the printed one."""
    data = datasets["compressible_stretch"].sortby("cells")
    figure, (flow, error, energy) = style.sheet(1, 3, size=(13.0, 4.2))
    _flow(figure, flow)
    cells = data["cells"].values.astype(float)
    for k, case in enumerate(data["case"].values):
        error.plot(cells, data["error"].sel(case=case), "-o", color=style.OKABE_ITO[k], label=str(case))
        name = "energy_membrane"
        energy.plot(cells, data[name].sel(case=case), "-o", color=style.OKABE_ITO[k], label=f"{case}, corrected")
    for k, case in enumerate(data["case"].values):
        printed = data["printed_membrane"].sel(case=case)
        energy.plot(cells, printed, ":s", color=style.OKABE_ITO[k], label=f"{case}, as printed")
    for ax, least in ((error, data["error"]), (energy, data["energy_membrane"])):
        start = 0.7 * float(least.isel(cells=0).min())
        ax.plot(cells, start * (cells[0] / cells) ** 2, **style.REFERENCE)
        ax.text(cells[0], 0.85 * start, "order 2", fontsize=7.5, color="0.35", va="top")
        ax.set(xscale="log", yscale="log", xlabel="N, cells along a side")
        ax.set_xticks(cells, [str(int(n)) for n in cells])
        ax.set_xticks([], minor=True)
    error.set(ylabel="largest relative error [1]", title="J|∇φ|/|∇φ₀(Y)| against the exact stretch")
    energy.set(ylabel="relative error [1]", title="∫½(s − 1)²: weight corrected or printed")
    energy.set_ylim(top=40 * float(data["printed_membrane"].max()))
    error.legend()
    energy.legend(ncols=2, fontsize=7, loc="upper right")
    style.note(
        figure, datasets, f"t = {stretch.END:g} T, ε = {stretch.EPS:g} Δx; box [−{stretch.SIDE:g}, {stretch.SIDE:g}]"
    )
    return figure


def _flow(figure: Figure, ax) -> None:
    """The velocity, the ellipse at first (grey) and at the end, coloured by its exact stretch."""
    s = np.linspace(-0.75, 0.75, 11)
    x, y = np.meshgrid(s, s)
    u = stretch.velocity(np.stack([x.ravel(), y.ravel()], axis=1))[0]
    ax.quiver(x.ravel(), y.ravel(), u[:, 0], u[:, 1], color="0.7", width=0.004)
    shape = stretch.CASES["ellipse"]
    first = shape.quadrature(300)[0]
    first = np.vstack([first, first[:1]])
    last, F = stretch.moved(first, stretch.END)
    values = stretch.stretch(F, shape.gradient(first))
    ax.plot(first[:, 0], first[:, 1], **style.REFERENCE)
    pieces = LineCollection(np.stack([last[:-1], last[1:]], axis=1), cmap=style.SEQUENTIAL, linewidths=3)
    pieces.set_array(values[:-1])
    ax.add_collection(pieces)
    figure.colorbar(pieces, ax=ax, label="exact stretch s [1]", shrink=0.85)
    ax.set(aspect="equal", xlabel="x [L]", ylabel="y [L]", title="ellipse at t = 0 (dashed) and at the end")
