"""Polynomials of the discrete Laplacian inverted by transforms along every axis."""

from collections.abc import Sequence

import numpy as np

from fsiwork.core.ends import Ends, check_ends
from fsiwork.core.poisson import TRANSFORMS, Periodic


class Spectral:
    """(c0 − c1 ∇² + c2 ∇⁴) q = f with the second-order stencil of ∇², applied twice for ∇⁴.

    ``n``, ``h``, ``ends`` as for `core.poisson.Direct`, but every pair of ends must be one of `TRANSFORMS`: what
    holds there for q holds for ∇²q too. Raises ValueError for others.
    """

    def __init__(self, n: Sequence[int], h: float, ends: Ends):
        self.n = tuple(int(k) for k in n)
        pairs = check_ends(self.n, ends)
        missing = [pair for pair in pairs if pair not in TRANSFORMS]
        if missing:
            raise ValueError(f"no transform for the ends {missing[0]}")
        self._transforms = [TRANSFORMS[pair] for pair in pairs]
        lines = [t.eigenvalues(k) for t, k in zip(self._transforms, self.n, strict=True)]
        self._eigenvalues = sum(np.ix_(*lines)) / h**2
        self._scale = 1.0
        for t, k in zip(self._transforms, self.n, strict=True):
            if not isinstance(t, Periodic):
                self._scale /= 2 * (k + t.extra)
        self._factors, self._coefficients = np.empty(self.n), None

    def solve(self, f: np.ndarray, c0: float, c1: float, c2: float) -> np.ndarray:
        """q, in place of ``f``, contiguous, shape ``n``. Raises ValueError unless c0 > 0, c1 ≥ 0 and c2 ≥ 0."""
        if (c0, c1, c2) != self._coefficients:
            if not (c0 > 0 and c1 >= 0 and c2 >= 0):
                raise ValueError(f"c0 > 0, c1 >= 0 and c2 >= 0 are needed, got {c0}, {c1}, {c2}")
            np.divide(self._scale, c0 + self._eigenvalues * (c1 + c2 * self._eigenvalues), out=self._factors)
            self._coefficients = (c0, c1, c2)
        for axis, transform in reversed(list(enumerate(self._transforms))):
            f = transform.apply(f, axis, inverse=False)
        f *= self._factors
        for axis, transform in enumerate(self._transforms):
            f = transform.apply(f, axis, inverse=True)
        return f
