"""The command: what it prints, what it writes, and that it never answers with a traceback."""

import copy
import errno
import json
import subprocess
import sys
import time
from pathlib import Path

import jsonschema
import pytest
import yaml

from fsiwork import provenance, running
from fsiwork.__main__ import _Log, main
from fsiwork.plan import PROCESS, estimate
from fsiwork.scene import Scene, load, parse

ROOT = Path(__file__).parents[1]
SCENES = ROOT / "configs" / "scenes"
SMALL = {
    "box": {"length": [2.0, 2.0], "cells": 24},
    "fluid": {"viscosity": 0.05},
    "bodies": [
        {
            "kind": "membrane",
            "shape": {"kind": "ellipse", "centre": [1.0, 1.0], "semi_axes": [0.7, 0.5]},
            "energy": {"kind": "linear", "stiffness": 1.0},
            "width": {"cells": 3},
            "coupling": "explicit",
        }
    ],
    "clock": {"end": 0.04, "step": 0.01, "frames": 2},
}


@pytest.fixture(autouse=True)
def untied(monkeypatch):
    """The test process shall not die with its parent."""
    monkeypatch.setattr(provenance, "die_with_parent", lambda: False)


@pytest.fixture
def small(tmp_path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(yaml.safe_dump(SMALL))
    return path


def call(capsys, *arguments) -> tuple[int, str, list[str]]:
    """Exit code, what was printed, lines on stderr."""
    code = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return code, out, err.splitlines()


def test_help_loads_nothing_heavy():
    heavy = "{'numpy', 'numba', 'scipy', 'xarray', 'matplotlib', 'pydantic', 'dask'}"
    code = (
        f"import sys; from fsiwork.__main__ import main; main(['--help']); print('heavy:', {heavy} & set(sys.modules))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "heavy: set()" in out
    for verb in ("check", "plan", "run", "show", "study", "figure", "table", "verify", "export", "schema"):
        assert f"\n  {verb} " in out


def test_check_names_every_fault_in_a_line_and_ends_with_2(capsys, small):
    assert call(capsys, "check", small) == (0, f"{small}: in order\n", [])
    sets = ("--set", "fluid.density=-1", "--set", "clock.frames=0", "--set", "a.b=1", "--set", "bodies.0.width={}")
    code, out, err = call(capsys, "check", small, *sets)
    assert (code, out) == (2, "")
    assert sorted(err) == [
        "a: unknown key; known: box, fluid, motion, bodies, clock, output",
        "bodies.0.width: give either cells or length, got neither",
        "clock.frames: must be at least 1, got 0",
        "fluid.density: must be positive, got -1",
    ]


def test_check_of_several_scenes_says_which(capsys, small, tmp_path):
    (tmp_path / "bad.yaml").write_text("box: [\n")
    code, out, err = call(capsys, "check", small, tmp_path / "bad.yaml", tmp_path / "none.yaml")
    assert (code, out) == (2, f"{small}: in order\n")
    assert len(err) == 2 and "bad.yaml: line 2" in err[0] and err[1].endswith("none.yaml: No such file or directory")


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["rum"], "No such command 'rum'"),
        (["run"], "Missing argument 'SCENE'"),
        (["run", "SMALL"], "Missing option '-o'"),
        (["run", "SMALL", "-o", "x.nc", "--max-seconds", "soon"], "--max-seconds"),
        (["run", "SMALL", "-o", "x.nc", "--threads", "0"], "--threads"),
        (["run", "SMALL", "-o", "x.txt"], "x.txt: the file of a run ends in .nc"),
        (["run", "SMALL", "-o", "x.nc", "--set", "box.cells"], "--set box.cells: write a.b.c=value"),
        (["run", "SMALL", "-o", "x.nc", "--set", "box.cells=[1"], "--set box.cells: line 1, column "),
        (["run", "SMALL", "-o", "x.nc", "--set", "box.cells=99999"], "box.cells: the run needs "),
        (["run", "none.nc", "-o", "x.nc"], "none.nc"),
        (["plan", "SMALL", "--set", "clock.end=no"], "clock.end: must be a number, got 'no'"),
        (["show", "SMALL"], "small.yaml"),
        (["export", "none.nc", "-o", "there"], "none.nc"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_leaves_nothing(capsys, small, monkeypatch, arguments, expected):
    monkeypatch.chdir(small.parent)
    code, out, err = call(capsys, *(str(small) if a == "SMALL" else a for a in arguments))
    assert code in (1, 2) and len(err) == 1 and expected in err[0], (code, err)
    assert "Traceback" not in out
    assert [path.name for path in small.parent.iterdir()] == ["small.yaml"]


def test_run_show_export_and_run_again_from_the_file(capsys, small, tmp_path):
    code, out, _ = call(capsys, "run", small, "-o", tmp_path / "a.nc")
    assert (code, out) == (0, f"{tmp_path / 'a.nc'}: complete\n")
    assert json.loads((tmp_path / "a.cost.json").read_text())["steps"] == 4
    assert call(capsys, "run", tmp_path / "a.nc", "-o", tmp_path / "b.nc", "--quiet")[0] == 0
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()
    code, out, _ = call(capsys, "show", tmp_path / "a.nc")
    assert code == 0 and "complete, 3 frames to t = 0.04" in out
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert call(capsys, "show", tmp_path / "a.nc", "-o", tmp_path / "a.gif")[0] == 0
    assert (tmp_path / "a.gif").read_bytes().startswith(b"GIF8")
    code, _, err = call(capsys, "show", tmp_path / "a.nc", "-o", tmp_path / "a.pdf")
    assert code == 2 and len(err) == 1
    assert call(capsys, "export", tmp_path / "a.nc", "-o", tmp_path / "vtk")[0] == 0
    assert len(list((tmp_path / "vtk").glob("*.vti"))) == 3


def test_a_stopped_run_goes_on_and_gives_the_same_bytes(capsys, small, tmp_path):
    assert call(capsys, "run", small, "-o", tmp_path / "straight.nc")[0] == 0
    parts = tmp_path / "parts.nc"
    code, out, _ = call(capsys, "run", small, "-o", parts, "--max-seconds", 0)
    assert code == 0 and "stopped at t=0" in out and "--resume" in out
    assert not parts.exists()
    assert call(capsys, "run", small, "-o", parts, "--resume")[0] == 0
    assert parts.read_bytes() == (tmp_path / "straight.nc").read_bytes()


def test_a_diverged_run_is_data(capsys, small, tmp_path):
    wild = ("--set", "clock.end=50", "--set", "clock.step=1", "--set", "fluid.viscosity=1e-4")
    code, out, err = call(capsys, "run", small, "-o", tmp_path / "wild.nc", *wild)
    assert (code, err) == (0, [])
    assert "diverged at t=" in out and "exceeds" in out
    code, out, _ = call(capsys, "show", tmp_path / "wild.nc")
    assert code == 0 and "diverged at t=" in out


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (KeyboardInterrupt(), 130, "interrupted"),
        (MemoryError(), 1, "out of memory"),
        (OSError(errno.ENOSPC, "disk full: x.nc, 0.1 MB free, 3 MB needed"), 1, "disk full"),
        (PermissionError(errno.EACCES, "Permission denied", "x.nc"), 1, "x.nc: Permission denied"),
        (RuntimeError("x.nc.frames: another process is writing this run"), 2, "another process"),
    ],
)
def test_what_goes_wrong_during_a_run_is_one_line(capsys, small, tmp_path, monkeypatch, error, code, line):
    def fail(*args, **options):
        raise error

    monkeypatch.setattr(running, "to_file", fail)
    found, _, err = call(capsys, "run", small, "-o", tmp_path / "x.nc")
    assert found == code and len(err) == 1 and line in err[0], err


def test_a_fault_of_the_program_keeps_its_traceback(small, tmp_path, monkeypatch):
    def fail(*args, **options):
        raise ZeroDivisionError

    monkeypatch.setattr(running, "to_file", fail)
    with pytest.raises(ZeroDivisionError):
        main(["run", str(small), "-o", str(tmp_path / "x.nc")])


def test_the_log_says_how_long_it_takes(capsys):
    class Frame:
        t = 0.0

    log = _Log(end=10.0, every=0.0)
    for Frame.t in (0.0, 1.0, 2.0):
        time.sleep(0.02)
        log(Frame)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("t = 2 of 10, ") and lines[0].endswith(" s left")


def test_the_schema_in_the_repository_is_that_of_the_scenes(capsys):
    code, out, _ = call(capsys, "schema")
    assert code == 0 and out == (ROOT / "configs" / "scene.schema.json").read_text(encoding="utf-8")
    schema = json.loads(out)
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for path in SCENES.glob("*.yaml"):
        data = parse(path.read_text())
        assert not list(validator.iter_errors(data)), path
        assert list(validator.iter_errors(data | {"clok": data["clock"]}))


def test_plan_counts_the_steps_and_the_fields():
    plan = estimate(load(SCENES / "elliptic_membrane.yaml"))
    assert (plan.cells, plan.steps) == ((128, 128), 500)
    assert {what: count for what, count, _ in plan.fields}["velocity: now, next, rate"] == 6
    assert ("diffusion", "lines") in [(what, which) for what, which, _ in plan.solvers]
    finer = estimate(load(SCENES / "elliptic_membrane.yaml", {"box.cells": 256, "clock.step": "auto"}))
    assert finer.bytes > plan.bytes and finer.seconds > plan.seconds
    mixed = estimate(load(SCENES / "rising_drop.yaml"))
    assert ("pressure", "multigrid") in [(what, which) for what, which, _ in mixed.solvers]
    parts = [{"shape": {"kind": "disc", "centre": [0.5, y], "radius": 0.1}, "density": 0.1} for y in (0.3, 0.7)]
    bubbles = estimate(load(SCENES / "bubbles.yaml", {"bodies.0.parts": parts, "bodies.0.viscosity": 0.01}))
    assert ("pressure", "multigrid") in [(what, which) for what, which, _ in bubbles.solvers]


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("elliptic_membrane", {}),  # the book's predictor takes the explicit step, Crank-Nicolson damps nothing
        ("elliptic_membrane", {"fluid.diffusion": "backward-euler", "bodies.0.coupling": "stabilised"}),
        ("oscillating_drop", {}),
        ("rising_drop", {}),
        ("bent_membrane", {"bodies.0.coupling": "explicit"}),
        ("bent_membrane", {"bodies.0.dirac": "plain", "bodies.0.stretch": 1.2}),
        ("bubbles", {"bodies.0.tension": 0.5}),
        ("twin", {}),
        ("fibre", {}),
    ],
)
def test_the_planned_step_is_that_of_a_run(name, changes):
    from fsiwork.simulate import build, longest_step

    scene = load(SCENES / f"{name}.yaml", {"box.cells": 32, "clock.step": "auto"} | changes)
    sim = build(scene)
    taken = scene.clock.safety * min(longest_step(sim.flow, sim.bodies).values())
    assert estimate(scene).step == pytest.approx(min(taken, scene.clock.end), rel=0.05)


def test_the_plan_counts_what_a_form_of_the_force_takes():
    settings = {"bodies.0.form": "adjoint", "bodies.0.transport.scheme": "upwind5"}
    usual, adjoint = (estimate(load(SCENES / "elliptic_membrane.yaml", s)) for s in ({}, settings))
    assert sum(count for _, count, _ in adjoint.fields) == sum(count for _, count, _ in usual.fields) + 7


def test_the_planned_time_is_that_of_a_run():
    from fsiwork.simulate import frames

    data = copy.deepcopy(SMALL)
    data["box"]["cells"], data["clock"] = 128, {"end": 0.03, "step": 0.001, "frames": 1}
    scene = Scene.model_validate(data)
    planned = sum(seconds for _, seconds in estimate(scene).stages)
    measured = []
    for _ in range(3):
        run = frames(scene)
        next(run)
        began = time.process_time()
        assert next(run).ended == "complete"
        measured.append(time.process_time() - began)
    assert planned / 4 < min(measured) < 4 * planned, (planned, measured)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads the peak from /proc")
def test_the_planned_memory_is_that_of_a_run(small, tmp_path):
    code = (
        "import sys; from fsiwork.__main__ import main; assert main(sys.argv[1:]) == 0; "
        "print([l.split()[1] for l in open('/proc/self/status') if l.startswith('VmHWM')][0])"
    )
    peaks, planned = [], []
    sets = ["clock.end=0.002", "clock.step=0.001", "clock.frames=1", "bodies.0.coupling=semi-implicit"]
    for cells in (24, 24, 720):  # the first warms the cache of kernels
        settings = [*sets, f"box.cells={cells}"]
        words = ["run", small, "-o", tmp_path / "x.nc", *(word for s in settings for word in ("--set", s))]
        done = subprocess.run([sys.executable, "-c", code, *words], check=True, capture_output=True, text=True)
        peaks.append(1024 * int(done.stdout.split()[-1]))
        planned.append(estimate(load(small, {k: parse(v) for k, v in (s.split("=") for s in settings)})).bytes)
    assert abs(peaks[1] / planned[1] - 1) < 0.4, (peaks, planned, PROCESS)
    assert abs((peaks[2] - peaks[1]) / (planned[2] - planned[1]) - 1) < 0.4, (peaks, planned)


def test_the_public_surface_is_loaded_when_used(tmp_path):
    code = (
        "import sys, fsiwork; assert 'pydantic' not in sys.modules; from fsiwork import Scene, Box; "
        "assert 'numba' not in sys.modules and 'run' in dir(fsiwork)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    import fsiwork

    scene = fsiwork.Scene.model_validate(SMALL)
    ds = fsiwork.run(scene)
    assert ds.attrs["ended"] == "complete" and ds.sizes["t"] == 3
    with fsiwork.run(scene, tmp_path / "run.nc") as kept:
        assert kept.identical(ds)
    with pytest.raises(TimeoutError, match="stopped at t=0"):
        fsiwork.run(scene, tmp_path / "stopped.nc", max_seconds=0.0)
    with pytest.raises(AttributeError, match="no attribute 'walk'"):
        fsiwork.walk  # noqa: B018
