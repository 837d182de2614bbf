"""A scene: frozen, checked data that says what is simulated. YAML in, faults in the field's words out.

`Scene` is the YAML file and the YAML file is the `Scene`: unknown keys are refused, and every fault names
its path (``fluid.density: must be positive, got -1``).
"""

import copy
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import TypeAdapter, ValidationError, WrapValidator

from fsiwork.specs.base import Positive, Spec, sense, tried, whole
from fsiwork.specs.bodies import (
    Body,
    Bubble,
    Bubbles,
    Curve,
    Energy,
    Interface,
    Law,
    Linear,
    Markers,
    Membrane,
    Quadratic,
    Redistance,
    ShearMembrane,
    Transport,
    Width,
)
from fsiwork.specs.box import Box, Edges, FreeSlip, Inflow, NoSlip, Outflow, Periodic, Side, Symmetry, Wall
from fsiwork.specs.faults import Fault, got, wording, wrong
from fsiwork.specs.fluid import Fluid, Inside, Rest, Shear, TaylorGreen
from fsiwork.specs.lines import Fibre, Ring
from fsiwork.specs.motion import Deformation, Motion, Rotation, Translation, Vortex
from fsiwork.specs.shapes import (
    Ball,
    Block,
    Capsule,
    Cassini,
    Ellipsoid,
    Intersection,
    Minus,
    Moved,
    Polygon,
    Shape,
    Slot,
    Tablet,
    Torus,
    Union,
)
from fsiwork.specs.yaml import Loader

__all__ = [
    "Ball", "Block", "Body", "Box", "Bubble", "Bubbles", "Capsule", "Cassini", "Clock", "Curve", "Deformation",
    "Edges", "Ellipsoid", "Energy", "Fibre", "Fluid", "FreeSlip", "Inflow", "Inside", "Interface", "Intersection",
    "Law", "Linear", "Markers", "Membrane", "Minus", "Motion", "Moved", "NoSlip", "Outflow", "Output", "Periodic",
    "Polygon", "Quadratic", "Redistance", "Rest", "Ring", "Rotation", "Scene", "SceneError", "Shape", "Shear",
    "ShearMembrane", "Side", "Slot", "Symmetry", "Tablet", "TaylorGreen", "Torus", "Translation", "Transport", "Union",
    "Vortex", "Wall", "Width", "faults", "load", "loads",
]  # fmt: skip


class SceneError(ValueError):
    """A scene that cannot be simulated; ``faults`` has one line for each thing that is wrong."""

    def __init__(self, *faults: str):
        super().__init__("\n".join(faults))
        self.faults = list(faults)


def _step(value, handler):
    if isinstance(value, str) and value == "auto":
        return value
    try:
        float(value) if isinstance(value, str) else None
    except ValueError:
        raise wrong(f"must be a number or auto, got {got(value)}") from None
    return _POSITIVE.validate_python(value)


_POSITIVE = TypeAdapter(Positive)


class Clock(Spec):
    """From t = 0 to ``end``, with ``frames`` evenly spaced frames after the first.

    ``step`` is Δt, or ``auto``: ``safety`` times the longest stable step, looked at anew each step.
    """

    end: Positive
    step: Annotated[Positive | Literal["auto"], WrapValidator(_step)]
    frames: whole(1, 1_000_000) = 1
    safety: Positive = 0.5

    @sense
    def _one_step(self) -> Iterator[Fault]:
        if self.step != "auto" and self.step > self.end:
            yield ("step",), f"must not exceed the end {self.end}, got {self.step}"


class Output(Spec):
    """What is kept: fields of the frames (``u`` is the whole velocity), and gauges every so many steps.

    ``geometric`` adds volumes and areas by height functions to the smeared gauges of bodies in space, where they cost
    as much as a step (in the plane they always stand there).
    """

    fields: tuple[Literal["u", "v", "w", "p", "phi", "rho", "mu", "vorticity", "Y"], ...] = ("u", "p", "phi")
    dtype: Literal["float64", "float32"] = "float64"
    gauges_every: whole(1) = 1
    geometric: bool = False


class Scene(Spec):
    """Everything that determines a run: in the box either a fluid or a prescribed motion, and bodies."""

    box: Box
    fluid: Fluid | None = None
    motion: Motion | None = None
    bodies: tuple[Body, ...] = ()
    clock: Clock
    output: Output = Output()

    @property
    def gravity(self) -> tuple[float, ...]:
        """Gravity with one number a direction [length/time²]."""
        return (self.fluid and self.fluid.gravity) or (0.0,) * self.box.dim

    @sense
    def _fluid_or_motion(self) -> Iterator[Fault]:
        if (self.fluid is None) == (self.motion is None):
            yield ("fluid",), "is required, or a motion" if self.fluid is None else "must not stand beside a motion"

    @sense
    def _motion_fits(self) -> Iterator[Fault]:
        if self.motion is None:
            return
        for path, text in self.motion.misfits(self.box.dim):
            yield ("motion", *path), text
        kinds = {side.kind for pair in self.box.sides for side in pair} - {"periodic", "no-slip", "free-slip"}
        if kinds:
            yield ("box", "edges"), f"a motion gives the velocity, not a side that is {', '.join(sorted(kinds))}"
        for k, name in enumerate(self.output.fields):
            if name in ("p", "rho", "mu"):
                yield ("output", "fields", k), f"{name}: needs a fluid, the scene has a motion; name output.fields"

    @sense
    def _gravity(self) -> Iterator[Fault]:
        if self.fluid and self.fluid.gravity and len(self.fluid.gravity) != self.box.dim:
            yield ("fluid", "gravity"), f"must have {self.box.dim} numbers, got {len(self.fluid.gravity)}"
            return
        for a, g in enumerate(self.gravity):
            if g and any(side.kind == "symmetry" for side in self.box.sides[a]):
                yield ("fluid", "gravity"), f"is not its own mirror image across the plane of symmetry along {'xyz'[a]}"

    @sense
    def _vortices(self) -> Iterator[Fault]:
        if self.fluid and self.fluid.initial.kind == "taylor-green":
            kinds = {side.kind for pair in self.box.sides[:2] for side in pair}
            if not kinds <= {"periodic", "free-slip"}:
                yield ("fluid", "initial"), "vortices need periodic or free-slip sides along x and y"

    @sense
    def _bodies_in_box(self) -> Iterator[Fault]:
        for i, body in enumerate(self.bodies):
            yield from tried(self._shape_fits(i, body))
            if not isinstance(body, Interface):
                yield from tried(self._has_a_fluid(i, body))
            if not isinstance(body, Interface | Markers):
                yield from tried(self._width_fits(i, body))

    @sense
    def _one_density_for_bending(self) -> Iterator[Fault]:
        for i, body in enumerate(self.bodies):
            bent = isinstance(body, Membrane) and body.bending and body.coupling == "stabilised"
            if bent and self.fluid and body.inside and body.inside.density != self.fluid.density:
                text = "with bending and another density inside it must be explicit, got 'stabilised'"
                yield ("bodies", i, "coupling"), text

    @sense
    def _mirrored(self) -> Iterator[Fault]:
        if "symmetry" not in {side.kind for pair in self.box.sides for side in pair}:
            return
        for i, body in enumerate(self.bodies):
            if not (isinstance(body, Membrane | Interface | Bubbles) and body.transport.carry == "field"):
                yield ("bodies", i), "at planes of symmetry only bodies that carry a field are mirrored"

    def _has_a_fluid(self, i: int, body) -> Iterator[Fault]:
        if self.motion is not None:
            yield ("bodies", i, "kind"), f"{body.kind} needs a fluid; with a motion go bodies of kind interface"

    def _shape_fits(self, i: int, body) -> Iterator[Fault]:
        if isinstance(body, Markers) and self.box.dim != 2 and not isinstance(body.shape, Ring):
            yield ("bodies", i, "shape", "kind"), f"in space markers make a ring, got {body.shape.kind}"
        if isinstance(body, ShearMembrane):
            kinds = {side.kind for pair in self.box.sides for side in pair}
            yield from ((("bodies", i, *path), text) for path, text in body.misfits(self.box.dim, kinds))
        if isinstance(body, Curve) and getattr(body.shape, "normal", "") in tuple(self._periodic):
            yield ("bodies", i, "shape", "normal"), "the ring must not lie across a periodic direction: φ¹ would jump"
        for where, shape in _shapes(body):
            misfits = list(shape.misfits(self.box.dim))
            for path, text in misfits or _outside(shape, self.box):
                yield ("bodies", i, *where, *path), text
        restarts = isinstance(body, Membrane) and body.transport.restart
        if restarts and any(side.kind == "inflow" for pair in self.box.sides for side in pair):
            fault = "needs a box without inflow: φ₀ would have to reach beyond it"
            yield ("bodies", i, "transport", "restart"), fault

    @property
    def _periodic(self) -> str:
        return "".join(x for x, (low, _) in zip("xyz", self.box.sides, strict=False) if low.kind == "periodic")

    def _width_fits(self, i: int, body) -> Iterator[Fault]:
        h, width = self.box.h, body.width
        if not width.of(h) >= h * (1 - 1e-9):
            knob = "length" if width.cells is None else "cells"
            yield ("bodies", i, "width", knob), f"ε = {width.of(h):.6g} is below the grid step {h:.6g}"
        if isinstance(body, Curve) and isinstance(body.shape, Fibre) and not list(body.shape.misfits(self.box.dim)):
            yield from ((("bodies", i, "width"), text) for text in self._crowded(body))

    def _crowded(self, body: Curve) -> Iterator[str]:
        """Levels jump at periodic sides; a label takes the jump away from the fibre, if there is room."""
        room = 2.5 * body.width.of(self.box.h) / body.stretch**0.5
        for a, x in enumerate("xyz"):
            low = body.shape.root[a] - self.box.origin[a]
            if x != body.shape.along and x in self._periodic and min(low, self.box.length[a] - low) < room:
                yield f"the fibre needs {room:.6g} to either side along {x}"

    @sense
    def _fields_exist(self) -> Iterator[Fault]:
        for k, name in enumerate(self.output.fields):
            if name == "w" and self.box.dim == 2:
                yield ("output", "fields", k), "w: the box has two directions"

    @sense
    def _map_is_carried(self) -> Iterator[Fault]:
        if "Y" in self.output.fields and "map" not in [
            body.transport.carry for body in self.bodies if not isinstance(body, Markers)
        ]:
            yield ("output", "fields", self.output.fields.index("Y")), "Y: no body has transport.carry: map"


def _shapes(body) -> Iterator[tuple[tuple, Any]]:
    """The shapes of a body, each with its path."""
    if not isinstance(body, Bubbles):
        yield ("shape",), body.shape
        return
    for k, part in enumerate(body.parts):
        yield ("parts", k, "shape"), part.shape


def _outside(shape, box: Box) -> Iterator[Fault]:
    for a, (low, high) in enumerate(shape.bounds(box.dim)):
        first, last = box.origin[a], box.origin[a] + box.length[a]
        if box.sides[a][0].kind == "periodic":
            if not high - low <= box.length[a]:
                yield (), f"is wider than the periodic box along {'xyz'[a]} ({high - low:.6g} > {box.length[a]:.6g})"
            continue
        mirrors = [p for p, side in zip((first, last), box.sides[a], strict=True) if side.kind == "symmetry"]
        crossed = [p for p in mirrors if low < p < high]
        for plane in crossed:
            if not _mirrored_across(shape, a, plane, box):
                yield (), f"crosses the plane of symmetry {'xyz'[a]} = {plane:.6g} and is not its own mirror image"
        inside = (low >= first or first in crossed) and (high <= last or last in crossed)
        if not inside:
            yield (
                (),
                f"leaves the box along {'xyz'[a]}: [{low:.6g}, {high:.6g}] is not inside [{first:.6g}, {last:.6g}]",
            )


def _mirrored_across(shape, a: int, plane: float, box: Box) -> bool:
    """Whether a shape reaches as far in some oblique directions as in their mirror images across a plane."""
    for numbers in OBLIQUE:
        there, back = list(numbers[: box.dim]), list(numbers[: box.dim])
        back[a] = -back[a]
        if not abs(shape.reach(there) - shape.reach(back) - 2.0 * plane * there[a]) <= 1e-9 * box.length[a]:
            return False
    return True


OBLIQUE = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.9, 0.4, 0.3), (0.3, 0.9, -0.5), (-0.4, 0.5, 0.8))


def faults(error: Exception) -> list[str]:
    """What is wrong, one line for each fault: ``path: text``."""
    if isinstance(error, SceneError):
        return error.faults
    if isinstance(error, ValidationError):
        details = error.errors(include_url=False)
        return [f"{'.'.join(map(_key, d['loc'])) or 'scene'}: {wording(d)}" for d in details]
    if isinstance(error, RecursionError):
        return ["scene: nested too deeply"]
    if isinstance(error, OSError):
        return [f"{error.filename or 'scene'}: {error.strerror or error}"]
    return [" ".join(str(error).split()) or type(error).__name__]


def _key(part: str | int) -> str:
    return part if isinstance(part, str) and part.isprintable() and part else got(part) if part != 0 else "0"


def load(path: str | Path, overrides: Mapping[str, Any] | None = None) -> Scene:
    """The scene in a YAML or JSON file, with some values replaced.

    ``overrides`` maps dotted paths to values: ``{"bodies.0.energy.stiffness": 3}``. Raises `SceneError`
    with all faults.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise SceneError(f"{path}: not a text file") from None
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror or error}") from None
    return loads(text, overrides, str(path))


def loads(text: str, overrides: Mapping[str, Any] | None = None, name: str = "scene") -> Scene:
    """The scene in a YAML or JSON text; ``name`` stands before faults of the syntax. See `load`."""
    data = parse(text, name)
    if data is None:
        raise SceneError(f"{name}: empty")
    if not isinstance(data, dict):
        raise SceneError(f"{name}: must be a mapping with box, fluid, bodies, clock; got {got(data)}")
    lines = [line for path, value in (overrides or {}).items() if (line := _replace(data, path, value))]
    try:
        scene = Scene.model_validate(data)
    except (ValidationError, RecursionError) as error:
        raise SceneError(*lines, *faults(error)) from None
    if lines:
        raise SceneError(*lines)
    return scene


def parse(text: str, name: str = "value") -> Any:
    """YAML as data: 1e-3 is a number, only true and false are truth values, no key twice."""
    try:
        return yaml.load(text, Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise SceneError(f"{name}: {where}{error.problem or error.context}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise SceneError(f"{name}: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise SceneError(f"{name}: nested too deeply") from None


def _replace(data: dict, path: str, value: Any) -> str:
    """Put a value at a dotted path; what is wrong with the path, or nothing."""
    *parents, last = path.split(".")
    if not all((*parents, last)):
        return f"{got(path)}: not a path; write a.b.c=value"
    place: Any = data
    for depth, key in enumerate((*parents, last)):
        here = ".".join(path.split(".")[: depth + 1])
        if isinstance(place, list):
            if not (key.isdecimal() and int(key) < len(place)):
                return f"{here}: unknown path, the list has {len(place)} items"
            key = int(key)
        elif not isinstance(place, dict):
            return f"{here}: unknown path, {'.'.join(path.split('.')[:depth])} is {got(place)}"
        if depth == len(parents):
            place[key] = copy.deepcopy(value)  # a later path may lead into it
        else:
            place = place[key] if isinstance(place, list) else place.setdefault(key, {})
    return ""
