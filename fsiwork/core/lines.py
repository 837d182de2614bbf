"""Diffusion line by line: the factored form of an implicit step."""

from collections.abc import Sequence

import numpy as np

from fsiwork.core.ends import END_ROWS, Ends, check_ends
from fsiwork.core.kernels.poisson import lines_across, lines_along

BLOCK = 1024  # columns of one sweep


class Lines:
    """Π_a (1 − α ∂_aa) q = f, one tridiagonal solve a line: diffusion in increment form, with an error O(α²).

    ``n``, ``h`` and ``ends`` as in `Direct`; every mixture of ends on every axis.
    """

    def __init__(self, n: Sequence[int], h: float, ends: Ends):
        self.n = tuple(int(k) for k in n)
        self.h = float(h)
        self.ends = check_ends(self.n, ends)
        self._key = None
        self._blocks = [self._columns(a) for a in range(len(self.n) - 1)]

    def _columns(self, a: int) -> np.ndarray:
        run = int(np.prod(self.n[a + 1 :]))
        first = np.arange(int(np.prod(self.n[:a]))) * run * self.n[a]
        start = np.array([k + c for k in first for c in range(0, run, BLOCK)])
        return np.stack([start, start, np.minimum(BLOCK, run - start % run)], axis=1)

    def _coefficients(self, a: int, ratio: float, dtype) -> tuple[np.ndarray, int]:
        """g, factors of f, and weights of the periodic sums for 1 − α ∂_aa, ratio = α/h²."""
        n, sigma = self.n[a], 1 / ratio
        r = np.exp(-2 * np.arcsinh(np.sqrt(sigma) / 2))
        c = np.zeros((4, n))
        c[1] = sigma
        reach = 0
        if self.ends[a][0] == "periodic":
            reach = int(min(n, np.ceil(np.log(0.25 * np.finfo(dtype).eps) / np.log(r))))
            power = r ** np.arange(n) / -np.expm1(n * np.log(r))
            c[0], c[2], c[3] = r, sigma * power[::-1], r * power
        else:
            diagonal = np.full(n, 2 + sigma)
            for i, word in ((0, self.ends[a][0]), (-1, self.ends[a][1])):
                d, w = END_ROWS[word]
                diagonal[i] = d + w * sigma
                c[1, i] *= w
            w = diagonal[0]
            c[0, 0] = 1 / w
            for i in range(1, n):
                w = diagonal[i] - 1 / w
                c[0, i] = 1 / w
        return c.astype(dtype), reach

    def solve(self, f: np.ndarray, alpha: float) -> np.ndarray:
        """q in place of ``f`` (contiguous, shape ``n``, float32 or float64); ``alpha`` >= 0 [length²].

        Coefficients are kept while alpha and the dtype stay the same. Raises ValueError for a wrong array or alpha.
        """
        if f.shape != self.n or not f.flags.c_contiguous or f.dtype.kind != "f":
            raise ValueError(f"a contiguous real array of shape {self.n} is needed, got {f.dtype} {f.shape}")
        if not alpha >= 0:
            raise ValueError(f"alpha must not be negative, got {alpha}")
        if alpha == 0:
            return f
        if (alpha, f.dtype) != self._key:
            self._lines = [self._coefficients(a, alpha / self.h**2, f.dtype) for a in range(len(self.n))]
            self._key = (alpha, f.dtype)
        for a, blocks in enumerate(self._blocks):
            c, reach = self._lines[a]
            lines_across(f.reshape(-1), c, reach, blocks, int(np.prod(self.n[a + 1 :])))
        c, reach = self._lines[-1]
        lines_along(f.reshape(-1, self.n[-1]), c, reach)
        return f
