"""Figure of the relaxing ring: radius and stretch over time, the gap to the markers over N, a section of the tube."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import rings

LOOK = {
    "markers": ("markers (3.1)-(3.8)", style.OKABE_ITO[6], "-"),
    "field": ("φ¹, φ²", style.OKABE_ITO[0], "--"),
    "map": ("φ₀¹(Y), φ₀²(Y)", style.OKABE_ITO[1], "o"),
}


def curve_ring(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Radius over time on the finest grid, Z₃ against the length of the curve, gaps over N, Z₃ in the tube."""
    data = datasets["curve_ring"]
    cells = sorted(int(n) for n in data["cells"].values)
    figure, panels = style.sheet(2, 2, size=(9.4, 6.6))
    (radius, stretch), (gaps, section) = panels
    for s, width in zip(rings.STRETCHES, (1.2, 1.9), strict=True):
        for way, (label, colour, dashes) in LOOK.items():
            at = {"case": f"{way}_{s:g}", "cells": cells[-1]}
            t, R = (rings.one(data, name, **at) for name in ("t", "radius"))
            look = {"color": colour, "linewidth": width, "markersize": 3, "markevery": 5}
            radius.plot(t, R, dashes, **look, label=label if s == rings.STRETCHES[0] else None)
            if way == "field":
                stretch.plot(t, rings.one(data, "stretch", **at), dashes, **look, label=f"Z₃, stretch {s:g}")
                stretch.plot(t, s * R / R[0], **style.REFERENCE)
        radius.annotate(f"stretch {s:g}", (0, R[0]), (6, 0), textcoords="offset points", fontsize=8)
    style.band(radius, 0.4, label="rest radius")
    radius.set(title=f"radius of the curve, N = {cells[-1]}", xlabel="time t [T]", ylabel="radius [L]")
    radius.legend()
    stretch.legend()
    stretch.set(
        title="stretch of the curve; dashed grey: its length / rest length", xlabel="time t [T]", ylabel="Z₃ [1]"
    )
    for s, marker in zip(rings.STRETCHES, "os", strict=True):
        values = [measured[f"gap_field_{s:g}_{n}"] for n in cells]
        gaps.plot(cells, values, color=LOOK["field"][1], marker=marker, label=f"gap in radius, stretch {s:g}")
    for name, label, colour in (("z3", "Z₃ on the curve", 2), ("z3_length", "mean Z₃", 3)):
        errors = [measured[f"{name}_fixed_{rings.STRETCHES[0]:g}_{n}"] for n in cells]
        gaps.plot(cells, errors, "--^", color=style.OKABE_ITO[colour], label=f"{label} from the length, ε fixed")
    gaps.axhline(5.0, **style.REFERENCE)
    gaps.set(title="φ¹, φ²: gap to the markers, Z₃ against lengths", xlabel="N", ylabel="[%]", ylim=(0, None))
    gaps.set_xticks(cells)
    gaps.legend(fontsize=7)
    _section(figure, section, data.sel(case=f"map_{rings.STRETCHES[-1]:g}", cells=cells[-1]))
    style.note(
        figure, datasets, "rest radius 0.4, E = ½(Z₃ − 1)², box 2, μ = 0.2, ρ = 1, Δt = 0.005, ε = 2 Δx √stretch"
    )
    return figure


def _section(figure: Figure, ax, one: xr.Dataset) -> None:
    """Z₃ where the force acts, at the end; lines of D at a tenth and a half."""
    shape = rings.ACROSS.size, rings.ALONG.size
    D, z3 = (np.reshape(one[name].values, shape) for name in ("dirac", "z3"))
    here = np.where(D > 0.01, z3, np.nan)
    picture = ax.pcolormesh(
        rings.ACROSS, rings.ALONG, here.T, cmap=style.SEQUENTIAL, shading="nearest", rasterized=True
    )
    ax.contour(rings.ACROSS, rings.ALONG, D.T, [0.1, 0.5], colors="white", linewidths=0.8)
    ax.plot(float(one["radius"][-1]), 0.0, "+", color="white", markersize=9)
    figure.colorbar(picture, ax=ax, label="Z₃ [1]")
    ax.set(title=f"threads of the tube at t = {float(one['t'][-1]):g}; +: the curve", xlabel="r [L]", ylabel="z [L]")
    ax.set(xlim=(0.2, 0.6), ylim=(-0.2, 0.2), aspect="equal")
