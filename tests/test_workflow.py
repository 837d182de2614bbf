"""The workflow on a miniature book: from two scenes to the scorecard, and what is noticed afterwards."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fsiwork.studies import jobs, scorecard, sweep
from fsiwork.targets import Check, Plan

ROOT = Path(__file__).resolve().parents[1]

FILES = {
    "mini.py": """
import numpy as np

def parabola(scene, point):
    return {"y": point["x"] ** 2 + point["shift"], "line": (("place",), [point["x"], 2.0 * point["x"]]), "word": "even"}

def measure(datasets):
    parabola, drop = datasets["parabola"], datasets["drop"]
    return {
        "last": float(parabola["y"].sel(x=3.0)),
        "place": float(parabola["line"].isel(place=1).sel(x=2.0)),
        "steps": float(drop["n_steps"].sum()),
        "volume": float(drop["volume"].isel(row=0).sel(cells=24, step=0.004)),
        "nothing": float("nan"),
    }

def figure(datasets, measured):
    from matplotlib.figure import Figure
    drawn = Figure()
    drawn.subplots().plot(datasets["parabola"]["y"])
    return drawn

def rows(datasets, measured):
    return ["x", "y"], [[float(x), float(y)] for x, y in zip(datasets["parabola"]["x"], datasets["parabola"]["y"])]
""",
    "configs/scenes/drop.yaml": """
box: {length: [2.0, 2.0], cells: 24, edges: walls}
fluid: {density: 1.0, viscosity: 0.1}
bodies:
  - kind: membrane
    shape: {kind: ellipse, centre: [1.0, 1.0], semi_axes: [0.6, 0.5]}
    energy: {kind: linear, stiffness: 1.0}
    width: {cells: 3}
clock: {end: 0.016, step: 0.004, frames: 2}
""",
    "configs/studies/parabola.yaml": """
kind: call
call: mini:parabola
args: {shift: 0.5}
axes: {x: [1.0, 2.0, 3.0]}
batch: [x]
book: {axes: {x: [1.0, 2.0, 3.0, 4.0]}}
""",
    "configs/studies/drop.yaml": """
scene: drop
axes: {box.cells: [16, 24], clock.step: [0.008, 0.004]}
batch: [step]
""",
    "configs/studies/plain.yaml": "{scene: drop, fields: [p], set: {bodies.0.coupling: explicit}}",
    "configs/book.yaml": """
mini:
  title: A parabola & a drop
  chapter: 1
  studies: [parabola, drop, plain]
  measure: mini:measure
  figure: mini:figure
  table: mini:rows
  caption: Nothing <b>but</b> a test.
  checks:
    - {metric: last, kind: near, expected: 9.5, tolerance: 0.0, source: exact}
    - {metric: place, kind: at_least, expected: 4.0, source: exact}
    - {metric: steps, kind: at_most, expected: 12, source: count}
    - {metric: volume, kind: near, expected: 0.942, tolerance: 0.05, source: πab}
    - {metric: nothing, kind: at_most, expected: 1.0, source: here, why: is not a number}
    - {metric: forgotten, kind: at_most, expected: 1.0, source: is not measured}
""",
}


def snakemake(folder, *arguments, path=()):
    """Run the repository's workflow in a folder with its own configs; one core, no profile of the repository."""
    command = [sys.executable, "-m", "snakemake", "--snakefile", ROOT / "Snakefile", "--directory", folder]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (folder, *path))), "NUMBA_NUM_THREADS": "1"}
    return subprocess.run(
        [*map(str, command), "--cores", "1", "--workflow-profile", "none", *arguments],
        capture_output=True, text=True, env=environment, cwd=folder,
    )  # fmt: skip


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    """The miniature book, made once."""
    folder = tmp_path_factory.mktemp("book")
    for name, content in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
    done = snakemake(folder, "--show-failed-logs")
    assert done.returncode == 0, done.stderr[-3000:] + done.stdout[-3000:]
    return folder


def fsiwork(folder, *arguments):
    return subprocess.run([sys.executable, "-m", "fsiwork", *arguments], capture_output=True, text=True, cwd=folder)


def test_the_scorecard_has_one_row_a_check_and_tells_failures(book):
    rows = json.loads((book / "results/scorecard.json").read_text())
    assert {row["metric"]: row["pass"] for row in rows} == {
        "last": True, "place": True, "steps": True, "volume": True, "nothing": False, "forgotten": False,
    }  # fmt: skip
    assert set(rows[0]) == {
        "artefact", "metric", "measured", "kind", "expected", "tolerance", "pass", "source", "size", "cells", "steps",
        "cpu_seconds",
    }  # fmt: skip
    assert rows[0]["measured"] == 9.5
    assert rows[4]["measured"] is None
    assert rows[4]["why"] == "is not a number"
    assert rows[0]["cells"] == 24
    assert rows[0]["steps"] == 2 * (2 + 4) + 4
    assert rows[0]["cpu_seconds"] > 0


def test_the_pages_of_the_scorecard_show_pictures_and_escape(book):
    page = (book / "results/scorecard.html").read_text()
    assert 'src="coarse/figures/mini.png"' in page
    assert "A parabola &amp; a drop" in page
    assert page.count("FAIL</td>") == 2
    assert page.count("here. Fails: is not a number") == 1
    assert "| mini | last | 9.5 | ≈ 9.5 ± 0 | pass | exact | coarse |" in (book / "results/scorecard.md").read_text()


def test_figure_and_table_are_there(book):
    assert (book / "results/coarse/figures/mini.png").read_bytes().startswith(b"\x89PNG")
    assert (book / "results/coarse/tables/mini.csv").read_text() == "x,y\n1.0,1.5\n2.0,4.5\n3.0,9.5\n"
    assert "| 2 | 4.5 |" in (book / "results/coarse/tables/mini.md").read_text()


def test_a_study_has_its_axes_as_dimensions(book):
    drop = sweep.load(book / "results/coarse/studies/drop.nc")
    assert drop["volume"].dims == ("cells", "step", "row")
    assert set(drop["ended"].values.ravel()) == {"complete"}
    np.testing.assert_array_equal(drop["n_steps"].sel(cells=16), [2, 4])
    assert (drop["cpu_seconds"] > 0).all()
    times, volumes = sweep.curve(drop, "volume", cells=24, step=0.008)
    assert len(times) == len(volumes) < drop.sizes["row"]
    assert times[-1] == pytest.approx(0.016)
    assert volumes[-1] == pytest.approx(np.pi * 0.6 * 0.5, rel=0.05)


def test_a_study_keeps_the_fields_it_asks_for(book):
    plain = sweep.load(book / "results/coarse/studies/plain.nc")
    assert plain["p"].dims[-2:] == ("y_c", "x_c")
    assert "phi" not in plain
    assert np.isfinite(plain["p"]).all()


def test_labelled_arrays_of_calls_keep_their_dimension(book):
    parabola = sweep.load(book / "results/coarse/studies/parabola.nc")
    assert parabola["line"].dims == ("x", "place")
    assert list(parabola["word"].values) == ["even"] * 3


def test_nothing_is_made_twice_and_a_deleted_dataset_is_noticed(book):
    again = snakemake(book, "--dry-run")
    assert "Nothing to be done" in again.stdout + again.stderr
    run = book / "results/coarse/runs/drop/cells~16_step~0.008.nc"
    content = run.read_bytes()
    run.unlink()
    again = snakemake(book, "--dry-run")
    assert "batch_drop" in again.stdout + again.stderr
    assert snakemake(book, str(run.relative_to(book))).returncode == 0
    assert run.read_bytes() == content, "two runs of a scene give the same bytes"


def test_a_changed_solver_makes_every_run_again(book, tmp_path):
    (tmp_path / "sitecustomize.py").write_text(
        "from fsiwork import sources\n"
        "before = sources.source_hash\n"
        "sources.source_hash = lambda *layers: before(*layers) + 'x'\n"
    )
    again = snakemake(book, "--dry-run", path=[tmp_path])
    said = again.stdout + again.stderr
    for rule in ("warm_cache", "batch_drop", "call", "run", "join", "measure", "figure"):
        assert f"rule {rule}:" in said, rule


def test_verify_finds_what_changed(book):
    first = fsiwork(book, "verify")
    assert first.returncode == 0, first.stderr
    table = book / "results/coarse/tables/mini.csv"
    kept = table.read_text()
    table.write_text(kept.replace("9.5", "9.6"))
    second = fsiwork(book, "verify")
    table.write_text(kept)
    assert second.returncode == 1
    assert second.stderr == "results/coarse/tables/mini.csv: changed since it was made\n"


def test_the_sizes_live_side_by_side(book):
    done = snakemake(book, "--config", "size=book", "--", "results/book/studies/parabola.nc")
    assert done.returncode == 0, done.stderr[-2000:]
    assert sweep.load(book / "results/book/studies/parabola.nc").sizes["x"] == 4
    assert sweep.load(book / "results/coarse/studies/parabola.nc").sizes["x"] == 3


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["measure", "fig_9"], "fig_9: is not in configs/book.yaml; there are mini"),
        (["study", "drop", "--job", "cells~7"], "drop: there is no job 'cells~7'; there are cells~16, cells~24"),
        (["study", "nothing"], "configs/studies/nothing.yaml: No such file or directory"),
        (["figure", "mini", "--size", "small"], "size: must be one of coarse, book, got 'small'"),
        (["verify", "--results", "elsewhere"], "elsewhere: no manifest; `snakemake` writes it at the end"),
    ],
)
def test_bad_input_is_answered_in_one_line(book, arguments, line):
    done = fsiwork(book, *arguments)
    assert (done.returncode, done.stderr) == (2, line + "\n")


@pytest.mark.parametrize(
    ("kind", "measured", "outcome"),
    [
        ("near", 1.1, True), ("near", 1.3, False), ("near", 0.7, False),
        ("at_most", 1.0, True), ("at_most", 1.3, False), ("at_least", 1.0, True), ("at_least", 0.7, False),
        ("at_most", float("-inf"), False), ("at_least", float("inf"), False), ("near", float("nan"), False),
    ],
)  # fmt: skip
def test_a_check_can_fail(kind, measured, outcome):
    assert scorecard.passes(Check("m", kind, 1.0, 0.2, "here"), measured) is outcome


def test_lint_wishes_for_containers_only():
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", "--lint"], capture_output=True, text=True, cwd=ROOT
    )  # fmt: skip
    said = done.stdout + done.stderr
    wishes = {line.strip() for line in said.splitlines() if line.startswith("    * ")}
    assert wishes <= {"* Specify a conda environment or container for each rule.:"}, said
    assert wishes or "Congratulations" in said, said


def test_reading_the_whole_workflow_loads_nothing_that_computes_or_draws():
    """What keeps it quick; `python -m benchmarks workflow_parse` times it."""
    words = [sys.executable, "-X", "importtime", "-m", "snakemake", "--dry-run", "--quiet", "all"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr[-2000:]
    loaded = {line.rsplit("|", 1)[-1].strip() for line in done.stderr.splitlines() if line.startswith("import time:")}
    assert "snakemake" in loaded
    assert not loaded & {"numba", "scipy", "xarray", "netCDF4", "dask", "matplotlib"}


def test_every_alias_is_a_rule():
    done = subprocess.run([sys.executable, "-m", "snakemake", "--list-rules"], capture_output=True, text=True, cwd=ROOT)
    rules = set(done.stdout.split())
    assert {"all", "book", "chapter_1", "chapter_3", *Plan(ROOT / "configs").book("coarse")} <= rules


@pytest.mark.parametrize("size", ["coarse", "book"])
def test_every_scene_of_a_study_has_a_small_grid_to_compile_on(size):
    """Boxes of all shapes: 32 cells along the longest side do not divide each of them."""
    plan = Plan(ROOT / "configs")
    scenes = [(plan.scene(one), point.overrides) for one in plan.studies(size) if one.scene for point in one.points]
    assert max(jobs._small(Path(path), overrides).box.cells for path, overrides in scenes) <= jobs.WARM_CELLS[-1]
