"""States become labelled data: frames -> netCDF that describes itself, and back."""

import json
import tempfile
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from fsiwork import layout, provenance, sources
from fsiwork.checkpoint import Store, need_space
from fsiwork.joining import axis_names, join, tabulate
from fsiwork.layout import VARIABLES
from fsiwork.netcdf import Writer, opened, written

__all__ = ["VARIABLES", "axis_names", "join", "open_run", "open_study", "tabulate", "to_dataset", "write"]

CONVENTIONS = "CF-1.11 SGRID-0.3"
BOOK = (
    "G.-H. Cottet, E. Maitre, T. Milcent: Level Set Methods for Fluid-Structure Interaction. "
    "Applied Mathematical Sciences 210, Springer, 2022"
)


loaded = cache(sources.source_hash)  # of the code that this process has loaded, not of later edits


def write(
    frames: Callable[..., Iterable] | Iterable,
    scene: Any,
    path: str | Path,
    *,
    resume: bool = False,
    every: float = 30.0,
) -> str:
    """Write the frames of a run as they come, and at the end the one netCDF file of the run.

    Parameters
    ----------
    frames : ``frames(scene, resume=None or state)``, or its iterator; the last frame says how the run ``ended``
    scene : the scene of the run
    path : ``NAME.nc``; ``NAME.cost.json`` is written beside it. While the run goes on ``NAME.nc.frames/`` holds the
        frames so far and, every ``every`` seconds, the state of the run.
    resume : go on from the state that an interrupted run left; ``frames`` is then the function.

    Returns how the run ended. A run that was stopped before its end leaves its state and no file.

    Raises
    ------
    fsiwork.checkpoint.DiskFull, fsiwork.checkpoint.Damaged, RuntimeError (another process writes the same run).
    """
    path = Path(path)
    identity = {"scene": sources.scene_id(layout.plain(scene)), "source": loaded()}
    store = Store(path, identity, resume)
    keep = True
    try:
        cost = provenance.Cost(store.meta.get("seconds", 0.0), store.meta.get("cpu_seconds", 0.0))
        ended, step = store.meta.get("ended") or _collect(frames, scene, path, store, cost, every)
        if not ended.startswith("stopped"):
            try:
                _assemble(store, scene, path, _attributes(scene, identity, ended))
            except OSError:  # the frames are all there: with resume only the file is written
                with suppress(OSError):
                    store.keep_state({}, step, cost.spent() | {"ended": [ended, step]})
                raise
            cost.write(path, int(np.prod(layout.geometry(scene).n)), step)
            keep = False
        return ended
    finally:
        store.close(keep)


def _collect(frames, scene, path: Path, store: Store, cost, every: float) -> tuple[str, int]:
    """Store the frames; returns how the run ended and after which step."""
    grid, data = layout.geometry(scene), layout.plain(scene)
    pending = _part(store.state or {}, "gauge:")
    if callable(frames):
        frames = frames(scene, resume=_part(store.state or {}, "state:") or None)
    saved = time.monotonic()
    for frame in frames:
        stopped = frame.ended.startswith("stopped")
        gauges = {k: np.concatenate([q[k] for q in (pending, frame.gauges) if k in q]) for k in pending | frame.gauges}
        if frame.step > store.last_step and not stopped:
            arrays = _record(frame, gauges, grid, data)
            if store.count == 0:
                size = sum(value.nbytes for value in arrays.values())
                need_space(path, 2.1 * size * (data["clock"]["frames"] + 1))
            empty = frame.ended.startswith("diverged") and not frame.fields
            store.add(arrays, frame.step, {"t": frame.t, "step": frame.step, "empty": empty})
            pending = gauges = {}
        if stopped or (not frame.ended and time.monotonic() - saved > every):
            held = {f"gauge:{k}": v for k, v in gauges.items()} if stopped else {}
            state = {f"state:{k}": v for k, v in frame.state().items()}
            store.keep_state(state | held, frame.step, cost.spent())
            saved = time.monotonic()
        if frame.ended:
            return frame.ended, frame.step
    raise RuntimeError("the frames stopped without saying how the run ended")


def _part(arrays: dict[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}


def _record(frame, gauges: dict, grid: layout.Geometry, scene: dict) -> dict[str, np.ndarray]:
    """What the file of a frame holds: fields, gauges since the frame before, points of the interface."""
    dtype = np.dtype(scene.get("output", {}).get("dtype", "float64"))
    fields = layout.arranged(frame.fields, grid)
    arrays = {f"field:{','.join(d)}:{'' if a is None else a}:{k}": q.astype(dtype) for k, (d, a, q) in fields.items()}
    arrays |= {f"gauge:{k}": np.asarray(v, dtype=np.float64) for k, v in gauges.items()}
    if grid.dim == 2 and "phi" in fields:
        arrays |= {f"contour:{k}": v for k, v in layout.contour(fields["phi"][2], grid).items()}
    return arrays


def _assemble(store: Store, scene, path: Path, attributes: dict[str, str]) -> None:
    """The file of the run from the files of its frames, one in memory at a time."""
    grid = layout.geometry(scene)
    words = [store.frame(k, "none")[1] for k in range(store.count)]
    times = [word["t"] for word in words if not word["empty"]]
    first, _ = store.frame(0)
    need = sum(value.nbytes for value in first.values()) * len(times) * 1.02 + 1e5
    with written(path, attributes, need) as out:
        _axes(out, grid)
        out.dimension("t", len(times))
        out.variable("t", ("t",), "f8", layout.described("t"))
        out.put("t", times)
        names = _declare_fields(out, first, grid)
        _gauges(out, store)
        _contours(out, store, first, len(times))
        for k in range(len(times)):
            arrays, _ = store.frame(k, "field:")
            for key, name in names.items():
                out.put(name, arrays[key], k)


def _attributes(scene, identity: dict[str, str], ended: str) -> dict[str, str]:
    data = layout.plain(scene)
    installed = sources.versions()
    return {
        "Conventions": CONVENTIONS,
        "title": data.get("title") or "Level-set fluid-structure interaction",
        "source": f"fsiwork {installed['fsiwork']}",
        "history": "written by fsiwork from the scene in this file",
        "references": BOOK,
        "scene": json.dumps(data, sort_keys=True, separators=(",", ":")),
        "scene_id": identity["scene"],
        "source_hash": identity["source"],
        "versions": json.dumps(installed),
        "ended": ended,
    }


def _axes(out: Writer, grid: layout.Geometry) -> None:
    for name, values in grid.coordinates().items():
        direction, place = name.split("_")
        out.dimension(name, len(values))
        words = {"long_name": f"{direction} of cell {'centres' if place == 'c' else 'faces'}", "units": "1"}
        out.variable(name, (name,), "f8", words)
        out.put(name, values)
    out.variable("grid", (), "i4", grid.grid_attributes())
    out.put("grid", 0)


def _declare_fields(out: Writer, first: dict, grid: layout.Geometry) -> dict[str, str]:
    names = {}
    for key, values in first.items():
        if not key.startswith("field:"):
            continue
        _, dims, face, name = key.split(":")
        dims = tuple(dims.split(","))
        for d, size in zip(dims, values.shape, strict=True):
            _label(out, d, size)
        where = {"grid": "grid", "location": grid.location(int(face) if face else None)}
        out.variable(name, ("t", *dims), values.dtype, layout.described(name) | where, whole=1)
        names[key] = name
    return names


def _label(out: Writer, dim: str, size: int) -> None:
    """Dimensions that are not of the grid: bodies by number, components by letter."""
    if dim in out.file.dimensions:
        return
    out.dimension(dim, size)
    if dim == "body":
        out.variable(dim, (dim,), "i4", {"long_name": "number of the body"})
        out.put(dim, np.arange(size))
    else:
        out.variable(dim, (dim,), str, {"long_name": "direction of the component"})
        out.put(dim, list(layout.DIRECTIONS[:size]))


def _gauges(out: Writer, store: Store) -> None:
    parts = [_part(store.frame(k, "gauge:")[0], "gauge:") for k in range(store.count)]
    columns = {k: np.concatenate([part[k] for part in parts if k in part]) for part in parts for k in part}
    times = columns.pop("t", np.zeros(0))
    out.dimension("t_step", len(times))
    out.variable("t_step", ("t_step",), "f8", layout.described("t_step"))
    out.put("t_step", times)
    for name, values in columns.items():
        if values.ndim > 1:
            _label(out, "body", values.shape[1])
        out.variable(name, ("t_step", "body")[: values.ndim], "f8", layout.described(name))
        out.put(name, values)


def _contours(out: Writer, store: Store, first: dict, frames: int) -> None:
    if "contour:x" not in first:
        return
    parts = [store.frame(k, "contour:")[0] for k in range(frames)]
    count = [len(part["contour:x"]) for part in parts]
    out.dimension("point", sum(count))
    out.variable("contour_count", ("t",), "i4", layout.described("contour_count") | {"sample_dimension": "point"})
    out.put("contour_count", count)
    for key, dtype in (("x", "f8"), ("y", "f8"), ("piece", "i4")):
        out.variable(f"contour_{key}", ("point",), dtype, layout.described(f"contour_{key}"))
        out.put(f"contour_{key}", np.concatenate([part[f"contour:{key}"] for part in parts]))


def open_run(path: str | Path) -> xr.Dataset:
    """Open the file of a run; values are read when they are used.

    Raises FileNotFoundError or ValueError, in one line, when it is missing, not netCDF, or not a finished run.
    """
    with opened(Path(path)) as file:
        if "scene" not in file.ncattrs():
            raise ValueError(f"{path}: not a run of fsiwork (no attribute 'scene')")
    return xr.open_dataset(path, engine="netcdf4")


def open_study(path: str | Path) -> xr.Dataset:
    """Open a study's file as lazy arrays, a chunk a frame of a point, computed in this thread (netCDF-C is not safe
    in several). Raises as `open_run` does."""
    import dask

    with opened(Path(path)):
        dask.config.set(scheduler="synchronous")
    return xr.open_dataset(path, engine="netcdf4", chunks={})


def to_dataset(frames: Callable[..., Iterable] | Iterable, scene: Any) -> xr.Dataset:
    """The frames of a run as a dataset in memory: what its file would hold."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.nc"
        write(frames, scene, path)
        with open_run(path) as found:
            return found.load()
