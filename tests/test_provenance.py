"""Hashes, caches, orphans, costs."""

import ast
import json
import os
import platform
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from fsiwork import provenance, sources

KERNELS = sources.PACKAGE / "core" / "kernels"
SMALL = {
    "core/grid.py": 'def area(h):\n    """Area."""\n    return h * h\n',
    "bodies/body.py": "class Body:\n    pass\n",
    "scene.py": "x = 1\n",
    "specs/base.py": "y = 1\n",
    "simulate.py": "z = 1\n",
    "dataset.py": "w = 1\n",
    "figures/chapter3.py": "SIZE = 3\n\ndef fig_1():\n    return pen(SIZE)\n\ndef fig_2():\n    return 2\n\n"
    "def pen(x):\n    return x\n",
}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A small package instead of fsiwork; returns how to edit it and the hashes of a run, a figure, a chapter."""
    for name, text in SMALL.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(sources, "PACKAGE", tmp_path)

    def edited(name, old, new):
        text = (tmp_path / name).read_text()
        assert old in text
        (tmp_path / name).write_text(text.replace(old, new))
        return hashes()

    def hashes():
        layers = [(), ("figures.chapter3:fig_1",), ("figures",)]
        return tuple(sources.source_hash(*layer) for layer in layers)

    return edited, hashes()


def test_code_changes_a_hash_words_do_not(package):
    edited, before = package
    assert edited("core/grid.py", '"""Area."""', '"""Area of a square [length²]."""  # new') == before
    assert edited("core/grid.py", '    """Area of a square [length²]."""  # new\n', "") == before
    assert edited("core/grid.py", "h * h", "h * h * 1.0")[0] != before[0]
    assert edited("core/grid.py", "h * h * 1.0", "(h  *  h)") == before
    assert edited("specs/base.py", "y = 1", "y = 2")[0] != before[0]


def test_a_figure_changes_only_what_is_drawn(package):
    edited, (run, figure, chapter) = package
    after = edited("figures/chapter3.py", "return 2", "return 3")
    assert after[:2] == (run, figure) and after[2] != chapter
    assert edited("figures/chapter3.py", "return x", "return x + 1")[1] != figure
    assert edited("figures/chapter3.py", "return x + 1", "return x")[1] == figure
    assert edited("figures/chapter3.py", "SIZE = 3", "SIZE = 4")[1] != figure


def test_versions_belong_to_the_hash_of_a_run(monkeypatch):
    before = sources.source_hash(), sources.source_hash("dataset")
    monkeypatch.setattr(sources, "versions", lambda *_: {"numba": "0.0"})
    assert sources.source_hash() != before[0]
    assert sources.source_hash("dataset") == before[1]


def test_unknown_layer_or_function_is_refused():
    with pytest.raises(FileNotFoundError, match="no layer 'cores'"):
        sources.source_hash("cores")
    with pytest.raises(FileNotFoundError, match="no function 'grow'"):
        sources.source_hash("provenance:grow")


def test_the_hash_of_a_run_covers_all_that_a_run_imports():
    root = sources.PACKAGE
    covered = {file for layer in sources.RUN for file in sources._files(layer)}
    exempt = {root / "provenance.py", root / "sources.py", root / "joining.py"}  # words about a run, not its numbers
    waiting, seen = [root / "simulate.py", root / "dataset.py"], {root / "__init__.py"}  # it imports when asked
    while waiting:
        file = waiting.pop()
        if file in seen or not file.is_file():
            continue
        seen.add(file)
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module, *(f"{node.module}.{a.name}" for a in node.names)]
            for name in names:
                if name.split(".")[0] == "fsiwork":
                    place = root.joinpath(*name.split(".")[1:])
                    waiting += [place.with_suffix(".py"), place / "__init__.py"]
    assert len(seen) > 10
    assert seen - exempt - {root / "__init__.py"} <= covered


def test_scene_id_sees_values_not_their_order():
    assert sources.scene_id('{"a": 1, "b": [2]}') == sources.scene_id({"b": [2], "a": 1})
    assert sources.scene_id({"a": 1}) != sources.scene_id({"a": 2})


def test_light_import():
    look = "sorted({'numpy', 'numba', 'xarray'} & set(sys.modules))"
    code = f"import sys, fsiwork.provenance, fsiwork.sources as p; p.source_hash(); print({look})"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


@pytest.mark.parametrize("damage", ["", "[1, 2]", "{", None])
def test_hashes_kept_on_disk_are_those_of_the_sources(tmp_path, damage):
    """Whatever lies there; and a later process writes what it had to parse."""
    package = tmp_path / "package"
    for name in ("scene.py", "specs/base.py"):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(SMALL[name])
    code = f"""
        from pathlib import Path
        from fsiwork import sources
        sources.PACKAGE = Path({str(package)!r})
        print(sources.source_hash("scene"))
        """
    kept = package.parent / ".cache" / f"sources-{platform.python_version()}.json"
    (package.parent / "pyproject.toml").touch()
    if damage is not None:
        kept.parent.mkdir(exist_ok=True)
        kept.write_text(damage)

    def run():
        words = [sys.executable, "-c", textwrap.dedent(code)]
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout

    first = run()
    assert len(json.loads(kept.read_text())) == 2
    assert run() == first
    (package / "scene.py").write_text("x = 2\n")
    assert run() != first
    assert len(json.loads(kept.read_text())) == 2


def test_prepare_sets_threads_and_an_own_cache():
    code = """
        from fsiwork import provenance
        folder = provenance.prepare(threads=1)
        import numba
        print(numba.config.NUMBA_NUM_THREADS, numba.config.CACHE_DIR == str(folder), folder.name)
        """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["1", "True", sources.source_hash(*sources.shared(KERNELS))]


def test_every_kernel_that_another_file_calls_counts_for_the_cache():
    """A jitted function used outside its file must be in a `shared` one, or an edit of it would go unnoticed."""
    names = sources.shared(KERNELS)
    assert {"core.kernels.__init__", "core.kernels.membrane"} <= set(names)
    for file in sources.PACKAGE.rglob("*.py"):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        jitted = any(
            isinstance(node, ast.FunctionDef) and {"loop", "point", "njit"} & _decorators(node) for node in tree.body
        )
        for node in ast.walk(tree) if jitted else ():
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("fsiwork.core.kernels."):
                assert node.module.removeprefix("fsiwork.") in names, f"{file}: calls kernels of {node.module}"


def _decorators(function):
    return {name.id for d in function.decorator_list for name in ast.walk(d) if isinstance(name, ast.Name)}


KERNEL = """
    import sys
    from numba import njit
    from fsiwork import provenance

    @njit(cache=True)
    def twice(x):
        return 2 * x

    print(provenance.with_healed_cache(lambda: twice(21)) if "--heal" in sys.argv else twice(21))
    """


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
def test_a_damaged_cache_heals(tmp_path, ending):
    script, cache = tmp_path / "kernel.py", tmp_path / "cache"
    script.write_text(textwrap.dedent(KERNEL))

    def run(*words):
        environment = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
        return subprocess.run([sys.executable, script, *words], capture_output=True, text=True, env=environment)

    assert run().stdout == "42\n"
    for file in cache.rglob(f"*.{ending}"):
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    assert run().returncode != 0
    assert run("--heal").stdout == "42\n"
    assert run().stdout == "42\n"


def test_other_faults_leave_the_cache_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    tries = []

    def action():
        tries.append(1)
        raise EOFError("of something else")

    with pytest.raises(EOFError):
        provenance.with_healed_cache(action)
    assert tmp_path.is_dir() and tries == [1]


CHILD = """
    import pathlib, sys, os, time
    from fsiwork import provenance
    tied = provenance.die_with_parent(poll=0.05)
    pathlib.Path(sys.argv[1]).write_text(f"{os.getpid()} {tied}")
    time.sleep(30)
    """


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_for(condition, seconds=15.0):
    limit = time.monotonic() + seconds
    while not condition() and time.monotonic() < limit:
        time.sleep(0.02)
    return condition()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux tells a child of its parent's death")
@pytest.mark.parametrize("shell", [False, True], ids=["directly", "through a shell"])
def test_no_orphan_survives_its_parent(tmp_path, shell):
    script, note = tmp_path / "child.py", tmp_path / "note"
    script.write_text(textwrap.dedent(CHILD))
    words = [sys.executable, str(script), str(note)]
    if shell:
        words = ["/bin/sh", "-c", f"'{words[0]}' '{words[1]}' '{words[2]}'; true"]
    parent = subprocess.Popen([sys.executable, "-c", f"import subprocess; subprocess.call({words!r})"])
    assert wait_for(lambda: note.exists() and note.read_text().endswith("True"))
    child = int(note.read_text().split()[0])
    assert alive(child)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    assert wait_for(lambda: not alive(child))


def test_cost_is_recorded_beside_the_run(tmp_path):
    cost = provenance.Cost(seconds=100.0, cpu_seconds=50.0)
    cost.write(tmp_path / "run.nc", cells=1000, steps=20)
    record = json.loads((tmp_path / "run.cost.json").read_text())
    assert 100.0 <= record["seconds"] < 130.0 and 50.0 <= record["cpu_seconds"] < 80.0
    assert record["cell_steps_per_second"] == pytest.approx(20000 / record["cpu_seconds"], rel=0.1)
    assert record["peak_memory_bytes"] > 1e6 and record["threads"] == 1 and record["machine"]
    assert os.listdir(tmp_path) == ["run.cost.json"]
