"""The lines φ = c beside a membrane, which slip along it and wind up: from time to time they are drawn anew."""

import numpy as np

from fsiwork.core import closest
from fsiwork.core.edges import Edges
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import foot

BEYOND = (4.0, 8.0)  # cells on each side of D_ε: WENO5 reads three, and the interface moves before the next time
BESIDE = 1.5  # nodes within so many cells of the interface say between which values its stretch lies


class Layers:
    """φ becomes d(x) s(x - d∇d): the distance to φ = 0, times the stretch s = |∇φ| at the nearest point of φ = 0.

    The interface and its stretch, all that a thin membrane is, stay. Under tank-treading the lines beside it, each an
    inextensible membrane of its own, turn at other rates: |∇φ| there grows without bound, and with it their force.
    Each time rubs out what of the stretch is shorter than some cells. Beside bending and the stabilised coupling it
    feeds waves of the grid when steps are long: at k Δt/(ε μ Δx²) = 20 if done every ten steps, at 7 if every five;
    at 13 every ten there were none.

    Parameters
    ----------
    grid, edges : where
    eps : half-width of D_ε [length]
    every : moves of φ between two times; 0: never
    """

    def __init__(self, grid: Grid, edges: Edges, eps: float, every: int):
        self.grid, self.edges, self.every, self.moves = grid, edges, int(every), 0
        self.reach = np.array([eps + cells * grid.h for cells in BEYOND])
        self._stretch = grid.field() if every else None

    def moved(self, phi: np.ndarray) -> None:
        """Count a move of a flat φ, ghosts filled, and draw it anew in place when it is time."""
        if self.every:
            self.moves += 1
            if self.moves % self.every == 0:
                self.renew(phi)

    def renew(self, phi: np.ndarray) -> None:
        """Draw φ anew in place, ghosts too; flat in the end beyond D_ε. Without an interface it stays as it is."""
        g, stretch = self.grid, self._stretch
        start, n = g.rows()
        d = closest.quintic(g, phi, self.reach[1] / g.h).astype(np.float64, copy=False)
        self.edges.mirror(d)
        foot.stretches(stretch, phi, d, start, n, np.array([*g.strides, 0][:3]), g.h)
        near = g.inside(stretch)[np.abs(g.inside(d)) < BESIDE * g.h]
        if not near.size:
            return
        self.edges.fill_scalar(stretch, "mirror")
        ends, joined = np.array([near.min(), near.max()]), np.array([self.edges.periodic(a) for a in g.axes])
        stretched = foot.stretched_2d if g.dim == 2 else foot.stretched_3d
        stretched(phi, d, stretch, start, n, np.array(g.strides), np.array(g.n), joined, ends, self.reach, g.h)
        self.edges.fill_scalar(phi, "linear")

    def state(self) -> dict[str, np.ndarray]:
        """How often φ has moved; nothing where that decides nothing."""
        return {"moves": np.array(self.moves)} if self.every else {}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Take back a `state`."""
        self.moves = int(state["moves"]) if self.every else 0
