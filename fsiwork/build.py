"""From specs to objects: the one place that knows both the words of a scene and the classes of the solver."""

import functools

import numpy as np

from fsiwork.bodies import laws
from fsiwork.bodies.body import Body
from fsiwork.bodies.bubbles import Bubbles
from fsiwork.bodies.curve import Curve, fibre, ring
from fsiwork.bodies.interface import Interface
from fsiwork.bodies.markers import Markers, outline
from fsiwork.bodies.membrane import Membrane
from fsiwork.bodies.shear import ShearMembrane
from fsiwork.core import motion, shapes
from fsiwork.core.edges import Edges, Side
from fsiwork.core.flow import Flow
from fsiwork.core.grid import Grid
from fsiwork.core.redistance import redistance
from fsiwork.core.transport import Transport
from fsiwork.scene import Scene


def parts(scene: Scene) -> tuple[Flow | motion.Motion, tuple[Body, ...]]:
    """Flow or motion and bodies of a scene as they are at t = 0."""
    box = scene.box
    grid = Grid(box.n, box.h, box.origin)
    edges = Edges(grid, tuple(tuple(_side(spec) for spec in pair) for pair in box.sides))
    bodies = tuple(BODIES[spec.kind](spec, grid, edges) for spec in scene.bodies)
    if scene.motion is not None:
        return motion.Motion(grid, edges, _field(scene.motion, grid), scene.motion.period), bodies
    fluid = scene.fluid
    flow = Flow(grid, edges, fluid.density, fluid.viscosity, scene.gravity, fluid.advection, fluid.diffusion)
    _set_in_motion(flow, fluid.initial)
    return flow, bodies


def _field(spec, grid: Grid) -> motion.Field:
    """The velocity of a prescribed motion."""
    if spec.kind == "rotation":
        return motion.Rotation(spec.centre, spec.rate)
    if spec.kind == "translation":
        return motion.Translation(spec.velocity)
    return {"vortex": motion.Vortex, "deformation": motion.Deformation}[spec.kind](grid.origin, grid.length, spec.speed)


def _membrane(spec, grid: Grid, edges: Edges) -> Membrane:
    law = _law(spec.energy)
    centring = 4 if isinstance(law, laws.Linear) and spec.form != "adjoint" else 2
    return Membrane(
        grid,
        edges,
        shape(spec.shape).distance,
        law,
        spec.width.of(grid.h),
        transport=_transport(spec.transport, grid, edges, centring),
        stretch=spec.stretch,
        form=spec.form,
        dirac=spec.dirac,
        coupling=spec.coupling,
        carry=spec.transport.carry,
        restart=np.inf if spec.transport.restart is None else spec.transport.restart,
        inside=None if spec.inside is None else (spec.inside.density, spec.inside.viscosity),
        surface_mass=spec.surface_mass,
        bending=spec.bending,
        renew=spec.renew,
    )


def _bubbles(spec, grid: Grid, edges: Edges) -> Bubbles:
    return Bubbles(
        grid,
        edges,
        [shape(part.shape).distance for part in spec.parts],
        [part.buoyancy if spec.boussinesq else part.density for part in spec.parts],
        spec.width.of(grid.h),
        transport=_transport(spec.transport, grid, edges, 4),
        tension=spec.tension,
        boussinesq=spec.boussinesq,
        viscosity=spec.viscosity,
        film=spec.film,
        keep_volume=spec.keep_volume,
        coupling=spec.coupling,
        carry=spec.transport.carry,
    )


def _transport(spec, grid: Grid, edges: Edges, centring: int) -> Transport:
    own = {"band": spec.band, "from_interface": spec.from_interface}
    return Transport(grid, edges, spec.scheme, spec.tableau, np.dtype(spec.dtype), centring, **own)


def _interface(spec, grid: Grid, edges: Edges) -> Interface:
    anew = spec.redistance
    return Interface(
        grid,
        edges,
        shape(spec.shape).distance,
        transport=_transport(spec.transport, grid, edges, 2 if spec.transport.from_interface else 4),
        carry=spec.transport.carry,
        redistance=functools.partial(redistance, method=anew.method) if anew else None,
        every=anew.every if anew else 1,
    )


def _markers(spec, grid: Grid, edges: Edges) -> Markers:
    if spec.shape.kind == "ring":
        points = np.array(spec.shape.points(spec.spacing * grid.h))
    else:
        bounds = spec.shape.bounds(grid.dim)
        points = outline(shape(spec.shape).distance, bounds, spec.spacing * grid.h)
    return Markers(grid, edges, points, _law(spec.energy), spec.stretch)


def _curve(spec, grid: Grid, edges: Edges) -> Curve:
    line, eps = spec.shape, spec.width.of(grid.h)
    if line.kind == "ring":
        levels = ring(line.centre, line.radius, "xyz".index(line.normal), spec.stretch)
    else:
        levels = fibre(line.root, line.length, "xyz".index(line.along), spec.stretch, eps)
    return Curve(
        grid,
        edges,
        levels,
        _law(spec.energy),
        eps,
        transport=_transport(spec.transport, grid, edges, 2),
        carry=spec.transport.carry,
        coupling=spec.coupling,
    )


def _shear_membrane(spec, grid: Grid, edges: Edges) -> ShearMembrane:
    return ShearMembrane(
        grid,
        edges,
        spec.shape.centre,
        spec.shape.radius,
        spec.law,
        spec.area,
        spec.shear,
        spec.width.of(grid.h),
        volume=spec.volume,
        slip=spec.slip,
        twist=spec.twist,
        inflation=spec.inflation,
        alike=spec.alike,
        coupling=spec.coupling,
    )


def _law(spec) -> laws.Law:
    kind = getattr(spec, "kind", None)  # a law written in Python is the object itself
    return LAWS[kind](spec.stiffness) if kind in LAWS else spec


BODIES = {
    "membrane": _membrane,
    "bubbles": _bubbles,
    "interface": _interface,
    "markers": _markers,
    "curve": _curve,
    "shear-membrane": _shear_membrane,
}
LAWS = {"quadratic": laws.Quadratic, "linear": laws.Linear}
SHAPES = {
    "ball": shapes.Ball,
    "disc": shapes.Ball,
    "ellipsoid": shapes.Ellipsoid,
    "ellipse": shapes.Ellipsoid,
    "box": shapes.Box,
    "polygon": shapes.Polygon,
    "capsule": shapes.Capsule,
    "tablet": shapes.Tablet,
    "torus": shapes.Torus,
    "cassini": shapes.Cassini,
    "slot": shapes.Slot,
    "union": shapes.Union,
    "intersection": shapes.Intersection,
    "minus": shapes.Minus,
    "moved": shapes.Moved,
}


def shape(spec) -> shapes.Shape:
    """The signed distance that a shape's spec describes."""
    values = {name: getattr(spec, name) for name in type(spec).model_fields if name != "kind"}
    for name, value in values.items():
        if name in ("shape", "cut"):
            values[name] = shape(value)
        elif name == "parts":
            values[name] = tuple(shape(part) for part in value)
    return SHAPES[spec.kind](**values)


def _side(spec) -> Side:
    if spec.kind in ("wall", "inflow"):
        return Side(spec.kind, spec.velocity, getattr(spec, "profile", "uniform"))
    return Side(spec.kind)


def _set_in_motion(flow: Flow, initial) -> None:
    g = flow.grid
    if initial.kind == "shear":
        middle = g.origin[1] + 0.5 * g.length[1]
        flow.u[0][:] = g.sample(lambda *x: initial.rate * (x[1] - middle), face=0)
    elif initial.kind == "taylor-green":
        k = [2 * np.pi * initial.waves / length for length in g.length[:2]]
        ratio = k[0] / k[1]

        def u(x, y, *_):
            return -initial.amplitude * np.cos(k[0] * (x - g.origin[0])) * np.sin(k[1] * (y - g.origin[1]))

        def v(x, y, *_):
            return ratio * initial.amplitude * np.sin(k[0] * (x - g.origin[0])) * np.cos(k[1] * (y - g.origin[1]))

        flow.u[0][:], flow.u[1][:] = g.sample(u, face=0), g.sample(v, face=1)
    flow.edges.fill_velocity(flow.u)
