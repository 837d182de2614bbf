"""Figures of the flow solver, of small oscillations, and of the balance of error and cost (Chapter 3)."""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.studies import modes, tradeoff

Datasets, Measured = Mapping[str, xr.Dataset], Mapping[str, float]


def taylor_green(datasets: Datasets, measured: Measured) -> Figure:
    """Errors of velocity and pressure over Δx and over Δt, with the slope of order two."""
    figure, (left, right) = style.sheet(1, 2)
    space, time = datasets["taylor_green_space"].sortby("cells"), datasets["taylor_green_time"].sortby("step")
    _errors(left, 2 * math.pi / space["cells"].values, space, "Δx", "against the exact solution")
    _errors(right, time["step"].values, time, "Δt", "against a step 16 times finer than the finest")
    left.set(title="Grid", ylabel="largest error")
    right.set(title="Time step, from an evolved state")
    orders = ", ".join(
        f"{where} {measured[f'order_{where}_u']:.2f} (u) {measured[f'order_{where}_p']:.2f} (p)"
        for where in ("space", "time")
    )
    style.note(figure, datasets, f"least order: {orders}")
    return figure


def _errors(ax, h: np.ndarray, data: xr.Dataset, name: str, against: str) -> None:
    for error, label, colour, marker in (
        ("error_u", "velocity", style.OKABE_ITO[0], "s"),
        ("error_p", "pressure", style.OKABE_ITO[1], "o"),
    ):
        values = data[error].values
        ax.plot(h, values, color=colour, marker=marker, label=f"{label}, {against}")
        k = int(np.argmax(h))
        ax.plot(h, values[k] * (h / h[k]) ** 2, **style.REFERENCE)
    ax.plot([], [], label="order 2", **style.REFERENCE)
    ax.set(xscale="log", yscale="log", xlabel=name)
    ax.set_xticks(h, [f"{q:.3g}" for q in h])
    ax.minorticks_off()
    low, high = ax.get_ylim()
    ax.set_ylim(low, 30 * high)
    ax.legend(loc="upper left", fontsize=7)


def cavity(datasets: Datasets, measured: Measured) -> Figure:
    """Velocity on the vertical mid-line at both Reynolds numbers, with the points of Ghia, Ghia and Shin."""
    figure, (left, right) = style.sheet(1, 2, width_ratios=(1.2, 1))
    data = datasets["cavity"]
    for k, case in enumerate(data["case"].values):
        one, colour = data.sel(case=case), style.OKABE_ITO[k]
        label = f"Re {float(one['reynolds']):.0f}, {int(one['n_cells'])}² cells, t = {float(one['t_end']):.0f}"
        left.plot(one["profile"], one["y_profile"], color=colour, linestyle=("-", "--")[k % 2], label=label)
        left.plot(one["ghia"], one["y_position"], "os"[k % 2], color=colour, markerfacecolor="none")
        right.plot(one["u"] - one["ghia"], one["y_position"], marker="os"[k % 2], color=colour, linestyle="none")
    left.plot([], [], "o", color="0.3", markerfacecolor="none", label="Ghia, Ghia and Shin (1982)")
    left.set(xlabel="u / lid velocity on x = 1/2", ylabel="y / L", title="Steady profile")
    left.legend(loc="lower right", fontsize=7)
    for sign in (-1, 1):
        right.axvline(0.005 * sign, **style.REFERENCE)
    right.set(xlabel="u − table (dashed: ±0.005, accepted)", title="Deviation", xlim=(-0.0065, 0.0065))
    worst = ", ".join(f"{case} {measured[f'deviation_{case}']:.4f}" for case in data["case"].values)
    style.note(figure, datasets, f"largest deviation: {worst}; max|Δu|/Δt at the end ≤ {measured['change']:.1e}")
    return figure


def mode_drop(datasets: Datasets, measured: Measured) -> Figure:
    """Small oscillation of a drop, with the sharp and the smeared theory."""
    return _mode(datasets["mode_drop"], measured)


def mode_membrane(datasets: Datasets, measured: Measured) -> Figure:
    """Small oscillation of a stretched membrane, with the sharp and the smeared theory."""
    return _mode(datasets["mode_membrane"], measured)


def _mode(data: xr.Dataset, measured: Measured) -> Figure:
    """Difference of the half-axes over time; the theories take amplitude, phase and rest from a fit to the run."""
    figure, ax = style.sheet(size=(6.6, 3.5))
    times, values = modes.oscillation(data)
    sharp, smeared = modes.references(data)
    fitted = type(sharp)(measured["omega"], measured["gamma"])
    every = max(1, times.size // 60)
    look = {"linestyle": "none", "marker": "o", "markersize": 3, "markerfacecolor": "none"}
    ax.plot(times[::every], values[::every], color="0", label=f"run, {int(data['n_cells'])}² cells", **look)
    for mode, label, colour, dashes in (
        (fitted, "fit", style.OKABE_ITO[0], "-"),
        (smeared, "linear theory, same ε", style.OKABE_ITO[2], "-."),
        (sharp, "linear theory, sharp", style.OKABE_ITO[1], "--"),
    ):
        text = f"{label}: ω = {mode.omega:.3f}, γ = {mode.gamma:.3f}"
        ax.plot(times, _drawn(times, values, fitted, mode), color=colour, linestyle=dashes, label=text)
    ax.axhline(0.0, color="0.6", linewidth=0.6)
    ax.set(xlabel="time", ylabel="half-axis x − half-axis y [length]", title="Damped oscillation, mode n = 2")
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + 0.55 * (high - low))
    ax.legend(loc="upper right", ncols=2, fontsize=7.5)
    parts = f"ω/sharp {measured['omega_over_sharp']:.3f}, γ/sharp {measured['gamma_over_sharp']:.3f}"
    style.note(figure, [data], parts)
    return figure


def _drawn(times, values, fitted, mode) -> np.ndarray:
    """The oscillation of a theory with the rest, amplitude and phase that the fit has at the first time."""
    late = times - times[0]
    wave = np.exp((1j * fitted.omega - fitted.gamma) * late)
    basis = np.stack([np.ones_like(late), wave.real, wave.imag], 1)
    rest, a, b = np.linalg.lstsq(basis, values, rcond=None)[0]
    other = np.exp((1j * mode.omega - mode.gamma) * late)
    return rest + a * other.real + b * other.imag


def tradeoff_membrane(datasets: Datasets, measured: Measured) -> Figure:
    """Error of the half-axes over CPU seconds, the front, the book's setting, and what the next digit costs."""
    figure, ax = style.sheet(size=(7.4, 4.6))
    data, finest = datasets["tradeoff_grid"], datasets["tradeoff_finest"]
    found = tradeoff.runs(data, finest)
    sizes = {int(n): 2.5 + 2.2 * k for k, n in enumerate(np.sort(data["cells"].values))}
    for run in found:
        look = style.COUPLING[run.point["coupling"]] | {"linestyle": "none", "alpha": 0.65}
        ax.plot(run.cpu, run.error, markersize=sizes[run.point["cells"]], markerfacecolor="none", **look)
    best = tradeoff.front(found)
    ax.step([run.cpu for run in best], [run.error for run in best], where="post", color="0", linewidth=1.0, zorder=1)
    for coupling in data["coupling"].values:
        ax.plot([], [], label=str(coupling), markerfacecolor="none", **style.COUPLING[coupling] | {"linestyle": "none"})
    for cells, size in sizes.items():
        ax.plot([], [], "s", color="0.5", markersize=size, markerfacecolor="none", label=f"{cells}² cells")
    ax.plot([], [], color="0", linewidth=1.0, label="no run is cheaper and better")
    _mark_book(ax, measured)
    last = f"{int(finest['n_cells'])}², {float(finest['cpu_seconds']):.0f} CPU seconds"
    ax.set(
        xscale="log", yscale="log", xlabel="CPU seconds of the run", ylabel="largest error of a half-axis [% of √0.375]"
    )
    ax.set_title(f"One more digit costs {measured['cost_of_next_digit']:.0f} times the CPU time.")
    ax.legend(loc="lower left", ncols=2)
    style.note(figure, datasets, f"error against the own finest run ({last}), t ≤ 2")
    return figure


def _mark_book(ax, measured: Measured) -> None:
    where = measured["book_cpu"], measured["book_error"]
    if not all(map(math.isfinite, where)):
        return
    ax.plot(*where, marker="*", markersize=13, color=style.OKABE_ITO[3], linestyle="none", zorder=3)
    text = "the book's setting:\n128², Δt = 0.008, semi-implicit"
    arrow = {"arrowstyle": "-", "color": "0.4", "shrinkB": 6}
    ax.annotate(text, where, (30, 76), textcoords="offset points", fontsize=8, arrowprops=arrow)
