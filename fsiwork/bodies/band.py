"""The cells near an interface, as pieces of rows: what is walked instead of the whole box."""

import numpy as np

from fsiwork.core.grid import Grid
from fsiwork.core.kernels import interface as kernels

MARGIN = 2.5  # cells beyond the support of D_ε: stress at corners (0.7) and its differences on faces (1), and some


class Band:
    """Runs of cells of ``grid.rows(1, 1)`` where D_ε of φ or of a neighbour of φ may not vanish.

    Attributes
    ----------
    runs, cells : array (runs, 3) of first flat index, length and offset among the cells of all runs; that many cells
    inside, cells_inside : the same for the cells of the box alone, for sums
    flags, row : one byte per block of 16 cells of each row, and the row of flags of each row of the box
    """

    def __init__(self, grid: Grid, eps: float, renormalised: bool):
        self.grid = grid
        self.start, self.n = grid.rows(1, 1)
        blocks = -(-self.n // kernels.BLOCK)
        self.flags = np.zeros((self.start.size, blocks), np.uint8)
        own = grid.rows()[0] - 1  # a row of the box starts one cell after that of rows(1, 1)
        self.row = np.searchsorted(self.start, own)
        self._interior = np.isin(self.start, own)
        # Room for half of all blocks apart from each other; pages that no run ever touches cost nothing.
        self._runs = np.zeros((2, self.start.size * (blocks // 2 + 1), 3), np.int64)
        self._strides = np.array([*grid.strides, 0][:3])
        cells = eps / grid.h
        self._reach = (0.0, cells + MARGIN) if renormalised else (eps, MARGIN)

    def find(self, phi: np.ndarray) -> None:
        """Look for the band of a flat field φ whose ghosts are filled."""
        kernels.mark(self.flags, phi, self.start, self.n, self._strides, *self._reach)
        counts = kernels.assemble(*self._runs, self.flags, self.start, self.n, self._interior)
        self.runs, self.inside = self._runs[0, : counts[0]], self._runs[1, : counts[1]]
        self.cells, self.cells_inside = counts[2:]
