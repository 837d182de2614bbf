"""Checks can fail: a sign turned round in one kernel, and an artefact of the book turns red.

The artefacts are the book's own: their studies, measures and checks from configs/, with fewer points on smaller grids.
"""

import inspect
from importlib import import_module
from pathlib import Path

import pytest
import yaml
from numba import njit

from fsiwork.core.kernels import FASTMATH
from fsiwork.studies import jobs, scorecard
from fsiwork.targets import Plan

CONFIGS = Path(__file__).resolve().parents[1] / "configs"

# Per artefact: what makes its studies small enough for a test (merged into the study), and its checks that must be
# green at that size; the others want the book's grids.
SMALL = {
    "stability_1_54": {
        "stability_spectral": {"axes": {"viscosity": [0.1], "tension": [10.0], "width": [1.5]}},
        "stability_stepping": {"axes": {"viscosity": [0.0, 1.0], "tension": [1.0], "width": [1.5]}},
        "stability_schemes": {},
        "stability_drop": {
            "axes": {"bodies.0.width.cells": [3], "fluid.viscosity": [0.02]},
            "coarse": {"set": {"box.cells": 32}, "args": {"horizon": 0.5}},
        },
    },
    "taylor_green": {
        "taylor_green_space": {"coarse": {"set": {"clock.step": 0.002, "clock.end": 0.1}}},
        "taylor_green_time": {
            "args": {"finest": 0.0015625},
            "coarse": {"set": {"box.cells": 16}, "axes": {"clock.step": [0.1, 0.05, 0.025]}},
        },
    },
    "zalesak": {
        "zalesak": {
            "axes": {
                "carried": {
                    "redistanced": {"clock.step": "auto"},
                    "map": {
                        "bodies.0.transport": {"scheme": "upwind5", "carry": "map"},
                        "bodies.0.redistance": None,
                        "clock.step": 0.2,
                    },
                },
                "box.cells": [100],
            },
        },
    },
    "fig_3_11": {
        "membrane_large_step": {"coarse": {"set": {"clock.end": 4.0}, "axes": {"box.cells": [64]}}},
    },
}

# (artefact, kernel, what stands there, the wrong sign, metrics that have to notice)
FLIPS = [
    ("stability_1_54", "studies.linear.march", "(u[i] + gain", "(u[i] - gain", "stepping_excess_min"),
    ("stability_1_54", "core.kernels.membrane.pull_balanced", "q[i] -= 0.5", "q[i] += 0.5", "drop_ratio_min"),
    ("taylor_green", "core.kernels.flow.momentum_central_2d", "- adv * (", "+ adv * (", "order_space_p"),
    ("taylor_green", "core.kernels.flow.momentum_central_2d", "- dp * (", "+ dp * (", "order_time_u"),
    ("zalesak", "core.kernels.transport.row2+upwind5_2d", "v0[i] + v1[i]", "v0[i] - v1[i]", "map_map_100"),
    ("zalesak", "core.kernels.transport.row2+weno5_2d", "v0[i] + v1[i]", "v0[i] - v1[i]", "volume_redistanced_100"),
    ("fig_3_11", "core.kernels.membrane.add_normal", "q[i] += k", "q[i] -= k", "axis_error"),
]  # fmt: skip


def plan(folder, artefact):
    """The book of one artefact with its small studies."""
    entry = yaml.safe_load((CONFIGS / "book.yaml").read_text(encoding="utf-8"))[artefact]
    (folder / "studies").mkdir(parents=True)
    (folder / "scenes").symlink_to(CONFIGS / "scenes")
    (folder / "book.yaml").write_text(yaml.safe_dump({artefact: entry}))
    for name in entry["studies"]:
        study = yaml.safe_load((CONFIGS / "studies" / f"{name}.yaml").read_text(encoding="utf-8"))
        for key, value in SMALL[artefact][name].items():
            study[key] = {**study.get(key, {}), **value} if key == "args" else value
        (folder / "studies" / f"{name}.yaml").write_text(yaml.safe_dump(study))
    return Plan(folder, folder / "results")


def colours(folder, artefact):
    """Whether each check of the artefact passes, computed from its scenes on."""
    made = plan(folder, artefact)
    for study in made.studies("coarse"):
        for job in study.batches:
            jobs.compute(made, study, job, "coarse")
        jobs.join(made, study, "coarse")
    found = scorecard.measure(made, made.entry(artefact, "coarse"), "coarse")
    return {row["metric"]: row["pass"] for row in found["rows"]}


def flipped(monkeypatch, kernel, old, new):
    """Put a kernel with another sign, compiled anew from its source, in the place of the right one; "part+kernel" where
    the sign is in a part that the compiler puts into the kernel."""
    place, _, names = kernel.rpartition(".")
    module, names = import_module(f"fsiwork.{place}"), names.split("+")
    source = "\n\n".join(inspect.getsource(getattr(module, name).py_func) for name in names)
    assert source.count(old) == 1
    space = vars(module) | {"loop": njit(parallel=True, error_model="numpy", fastmath=FASTMATH)}  # kept in no cache
    exec(compile(source.replace(old, new), f"<{names[-1]} with the wrong sign>", "exec"), space)
    for name in names:
        monkeypatch.setattr(module, name, space[name])


@pytest.fixture(scope="module")
def untouched(tmp_path_factory):
    """Colours of an artefact with the right signs, computed once."""
    known = {}

    def of(artefact):
        if artefact not in known:
            known[artefact] = colours(tmp_path_factory.mktemp("right") / "configs", artefact)
        return known[artefact]

    return of


@pytest.mark.parametrize(
    ("artefact", "kernel", "old", "new", "metric"), FLIPS, ids=[f"{one[0]} {one[-1]}" for one in FLIPS]
)
def test_a_wrong_sign_turns_its_artefact_red(artefact, kernel, old, new, metric, untouched, tmp_path, monkeypatch):
    assert untouched(artefact)[metric]
    flipped(monkeypatch, kernel, old, new)
    assert not colours(tmp_path / "configs", artefact)[metric]


@pytest.mark.parametrize("artefact", sorted(SMALL))
def test_with_the_right_signs_the_small_artefact_is_green(artefact, untouched):
    """But for the checks that are known to fail and say why."""
    entry = yaml.safe_load((CONFIGS / "book.yaml").read_text(encoding="utf-8"))[artefact]
    known = {check["metric"] for check in entry["checks"] if "why" in check}
    assert all(green for metric, green in untouched(artefact).items() if metric not in known), untouched(artefact)
