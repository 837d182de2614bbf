"""Figures of the invariants Z₁ and Z₂: deformations of a plane (Figs 3.3 to 3.8) and of surfaces (Figs 7.1 to 7.6)."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies.invariants import CASES, TIMES

PLANE = {
    "TC1-minus": "3.3: u = (x, −y, 0)", "TC1-plus": "3.4: u = (x, y, 0)", "TC1-zero": "3.5: u = (x, 0, 0)",
    "TC2-plus": "3.6: u = (y, x, 0)", "TC2-minus": "3.7: u = (−y, x, 0)", "TC2-zero": "3.8: u = (0, x, 0)",
}  # fmt: skip
SURFACES = (
    ("TC3", "z2", "7.1: cylinder, Z₂"), ("TC4", "z2", "7.2: sphere, Z₂"), ("TC5", "z1", "7.3: sphere, Z₁"),
    ("TC6", "z2", "7.5: cube, Z₂"), ("TC7", "z1", "7.6: sphere, Z₁"), ("TC7", "z2", "7.6: sphere, Z₂"),
)  # fmt: skip


def plane(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """For each velocity in the plane z = 0: its arrows, and Z₁ and Z₂ over time, exact lines and points of the map."""
    data = datasets["invariants"].isel(cells=-1)
    figure, panels = style.sheet(2, 6, size=(12.5, 4.6))
    t, s = np.linspace(0, TIMES[-1], 60), np.linspace(-1, 1, 7)
    x, y = np.meshgrid(s, s)
    for (arrows, ax), (case, title) in zip(panels.T, PLANE.items(), strict=True):
        u = CASES[case].u(x, y, 0 * x)
        arrows.quiver(x, y, u[0], u[1], color=style.OKABE_ITO[0])
        arrows.set(title=f"Fig. {title}", aspect="equal", xlabel="x [L]", ylabel="y [L]")
        exact = CASES[case].Z(*np.zeros((3, 1)), t[:, None])
        for name, letter, values, colour, marker in (
            ("z1", "Z₁", exact[0], style.OKABE_ITO[1], "s"), ("z2", "Z₂", exact[1], style.OKABE_ITO[2], "o"),
        ):  # fmt: skip
            ax.plot(t, np.broadcast_to(values, (60, 1)), color=colour)
            ax.plot(TIMES, data[name].sel(case=case), marker, color=colour, label=letter)
        ax.set(xlabel="t [T]", ylim=(0.9, 2.9))
    panels[1, 0].set_ylabel("invariant [1]")
    panels[1, 0].legend()
    style.note(figure, datasets, f"points: map carried on {int(data['cells'])}³ cells; lines: exact, TC2 with (1 + β)²")
    return figure


def surfaces(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Nodes next to the deformed surfaces at t = 0.5, coloured by an invariant from the carried map."""
    data = datasets["invariants"].isel(cells=-1)
    figure = style.sheet(1, 1, size=(10.5, 6.2))[0]
    figure.clear()
    for k, (case, name, title) in enumerate(SURFACES):
        one = data.sel(case=case)
        ax = figure.add_subplot(2, 3, k + 1, projection="3d")
        values = one[f"node_{name}"]
        low, high = float(values.min()), max(float(values.max()), float(values.min()) + 1e-3)
        points = ax.scatter(one["x"], one["y"], one["z"], c=values, cmap=style.SEQUENTIAL, s=3, vmin=low, vmax=high)
        error = float(one[f"error_{name}"])
        ax.set_title(f"Fig. {title}, {case}\nlargest error {error:.1e}", fontsize=8)
        ax.set(xlim=(-0.8, 0.8), ylim=(-0.8, 0.8), zlim=(-0.8, 0.8), xlabel="x [L]", ylabel="y [L]", zlabel="z [L]")
        ax.tick_params(labelsize=5)
        figure.colorbar(points, ax=ax, shrink=0.6, pad=0.12)
    style.note(figure, datasets, f"t = {TIMES[-1]}; nodes within Δx of the surface, {int(data['cells'])}³ cells")
    return figure
