"""The backward map Y: where a point's material was at first; ∂t Y + u·∇Y = 0, Y(x, 0) = x."""

import copy

import numpy as np

from fsiwork.core.edges import Edges
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.transport import Transport


class BackwardMap:
    """Components of Y [length] at centres, flat. Along a periodic direction x - Y is periodic: Y grows by the period;
    and beyond an inflow side it is that of the first cell: the fluid outside goes along as at the inlet.

    Parameters
    ----------
    grid, edges : where
    transport : what carries Y; its scratch is shared
    """

    def __init__(self, grid: Grid, edges: Edges, transport: Transport):
        self.grid, self.edges = grid, edges
        self.Y = [grid.sample(lambda *x, a=a: x[a], dtype=transport.dtype) for a in grid.axes]
        self._carriers = []
        for a in grid.axes:
            carrier = copy.copy(transport)
            carrier.edges = _Growing(edges, a)
            self._carriers.append(carrier)

    def move(self, u: list[np.ndarray], dt: float) -> None:
        """Carry Y over dt with the face velocity ``u``."""
        for carrier, Y in zip(self._carriers, self.Y, strict=True):
            carrier.advance([Y], u, dt, "linear")

    def home(self) -> list[np.ndarray]:
        """Y with its ghosts in the padded shape, taken back into the box along periodic directions."""
        g, padded = self.grid, [self.grid.padded(Y) for Y in self.Y]
        for a in g.axes:
            if self.edges.periodic(a):
                padded[a] = np.mod(padded[a] - g.origin[a], g.length[a]) + g.origin[a]
        return padded


class _Growing:
    """Ghosts of component ``a``: Y(x + L) = Y(x) + L where periodic, Y(x + d) = Y(x) + d beyond an inflow side."""

    def __init__(self, edges: Edges, a: int):
        self.edges, self.a = edges, a
        g, kinds = edges.grid, [side.kind for side in edges.sides[a]]
        beyond = {"periodic": np.full(GHOSTS, g.length[a]), "inflow": g.h * np.arange(1, GHOSTS + 1)}
        self._growth = [beyond.get(kind, np.zeros(GHOSTS)).reshape(-1, *[1] * (g.dim - 1)) for kind in kinds]

    def fill_scalar(self, Y: np.ndarray, rule: str) -> None:
        """As `Edges.fill_scalar`, with the growth added."""
        self.edges.fill_scalar(Y, rule)
        low, high = self._growth
        lines = np.moveaxis(self.edges.grid.padded(Y), self.a, 0)
        lines[:GHOSTS] -= low[::-1]
        lines[-GHOSTS:] += high
