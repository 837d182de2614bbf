"""Figures of Chapter 3: drop and membrane immersed in a fluid (Figs 3.9–3.14, Table 3.1)."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fsiwork.figures import style
from fsiwork.studies import membranes, pressure
from fsiwork.studies.histories import history

Datasets, Measured = Mapping[str, xr.Dataset], Mapping[str, float]
TIME, AXES = "t [time]", "half-axes [length]"
AXIS = {"axis_x": "horizontal", "axis_y": "vertical"}


def _half_axes(ax, data: xr.Dataset, label: str, look: dict, marks: int = 0, **point) -> None:
    """Both half-axes of a run over time in one look; ``marks``: so many markers, else none."""
    for gauge in AXIS:
        t, q = history(data, gauge, **point)
        every = max(1, t.size // marks) if marks else None
        options = look if marks else {k: v for k, v in look.items() if k != "marker"}
        ax.plot(t, q, label=label, markevery=every, **options)
        label = None


# ------------------------------------------------------------------------------------------------------- the drop
def fig_3_9(datasets: Datasets, measured: Measured) -> Figure:
    """Half-axes of the drop with the semi-implicit (left) and the explicit scheme (right), and its limit."""
    runs = datasets["drop_schemes"]
    figure, (left, right) = style.sheet(1, 2, size=(8.6, 3.3), sharey=True)
    for ax, coupling, word in ((left, "semi-implicit", "stable"), (right, "explicit", "unstable")):
        for k, gauge in enumerate(AXIS):
            t, q = history(runs, gauge, coupling=coupling)
            ax.plot(t, q, "-" if k == 0 else "--", color=style.OKABE_ITO[k], label=AXIS[gauge])
        ax.set(xlabel=TIME, title=f"{coupling}: {word}", ylim=(0.45, 0.85))
        style.band(ax, membranes.RADIUS)
    right.set_xlim(0, 1.9 * float(history(runs, "axis_x", coupling="explicit")[0][-1]))
    right.axvline(measured["explicit_from"], color="0", linewidth=0.8)
    right.annotate(
        f"past the bounds at t = {measured['explicit_from']:.3g}",
        (measured["explicit_from"], 0.83), (4, 0), textcoords="offset points", fontsize=8, va="top",
    )  # fmt: skip
    lines = (
        "largest stable Δt, explicit:",
        f"  bisected {measured['explicit_limit']:.5f}",
        f"  (1.54)    {measured['predicted_1_54']:.5f}",
        f"  ratio      {measured['limit_over_1_54']:.2f}",
        "here Δt = 0.00250",
    )
    right.text(0.6, 0.04, "\n".join(lines), transform=right.transAxes, fontsize=8, va="bottom")
    left.set_ylabel(AXES)
    left.legend(loc="upper right", ncols=2)
    style.note(figure, datasets, "grey: circle of the same area")
    return figure


def fig_3_10(datasets: Datasets, measured: Measured) -> Figure:
    """Half-axes on the two finest grids; deviation of the volume on all grids beside what the book reports."""
    runs = datasets["drop_refinement"]
    cells = sorted(int(n) for n in runs["cells"].values)
    figure, (left, right) = style.sheet(1, 2, size=(8.6, 3.4))
    for n, look in zip(
        cells[-2:], ({"marker": "x", "markersize": 3.5, "linestyle": "none"}, {"linestyle": "-"}), strict=True
    ):
        for k, (gauge, word) in enumerate(AXIS.items()):
            t, q = history(runs, gauge, cells=n)
            step = max(1, t.size // 130) if "marker" in look else 1
            left.plot(t[::step], q[::step], color=style.OKABE_ITO[k], label=f"{word}, N = {n}", **look)
    style.band(left, membranes.RADIUS)
    left.set(xlabel=TIME, ylabel=AXES, ylim=(0.48, 0.86), title="Axes on the two finest grids")
    left.legend(loc="upper right", ncols=2)
    for n, colour in zip(cells, style.shades(len(cells)), strict=True):
        t, volume = history(runs, "geometric_volume", cells=n)
        deviation = 100 * np.abs(volume / volume[0] - 1)
        step = max(1, t.size // 400)
        right.plot(t[1::step], np.maximum(deviation[1::step], 1e-6), color=colour, linewidth=1.1)
        worst = measured[f"volume_deviation_{n}"]
        place, side = ((0, 4), "bottom") if n == cells[-1] else ((0, -4), "top")
        right.annotate(f"N = {n}: {worst:.2g} %", (t[-1], deviation[-1]), place, color=colour,
                       textcoords="offset points", fontsize=8, ha="right", va=side)  # fmt: skip
    own = datasets["drop_stabilised"]
    for n in sorted(int(n) for n in own["cells"].values):
        t, volume = history(own, "geometric_volume", cells=n)
        deviation, colour = 100 * np.abs(volume / volume[0] - 1), style.shades(len(cells))[cells.index(n)]
        every = max(1, t.size // 400)
        right.plot(t[1::every], np.maximum(deviation[1::every], 1e-6), ":", color=colour, linewidth=1.1)
    for percent, n in ((1.5, 64), (0.1, 512)):
        right.axhline(percent, **style.REFERENCE)
        right.text(0.03, percent, f"book, N = {n}: {percent:g} %", fontsize=8, va="bottom", color="0.3",
                   transform=right.get_yaxis_transform())  # fmt: skip
    right.set(yscale="log", ylim=(1e-4, 5), xlabel=TIME, ylabel="|volume / first volume − 1| [%]")
    right.set_title("Volume: largest deviation by grid")
    text = f"last refinement: {measured['amplitude_difference']:.2g} % of the amplitude  ·  stabilised (dotted): "
    text += ", ".join(f"{measured[f'volume_stabilised_{int(n)}']:.2g} %" for n in own["cells"].values)
    style.note(figure, datasets, text)
    return figure


# --------------------------------------------------------------------------------------------------- the membrane
def table_3_1(datasets: Datasets, measured: Measured) -> Figure:
    """Largest steps over N: bisected (filled: D plain, open: renormalised), (1.54), and the book's."""
    data = datasets["membrane_limits"].sortby("cells")
    n = data["cells"].values.astype(float)
    figure, ax = style.sheet(size=(6.4, 4.4))
    for coupling in membranes.COUPLINGS:
        look = style.COUPLING[coupling]
        for dirac, more in (("plain", {}), ("renormalised", {"markerfacecolor": "none", "alpha": 0.6})):
            found = data["found"].sel(coupling=coupling, dirac=dirac).values
            limit = membranes.limits(data, coupling, dirac).values
            none = ", none found up to there" if (found == 0).all() else ""
            ax.plot(n, limit, label=f"{coupling}, {dirac} D{none}", **{**look, **more})
    one = data.sel(coupling="explicit", dirac="plain")
    ax.plot(n, one["predicted_tension"], color="0", linestyle=":", label="(1.54) with sE'(s)")
    ax.plot(n, one["predicted_lambda"], color="0.5", linestyle=":", label="(1.54) with λ")
    book = [(m, steps) for m, steps in membranes.BOOK_STEPS.items() if m in n]
    for k, (coupling, marker) in enumerate((("explicit", "+"), ("semi-implicit", "x"))):
        ax.plot([m for m, _ in book], [steps[k] for _, steps in book], marker, color="0", markersize=8,
                label=f"the book, {coupling}")  # fmt: skip
    ax.set(xscale="log", yscale="log", xlabel="N [cells along a side]", ylabel="largest stable Δt [time]")
    ax.set_xticks(n, [f"{m:g}" for m in n])
    ax.minorticks_off()
    ax.set(xlim=(0.85 * n[0], 1.18 * n[-1]), title="λ = 10, μ = 0.1, ε = 3 Δx, backward Euler")
    figure.legend(loc="outside right upper")
    figure.set_size_inches(8.6, 4.0)
    text = f"limit over (1.54) with sE': {measured['ratio_min']:.2f} to {measured['ratio_max']:.2f}"
    style.note(figure, datasets, text)
    return figure


def fig_3_11(datasets: Datasets, measured: Measured) -> Figure:
    """Half-axes with the same large step on three grids, for ε = 6 Δx and for 3 Δx."""
    runs = datasets["membrane_large_step"]
    cells = sorted(int(n) for n in runs["cells"].values)
    figure, panels = style.sheet(1, len(cells), size=(10.6, 3.4), sharey=True)
    for ax, n in zip(panels, cells, strict=True):
        for width, look in ((3, {"color": style.OKABE_ITO[1], "linestyle": ":"}), (6, {"color": style.OKABE_ITO[0]})):
            tail = "" if width == membranes.WIDE else f"_width_{width}"
            label = f"ε = {width} Δx: end {measured[f'axis_error_{n}{tail}']:.2g} % off"
            _half_axes(ax, runs, label, look, cells=n, width=width)
        style.band(ax, membranes.RADIUS, 0.005 * membranes.RADIUS)
        ax.set(xlabel=TIME, title=f"N = {n}, Δt = 0.01", ylim=(0.48, 0.78))
        ax.legend(loc="upper right")
    panels[0].set_ylabel(AXES)
    style.note(figure, datasets, "semi-implicit; grey: exact equilibrium 0.6124 ± 0.5 %")
    return figure


def fig_3_12(datasets: Datasets, measured: Measured) -> Figure:
    """Half-axes of the three schemes at the book's steps, N = 128 and 256, ε = 3 Δx (above) and 6 Δx."""
    runs = datasets["membrane_schemes"]
    figure, panels = style.sheet(2, 2, size=(7.4, 5.0), sharex=True, sharey=True)
    for row, width in zip(panels, sorted(runs["width"].values), strict=True):
        tail = "" if width == membranes.NARROW else f"_width_{width:g}"
        for ax, n in zip(row, (128, 256), strict=True):
            for coupling in membranes.COUPLINGS:
                case = f"{coupling.replace('-', '_')}_{n}"
                dt = float(runs["dt"].sel(case=case, width=width).max())
                look = {**style.COUPLING[coupling], "markersize": 4}
                _half_axes(ax, runs, f"{coupling}, Δt = {dt:.2g}", look, 12, case=case, width=width)
            style.band(ax, membranes.RADIUS, 0.005 * membranes.RADIUS)
            book, own = (measured[f"{name}_amplitude_error_{n}{tail}"] for name in ("semi_implicit", "stabilised"))
            ax.set(title=f"N = {n}, ε = {width:g} Δx", ylim=(0.48, 0.86))
            words = "first extremes against the explicit scheme,\n% of amplitude: "
            words += f"{book:.2g} semi-implicit, {own:.2g} stabilised"
            ax.text(0.98, 0.03, words, transform=ax.transAxes, fontsize=8, ha="right")
            ax.legend(loc="upper right")
    for ax in panels[-1]:
        ax.set_xlabel(TIME)
    for ax in panels[:, 0]:
        ax.set_ylabel(AXES)
    style.note(figure, datasets, "grey: exact equilibrium 0.6124 ± 0.5 %")
    return figure


# --------------------------------------------------------------------------------------------------- its pressure
def fig_3_13(datasets: Datasets, measured: Measured) -> Figure:
    """Pressure field at t = 0.4 with the interface, and the two lines on which the jump is measured."""
    now = pressure.frame(datasets["pressure_moving"], 0.4)
    x, y, p, phi = now["x_c"].values, now["y_c"].values, now["p"].values, now["phi"].values
    figure, ax = style.sheet(size=(5.6, 4.9))
    levels = np.linspace(p.min(), p.max(), 25)
    filled = ax.contourf(x, y, p, levels, cmap=style.SEQUENTIAL)
    ax.contour(x, y, phi, [0.0], colors="w", linewidths=1.6)
    ax.axhline(1, color="w", linewidth=0.6, linestyle=":")
    ax.axvline(1, color="w", linewidth=0.6, linestyle=":")
    ax.grid(visible=False)
    ax.set(xlabel="x [length]", ylabel="y [length]", aspect="equal", title="λ = 1, Re = 100, ε = 0.1, t = 0.4")
    figure.colorbar(filled, label="p [mass / (length · time²)], mean zero", shrink=0.9, ticks=MaxNLocator(7))
    words = [
        f"{line}: jump {measured[f'jump_{axis}']:.4f}, {measured[f'jump_over_balance_{axis}']:.3f} of the local balance"
        for axis, line in (("x", "y = 1"), ("y", "x = 1"))
    ]
    ax.text(0.02, 0.02, "\n".join(words), color="w", fontsize=8, transform=ax.transAxes)
    ax.set(xlim=(0, 2), ylim=(0, 2), facecolor=style.SEQUENTIAL(0.3))
    style.note(figure, datasets, "white: interface")
    return figure


def fig_3_14(datasets: Datasets, measured: Measured) -> Figure:
    """Pressure along y = 1 at t = 0.4 and at rest; the straight fits beside the layer, extended to the interface."""
    figure, panels = style.sheet(1, 2, size=(9.4, 3.6), sharey=True)
    stages = (("pressure_moving", 0.4, "t = 0.4, moving"), ("pressure_rest", 20.0, "t = 20, at rest"))
    for ax, (study, t, title) in zip(panels, stages, strict=True):
        data = datasets[study]
        now, line = pressure.frame(data, t), pressure.across(data, t, "x")
        x = np.linspace(float(now["x_c"][0]), float(now["x_c"][-1]), 600)
        ax.plot(x, pressure.along(pressure.surface(now["p"]), "x", (1.0, 1.0), x), color=style.OKABE_ITO[0], label="p")
        eps = float(pressure.spec(data)["bodies"][0]["width"]["length"])
        ax.axvspan(line.position - eps, line.position + eps, color="0.35", alpha=0.13, linewidth=0, label="± ε")
        for side, fit in zip((-1, 1), line.fits, strict=True):
            r = np.array([0, pressure.FAR * eps * side])
            label = "fit beside the layer" if side < 0 else None
            ax.plot(line.position + r, np.polyval(fit, r), "--", color=style.OKABE_ITO[1], label=label)
        ends = [fit[1] for fit in line.fits]
        ax.plot([line.position] * 2, ends, "o-", color="0", linewidth=1, markersize=3)
        words = f"jump {line.jump:.4f}\nE'H − [2μ n·Dn] = {line.balance:.4f}\nratio {line.jump / line.balance:.3f}"
        if t > 1:
            words += f"\nexact at rest 0.367007 λ ({100 * (measured['rest_jump'] / 0.367007 - 1):+.2f} %)"
        ax.text(0.27, 0.3, words, transform=ax.transAxes, fontsize=8)
        ax.set(xlabel="x [length], y = 1", title=title)
    panels[0].set_ylabel("p [mass / (length · time²)]")
    panels[0].legend(loc="upper left", bbox_to_anchor=(0.24, 0.75))
    style.note(figure, datasets, "λ = 1, Re = 100, ε = 0.1")
    return figure
