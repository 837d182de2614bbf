"""Jobs of studies: their points computed, and joined to one labelled dataset.

The solver and the scenes are loaded only where something is computed: most jobs of the book join, measure or draw.
"""

import inspect
import json
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from fsiwork import joining, provenance, sources
from fsiwork.checkpoint import Kept, replacing
from fsiwork.netcdf import opened
from fsiwork.targets import Plan, Point, Study
from fsiwork.targets.plan import sources as code

WARM_CELLS = (32, 36, 40, 48, 60)  # grids on which `warm` compiles: the first into which a box can be divided


def compute(plan: Plan, study: Study, job: str, size: str) -> list[Path]:
    """Compute the points of a job, runs or calls, and write them where the plan wants them; returns the files."""
    place = plan.results / size / "runs" / study.name
    place.mkdir(parents=True, exist_ok=True)
    points = plan.points(study, job)
    path = plan.scene(study)
    if study.work == "call":
        return [_calls(study, path, points, place / f"{job}.json")]
    from fsiwork import scene
    from fsiwork.dataset import write
    from fsiwork.simulate import frames

    warm([(path, points[0].overrides)])
    written = []
    for point in points:
        file = place / f"{point.name}.nc"
        ended = write(frames, scene.load(path, point.overrides), file)
        print(f"{point.name}: {ended}", flush=True)
        written.append(file)
    return written


def _calls(study: Study, path: Path | None, points: list[Point], out: Path) -> Path:
    """The results of a function at points as JSON: numbers, strings, lists, ``{dims, values}`` for labelled lists."""
    from fsiwork import scene
    from fsiwork.studies.sweep import resolve

    function = resolve(study.call, "studies")
    lasting = "kept" in inspect.signature(function).parameters
    results, costs = [], []
    for point in points:
        made = scene.load(path, point.overrides) if path else None
        words = {**study.args, **point.coords}
        start, kept = time.process_time(), {}
        if lasting:
            kept = {"kept": Kept(out.with_name(f"{point.name}.state"), _identity(study, made, words))}
        found = function(made, words, **kept)
        spent = time.process_time() - start + sum(state.before for state in kept.values())
        print(f"{point.name}: {spent:.2f} s", flush=True)
        cells = made.box.cells if made else 0
        steps, cells = found.pop("n_steps", 0), found.pop("n_cells", cells)
        costs.append({"cpu_seconds": round(spent, 6), "steps": int(steps), "cells": int(cells)})
        results.append({name: _plain(value) for name, value in found.items()})
        for state in kept.values():
            state.drop()
    _write_json(out, results)
    _write_json(provenance.cost_path(out), costs)
    return out


def _identity(study: Study, scene, words: dict[str, Any]) -> dict[str, str]:
    """What a state must agree with for a call to go on from it."""
    return {
        "scene": sources.scene_id(scene.model_dump_json()),
        "words": json.dumps(words),
        "source": sources.source_hash(),
        "call": code(study.call, "studies"),
    }


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return {"dims": list(value[0]), "values": _plain(value[1])}
    if isinstance(value, str):
        return value
    return np.asarray(value, dtype=float).tolist()


def _write_json(path: Path, data: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as spare:
        spare.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def warm(scenes: Iterable[tuple[Path, dict[str, Any]]]) -> int:
    """Compile what the scenes need: two steps of each on a small grid. Returns how many different ones there were."""
    from fsiwork.simulate import frames

    done = set()
    for path, overrides in scenes:
        small = _small(path, overrides)
        key = sources.scene_id(small.model_dump_json())
        if key not in done:
            done.add(key)
            for _ in frames(small):
                pass
    return len(done)


def _small(path: Path, overrides: dict[str, Any]):
    """A scene for two steps on the first of `WARM_CELLS` that suits it, else on its own grid."""
    from fsiwork import scene

    short = {**overrides, "clock.step": 1e-4, "clock.end": 2e-4}
    for cells in WARM_CELLS:
        try:
            return scene.load(path, {**short, "box.cells": cells})
        except scene.SceneError:
            continue
    return scene.load(path, short)


# ---------------------------------------------------------------------------------------------------- joining
def join(plan: Plan, study: Study, size: str) -> Path:
    """The jobs of a study as ``studies/NAME.nc`` with its axes as dimensions, and its cost beside."""
    out = Path(plan.file(size, "studies", study.name))
    files = [Path(file) for file in plan.jobs(size, study.name)]
    out.parent.mkdir(parents=True, exist_ok=True)
    coords = [point.coords for point in study.points]
    if study.work == "call":
        results = [row for file in files for row in json.loads(file.read_text(encoding="utf-8"))]
        costs = [row for file in files for row in json.loads(provenance.cost_path(file).read_text(encoding="utf-8"))]
        _tabulate(results, coords, out)
    else:
        keep = [*_gauges(files), *study.fields]
        joining.join(files, coords, out, keep=keep, keep_diverged=study.keep_diverged)
        costs = [_run_cost(file) for file in files]
    total = {
        "cells": max(cost["cells"] for cost in costs),
        "steps": sum(cost["steps"] for cost in costs),
        "cpu_seconds": round(sum(cost["cpu_seconds"] for cost in costs), 6),
    }
    rows = [{"point": point, **cost} for point, cost in zip(coords, costs, strict=True)]
    _write_json(provenance.cost_path(out), {**total, "points": rows})
    return out


def _tabulate(results: list[dict[str, Any]], coords: list[dict[str, Any]], out: Path) -> None:
    """Write the results of calls; the dimensions that a function named are remembered in the attribute ``dims``."""
    dims = {k: v["dims"][0] for result in results for k, v in result.items() if isinstance(v, dict)}
    plain = [{k: v["values"] if isinstance(v, dict) else v for k, v in result.items()} for result in results]
    joining.tabulate(plain, coords, out, {"dims": json.dumps(dims)})


def _gauges(files: list[Path]) -> list[str]:
    """Names of the gauges of the first run that is there."""
    for file in filter(Path.is_file, files):
        with opened(file) as run:
            return [name for name, values in run.variables.items() if values.dimensions[:1] == ("t_step",)]
    return []


def _run_cost(file: Path) -> dict[str, float]:
    cost = json.loads(provenance.cost_path(file).read_text(encoding="utf-8"))
    with opened(file) as run:
        cells = json.loads(run.scene)["box"]["cells"]
    return {"cells": int(cells), "steps": int(cost["steps"]), "cpu_seconds": float(cost["cpu_seconds"])}
