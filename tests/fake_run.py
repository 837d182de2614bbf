"""Frames by formula instead of by solver: what the tests of datasets feed on; as a script, a run to be killed."""

import sys
import time
from dataclasses import dataclass, field

import numpy as np

from fsiwork import dataset, provenance


def scene(cells=16, length=(2.0, 1.0), edges="walls", frames=6, **more):
    """A scene as plain data."""
    box = {"length": list(length), "cells": cells, "origin": [0.5] * len(length), "edges": edges}
    clock = {"end": 1.0, "step": 0.05, "frames": frames}
    return {"box": box, "fluid": {"density": 1.0}, "bodies": [], "clock": clock, "output": {"dtype": "float64"}} | more


@dataclass
class Frame:
    t: float
    step: int
    fields: dict
    gauges: dict
    memory: dict = field(default_factory=dict)
    ended: str = ""

    def state(self):
        return self.memory


def velocity(a, *x):
    """A velocity whose divergence is 2x + 3y (+ z)."""
    return (x[0] ** 2, 1.5 * x[1] ** 2 + x[0], 0.5 * x[-1] ** 2)[a]


def fields(scene, memory):
    """All fields at a moment; ``memory`` is the number that the next step reads."""
    grid = dataset.layout.geometry(scene)
    lines = grid.coordinates()
    found = {}
    for a, name in enumerate("uvw"[: grid.dim]):
        x = np.meshgrid(
            *(lines[f"{d}_{'n' if i == a else 'c'}"] for i, d in enumerate("xyz"[: grid.dim])), indexing="ij"
        )
        found[name] = ((a,), velocity(a, *x) * memory)
    x = np.meshgrid(*(lines[f"{d}_c"] for d in "xyz"[: grid.dim]), indexing="ij")
    centre = [o + 0.5 * n * grid.h for o, n in zip(grid.origin, grid.n, strict=True)]
    found["phi"] = (None, np.sqrt(sum((q - c) ** 2 for q, c in zip(x, centre, strict=True))) - 0.2 - 0.05 * memory)
    found["p"] = (None, np.cos(x[0]) * memory)
    return found


def frames(scene, resume=None, stop_after=None, end="complete", pause=0.0):
    """A run of ``4 frames`` steps: a frame each fourth; the state is one number and the number of steps."""
    count = 4 * scene["clock"]["frames"]
    step, memory = (int(resume["step"]), float(resume["memory"])) if resume else (0, 1.0)
    rows = {"t": [], "dt": [], "volume": []}
    if not resume:
        yield Frame(0.0, 0, fields(scene, memory), {k: np.array(v) for k, v in rows.items()}, {})
    first = step
    while step < count:
        time.sleep(pause)
        step, memory = step + 1, np.sin(memory * 2.0) + 0.1 * memory
        for name, value in (("t", 0.05 * step), ("dt", 0.05), ("volume", memory)):
            rows[name].append(value)
        stopping = stop_after is not None and step - first >= stop_after and step < count
        if step % 4 == 0 or stopping:
            gauges = {k: np.array(v) for k, v in rows.items()}
            ended = end if step == count else ""
            now = {"step": np.array(step), "memory": np.array(memory)}
            if step % 4 == 0:
                yield Frame(0.05 * step, step, fields(scene, memory), gauges, now, ended)
                gauges = {k: v[:0] for k, v in gauges.items()}
            if stopping:
                yield Frame(0.05 * step, step, fields(scene, memory), gauges, now, "stopped at t: --max-seconds")
                return
            rows = {k: [] for k in rows}


if __name__ == "__main__":
    provenance.die_with_parent()
    dataset.write(frames, scene(32, frames=40), sys.argv[1], resume="--resume" in sys.argv, every=0.01)
