"""Every setting of every shipped scene with bad values: one line a fault with its path, and never anything else."""

from pathlib import Path

import pytest

from fsiwork.scene import SceneError, load

SCENES = sorted((Path(__file__).resolve().parents[1] / "configs" / "scenes").glob("*.yaml"))
BAD = ("x", -1, 0, float("nan"), float("inf"), 1e300, True, None, [], [1.0], ["a", "b", "c"], {}, {"kind": "typo"})


def paths(value, before=""):
    """Dotted paths to all settings, the ones in between too."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield f"{before}{key}"
        yield from paths(inner, f"{before}{key}.")


@pytest.mark.parametrize("path", SCENES, ids=lambda p: p.stem)
def test_any_bad_setting_is_answered_in_lines(path):
    refused = 0
    for place in paths(load(path).model_dump(mode="json")):
        for value in BAD:
            try:
                load(path, {place: value})
            except SceneError as error:
                refused += 1
                assert all(line.isprintable() and ": " in line for line in error.faults), (place, value, error.faults)
    assert refused > 100


@pytest.mark.parametrize(
    ("scene", "place", "value", "line"),
    [
        ("fibre", "bodies.0.shape.root", [1.0, 2.0], "bodies.0.shape.root: must have 3 numbers, got 2"),
        ("bubbles", "bodies.0.keep_volume", "maybe", "bodies.0.keep_volume: must be true or false, got 'maybe'"),
        ("bubbles", "bodies.0.film", -1, "bodies.0.film: must not be negative, got -1"),
        ("twin", "bodies.0.spacing", 0, "bodies.0.spacing: must be positive, got 0"),
        ("bent_membrane", "bodies.0.bending", float("nan"), "bodies.0.bending: must be finite, got nan"),
        ("blob", "motion.period", -2, "motion.period: must be positive, got -2"),
        ("sheared_sphere", "bodies.0.inflation", 0, "bodies.0.inflation: must be positive, got 0"),
        ("ring", "bodies.0.shape.radius", -1, "bodies.0.shape.radius: must be positive, got -1"),
    ],
)
def test_new_settings_name_the_fault(scene, place, value, line):
    path = next(path for path in SCENES if path.stem == scene)
    with pytest.raises(SceneError) as caught:
        load(path, {place: value})
    assert caught.value.faults == [line]
