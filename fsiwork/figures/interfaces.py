"""Figures of interfaces in a prescribed motion: outlines against the exact ones, lengths over time."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style

Datasets, Measured = Mapping[str, xr.Dataset], Mapping[str, float]
METHODS = {
    "plain": ("φ, never redistanced", style.OKABE_ITO[1], "o"),
    "redistanced": ("φ, redistanced", style.OKABE_ITO[2], "s"),
    "map": ("map Y, φ₀(Y)", style.OKABE_ITO[0], "^"),
}
LEAST = 1e-8
PARTICLES = {"zalesak": {100: 0.31}, "reversed_vortex": {64: 1.81, 128: 0.71, 256: 0.35}, "enright": {100: 2.6}}
"""Percent of area or volume that the particle level set loses (Enright et al. 2002, as recalled)."""
EXACT = {"color": "0", "linewidth": 0.7, "linestyle": (0, (4, 2))}


def fig_1_5(datasets: Datasets, measured: Measured) -> Figure:
    """Outlines at the end by method, the two finest grids one below the other, on the exact one."""
    data, exact = datasets["blob"], datasets["blob_exact"]
    cells = sorted(int(n) for n in data["cells"].values)[-2:]
    figure, axes = style.sheet(2, 3, size=(9.4, 6.8), sharex=True, sharey=True)
    for row, n in zip(axes, cells, strict=True):
        for ax, (method, (label, colour, _)) in zip(row, METHODS.items(), strict=True):
            one = data.sel(carried=method, cells=n)
            ax.fill(*_filled(one["x"].values, one["y"].values), color=colour, alpha=0.75, linewidth=0)
            ax.plot(exact["x"], exact["y"], label="exact", **EXACT)
            area, length = ((measured[f"{q}_{method}_{n}"]) for q in ("area", "length"))
            sign = "" if method == "map" else "+"
            ax.set_title(f"{label}, N = {n}\narea {area:{sign}.3g} %, length {length:{sign}.3g} %")
            ax.set(aspect="equal", xlim=(0, 1), ylim=(0, 1))
        row[0].set_ylabel("y [length]")
    for ax in axes[-1]:
        ax.set_xlabel("x [length]")
    axes[0, 0].legend(loc="lower right")
    style.note(figure, datasets, "t = 5; dashed: markers; errors of area and length (map: absolute)")
    return figure


def _filled(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pieces joined to one path for filling: each is closed, and the way between two is gone there and back."""
    ends = np.flatnonzero(np.isnan(x))
    pieces = [p for p in np.split(np.column_stack([x, y]), ends) if np.isfinite(p[:, 0]).sum() > 2]
    pieces = [p[np.isfinite(p[:, 0])] for p in pieces]
    if not pieces:
        return np.zeros(0), np.zeros(0)
    back = [p[-1:] for p in reversed(pieces[:-1])]
    return tuple(np.vstack([*pieces, *back]).T)


def fig_1_6(datasets: Datasets, measured: Measured) -> Figure:
    """Length over time on each grid: renormalised without redistancing, redistanced, and the map's; the exact curve."""
    data, exact = datasets["blob"], datasets["blob_exact"]
    cells = sorted(int(n) for n in data["cells"].values)
    figure, axes = style.sheet(1, 3, size=(9.8, 3.7), sharey=True, sharex=True)
    for ax, (method, (label, *_)) in zip(axes, METHODS.items(), strict=True):
        name = "length" if method == "map" else "renormalised"
        for n, colour, mark in zip(cells, style.shades(len(cells)), "osv^", strict=False):
            one = data.sel(carried=method, cells=n)
            ax.plot(one["t"], one[name], color=colour, marker=mark, markevery=2, label=f"N = {n}")
        ax.plot(exact["t"], exact["length"], label="exact", **EXACT)
        how = "geometric on a finer grid" if method == "map" else "renormalised D"
        ax.set(title=f"{label}\n({how})", xlabel="t [time]")
    axes[0].set_ylabel("length of φ = 0 [length]")
    axes[0].legend(loc="upper left")
    style.note(figure, datasets, "exact: markers")
    return figure


def back_again(datasets: Datasets, measured: Measured) -> Figure:
    """Outlines half way and at the end on the second finest grid, with how they began; errors over N."""
    ((study, data),) = datasets.items()
    cells = sorted(int(n) for n in data["cells"].values)
    shown = cells[max(len(cells) - 2, 0)]
    figure, axes = style.sheet(2, 3, size=(9.4, 6.6))
    for ax, when, word in zip(axes[:, 0], ("half", "end"), ("half way", "at the end"), strict=True):
        for method, (label, colour, _) in METHODS.items():
            one = data.sel(carried=method, cells=shown)
            ax.plot(one[f"{when}_x"], one[f"{when}_y"], color=colour, label=label, linewidth=1.1)
        if when == "end":
            ax.plot(one["start_x"], one["start_y"], **EXACT)
        ax.set(aspect="equal", title=f"{word}, N = {shown}", xlabel="x [length]", ylabel="y [length]")
    names = {"volume": "|change of volume| [%]", "mismatch": "on the wrong side [% of the inside]"}
    names |= {"l1": "L1 [Δx]", "shape": "mean distance of the line [Δx]"}
    for ax, (name, label) in zip(axes[:, 1:].ravel(), names.items(), strict=True):
        for method, (word, colour, marker) in METHODS.items():
            values = np.abs(data[name].sel(carried=method).sel(cells=cells))
            ax.plot(cells, np.maximum(values, LEAST), color=colour, marker=marker, label=word)
        ax.set(xscale="log", yscale="log", title=label, xlabel="N, cells along a side")
        ax.set_xticks(cells, [str(n) for n in cells])
        ax.set_xticks([], minor=True)
    lost = PARTICLES.get(study, {})
    axes[0, 1].plot(list(lost), list(lost.values()), "x", color="0", label="particle level set")
    axes[0, 1].legend(loc="best", fontsize=7)
    style.note(figure, datasets, f"dashed: as it began; nothing below {LEAST:g} is drawn lower")
    return figure
