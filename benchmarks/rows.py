"""One row a benchmark: what was measured, against what, and whether it reaches its mark; JSON and Markdown."""

import json
import math
import os
import textwrap
from pathlib import Path
from typing import Any

from benchmarks.timing import load
from fsiwork.provenance import machine

BEGIN, END = "<!-- benchmarks -->", "<!-- /benchmarks -->"
Row = dict[str, Any]


def row(
    benchmark: str,
    measured: float | None,
    unit: str,
    mark: str = "",
    *,
    against: tuple[str, float | None] = ("", None),
    share: float | None = None,
    besides: bool = True,
    note: str = "",
) -> Row:
    """A row.

    ``mark``: ``>= 70``, ``<= 6`` or ``ratio <= 0.05``; ``against``: a peer and its number in the same unit; ``ratio``:
    measured over that number; ``besides``: what must also hold to pass; ``share``: of the bandwidth of the triad.
    ``pass`` is None where nothing was decided: no number, or no mark.
    """
    reference = against[1]
    ratio = measured / reference if measured is not None and reference else None
    reached = reaches(ratio if mark.startswith("ratio") else measured, mark.removeprefix("ratio"))
    return {
        "benchmark": benchmark,
        "measured": _tidy(measured),
        "unit": unit,
        "against": against[0],
        "reference": _tidy(reference),
        "ratio": _tidy(ratio),
        "mark": mark,
        "pass": reached if reached is None else reached and besides,
        "bandwidth_share": _tidy(share),
        "load": load(),
        "machine": machine(),
        "note": note,
    }


def reaches(value: float | None, mark: str) -> bool | None:
    """Whether a number reaches ``>= 70``; None when there is no number or no mark. NaN reaches none."""
    if value is None or not mark:
        return None
    word, number = mark.split()
    return bool({">=": value >= float(number), "<=": value <= float(number)}[word])


def _tidy(x: float | None) -> float | None:
    """Four digits; JSON knows neither NaN nor infinity."""
    return float(f"{x:.4g}") if x is not None and math.isfinite(x) else None


def read(path: Path) -> list[Row]:
    """The rows of a file; none if there is no file."""
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else []


def write(found: list[Row], path: Path) -> None:
    """The rows as JSON, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    spare = path.with_name(f"{path.name}.tmp.{os.getpid()}")
    spare.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    os.replace(spare, path)


def merged(old: list[Row], new: list[Row]) -> list[Row]:
    """``old`` with the rows of ``new`` in the place of theirs, further ones at the end."""
    fresh = {r["benchmark"]: r for r in new}
    return [fresh.pop(r["benchmark"], r) for r in old] + list(fresh.values())


def table(found: list[Row]) -> str:
    """The rows as Markdown."""
    lines = ["| benchmark | measured | mark | against | ratio | of triad | |", "|---|--:|--:|---|--:|--:|---|"]
    verdicts = {True: "reached", False: "**missed**", None: ""}
    for r in found:
        peer = " ".join(w for w in (r["against"], _show(r["reference"])) if w)
        share = "" if r["bandwidth_share"] is None else f"{100 * r['bandwidth_share']:.0f} %"
        words = "; ".join(w for w in (verdicts[r["pass"]], r["note"]) if w)
        measured = "–" if r["measured"] is None else f"{_show(r['measured'])} {r['unit']}"
        cells = (f"`{r['benchmark']}`", measured, r["mark"], peer, _show(r["ratio"]), share, words)
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join((*lines, "", _legend(found))) + "\n"


def _legend(found: list[Row]) -> str:
    machines = " and ".join(sorted({r["machine"] for r in found}))
    loads = [r["load"] for r in found] or [0.0]
    busy = f"{min(loads):.1f} to {max(loads):.1f}"
    text = (
        f"Least CPU time of many, one thread, {machines}; {busy} processes a core wanted to run at the time."
        " *Bandwidth*: what a triad a = b + s c over arrays of the same size, in the same run, would allow if each"
        " field that a stage needs were read once and each that it changes written once."
    )
    return textwrap.fill(text, 120)


def _show(x: float | None) -> str:
    return "" if x is None else f"{x:.3g}" if abs(x) < 1000 else f"{x:.0f}"


def put_into(readme: Path, text: str) -> None:
    """Replace what stands between the markers of a file. Raises ValueError when they are not there."""
    head, begin, rest = readme.read_text(encoding="utf-8").partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"{readme.name} lacks the markers {BEGIN} and {END}")
    readme.write_text(f"{head}{BEGIN}\n{text}{END}{tail}", encoding="utf-8")
