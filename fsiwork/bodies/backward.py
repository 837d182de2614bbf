"""The backward map Y: where a point's material was at first; ∂t Y + u·∇Y = 0, Y(x, 0) = x."""

import copy

import numpy as np

from fsiwork.core.edges import Edges
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.transport import Transport


class BackwardMap:
    """Components of Y [length] at centres, flat; along a periodic direction x - Y is periodic, Y grows by the period.

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
            carrier.edges = _Growing(edges, a) if edges.periodic(a) else edges
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
    """Ghosts of component ``a`` in a box that is periodic along ``a``: Y(x + L) = Y(x) + L."""

    def __init__(self, edges: Edges, a: int):
        self.edges, self.a = edges, a

    def fill_scalar(self, Y: np.ndarray, rule: str) -> None:
        """As `Edges.fill_scalar`, with the period added."""
        self.edges.fill_scalar(Y, rule)
        g = self.edges.grid
        lines = np.moveaxis(g.padded(Y), self.a, 0)
        lines[:GHOSTS] -= g.length[self.a]
        lines[-GHOSTS:] += g.length[self.a]
