"""A narrow band around an interface as pieces of rows, all of one length: kernels take them like rows."""

import numpy as np

from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import pieces as kernels

LENGTH = 16  # cells: shorter ones spend more on calls, longer ones on cells outside the band
BESIDE = 2  # rows beyond the band that move with it, and cells along a row: its edge advances by half a cell a step
FLAT = 1e-2  # a difference of neighbours over the height of the band, below which nothing moves
LOOSE = 1.25  # only a field this much higher than the band is clipped, not one whose slope fell a little


class Pieces:
    """The cells near the zeros of φ, found anew from φ whenever asked.

    φ is clipped to plateaus ± ``band`` cells' worth of its largest slope, and the pieces are where it is not flat. The
    clipped field obeys the same equation, so that only the kink at the band's edge differs from a full transport. The
    largest difference of neighbours is h for a distance: the scale of φ does not matter. A field that is flat nowhere
    and lower than the band is left alone and carried everywhere.

    Parameters
    ----------
    grid : where
    band : half-width [cells]

    Attributes
    ----------
    start, n : flat starts of the pieces and their one length, as `Grid.rows` gives for the whole box
    around : starts of all pieces that a stencil of three cells on either side of these reads
    inner : whether all of these are away from the sides, so that no ghost is read
    steepest : largest |difference| of neighbours of φ

    Raises
    ------
    ValueError : a band of fewer than 3 cells
    """

    def __init__(self, grid: Grid, band: float):
        if not band >= GHOSTS:
            raise ValueError(f"a band needs at least {GHOSTS} cells on either side, got {band!r}")
        rows, length = grid.rows()
        self.grid, self.band, self.n = grid, float(band), min(LENGTH, length)
        first = np.minimum(np.arange(-(-length // self.n)) * self.n, length - self.n)
        self._starts = np.add.outer(rows, first).ravel()
        self._steep = np.zeros((rows.size, first.size))
        self._shape = (*grid.n[:-1], first.size)
        self._strides = np.array([*grid.strides, 1][:3])
        self._across = 1 + (0 < length % self.n < GHOSTS)  # pieces that three cells along a row may reach into
        self._top = np.empty(self._starts.size)
        self.start = self.around = rows[:0]
        self.steepest, self.inner = 0.0, False

    def find(self, q: np.ndarray) -> None:
        """Clip ``q`` (flat, at centres, ghosts filled) and find the pieces of its band."""
        rough = self._rough(q)
        starts = self._starts[np.flatnonzero(rough)]
        kernels.tallest(self._top, q, starts, self.n)
        level = self.band * self.steepest
        if starts.size and self._top[: starts.size].max() > LOOSE * level:
            np.clip(q, -level, level, out=q)
            rough = self._rough(q)
        for a in self.grid.axes[:-1]:
            rough = spread(rough, a, BESIDE)
        self.start = self._starts[np.flatnonzero(rough)]
        for a in self.grid.axes:
            rough = spread(rough, a, self._across if a == self.grid.dim - 1 else GHOSTS)
        self.around = self._starts[np.flatnonzero(rough)]
        self.inner = not any(rough.take((0, -1), axis=a).any() for a in self.grid.axes)

    def _rough(self, q: np.ndarray) -> np.ndarray:
        kernels.steepness(self._steep, q, *self.grid.rows(), self._strides, self.n)
        self.steepest = float(self._steep.max())
        return (self._steep > FLAT * self.band * self.steepest).reshape(self._shape)


def spread(flags: np.ndarray, a: int, reach: int) -> np.ndarray:
    """Flags that are set within ``reach`` of a set one along axis ``a``, the ends joined; shape of ``flags``."""
    wide = flags.copy()
    to, of = np.moveaxis(wide, a, 0), np.moveaxis(flags, a, 0)
    for d in range(1, reach + 1):
        to[d:] |= of[:-d]
        to[:d] |= of[-d:]
        to[:-d] |= of[d:]
        to[-d:] |= of[:d]
    return wide
