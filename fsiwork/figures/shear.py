"""Figures of the sheared sphere, Figs 3.18 to 3.24, and of the same with a pressure inside."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import shear
from fsiwork.studies.shear_measures import grids

AZIMUTH, ELEVATION = np.radians(30), np.radians(22)
LOOKS = ((style.OKABE_ITO[5], ":"), (style.OKABE_ITO[1], "--"), (style.OKABE_ITO[0], "-"))
FREE = {"color": style.OKABE_ITO[3], "linestyle": "-.", "linewidth": 1.0}
CELLS = {"color": style.OKABE_ITO[2], "linewidth": 1.0}


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
            pieces[np.argsort(depth)], colors=colours[np.argsort(depth)], linewidths=0.6 if speed is None else 1.5
        )
    )
    ax.set(xlim=(-0.62, 0.62), ylim=(-0.62, 0.62), aspect="equal")
    ax.axis("off")


def _others(data: xr.Dataset) -> dict[str, dict]:
    """Cases beside the refined grids, with their look and name: ε in cells, and layers that slide."""
    out = {}
    for case in map(str, data["case"].values):
        cells = int(data["n_cells"].sel(case=case))
        if case.startswith("cells"):
            wide = float(data["eps"].sel(case=case)) * cells / 2
            out[case] = CELLS | {"linestyle": (0, (1, 1 + 2 * len(out))), "label": f"N = {cells}, ε = {wide:.2g} Δx"}
        elif case.startswith("free"):
            out[case] = FREE | {"label": f"N = {cells}, (3.67), κₛ = 0"}
    return out


def _history(ax, data: xr.Dataset, name: str, label: str) -> None:
    """A gauge over time: refined grids thick to thin, and the others."""
    for case, (colour, dashes) in zip(grids(data), LOOKS, strict=True):
        one = data.sel(case=case)
        ax.plot(one["t"], one[name], color=colour, linestyle=dashes, label=f"N = {case[1:]}")
    for case, look in _others(data).items():
        ax.plot(data["t"].sel(case=case), data[name].sel(case=case), **look)
    ax.set(xlabel="time t [T]", ylabel=label, xlim=(0, None))


def _note(figure: Figure, datasets: Mapping[str, xr.Dataset], text: str = "") -> None:
    data = datasets["sheared_sphere"]
    eps = float(data["eps"].sel(case=grids(data)[-1]))
    style.note(figure, datasets, f"ε = {eps:g} in length if not said, walls, μ = 0.01, λ₁ = λ₂ = 1{text}")


def fig_3_18(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Markers that go along, every half unit of time, finest grid."""
    data = datasets["sheared_sphere"]
    fine = data.sel(case=grids(data)[-1])
    figure, axes = style.sheet(3, 7, size=(11.0, 5.2))
    for ax in axes.flat:
        ax.axis("off")
    for k, (ax, t) in enumerate(zip(axes.flat, shear.SHOTS, strict=False)):
        _globe(ax, fine[f"markers_{k}"].values)
        ax.set_title(f"t = {t:g}", fontsize=8, pad=0)
    _note(figure, datasets, f", N = {grids(data)[-1][1:]}")
    return figure


def fig_3_19(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Speed at the markers at t = 0.5 on every grid, one scale."""
    data = datasets["sheared_sphere"]
    cases = [*grids(data), *(case for case in _others(data) if case.startswith("cells"))]
    top = max(measured[f"top_{case}"] for case in cases)
    figure, axes = style.sheet(1, len(cases), size=(2.4 * len(cases) + 0.9, 3.0))
    for ax, case in zip(axes, cases, strict=True):
        one = data.sel(case=case)
        _globe(ax, one["seen"].values, one["speed"].values, top)
        name = f"N = {int(one['n_cells'])}, ε = {float(one['eps']):.2g}"
        ax.set_title(f"{name}\n|u| ≤ {measured[f'top_{case}']:.3f}", fontsize=8)
    mappable = axes[0].collections[0]
    mappable.set(cmap=style.SEQUENTIAL, clim=(0, top))
    figure.colorbar(mappable, ax=axes, label="speed |u| [L/T]", shrink=0.8)
    _note(figure, datasets, ", t = 0.5")
    return figure


def _pressures(datasets: Mapping[str, xr.Dataset], axis: str) -> Figure:
    data = datasets["sheared_sphere"]
    figure, axes = style.sheet(1, 2, size=(9.6, 3.9))
    for k, (ax, t) in enumerate(zip(axes, shear.PRESSURE, strict=True)):
        looks = [{"color": c, "linestyle": d, "label": f"N = {case[1:]}"} for case, (c, d) in _looks(data)]
        for case, look in [*zip(grids(data), looks, strict=True), *_others(data).items()]:
            ax.plot(shear.STATIONS, data[f"p_{axis}_{k}"].sel(case=case), **look)
        fine = data.sel(case=grids(data)[-1])
        phi, eps = fine[f"phi_{axis}_{k}"].values, float(fine["eps"])
        inside = np.abs(phi) <= eps
        ax.fill_between(shear.STATIONS, 0, 1, where=inside, transform=ax.get_xaxis_transform(), color="0.9", zorder=0)
        ax.set(xlabel=f"{axis} [L]", ylabel="pressure p [M/(L T²)]", title=f"t = {t:g}", xlim=(0, 1))
    axes[0].legend(fontsize=7)
    _note(figure, datasets, "; grey: |φ| ≤ ε on the finest grid")
    return figure


def _looks(data: xr.Dataset):
    return zip(grids(data), LOOKS, strict=True)


def fig_3_20(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Pressure on the x axis at both times."""
    return _pressures(datasets, "x")


def fig_3_21(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Pressure on the z axis at both times."""
    return _pressures(datasets, "z")


def fig_3_22(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Radius along z to the end, and to t = 5."""
    data = datasets["sheared_sphere"]
    figure, axes = style.sheet(1, 2, size=(9.6, 3.9), sharey=True)
    for ax, end in zip(axes, (float(data["t"].max()), 5.0), strict=True):
        _history(ax, data, "axis_z", "half-axis along z [L]")
        ax.axhline(0.5, **style.REFERENCE)
        ax.set_xlim(0, end)
    axes[1].set_ylabel("")
    axes[1].legend(fontsize=7)
    _note(figure, datasets)
    return figure


def _norm(datasets: Mapping[str, xr.Dataset], name: str, where: str) -> Figure:
    data = datasets["sheared_sphere"]
    figure, (left, right) = style.sheet(1, 2, size=(9.6, 3.9))
    _history(left, data, name, f"RMS of det ∇Y − 1 {where} [1]")
    _history(right, data, "det_min", "least det ∇Y in the band so far [1]")
    right.axhline(0.1, **style.REFERENCE)
    left.set_ylim(0, None)
    right.set_ylim(0, None)
    left.legend(fontsize=7)
    _note(figure, datasets)
    return figure


def fig_3_23(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """The norm (3.68) over the box, and the least determinant."""
    return _norm(datasets, "rms_box", "in the box")


def fig_3_24(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """The norm (3.68) over the surface, and the least determinant."""
    return _norm(datasets, "rms_surface", "on the surface")


def sphere_inflated(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Left: radii along x and z over time; right: mean of Z₂ - 1 on the surface; for both laws, and for (3.67) as it is
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
    style.note(figure, datasets, f"ε = {eps} at rest, radius 1.1 × that at rest, walls, μ = 0.01")
    return figure
