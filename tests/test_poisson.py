"""Direct, line and multigrid solvers against dense and sparse solves of the same stencils."""

from itertools import product

import numpy as np
import pytest

from fsiwork.core.poisson import Direct, Lines

SINGLE = ("neumann", "dirichlet", "node", "node-neumann")
PAIRS = [("periodic", "periodic"), *product(SINGLE, SINGLE)]
TRANSFORMABLE = [pair for pair in PAIRS if pair[0] == "periodic" or len({"node" in word for word in pair}) == 1]


def line(n, pair):
    """The stencil −h² ∂_aa of one axis, written down from the words alone."""
    a = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    for i, inner, word in ((0, 1, pair[0]), (n - 1, n - 2, pair[1])):
        if word == "periodic":
            a[i, n - 1 - i] -= 1
        elif word == "neumann":
            a[i, i] -= 1
        elif word == "dirichlet":
            a[i, i] += 1
        elif word == "node-neumann":
            a[i, inner] -= 1
    return a


def laplacian(n, ends, h):
    """Dense −∇² of any number of axes."""
    total = 0
    for a, pair in enumerate(ends):
        term = np.eye(1)
        for b, k in enumerate(n):
            term = np.kron(term, line(k, pair) if a == b else np.eye(k))
        total = total + term
    return total / h**2


def singular_weights(n, ends):
    """Points on a mirror boundary count half."""
    weights = np.ones(n)
    for a, pair in enumerate(ends):
        for i, word in ((0, pair[0]), (-1, pair[1])):
            if word == "node-neumann":
                np.moveaxis(weights, a, 0)[i] *= 0.5
    return weights / weights.sum()


def dense(n, ends, h, f, c0, c1):
    """Dense solution, of weighted mean zero in the singular case."""
    matrix = c0 * np.eye(f.size) + c1 * laplacian(n, ends, h)
    words = {word for pair in ends for word in pair}
    if c0 == 0 and not words & {"dirichlet", "node"}:
        w = singular_weights(n, ends)
        f = f - (w * f).sum()
        return np.linalg.solve(matrix + np.abs(matrix).max() * np.outer(np.ones(f.size), w.ravel()), f.ravel()).reshape(
            n
        )
    return np.linalg.solve(matrix, f.ravel()).reshape(n)


def agree(q, exact, tolerance=1e-12):
    return np.abs(q - exact).max() <= tolerance * np.abs(exact).max()


@pytest.mark.parametrize("slow", PAIRS)
@pytest.mark.parametrize("fast", TRANSFORMABLE)
def test_direct_2d_is_the_dense_solve(slow, fast):
    rng = np.random.default_rng(1)
    for n, ends in (((6, 9), (slow, fast)), ((8, 5), (fast, slow))):
        solver = Direct(n, 0.3, ends)
        for c0, c1 in ((0.0, 1.0), (2.0, 0.4), (0.0, 3.0)):
            f = rng.standard_normal(n)
            assert agree(solver.solve(f.copy(), c0, c1), dense(n, ends, 0.3, f, c0, c1))


@pytest.mark.parametrize("ends", [(PAIRS[i % 17], a, b) for i, (a, b) in enumerate(product(TRANSFORMABLE, repeat=2))])
def test_direct_3d_is_the_dense_solve(ends):
    rng = np.random.default_rng(2)
    for n, order in (((5, 4, 6), ends), ((4, 6, 5), ends[::-1]), ((4, 7, 4), (ends[1], ends[0], ends[2]))):
        f = rng.standard_normal(n)
        assert agree(Direct(n, 0.7, order).solve(f.copy()), dense(n, order, 0.7, f, 0.0, 1.0))


@pytest.mark.parametrize("pair", PAIRS)
def test_lines_are_the_product_of_dense_lines(pair):
    rng = np.random.default_rng(3)
    for n in ((9, 21), (5, 6, 7), (30, 17)):
        ends = [pair, *PAIRS[2 : 2 + len(n) - 1]]
        for order in (ends, ends[::-1]):
            solver = Lines(n, 0.5, order)
            for alpha in (0.02, 1.3):
                f = rng.standard_normal(n)
                exact = f.copy()
                for a, k in enumerate(n):
                    matrix = np.eye(k) + alpha / 0.25 * line(k, order[a])
                    exact = np.moveaxis(np.tensordot(np.linalg.inv(matrix), exact, (1, a)), 0, a)
                assert agree(solver.solve(f, alpha), exact)
