"""Where a number comes from: the process that makes it, its compiler's cache and its cost (standard library only)."""

import ctypes
import json
import os
import platform
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

from fsiwork.sources import PACKAGE, cache_root, shared, source_hash, versions

SHELLS = {"sh", "bash", "dash", "zsh", "ksh", "fish", "tcsh"}
T = TypeVar("T")


# -------------------------------------------------------------------------------------------------------------- process
def prepare(threads: int = 1) -> Path:
    """Set up Numba's threads and its cache folder; call it before anything imports Numba.

    Numba sees an edit in a kernel's own file, but not in a callee of another file: the cache folder carries the hash of
    the `shared` files, so that an edit elsewhere compiles no more than its own file. Returns the folder.
    """
    folder = cache_root() / "numba" / source_hash(*shared(PACKAGE / "core" / "kernels"))
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    os.environ["NUMBA_NUM_THREADS"] = str(threads)
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    os.environ.setdefault("GOMP_SPINCOUNT", "30000")  # look for work some 50 μs before sleep: waking takes as long
    if numba := sys.modules.get("numba"):  # too late for the environment: what can still be set
        numba.config.CACHE_DIR = str(folder)
        numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
    return folder


def with_healed_cache(action: Callable[[], T]) -> T:
    """``action()``; when a damaged file of Numba's cache breaks it, delete the cache and try once more."""
    try:
        return action()
    except Exception as error:
        folder = os.environ.get("NUMBA_CACHE_DIR")
        if not folder or not _in_cache_reading(error):
            raise
        shutil.rmtree(folder, ignore_errors=True)
    return action()


def _in_cache_reading(error: Exception) -> bool:
    trace = error.__traceback__
    while trace:
        code = trace.tb_frame.f_code
        if Path(code.co_filename).parts[-3:] == ("numba", "core", "caching.py") and "load" in code.co_name:
            return True
        trace = trace.tb_next
    return False


def die_with_parent(poll: float = 0.5) -> bool:
    """End this process when the program that started it ends, so that a killed workflow leaves no orphan (Linux).

    ``sh -c`` in between is looked through; under an interactive shell nothing is done, so that ``nohup`` works.
    Returns whether the process is tied to another one.
    """
    if not sys.platform.startswith("linux"):
        return False
    parent, between = os.getppid(), []
    while parent > 1 and _wrapper(parent):
        between.append(parent)
        parent = _parent(parent)
    if parent <= 1 or Path(_words(parent)[0].lstrip("-")).name in SHELLS:
        return False
    ctypes.CDLL(None, use_errno=True).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG: for the direct parent
    if between:
        chain = [os.getpid(), *between, parent]
        threading.Thread(target=_watch, args=(chain, poll), daemon=True).start()
    elif os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    return True


def _watch(chain: list[int], poll: float) -> None:
    while all(_parent(child) == parent for child, parent in pairwise(chain)):
        time.sleep(poll)
    os.kill(os.getpid(), signal.SIGKILL)


def _words(pid: int) -> list[str]:
    try:
        return Path(f"/proc/{pid}/cmdline").read_text(errors="replace").split("\0")
    except OSError:
        return [""]


def _wrapper(pid: int) -> bool:
    words = _words(pid)
    return len(words) > 1 and Path(words[0]).name in SHELLS and "c" in words[1] and words[1].startswith("-")


def _parent(pid: int) -> int:
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    except (OSError, IndexError):
        return 0


# ----------------------------------------------------------------------------------------------------------------- cost
class Cost:
    """What a run costs: wall and CPU seconds since the object was made, added to what was spent ``before``."""

    def __init__(self, seconds: float = 0.0, cpu_seconds: float = 0.0):
        self.seconds, self.cpu_seconds = time.perf_counter() - seconds, time.process_time() - cpu_seconds

    def spent(self) -> dict[str, float]:
        """Wall and CPU seconds so far."""
        return {
            "seconds": time.perf_counter() - self.seconds,
            "cpu_seconds": time.process_time() - self.cpu_seconds,
        }

    def write(self, path: Path, cells: int, steps: int) -> None:
        """Write ``NAME.cost.json`` beside ``path`` = ``NAME.nc``; ``steps`` time steps of ``cells`` cells each."""
        record: dict[str, Any] = {key: round(value, 6) for key, value in self.spent().items()}
        rate = cells * steps / self.spent()["cpu_seconds"] if steps else 0.0
        record |= {"cells": cells, "steps": steps, "cell_steps_per_second": rate}
        record |= {"peak_memory_bytes": peak_memory(), "threads": int(os.environ.get("NUMBA_NUM_THREADS", "1"))}
        record |= {"machine": machine(), "cores": os.cpu_count(), "versions": versions()}
        target = cost_path(path)
        spare = target.with_name(f"{target.name}.tmp.{os.getpid()}")
        spare.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
        os.replace(spare, target)


def cost_path(path: Path) -> Path:
    """``NAME.cost.json`` for ``NAME.nc``."""
    return Path(path).with_suffix(".cost.json")


def peak_memory() -> int:
    """Largest resident memory of this process so far [bytes]; 0 where the system does not tell."""
    with suppress(OSError, StopIteration):  # Linux: `getrusage` would count what the parent had before the fork
        lines = Path("/proc/self/status").read_text().splitlines()
        return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))
    try:
        import resource
    except ImportError:
        return 0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def machine() -> str:
    """Model name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    model = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    return model or platform.processor() or platform.machine()
