"""Figure of bending without motion: errors of the force over the grid, energies of tori."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import willmore


def willmore_energy(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Left: largest error of k[Δ_ΓH + ½H(H² − 4G)] near the surface; right: ½∫H² of tori over R/r."""
    forces, energies = datasets["willmore_force"].sortby("cells"), datasets["willmore_energy"].sortby("cells")
    figure, (left, right) = style.sheet(1, 2, size=(9.0, 4.0))
    for k, surface in enumerate(forces["surface"].values):
        for form, dashes, marker in (("pointwise", "-", "o"), ("divergence", "--", "s")):
            one = forces["error"].sel(surface=surface, form=form)
            left.plot(one["cells"], one, dashes, color=style.OKABE_ITO[k], marker=marker, label=f"{surface}, {form}")
    cells = np.array([float(forces["cells"][0]), float(forces["cells"][-1])])
    left.plot(cells, 0.02 * (cells[0] / cells) ** 2, **style.REFERENCE)
    left.text(cells[1], 0.02 * (cells[0] / cells[1]) ** 2, "order 2", fontsize=7.5, color="0.35", va="top", ha="right")
    left.set(
        xscale="log", yscale="log", xlabel="N, cells along a side", ylabel="largest error / largest exact value [1]"
    )
    ticks = forces["cells"].values
    left.set_xticks(ticks, [str(int(t)) for t in ticks])
    left.set_xticks([], minor=True)
    left.legend(fontsize=7)
    fine = np.linspace(willmore.RATIOS[0], willmore.RATIOS[-1], 100)
    right.plot(fine, willmore.exact_energy(fine) / (4 * np.pi**2), color="0.35", label="exact")
    for k, n in enumerate(energies["cells"].values):
        values = energies["tori"].sel(cells=n) / (4 * np.pi**2)
        right.plot(willmore.RATIOS, values, "o", color=style.OKABE_ITO[k], markersize=4, label=f"N = {int(n)}")
    right.axvline(np.sqrt(2), **style.REFERENCE)
    right.set(xlabel="R/r [1]; dashed: √2", ylabel="½∫H² / 4π² [1]")
    right.legend(fontsize=7)
    style.note(figure, datasets, f"box [−1, 1]³, ε = {willmore.EPS:g} Δx; nodes within Δx of the surface")
    return figure
