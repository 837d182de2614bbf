"""One look for all figures: size, colours that everybody can tell apart, cost and reference marks, saved PNGs.

Importing this module chooses matplotlib's file-only backend and sets its defaults. A figure is made as
``fig, ax = sheet()`` and saved by `save`; nothing here keeps a reference to it.
"""

import io
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from cmcrameri import cm
from cycler import cycler
from matplotlib.figure import Figure
from PIL import Image

OKABE_ITO = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442")
"""Okabe and Ito's palette, told apart with every common kind of colour vision; yellow last, it is faint on white."""

COUPLING = {
    "explicit": {"color": OKABE_ITO[1], "marker": "o", "linestyle": "-"},
    "semi-implicit": {"color": OKABE_ITO[0], "marker": "s", "linestyle": "--"},
    "stabilised": {"color": OKABE_ITO[2], "marker": "^", "linestyle": "-."},
    "iterated": {"color": OKABE_ITO[3], "marker": "D", "linestyle": ":"},
}
"""How a time scheme is drawn, in every figure alike: colour, marker and dashes say the same."""

REFERENCE = {"color": "0.35", "linewidth": 1.0, "linestyle": (0, (6, 2))}
SEQUENTIAL, DIVERGING = cm.batlow, cm.vik
DPI = 125

matplotlib.use("Agg")
matplotlib.rcParams.update(
    {
        "axes.grid": True,
        "axes.labelsize": 9,
        "axes.prop_cycle": cycler(color=OKABE_ITO[:7]),
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlelocation": "left",
        "axes.titlesize": 9.5,
        "figure.constrained_layout.use": True,
        "figure.constrained_layout.w_pad": 0.1,
        "figure.dpi": DPI,
        "font.family": "DejaVu Sans",
        "font.size": 9,
        "grid.alpha": 0.25,
        "grid.linewidth": 0.6,
        "image.cmap": "cmc.batlow",
        "image.origin": "lower",
        "legend.fontsize": 8,
        "legend.frameon": False,
        "lines.linewidth": 1.4,
        "lines.markersize": 4.5,
        "savefig.dpi": DPI,
        "xtick.labelsize": 8,
        "ytick.labelsize": 8,
    }
)


def sheet(rows: int = 1, columns: int = 1, size: tuple[float, float] | None = None, **options) -> tuple[Figure, Any]:
    """A figure and its axes (one, or an array as by ``Figure.subplots``); ``size`` in inches, 3.6 × 3 a panel."""
    figure = Figure(figsize=size or (3.6 * columns + 0.4, 3.0 * rows + 0.2))
    return figure, figure.subplots(rows, columns, **options)


def shades(count: int) -> list[tuple[float, ...]]:
    """Colours for an ordered parameter (cells, time), dark to light, all of them dark enough for a line."""
    return [tuple(SEQUENTIAL(q)) for q in np.linspace(0.05, 0.72, max(count, 2))[:count]]


def band(ax, expected: float, tolerance: float = 0.0, label: str | None = None, axis: str = "y") -> None:
    """A reference line at ``expected`` and, when ``tolerance`` > 0, the band around it that a check accepts."""
    line, span = (ax.axhline, ax.axhspan) if axis == "y" else (ax.axvline, ax.axvspan)
    if tolerance > 0:
        span(expected - tolerance, expected + tolerance, color="0.35", alpha=0.13, linewidth=0, zorder=0)
    line(expected, label=label, zorder=1, **REFERENCE)


def cost(datasets: Mapping[str, Any] | Iterable[Any]) -> str:
    """What the data of a figure cost: points, CPU seconds, steps, cells along a side, as far as the datasets say."""
    found = list(datasets.values() if isinstance(datasets, Mapping) else datasets)

    def values(name):
        parts = [np.ravel(ds[name].values.astype(float)) for ds in found if name in ds]
        joined = np.concatenate([*parts, np.zeros(0)])
        return joined[joined > 0]  # neither unknown nor without a grid

    words = []
    if (seconds := values("cpu_seconds")).size:
        words.append(f"{_short(seconds.sum())} CPU seconds")
    if (steps := values("n_steps")).size:
        words.append(f"{_short(steps.sum())} steps")
    if (cells := values("n_cells")).size:
        low, high = int(cells.min()), int(cells.max())
        words.append(f"{low} to {high} cells along a side" if low < high else f"{low} cells along a side")
    return "Cost: " + ", ".join(words) if words else ""


def _short(value: float) -> str:
    """A count in at most three figures."""
    return f"{value:.3g}" if value < 1000 else f"{float(f'{value:.3g}'):,.0f}".replace(",", " ")


def note(figure: Figure, datasets: Mapping[str, Any] | Iterable[Any], text: str = "") -> None:
    """The line under a figure: ``text``, then the cost of its data."""
    line = "  ·  ".join(part for part in (text, cost(datasets)) if part)
    if line:
        figure.supxlabel(line, fontsize=7, color="0.4", x=0.99, ha="right")


def save(figure: Figure, path: str | Path, largest: int = 150_000) -> Path:
    """Write a PNG of at most ``largest`` bytes, the same bytes for the same figure (no date, no version), whole or not.

    A picture that is too large is drawn with fewer pixels, then with a palette of 256 colours, then both, ever smaller.
    """
    path = Path(path)
    tries = [(DPI, False), (0.8 * DPI, False), *((DPI * 0.8**k, True) for k in range(7))]
    for dpi, palette in tries:
        data = _png(figure, dpi, palette)
        if len(data) <= largest:
            break
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    part.write_bytes(data)
    part.replace(path)
    return path


def _png(figure: Figure, dpi: float, palette: bool = False) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=dpi, metadata={"Software": None})
    if not palette:
        return out.getvalue()
    picture = Image.open(out).convert("RGB").quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    small = io.BytesIO()
    picture.save(small, format="PNG", optimize=True)
    return small.getvalue()
