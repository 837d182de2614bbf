"""From specs to objects: the one place that knows both the words of a scene and the classes of the solver."""

import numpy as np

from fsiwork.bodies.body import Body
from fsiwork.bodies.membrane import Membrane
from fsiwork.core import shapes
from fsiwork.core.edges import Edges, Side
from fsiwork.core.flow import Flow
from fsiwork.core.grid import Grid
from fsiwork.core.transport import Transport
from fsiwork.scene import Scene


def parts(scene: Scene) -> tuple[Flow, tuple[Body, ...]]:
    """Flow and bodies of a scene as they are at t = 0."""
    box, fluid = scene.box, scene.fluid
    grid = Grid(box.n, box.h, box.origin)
    edges = Edges(grid, tuple(tuple(_side(spec) for spec in pair) for pair in box.sides))
    flow = Flow(grid, edges, fluid.density, fluid.viscosity, scene.gravity, fluid.advection, fluid.diffusion)
    _set_in_motion(flow, fluid.initial)
    return flow, tuple(BODIES[spec.kind](spec, grid, edges) for spec in scene.bodies)


def _membrane(spec, grid: Grid, edges: Edges) -> Membrane:
    raise NotImplementedError


BODIES = {"membrane": _membrane}


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
