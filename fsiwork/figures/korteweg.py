"""Figure of the Korteweg form of a membrane's force: differences of the velocities, pressures."""

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies.korteweg import FORMS


def korteweg(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Left: by how much the velocities of both forms differ at the end, over N. Right: the pressures of the membrane
    along a line through the middle on the finest grid, which differ by E'|∇φ|D_ε."""
    data = datasets["korteweg"].sortby("cells")
    figure, (left, right) = style.sheet(1, 2, size=(10.5, 4.2))
    cells = data["cells"].values.astype(float)
    for k, law in enumerate(data["law"].values):
        for width, dashes, marker in (("length", "-", "o"), ("cells", ":", "s")):
            words = "ε fixed" if width == "length" else "ε = 6 Δx"
            one = 100 * data["difference"].sel(law=law, width=width)
            left.plot(cells, one, dashes, marker=marker, color=style.OKABE_ITO[k], label=f"{law}, {words}")
    first = 0.6 * 100 * float(data["difference"].sel(width="length").isel(cells=0).min())
    left.plot(cells, first * (cells[0] / cells) ** 2, **style.REFERENCE)
    left.text(cells[0], 0.85 * first, "order 2", fontsize=7.5, color="0.35", va="top")
    left.plot([cells[0], 128], [5, 5], color="0.35", linewidth=0.8)
    left.text(128, 4.9, "5 %", fontsize=7.5, color="0.35", va="top", ha="right")
    left.set(xscale="log", yscale="log", xlabel="N, cells along a side", ylabel="difference of velocities, rms [%]")
    left.set_xticks(cells, [str(int(n)) for n in cells])
    left.set_xticks([], minor=True)
    left.legend(fontsize=7)
    last = data.sel(law="membrane", width="length").isel(cells=-1)
    for form, words, dashes in zip(FORMS, ("(3.16)", "(3.24)"), ("-", "--"), strict=True):
        right.plot(last["x"], last[f"p_{form}"], dashes, label=f"{form} {words}")
    right.set(xlabel="x [L], y in the middle", ylabel="p − p at the wall [energy/volume]")
    right.legend()
    style.note(figure, datasets, "ellipse 0.75 × 0.5, t = 0.5 T, explicit; ε fixed: 0.1875 L; plain D_ε")
    return figure
