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
from fsiwork.provenance import source_hash
from fsiwork.scene import Scene
from fsiwork.simulate import frames

SCRIPT = Path(__file__).with_name("membrane2d.edp")
NAMES = ("FreeFem++-nw", "FreeFem++", "FreeFem++-mpi")
STRETCH = 1.26253157  # perimeter of the ellipse over that of the rest circle, radius 0.5
UNIT = "s of CPU"


@dataclass(frozen=True)
class Run:
    """Half-axes at the end [length], CPU time of the loop [s]."""

    axes: tuple[float, float]
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


def finest(cache: Path, cells: int = 512, step: float = 2.5e-4) -> tuple[float, float]:
    """Half-axes at t = 0.4 of our own fine run, kept in ``cache`` for as long as scene and solver stay the same."""
    what = scene(cells, step, "explicit")
    key = hashlib.sha256(f"{source_hash()}{what.model_dump_json()}".encode()).hexdigest()[:16]
    if cache.is_file():
        kept = json.loads(cache.read_text(encoding="utf-8"))
        if kept["key"] == key:
            return tuple(kept["axes"])
    axes = ours(what, times=1).axes
    cache.parent.mkdir(parents=True, exist_ok=True)
    cache.write_text(json.dumps({"key": key, "axes": axes, "cells": cells, "step": step}) + "\n", encoding="utf-8")
    return axes


def compare(results: Path, cells: int = 60, step: float = 2.5e-3) -> list[Row]:
    """CPU time and error of the axes, ours at the same number of cells and steps, FreeFEM's both as the book has it
    and with its matrix factorised only once."""
    program = next((found for name in NAMES if (found := shutil.which(name))), None)
    marks = {"freefem": "ratio <= 0.05", "freefem_error": "ratio <= 1", "freefem_kept": "ratio <= 0.05"}
    if program is None:
        units = {"freefem_error": "of length"}
        return [
            row(name, None, units.get(name, UNIT), mark, against=("FreeFEM", None), note="FreeFEM is not installed")
            for name, mark in marks.items()
        ]
    fine = finest(results / "benchmarks.finest.json")
    mine, book, kept = ours(scene(cells, step)), theirs(program), theirs(program, keep=True)
    error, peers = deviation(mine.axes, fine), deviation(book.axes, fine)
    as_good, size = error <= peers, f"N = {cells}, Δt = {step:g}"
    notes = (
        f"both {size}; {book.seconds / mine.seconds:.0f} times less; errors of the axes {error:.2g} and {peers:.2g}",
        f"larger error of the two half-axes at t = 0.4 against N = 512, Δt = 2.5e-4: {fine[0]:.5f}, {fine[1]:.5f}",
        f"FreeFEM with its matrix factorised once: {kept.seconds / mine.seconds:.0f} times less",
    )
    return [
        row(
            "freefem",
            mine.seconds,
            UNIT,
            marks["freefem"],
            against=("FreeFEM", book.seconds),
            besides=as_good,
            note=notes[0],
        ),
        row("freefem_error", error, "of length", marks["freefem_error"], against=("FreeFEM", peers), note=notes[1]),
        row(
            "freefem_kept",
            mine.seconds,
            UNIT,
            marks["freefem_kept"],
            against=("FreeFEM", kept.seconds),
            besides=as_good,
            note=notes[2],
        ),
    ]


def deviation(axes: tuple[float, float], fine: tuple[float, float]) -> float:
    """Larger difference of the two half-axes [length]."""
    return max(abs(a - b) for a, b in zip(axes, fine, strict=True))
