"""Figure of active contours: the pictures, the contour on its way, and the energy."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style

NAMES = {"discs": "three discs and a bar", "others": "other shapes, levels and noise"}


def fig_1_3(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Each noisy picture with the contour on its way and at the end, and the energy of both over the steps."""
    data = datasets["segmentation"].squeeze("cells")
    figure, axes = style.sheet(1, 3, size=(11.0, 4.1), gridspec_kw={"width_ratios": [1, 1, 1.1]})
    for ax, (name, words) in zip(axes, NAMES.items(), strict=False):
        one = data.sel(picture=name)
        _contours(ax, one)
        ax.set_title(f"{words[0].upper()}{words[1:]}: Dice {measured[f'dice_{name}']:.4f}")
    for (name, words), colour, dashes in zip(NAMES.items(), style.OKABE_ITO[::2], ("-", "--"), strict=False):
        one = data.sel(picture=name)
        energy = one["energy"].values[np.isfinite(one["energy"].values)]
        fresh = np.flatnonzero(one["redistanced"].values[: energy.size] == 1)
        steps = np.arange(energy.size) - np.cumsum(one["redistanced"].values[: energy.size]) + 1
        axes[2].plot(steps, energy, color=colour, linestyle=dashes, label=words)
        axes[2].plot(steps[fresh], energy[fresh], ".", color=colour, markersize=5)
    axes[2].set(xlabel="steps", ylabel="energy / first energy [1]", title="Falls in each step; dots: redistanced")
    axes[2].legend()
    style.note(
        figure,
        datasets,
        "noise 0.3 of the contrast; contours from dark (first) to light, thick the last; the second chose no parameter",
    )
    return figure


def _contours(ax, one: xr.Dataset) -> None:
    """The picture in grey, and its contours from the first to the last; the last one thick."""
    cells = round(one["image"].size ** 0.5)
    picture = one["image"].values.reshape(cells, cells)
    ax.imshow(picture, extent=(0, 1, 0, 1), cmap="gray", vmin=-3.5, vmax=1.6, interpolation="nearest")
    frames = one["contour_frame"].values
    count = int(np.nanmax(frames)) + 1
    for k, colour in enumerate(style.shades(count - 1)):
        here = frames == k
        ax.plot(one["contour_x"].values[here], one["contour_y"].values[here], color=colour, linewidth=1.6)
    here = frames == count - 1
    ax.plot(one["contour_x"].values[here], one["contour_y"].values[here], color=style.OKABE_ITO[1], linewidth=2.2)
    ax.set(xlim=(0, 1), ylim=(0, 1), xlabel="x [side]", ylabel="y [side]", aspect="equal")
    ax.grid(False)
