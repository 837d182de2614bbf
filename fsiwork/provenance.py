"""Where a number comes from: hashes of scenes and sources, versions, the cost of a run (standard library only)."""

import ast
import atexit
import ctypes
import hashlib
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
from functools import cache
from importlib import metadata
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

PACKAGE = Path(__file__).resolve().parent
RUN = ("core", "bodies", "scene", "simulate", "dataset")  # what the numbers of a run depend on
ALSO = {  # layers of several modules
    "scene": ("scene", "specs"),
    "simulate": ("simulate", "build"),
    "dataset": ("dataset", "layout", "netcdf", "checkpoint"),
    "studies": ("studies", "joining"),
}
NUMERICS = ("numpy", "scipy", "numba")
SHELLS = {"sh", "bash", "dash", "zsh", "ksh", "fish", "tcsh"}
T = TypeVar("T")


# -------------------------------------------------------------------------------------------------------------- sources
def source_hash(*layers: str) -> str:
    """Hash (16 hex digits) of the syntax trees of layers, without comments and docstrings.

    Parameters
    ----------
    layers : names of folders or modules of the package (``core``, ``simulate``, ``figures.chapter3``), or one
        function with all that it names in its module (``figures.chapter3:fig_3_9``). Without any, the layers
        of a run. With ``core`` among them the versions of NumPy, SciPy and Numba belong to the hash.

    Raises
    ------
    FileNotFoundError : when a named layer does not exist.
    """
    layers = layers or tuple(layer for layer in RUN if _files(layer))
    digest = hashlib.sha256()
    for layer in layers:
        module, _, function = layer.partition(":")
        files = _files(module)
        if not files:
            raise FileNotFoundError(f"no layer {module!r} in fsiwork")
        for file in files:
            stamp = file.stat()
            code = _bare(str(file), function, stamp.st_mtime_ns, stamp.st_size)
            digest.update(f"{file.relative_to(PACKAGE).as_posix()}\n{code}\n".encode())
    if "core" in layers:
        digest.update(json.dumps(versions(NUMERICS)).encode())
    return digest.hexdigest()[:16]


def _files(layer: str) -> list[Path]:
    found = []
    for name in ALSO.get(layer, (layer,)):
        place = PACKAGE.joinpath(*name.split("."))
        found += sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]
    return [file for file in found if file.is_file()]


@cache
def _bare(file: str, function: str, mtime: int, size: int) -> str:
    """Hash of a file, or of one function and what it names in the file, without comments and docstrings.

    Kept on disk by the file's time and size: parsing all sources takes longer than all the rest of a dry run.
    """
    key = f"{file}:{function}:{mtime}:{size}"
    if key not in _kept():
        tree = _tree(file, mtime, size)
        body = _reached(tree.body, function) if function else tree.body
        _kept()[key] = hashlib.sha256(ast.dump(ast.Module(body, tree.type_ignores)).encode()).hexdigest()
    return _kept()[key]


@cache
def _kept() -> dict[str, str]:
    """Hashes of earlier processes; what is new is written when this one ends, as far as the disk lets it."""
    path = cache_root() / f"sources-{platform.python_version()}.json"
    known: dict[str, str] = {}
    with suppress(OSError, ValueError, TypeError):
        known.update(json.loads(path.read_text(encoding="utf-8")))
    before = len(known)

    def keep():
        if len(known) == before:
            return
        alive = {key: value for key, value in known.items() if _as_it_is(key)}
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            spare = path.with_suffix(f".{os.getpid()}")
            spare.write_text(json.dumps(alive), encoding="utf-8")
            spare.replace(path)

    atexit.register(keep)
    return known


def _as_it_is(key: str) -> bool:
    file, _, mtime, size = key.rsplit(":", 3)
    with suppress(OSError):
        stamp = os.stat(file)
        return (str(stamp.st_mtime_ns), str(stamp.st_size)) == (mtime, size)
    return False


@cache
def _tree(file: str, mtime: int, size: int) -> ast.Module:
    """Syntax tree of a file without docstrings; a file is read once."""
    tree = ast.parse(Path(file).read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and body:
            first = body[0]
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                node.body = body[1:] or [ast.Pass()]
    return tree


def _reached(body: list[ast.stmt], function: str) -> list[ast.stmt]:
    """Statements of a module that a function needs: itself and, transitively, the definitions that it names."""
    names = [{n.id for n in ast.walk(s) if isinstance(n, ast.Name)} for s in body]
    defines = [_defined(s) for s in body]
    if not any(function in d for d in defines):
        raise FileNotFoundError(f"no function {function!r} in its module")
    wanted, kept = {function}, set()
    while new := [i for i, d in enumerate(defines) if i not in kept and d & wanted]:
        kept.update(new)
        wanted.update(*(names[i] for i in new))
    return [s for i, s in enumerate(body) if i in kept]


def _defined(statement: ast.stmt) -> set[str]:
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return {statement.name}
    if isinstance(statement, ast.Import | ast.ImportFrom):
        return {(a.asname or a.name).split(".")[0] for a in statement.names}
    return {n.id for n in ast.walk(statement) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}


def versions(names: tuple[str, ...] = (*NUMERICS, "xarray", "netCDF4")) -> dict[str, str]:
    """Installed versions of Python, fsiwork and packages, without importing them."""
    found = {"python": platform.python_version()}
    return found | {name: _version(name) for name in ("fsiwork", *names)}


@cache
def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


def scene_id(scene_json: str | dict) -> str:
    """Hash (16 hex digits) of a scene; the order of keys and white space do not matter."""
    data = json.loads(scene_json) if isinstance(scene_json, str) else scene_json
    text = json.dumps(data, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


# -------------------------------------------------------------------------------------------------------------- process
def cache_root() -> Path:
    """Folder of the caches: ``.cache`` of the checkout, or of the user when the package is installed elsewhere."""
    root = PACKAGE.parent
    if (root / "pyproject.toml").is_file() and os.access(root, os.W_OK):
        return root / ".cache"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fsiwork"


def prepare(threads: int = 1) -> Path:
    """Set up Numba's threads and its cache folder; call it before anything imports Numba.

    Numba sees an edit in a kernel's own file, but not in a callee of another file: the cache folder carries the hash of
    the `shared` files, so that an edit elsewhere compiles no more than its own file. Returns the folder.
    """
    folder = cache_root() / "numba" / source_hash(*shared(PACKAGE / "core" / "kernels"))
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    os.environ["NUMBA_NUM_THREADS"] = str(threads)
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    if numba := sys.modules.get("numba"):  # too late for the environment: what can still be set
        numba.config.CACHE_DIR = str(folder)
        numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
    return folder


def shared(kernels: Path) -> tuple[str, ...]:
    """Modules of a folder of kernels from which other files of it import, and the folder's own ``__init__``."""
    package = ".".join(kernels.relative_to(PACKAGE).parts)
    names = {f"{package}.__init__"}
    for file in kernels.glob("*.py"):
        stamp = file.stat()
        for node in ast.walk(_tree(str(file), stamp.st_mtime_ns, stamp.st_size)):
            if isinstance(node, ast.ImportFrom) and node.module.startswith(f"fsiwork.{package}."):
                names.add(node.module.removeprefix("fsiwork."))
    return tuple(sorted(names))


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
