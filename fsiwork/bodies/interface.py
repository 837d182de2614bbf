"""An interface that goes with the flow and does nothing to it: transport and redistancing alone (Chapter 1)."""

from collections.abc import Callable

import numpy as np

from fsiwork.bodies.backward import BackwardMap
from fsiwork.bodies.body import Body
from fsiwork.core import integrals
from fsiwork.core.edges import Edges
from fsiwork.core.grid import Grid
from fsiwork.core.refinement import refined
from fsiwork.core.transport import Transport

XYZ = "xyz"


class Interface(Body):
    """The surface φ = 0, φ < 0 inside.

    Parameters
    ----------
    grid, edges : where
    distance : φ₀(x, y[, z]) [length]
    transport : what carries φ or Y
    carry : ``field`` (φ) or ``map`` (the backward map Y, and φ = φ₀(Y))
    redistance : (grid, flat φ) -> flat φ with the same zero set and |∇φ| = 1; None: never. Not with a map, which makes
        φ anew
    every : steps between two redistancings

    Attributes
    ----------
    phi : flat field at centres; of a map as old as the last look at it, see `fields`
    map : the backward map, or None
    """

    def __init__(
        self,
        grid: Grid,
        edges: Edges,
        distance: Callable[..., np.ndarray],
        *,
        transport: Transport,
        carry: str = "field",
        redistance: Callable[[Grid, np.ndarray], np.ndarray] | None = None,
        every: int = 1,
    ):
        if carry not in ("field", "map"):
            raise ValueError(f"carry must be field or map, got {carry!r}")
        if carry == "map" and redistance:
            raise ValueError("a map makes φ anew: nothing to redistance")
        self.grid, self.edges, self.transport = grid, edges, transport
        self.redistance, self.every, self.moves = redistance, int(every), 0
        self._distance = distance
        self.phi = grid.field(transport.dtype)
        self.map = BackwardMap(grid, edges, transport) if carry == "map" else None
        self._fresh = False
        if not self.map:
            grid.padded(self.phi)[...] = distance(*grid.points())
            edges.fill_scalar(self.phi, "linear")

    def move(self, flow, dt: float) -> None:
        """Carry φ or Y with ``flow.u``; redistance φ after every so many moves."""
        if self.map:
            self.map.move(flow.u, dt)
            self._fresh = False
            return
        self.transport.advance([self.phi], flow.u, dt, "linear")
        self.moves += 1
        if self.redistance and self.moves % self.every == 0:
            self.phi[:] = self.redistance(self.grid, self.phi)
            self.edges.fill_scalar(self.phi, "linear")

    def state(self) -> dict[str, np.ndarray]:
        """φ or Y, and how often it was carried."""
        names = {k: q for k, q in self._named().items() if k != "phi" or not self.map}
        return {name: q.copy() for name, q in names.items()} | {"moves": np.array(self.moves)}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Take back a `state`."""
        self.moves = int(state["moves"])
        for name, q in self._named().items():
            if name in state:
                q[:] = state[name]
        self._fresh = False

    def fields(self) -> dict[str, np.ndarray]:
        """φ and the components of Y, flat fields at centres."""
        if self.map and not self._fresh:
            self.grid.padded(self.phi)[...] = self._distance(*self.map.home())
            self.edges.fill_scalar(self.phi, "linear")
            self._fresh = True
        return self._named()

    def gauges(self, flow) -> dict[str, float]:
        """Volume inside and length (2D) or area (3D) of φ = 0, by geometry."""
        return measures(self.grid, self.fields()["phi"])

    def finer(self, factor: int) -> tuple[Grid, np.ndarray]:
        """A grid with ``factor`` times as many cells a direction and φ on it, flat.

        Of a map φ₀ of the interpolated Y, which shows filaments thinner than a cell; else φ itself interpolated.
        """
        if not self.map:
            return refined(self.grid, self.phi, factor)
        g, Y = self.grid, []
        for a in g.axes:
            fine, q = refined(g, self.map.Y[a], factor)
            Y.append(np.mod(q - g.origin[a], g.length[a]) + g.origin[a] if self.edges.periodic(a) else q)
        return fine, self._distance(*Y)

    def _named(self) -> dict[str, np.ndarray]:
        Y = self.map.Y if self.map else ()
        return {"phi": self.phi} | {f"Y_{XYZ[a]}": q for a, q in enumerate(Y)}


def measures(grid: Grid, phi: np.ndarray) -> dict[str, float]:
    """``volume`` of φ < 0 and ``length`` (2D) or ``area`` (3D) of φ = 0, for a flat φ with its ghosts."""
    if grid.dim == 2:
        line, area = integrals.length_and_area(grid, phi)
        return {"volume": area, "length": line}
    surface, volume = integrals.area_and_volume(grid, phi)
    return {"volume": volume, "area": surface}
