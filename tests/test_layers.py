"""The house's layers, read from the syntax trees: imports point down, heavy libraries stay in their rooms."""

import ast
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "fsiwork"
FILES = sorted(PACKAGE.rglob("*.py"))

# Level of a room; a module may import from rooms of its own level or below.
LEVEL = {
    "core": 0,
    "bodies": 1,
    "specs": 2, "scene": 2, "targets": 2, "build": 2, "simulate": 2, "plan": 2,
    "layout": 3, "checkpoint": 3, "contour": 3, "netcdf": 3, "dataset": 3, "joining": 3, "export": 3,
    "sources": 0, "provenance": 0,  # standard library only, so that everybody may say where a number comes from
    "running": 4, "segmenting": 4, "studies": 4, "figures": 4,
    "artefacts": 5, "__init__": 5, "__main__": 5,
}  # fmt: skip
DATA = {"specs", "scene", "targets"}  # what is simulated, as data: no arithmetic
LIGHT = {"targets", "provenance", "sources"}
FORBIDDEN_NAMES = {"utils", "util", "helpers", "helper", "common", "misc", "tools"}


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path: Path, everywhere: bool = True) -> set[str]:
    """Full names of imported modules; with ``everywhere`` false only those imported when the module is."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree)) if everywhere else list(_at_import(tree.body))
    found = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def _at_import(body):
    for node in body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        yield node
        for part in ("body", "orelse", "handlers", "finalbody"):
            if not isinstance(node, ast.FunctionDef | ast.ClassDef | ast.AsyncFunctionDef):
                yield from _at_import(getattr(node, part, []))


def tops(names: set[str]) -> set[str]:
    return {name.split(".")[0] for name in names}


def inner(names: set[str]) -> set[str]:
    return {name.split(".")[1] for name in names if name.startswith("fsiwork.")}


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_point_down(path):
    own = room(path)
    assert own in LEVEL, f"{own}: say in LEVEL on which level this room is"
    for other in inner(imports(path)):
        assert LEVEL.get(other, 5) <= LEVEL[own], f"{path.name} ({own}) imports {other}"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_heavy_libraries_stay_in_their_rooms(path):
    own, used, at_import = room(path), tops(imports(path)), tops(imports(path, everywhere=False))
    if own != "figures":
        assert not used & {"matplotlib", "cmcrameri"}
    if own not in ("dataset", "studies", "figures"):
        assert not (used - {"xarray"} if own == "running" else used) & {"dask", "xgcm"}
        assert "xarray" not in at_import
    if own == "core":
        assert not used & {"xarray", "pydantic", "yaml", "typer", "netCDF4"}
    if own in DATA | LIGHT:
        assert not used & {"numba", "xarray", "scipy", "matplotlib"}
    if own in LIGHT:
        assert not used & {"numpy", "pydantic"}


def test_bodies_know_no_scene_and_only_build_knows_both():
    for path in FILES:
        known = inner(imports(path, everywhere=False))
        if room(path) in ("core", "bodies"):
            assert not known & {"scene", "specs", "simulate"}
        if room(path) in DATA:
            assert not known & {"core", "bodies", "simulate"}


def test_rules_are_light():
    root = PACKAGE.parent
    for path in (root / "Snakefile", *sorted((root / "rules").glob("*.smk"))):
        text = path.read_text(encoding="utf-8")
        used = re.findall(r"^(?:from|import) (fsiwork[\w.]*)", text, re.MULTILINE)
        assert set(used) <= {"fsiwork.targets", "fsiwork.sources"}, path
        assert not re.search(r"^\s*run:", text, re.MULTILINE), f"{path}: no run: blocks"


def test_importing_targets_loads_nothing_heavy():
    import subprocess
    import sys

    heavy = "('numba', 'xarray', 'numpy', 'matplotlib', 'pydantic', 'scipy')"
    light = "fsiwork.targets, fsiwork.provenance, fsiwork.sources"
    code = f"import sys, {light}; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_no_grab_bags_and_no_numba_traps():
    for path in FILES:
        assert path.stem not in FORBIDDEN_NAMES, path
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.keyword) and node.arg == "fastmath":
                assert not (isinstance(node.value, ast.Constant) and node.value.value), f"{path}: folds isnan to False"
            assert not (isinstance(node, ast.Name) and node.id == "guvectorize"), path
