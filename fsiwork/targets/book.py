"""The index of what is regenerated: figures, tables and tests of the book, each with its checks."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fsiwork.targets.reading import FUNCTION, IDENTIFIER, SIZES, Faults, read_yaml

KINDS = ("near", "at_most", "at_least")
ENTRY_KEYS = {"title", "chapter", "studies", "figure", "table", "measure", "caption", "checks"}
CHECK_KEYS = {"metric", "kind", "expected", "tolerance", "source", "why", *SIZES}


@dataclass(frozen=True)
class Check:
    """One number and what it is held against: near (within tolerance), at_most or at_least ``expected``.

    ``why`` says, where a check is known to fail, what was found; it changes nothing about passing.
    """

    metric: str
    kind: str
    expected: float
    tolerance: float
    source: str
    why: str = ""


@dataclass(frozen=True)
class Entry:
    """A figure, table or test of the book with its studies, functions and the checks of one size."""

    id: str
    title: str
    chapter: int
    studies: tuple[str, ...]
    measure: str
    figure: str | None
    table: str | None
    caption: str
    checks: tuple[Check, ...] = field(default=())


def load_book(path: Path, size: str) -> dict[str, Entry]:
    """Entries of the book at a size, by id. Raises `Faults`, one line a fault."""
    data, faults, entries = read_yaml(path), [], {}
    for name, raw in data.items():
        if not isinstance(raw, dict):
            faults.append(f"{name}: must be a mapping")
            continue
        own = [f"{name}.{line}" for line in _entry_faults(str(name), raw)]
        checks = []
        for i, check in enumerate(raw.get("checks") or []):
            wrong, made = _check(check, size)
            own += [f"{name}.checks.{i}.{line}" for line in wrong]
            checks += made
        faults += own
        if not own:
            extra = {key: raw.get(key) for key in ("figure", "table")}
            fixed = {key: raw[key] for key in ("title", "chapter", "measure", "caption")}
            entries[name] = Entry(id=name, studies=tuple(raw["studies"]), checks=tuple(checks), **fixed, **extra)
    if faults:
        raise Faults(*(f"{path}: {fault}" for fault in faults))
    return entries


def _entry_faults(name: str, raw: dict[str, Any]) -> list[str]:
    faults = [f"{key}: unknown key" for key in raw if key not in ENTRY_KEYS]
    if not IDENTIFIER.fullmatch(name):
        faults.append(f"{name}: is no identifier")
    for key, kind in (("title", str), ("caption", str), ("chapter", int), ("studies", list), ("measure", str)):
        if not isinstance(raw.get(key), kind) or not raw[key]:
            faults.append(f"{key}: needs a {kind.__name__}, got {raw.get(key)!r}")
    for key in ("measure", "figure", "table"):
        if isinstance(raw.get(key), str) and not FUNCTION.fullmatch(raw[key]):
            faults.append(f"{key}: must be module.function, got {raw[key]!r}")
    if not raw.get("checks"):
        faults.append("checks: at least one is needed")
    return faults


def _check(raw: Any, size: str) -> tuple[list[str], list[Check]]:
    if not isinstance(raw, dict):
        return [f" must be a mapping, got {raw!r}"], []
    faults = [f"{key}: unknown key" for key in raw if key not in CHECK_KEYS]
    if size in raw and raw[size] is None:
        return faults, []
    values = {key: raw.get(key) for key in ("expected", "tolerance")} | (raw.get(size) or {})
    faults += [f"{size}.{key}: unknown key" for key in values if key not in ("expected", "tolerance")]
    kind, expected, tolerance = raw.get("kind"), values["expected"], values["tolerance"]
    if kind not in KINDS:
        faults.append(f"kind: must be one of {', '.join(KINDS)}, got {kind!r}")
    if kind != "near" and tolerance is None:
        tolerance = 0.0
    for key, value in (("expected", expected), ("tolerance", tolerance)):
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < float("inf"):
            faults.append(f"{key}: must be a number, got {value!r}")
    for key in ("metric", "source"):
        if not isinstance(raw.get(key), str) or not raw[key]:
            faults.append(f"{key}: is missing")
    if not isinstance(raw.get("why", ""), str):
        faults.append(f"why: must be a text, got {raw['why']!r}")
    if faults:
        return faults, []
    return [], [Check(raw["metric"], kind, float(expected), float(tolerance), raw["source"], raw.get("why", ""))]
