"""Least CPU times of several, and the bandwidth of the same machine in the same run."""

import os
import time
from collections.abc import Callable
from functools import cache

import numpy as np
from numba import njit


def least(stages: dict[str, Callable[[], object]], seconds: float = 2.0, rounds: int = 10) -> dict[str, float]:
    """Least CPU time of each stage by this thread [s], all run in turn: at least ``rounds`` times, and as many more
    as fit into ``seconds`` of CPU. The first two rounds are not counted: they compile and plan."""
    best, spent, done = dict.fromkeys(stages, np.inf), 0.0, -2
    while done < rounds or spent < seconds:
        for name, action in stages.items():
            before = time.thread_time()
            action()
            took = time.thread_time() - before
            if done >= 0:
                best[name] = min(best[name], took)
                spent += took
        done += 1
    return {name: float(t) for name, t in best.items()}


@njit(error_model="numpy", fastmath={"contract"})
def _triad(a, b, c, s, times):
    for _ in range(times):
        for i in range(a.size):
            a[i] = b[i] + s * c[i]


@cache
def triad(cells: int) -> float:
    """Bandwidth of a = b + s c over arrays of ``cells`` float64 [byte/s], 24 bytes a cell, one thread."""
    a, b, c = np.zeros(cells), np.ones(cells), np.ones(cells)
    times = max(1, 1_000_000 // cells)
    took = least({"triad": lambda: _triad(a, b, c, 0.5, times)}, 0.3, 20)["triad"]
    return 24.0 * cells * times / took


def load() -> float:
    """Processes that wanted to run during the last minute, per core."""
    return round(os.getloadavg()[0] / (os.cpu_count() or 1), 2)
