"""The verbs that make the book: study, join, measure, figure, table, score, manifest, verify, warm."""

import hashlib
import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from fsiwork.targets import Faults, Plan

Id = Annotated[str, typer.Argument(help="name in configs/book.yaml, as fig_3_12")]
Name = Annotated[str, typer.Argument(help="name in configs/studies")]
Size = Annotated[str, typer.Option(help="coarse or book")]
Configs = Annotated[Path, typer.Option(help="folder with book.yaml, studies and scenes")]
Results = Annotated[Path, typer.Option(help="folder of all results")]
Out = Annotated[Path | None, typer.Option("-o", "--output", help="another file than the usual one")]
CONFIGS, RESULTS = Path("configs"), Path("results")


def register(app: typer.Typer) -> None:
    """Add the verbs to the command, which turns their `Faults` into one line each."""
    for verb in (study, join, measure, figure, table, score, manifest, verify, warm):
        app.command()(verb)


def study(
    name: Name,
    job: Annotated[str | None, typer.Option(help="one job only, as n~128; by default all")] = None,
    size: Size = "coarse",
    configs: Configs = CONFIGS,
    results: Results = RESULTS,
) -> None:
    """Compute a study: all its jobs and the dataset joined from them, or with --job one of its jobs."""
    _prepare()
    from fsiwork.studies import jobs

    plan = Plan(configs, results)
    found = plan.study(name, size)
    for one in [job] if job else found.batches:
        for file in jobs.compute(plan, found, one, size):
            print(file)
    if not job:
        print(jobs.join(plan, found, size))


def join(name: Name, size: Size = "coarse", configs: Configs = CONFIGS, results: Results = RESULTS) -> None:
    """Put the runs of a study together: one dataset with its axes as dimensions."""
    from fsiwork.studies import jobs

    plan = Plan(configs, results)
    print(jobs.join(plan, plan.study(name, size), size))


def measure(
    artefact: Id, size: Size = "coarse", configs: Configs = CONFIGS, results: Results = RESULTS, output: Out = None
) -> None:
    """Measure an artefact and check it; a failed check is written, not an error."""
    from fsiwork.studies import scorecard

    plan = Plan(configs, results)
    found = scorecard.measure(plan, plan.entry(artefact, size), size)
    _write(output or Path(plan.file(size, "checks", artefact)), json.dumps(found, indent=1, ensure_ascii=False) + "\n")
    print(scorecard.markdown(found["rows"]))
    for name, value in found["measured"].items():
        print(f"{name} = {scorecard.number(value)}")


def figure(
    artefact: Id, size: Size = "coarse", configs: Configs = CONFIGS, results: Results = RESULTS, output: Out = None
) -> None:
    """Draw the figure of an artefact from its datasets and its measured numbers."""
    from fsiwork.figures.style import save

    plan = Plan(configs, results)
    entry = plan.entry(artefact, size)
    if not entry.figure:
        raise Faults(f"{artefact}: has no figure")
    drawn = _made(plan, artefact, size, "figure")
    path = output or Path(plan.file(size, "figures", artefact))
    save(drawn, path)


def table(
    artefact: Id, size: Size = "coarse", configs: Configs = CONFIGS, results: Results = RESULTS, output: Out = None
) -> None:
    """Write the table of an artefact as CSV and Markdown."""
    import csv
    import io

    plan = Plan(configs, results)
    if not plan.entry(artefact, size).table:
        raise Faults(f"{artefact}: has no table")
    header, lines = _made(plan, artefact, size, "table")
    path = output or Path(plan.file(size, "tables", artefact))
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([header, *lines])
    _write(path, text.getvalue())
    words = [[_word(cell) for cell in line] for line in (header, ["---"] * len(header), *lines)]
    _write(path.with_suffix(".md"), "\n".join("| " + " | ".join(line) + " |" for line in words) + "\n")


def _made(plan: Plan, artefact: str, size: str, kind: str) -> Any:
    from fsiwork.studies import scorecard, sweep

    entry = plan.entry(artefact, size)
    function = sweep.resolve(getattr(entry, kind), "figures" if kind == "figure" else "studies")
    measured = scorecard.measured_of(Path(plan.file(size, "checks", artefact)))
    return function(scorecard.datasets(plan, entry, size), measured)


def _word(cell: Any) -> str:
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell).replace("|", "\\|")


def score(configs: Configs = CONFIGS, results: Results = RESULTS, output: Out = None) -> None:
    """Collect all checks that were measured, of both sizes, into scorecard.json, .md and .html."""
    from fsiwork.studies import scorecard

    found = scorecard.write(Plan(configs, results), output or results / "scorecard.json")
    print(scorecard.summary(found))
    for row in found:
        if not row["pass"]:
            print("FAIL " + "  ".join(scorecard.cells(row)[:7]))


def manifest(size: Size = "coarse", configs: Configs = CONFIGS, results: Results = RESULTS, output: Out = None) -> None:
    """Write down the SHA-256 of every result of a size."""
    files = [Path(file) for file in Plan(configs, results).everything(size)]
    hashes = {file.relative_to(results).as_posix(): _sha256(file) for file in files}
    _write(output or results / size / "manifest.json", json.dumps(hashes, indent=1, sort_keys=True) + "\n")


def verify(results: Results = RESULTS) -> None:
    """Compare results with the hashes written when they were made; exit code 1 when one differs or is missing."""
    manifests = sorted(results.glob("*/manifest.json"))
    if not manifests:
        raise Faults(f"{results}: no manifest; `snakemake` writes it at the end")
    wrong, count = [], 0
    for file in manifests:
        for name, expected in json.loads(file.read_text(encoding="utf-8")).items():
            count += 1
            path = results / name
            if not path.is_file():
                wrong.append(f"{path}: missing")
            elif _sha256(path) != expected:
                wrong.append(f"{path}: changed since it was made")
    for line in wrong:
        print(line, file=sys.stderr)
    print(f"{count - len(wrong)} of {count} results are as they were made")
    if wrong:
        raise typer.Exit(1)


def warm(size: Size = "coarse", configs: Configs = CONFIGS) -> None:
    """Compile the kernels that the studies need, once, before many processes want them at the same time."""
    _prepare()
    from fsiwork.studies import jobs

    plan = Plan(configs)
    with_scene = [(plan.scene(one), one.points) for one in plan.studies(size) if one.scene]
    count = jobs.warm((path, point.overrides) for path, points in with_scene for point in points)
    print(f"{count} different scenes compiled")


def _prepare() -> None:
    import os

    from fsiwork import provenance

    provenance.prepare(int(os.environ.get("NUMBA_NUM_THREADS", "1")))
    provenance.die_with_parent()


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    spare = path.with_name(f"{path.name}.tmp")
    spare.write_text(text, encoding="utf-8")
    spare.replace(path)


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
