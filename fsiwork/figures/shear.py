"""Figures of the sheared sphere, Figs 3.18 to 3.24, and of the same with a pressure inside."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import shear

AZIMUTH, ELEVATION = np.radians(30), np.radians(22)
LOOK = dict(
    zip(shear.GRIDS, ((style.OKABE_ITO[5], ":"), (style.OKABE_ITO[1], "--"), (style.OKABE_ITO[0], "-")), strict=True)
)
HELD = {"color": style.OKABE_ITO[3], "linestyle": "-.", "label": "N = 32, κ = 10"}


def _globe(ax, markers: np.ndarray, speed: np.ndarray | None = None, top: float = 1.0):
    """Lines of markers seen from above the equator; those behind are faint. Coloured by ``speed`` if it is given."""
    a, e = AZIMUTH, ELEVATION
    view = np.array(
        [
            [-np.sin(a), np.cos(a), 0],
            [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)],
            [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)],
        ]
    )
    lines = markers.reshape(-1, shear.AROUND, 3) @ view.T
    pieces = np.stack([lines[:, :-1, :2], lines[:, 1:, :2]], axis=2).reshape(-1, 2, 2)
    depth = 0.5 * (lines[:, :-1, 2] + lines[:, 1:, 2]).ravel()
    if speed is None:
        colours = np.tile([0.0, 0.0, 0.0, 1.0], (depth.size, 1))
    else:
        values = speed.reshape(-1, shear.AROUND)
        colours = style.SEQUENTIAL(np.clip(0.5 * (values[:, :-1] + values[:, 1:]).ravel() / top, 0, 1))
    colours[:, 3] = np.where(depth > 0, 0.9, 0.1)
    ax.add_collection(
        LineCollection(
            pieces[np.argsort(depth)], colors=colours[np.argsort(depth)], linewidths=0.8 if speed is None else 1.3
        )
    )
    ax.set(xlim=(-0.62, 0.62), ylim=(-0.62, 0.62), aspect="equal")
    ax.axis("off")


def _globes(figure: Figure, row, fine: xr.Dataset) -> None:
    fast = shear.SHOTS.index(0.5)
    for k, t in enumerate(shear.SHOTS):
        ax = figure.add_subplot(row[k])
        speed = fine[f"speed_{k}"].values
        top = float(np.nanmax(speed)) if np.isfinite(speed).any() else 1.0
        _globe(ax, fine[f"markers_{k}"].values, speed if k == fast else None, top)
        ax.set_title(f"t = {t:g}" + (f", |u| ≤ {top:.2f}" if k == fast else ""), fontsize=8)


def _history(ax, data: xr.Dataset, name: str, label: str) -> None:
    for case, (colour, dashes) in LOOK.items():
        one = data.sel(case=case)
        ax.plot(one["t"], one[name], color=colour, linestyle=dashes, label=f"N = {case[1:]}")
    one = data.sel(case="held")
    ax.plot(one["t"], one[name], linewidth=1.0, **HELD)
    ax.set(xlabel="time t [T]", ylabel=label, xlim=(0, None))


def fig_3_18(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Above: markers on the sphere, at t = 0.5 coloured by speed; then radius along z, pressure on the axes; below:
    both norms (3.68) and the least det ∇Y so far."""
    data = datasets["sheared_sphere"]
    figure = Figure(figsize=(10.0, 8.2))
    rows = figure.add_gridspec(3, 1, height_ratios=(0.6, 1, 1))
    _globes(figure, rows[0].subgridspec(1, len(shear.SHOTS), wspace=0.02), data.sel(case=shear.GRIDS[-1]))
    radius, *pressures = (figure.add_subplot(place) for place in rows[1].subgridspec(1, 3))
    _history(radius, data, "axis_z", "half-axis along z [L]")
    radius.axhline(0.5, **style.REFERENCE)
    radius.legend(fontsize=7, ncols=2)
    for ax, axis in zip(pressures, "xz", strict=True):
        for case, (colour, dashes) in LOOK.items():
            for k, t in enumerate(shear.PRESSURE):
                p = data.sel(case=case)[f"p_{axis}_{k}"]
                label = f"t = {t:g}" if case == shear.GRIDS[-1] else None
                ax.plot(shear.STATIONS, p, color=colour, linestyle=dashes, linewidth=0.8 + 0.9 * k, label=label)
        ax.set(xlabel=f"{axis} [L]", ylabel="pressure p [M/(L T²)]")
        ax.set_title(f"on the {axis} axis: thin t = 0.1, thick t = 1.2", fontsize=8)
    below = [figure.add_subplot(place) for place in rows[2].subgridspec(1, 3)]
    _history(below[0], data, "rms_box", "RMS of det ∇Y − 1 in the box [1]")
    _history(below[1], data, "rms_surface", "RMS of det ∇Y − 1 at the surface [1]")
    _history(below[2], data, "det_min", "least det ∇Y in the band so far [1]")
    below[2].axhline(0.1, **style.REFERENCE)
    below[2].set_ylim(0, None)
    eps = float(data["eps"][0])
    style.note(figure, datasets, f"ε = {eps:g} in length, walls, μ = 0.01, λ₁ = λ₂ = 1; globes: finest grid")
    return figure


def sphere_inflated(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Left: radii along x and z over time; right: mean of Z₂ − 1 on the surface; for both laws, and for (3.67) as it is
    printed."""
    data = datasets["inflated_sphere"]
    figure, (left, right) = style.sheet(1, 2, size=(9.6, 3.9))
    names = {"quadratic": "E₂′ = λ₂(Z₂ − 1)", "linear": "E₂′ = λ₂", "printed": "E₂′ = λ₂(Z₂ − 1), layers by (3.67)"}
    for k, (case, name) in enumerate(names.items()):
        one, colour = data.sel(case=case), style.OKABE_ITO[k]
        label = f"{name}, N = {int(one['n_cells'])}: {100 * measured[f'away_{case}']:.2g} % from the sphere"
        left.plot(one["t"], one["axis_z"], color=colour, label=f"{name}, z and dashed x")
        left.plot(one["t"], one["axis_x"], "--", color=colour, linewidth=1.0)
        right.semilogy(one["t"], one["shear_mean"], ("-", "--", ":")[k], color=colour, label=label)
    for level in (0.1 * float(data["shear_mean"].sel(case="quadratic")[0]), 0.01):
        right.axhline(level, **style.REFERENCE)
    style.band(left, 0.5, 0.01)
    left.set(xlabel="time t [T]", ylabel="half-axes [L]")
    right.set(xlabel="time t [T]", ylabel="mean of Z₂ − 1 [1]", ylim=(None, 3))
    left.legend(fontsize=7)
    right.legend(fontsize=7)
    eps = " and ".join(f"{q:g}" for q in sorted(set(data["eps"].values)))
    style.note(figure, datasets, f"ε = {eps} at rest, radius 1.1 × that at rest, walls, μ = 0.01, κ = 10")
    return figure
