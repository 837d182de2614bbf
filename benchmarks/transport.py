"""Transport: cell-stages a second of the kernels in cache, what a second thread gives, what a narrow band saves."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numba
import numpy as np

from benchmarks.rows import Row, row
from benchmarks.timing import least
from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import transport as kernels
from fsiwork.core.transport import Transport

RATE = "million cell-stages/s"
ROOT = Path(__file__).resolve().parents[1]


def scene(n: int, dim: int) -> tuple[Grid, list[np.ndarray], np.ndarray]:
    """Unit box of n cells a side, a vortex (in 3D the same in every plane), the distance to a circle (a cylinder)."""
    grid = Grid((n,) * dim, 1 / n)
    flow = (
        lambda x, y, *z: -(np.sin(np.pi * x) ** 2) * np.sin(2 * np.pi * y),
        lambda x, y, *z: np.sin(np.pi * y) ** 2 * np.sin(2 * np.pi * x),
        lambda x, y, *z: 0.1 + 0.0 * x,
    )
    u = [grid.sample(f, face=a).copy() for a, f in zip(grid.axes, flow, strict=False)]
    return grid, u, grid.sample(lambda x, y, *z: np.hypot(x - 0.5, y - 0.75) - 0.15).copy()


def stage(scheme: str, n: int, dim: int):
    """One call of the kernel of a stage, all axes, as an action."""
    grid, u, q = scene(n, dim)
    out, base = grid.field(), q.copy()
    k = np.array([0.75, 0.25, 0.1, 1.0, 1e-3])
    kernel, strides = getattr(kernels, f"{scheme}_{dim}d"), np.array(grid.strides[:-1])
    return lambda: kernel(out, base, q, *u, *grid.rows(), strides, k)


def rate(name: str, scheme: str, n: int, dim: int, mark: str, seconds: float = 1.0) -> Row:
    """Million cell-stages a second and core: differences along all axes and the stage's combination."""
    took = least({"stage": stage(scheme, n, dim)}, seconds)["stage"]
    return row(name, n**dim / took * 1e-6, RATE, mark, note=f"{scheme} at {n}{'²³'[dim - 2]}")


def band(n: int = 512, seconds: float = 2.0) -> Row:
    """An SSP-RK3 step with WENO5 of a circle of radius 0.15 in the unit square: everywhere, over in a band of 6 cells
    on either side, finding the band included."""
    grid, u, q = scene(n, 2)
    edges, narrow, dt = Edges(grid, ((Side("no-slip"),) * 2,) * 2), q.copy(), 0.25 / n
    full, near = Transport(grid, edges), Transport(grid, edges, band=6)
    # One after the other, step upon step as a run makes them: in turn each would find the other's fields in the cache.
    took = least({"full": lambda: full.advance([q], u, dt)}, seconds / 2, rounds=30)
    took |= least({"band": lambda: near.advance([narrow], u, dt)}, seconds / 2, rounds=30)
    note = f"{took['full'] * 1e3:.2f} and {took['band'] * 1e3:.2f} ms a step at {n}², one circle"
    return row("band", took["full"] / took["band"], "times faster than everywhere", ">= 5", note=note)


def speedup(n: int, times: int = 3000) -> float:
    """Least time of a stage with one thread over that with two [wall clock]; in a process that has two."""
    action, best = stage("weno5", n, 2), {1: np.inf, 2: np.inf}
    for _ in range(times):
        for count in best:
            numba.set_num_threads(count)
            before = time.perf_counter()
            action()
            best[count] = min(best[count], time.perf_counter() - before)
    return best[1] / best[2]


def threads(sizes: tuple[int, ...] = (256, 512)) -> Row:
    """The smallest speed-up of the sizes, measured in a process of its own."""
    unit, mark = "times with two threads", ">= 1.8"
    if (os.cpu_count() or 1) < 2:
        return row("threads", None, unit, mark, note="one core only")
    env = os.environ | {"NUMBA_NUM_THREADS": "2", "PYTHONPATH": os.pathsep.join(sys.path)}
    words = [sys.executable, "-m", "benchmarks.transport", *map(str, sizes)]
    done = subprocess.run(words, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    if done.returncode:
        return row("threads", None, unit, mark, note=f"failed: {done.stderr.strip().splitlines()[-1]}")
    found = [float(word) for word in done.stdout.split()]
    note = ", ".join(f"{ratio:.2f} at {n}²" for n, ratio in zip(sizes, found, strict=True))
    return row("threads", min(found), unit, mark, note=f"weno5: {note}; least wall-clock times")


if __name__ == "__main__":
    print(*(speedup(int(word)) for word in sys.argv[1:]))
