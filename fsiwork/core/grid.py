"""A uniform staggered grid of square cells: one padded shape for every field, kept flat."""

from functools import cache

import numpy as np

GHOSTS = 3  # WENO5 reads three points on each side


class Grid:
    """Geometry and index arithmetic of a box of square cells in two or three dimensions.

    Array axes are the directions (x, y[, z]); the last one is contiguous. Every field, at cell centres
    or on faces, has the same padded shape ``(n_0 + 2 G, ...)`` and is kept flat; padded index ``G + i``
    holds cell ``i``. Component ``a`` of a vector sits on the **low** face of its cell in direction ``a``, so
    that face ``n_a`` (the high wall) lies in the first ghost layer.

    Parameters
    ----------
    n : cells in each direction
    h : length of a cell's side [length]
    origin : coordinates of the low corner of the box [length]
    """

    def __init__(self, n: tuple[int, ...], h: float, origin: tuple[float, ...] | None = None):
        if len(n) not in (2, 3):
            raise ValueError(f"a grid has two or three directions, got {len(n)}")
        if min(n) < 4:
            raise ValueError(f"at least 4 cells in each direction, got {min(n)}")
        self.n = tuple(int(k) for k in n)
        self.h = float(h)
        self.origin = tuple(origin) if origin is not None else (0.0,) * len(n)
        self.dim = len(n)
        self.axes = range(self.dim)
        self.shape = tuple(k + 2 * GHOSTS for k in self.n)
        self.size = int(np.prod(self.shape))
        self.strides = tuple(int(np.prod(self.shape[a + 1 :])) for a in self.axes)
        self.cells = int(np.prod(self.n))
        self.length = tuple(k * self.h for k in self.n)
        self.cell_volume = self.h**self.dim
        self.rows = cache(self._rows)  # asked for once a kernel call: keep them

    def _rows(self, low: int = 0, high: int = 0) -> tuple[np.ndarray, int]:
        """Flat starts of the rows, and their length, over cells ``low`` before to ``high`` after the box.

        ``rows()`` are the cells of the box; ``rows(0, 1)`` adds one index at the high end of every
        direction (faces and corners), ``rows(1, 1)`` one ghost cell all around.
        """
        first = [np.arange(GHOSTS - low, GHOSTS + k + high) for k in self.n[:-1]]
        start = np.zeros((), dtype=np.int64)
        for index, stride in zip(first, self.strides[:-1], strict=True):
            start = np.add.outer(start, index * stride)
        return np.ascontiguousarray(start.ravel() + GHOSTS - low), self.n[-1] + low + high

    def field(self, dtype=np.float64) -> np.ndarray:
        """A new field of zeros, flat, shape ``(size,)``."""
        return np.zeros(self.size, dtype)

    def padded(self, q: np.ndarray) -> np.ndarray:
        """View of a flat field with its ghosts, shape ``shape``."""
        return q.reshape(self.shape)

    def inside(self, q: np.ndarray, face: int | None = None) -> np.ndarray:
        """View of a flat field without its ghosts: cells, shape ``n``; with ``face=a`` also the high face of ``a``."""
        return self.padded(q)[tuple(slice(GHOSTS, GHOSTS + k + (a == face)) for a, k in enumerate(self.n))]

    def coordinate(self, a: int, face: bool = False, ghosts: int = 0) -> np.ndarray:
        """Coordinates along direction ``a`` [length]: centres, shape ``(n,)``, or all faces, shape ``(n + 1,)``."""
        first, last = -ghosts, self.n[a] + ghosts + face
        return self.origin[a] + (np.arange(first, last) + (0.0 if face else 0.5)) * self.h

    def points(self, face: int | None = None, ghosts: int = GHOSTS) -> tuple[np.ndarray, ...]:
        """Open mesh of coordinates of the padded shape: at centres, or on the low faces of direction ``face``."""
        lines = [
            self.origin[a] + (np.arange(-ghosts, k + ghosts) + (0.0 if a == face else 0.5)) * self.h
            for a, k in enumerate(self.n)
        ]
        return tuple(np.meshgrid(*lines, indexing="ij", sparse=True))

    def sample(self, function, face: int | None = None, dtype=np.float64) -> np.ndarray:
        """Flat field of ``function(x, y[, z])``, ghosts included, at centres or on the low faces of ``face``."""
        values = np.broadcast_to(function(*self.points(face)), self.shape)
        return np.array(values, dtype=dtype, order="C").ravel()
