"""``python -m benchmarks [--only NAME …] [--cold] [--readme] [-o FILE]``."""

import argparse
import os
import sys
from pathlib import Path

from fsiwork.provenance import prepare

ROOT = Path(__file__).resolve().parents[1]
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
prepare(threads=1)

from benchmarks import freefem, lengths, poisson, redistancing, rows, stepping, transport, workflow  # noqa: E402  after the threads are set


def suite(results: Path) -> dict:
    """Name → function that gives a row or several."""
    flow, membrane = stepping.flow, stepping.membrane
    return {
        "flow_2d": lambda: stepping.rate("flow_2d", flow(512, 2, "upwind5", "explicit"), ">= 70"),
        "flow_2d_implicit": lambda: stepping.rate("flow_2d_implicit", flow(512, 2, "upwind5", "implicit"), ">= 45"),
        "flow_3d": lambda: stepping.rate("flow_3d", flow(96, 3, "central", "explicit"), ">= 35"),
        "membrane_2d": lambda: stepping.rate("membrane_2d", membrane(512, 2), ">= 20"),
        "poisson_2d": poisson.poisson,
        "geometric_length": lengths.geometric,
        "stage_2d": lambda: stepping.stages("stage_2d", membrane(512, 2)),
        "stage_3d": lambda: stepping.stages("stage_3d", membrane(96, 3)),
        "shear_3d": lambda: stepping.sheared_step("shear_3d", 64),
        "shear_3d_128": lambda: stepping.sheared_step("shear_3d_128", 128),
        "stage_shear": lambda: stepping.stages("stage_shear", stepping.sheared(64)),
        "shear_bytes": stepping.sheared_bytes,
        "python_share": stepping.python_share,
        "allocation": stepping.allocation,
        "workflow_parse": workflow.parse,
        "weno_2d": lambda: transport.rate("weno_2d", "weno5", 256, 2, ">= 250"),
        "weno_3d": lambda: transport.rate("weno_3d", "weno5", 64, 3, ">= 140"),
        "upwind5_2d": lambda: transport.rate("upwind5_2d", "upwind5", 256, 2, ">= 500"),
        "threads": transport.threads,
        "band": transport.band,
        "fmm_full": redistancing.full,
        "fmm_band": redistancing.narrow,
        "fmm_3d": redistancing.space,
        "freefem": lambda: freefem.compare(results),
        "cold_start": workflow.cold_start,
    }


def main(words: list[str] | None = None) -> int:
    """Measure, write, print. A missed mark is a result, not an error."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "results" / "benchmarks.json")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="only these; the other rows of the file stay")
    parser.add_argument("--cold", action="store_true", help="also the cold start (minutes, network)")
    parser.add_argument(
        "--readme", action="store_true", help="put the table of the file into README.md, measure nothing"
    )
    given = parser.parse_args(words)
    if given.readme:
        found = rows.read(given.output)
        if not found:
            parser.error(f"nothing to show: {given.output} is not there; run python -m benchmarks first")
        rows.put_into(ROOT / "README.md", rows.table(found))
        return 0
    benchmarks = suite(given.output.parent)
    if unknown := set(given.only or ()) - set(benchmarks):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; known: {', '.join(benchmarks)}")
    wanted = given.only or [name for name in benchmarks if given.cold or name != "cold_start"]
    before = rows.read(given.output)
    found = before if given.only else [r for r in before if r["benchmark"] == "cold_start"]
    for name in wanted:
        print(f"{name} …", file=sys.stderr, flush=True)
        new = benchmarks[name]()
        found = rows.merged(found, new if isinstance(new, list) else [new])
        rows.write(found, given.output)
    print(rows.table(found))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
