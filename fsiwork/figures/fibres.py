"""Figure of the tethered fibre: its shapes over time at two stiffnesses, and its length."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import fibres

LABEL = {"soft": "stiffness 5", "stiff": "stiffness 200"}


def curve_fibre(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Above: the fibre at five times for each stiffness, dots at every tenth of its rest length; below: its lengths."""
    data = datasets["curve_fibre"]
    figure, panels = style.sheet(1, 3, size=(11.5, 3.9), width_ratios=(1, 1, 1.1))
    for ax, case in zip(panels, fibres.CASES, strict=False):
        x, y = fibres.paths(data, case)
        t = data["t"].sel(case=case).values
        when = np.linspace(0, t.size - 1, 5).astype(int)
        for k, colour in zip(when, style.shades(when.size), strict=True):
            ax.plot(x[k] - x[0, 0], y[k], color=colour, label=f"t = {t[k]:g}")
            ax.plot((x[k] - x[0, 0])[::10], y[k, ::10], ".", color=colour)
        ax.axhline(0.0, color="0.2", linewidth=2.5)
        ax.set(
            title=LABEL[case],
            xlabel="x − root [L]",
            ylabel="y [L]",
            aspect="equal",
            xlim=(-0.05, 0.55),
            ylim=(-0.03, 0.6),
        )
    panels[0].legend()
    for case, colour in zip(fibres.CASES, style.OKABE_ITO, strict=False):
        one = data.sel(case=case)
        for name, dashes, label in (("length", "-", "by labels"), ("smeared", "--", "∫|w|D")):
            q = one[name].values
            panels[2].plot(one["t"], 100 * (q / q[0] - 1), dashes, color=colour, label=f"{LABEL[case]}, {label}")
    style.band(panels[2], 0.0, 1.0)
    panels[2].set(title="change of length; grey: one percent", xlabel="time t [T]", ylabel="length / first − 1 [%]")
    panels[2].legend()
    style.note(figure, datasets, "box 2 × 1 × 1, lid 1 at y = 1, μ = ρ = 1, fibre 0.5 long, E = ½λ(Z₃ − 1)², ε = 0.125")
    return figure
