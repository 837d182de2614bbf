"""Figure of chapter 2: residuals of its identities over the length of a cell."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies.kinematics import IDENTITIES, PRINTED, STUDIES

GROUPS = {
    "characteristics": ("inverse", "forward", "backward", "gradients"),
    "Jacobians": ("jacobian", "jacobian_eulerian", "cofactor_rate"),
    "change of variables": ("volume", "surface", "normal", "flux", "curve", "tangent", "piola"),
    "Reynolds formulas": ("reynolds_volume", "reynolds_surface", "reynolds_curve"),
    "mass": ("mass_eulerian", "mass_lagrangian", "density"),
}
DASHES = {"plane": "-", "space": "--"}
MARKERS = "os^Dv<>"


def kinematics(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """A panel for each kind of identity, plane full, space dashed, then the two formulas as printed."""
    figure, axes = style.sheet(2, 3, size=(11.5, 7.0), sharex=True, sharey=True)
    data = {place: datasets[name].sortby("cells") for place, name in STUDIES.items()}
    for ax, (title, keys) in zip(axes.ravel(), GROUPS.items(), strict=False):
        for k, key in enumerate(keys):
            _lines(ax, data, key, k, f"({IDENTITIES[key][0]}) order {measured[f'order_{key}']:.2f}")
        _finish(ax, title, data)
    last = axes[1, 2]
    for k, (key, corrected) in enumerate(zip(PRINTED, ("cofactor_rate", "reynolds_curve"), strict=True)):
        _lines(last, data, key, 2 * k, f"({PRINTED[key]}) as printed")
        _lines(last, data, corrected, 2 * k + 1, f"({PRINTED[key]}) corrected")
    _finish(last, "two slips in print", data, "lower right")
    for ax in axes[1]:
        ax.set_xlabel("Δx [1], box of side 1")
    for ax in axes[:, 0]:
        ax.set_ylabel("residual / largest term [1]")
    style.note(figure, datasets, "full: plane, dashed: space; order between the two finest grids, the lower of both")
    return figure


def _lines(ax, data: Mapping[str, xr.Dataset], key: str, k: int, label: str) -> None:
    for place, one in data.items():
        ax.plot(
            1 / one["cells"], one[key], DASHES[place], color=style.OKABE_ITO[k], marker=MARKERS[k], markersize=4,
            label=label if place == "plane" else None,
        )  # fmt: skip


def _finish(ax, title: str, data: Mapping[str, xr.Dataset], place: str = "upper left") -> None:
    cells = [float(n) for one in data.values() for n in one["cells"]]
    steps = np.array([1 / max(cells), 1 / min(cells)])
    ax.plot(steps, 20 * steps**2, **style.REFERENCE)
    ax.annotate("order 2", (steps[1], 20 * steps[1] ** 2), (-40, -5), textcoords="offset points", fontsize=7)
    ax.set(xscale="log", yscale="log", title=title)
    ticks = 2 ** np.arange(np.log2(min(cells)), np.log2(max(cells)) + 0.5)
    ax.set_xticks(1 / ticks, [f"1/{n:g}" for n in ticks])
    ax.set_xticks([], minor=True)
    ax.legend(fontsize=7, loc=place, ncols=2)
