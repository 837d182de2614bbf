"""The benchmarks say what they measured; no time is asserted here."""

import json
import math

import pytest

from benchmarks import __main__ as command
from benchmarks import freefem, poisson, rows, stepping, transport, workflow
from benchmarks.timing import least, triad

KEYS = {"benchmark", "measured", "unit", "against", "reference", "ratio", "mark", "pass", "bandwidth_share"}


def well_formed(row):
    """Keys, kinds, and a verdict that follows from the numbers of the row."""
    assert set(row) >= KEYS
    assert row["benchmark"] and row["unit"]
    assert row["measured"] is None or (row["measured"] > 0 and math.isfinite(row["measured"]))
    if row["ratio"] is not None:
        assert row["ratio"] == pytest.approx(row["measured"] / row["reference"], rel=2e-3)
    assert row["bandwidth_share"] is None or 0 < row["bandwidth_share"] < 2
    assert json.loads(json.dumps(row, allow_nan=False)) == row
    return row


def test_a_row_reaches_its_mark_or_not():
    assert rows.row("a", 71.0, "u", ">= 70")["pass"] is True
    assert rows.row("a", 69.0, "u", ">= 70")["pass"] is False
    assert rows.row("a", 2.0, "u", "ratio <= 0.05", against=("peer", 100.0))["pass"] is True
    assert rows.row("a", 6.0, "u", "ratio <= 0.05", against=("peer", 100.0))["pass"] is False
    assert rows.row("a", 2.0, "u", "ratio <= 0.05", against=("peer", 100.0), besides=False)["pass"] is False
    assert rows.row("a", math.nan, "u", "<= 6")["pass"] is False
    assert rows.row("a", 2.0, "u")["pass"] is None
    assert rows.row("a", None, "u", "<= 6")["pass"] is None


@pytest.mark.parametrize("dim", [2, 3])
def test_flow_and_stages_give_rows(dim):
    well_formed(stepping.rate("flow", stepping.flow(16, dim, "central", "explicit"), ">= 1e-9", seconds=0.01))
    sim = stepping.membrane(16, dim)
    found = stepping.stages("stage", sim, seconds=0.01)
    assert [well_formed(r)["benchmark"] for r in found] == [
        f"stage_{v}" for v in ("push", "predict", "project", "move")
    ]
    assert sum(float(r["note"].split()[0]) for r in found) == pytest.approx(100, abs=3)


@pytest.mark.parametrize("made", [lambda: stepping.membrane(16, 2), lambda: stepping.sheared(16)])
def test_stages_are_the_step(made):
    one, other = made(), made()
    for _ in range(3):
        stepping.step(one.flow, one.bodies, one.dt)
        for verb in stepping.verbs(other).values():
            verb()
    assert (one.flow.u[0] == other.flow.u[0]).all()
    for name, q in one.bodies[0].fields().items():
        assert (q == other.bodies[0].fields()[name]).all()
    assert abs(one.flow.u[0]).max() > 0


def test_a_membrane_with_shear_gives_rows():
    found = well_formed(stepping.sheared_step("shear", 16, seconds=0.01))
    assert "600 steps" in found["note"]
    shares = [well_formed(r) for r in stepping.stages("stage", stepping.sheared(16), seconds=0.01)]
    assert sum(float(r["note"].split()[0]) for r in shares) == pytest.approx(100, abs=3)
    used = well_formed(stepping.sheared_bytes(48))
    assert used["reference"] == 88
    assert 2 < used["ratio"] < 10


def test_poisson_python_and_memory_give_rows():
    assert well_formed(poisson.poisson(32, seconds=0.01))["against"] == "scipy dctn + idctn"
    well_formed(stepping.python_share(64, seconds=0.01))
    largest, total = map(well_formed, stepping.allocation(64))
    assert largest["measured"] <= total["measured"]
    assert largest["pass"] is True


def test_transport_gives_rows():
    for scheme, dim in (("weno5", 2), ("weno5", 3), ("upwind5", 2)):
        assert well_formed(transport.rate("weno", scheme, 16, dim, ">= 1e-9", seconds=0.01))["pass"] is True
    assert well_formed(transport.band(64, seconds=0.01))["mark"] == ">= 5"
    assert well_formed(transport.threads((16, 24)))["note"].count("at ") == 2


def test_watch_sees_a_block(monkeypatch):
    monkeypatch.setattr(stepping, "step", lambda *_: bytearray(50_000))
    assert stepping.allocation(16)[0]["measured"] >= 50_000
    assert stepping.allocation(16)[0]["pass"] is False


def test_least_and_triad():
    calls = []
    found = least({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, seconds=0.0, rounds=3)
    assert calls == ["a", "b"] * 5
    assert set(found) == {"a", "b"} and min(found.values()) > 0
    assert 1e8 < triad(4096) < 1e13


def test_without_freefem_nothing_is_decided(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    found = freefem.compare(tmp_path)
    assert [r["benchmark"] for r in found] == ["freefem", "freefem_kept", "freefem_error"]
    for r in found:
        assert well_formed(r)["pass"] is None
        assert r["note"] == "FreeFEM is not installed"
    assert not list(tmp_path.iterdir())


def test_ours_relaxes_and_the_fine_run_is_kept(monkeypatch, tmp_path):
    run = freefem.ours(freefem.scene(40, 0.01, end=0.1), times=1)
    assert 0.74 < run.axes[0] < 0.75 and 0.5 < run.axes[1] < 0.51
    assert run.seconds > 0
    monkeypatch.setattr(freefem, "ours", lambda what, times: freefem.Run((what.box.n[0] / 512, 0.5), 1.0))
    fine, limit = freefem.finest(tmp_path / "fine.json")
    assert fine == (1.0, 0.5)
    assert limit == pytest.approx((1 + 0.5 / 3, 0.5))
    monkeypatch.setattr(freefem, "ours", None)
    assert freefem.finest(tmp_path / "fine.json") == (fine, limit)


def test_freefem_agrees_with_ours():
    program = next((found for name in freefem.NAMES if (found := freefem.shutil.which(name))), None)
    if program is None:
        pytest.skip("FreeFEM is not installed")
    peer = freefem.theirs(program, cells=20, step=0.02, end=0.1, keep=True)
    mine = freefem.ours(freefem.scene(40, 0.01, end=0.1), times=1)
    assert freefem.deviation(peer.axes, mine.axes) < 0.005
    assert peer.seconds > 0


def test_table_goes_between_the_markers(tmp_path):
    readme = tmp_path / "README.md"
    readme.write_text(f"before\n{rows.BEGIN}\nold\n{rows.END}\nafter\n")
    found = [rows.row("fast", 71.0, "u", ">= 70"), rows.row("gone", None, "u", "<= 6", note="peer is not installed")]
    for _ in range(2):
        rows.put_into(readme, rows.table(found))
        text = readme.read_text()
        assert text.startswith("before\n") and text.endswith("\nafter\n") and "old" not in text
        assert "| `fast` | 71 u | >= 70 |  |  |  | reached |" in text
        assert "| `gone` | – | <= 6 |  |  |  | peer is not installed |" in text
    readme.write_text("nothing\n")
    with pytest.raises(ValueError, match="lacks the markers"):
        rows.put_into(readme, "")


def test_command_writes_and_keeps_rows(monkeypatch, tmp_path, capsys):
    out = tmp_path / "benchmarks.json"
    number = iter(range(1, 9))
    fake = {
        name: lambda name=name: rows.row(name, float(next(number)), "u", ">= 3") for name in ("a", "b", "cold_start")
    }
    monkeypatch.setattr(command, "suite", lambda results: fake)
    assert command.main(["-o", str(out)]) == 0
    assert [(r["benchmark"], r["measured"]) for r in rows.read(out)] == [("a", 1.0), ("b", 2.0)]
    command.main(["-o", str(out), "--only", "a", "cold_start"])
    assert [(r["benchmark"], r["pass"]) for r in rows.read(out)] == [("a", True), ("b", False), ("cold_start", True)]
    assert "**missed**" in capsys.readouterr().out
    with pytest.raises(SystemExit) as stop:
        command.main(["-o", str(out), "--only", "c"])
    assert stop.value.code == 2
    assert "unknown: c; known: a, b" in capsys.readouterr().err


def test_every_mark_of_the_suite_is_named(tmp_path):
    names = {"flow_2d", "flow_2d_implicit", "flow_3d", "membrane_2d", "poisson_2d", "stage_2d", "stage_3d"}
    assert set(command.suite(tmp_path)) == names | {
        "python_share", "allocation", "workflow_parse", "freefem", "cold_start", "fmm_full", "fmm_band", "fmm_3d",
        "shear_3d", "shear_3d_128", "stage_shear", "shear_bytes",
        "weno_2d", "weno_3d", "upwind5_2d", "threads", "band", "geometric_length",
    }  # fmt: skip


def test_workflow_that_does_not_parse_is_said(monkeypatch, tmp_path):
    monkeypatch.setattr(workflow, "ROOT", tmp_path)
    found = well_formed(workflow.parse(times=1))
    assert found["pass"] is None
    assert "failed" in found["note"] or "not installed" in found["note"]
