"""The README is true: its code runs, its commands exist, its map shows the house as it is."""

import json
import re
import shlex
from pathlib import Path

import pytest

from fsiwork.__main__ import main
from fsiwork.figures.readme import put_costs
from fsiwork.scene import loads
from fsiwork.targets import Plan

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language):
    """Contents of the fenced blocks of a language, in order."""
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)


def section(title):
    """Text of a section, without its heading."""
    return re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", TEXT, re.MULTILINE | re.DOTALL)[1]


def test_python_runs_as_it_is_printed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    space = {}
    codes = blocks("python")
    assert len(codes) == 2
    for code in codes:  # one after the other, as one reads them
        exec(compile(code, "<README>", "exec"), space)
    ds = space["ds"]
    assert float(ds["axis_x"][-1]) == pytest.approx(0.6124, abs=0.0015)
    assert ds.attrs["ended"] == "complete"
    assert {"u", "v", "p", "phi", "volume"} <= set(ds.data_vars)


def test_the_first_scene_has_ten_lines():
    assert len(blocks("python")[0].strip().splitlines()) <= 12  # with the import and the empty line


def test_yaml_is_a_scene():
    scenes = [loads(text) for text in blocks("yaml")]
    assert [scene.clock.step for scene in scenes] == ["auto"]


def test_commands_do_what_they_say(tmp_path, monkeypatch, capsys):
    """Every `fsiwork` line runs, in a folder with nothing but configs; `verify` alone needs results."""
    lines = re.findall(r"^\$ (.*?)(?:\s+# .*)?$", "".join(blocks("console")), re.MULTILINE)
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    monkeypatch.chdir(tmp_path)
    ours = [shlex.split(line)[1:] for line in lines if line.startswith("fsiwork ")]
    assert [words[0] for words in ours] == ["check", "plan", "run", "show", "export", "verify"]
    for words in ours[:-1]:
        words = [str(p) for w in words for p in (sorted(tmp_path.glob(w)) if "*" in w else [w])]
        short = ["--set", "clock.end=0.1", "--set", "clock.frames=2", "--quiet"] if words[0] == "run" else []
        assert main([*words, *short]) == 0, words
    assert (tmp_path / "out.png").stat().st_size > 10_000
    assert list((tmp_path / "vtk").iterdir())
    assert "in order" in capsys.readouterr().out


def test_make_has_the_targets_that_are_named():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    named = set(re.findall(r"(?:`|\$ )make (\w+)", TEXT))
    assert {"test", "bench", "rulegraph"} <= named
    for target in named:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


def test_every_file_that_is_linked_or_named_is_there():
    links = re.findall(r"\]\(([^)#:]+)\)", TEXT)
    named = re.findall(r"`((?:configs|fsiwork|tests|docs|rules)/[\w./]*)`", TEXT)
    assert links and named
    for path in {*links, *named} - {"configs/studies/NAME.yaml"}:
        assert (ROOT / path).exists(), path


def test_pictures_are_small():
    pictures = sorted((ROOT / "docs").glob("*.png"))
    assert pictures
    for path in pictures:
        assert path.stat().st_size <= 150_000, path
        assert f"docs/{path.name}" in TEXT


def test_the_map_shows_every_room():
    """A new module or folder wants a line in the map; levels are those of the test of the layers."""
    from test_layers import LEVEL

    rows = re.findall(r"^\| (`.*?) \| (.*?) \| (\d?) ?\|$", section("The way of a number"), re.MULTILINE)
    mentioned = " ".join(f"{what} {text}" for what, text, _ in rows)
    rooms = {path.stem for path in (ROOT / "fsiwork").iterdir() if path.suffix in ("", ".py")}
    for room in rooms - {"__init__", "__pycache__"}:
        assert re.search(rf"\b{room}\b", mentioned), room
    for what, _, level in rows:
        for room in re.findall(r"(\w+)(?:\.py|/)`", what.replace("fsiwork/", "")):
            if level and room in LEVEL:
                assert LEVEL[room] == int(level), room


def test_the_graph_names_the_rules():
    (graph,) = blocks("mermaid")
    rules = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "rules").glob("*.smk"))
    declared = set(re.findall(r"^rule (\w+):", rules, re.MULTILINE)) | {"batch", "all"}
    assert set(re.findall(r"\b[a-z_]+\b", graph)) - {"flowchart"} == declared


def test_marks_for_measured_tables_are_there_once():
    for name in ("benchmarks", "cost"):
        assert TEXT.count(f"<!-- {name} -->") == TEXT.count(f"<!-- /{name} -->") == 1
        assert TEXT.index(f"<!-- {name} -->") < TEXT.index(f"<!-- /{name} -->")


def test_the_costs_of_the_book_are_sums_of_its_studies(tmp_path):
    plan = Plan(ROOT / "configs", tmp_path)
    studies = ("pressure_moving", "pressure_rest")
    for k, name in enumerate(studies):
        path = Path(plan.file("coarse", "studies", name)).with_suffix(".cost.json")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"cpu_seconds": 1000.0 * (k + 1), "steps": 5 + k}))
    readme = tmp_path / "README.md"
    readme.write_text("before\n<!-- cost -->\nold\n<!-- /cost -->\nafter\n")
    put_costs(readme, plan)
    lines = readme.read_text().splitlines()
    assert lines[:2] == ["before", "<!-- cost -->"] and lines[-2:] == ["<!-- /cost -->", "after"]
    assert "old" not in lines
    assert "| `fig_3_13` | 1,000 | 5 | – | – |" in lines
    assert "| `fig_3_14` | 3,000 | 11 | – | – |" in lines
    assert "| all that was run | 3,000 | 11 | 0 | 0 |" in lines
    assert len(lines) == 7 + len(plan.book("coarse"))
