"""The workflow: what parsing it costs, and how long the way is from a clone to a first figure."""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.rows import Row, row

ROOT = Path(__file__).resolve().parents[1]


def parse(times: int = 5) -> Row:
    """Least CPU time of ``snakemake -n`` on the coarse book."""
    unit, mark = "s of CPU", "<= 3"
    if subprocess.run([sys.executable, "-c", "import snakemake"], capture_output=True).returncode:
        return row("workflow_parse", None, unit, mark, note="snakemake is not installed")
    words = [sys.executable, "-m", "snakemake", "-n", "--quiet", "all", "--cores", "1", "--config", "size=coarse", "--"]
    took = []
    for _ in range(times):
        before = os.times()
        done = subprocess.run([*words, "all"], cwd=ROOT, capture_output=True, text=True)
        after = os.times()
        if done.returncode:
            last = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()[-1]
            return row("workflow_parse", None, unit, mark, note=f"snakemake -n failed: {last[:100]}")
        took.append(after.children_user - before.children_user + after.children_system - before.children_system)
    return row("workflow_parse", min(took), unit, mark, note="snakemake -n")


def cold_start(figure: str = "stability_1_54") -> Row:
    """Wall time from a clone, without environment and caches, to a figure of the coarse book. Needs a network."""
    unit = "s of wall clock"
    if not (shutil.which("git") and shutil.which("make")):
        return row("cold_start", None, unit, note="git or make is not installed")
    folder = Path(tempfile.mkdtemp(prefix="cold-"))
    began = time.monotonic()
    try:
        clone = folder / "clone"
        script = (
            ["git", "clone", "--quiet", str(ROOT), str(clone)],
            ["make", "--no-print-directory", "-C", str(clone), ".venv/.ready"],
            [str(clone / ".venv/bin/snakemake"), "-d", str(clone), "-s", str(clone / "Snakefile"), "--cores", "all",
             "--config", "size=coarse", "--", figure],
        )  # fmt: skip
        mine = ("NUMBA_", "MAKE", "MFLAGS", "VIRTUAL_ENV")  # what would lead the clone to this checkout
        env = {k: v for k, v in os.environ.items() if not k.startswith(mine)} | {"PIP_NO_CACHE_DIR": "1"}
        ready = 0.0
        for words in script:
            done = subprocess.run(words, cwd=folder, capture_output=True, text=True, env=env)
            if done.returncode:
                return row("cold_start", None, unit, note=f"{Path(words[0]).name} failed")
            if words[0] == "make":
                ready = time.monotonic() - began
        note = f"clone to {figure}, of it {ready:.0f} s until everything is installed"
        return row("cold_start", time.monotonic() - began, unit, note=note)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
