"""Side by side with FreeFEM on the same work: the book's stretched ellipse, λ = 1, ε = 0.1, to t = 0.4, one core."""

import hashlib
import json
import os
import shutil
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.rows import Row, row
from fsiwork.scene import Scene
from fsiwork.simulate import frames
from fsiwork.sources import source_hash

SCRIPT = Path(__file__).with_name("membrane2d.edp")
NAMES = ("FreeFem++-nw", "FreeFem++", "FreeFem++-mpi")
STRETCH = 1.26253157  # perimeter of the ellipse over that of the rest circle, radius 0.5
MARKS = {
    "freefem": ("s of CPU", "ratio <= 0.05"),
    "freefem_kept": ("s of CPU", "ratio <= 0.05"),
    "freefem_error": ("of length", "ratio <= 1"),
}
Axes = tuple[float, float]


@dataclass(frozen=True)
class Run:
    """Half-axes at the end [length], CPU time of the loop [s]."""

    axes: Axes
    seconds: float


def scene(cells: int, step: float, coupling: str = "semi-implicit", end: float = 0.4) -> Scene:
    """The same work for fsiwork; ε stays 0.1 whatever the grid."""
    body = {
        "kind": "membrane",
        "shape": {"kind": "ellipse", "centre": [1.0, 1.0], "semi_axes": [0.75, 0.5]},
        "stretch": STRETCH,
        "energy": {"kind": "quadratic", "stiffness": 1.0},
        "width": {"length": 0.1},
        "coupling": coupling,
    }
    data = {
        "box": {"length": [2.0, 2.0], "cells": cells, "edges": "walls"},
        "fluid": {"viscosity": 0.01},
        "bodies": [body],
        "clock": {"end": end, "step": step, "frames": 1},
    }
    return Scene.model_validate(data)


def ours(what: Scene, times: int = 3) -> Run:
    """The loop over frames, first frame (and with it planning and compilation) excluded; least of several runs."""
    least = float("inf")
    for _ in range(times):
        loop = frames(what)
        next(loop)
        before = time.thread_time()
        *_, last = loop
        least = min(least, time.thread_time() - before)
        if last.ended != "complete":
            return Run((float("nan"),) * 2, float("nan"))
    return Run((float(last.gauges["axis_x"][-1]), float(last.gauges["axis_y"][-1])), least)


def theirs(program: str, cells: int = 60, step: float = 2.5e-3, end: float = 0.4, keep: bool = False) -> Run:
    """FreeFEM's loop by its own clock: its cheapest step times the number of steps, which load disturbs least."""
    words = [program, "-nw", "-v", "0", str(SCRIPT), "-n", str(cells), "-cells", str(0.05 * cells)]
    words += ["-dt", str(step), "-end", str(end), "-stretch", str(STRETCH), "-keep", str(int(keep))]
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    done = subprocess.run(words, capture_output=True, text=True, env=os.environ | one, check=True)
    line = next(text for text in done.stdout.splitlines() if text.startswith("RESULT"))
    x, y, _, least, steps = map(float, line.split()[1:])
    return Run((x, y), least * steps)


def finest(cache: Path) -> tuple[Axes, Axes]:
    """Half-axes at t = 0.4 of our own run with N = 512, and extrapolated from N = 256 and 512 to no grid step at all.

    Kept in ``cache`` for as long as scene and solver stay the same.
    """
    fine, coarse = scene(512, 2.5e-4, "explicit"), scene(256, 2.5e-4, "explicit")
    key = hashlib.sha256(f"{source_hash()}{fine.model_dump_json()}".encode()).hexdigest()[:16]
    if cache.is_file():
        kept = json.loads(cache.read_text(encoding="utf-8"))
        if kept["key"] == key:
            return tuple(kept["fine"]), tuple(kept["limit"])
    low, high = ours(coarse, times=1).axes, ours(fine, times=1).axes
    limit = tuple(b + (b - a) / 3.0 for a, b in zip(low, high, strict=True))
    cache.parent.mkdir(parents=True, exist_ok=True)
    cache.write_text(json.dumps({"key": key, "fine": high, "limit": limit}) + "\n", encoding="utf-8")
    return high, limit


def compare(results: Path, cells: int = 384, step: float = 2.5e-3) -> list[Row]:
    """CPU time and error of the axes: FreeFEM's as the book has it and with its matrix factorised only once; ours with
    the same Δt, on the grid that a second-order scheme needs to be as good as its quadratic elements."""
    program = next((found for name in NAMES if (found := shutil.which(name))), None)
    if program is None:
        gone = {"against": ("FreeFEM", None), "note": "FreeFEM is not installed"}
        return [row(name, None, unit, mark, **gone) for name, (unit, mark) in MARKS.items()]
    references = finest(results / "benchmarks.finest.json")
    mine, book, kept = ours(scene(cells, step)), theirs(program), theirs(program, keep=True)
    errors = [(deviation(mine.axes, r), deviation(book.axes, r)) for r in references]
    (error, peer), (far, far_peer) = errors
    as_good = all(a <= b for a, b in errors)
    notes = {
        "freefem": f"{book.seconds / mine.seconds:.0f} times less; N = {cells} against 60² P2/P1, both Δt = {step:g}",
        "freefem_kept": f"{kept.seconds / mine.seconds:.0f} times less than FreeFEM with its matrix factorised once",
        "freefem_error": f"half-axes against our N = 512; against its extrapolation {far:.2g} and {far_peer:.2g}",
    }
    numbers = {"freefem": (mine.seconds, book.seconds), "freefem_kept": (mine.seconds, kept.seconds)}
    numbers["freefem_error"] = error, peer
    return [
        row(name, numbers[name][0], *words, against=("FreeFEM", numbers[name][1]), besides=as_good, note=notes[name])
        for name, words in MARKS.items()
    ]


def deviation(axes: Axes, reference: Axes) -> float:
    """Larger difference of the two half-axes [length]."""
    return max(abs(a - b) for a, b in zip(axes, reference, strict=True))
