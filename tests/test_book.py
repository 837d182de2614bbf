"""The index of the book: every entry resolves, every fault of the configuration is one clear line."""

from pathlib import Path

import pytest
import yaml

from fsiwork.scene import load as load_scene
from fsiwork.studies.sweep import resolve
from fsiwork.targets import SIZES, Faults, Plan
from fsiwork.targets.studies import short_names, text

ROOT = Path(__file__).resolve().parents[1]
PLAN = Plan(ROOT / "configs")
ASKED = {
    *(f"fig_3_{n}" for n in range(9, 18)), "table_3_1", "stability_1_54", "taylor_green", "cavity",
    "mode_drop", "mode_membrane", "tradeoff_membrane", "energy_law",
}  # fmt: skip


@pytest.mark.parametrize("size", SIZES)
def test_every_asked_artefact_is_there_and_checked(size):
    book = PLAN.book(size)
    assert set(book) >= ASKED
    assert all(book[name].checks for name in ASKED)


@pytest.mark.parametrize("name", PLAN.book("coarse"))
def test_functions_exist(name):
    entry = PLAN.entry(name, "coarse")
    assert callable(resolve(entry.measure, "studies"))
    assert entry.figure is None or callable(resolve(entry.figure, "figures"))
    assert entry.table is None or callable(resolve(entry.table, "studies"))


@pytest.mark.parametrize("study", [s for s in PLAN.studies("coarse") if s.call], ids=lambda s: s.name)
def test_calls_exist(study):
    assert callable(resolve(study.call, "studies"))


@pytest.mark.parametrize("size", SIZES)
def test_every_point_of_every_study_is_a_scene(size):
    for study in PLAN.studies(size):
        assert len({point.name for point in study.points}) == len(study.points)
        for point in study.points if study.scene else ():
            scene = load_scene(PLAN.scene(study), point.overrides)
            for path, value in point.overrides.items():
                if path == "box.cells":
                    assert scene.box.cells == value


def test_no_study_is_left_over():
    used = {study.name for size in SIZES for study in PLAN.studies(size)}
    assert used == {path.stem for path in (ROOT / "configs" / "studies").glob("*.yaml")}


def test_names_of_points_can_be_read():
    study = PLAN.study("tradeoff_grid", "coarse")
    assert "coupling~explicit_cells~64_step~0.001" in [point.name for point in study.points]
    assert len(study.batches) * len(study.batches["coupling~explicit_cells~64"]) == len(study.points)


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        (["box.cells", "clock.step"], ["cells", "step"]),
        (["box.cells", "bodies.0.width.cells"], ["cells", "width"]),
        (["fluid.density", "bodies.0.inside.density"], ["fluid_density", "inside_density"]),
    ],
)
def test_short_names_are_unique(paths, names):
    assert list(short_names(paths).values()) == names


@pytest.mark.parametrize("value", [1, 0.1, 1e-3, 6.5e-4, True, "explicit", [1.0, 2.0], {"length": 0.1}])
def test_an_option_gives_back_its_value(value):
    assert yaml.safe_load(text(value)) == value


GOOD_CHECK = {"metric": "m", "kind": "at_most", "expected": 1, "source": "x"}
GOOD_STUDY = {"title": "t", "scene": "s", "axes": {"box.cells": [16, 32]}}
GOOD_ENTRY = {"title": "t", "chapter": 1, "studies": ["s"], "measure": "a.b", "caption": "c", "checks": [GOOD_CHECK]}


def faults(folder, entry=None, study=None):
    (folder / "studies").mkdir()
    (folder / "book.yaml").write_text(yaml.safe_dump({"artefact": entry or GOOD_ENTRY}))
    (folder / "studies" / "s.yaml").write_text(yaml.safe_dump(study or GOOD_STUDY))
    plan = Plan(folder)
    with pytest.raises(Faults) as caught:
        plan.book("coarse")
        plan.study("s", "coarse")
    assert all("\n" not in line for line in caught.value.faults)
    return caught.value.faults


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"chapter": "one"}, "artefact.chapter: needs a int, got 'one'"),
        ({"studies": []}, "artefact.studies: needs a list, got []"),
        ({"measure": "no function"}, "artefact.measure: must be module.function, got 'no function'"),
        ({"colour": 1}, "artefact.colour: unknown key"),
        ({"checks": []}, "artefact.checks: at least one is needed"),
    ],
)
def test_a_fault_of_the_book_is_one_line(tmp_path, change, line):
    assert faults(tmp_path, entry=GOOD_ENTRY | change) == [f"{tmp_path / 'book.yaml'}: {line}"]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"expected": float("nan")}, "expected: must be a number, got nan"),
        ({"expected": True}, "expected: must be a number, got True"),
        ({"kind": "about"}, "kind: must be one of near, at_most, at_least, got 'about'"),
        ({"kind": "near"}, "tolerance: must be a number, got None"),
        ({"coarse": {"expectd": 2}}, "coarse.expectd: unknown key"),
        ({"source": ""}, "source: is missing"),
    ],
)
def test_a_fault_of_a_check_is_one_line(tmp_path, change, line):
    found = faults(tmp_path, entry=GOOD_ENTRY | {"checks": [GOOD_CHECK, GOOD_CHECK | change]})
    assert found == [f"{tmp_path / 'book.yaml'}: artefact.checks.1.{line}"]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"kind": "scan"}, "kind: must be sweep or call, got 'scan'"),
        ({"scene": None}, "scene: a sweep needs one"),
        (
            {"axes": {"box.cells": 1}},
            "axes.box.cells: must be a list of values or a mapping of labels to settings, got 1",
        ),
        ({"axes": {"box.cells": [16, "$(rm)"]}}, "axes.box.cells: '$(rm)' cannot be a name"),
        ({"axes": {"box.cells": [16, 16]}}, "axes: two points are named cells~16"),
        ({"batch": ["step"]}, "batch: 'step' is no axis (cells)"),
        ({"axs": {}}, "unknown key 'axs'"),
        ({"coarse": {"stes": {}}}, "coarse: unknown key 'stes'"),
        ({"call": "a.b"}, "call: a study of kind call needs module.function, another kind none; got 'a.b'"),
    ],
)
def test_a_fault_of_a_study_is_one_line(tmp_path, change, line):
    assert faults(tmp_path, study=GOOD_STUDY | change) == [f"{tmp_path / 'studies' / 's.yaml'}: {line}"]


def test_all_faults_come_at_once(tmp_path):
    assert len(faults(tmp_path, entry=GOOD_ENTRY | {"chapter": None, "caption": "", "measure": None})) == 3


def test_an_unknown_size_or_name_says_what_there_is(tmp_path):
    with pytest.raises(Faults, match="size: must be one of coarse, book, got 'small'"):
        PLAN.book("small")
    with pytest.raises(Faults, match=r"fig_9_9: is not in .*; there are stability_1_54"):
        PLAN.entry("fig_9_9", "coarse")


def test_the_citation_names_software_and_book():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    version = next(line for line in (ROOT / "pyproject.toml").read_text().splitlines() if line.startswith("version"))
    assert version == f'version = "{citation["version"]}"'
    (book,) = citation["references"]
    assert [author["family-names"] for author in book["authors"]] == ["Cottet", "Maitre", "Milcent"]
    assert book["title"] == "Level Set Methods for Fluid-Structure Interaction"
