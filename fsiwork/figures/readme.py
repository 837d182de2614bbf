"""What the README shows: the picture on its first screen, and what the book costs (`make pictures`)."""

import json
import sys
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fsiwork.figures import style
from fsiwork.targets import SIZES, Plan

RADIUS = np.sqrt(0.75 * 0.5)  # of the circle with the ellipse's area: the exact equilibrium
TIMES = (0.1, 0.3, 4.0)


def membrane(ds: xr.Dataset) -> Figure:
    """Pressure, flow and interface at three times, and the half-axes over time with the exact radius at rest.

    ``ds``: a run of configs/scenes/elliptic_membrane.yaml with ``u``, ``v``, ``p`` and ``phi``.
    """
    figure = Figure(figsize=(9.6, 2.9))
    places, graph = figure.subfigures(1, 2, width_ratios=(2.35, 1))
    axes = places.subplots(1, 3, sharey=True)
    frames = [ds.sel(t=t, method="nearest") for t in TIMES]
    top = float(np.abs(frames[0]["p"]).quantile(0.99)) * 1.25
    for ax, frame in zip(axes, frames, strict=True):
        image = _snapshot(ax, frame, top)
    axes[0].set(ylabel="y")
    places.colorbar(image, ax=list(axes), shrink=0.7, label="pressure p", extend="both")
    _half_axes(graph.subplots(), ds)
    return figure


def _snapshot(ax, frame: xr.Dataset, top: float):
    x, y = frame["x_c"].values, frame["y_c"].values
    u, v = frame["u"].transpose("y_c", "x_n").values, frame["v"].transpose("y_n", "x_c").values
    u, v = 0.5 * (u[:, 1:] + u[:, :-1]), 0.5 * (v[1:] + v[:-1])  # of the faces on both sides: at centres
    h = x[1] - x[0]
    extent = (x[0] - h / 2, x[-1] + h / 2, y[0] - h / 2, y[-1] + h / 2)
    p = frame["p"].transpose("y_c", "x_c").values
    image = ax.imshow(p, extent=extent, cmap=style.DIVERGING, vmin=-top, vmax=top, interpolation="bilinear")
    some = slice(5, None, 9)
    ax.quiver(x[some], y[some], u[some, some], v[some, some], color="0.1", scale=3.5, width=0.007, pivot="mid")
    ax.contour(x, y, frame["phi"].transpose("y_c", "x_c").values, levels=[0.0], colors="k", linewidths=1.8)
    ax.grid(False)
    ax.set(title=f"t = {float(frame['t']):.1f}", xlabel="x", xticks=(0, 1, 2), yticks=(0, 1, 2))
    return image


def _half_axes(ax, ds: xr.Dataset) -> None:
    ax.plot(ds["t_step"], ds["axis_x"], label="half-axis along x")
    ax.plot(ds["t_step"], ds["axis_y"], "--", label="half-axis along y")
    ax.axhline(RADIUS, label="√(ab), exact at rest", **style.REFERENCE)
    ax.set(xlabel="time t", ylabel="length", xlim=(0, float(ds["t_step"][-1])))
    ax.legend(loc="upper right")


def costs(plan: Plan) -> str:
    """Markdown table: CPU seconds and steps of each artefact's studies at both sizes, "–" for what was not run.

    A study that serves two artefacts counts once in the sum.
    """
    head = "| artefact | " + " | ".join(f"{size}: CPU s | steps" for size in SIZES) + " |"
    lines, spent = [head, "|---|" + "---:|" * (2 * len(SIZES))], {}
    for name in plan.book(SIZES[0]):
        cells = []
        for size in SIZES:
            files = [
                Path(plan.file(size, "studies", s)).with_suffix(".cost.json") for s in plan.entry(name, size).studies
            ]
            found = {file: json.loads(file.read_text(encoding="utf-8")) for file in files if file.is_file()}
            spent.setdefault(size, {}).update(found)
            cells += _sums(found.values()) if len(found) == len(files) else ["–", "–"]
        lines.append(f"| `{name}` | {' | '.join(cells)} |")
    sums = [cell for size in SIZES for cell in _sums(spent[size].values())]
    return "\n".join([*lines, f"| all that was run | {' | '.join(sums)} |"])


def _sums(found) -> list[str]:
    parts = list(found)
    return [f"{sum(part['cpu_seconds'] for part in parts):,.0f}", f"{sum(part['steps'] for part in parts):,}"]


def put_costs(readme: Path, plan: Plan) -> None:
    """Write `costs` between its marks in the README."""
    before, rest = readme.read_text(encoding="utf-8").split("<!-- cost -->\n")
    after = rest.split("<!-- /cost -->")[1]
    readme.write_text(f"{before}<!-- cost -->\n{costs(plan)}\n<!-- /cost -->{after}", encoding="utf-8")


if __name__ == "__main__":  # RUN.nc PICTURE.png README.md
    from fsiwork.dataset import open_run

    with open_run(sys.argv[1]) as run:
        print(style.save(membrane(run), sys.argv[2]))
    put_costs(Path(sys.argv[3]), Plan())
