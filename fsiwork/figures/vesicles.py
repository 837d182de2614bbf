"""Figures of vesicles in space: at rest, Fig. 3.16, and in a shear flow, Fig. 3.17."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import vesicle_rest as rest
from fsiwork.studies import vesicle_shear as shear

COLOUR = {"prolate": style.OKABE_ITO[0], "oblate": style.OKABE_ITO[1]}
LIGHT = np.array([-0.35, -0.5, 0.8]) / np.linalg.norm([-0.35, -0.5, 0.8])
AROUND = 73  # meridians of a shaded surface
ALONG = 60  # points of a meridian


def _meridian(one: xr.Dataset, exact: xr.Dataset) -> np.ndarray:
    """The measured meridian, (ALONG, 2) from the pole to the equator: means of the points next to each place of the
    exact one."""
    line = np.stack([exact["r"].values, exact["z"].values], axis=1)
    points = np.stack([one["r"].values, one["z"].values], axis=1)
    nearest = np.linalg.norm(points[:, None] - line, axis=2).argmin(axis=1)
    edges = np.linspace(0, len(line), ALONG + 1)
    place = np.digitize(nearest, edges[1:-1])
    full = np.array([points[place == k].mean(axis=0) if (place == k).any() else [np.nan] * 2 for k in range(ALONG)])
    good = np.isfinite(full[:, 0])
    full = np.stack([np.interp(np.arange(ALONG), np.flatnonzero(good), full[good, a]) for a in (0, 1)], axis=1)
    full[0, 0], full[-1, 1] = 0.0, 0.0
    return full


def _solid(ax, meridian: np.ndarray, title: str, colour: str) -> None:
    """The surface of revolution of a meridian, shaded; the axis of a slender one lies along the picture."""
    r, z = np.concatenate([meridian, meridian[-2::-1] * [1, -1]]).T
    turn = np.linspace(0, 2 * np.pi, AROUND)
    x, y, z = np.outer(r, np.cos(turn)), np.outer(r, np.sin(turn)), np.outer(z, np.ones_like(turn))
    if np.ptp(z) > np.ptp(x):
        x, z = z, -x
    along = [np.stack(np.gradient(q), -1) for q in (x, y, z)]
    normal = np.cross(np.stack([g[..., 0] for g in along], -1), np.stack([g[..., 1] for g in along], -1))
    normal[0], normal[-1] = normal[1].mean(axis=0), normal[-2].mean(axis=0)  # at the poles
    outward = np.sign((normal * np.stack([x, y, z], -1)).sum())
    normal *= outward / np.linalg.norm(normal, axis=-1, keepdims=True)
    shade = 0.35 + 0.65 * np.clip(normal @ LIGHT, 0, 1)
    base = np.array([int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    faces = np.clip(shade[..., None] * (0.35 + 0.65 * base), 0, 1)
    plain = {"rcount": 2 * ALONG, "ccount": AROUND, "shade": False, "linewidth": 0, "antialiased": False}
    ax.plot_surface(x, y, z, facecolors=faces, **plain)
    half = max(1.05 * x.max(), 1.4)
    ax.set(xlim=(-half, half), ylim=(-half, half), zlim=(-half, half))
    ax.set_box_aspect((1, 1, 1), zoom=1.6)
    ax.view_init(elev=28, azim=-90)
    ax.set_axis_off()
    ax.set_title(title, fontsize=8.5, y=0.9, loc="center")


def _profiles(ax, data: xr.Dataset, shapes: xr.Dataset, volume: float) -> None:
    for branch in rest.BRANCHES:
        exact = shapes.sel(volume=volume, branch=branch)
        ax.plot(
            exact["r"], exact["z"], color="0.15", linewidth=0.9, zorder=3, label=None if branch != "oblate" else "exact"
        )
        for one, marker in zip(rest.cases(data, volume, branch), "ox", strict=True):
            start = str(one["case"].item()).split("_")[-1]
            points = one.isel(point=slice(None, None, 7))
            ax.plot(points["r"], points["z"], marker, color=COLOUR[branch], markersize=3.4, fillstyle="none",
                    linewidth=0, label=f"{branch}, from {_article(start)}")  # fmt: skip
    ax.set(
        xlabel="r/R [1]",
        ylabel="z/R [1]",
        aspect="equal",
        xlim=(0, 1.45),
        title=f"meridians, reduced volume {volume:g}",
    )
    ax.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _article(start: str) -> str:
    return {"spheroid": "a spheroid", "plump": "a plump spheroid", "tablet": "a tablet"}[start]


def _energies(ax, data: xr.Dataset, shapes: xr.Dataset, volume: float) -> None:
    for branch in rest.BRANCHES:
        ax.axhline(float(shapes["energy"].sel(volume=volume, branch=branch)) / rest.BALL, **style.REFERENCE)
        for one, dashes in zip(rest.cases(data, volume, branch), ("-", ":"), strict=True):
            ax.plot(
                one["t"],
                one["energy"] / rest.BALL,
                dashes,
                color=COLOUR[branch],
                label=str(one["case"].item()).replace("_", " "),
            )
    levels = [float(e) / rest.BALL for e in shapes["energy"].sel(volume=volume)]
    room = max(levels) - min(levels)
    ax.set(xlabel="time t [μR³/k]", ylabel="½∫H²/8π [1]", ylim=(min(levels) - 1.1 * room, max(levels) + 1.6 * room))
    ax.set_title(f"reduced volume {volume:g}; dashed: shape equation")
    ax.legend(fontsize=7)


def fig_3_16(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Above: shapes at rest, shaded, the book's two first; then meridians beside the exact ones; below: energies."""
    data, shapes = datasets["vesicle_rest"], datasets["vesicle_shapes"]
    figure = Figure(figsize=(9.8, 9.4))
    above, middle, below = figure.subfigures(3, 1, height_ratios=(0.85, 1.5, 1.1))
    least = {0.77: "prolate", 0.6: "oblate"}
    order = [(v, least[v]) for v in rest.VOLUMES] + [
        (v, b) for v in rest.VOLUMES for b in rest.BRANCHES if b != least[v]
    ]
    for k, (volume, branch) in enumerate(order):
        ax = above.add_subplot(1, 4, k + 1, projection="3d")
        one = rest.cases(data, volume, branch)[0]
        energy = float(one["energy"][-1]) / rest.BALL
        word = "the lower one" if branch == least[volume] else "held by symmetry"
        title = f"reduced volume {volume:g}, {branch}:\n½∫H² = {energy:.3f} · 8π, {word}"
        _solid(ax, _meridian(one, shapes.sel(volume=volume, branch=branch)), title, COLOUR[branch])
    for ax, volume in zip(middle.subplots(1, 2), rest.VOLUMES, strict=True):
        _profiles(ax, data, shapes, volume)
    for ax, volume in zip(below.subplots(1, 2), rest.VOLUMES, strict=True):
        _energies(ax, data, shapes, volume)
    words = f"energies within {measured['energy']:.2g} %, meridians within {measured['profile']:.2g} % of R"
    style.note(figure, datasets, f"{words} of the shape equation; two starts within {measured['starts']:.2g} %")
    return figure


RUNS = {"v90": "0.9", "v90_high": "0.9, higher box", "v90_fine": "0.9, finer grid", "v95": "0.95"}
LOOK = dict(zip(RUNS, ("-", "--", ":", "-"), strict=True))
MAIN = ("v90", "v95")


def _shapes_in_shear(axes, data: xr.Dataset, measured: Mapping[str, float]) -> None:
    """Outlines in the plane of shear, dark to light over time, the long axis at the end, and the flow."""
    for ax, case in zip(axes, MAIN, strict=True):
        one = data.sel(case=case)
        for k, colour in enumerate(style.shades(shear.SHOTS)):
            t = float(one["t"][k * (shear.ROWS // (shear.SHOTS - 1))])
            line = one[f"line_{k}"].values.reshape(-1, 2)
            ax.plot(*np.vstack([line, line[:1]]).T, color=colour, label=f"γ̇t = {t * float(one['rate']):.1f}")
        turn, half = np.radians(measured[f"angle_{case}"]), 1.05 * float(one["axis_1"][-1])
        ax.plot(*np.outer([np.cos(turn), np.sin(turn)], [-half, half]), color="0.4", linewidth=0.8)
        for y in np.linspace(-1.2, 1.2, 7):
            if abs(y) > 0.1:
                ax.annotate("", (-1.95 + 0.3 * y, y), (-1.95, y), arrowprops={"arrowstyle": "->", "color": "0.6"})
        ax.axhline(0.0, color="0.8", linewidth=0.6)
        ax.set(xlabel="x/R [1]", ylabel="y/R [1]", aspect="equal", xlim=(-2.4, 2.0), ylim=(-1.35, 1.35))
        ax.set_title(f"reduced volume {RUNS[case]}: {measured[f'angle_{case}']:.1f}°")
        ax.legend(fontsize=7, loc="lower right")


def fig_3_17(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Above: outlines in the plane of shear at some times; below: angle, area and volume over time."""
    data = datasets["vesicle_shear"]
    figure = Figure(figsize=(9.8, 6.6))
    above, below = figure.subfigures(2, 1, height_ratios=(1.1, 1))
    _shapes_in_shear(above.subplots(1, 2), data, measured)
    angle, kept = below.subplots(1, 2)
    for case, name in RUNS.items():
        one, colour = data.sel(case=case), style.OKABE_ITO[case == "v95"]
        strain = one["t"] * one["rate"]
        angle.plot(strain, one["angle"], LOOK[case], color=colour, label=name)
        kept.plot(strain, 100 * (one["area"] / one["area"][0] - 1), LOOK[case], color=colour, label=f"area, {name}")
        if case in MAIN:
            angle.axhline(measured[f"theory_{case}"], color=colour, linewidth=0.9, linestyle=(0, (6, 2)), alpha=0.7)
            change = 100 * (one["volume"] / one["volume"][0] - 1)
            kept.plot(strain, change, color=("0.2", "0.55")[case == "v95"], linewidth=1.0, label=f"volume, {name}")
    angle.axvspan(float(data["t"].max()) - shear.LAST, float(data["t"].max()), color="0.35", alpha=0.08, linewidth=0)
    angle.set(xlabel="strain γ̇t [1]", ylabel="angle of the long axis to the flow [°]", ylim=(20, 36))
    angle.set_title("angle; dashed, thin: small deformations, unbounded")
    angle.legend(title="reduced volume", title_fontsize=7, fontsize=7, ncols=2, loc="upper right")
    for level in (-1, 1):
        kept.axhline(level, **style.REFERENCE)
    kept.set(xlabel="strain γ̇t [1]", ylabel="change from the start [%]", ylim=(-1.15, 1.9), title="what is kept")
    kept.legend(fontsize=7, ncols=2, loc="upper right")
    words = f"drift over the last {shear.LAST:g} strain units (shaded) ≤ {measured['drift']:.2g}°, "
    words += f"area within {measured['area']:.2g} %, volume within {measured['volume']:.2g} %"
    style.note(figure, datasets, words)
    return figure
