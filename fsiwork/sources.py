"""What the code is: hashes of sources and scenes, versions, the folder of the caches (standard library only)."""

import ast
import atexit
import hashlib
import json
import os
import platform
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
RUN = ("core", "bodies", "scene", "simulate", "dataset")  # what the numbers of a run depend on
ALSO = {  # layers of several modules
    "scene": ("scene", "specs"),
    "simulate": ("simulate", "build"),
    "dataset": ("dataset", "layout", "netcdf", "checkpoint"),
    "studies": ("studies", "joining"),
}
NUMERICS = ("numpy", "scipy", "numba")


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


def cache_root() -> Path:
    """Folder of the caches: ``.cache`` of the checkout, or of the user when the package is installed elsewhere."""
    root = PACKAGE.parent
    if (root / "pyproject.toml").is_file() and os.access(root, os.W_OK):
        return root / ".cache"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fsiwork"
