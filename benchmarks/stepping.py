"""Flow and membranes: cell-steps a second, each stage of a step, the share of Python, memory allocated by a step.

A share of the bandwidth counts only what any program must move: every field that a stage reads, once, and every field
that it writes, once, whatever the number of passes the stage takes.
"""

import sys
import tracemalloc
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import psutil

from benchmarks.rows import Row, row
from benchmarks.timing import least, triad
from fsiwork.bodies.shear import ShearMembrane
from fsiwork.scene import Scene
from fsiwork.simulate import Simulation, build, step

RATE = "million cell-steps/s"
SHEARED_STEP = 0.24  # Δt of fig_3_18 times its cells a side
SMALL = 3072  # bytes of Python's and Numba's objects between two calls: less than another row of 512 cells


def flow(n: int, dim: int, advection: str, diffusion: str) -> Simulation:
    """A swirl in a free-slip box of n cells a side."""
    scene = {
        "box": {"length": [2.0] * dim, "cells": n, "edges": "free-slip"},
        "fluid": {"viscosity": 1e-3, "advection": advection, "diffusion": diffusion},
        "clock": {"end": 1.0, "step": 0.4 / n, "frames": 1},
    }
    sim = build(Scene.model_validate(scene))
    _swirl(sim)
    return sim


def membrane(n: int, dim: int) -> Simulation:
    """The book's stretched ellipse (Sec. 3.5.3; in 3D an ellipsoid), n cells a side, explicit coupling, φ by WENO5."""
    kind, axes = ("ellipse", [0.75, 0.5]) if dim == 2 else ("ellipsoid", [0.75, 0.5, 0.5])
    body = {
        "kind": "membrane",
        "shape": {"kind": kind, "centre": [1.0] * dim, "semi_axes": axes},
        "stretch": 1.2625,
        "energy": {"kind": "quadratic", "stiffness": 1.0},
        "width": {"cells": 3},
        "coupling": "explicit",
        "transport": {"scheme": "weno5"},
    }
    scene = {
        "box": {"length": [2.0] * dim, "cells": n, "edges": "walls"},
        "fluid": {"viscosity": 0.01},
        "bodies": [body],
        "clock": {"end": 1.0, "step": 0.05 / n, "frames": 1},
    }
    return build(Scene.model_validate(scene))


def sheared(n: int) -> Simulation:
    """The sphere of Sec. 3.6.2 on n³ cells as `fig_3_18` has it, ε = 0.11 or one cell, its map by linear upwinding."""
    body = {
        "kind": "shear-membrane",
        "shape": {"kind": "ball", "centre": [0.0] * 3, "radius": 0.5},
        "area": 1.0,
        "shear": 1.0,
        "width": {"length": max(0.11, 2.0 / n)},
        "twist": np.pi,
    }
    scene = {
        "box": {"length": [2.0] * 3, "cells": n, "origin": [-1.0] * 3, "edges": "walls"},
        "fluid": {"viscosity": 0.01},
        "bodies": [body],
        "clock": {"end": 9.0, "step": SHEARED_STEP / n, "frames": 1},
    }
    return build(Scene.model_validate(scene))


def _swirl(sim: Simulation) -> None:
    """u = sin(πx/2) cos(πy/2), v = -cos(πx/2) sin(πy/2), in the plane of the first two directions."""
    g, q = sim.flow.grid, np.pi / 2.0
    u, v = g.points(0), g.points(1)
    g.padded(sim.flow.u[0])[...] = np.sin(q * u[0]) * np.cos(q * u[1]) + 0.0 * u[-1]
    g.padded(sim.flow.u[1])[...] = -np.cos(q * v[0]) * np.sin(q * v[1]) + 0.0 * v[-1]
    sim.flow.edges.fill_velocity(sim.flow.u)


def verbs(sim: Simulation) -> dict:
    """The stages of `simulate.step`, in its order."""
    flow, bodies, dt = sim.flow, sim.bodies, sim.dt

    def push():
        flow.begin()
        for body in bodies:
            body.blend(flow, dt)
            body.push(flow, dt)

    def move():
        for body in bodies:
            body.move(flow, dt)

    return {"push": push, "predict": lambda: flow.predict(dt), "project": lambda: flow.project(dt), "move": move}


def fields_moved(dim: int, sheared: bool = False) -> dict[str, int]:
    """Fields that a stage must read or write: old terms of advection twice; a pressure and the one before. A membrane
    with shear reads Y and the velocity, which says what is upwind, for its force, and carries all of Y."""
    push, move = (3 * dim, 3 * dim) if sheared else (1 + dim, dim + 2)
    return {"push": push, "predict": 4 * dim + 1, "project": 2 * dim + 3, "move": move}


def _moved(sim: Simulation) -> dict[str, int]:
    return fields_moved(sim.flow.grid.dim, any(isinstance(body, ShearMembrane) for body in sim.bodies))


def rate(name: str, sim: Simulation, mark: str, seconds: float = 2.0) -> Row:
    """Million cell-steps a second of the whole `step`."""
    cells, moved = sim.flow.grid.cells, _moved(sim)
    took = least({"step": lambda: step(sim.flow, sim.bodies, sim.dt)}, seconds)["step"]
    count = sum(moved.values()) if sim.bodies else moved["predict"] + moved["project"]
    roof = triad(cells) / (8 * count) * 1e-6
    per_second = cells / took * 1e-6
    return row(name, per_second, RATE, mark, against=("bandwidth", roof), share=per_second / roof)


def stages(name: str, sim: Simulation, seconds: float = 4.0) -> list[Row]:
    """Time per cell of each stage."""
    cells = sim.flow.grid.cells
    took, moved = least(verbs(sim), seconds), _moved(sim)
    total, rows = sum(took.values()), []
    for verb, t in took.items():
        roof = 8 * moved[verb] / triad(cells) * 1e9
        ns = t / cells * 1e9
        note = f"{100 * t / total:.0f} % of the step"
        rows.append(row(f"{name}_{verb}", ns, "ns a cell", against=("bandwidth", roof), share=roof / ns, note=note))
    return rows


def sheared_step(name: str, n: int, seconds: float = 3.0) -> Row:
    """Seconds of a step of the sheared sphere; the note has the whole run to t = 9, with its looks at det ∇Y."""
    sim = sheared(n)
    flow, bodies, cells = sim.flow, sim.bodies, sim.flow.grid.cells
    took = least({"step": lambda: step(flow, bodies, sim.dt), "survey": bodies[0].survey}, seconds)
    roof = 8 * sum(_moved(sim).values()) * cells / triad(cells)
    run = sim.total * sum(took.values()) / 60
    note = (
        f"{took['step'] / cells * 1e9:.0f} ns a cell; fig_3_18 at {n}³ to t = 9: {sim.total} steps, {run:.2g} minutes"
    )
    against = ("bandwidth", roof)
    return row(name, took["step"], "s a step", against=against, share=roof / took["step"], note=note)


def sheared_bytes(n: int = 96) -> Row:
    """Memory of the sheared sphere on n³ cells [byte a cell], beside what has to be kept from step to step: velocity,
    its last advection, pressure and the one before, Y. In a process of its own: another may reuse what it once had."""
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        used = pool.submit(_resident, n).result()
    kept = 8 * 11
    note = f"{n}³, ghosts included; {used / 8:.0f} fields where the state is {kept // 8}"
    return row("shear_bytes", used, "byte a cell", against=("state", kept), note=note)


def _resident(n: int) -> float:
    """Bytes a cell that the process grows by to hold the sheared sphere and to step it; kernels are compiled before."""
    process, before = psutil.Process(), 0
    for k in (24, n):
        before = process.memory_info().rss
        sim = sheared(k)
        for _ in range(2):
            step(sim.flow, sim.bodies, sim.dt)
    return (process.memory_info().rss - before) / sim.flow.grid.cells


def python_share(n: int = 512, seconds: float = 2.0) -> Row:
    """What a step costs on no cells at all (from 16² and 32²), over what it costs on n²."""
    took = {}
    for k in (16, 32, n):
        sim = membrane(k, 2)
        took[k] = least({"step": lambda sim=sim: step(sim.flow, sim.bodies, sim.dt)}, seconds)["step"]
    nothing = (4.0 * took[16] - took[32]) / 3.0
    note = f"{nothing * 1e3:.2f} ms of {took[n] * 1e3:.2f} ms a step, calls of kernels included"
    return row("python_share", nothing / took[n], f"of a membrane step at {n}²", note=note)


class Watch:
    """Follows the memory in use from call to call: largest rise between two of them, and the sum of all rises."""

    def __init__(self):
        self.largest = self.total = self.level = 0

    def __call__(self, _frame, _event, _argument):
        rise = tracemalloc.get_traced_memory()[1] - self.level
        if rise > 0:
            self.largest, self.total = max(self.largest, rise), self.total + rise
        self.settle()

    def settle(self):
        """Count from here."""
        self.level = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()


def allocation(n: int = 512) -> list[Row]:
    """Memory that Python and NumPy allocate in a membrane step [byte]: the largest rise between two calls anywhere
    inside it, which bounds the largest block, and all rises."""
    sim, watch = membrane(n, 2), Watch()
    for _ in range(3):
        step(sim.flow, sim.bodies, sim.dt)
    tracemalloc.start()
    try:
        step(sim.flow, sim.bodies, sim.dt)  # what tracing itself makes once
        watch.settle()
        sys.setprofile(watch)
        step(sim.flow, sim.bodies, sim.dt)
    finally:
        sys.setprofile(None)
        tracemalloc.stop()
    one = 8 * (n + 6)
    mark, at = f"<= {one + SMALL}", f"membrane at {n}²"
    note = f"{at}; mark: a row and {SMALL} bytes of small objects"
    return [
        row("allocation", watch.largest, "byte at once", mark, against=("a row", one), note=note),
        row("allocation_step", watch.total, "byte a step", note=f"{at}; all that is allocated and freed again"),
    ]
