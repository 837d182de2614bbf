"""A look at any run: what its file holds, as one picture or as a short film."""

import io
import os
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

from fsiwork.figures import style

FIELDS = {
    "speed": ("speed |u|", style.SEQUENTIAL),
    "p": ("pressure p", style.DIVERGING),
    "vorticity": ("vorticity", style.DIVERGING),
    "phi": ("level set φ", style.DIVERGING),
}
GAUGES = (
    ("energy", ("kinetic_energy", "elastic_energy"), False),
    ("half extent", ("axis_x", "axis_y", "axis_z"), False),
    ("change [%]", ("volume", "length"), True),
    ("speed", ("max_speed",), False),
)
LONGEST_FILM = 60  # frames


def show(ds: xr.Dataset, path: str | Path) -> Path:
    """Draw the fields and gauges of a run: a PNG overview, or an animated GIF when ``path`` ends in ``.gif``.

    ``ds`` is the dataset of a run (`fsiwork.dataset.open_run`), in the plane or in space (the middle plane across z is
    shown), with any choice of fields. Raises ValueError for another ending, or for a run with nothing to draw.
    """
    path = Path(path)
    if path.suffix.lower() == ".gif":
        return _film(ds, path)
    if path.suffix.lower() != ".png":
        raise ValueError(f"{path}: pictures end in .png, films in .gif")
    return style.save(overview(ds), path)


def overview(ds: xr.Dataset) -> Figure:
    """The first, middle and last frame of up to three fields, and below them the gauges over time."""
    names = _drawable(ds)
    panels = _gauge_panels(ds)
    if not names and not panels:
        raise ValueError("the run has neither fields nor gauges to draw")
    last = ds.sizes.get("t", 1) - 1
    frames = sorted({0, last // 2, last})
    tall = 2.6 * min(max(_aspect(ds), 0.4), 1.6) if names else 0.0
    heights = [height for height in (len(names) * (tall + 0.35), 2.3 * bool(panels)) if height]
    figure = Figure(figsize=(3.1 * (len(frames) if names else len(panels)) + 0.5, sum(heights) + 0.4))
    parts = list(np.ravel(figure.subfigures(len(heights), 1, height_ratios=heights)))
    if names:
        axes = parts.pop(0).subplots(len(names), len(frames), squeeze=False)
        for row, name in zip(axes, names, strict=True):
            _field_row(row, ds, name, frames)
    if panels:
        for ax, panel in zip(parts[0].subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
            _draw_gauges(ax, ds, panel)
    figure.suptitle(_title(ds), fontsize=10, x=0.01, ha="left")
    return figure


def _drawable(ds: xr.Dataset) -> list[str]:
    """Fields that the file can give, at most three; φ only where nothing else is (its zero line is drawn anyway)."""
    names = [name for name in FIELDS if _plane(ds, name, 0) is not None]
    return [name for name in names if name != "phi" or names == ["phi"]][:3]


def _title(ds: xr.Dataset) -> str:
    ended = ds.attrs.get("ended", "")
    title = ds.attrs.get("title", "run")
    return f"{title} — {ended}" if ended and ended != "complete" else title


def _aspect(ds: xr.Dataset) -> float:
    return float(ds.sizes["y_c"] / ds.sizes["x_c"])


def _centred(q: np.ndarray, axis: int, n: int) -> np.ndarray:
    """Face values averaged to the n centres along ``axis`` (n + 1 faces, or n on a periodic axis)."""
    high = np.take(q, range(1, n + 1), axis, mode="wrap")
    return 0.5 * (np.take(q, range(n), axis) + high)


def _middle(q: xr.DataArray) -> xr.DataArray:
    """The middle plane across z of a field in space; bodies are joined by the smallest value."""
    q = q.min("body") if "body" in q.dims else q
    for dim in ("z_c", "z_n"):
        q = q.isel({dim: q.sizes[dim] // 2}) if dim in q.dims else q
    return q


def _plane(ds: xr.Dataset, name: str, frame: int) -> np.ndarray | None:
    """Values of a field at the centres of the plane, shape (n_y, n_x); None if the file cannot give it."""
    if name != "speed":
        if name not in ds or not {"t", "y_c", "x_c"} <= set(ds[name].dims):
            return None
        return _middle(ds[name].isel(t=frame)).transpose("y_c", "x_c").values.astype(float)
    if not {"u", "v"} <= set(ds.data_vars) or "x_n" not in ds["u"].dims:
        return None
    u = _centred(_middle(ds["u"].isel(t=frame)).transpose("y_c", "x_n").values.astype(float), 1, ds.sizes["x_c"])
    v = _centred(_middle(ds["v"].isel(t=frame)).transpose("y_n", "x_c").values.astype(float), 0, ds.sizes["y_c"])
    return np.hypot(u, v)


def _range(planes: list[np.ndarray], diverging: bool) -> tuple[float, float]:
    """Limits of the colours: common to all frames, around zero for signed fields, never empty."""
    values = np.concatenate([np.ravel(q[np.isfinite(q)]) for q in planes])
    top = float(np.abs(values).max(initial=0.0)) or 1.0
    return (-top, top) if diverging else (0.0, top)


def _image(ax, ds: xr.Dataset, values: np.ndarray, name: str, limits: tuple[float, float]):
    """Colours of one field; returns the image."""
    x, y = ds["x_c"].values, ds["y_c"].values
    h = x[1] - x[0]
    extent = (x[0] - h / 2, x[-1] + h / 2, y[0] - h / 2, y[-1] + h / 2)
    ax.grid(False)
    options = {"extent": extent, "cmap": FIELDS[name][1], "vmin": limits[0], "vmax": limits[1]}
    return ax.imshow(values, interpolation="bilinear", **options)


def _interface(ax, ds: xr.Dataset, frame: int, name: str):
    """The line φ = 0; returns it, or None when there is none in the file or in the plane."""
    phi = _plane(ds, "phi", frame)
    if phi is None or not (np.isfinite(phi).all() and phi.min() < 0 < phi.max()):
        return None
    colour = "w" if name == "speed" else "k"
    return ax.contour(ds["x_c"].values, ds["y_c"].values, phi, levels=[0.0], colors=colour, linewidths=1.2)


def _field_row(axes, ds: xr.Dataset, name: str, frames: list[int]) -> None:
    planes = [_plane(ds, name, frame) for frame in frames]
    limits = _range(planes, FIELDS[name][1] is style.DIVERGING)
    for ax, frame, values in zip(axes, frames, planes, strict=True):
        image = _image(ax, ds, values, name, limits)
        _interface(ax, ds, frame, name)
        ax.set_title(
            f"{FIELDS[name][0]}, t = {float(ds['t'][frame]):.4g}" + (", mid-plane" if "z_c" in ds.dims else "")
        )
    axes[0].figure.colorbar(image, ax=list(axes), shrink=0.85, pad=0.01)


def _gauge_panels(ds: xr.Dataset) -> list[tuple[str, list[str], bool]]:
    """The first three groups of gauges that the run has: axis label, names, whether shown as change in percent."""
    if ds.sizes.get("t_step", 0) < 2:
        return []
    found = [(label, [n for n in names if n in ds], change) for label, names, change in GAUGES]
    return [panel for panel in found if panel[1]][:3]


def _draw_gauges(ax, ds: xr.Dataset, panel: tuple[str, list[str], bool]) -> None:
    label, names, change = panel
    total = 0.0
    for k, name in enumerate(names):
        gauge = ds[name]
        if label == "energy":
            gauge = gauge.sum("body", skipna=False) if "body" in gauge.dims else gauge
            total = total + gauge
        gauge = 100 * (gauge / gauge.isel(t_step=0) - 1) if change else gauge
        for i, line in enumerate(np.atleast_2d(gauge.transpose(..., "t_step").values)):
            ax.plot(ds["t_step"], line, color=style.OKABE_ITO[k], label=name.replace("_", " ") if i == 0 else None)
    if label == "energy" and len(names) > 1:
        ax.plot(ds["t_step"], total, color="0", linestyle=":", label="sum")
    ax.set(xlabel="t", ylabel=label)
    ax.legend(loc="best")


def _film(ds: xr.Dataset, path: Path) -> Path:
    """The first field of the run, frame by frame (at most 60 of them), ten a second."""
    names = _drawable(ds)
    if not names:
        raise ValueError("the run has no fields to make a film of")
    name = names[0]
    frames = np.unique(np.linspace(0, ds.sizes["t"] - 1, min(ds.sizes["t"], LONGEST_FILM)).round().astype(int))
    limits = _range([_plane(ds, name, frame) for frame in frames], FIELDS[name][1] is style.DIVERGING)
    figure = Figure(figsize=(4.2, 0.7 + 3.6 * min(max(_aspect(ds), 0.3), 2.0)), dpi=90)
    ax = figure.subplots()
    image, line, pictures = _image(ax, ds, _plane(ds, name, 0), name, limits), None, []
    figure.colorbar(image, ax=ax, shrink=0.85)
    for frame in frames:
        image.set_data(_plane(ds, name, frame))
        if line is not None:
            line.remove()
        line = _interface(ax, ds, frame, name)
        ax.set_title(f"{FIELDS[name][0]}, t = {float(ds['t'][frame]):.4g}")
        pictures.append(_picture(figure))
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    pictures[0].save(part, format="GIF", save_all=True, append_images=pictures[1:], duration=100, loop=0)
    part.replace(path)
    return path


def _picture(figure: Figure) -> Image.Image:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=90)
    return Image.open(out).convert("RGB").quantize(64, dither=Image.Dither.NONE)
