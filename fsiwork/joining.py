"""Many runs or results become one study file with the dials as labelled dimensions, one frame in memory at a time."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fsiwork import sources
from fsiwork.layout import VARIABLES, described
from fsiwork.netcdf import Writer, opened, written

MISSING = "missing"


def axis_names(paths: Sequence[str]) -> dict[str, str]:
    """Dimension for each dotted path: the shortest tail that no other path and no variable of a run has.

    ``box.cells`` -> ``cells``, ``bodies.0.energy.stiffness`` -> ``stiffness``, ``bodies.0.width.length`` ->
    ``width_length`` (``length`` is a gauge).
    """
    names = {}
    for path in paths:
        words = path.split(".")
        tails = ["_".join(words[k:]) for k in reversed(range(len(words)))]
        others = [f".{other}" for other in paths if other != path]
        free = [
            tail
            for k, tail in enumerate(tails, 1)
            if tail not in VARIABLES and tail[0].isalpha() and not any(o.endswith(_tail(words, k)) for o in others)
        ]
        names[path] = free[0] if free else tails[-1]
    return names


def _tail(words: list[str], k: int) -> str:
    return "." + ".".join(words[-k:])


@dataclass
class Shape:
    """What is known of a variable before it is written: dimensions, type, attributes."""

    dims: tuple[str, ...]
    dtype: Any
    attributes: dict[str, Any]


@dataclass
class Plan:
    """Dials, sizes and variables of a study."""

    points: Sequence[Mapping[str, Any]]
    sizes: dict[str, int] = field(default_factory=dict)
    variables: dict[str, Shape] = field(default_factory=dict)

    def __post_init__(self):
        paths = list(dict.fromkeys(path for point in self.points for path in point))
        self.dims = axis_names(paths)
        self.values = {path: list(dict.fromkeys(_key(p[path]) for p in self.points if path in p)) for path in paths}

    def index(self, k: int) -> tuple[int, ...]:
        """Where point ``k`` stands along the dials."""
        return tuple(self.values[path].index(_key(self.points[k][path])) for path in self.dims)

    def name(self, variable: str) -> str:
        """Name in the study: a variable called like a dimension, because it differs from run to run, gives way."""
        return f"{variable}_of_run" if variable in self.sizes or variable in self.dims.values() else variable

    def grow(self, sizes: Mapping[str, int]) -> None:
        """A dimension is as long as the longest of the points needs it."""
        for name, size in sizes.items():
            self.sizes[name] = max(size, self.sizes.get(name, 0))


def _key(value: Any) -> Any:
    return value if isinstance(value, str | int | float) else json.dumps(value)


def join(
    paths: Sequence[str | Path],
    points: Sequence[Mapping[str, Any]],
    out: str | Path,
    *,
    keep: Sequence[str] | None = None,
    keep_diverged: bool = False,
) -> None:
    """Join the files of runs to one study file.

    Parameters
    ----------
    paths : the files of the runs; one that does not exist counts as missing
    points : the dials of each run, dotted path -> value; they become dimensions named by `axis_names`
    out : the study's file
    keep : the variables to take (their coordinates follow); by default all
    keep_diverged : also take the values of runs that diverged; otherwise they are NaN

    ``ended`` and ``scene`` stand beside, a string for each point. Where runs have different sizes a dimension is as
    long as the longest, the rest is NaN, and its coordinate becomes a variable with the dials as dimensions.
    """
    paths, plan = [Path(path) for path in paths], Plan(points)
    found = [_look(path, plan, keep, keep_diverged) for path in paths]
    if not any(run["usable"] is not None for run in found):
        raise FileNotFoundError(f"{out}: none of the {len(paths)} runs is there")
    fixed = _common([run["coordinates"] for run in found if run["usable"]])
    if not all(name in fixed for name in plan.variables if name[1:] in ("_c", "_n")):
        plan.variables.pop("grid", None)
    hashes = " ".join(sorted({run["source_hash"] for run in found if "source_hash" in run}))
    first = next(run for run in found if "source_hash" in run)
    attributes = {name: first[name] for name in ("source", "references", "versions")}
    attributes |= {"source_hash": hashes, "ended": "complete"}
    with written(Path(out), _titled(attributes), _bytes(plan, sum(bool(run["usable"]) for run in found))) as writer:
        _declare(writer, plan, fixed)
        _words(writer, plan, {name: [run[name] for run in found] for name in ("ended", "scene")})
        for k, path in enumerate(paths):
            if found[k]["usable"]:
                _copy(writer, plan, fixed, path, plan.index(k))


def _look(path: Path, plan: Plan, keep: Sequence[str] | None, keep_diverged: bool) -> dict[str, Any]:
    """What a run brings: its words and coordinates, and whether its values are taken (None: there is no file)."""
    if not path.is_file():
        return {"ended": MISSING, "scene": "", "usable": None}
    with opened(path) as run:
        words = {
            name: run.getncattr(name) for name in ("ended", "scene", "source", "references", "versions", "source_hash")
        }
        taken = _taken(run, keep)
        plan.grow({d: len(run.dimensions[d]) for name in taken for d in run[name].dimensions})
        for name in taken:
            attributes = {k: run[name].getncattr(k) for k in run[name].ncattrs()}
            plan.variables.setdefault(name, Shape(run[name].dimensions, run[name].dtype, attributes))
        coordinates = {name: run[name][:] for name in taken if run[name].dimensions == (name,)}
        usable = keep_diverged or not run.ended.startswith("diverged")
    return words | {"usable": usable, "coordinates": coordinates}


def _common(coordinates: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Coordinates on which all runs agree as far as each of them goes."""
    fixed = {}
    for name in dict.fromkeys(name for run in coordinates for name in run):
        values = [run[name] for run in coordinates if name in run]
        longest = max(values, key=len)
        if all(np.array_equal(longest[: len(q)], q) for q in values):
            fixed[name] = longest
    return fixed


def _taken(run, keep: Sequence[str] | None) -> list[str]:
    names = [name for name in run.variables if keep is None or name in keep]
    dims = {d for name in names for d in run[name].dimensions}
    return [name for name in run.variables if name in names or name in dims]


def _titled(attributes: dict[str, Any]) -> dict[str, Any]:
    words = {"Conventions": "CF-1.11", "title": "Study of level-set fluid-structure interaction"}
    return words | {"history": "joined by fsiwork from the runs of the scenes in this file"} | attributes


def _bytes(plan: Plan, runs: int) -> float:
    sizes = [np.prod([float(plan.sizes[d]) for d in s.dims]) * 8 for s in plan.variables.values() if s.dtype is not str]
    return 1.02 * runs * sum(sizes) + 1e5


def _declare(writer: Writer, plan: Plan, fixed: dict[str, np.ndarray]) -> None:
    dials = tuple(plan.dims.values())
    for path, dim in plan.dims.items():
        values = plan.values[path]
        text = any(isinstance(v, str) for v in values)
        kind = str if text else "i8" if all(isinstance(v, int) for v in values) else "f8"
        writer.dimension(dim, len(values))
        words = {"long_name": f"dial {path}"} | ({} if text else {"units": "1"})
        writer.variable(dim, (dim,), kind, words)
        writer.put(dim, [str(v) for v in values] if text else values)
    for name, size in plan.sizes.items():
        writer.dimension(name, size)
    for name, shape in plan.variables.items():
        if name in fixed or name == "grid":
            writer.variable(name, shape.dims, shape.dtype, shape.attributes)
            writer.put(name, fixed.get(name, 0))
            continue
        whole = len(dials) + (shape.dims[:1] == ("t",) and len(shape.dims) > 1)
        dtype = np.dtype("f8") if shape.dtype is str or shape.dtype.kind != "f" else shape.dtype
        writer.variable(plan.name(name), (*dials, *shape.dims), dtype, shape.attributes, whole=whole, fill=np.nan)


def _words(writer: Writer, plan: Plan, words: Mapping[str, list[str]]) -> None:
    for name, texts in words.items():
        blank = MISSING if name == "ended" else ""
        table = np.full([len(plan.values[path]) for path in plan.dims], blank, dtype=object)
        for k, text in enumerate(texts):
            table[plan.index(k)] = text
        writer.variable(name, tuple(plan.dims.values()), str, {"long_name": described(name)["long_name"]})
        writer.put(name, table)


def _copy(writer: Writer, plan: Plan, fixed: dict, path: Path, index: tuple[int, ...]) -> None:
    with opened(path) as run:
        for name, shape in plan.variables.items():
            if name in fixed or name == "grid" or name not in run.variables:
                continue
            extent = tuple(slice(0, n) for n in run[name].shape)
            if shape.dims[0] == "t" and len(shape.dims) > 1:
                for k in range(run[name].shape[0]):
                    writer.put(plan.name(name), run[name][k], (*index, k, *extent[1:]))
            else:
                writer.put(plan.name(name), run[name][:], (*index, *extent))


def tabulate(
    results: Sequence[Mapping[str, Any]],
    points: Sequence[Mapping[str, Any]],
    out: str | Path,
    attributes: Mapping[str, str] | None = None,
) -> None:
    """Write the results of a function at many points as a study file.

    A result maps names to numbers, strings or 1-D arrays. An array of the name ``q`` has the dimension ``q_i``;
    shorter ones are filled with NaN. A missing number is NaN, a missing string empty.
    """
    plan, texts = Plan(points), []
    for name in dict.fromkeys(name for result in results for name in result):
        found = [result[name] for result in results if name in result]
        if isinstance(found[0], str):
            texts.append(name)
            continue
        long = max((np.size(q) for q in found if np.ndim(q)), default=0)
        dims = (f"{name}_i",) if any(np.ndim(q) for q in found) else ()
        plan.grow(dict.fromkeys(dims, long))
        plan.variables[name] = Shape(dims, np.dtype("f8"), described(name))
    words = {"source": f"fsiwork {sources.versions()['fsiwork']}", "source_hash": sources.source_hash()}
    words |= {"versions": json.dumps(sources.versions()), "ended": "complete", **(attributes or {})}
    with written(Path(out), _titled(words), _bytes(plan, len(results))) as writer:
        _declare(writer, plan, {})
        _words(writer, plan, {name: [result.get(name, "") for result in results] for name in texts})
        for k, result in enumerate(results):
            for name in plan.variables.keys() & result.keys():
                values = np.asarray(result[name], dtype=float)
                writer.put(plan.name(name), values, (*plan.index(k), *(slice(0, n) for n in values.shape)))
