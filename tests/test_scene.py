"""Scenes: what is right is kept as it is, what is wrong is named with its path, one line each, all at once."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from fsiwork.scene import Ball, Box, Clock, Fluid, Membrane, Moved, Scene, SceneError, Width, faults, load, loads

SCENES = sorted((Path(__file__).parents[1] / "configs" / "scenes").glob("*.yaml"))
GOOD = {
    "box": {"length": [2.0, 2.0], "cells": 64, "edges": "walls"},
    "fluid": {"density": 1.0, "viscosity": 0.1},
    "bodies": [
        {
            "kind": "membrane",
            "shape": {"kind": "ellipse", "centre": [1.0, 1.0], "semi_axes": [0.75, 0.5]},
            "stretch": 1.2625,
            "energy": {"kind": "quadratic", "stiffness": 10},
            "width": {"cells": 3},
            "inside": {"density": 2.0, "viscosity": 0.2},
            "transport": {"carry": "map"},
        }
    ],
    "clock": {"end": 4.0, "step": 0.008, "frames": 40},
    "output": {"fields": ["u", "p", "Y"]},
}


def put(path: str, value, data=None):
    """A copy of a scene with one value replaced; `...` removes the key."""
    data = copy.deepcopy(GOOD if data is None else data)
    *parents, last = [int(k) if k.isdecimal() else k for k in path.split(".")]
    place = data
    for key in parents:
        place = place[key]
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return data


def lines(data) -> list[str]:
    """Faults of a scene given as data; none when it is right."""
    try:
        Scene.model_validate(data)
    except ValidationError as error:
        return faults(error)
    return []


def places(data, path=()):
    """All dotted paths of a nested structure."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield ".".join(map(str, (*path, key)))
        yield from places(value, (*path, key))


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_every_scene_is_right_and_comes_back_from_its_json(path):
    scene = load(path)
    assert loads(scene.model_dump_json()) == scene
    assert Scene.model_validate(yaml.safe_load(yaml.safe_dump(json.loads(scene.model_dump_json())))) == scene
    assert path.read_text().startswith("#"), "the first line says where the scene comes from"


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        ("fluid.density", -1, "fluid.density: must be positive, got -1"),
        ("fluid.density", float("nan"), "fluid.density: must be finite, got nan"),
        ("fluid.viscosity", -0.1, "fluid.viscosity: must not be negative, got -0.1"),
        ("fluid.viscosity", "thick", "fluid.viscosity: must be a number, got 'thick'"),
        ("fluid.viscosity", True, "fluid.viscosity: must be a number, got True"),
        ("fluid.viscosity", ..., "fluid.viscosity: is required"),
        ("fluid.densty", 1.0, "fluid.densty: unknown key; did you mean density?"),
        ("fluid.gravity", [0, 0, 1], "fluid.gravity: must have 2 numbers, got 3"),
        ("fluid.initial", "taylor-green", "fluid.initial: vortices need periodic or free-slip sides along x and y"),
        ("fluid", 3, "fluid: must be a mapping, got 3"),
        ("box.cells", 63.5, "box.cells: must be a whole number, got 63.5"),
        ("box.cells", 2, "box.cells: must be at least 4, got 2"),
        ("box.cells", 10**400, "box.cells: is too large, got 1000"),
        ("box.length", [2.0, 1.99], "box.length.1: cells are square (side 0.03125): must be a whole number"),
        ("box.length", [2.0], "box.length: must have at least 2 items, got [2.0]"),
        ("box.origin", [0.0, 0.0, 0.0], "box.origin: must have 2 numbers, got 3"),
        ("box.edges", "wals", "box.edges: must be one of walls, periodic, free-slip, or a mapping of x, y (z); got 'w"),
        ("box.edges", {"x": "walls", "y": "no-slip"}, "box.edges.x.0: must be one of periodic, no-slip, free-slip"),
        ("box.edges", {"x": "no-slip"}, "box.edges.y: is required"),
        ("box.edges", {"x": "no-slip", "y": "no-slip", "z": "periodic"}, "box.edges.z: the box has two directions"),
        (
            "box.edges",
            {"x": ["periodic", "no-slip"], "y": "no-slip"},
            "box.edges.x: both sides are periodic or none, got periodic and no-slip",
        ),
        (
            "box.edges",
            {"x": "no-slip", "y": {"kind": "wall", "velocity": [1, 2]}},
            "box.edges.y.0.velocity: a wall moves in its own plane: component y must be 0, got 2.0",
        ),
        (
            "box.edges",
            {"x": [{"kind": "inflow", "velocity": [-1, 0]}, "outflow"], "y": "no-slip"},
            "box.edges.x.0.velocity: an inflow points into the box: component x has the wrong sign, got -1.0",
        ),
        ("box.edges", {"x": ["no-slip", "outflow"], "y": "no-slip"}, "box.edges.x.1: an outflow needs an inflow"),
        (
            "box.edges",
            {"x": [{"kind": "inflow", "velocity": [1, 0]}, "no-slip"], "y": "no-slip"},
            "box.edges.x.0: an inflow needs an outflow",
        ),
        ("bodies.0.kind", "jelly", "bodies.0.kind: must be one of membrane, "),
        ("bodies.0.energy", {"kind": "quadratic"}, "bodies.0.energy.stiffness: is required"),
        ("bodies.0.energy.kind", "cubic", "bodies.0.energy.kind: must be one of quadratic, linear, got 'cubic'"),
        ("bodies.0.stretch", 0, "bodies.0.stretch: must be positive, got 0"),
        ("bodies.0.width", {"cells": 3, "length": 0.1}, "bodies.0.width: give either cells or length, got both"),
        ("bodies.0.width", {}, "bodies.0.width: give either cells or length, got neither"),
        ("bodies.0.width", {"length": 0.01}, "bodies.0.width.length: ε = 0.01 is below the grid step 0.03125"),
        (
            "bodies.0.shape.centre",
            [1.0, 1.6],
            "bodies.0.shape: leaves the box along y: [1.1, 2.1] is not inside [0, 2]",
        ),
        ("bodies.0.shape.centre", [1.0], "bodies.0.shape.centre: must have 2 numbers, got 1"),
        ("bodies.0.shape.kind", "egg", "bodies.0.shape.kind: must be one of ball, disc, ellipsoid"),
        (
            "bodies.0.shape",
            {"kind": "torus", "centre": [0, 0, 0], "radius": 1, "tube": 0.1},
            "bodies.0.shape.kind: a torus has 3 directions, the box 2",
        ),
        ("bodies.0.shape", {"kind": "union", "parts": []}, "bodies.0.shape.parts: must have at least 1 items, got []"),
        (
            "bodies.0.shape",
            {"kind": "minus", "shape": {"kind": "disc", "centre": [1, 1], "radius": 0.5}, "cut": {"kind": "disc"}},
            "bodies.0.shape.cut.centre: is required",
        ),
        ("clock.step", 5.0, "clock.step: must not exceed the end 4.0, got 5.0"),
        ("clock.step", -1, "clock.step: must be positive, got -1"),
        ("clock.step", "fast", "clock.step: must be a number or auto, got 'fast'"),
        ("clock.frames", 0, "clock.frames: must be at least 1, got 0"),
        (
            "output.fields",
            ["u", "q"],
            "output.fields.1: must be one of u, v, w, p, phi, rho, mu, vorticity or Y, got 'q'",
        ),
        ("output.fields", ["w"], "output.fields.0: w: the box has two directions"),
        ("bodies.0.transport.carry", "field", "output.fields.2: Y: no body has transport.carry: map"),
    ],
)
def test_a_fault_has_one_line_with_its_path(path, value, expected):
    found = lines(put(path, value))
    assert any(line.startswith(expected) for line in found), found


def test_a_number_too_long_to_print_is_one_line():
    found = lines(put("box.cells", 10**5000))
    assert found == ["box.cells: is too large, got something that cannot be printed (int)"]


def test_all_faults_come_at_once_those_between_fields_included():
    data = put("fluid.density", -1)
    data["box"]["length"] = [2.0, 2.0, 2.0]
    data["box"]["edges"] = {"x": "periodic", "y": "no-slip", "z": ["no-slip", {"kind": "wall", "velocity": [0, 1, 1]}]}
    data["bodies"][0]["energy"] = {"kind": "linear"}
    data["bodies"][0]["width"] = {"cells": 0.5}
    data["bodies"].append({"kind": "membrane"})
    data["clock"] = {"end": 1.0, "step": 2.0, "frames": -1}
    assert {line.split(":")[0] for line in lines(data)} == {
        "box.edges.z.1.velocity",
        "fluid.density",
        "bodies.0.energy.stiffness",
        "bodies.0.shape.centre",
        "bodies.0.shape.semi_axes",
        "bodies.0.width.cells",
        "bodies.1.shape",
        "bodies.1.energy",
        "bodies.1.width",
        "clock.step",
        "clock.frames",
    }


def test_numbers_of_yaml_are_numbers():
    text = yaml.safe_dump(put("clock.step", 0.001)).replace("step: 0.001", "step: 1e-3")
    assert yaml.safe_load(text)["clock"]["step"] == "1e-3", "the trap of YAML 1.1"
    assert loads(text).clock.step == 1e-3
    assert Scene.model_validate(put("clock.step", "1e-3")).clock.step == 1e-3


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "scene.yaml: empty"),
        ("# nothing\n", "scene.yaml: empty"),
        ("- 1\n- 2\n", "scene.yaml: must be a mapping with box, fluid, bodies, clock; got [1, 2]"),
        ("box: {length: [1, 1\nfluid: 3", "scene.yaml: line 2, column "),
        ("box: 1\nbox: 2\n", "scene.yaml: line 2, column 1: 'box' comes twice"),
        ("fluid: !!python/object:os.system {}", "scene.yaml: line 1, column 8: could not determine a constructor"),
        ("{1: 2, [3]: 4}", "scene.yaml: line 1, column 8: a key must be a word"),
        ("a: *b", "scene.yaml: line 1, column 4: found undefined alias 'b'"),
        ("[" * 5000, "scene.yaml: nested too deeply"),
        ("box: \x00", "scene.yaml: unacceptable character"),
        ("bodies: &a [*a]", "bodies.0: must be a mapping with a kind"),
    ],
)
def test_a_broken_file_is_one_line(tmp_path, text, expected):
    path = tmp_path / "scene.yaml"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        load(path)
    assert any(expected in line for line in caught.value.faults), caught.value.faults
    assert all("\n" not in line for line in caught.value.faults)


def test_a_file_that_cannot_be_read_is_one_line(tmp_path):
    for path, expected in ((tmp_path / "none.yaml", "No such file"), (tmp_path, "Is a directory")):
        with pytest.raises(SceneError, match=expected):
            load(path)
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(SceneError, match="not a text file"):
        load(tmp_path / "binary")


def test_overrides_reach_every_value_and_an_unknown_path_is_a_fault(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(yaml.safe_dump(GOOD))
    scene = load(path, {"box.cells": 128, "bodies.0.energy.stiffness": "3e0", "bodies.0.width": {"length": 0.1}})
    assert (scene.box.n, scene.bodies[0].energy.stiffness) == ((128, 128), 3.0)
    assert scene.bodies[0].width.of(scene.box.h) == 0.1
    assert load(path, {"output.dtype": "float32"}).output.dtype == "float32"
    wrong = {"bodies.3.stretch": 1, "fluid.densty": 1, "box.edges.x": "periodic", "": 1, "clock.end": -1}
    with pytest.raises(SceneError) as caught:
        load(path, wrong)
    expected = (
        "bodies.3: unknown path",
        "fluid.densty: unknown key",
        "box.edges.x: unknown path",
        "'': not",
        "clock.end",
    )
    for start in expected:
        assert any(line.startswith(start) for line in caught.value.faults), start


def test_a_law_written_in_python_is_kept_and_named():
    class Cubic:
        def E(self, s):
            return (s - 1) ** 3

        def dE(self, s):
            return 3 * (s - 1) ** 2

        def ddE(self, s):
            return 6 * (s - 1)

    law = Cubic()
    body = Membrane(shape=Ball(centre=(0.5, 0.5), radius=0.2), energy=law, width=Width(cells=3))
    scene = Scene(
        box=Box(length=(1, 1), cells=16), fluid=Fluid(viscosity=1), bodies=(body,), clock=Clock(end=1, step=0.1)
    )
    assert scene.bodies[0].energy is law
    with pytest.raises(SceneError, match=r"bodies\.0\.energy: the law .*test_scene.* was written in Python"):
        loads(scene.model_dump_json())


def test_a_scene_is_frozen_data():
    scene = Scene.model_validate(GOOD)
    with pytest.raises(ValidationError, match="frozen"):
        scene.clock.end = 3.0
    assert hash(scene) == hash(Scene.model_validate(GOOD))
    assert scene.model_dump() == Scene.model_validate(scene.model_dump()).model_dump()


@settings(max_examples=200, deadline=None)
@given(angle=st.floats(-7, 7), semi=st.tuples(st.floats(0.1, 2), st.floats(0.1, 2)), shift=st.floats(-3, 3))
def test_the_bounds_of_a_turned_ellipse_are_those_of_its_points(angle, semi, shift):
    inner = {"kind": "ellipse", "centre": [0.3, -0.2], "semi_axes": semi}
    low_high = np.array(Moved(shape=inner, shift=(shift, 1.0), angle=angle).bounds(2))
    t = np.linspace(0, 2 * np.pi, 4001)
    x, y = 0.3 + semi[0] * np.cos(t), -0.2 + semi[1] * np.sin(t)
    points = np.array([np.cos(angle) * x - np.sin(angle) * y + shift, np.sin(angle) * x + np.cos(angle) * y + 1.0])
    assert np.allclose(low_high, np.stack([points.min(axis=1), points.max(axis=1)], axis=1), atol=1e-5)


WORDS = st.sampled_from(
    ["walls", "periodic", "no-slip", "auto", "kind", "membrane", "quadratic", "1e-3", "nan", "\n", ""]
)
NUMBERS = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True), st.integers(), st.sampled_from([10**400, 0, -1, 1e308, 1e-308])
)
LEAVES = st.one_of(st.none(), st.booleans(), NUMBERS, WORDS, st.text(max_size=5), st.binary(max_size=3))
TREES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS | st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)
BASES = [GOOD, *(yaml.safe_load(path.read_text()) for path in SCENES)]


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_bad_values_give_lines_with_paths_never_a_traceback(data):
    scene = copy.deepcopy(data.draw(st.sampled_from(BASES)))
    for _ in range(data.draw(st.integers(1, 3))):
        path = data.draw(st.sampled_from(sorted(places(scene))))
        change = data.draw(st.sampled_from(["replace", "remove", "add"]))
        if change == "add":
            path = f"{path}.stray"
        try:
            scene = put(path, ... if change == "remove" else data.draw(TREES), scene)
        except (TypeError, IndexError, KeyError):
            continue
    for line in lines(scene):
        path, colon, text = line.partition(": ")
        assert colon and text.strip() and line.isprintable(), line
        assert path == "scene" or path.split(".")[0] in (*Scene.model_fields, "stray"), line
        assert len(line) < 400, line


numbers = st.floats(1e-3, 1e3)
shapes = st.one_of(
    st.builds(lambda r: {"kind": "disc", "centre": [1.0, 1.0], "radius": r}, st.floats(0.1, 0.9)),
    st.builds(
        lambda a, b: {"kind": "ellipse", "centre": [1.0, 1.0], "semi_axes": [a, b]},
        st.floats(0.1, 1),
        st.floats(0.1, 1),
    ),
    st.builds(
        lambda a, s: {
            "kind": "moved",
            "shape": {
                "kind": "union",
                "parts": [
                    {"kind": "capsule", "start": [-0.3, 0], "end": [0.3, 0.0], "radius": 0.1},
                    {"kind": "polygon", "points": [[0, 0], [0.4, 0], [0, 0.4]]},
                ],
            },
            "shift": [s, 1.0],
            "angle": a,
        },
        st.floats(-4, 4),
        st.floats(0.5, 1.5),
    ),
)
bodies = st.fixed_dictionaries(
    {
        "kind": st.just("membrane"),
        "shape": shapes,
        "energy": st.fixed_dictionaries({"kind": st.sampled_from(["quadratic", "linear"]), "stiffness": numbers}),
        "width": st.one_of(
            st.builds(lambda c: {"cells": c}, st.floats(1, 8)), st.builds(lambda c: {"length": c}, st.floats(0.5, 1))
        ),
    },
    optional={
        "stretch": numbers,
        "coupling": st.sampled_from(["explicit", "semi-implicit", "stabilised", "iterated"]),
        "inside": st.fixed_dictionaries({"density": numbers, "viscosity": numbers}),
        "surface_mass": numbers,
        "transport": st.fixed_dictionaries({"carry": st.sampled_from(["field", "map"])}),
    },
)
side = st.one_of(
    st.sampled_from(["no-slip", "free-slip"]), st.builds(lambda v: {"kind": "wall", "velocity": [0, v]}, numbers)
)
scenes = st.fixed_dictionaries(
    {
        "box": st.fixed_dictionaries(
            {"length": st.sampled_from([[2, 2], [2.0, 4.0], [4, 2]]), "cells": st.sampled_from([16, 64, 500])},
            optional={
                "edges": st.one_of(
                    st.sampled_from(["walls", "periodic", "free-slip"]),
                    st.fixed_dictionaries({"x": st.tuples(side, side), "y": st.sampled_from(["periodic", "no-slip"])}),
                )
            },
        ),
        "fluid": st.fixed_dictionaries({"viscosity": numbers}, optional={"gravity": st.tuples(numbers, numbers)}),
        "bodies": st.lists(bodies, max_size=3),
        "clock": st.fixed_dictionaries({"end": st.floats(1, 10), "step": st.floats(1e-6, 1) | st.just("auto")}),
    }
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=scenes)
def test_random_right_scenes_come_back_from_json_and_yaml(data):
    scene = Scene.model_validate(data)
    assert loads(scene.model_dump_json()) == scene
    assert loads(yaml.safe_dump(json.loads(scene.model_dump_json()))) == scene
    assert hash(loads(scene.model_dump_json())) == hash(scene)


def test_values_that_replace_others_stay_as_they_are():
    """A path may lead into the value of another: a study's settings serve many scenes."""
    changes = {"clock": {"end": 1.0, "step": 0.1, "frames": 2}, "clock.end": 0.5}
    assert loads(yaml.safe_dump(GOOD), changes).clock.end == 0.5
    assert changes["clock"]["end"] == 1.0
