"""Transforms along every axis against the stencil itself."""

import numpy as np
import pytest

from fsiwork.core.poisson import Direct
from fsiwork.core.spectral import Spectral

PAIRS = [("periodic",) * 2, ("neumann",) * 2, ("dirichlet",) * 2, ("node",) * 2, ("neumann", "dirichlet")]


def laplacian(q, h, ends):
    """∇² by the stencil, with what lies beyond the ends."""
    out = np.zeros_like(q)
    for a, (low, high) in enumerate(ends):
        first, last = np.take(q, [0], a), np.take(q, [-1], a)
        beyond = {"neumann": 1.0, "dirichlet": -1.0, "node": 0.0}
        before = last if low == "periodic" else beyond[low] * first
        after = first if high == "periodic" else beyond[high] * last
        full = np.concatenate([before, q, after], axis=a)
        out += np.diff(full, 2, axis=a)
    return out / h**2


@pytest.mark.parametrize("first", PAIRS)
@pytest.mark.parametrize("second", PAIRS)
def test_the_inverse_of_the_stencils_polynomial(first, second):
    ends, h = (first, second), 0.1
    q = np.random.default_rng(1).normal(size=(12, 9))
    two = laplacian(q, h, ends)
    f = 1.0 * q - 0.03 * two + 2e-4 * laplacian(two, h, ends)
    assert np.abs(Spectral(q.shape, h, ends).solve(f, 1.0, 0.03, 2e-4) - q).max() < 1e-12


def test_three_directions_and_no_biharmonic_part():
    ends = (("node", "node"), ("dirichlet", "dirichlet"), ("periodic", "periodic"))
    f = np.random.default_rng(2).normal(size=(7, 8, 10))
    wanted = Direct(f.shape, 0.2, ends).solve(f.copy(), 1.0, 0.05)
    assert np.abs(Spectral(f.shape, 0.2, ends).solve(f, 1.0, 0.05, 0.0) - wanted).max() < 1e-13


def test_what_it_cannot_solve_is_refused():
    with pytest.raises(ValueError, match="no transform for the ends"):
        Spectral((8, 8), 0.1, (("node", "dirichlet"), ("periodic", "periodic")))
    with pytest.raises(ValueError, match="c0 > 0"):
        Spectral((8, 8), 0.1, (("periodic",) * 2,) * 2).solve(np.zeros((8, 8)), 0.0, 1.0, 0.0)
