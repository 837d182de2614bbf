"""Figures of the relaxing ellipse carried by level sets and by Lagrangian markers."""

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import twin
from fsiwork.studies.histories import history

LOOK = {
    "markers": ("markers (3.1)-(3.8)", style.OKABE_ITO[6], "o", "-"),
    "phi": ("level set, φ", style.OKABE_ITO[0], "s", "--"),
    "map": ("level set, φ₀(Y)", style.OKABE_ITO[1], "^", ":"),
}


def lagrangian_twin(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Above: half-axis along x over time on the finest grid; below: time of its first minimum over the grid step."""
    data = datasets["lagrangian_twin"]
    cells = sorted(int(n) for n in data["cells"].values)
    figure, panels = style.sheet(2, 2, size=(9.0, 6.0))
    for (above, below), law in zip(panels.T, twin.LAWS, strict=True):
        for carrier, (label, colour, marker, dashes) in LOOK.items():
            if carrier not in data["carrier"].values:
                continue
            t, q = history(data, "axis_x", carrier=carrier, law=law, cells=cells[-1])
            above.plot(t, q, color=colour, linestyle=dashes, label=label)
            times = [measured[f"{law}_{carrier}_time_{n}"] for n in cells]
            end = measured[f"{law}_{carrier}_limit"]
            below.plot([1 / n for n in cells], times, color=colour, marker=marker, linestyle=dashes)
            below.plot([0], [end], color=colour, marker=marker, fillstyle="none", clip_on=False)
        above.set(title=f"{law}, N = {cells[-1]}", xlabel="time t [T]", ylabel="half-axis along x [L]")
        below.set(xlabel="1/N [1]; 0: extrapolated", ylabel="time of the first minimum [T]", xlim=(0, None))
    panels[0, 0].legend()
    style.note(figure, datasets, "ε = 4 Δx; markers Δx/2 apart, cosine δ of half-width 2 Δx; μ = 0.01, walls")
    return figure
