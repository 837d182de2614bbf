"""Figure of the energy law (3.23)."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import balance, energy

Datasets, Measured = Mapping[str, xr.Dataset], Mapping[str, float]


def energy_law(datasets: Datasets, measured: Measured) -> Figure:
    """Above: total residual of (3.23) over Δt and over Δx, and its growth in time for membrane and drop. Below: what of
    it belongs to Δt, and what to Δx, for every scene with an elastic body."""
    figure = Figure(figsize=(11.4, 8.2))
    above, below = figure.subfigures(2, 1, height_ratios=[3.5, 4.7])
    left, middle, right = above.subplots(1, 3)
    _scenes(below.subplots(1, 2, sharey=True), balance.scenes(datasets), measured)
    _energy_steps(left, energy.totals(datasets["energy_steps"]).sortby("step"), measured)
    _energy_grids(middle, energy.totals(datasets["energy_grids"]).sortby("cells"), measured)
    for k, name in enumerate(("membrane", "drop")):
        data = datasets[f"energy_bodies_{name}"]
        sums = energy.residuals(data).cumsum("row")
        label = f"{name}: {measured[f'total_{name}']:.3f} at the end"
        right.plot(data["t_step"], sums, color=style.OKABE_ITO[k], linestyle=("-", "--")[k], label=label)
    for sign in (-1, 1):
        right.axhline(0.15 * sign, **style.REFERENCE)
    cells = int(datasets["energy_bodies_drop"]["n_cells"])
    right.set(title=f"Sum over time, {cells}² cells, ε = 6 Δx", xlabel="time", ylim=(-0.2, 0.26))
    right.set_ylabel("sum of residuals / excess energy")
    right.legend(loc="upper right")
    style.note(figure, datasets, f"largest residual of one step: {measured['step_largest']:.1e} of the excess energy")
    return figure


def _energy_steps(ax, total: xr.DataArray, measured: Measured) -> None:
    """Differences of successive totals: what the larger of two steps adds."""
    steps, change = total["step"].values[1:], np.abs(np.diff(total.values))
    label = f"order ≥ {measured['order_step']:.2f}"
    ax.plot(steps, change, color=style.OKABE_ITO[0], marker="s", label=label)
    ax.plot(steps, change[-1] * steps / steps[-1], label="order 1", **style.REFERENCE)
    ax.set(xscale="log", yscale="log", xlabel="Δt", title="Part of the time step")
    ax.set_ylabel("|total(Δt) − total(Δt/2)| / excess")
    ax.set_xticks(steps, [f"{q:.3g}" for q in steps])
    ax.minorticks_off()
    ax.legend(loc="upper left")


def _energy_grids(ax, total: xr.DataArray, measured: Measured) -> None:
    cells = total["cells"].values.astype(float)
    labels = {"plain": f"plain D: order ≥ {measured['order_grid']:.2f}", "renormalised": "renormalised D"}
    for k, (dirac, label) in enumerate(labels.items()):
        values = abs(total.sel(dirac=dirac)).values
        look = {"color": style.OKABE_ITO[k], "marker": "so"[k], "linestyle": ("-", "--")[k]}
        ax.plot(cells, values, label=label, **look)
    first = float(abs(total.sel(dirac="plain"))[0])
    ax.plot(cells, first * cells[0] / cells, label="order 1", **style.REFERENCE)
    ax.set(xscale="log", yscale="log", xlabel="cells along a side", title="Grid, ε fixed in length")
    ax.set_ylabel("|total residual| / excess")
    ax.set_xticks(cells, [f"{q:.0f}" for q in cells])
    ax.minorticks_off()
    low, high = ax.get_ylim()
    ax.set_ylim(low, 6 * high)
    ax.legend(loc="upper right")


def _scenes(axes, found: Mapping[str, xr.Dataset], measured: Measured) -> None:
    """A row for each scene: its part of the time step (left) and of the grid; open: the coarser, full: the finer."""
    step, grid = axes
    for k, (name, data) in enumerate(found.items()):
        for ax, part, kind, colour in ((step, "of_step", "step", 0), (grid, "of_grid", "grid", 1)):
            values, look = data[part].values, {"color": style.OKABE_ITO[colour], "linestyle": "none", "marker": "o"}
            ax.plot(values[[0, -1]], [k, k], color="0.7", linewidth=1.0, zorder=1)
            ax.plot(values[:-1], [k] * (values.size - 1), markerfacecolor="1", **look)
            ax.plot(values[-1], k, **look)
            order = f"{measured[f'order_{kind}_{name}']:.2f}"
            ax.text(1.01, k, order, fontsize=7.5, va="center", transform=ax.get_yaxis_transform())
    step.set_yticks(range(len(found)), [name.replace("_", " ") for name in found])
    step.set(title="Every scene: part of Δt, at a step and at half of it", ylim=(len(found) - 0.5, -0.5))
    grid.set(title="Every scene: part of Δx, on two grids, ε fixed in length")
    for ax in axes:
        ax.set(xscale="log", xlabel="sum over tenths of |residual| / energy dissipated and set in motion")
        ax.text(1.01, -0.8, "order", fontsize=7.5, va="bottom", transform=ax.get_yaxis_transform())
