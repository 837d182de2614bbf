"""Figures of Chapter 1: level sets, surface tension, and how large a time step may be."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style


def stability_1_54(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> Figure:
    """The limit (1.54): where the linear model ends, what the other schemes do beyond, where the real step ends."""
    figure, (left, middle, right) = style.sheet(1, 3, size=(12.0, 3.7))
    _linear_limit(left, datasets)
    _schemes(middle, datasets["stability_schemes"])
    _real_step(right, datasets["stability_drop"])
    text = f"linear model: spectral radius within {measured['spectral_deviation']:.0e} of (1.54) in every case"
    style.note(figure, datasets, text)
    return figure


def _linear_limit(ax, datasets: Mapping[str, xr.Dataset]) -> None:
    """Distance of the two measured limits of the linear model from (1.54), over what decides: viscous or inertial."""
    kinds = (
        ("stability_spectral", "deviation", "spectral radius ≤ 1", style.OKABE_ITO[0], "s"),
        ("stability_stepping", "excess", "time stepping", style.OKABE_ITO[1], "o"),
    )
    floor = 1e-16  # where round-off leaves a deviation of exactly zero
    for study, name, label, colour, marker in kinds:
        ds = datasets[study]
        table = xr.broadcast(abs(ds[name]), ds["viscosity"], ds["tension"], ds["width"])
        error, viscosity, tension, width = (np.ravel(q.values) for q in table)
        # Δx = 2π/N is the same for all points: viscous against capillary part under the root of (1.54)
        group = viscosity**2 * width / tension
        group = np.where(group > 0, group, 0.1 * group[group > 0].min(initial=1.0))
        options = {"marker": marker, "markerfacecolor": "none", "linestyle": "none", "alpha": 0.6}
        ax.plot(group, np.maximum(error, floor), color=colour, label=f"{label} ({error.size} cases)", **options)
    ax.axhline(2e-4, **style.REFERENCE)
    ax.text(0.98, 3e-4, "2·10⁻⁴", transform=ax.get_yaxis_transform(), ha="right", va="bottom", fontsize=8, color="0.3")
    ax.set(xscale="log", yscale="log", ylim=(0.2 * floor, 3), xlabel="μ² (ε/Δx) / λ  (leftmost: μ = 0)")
    ax.set(ylabel="|measured limit / (1.54) − 1|", title="Linear model, explicit: (1.54) is sharp")
    ax.legend(loc="upper left")


def _schemes(ax, ds: xr.Dataset) -> None:
    """Largest spectral radius of each scheme over Δt/(1.54), at the largest viscosity of the study."""
    looks = {
        "explicit": ("explicit (1.53)", style.COUPLING["explicit"]),
        "implicit": ("implicit (1.59)", {"color": style.OKABE_ITO[2], "marker": "^", "linestyle": "-."}),
        "semi-implicit": ("semi-implicit, Δt in (1.60)", style.COUPLING["semi-implicit"]),
        "predictor-printed": ("Δt² in (1.60), as printed", {"color": "0", "marker": "x", "linestyle": ":"}),
    }
    radius = ds["radius"].max("viscosity") if "viscosity" in ds["radius"].dims else ds["radius"]
    for scheme, (label, look) in looks.items():
        ax.plot(ds["ratio"], radius.sel(scheme=scheme), label=label, **look)
    style.band(ax, 1.0)
    ax.text(0.02, 0.8, "stable below", transform=ax.get_yaxis_transform(), va="top", fontsize=8, color="0.3")
    ax.set(xscale="log", yscale="log", xlabel="Δt / (1.54)", ylabel="largest spectral radius [1]")
    ax.set(title="Linear model, the four schemes")
    ax.legend(loc="upper left")


def _real_step(ax, ds: xr.Dataset) -> None:
    """Limit of the full step for a drop over ε/Δx, one colour a viscosity; open marks: no limit found.

    Full lines: over (1.54). Dotted: over its form for the diffusion that the flow takes.
    """
    name = next(dim for dim in ds["limit"].dims if dim != "viscosity")
    forms = [(by, dashes) for by, dashes in (("lambda", "-"), ("scheme", ":")) if f"predicted_{by}" in ds]
    colours = style.shades(ds.sizes["viscosity"])
    for by, dashes in forms:
        ratio = ds["limit"] / ds[f"predicted_{by}"]
        for k, (viscosity, colour) in enumerate(zip(ds["viscosity"].values, colours, strict=True)):
            line, found = ratio.sel(viscosity=viscosity), ds["found"].sel(viscosity=viscosity)
            look = {"color": colour, "marker": "osD^v"[k % 5]}
            label = f"μ = {float(viscosity):g}" if by == "lambda" else None
            ax.plot(ds[name], line.where(found == 1), label=label, linestyle=dashes, **look)
            ax.plot(ds[name], line.where(found == 0), linestyle="none", markerfacecolor="none", **look)
    if len(forms) > 1:
        ax.plot([], [], color="0.4", linestyle=":", label="over (1.54) for Crank–Nicolson")
    style.band(ax, 1.0)
    ax.set(xlabel="ε / Δx", ylabel="largest stable Δt / (1.54)", title="Full model, explicit, oscillating drop")
    top = max(float((ds["limit"] / ds[f"predicted_{by}"]).max()) for by, _ in forms)
    ax.set_ylim(0, 1.35 * max(1.5, top))
    ax.legend(loc="upper right", ncols=2)
