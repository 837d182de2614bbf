"""A study: a scene (or none), its axes, and what happens at each point."""

import itertools
import re
import shlex
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import yaml

from fsiwork.targets.reading import FUNCTION, IDENTIFIER, SIZES, Faults, read_yaml

LABEL = re.compile(r"[A-Za-z0-9.+-][\w.+-]*")
STUDY_KEYS = {"title", "scene", "kind", "call", "set", "args", "axes", "batch", "fields", "keep_diverged", *SIZES}


@dataclass(frozen=True)
class Point:
    """One point of a study: its name ``n~128_dt~0.01``, its coordinates by axis and its overrides by scene path."""

    name: str
    coords: dict[str, Any]
    overrides: dict[str, Any]

    @property
    def options(self) -> str:
        """The overrides as options of ``fsiwork run``, quoted for a shell."""
        return " ".join(f"--set {shlex.quote(f'{path}={text(value)}')}" for path, value in self.overrides.items())


@dataclass(frozen=True)
class Study:
    """A study at one size. ``axes``: short name -> list of (coordinate, overrides)."""

    name: str
    title: str
    kind: str
    scene: str | None
    call: str | None
    fixed: dict[str, Any]
    args: dict[str, Any]
    axes: dict[str, list[tuple[Any, dict[str, Any]]]]
    batch: tuple[str, ...] = ()
    fields: tuple[str, ...] = ()
    keep_diverged: bool = False

    @cached_property
    def batches(self) -> dict[str, list[Point]]:
        """Jobs of the study: name -> points that one process computes."""
        jobs: dict[str, list[Point]] = {}
        for combination in itertools.product(*self.axes.values()):
            coords = {axis: value for axis, (value, _) in zip(self.axes, combination, strict=True)}
            overrides = dict(self.fixed)
            for _, paths in combination:
                overrides |= paths
            outer = {axis: value for axis, value in coords.items() if axis not in self.batch}
            jobs.setdefault(_name(outer), []).append(Point(_name(outer | coords), coords, overrides))
        return jobs

    @property
    def points(self) -> list[Point]:
        """All points in the order of the axes, the last axis fastest (batches regroup them)."""
        return [point for points in self.batches.values() for point in points]

    @property
    def work(self) -> str:
        """What a job is: ``run`` (one scene, as ``fsiwork run`` does it), ``batch`` (several), ``call``."""
        return "call" if self.kind == "call" else "batch" if self.batch else "run"

    @property
    def tails(self) -> list[str]:
        """What the batched axes add to the name of a job to make the names of its points."""
        job, points = next(iter(self.batches.items()))
        return [point.name.removeprefix(job) if job != "all" else point.name for point in points]


def text(value: Any) -> str:
    """A value as it is written in names and options: numbers short and exact, lists as YAML."""
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "null"}[value]
    if isinstance(value, float):
        return f"{value:.12g}"
    if isinstance(value, list | dict):
        return yaml.safe_dump(value, default_flow_style=True, width=10_000).strip()
    return str(value)


def _name(coords: dict[str, Any]) -> str:
    return "_".join(f"{axis}~{text(value)}" for axis, value in coords.items()) or "all"


def short_names(paths: list[str]) -> dict[str, str]:
    """Shortest unique tails of dotted paths: ``box.cells`` -> ``cells``, ``bodies.0.width.cells`` -> ``width``."""
    parts = {path: [part for part in path.split(".") if not part.isdecimal()] for path in paths}
    parts = {path: own[:-1] if own[-2:-1] == ["width"] else own for path, own in parts.items()}
    tails = {path: ["_".join(own[-k:]) for k in range(1, len(own) + 1)] for path, own in parts.items()}
    every = [tail for own in tails.values() for tail in own]
    return {path: next((t for t in own if every.count(t) == 1), path.replace(".", "_")) for path, own in tails.items()}


def load_study(path: Path, size: str) -> Study:
    """The study in ``path`` at a size. Raises `Faults` with one line for each thing that is wrong."""
    data = read_yaml(path)
    faults = [f"unknown key {key!r}" for key in data if key not in STUDY_KEYS]
    own = data.get(size) or {}
    for part in SIZES:
        unknown = set(data.get(part) or {}) - {"set", "args", "axes"}
        faults += [f"{part}: unknown key {key!r}" for key in sorted(unknown)]
    merged = {key: {**(data.get(key) or {}), **(own.get(key) or {})} for key in ("set", "args", "axes")}
    kind, scene, call = data.get("kind", "sweep"), data.get("scene"), data.get("call")
    if kind not in ("sweep", "call"):
        faults.append(f"kind: must be sweep or call, got {kind!r}")
    if kind == "sweep" and not scene:
        faults.append("scene: a sweep needs one")
    if (kind == "call") != bool(call) or (call and not FUNCTION.fullmatch(call)):
        faults.append(f"call: a study of kind call needs module.function, another kind none; got {call!r}")
    if scene is None and merged["set"]:
        faults.append("set: without a scene there is nothing to set")
    axes, wrong = _axes(merged["axes"], scene is not None)
    faults += wrong
    batch = tuple(data.get("batch") or ())
    faults += [f"batch: {axis!r} is no axis ({', '.join(axes)})" for axis in batch if axis not in axes]
    if faults:
        raise Faults(*(f"{path}: {fault}" for fault in faults))
    title, fields = data.get("title", path.stem), tuple(data.get("fields") or ())
    kept = bool(data.get("keep_diverged"))
    study = Study(path.stem, title, kind, scene, call, merged["set"], merged["args"], axes, batch, fields, kept)
    names = [point.name for point in study.points]
    if doubled := {n for n in names if names.count(n) > 1}:
        raise Faults(*(f"{path}: axes: two points are named {n}" for n in sorted(doubled)))
    return study


def _axes(raw: dict[str, Any], with_scene: bool) -> tuple[dict[str, list[tuple[Any, dict[str, Any]]]], list[str]]:
    """Axes by short name: a list holds values of a path, a mapping holds labels of settings that move together."""
    short = short_names([key for key in raw if isinstance(key, str)])
    axes, faults = {}, []
    for key, values in raw.items():
        name = short.get(key, "")
        if not IDENTIFIER.fullmatch(name):
            faults.append(f"axes.{key}: is no path")
        elif isinstance(values, dict) and values and all(isinstance(v, dict) for v in values.values()):
            axes[name] = list(values.items())
        elif isinstance(values, list) and values:
            axes[name] = [(value, {key: value} if with_scene else {}) for value in values]
        else:
            faults.append(f"axes.{key}: must be a list of values or a mapping of labels to settings, got {values!r}")
            continue
        wrong = [v for v, _ in axes.get(name, []) if not LABEL.fullmatch(text(v))]
        faults += [f"axes.{key}: {v!r} cannot be a name" for v in wrong]
    return axes, faults
