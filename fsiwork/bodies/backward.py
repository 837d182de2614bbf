"""The backward map Y: where a point's material was at first; ∂t Y + u·∇Y = 0, Y(x, 0) = x."""

import copy
from collections.abc import Callable

import numpy as np

from fsiwork.core.edges import Edges
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import sampling
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
        self.Y = [grid.field(transport.dtype) for _ in grid.axes]
        self.begin()
        self._carriers = []
        for a in grid.axes:
            carrier = copy.copy(transport)
            carrier.edges = _Growing(edges, a)
            self._carriers.append(carrier)

    def begin(self) -> None:
        """Y = x."""
        for a, Y in enumerate(self.Y):
            Y[:] = self.grid.sample(lambda *x, a=a: x[a], dtype=Y.dtype)

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


class Rest:
    """φ₀ of a map: a function, until the map is wound up and starts anew, φ₀ ← φ and Y ← x; from then on a field, with
    quintics between its points. Layers that turn at different speeds wind Y up without end, though φ hardly changes.

    Parameters
    ----------
    map : the backward map
    function : φ₀(x, y[, z]) at t = 0, of padded arrays
    restart : largest |∂_jY_i| near the interface before the map starts anew; inf: never
    """

    def __init__(self, map: BackwardMap, function: Callable, restart: float = np.inf):
        self.map, self.function, self.restart = map, function, float(restart)
        self.often = np.zeros(1)  # how often it has started anew
        if self.restart < np.inf:
            g = map.grid
            self._phi0, self._s, self._box = g.field(map.Y[0].dtype), np.array(g.strides), np.array(g.n)
            self._low = GHOSTS - 0.5 - np.array(g.origin[: g.dim]) / g.h
            self._sample = getattr(sampling, f"sample_{g.dim}d")

    def level(self, phi: np.ndarray) -> None:
        """φ = φ₀(Y), flat; its ghosts are filled."""
        g, home = self.map.grid, self.map.home()
        if self.often[0]:
            places = [np.ravel(q) for q in home]
            self._sample(phi, self._phi0, *places, *g.rows(), self._s, self._box, self._low, g.h)
        else:
            g.padded(phi)[...] = self.function(*home)
        self.map.edges.fill_scalar(phi, "linear")

    def wound(self, runs: np.ndarray) -> bool:
        """Whether Y is wound up on the ``runs`` of a band."""
        top = np.zeros(runs.shape[0])
        for Y in self.map.Y:
            sampling.steepest(top, Y, runs, self._s, 0.5 / self.map.grid.h)
            if top.max(initial=0.0) > self.restart:
                return True
        return False

    def begin(self, phi: np.ndarray) -> None:
        """Start anew: φ₀ ← φ, flat with its ghosts, and Y ← x."""
        self._phi0[:] = phi
        self.often += 1
        self.map.begin()

    def state(self) -> dict[str, np.ndarray]:
        """φ₀ of a map that may start anew, and how often it did."""
        return {"rest": self._phi0.copy(), "often": self.often.copy()} if self.restart < np.inf else {}

    def put_back(self, state: dict[str, np.ndarray]) -> None:
        """Take back a `state`."""
        if self.restart < np.inf:
            self._phi0[:], self.often[:] = state["rest"], state["often"]


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
