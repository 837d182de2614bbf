"""Figure of the stabilised scheme for bending."""

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import bending


def coupling_bending(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Left: half-axis over time on the finest grid, walls; right: error over the step, both boxes."""
    data = bending.numbered(datasets["coupling_bending"])
    finest, found = data["cells"].max(), bending.errors(data)
    figure, (left, right) = style.sheet(1, 2, size=(9.0, 3.8))
    for multiple, colour in zip(data["multiple"].values, style.shades(data.sizes["multiple"]), strict=True):
        one = data.sel(edges="walls", cells=finest, multiple=multiple)
        label = "explicit" if multiple < 1 else f"stabilised, {multiple:g} times the explicit limit"
        left.plot(one["t"], one["axis"], color=colour, label=label)
    left.set(xlabel="t [T]", ylabel="half-axis along x [L]", title=f"walls, N = {int(finest)}")
    left.legend(fontsize=7)
    for k, edges in enumerate(data["edges"].values):
        for n, marker in zip(data["cells"].values, "os", strict=False):
            one = found.sel(edges=edges, cells=n).isel(multiple=slice(1, None))
            right.plot(one["multiple"], one, marker=marker, color=style.OKABE_ITO[k], label=f"{edges}, N = {int(n)}")
    for level in (1.0, 3.0):
        right.axhline(level, **style.REFERENCE)
    right.set(xscale="log", yscale="log", xlabel="Δt over ½Δx²√(ρε/k) [1]", ylabel="largest error [% of the travel]")
    right.legend(fontsize=7)
    style.note(figure, datasets, "k = 0.1, λ = 1, μ = 0.1, ε = 6 Δx; explicit at half its limit as reference")
    return figure
