"""What was measured beside what was expected: rows of an artefact, and the scorecard of all (JSON, Markdown, HTML)."""

import html
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import xarray as xr

from fsiwork.checkpoint import replacing
from fsiwork.provenance import cost_path
from fsiwork.studies.sweep import load, resolve
from fsiwork.targets import SIZES, Check, Entry, Faults, Plan

SIGN = {"near": "≈", "at_most": "≤", "at_least": "≥"}


def datasets(plan: Plan, entry: Entry, size: str) -> dict[str, xr.Dataset]:
    """The studies of an entry by name."""
    return {name: load(plan.file(size, "studies", name)) for name in entry.studies}


def passes(check: Check, measured: float) -> bool:
    """Whether a number passes; one that is missing or not finite never does."""
    if not math.isfinite(measured):
        return False
    if check.kind == "near":
        return abs(measured - check.expected) <= check.tolerance
    if check.kind == "at_most":
        return measured <= check.expected + check.tolerance
    return measured >= check.expected - check.tolerance


def rows(entry: Entry, size: str, measured: dict[str, float], cost: dict[str, float]) -> list[dict[str, Any]]:
    """One row for each check; a missing or NaN metric has ``measured`` null and fails."""
    made = []
    for check in entry.checks:
        value = float(measured.get(check.metric, math.nan))
        row = {"artefact": entry.id, "metric": check.metric, "measured": value if math.isfinite(value) else None}
        row |= {"kind": check.kind, "expected": check.expected, "tolerance": check.tolerance}
        row |= {"pass": passes(check, value), "source": check.source, "size": size, **cost}
        if check.why and not row["pass"]:
            row["why"] = check.why
        made.append(row)
    return made


def measure(plan: Plan, entry: Entry, size: str) -> dict[str, Any]:
    """Measures and checks of an entry: ``{"rows": [...], "measured": {metric: number}}``."""
    found = resolve(entry.measure, "studies")(datasets(plan, entry, size))
    measured = {name: float(value) for name, value in found.items()}
    plain = {name: value if math.isfinite(value) else None for name, value in measured.items()}
    return {"rows": rows(entry, size, measured, _cost(plan, entry, size)), "measured": plain}


def measured_of(path: Path) -> dict[str, float]:
    """The numbers that `measure` wrote, NaN for null. Raises `Faults` when it did not."""
    if not path.is_file():
        raise Faults(f"{path}: no such file; `snakemake {path}` makes it")
    numbers = json.loads(path.read_text(encoding="utf-8"))["measured"]
    return {name: math.nan if value is None else value for name, value in numbers.items()}


def _cost(plan: Plan, entry: Entry, size: str) -> dict[str, float]:
    parts = [json.loads(cost_path(Path(plan.file(size, "studies", s))).read_text()) for s in entry.studies]
    return {
        "cells": max(part["cells"] for part in parts),
        "steps": sum(part["steps"] for part in parts),
        "cpu_seconds": round(sum(part["cpu_seconds"] for part in parts), 3),
    }


# -------------------------------------------------------------------------------------------------- the scorecard
def collect(plan: Plan) -> list[dict[str, Any]]:
    """Rows of both sizes, as far as they were run, in the order of the book."""
    found = []
    for size in SIZES:
        for name in plan.book(size):
            path = Path(plan.file(size, "checks", name))
            if path.is_file():
                found += json.loads(path.read_text(encoding="utf-8"))["rows"]
    return found


def write(plan: Plan, out: Path) -> list[dict[str, Any]]:
    """Write ``scorecard.json`` and the ``.md`` and ``.html`` made from it; returns the rows."""
    found = collect(plan)
    _put(out, json.dumps(found, indent=1, ensure_ascii=False) + "\n")
    _put(out.with_suffix(".md"), markdown(found))
    _put(out.with_suffix(".html"), page(found, plan, out.parent))
    return found


def _put(path: Path, content: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as spare:
        spare.write_text(content, encoding="utf-8")


def summary(found: Iterable[dict[str, Any]]) -> str:
    """``coarse: 41 of 42 checks pass; book: …``"""
    parts = []
    for size in SIZES:
        own = [row["pass"] for row in found if row["size"] == size]
        if own:
            parts.append(f"{size}: {sum(own)} of {len(own)} checks pass")
    return "; ".join(parts) or "nothing was measured yet"


def number(value: float | None) -> str:
    """A number for reading: four digits."""
    return "missing" if value is None else f"{value:.4g}"


def expected(row: dict[str, Any]) -> str:
    """``≈ 3.39 ± 0.07`` or ``≤ 0.5``."""
    tolerance = f" ± {number(row['tolerance'])}" if row["kind"] == "near" or row["tolerance"] else ""
    return f"{SIGN[row['kind']]} {row['expected']:.7g}{tolerance}"


COLUMNS = ("artefact", "metric", "measured", "expected", "pass", "source", "size", "cells", "steps", "CPU s")


def cells(row: dict[str, Any]) -> list[str]:
    """A row as words, in the order of `COLUMNS`."""
    outcome = "pass" if row["pass"] else "FAIL"
    first = [
        row["artefact"],
        row["metric"],
        number(row["measured"]),
        expected(row),
        outcome,
        f"{row['source']}. Fails: {row['why']}" if "why" in row else row["source"],
        row["size"],
    ]
    return [*first, str(row["cells"]), str(row["steps"]), f"{row['cpu_seconds']:.1f}"]


def markdown(found: list[dict[str, Any]]) -> str:
    """The scorecard as a Markdown table."""
    lines = [[*COLUMNS], ["---"] * len(COLUMNS), *map(cells, found)]
    table = "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
    return f"# Scorecard\n\n{summary(found)}\n\n{table}\n"


STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem; color: #222 }
table { border-collapse: collapse; width: 100% } th, td { padding: .3rem .6rem; text-align: left; vertical-align: top }
th { border-bottom: 2px solid #888; position: sticky; top: 0; background: #fff } td { border-bottom: 1px solid #ddd }
.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
.pass { color: #17692b } .FAIL { color: #fff; background: #b3261e; font-weight: bold }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); gap: 1rem; margin: 1.5rem 0 }
figure { margin: 0; border: 1px solid #ddd; padding: .5rem } img { width: 100% } figcaption { font-size: 13px }
"""


def page(found: list[dict[str, Any]], plan: Plan, folder: Path) -> str:
    """The scorecard as one HTML page with its style inside; pictures are linked by paths below ``folder``."""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in COLUMNS)
    body = []
    for row in found:
        words = cells(row)
        marks = ["", "", "number", "number", words[4], "", "", "number", "number", "number"]
        line = "".join(f'<td class="{m}">{html.escape(w)}</td>' for m, w in zip(marks, words, strict=True))
        body.append(f'<tr id="{row["artefact"]}-{row["size"]}">{line}</tr>')
    table = f"<table><thead><tr>{head}</tr></thead><tbody>\n" + "\n".join(body) + "\n</tbody></table>"
    pictures = f'<div class="pictures">{_pictures(plan, folder)}</div>'
    title = f"<h1>Scorecard</h1><p>{html.escape(summary(found))}</p>"
    style = f"<meta charset='utf-8'><title>fsiwork: scorecard</title><style>{STYLE}</style>"
    return f"<!doctype html><html lang='en'><head>{style}</head><body>{title}{table}{pictures}</body></html>\n"


def _pictures(plan: Plan, folder: Path) -> str:
    made = []
    for size in SIZES:
        for name, entry in plan.book(size).items():
            path = Path(plan.file(size, "figures", name))
            if not entry.figure or not path.is_file():
                continue
            link = html.escape(path.resolve().relative_to(folder.resolve()).as_posix())
            words = f"<b>{name}</b> ({size}) {html.escape(entry.title)}"
            made.append(f'<figure><a href="{link}"><img src="{link}" loading="lazy" alt="{name}"></a>'
                        f"<figcaption>{words}</figcaption></figure>")  # fmt: skip
    return "\n".join(made)
