"""Direct solver with constant coefficients, cosine and sine transforms with elimination; door to the other two."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numba
import numpy as np
import scipy.fft
import scipy.fftpack

from fsiwork.core.ends import END_ROWS, Ends, check_ends, is_singular
from fsiwork.core.kernels.poisson import factorise, singular_line, sweep, transpose
from fsiwork.core.lines import Lines
from fsiwork.core.multigrid import NotConverged, Variable

__all__ = ["Direct", "Lines", "NotConverged", "Variable"]

BLOCK = 1024  # columns of one sweep in 2D


@dataclass(frozen=True)
class Transform:
    """The transform whose basis diagonalises the stencil of one pair of ends (scipy's numbering of types).

    Basis k has angle π (k + shift)/(n + extra) and the eigenvalue 4 sin²(angle/2); forward and back multiply by
    2 (n + extra); ``cost`` is the measured time of both at a good length [ns per cell].
    """

    function: Callable
    types: tuple[int, int]
    shift: float
    extra: int
    cost: float

    def eigenvalues(self, n: int) -> np.ndarray:
        return 4 * np.sin(np.pi * (np.arange(n) + self.shift) / (2 * (n + self.extra))) ** 2

    def apply(self, q: np.ndarray, axis: int, inverse: bool) -> np.ndarray:
        """In place along one axis, as many threads as the kernels."""
        kind = self.types[inverse]
        return self.function(q, kind, axis=axis, overwrite_x=True, workers=numba.get_num_threads())


@dataclass(frozen=True)
class Periodic:
    """The real Fourier transform in fftpack's packed order (0, 1, 1, 2, 2, ...), which works in place."""

    extra: int = 0
    cost: float = 2.6

    def eigenvalues(self, n: int) -> np.ndarray:
        return 4 * np.sin(np.pi * ((np.arange(n) + 1) // 2) / n) ** 2

    def apply(self, q: np.ndarray, axis: int, inverse: bool) -> np.ndarray:
        return (scipy.fftpack.irfft if inverse else scipy.fftpack.rfft)(q, axis=axis, overwrite_x=True)


_cosine, _sine = partial(Transform, scipy.fft.dct), partial(Transform, scipy.fft.dst)
TRANSFORMS = {
    ("periodic", "periodic"): Periodic(),
    ("neumann", "neumann"): _cosine((2, 3), 0.0, 0, 3.6),
    ("neumann", "dirichlet"): _cosine((4, 4), 0.5, 0, 3.5),
    ("dirichlet", "neumann"): _sine((4, 4), 0.5, 0, 3.8),
    ("dirichlet", "dirichlet"): _sine((2, 3), 1.0, 0, 3.9),
    ("node", "node"): _sine((1, 1), 1.0, 1, 5.8),
    ("node", "node-neumann"): _sine((3, 2), 0.5, 0, 3.9),
    ("node-neumann", "node"): _cosine((3, 2), 0.5, 0, 3.6),
    ("node-neumann", "node-neumann"): _cosine((1, 1), 0.0, -1, 5.8),
}


def _cost(pair: tuple[str, str], n: int) -> float:
    """Time of the transforms of one axis [ns per cell]; infinite when no transform fits the ends."""
    transform = TRANSFORMS.get(pair)
    if transform is None:
        return np.inf
    m = n + transform.extra
    return transform.cost * (1 if scipy.fft.next_fast_len(m, real=True) == m else 3)


class Direct:
    """(c0 − c1 ∇²) q = f with the second-order stencil: elimination along one axis, transforms along the others.

    Parameters
    ----------
    n : unknowns along each axis (1 to 3 axes)
    h : grid step [length]
    ends : (low, high) of each axis: "periodic" (both), "neumann" (mirror half a cell outside the first unknown),
        "dirichlet" (odd mirror there), "node" (value 0 one whole cell outside), "node-neumann" (mirror about the
        unknown itself). One axis takes any mixture; the others need a pair listed in `TRANSFORMS`.
    dtype : float64 or float32

    Raises ValueError for ends that it cannot solve. Memory: one more field of factors when open.
    """

    def __init__(self, n: Sequence[int], h: float, ends: Ends, dtype=np.float64):
        self.n = tuple(int(k) for k in n)
        self.h = float(h)
        self.ends = check_ends(self.n, ends)
        self.dtype = np.dtype(dtype)
        self.axis = self._line_axis()
        self.others = [a for a in range(len(n)) if a != self.axis]
        self._turned = self.axis == len(n) - 1 > 0  # the last axis goes first, through a copy
        shape = (self.n[-1], *self.n[:-1]) if self._turned else self.n
        line = 0 if self._turned else self.axis
        self._copy = np.empty(shape, self.dtype) if self._turned else None
        self._transforms = [(TRANSFORMS[self.ends[a]], a + self._turned) for a in self.others]
        self._plan(shape, line)
        self._coefficients = None

    def _line_axis(self) -> int:
        """The axis of the elimination: where the transforms of the others (and a turn of the array) cost least."""
        costs = [_cost(pair, k) for pair, k in zip(self.ends, self.n, strict=True)]
        dim = len(self.n)
        rest = [sum(costs[:a] + costs[a + 1 :]) + 2.4 * (a == dim - 1 > 0) for a in range(dim)]
        best = int(np.argmin(rest))
        if not np.isfinite(rest[best]):
            raise ValueError(f"only one axis may mix ends half a cell and a whole cell away, got {self.ends}")
        return best

    def _plan(self, shape: tuple[int, ...], line: int) -> None:
        """Blocks of neighbouring columns, eigenvalues a column, and room for the factors."""
        self._lines = shape[line]
        self._stride = int(np.prod(shape[line + 1 :]))
        before = int(np.prod(shape[:line]))
        columns = before * self._stride
        width = min(shape[-1] if line < len(shape) - 1 else 1, BLOCK)
        run = shape[-1] if line < len(shape) - 1 else 1
        column = np.array([c + k for c in range(0, columns, run) for k in range(0, run, width)])
        start = column // self._stride * self._lines * self._stride + column % self._stride
        self._blocks = np.stack([start, column, np.minimum(width, run - column % run)], axis=1)
        grids = [t.eigenvalues(self.n[a]) for (t, _), a in zip(self._transforms, self.others, strict=True)]
        self._eigenvalues = sum(np.ix_(*grids)).ravel() if grids else np.zeros(1)
        self._scale = 1.0
        for (transform, _), a in zip(self._transforms, self.others, strict=True):
            if isinstance(transform, Transform):
                self._scale /= 2 * (self.n[a] + transform.extra)
        pair = self.ends[self.axis]
        self._periodic = pair[0] == "periodic"
        self._rows = np.array([END_ROWS.get(word, (2.0, 1.0)) for word in pair]).ravel()
        self._tail = np.zeros((3, columns), self.dtype)
        self._counts = np.zeros((2, len(self._blocks), self._lines), np.int64)
        self._factors = np.empty(0 if self._periodic else columns * self._lines, self.dtype)  # pages touched as needed

    def _factorise(self, c0: float, c1: float) -> None:
        if not (c1 > 0 and c0 >= 0):
            raise ValueError(f"c0 >= 0 and c1 > 0 are needed, got c0 = {c0}, c1 = {c1}")
        self._coefficients = (c0, c1)
        self._singular = c0 == 0 and is_singular(self.ends)
        sigma = self._eigenvalues + c0 * self.h**2 / c1
        theta = 2 * np.arcsinh(np.sqrt(sigma) / 2)  # r + 1/r = 2 + σ,  r = exp(−θ)
        if self._singular:
            theta[0] = 1.0  # solved apart; any number that stays finite
            sigma[0] = 2 * np.cosh(1.0) - 2
        self._tail[0] = np.exp(-theta)
        if self._periodic:
            self._tail[1] = -1 / np.expm1(-theta * self._lines)
            far = -np.log(0.25 * np.finfo(self.dtype).eps)
            for b, (_, column, width) in enumerate(self._blocks):
                reach = np.minimum(far / theta[column : column + width], self._lines)  # falls with the eigenvalue
                self._counts[1, b] = np.searchsorted(-reach, -np.arange(self._lines), side="left")
        else:
            factorise(
                self._factors, self._tail, self._counts, sigma, self._blocks, self._rows, self._stride, self._lines
            )
        scale = self._scale * self.h**2 / c1
        self._scales = (scale * np.array([self._rows[1], 1.0, self._rows[3]])).astype(self.dtype)
        self._weights = np.ones(self._lines)
        self._weights[[0, -1]] = self._rows[[1, 3]]

    def solve(self, f: np.ndarray, c0: float = 0.0, c1: float = 1.0) -> np.ndarray:
        """q of (c0 − c1 ∇²) q = f; ``f``, shape ``n``, contiguous, of the solver's dtype, is overwritten and returned.

        Without c0 and with Neumann or periodic ends only, the mean of f is dropped and q has mean zero (a point on
        a "node-neumann" boundary counts half). Factors are kept while c0 and c1 stay the same.
        Raises ValueError for a wrong array or coefficients.
        """
        if f.shape != self.n or f.dtype != self.dtype or not f.flags.c_contiguous:
            raise ValueError(f"a contiguous {self.dtype} array of shape {self.n} is needed, got {f.dtype} {f.shape}")
        if (c0, c1) != self._coefficients:
            self._factorise(c0, c1)
        q = f
        if self._turned:
            transpose(self._copy.reshape(self.n[-1], -1), f.reshape(-1, self.n[-1]))
            q = self._copy
        for transform, axis in reversed(self._transforms):
            q = transform.apply(q, axis, inverse=False)
        self._eliminate(q)
        for transform, axis in self._transforms:
            q = transform.apply(q, axis, inverse=True)
        if self._turned:
            transpose(f.reshape(-1, self.n[-1]), q.reshape(self.n[-1], -1))
            return f
        return q

    def _eliminate(self, q: np.ndarray) -> None:
        flat = q.reshape(-1)
        constant = flat[:: self._stride][: self._lines]
        if self._singular:
            mode = np.empty(self._lines)
            singular_line(mode, constant * float(self._scales[1]), self._weights, self._periodic)
        sweep(flat, self._factors, self._tail, self._counts, self._blocks, self._scales, self._stride, self._lines)
        if self._singular:
            constant[:] = mode
