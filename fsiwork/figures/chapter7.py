"""Figures of Chapter 7, the annex: how well transport schemes carry a profile."""

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style

LOOKS = {
    "upwind": ("upwind", style.OKABE_ITO[0], "-"),
    "lax-wendroff": ("Lax–Wendroff", style.OKABE_ITO[1], "--"),
    "centred": ("centred", style.OKABE_ITO[2], ":"),
    "beam-warming": ("Beam–Warming", style.OKABE_ITO[3], "-."),
    "fromm": ("Fromm", style.OKABE_ITO[4], "-"),
    "eno2": ("ENO2", style.OKABE_ITO[5], "--"),
    "eno3": ("ENO3", style.OKABE_ITO[0], ":"),
    "weno5": ("WENO5", style.OKABE_ITO[1], "-"),
    "weno-z": ("WENO-Z", style.OKABE_ITO[2], "-."),
    "upwind5": ("linear upwind 5", style.OKABE_ITO[3], "--"),
}
LOW = ("upwind", "lax-wendroff", "centred", "beam-warming", "fromm")
HIGH = ("eno2", "eno3", "weno5", "weno-z", "upwind5")


def fig_7_7(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """Both profiles after 100 nodes of travel, as printed and with RK3: linear schemes, and errors of the others."""
    data = datasets["schemes"]
    figure, axes = style.sheet(2, 4, size=(12.0, 5.6), sharex="col")
    columns = [(name, stepping) for name in ("distance", "gaussian") for stepping in ("printed", "rk3")]
    for (above, below), (name, stepping) in zip(axes.T, columns, strict=True):
        one = data.sel(profile=name, stepping=stepping)
        _profiles(above, one, name)
        _errors(below, one, stepping)
        words = "RK3" if stepping == "rk3" else "as printed (Euler)"
        above.set_title(f"{'Clipped distance' if name == 'distance' else 'Gaussian'}, {words}")
    for k, label in ((0, "φ [length]"), (2, "q [1]")):
        axes[0, k].set_ylabel(label)
        axes[1, k].set_ylabel(f"error of {label}")
    text = (
        f"Euler with WENO5 is unstable:\nmodes grow {measured['euler_growth']:.1e} times\nin 500 steps; "
        f"L1 is {measured['euler_over_rk3']:.0f} times RK3's"
    )
    axes[1, 2].text(0.66, 0.05, text, transform=axes[1, 2].transAxes, fontsize=6.5, ha="center")
    text = "200 nodes, CFL 0.2, t = 5; centred: always RK3; dashed grey: exact; numbers: L1"
    style.note(figure, datasets, text)
    return figure


def _profiles(ax, data: xr.Dataset, name: str) -> None:
    """The linear schemes of low order: q over x, the overshoots at the kinks visible."""
    for scheme in LOW:
        _line(ax, data.sel(scheme=scheme), scheme, data.sel(scheme=scheme)["q"])
    one = data.sel(scheme=LOW[0])
    ax.plot(one["position"], one["exact"], zorder=1, **style.REFERENCE)
    distance = name == "distance"
    ax.set(xlim=(4.5, 10) if distance else (3, 10), ylim=(-1.1, 1.7) if distance else (-0.1, 1.6))
    _legend(ax)


def _errors(ax, data: xr.Dataset, stepping: str) -> None:
    """The schemes that choose their stencil, and linear upwind 5: the size of the error over x, logarithmic."""
    for scheme in HIGH:
        if stepping == "rk3" or scheme in ("eno2", "eno3", "weno5"):  # the others are not in the book's figure
            one = data.sel(scheme=scheme)
            _line(ax, one, scheme, abs(one["q"] - one["exact"]))
    ax.set(yscale="log", ylim=(1e-7, 8), xlabel="x [length]")
    _legend(ax)


def _line(ax, one: xr.Dataset, scheme: str, values: xr.DataArray) -> None:
    label, colour, dashes = LOOKS[scheme]
    label = f"{label} {float(one['l1']):.1e}"
    ax.plot(one["position"], values, color=colour, linestyle=dashes, linewidth=1.1, label=label)


def _legend(ax) -> None:
    options = {"ncols": 2, "columnspacing": 0.8, "handlelength": 1.4, "handletextpad": 0.4, "borderaxespad": 0.1}
    ax.legend(loc="upper center", fontsize=6, **options).set_in_layout(False)
