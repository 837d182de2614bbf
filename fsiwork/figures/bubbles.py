"""Figure of two bubbles that merge (Fig. 1.4)."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies.histories import history

CASES = {
    "kept": ("film breaks at 0.02", "o", "-"),
    "semi_lagrangian": ("the same, semi-Lagrangian", "x", ":"),
    "alone": ("φ alone", "s", "--"),
}


def fig_1_4(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Interface and vorticity on the finest grid, without (top) and with surface tension; merging time and volume."""
    runs = datasets["bubbles"]
    tensions, cells = sorted(runs["tension"].values), sorted(int(n) for n in runs["cells"].values)
    figure, axes = style.sheet(2, 3, size=(9.6, 6.0), width_ratios=(1, 1, 1.05))
    for row, tension in zip(axes, tensions, strict=True):
        one = runs.sel(tension=tension, case="kept", cells=cells[-1])
        for ax, frame in zip(row, (1, 2), strict=False):
            _vorticity(ax, one.isel(t=frame), cells[-1])
            ax.set_title(f"λ = {tension:g}, t = {float(one['t'][frame]):.1f}, N = {cells[-1]}")
        row[0].set_ylabel("y [length]")
    for ax in axes[1, :2]:
        ax.set_xlabel("x [length]")
    _times(axes[0, 2], measured, cells)
    _volumes(axes[1, 2], runs, tensions, cells)
    change = max(measured[f"merge_change_{word}_kept"] for word in ("free", "pulled"))
    kept = f"volume within {measured['volume_kept']:.3f} %, mean buoyancy {measured['content_kept']:.1f} %"
    style.note(figure, datasets, f"merging time, N = 128 to 256: {change:.1f} %; {kept}")
    return figure


def _vorticity(ax, frame: xr.Dataset, n: int) -> None:
    x = (np.arange(n) + 0.5) / n
    values, phi = (frame[name].values[:n, :n] for name in ("vorticity", "phi"))
    levels = np.linspace(5.0, 55.0, 11)
    for sign, colour in ((-1.0, style.OKABE_ITO[0]), (1.0, style.OKABE_ITO[1])):
        ax.contour(x, x, sign * values, levels, colors=colour, linewidths=0.6)
    ax.contour(x, x, phi, [0.0], colors="0", linewidths=1.4)
    ax.set(aspect="equal", xlim=(0.2, 0.8), ylim=(0.2, 0.85))


def _times(ax, measured: Mapping[str, float], cells: list[int]) -> None:
    """When there is one piece, over the grid."""
    for case, (label, marker, dashes) in CASES.items():
        for k, (word, tension) in enumerate((("free", "λ = 0"), ("pulled", "λ = 0.02"))):
            times = [measured[f"merge_{word}_{case}_{n}"] for n in cells]
            look = {"color": style.OKABE_ITO[2 * k], "marker": marker, "linestyle": dashes}
            ax.plot(cells, times, label=f"{tension}, {label}", **look)
    ax.set(
        xscale="log", xlabel="N, cells along a side", ylabel="t [time]", title="Two pieces become one", ylim=(0, 0.6)
    )
    ax.set_xticks(cells, [str(n) for n in cells])
    ax.set_xticks([], minor=True)
    ax.legend(loc="upper left", fontsize=7)


def _volumes(ax, runs: xr.Dataset, tensions: list[float], cells: list[int]) -> None:
    """Deviation of the volume of φ as it is carried; where it is kept, it stays at zero."""
    for n, dashes in zip(cells, ("--", "-", ":"), strict=False):
        for k, tension in enumerate(tensions):
            t, volume = history(runs, "volume", tension=tension, case="alone", cells=n)
            label = f"λ = {tension:g}, N = {n}, φ alone"
            ax.plot(t, 100 * (volume / volume[0] - 1), color=style.OKABE_ITO[2 * k], linestyle=dashes, label=label)
    t, volume = history(runs, "volume", tension=tensions[0], case="kept", cells=cells[-1])
    ax.plot(t, 100 * (volume / volume[0] - 1), color="0", label="volume kept")
    style.band(ax, 0.0, 0.5)
    ax.set(xlabel="t [time]", ylabel="deviation [%]", title="Volume of both together")
    ax.legend(loc="upper left", fontsize=7)
