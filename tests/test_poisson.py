"""Direct, line and multigrid solvers against dense and sparse solves of the same stencils."""

import tracemalloc
from itertools import product

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from fsiwork.core.poisson import Direct, Lines, NotConverged, Variable

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


def apply_laplacian(q, ends, h):
    """−∇² without a matrix, for grids too large for a dense one."""
    return (
        sum(
            np.moveaxis(np.tensordot(line(k, pair), q, (1, a)), 0, a)
            for a, (k, pair) in enumerate(zip(q.shape, ends, strict=True))
        )
        / h**2
    )


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize(
    "n, ends",
    [
        ((200, 240), [PAIRS[1], PAIRS[1]]),
        ((160, 96), [PAIRS[0], PAIRS[0]]),
        ((127, 128), [("node", "node"), ("dirichlet", "dirichlet")]),
        ((128, 127), [("dirichlet", "dirichlet"), ("node", "node")]),
        ((90, 127), [("neumann", "neumann"), ("node", "neumann")]),
        ((20, 1500), [("neumann", "dirichlet"), ("neumann", "neumann")]),
        ((1500, 20), [("periodic", "periodic"), ("neumann", "dirichlet")]),
        ((24, 23, 24), [("dirichlet", "dirichlet"), ("node", "node"), ("dirichlet", "dirichlet")]),
        ((32, 30, 23), [("periodic", "periodic"), ("neumann", "neumann"), ("node", "neumann")]),
    ],
)
def test_direct_leaves_only_round_off_and_works_in_place(n, ends, dtype):
    """Long lines, where the stored factors are cut off, and the elimination turned to another axis."""
    solver = Direct(n, 0.1, ends, dtype)
    for c0 in (0.0, 30.0, 0.0):
        f = np.random.default_rng(4).standard_normal(n).astype(dtype)
        f -= f.mean()
        rest = f.astype(np.float64)
        q = solver.solve(f, c0, 1.0)
        assert q.dtype == dtype and np.shares_memory(q, f)
        rest -= c0 * q + apply_laplacian(q.astype(np.float64), ends, 0.1)
        assert np.abs(rest).max() < 20 * np.finfo(dtype).eps * (np.abs(q).max() / 0.1**2)


def test_direct_drops_the_mean_and_returns_mean_zero():
    f = np.random.default_rng(5).standard_normal((40, 30))
    for ends in ([("neumann", "neumann")] * 2, [("periodic", "periodic")] * 2):
        q = Direct(f.shape, 0.1, ends).solve(f + 7.0)
        assert abs(q.mean()) < 1e-13 * np.abs(q).max()
        assert agree(q, Direct(f.shape, 0.1, ends).solve(f.copy()))


@pytest.mark.parametrize(
    "ends, exact, rate",
    [
        (("neumann", "neumann"), lambda x: np.cos(2 * np.pi * x), 4),
        (("dirichlet", "dirichlet"), lambda x: np.sin(2 * np.pi * x), 4),
        (("periodic", "periodic"), lambda x: np.sin(2 * np.pi * x), 4),
        (("neumann", "dirichlet"), lambda x: np.cos(2.5 * np.pi * x), 6.25),
        (("dirichlet", "neumann"), lambda x: np.sin(2.5 * np.pi * x), 6.25),
    ],
)
def test_order_two_towards_the_differential_equation(ends, exact, rate):
    """−∇² of products of eigenfunctions, whatever the ends."""
    errors = []
    for n in (32, 64):
        x = (np.arange(n) + 0.5) / n
        q = np.multiply.outer(exact(x), np.cos(np.pi * x))
        f = (rate + 1) * np.pi**2 * q
        errors.append(np.abs(Direct((n, n), 1 / n, [ends, ("neumann", "neumann")]).solve(f) - q).max())
    assert 1.95 < np.log2(errors[0] / errors[1]) < 2.05


def test_extruded_field_gives_the_plane_solution():
    ends = [("neumann", "dirichlet"), ("periodic", "periodic")]
    f = np.random.default_rng(6).standard_normal((24, 20))
    plane = Direct((24, 20), 0.1, ends).solve(f.copy())
    beta = [np.exp(np.random.default_rng(7).standard_normal(s)) for s in ((25, 20), (24, 21))]
    variable = Variable((24, 20), 0.1, ends, rtol=1e-13).solve(beta, f).copy()
    for place in range(3):
        for end in (("neumann", "neumann"), ("periodic", "periodic")):
            n, box = list(f.shape), list(ends)
            n.insert(place, 6)
            box.insert(place, end)
            thick = np.ascontiguousarray(np.broadcast_to(np.expand_dims(f, place), n))
            layers = np.moveaxis(Direct(n, 0.1, box).solve(thick.copy()), place, 0)
            assert all(agree(layer, plane) for layer in layers)
            faces = [np.repeat(np.expand_dims(b, place), 6, place) for b in beta]
            faces.insert(place, np.ones([k + (a == place) for a, k in enumerate(n)]))
            layers = np.moveaxis(Variable(n, 0.1, box, rtol=1e-13).solve(faces, thick), place, 0)
            assert all(agree(layer, variable, 1e-11) for layer in layers)


@pytest.mark.parametrize(
    "call, text",
    [
        (lambda: Direct((8, 8), 0.1, [("wall", "wall"), ("node", "node")]), "axis 0"),
        (lambda: Direct((8, 8), 0.1, [("neumann", "neumann"), ("periodic", "node")]), "axis 1"),
        (lambda: Direct((8, 8), 0.1, [("node", "neumann")] * 2), "only one axis"),
        (lambda: Direct((8, 8), 0.1, [("node", "node")] * 2).solve(np.zeros((8, 9))), "shape"),
        (lambda: Direct((8, 8), 0.1, [("node", "node")] * 2).solve(np.zeros((8, 8)), 1.0, 0.0), "c1 > 0"),
        (lambda: Lines((8, 8), 0.1, [("node", "node")] * 2).solve(np.zeros((8, 8)), -1.0), "alpha"),
        (lambda: Variable((8, 8), 0.1, [("node", "node-neumann")] * 2), "node-neumann"),
        (lambda: Variable((8, 8), 0.1, [("node", "node")] * 2).solve([np.ones((8, 8))] * 2, np.ones((8, 8))), "faces"),
    ],
)
def test_wrong_input_is_refused(call, text):
    with pytest.raises(ValueError, match=text):
        call()


def variable_matrix(beta, ends, h):
    """Sparse −div(β grad) from differences D and face values: Dᵀ β D, end faces as the words say."""
    n = [b.shape[a] - 1 for a, b in enumerate(beta)]
    total = 0
    for a, (low, high) in enumerate(ends):
        k = n[a]
        d = sparse.diags_array([np.ones(k), -np.ones(k)], offsets=[0, -1], shape=(k + 1, k)).tolil()
        weight = np.ones(k + 1)
        if low == "periodic":
            d[0, k - 1] = -1
            weight[k] = 0
        else:
            weight[0], weight[k] = ({"neumann": 0, "dirichlet": 2, "node": 1}[word] for word in (low, high))
        grown = sparse.eye_array(1)
        for b in range(len(n)):
            grown = sparse.kron(grown, d if b == a else sparse.eye_array(n[b]))
        shape = [-1 if b == a else 1 for b in range(len(n))]
        total = total + grown.T @ sparse.diags_array((beta[a] * weight.reshape(shape)).ravel()) @ grown
    return sparse.csc_array(total) / h**2


def bubble(n, ratio, periodic):
    """1/ρ on faces, ρ = ratio in a ball, 1 outside."""
    x = np.meshgrid(*[(np.arange(k) + 0.5) / max(n) for k in n], indexing="ij")
    rho = np.where(sum((c - 0.4) ** 2 for c in x) < 0.06, float(ratio), 1.0)
    faces = []
    for a in range(len(n)):
        r = np.pad(rho, [(int(a == b),) * 2 for b in range(len(n))], mode="wrap" if periodic[a] else "edge")
        low, high = (np.take(r, np.arange(i, n[a] + 1 + i), axis=a) for i in (0, 1))
        faces.append(2 / (low + high))
    return faces


@pytest.mark.parametrize("ratio", [1000, 0.001])
@pytest.mark.parametrize(
    "n, ends",
    [
        ((48, 48), [("neumann", "neumann")] * 2),
        ((37, 50), [("neumann", "neumann"), ("periodic", "periodic")]),
        ((51, 33), [("periodic", "periodic")] * 2),
        ((13, 60), [("neumann", "dirichlet"), ("node", "neumann")]),
        ((64, 3), [("dirichlet", "dirichlet"), ("neumann", "neumann")]),
        ((3, 2), [("periodic", "periodic"), ("dirichlet", "neumann")]),
        ((12, 15, 10), [("neumann", "neumann")] * 3),
        ((9, 14, 11), [("periodic", "periodic"), ("neumann", "dirichlet"), ("periodic", "periodic")]),
        ((14, 3, 9), [("node", "node"), ("periodic", "periodic"), ("dirichlet", "neumann")]),
    ],
)
def test_variable_is_the_sparse_solve(n, ends, ratio):
    rng = np.random.default_rng(8)
    beta = bubble(n, ratio, [pair[0] == "periodic" for pair in ends])
    f = rng.standard_normal(n)
    solver = Variable(n, 1 / max(n), ends, rtol=1e-12)
    q = solver.solve(beta, f, rng.standard_normal(n)).copy()
    matrix = variable_matrix(beta, ends, 1 / max(n))
    if {word for pair in ends for word in pair} <= {"neumann", "periodic"}:
        f = f - f.mean()
        assert abs(q.mean()) < 1e-13 * np.abs(q).max()
        exact = np.zeros(f.size)
        exact[1:] = splu(matrix[1:, 1:]).solve(f.ravel()[1:])
        exact = (exact - exact.mean()).reshape(n)
    else:
        exact = splu(matrix).solve(f.ravel()).reshape(n)
    assert agree(q, exact, 1e-9)
    assert solver.iterations <= 45 and solver.residual <= 1e-12
    assert np.linalg.norm(f.ravel() - matrix @ q.ravel()) < 1e-10 * np.linalg.norm(f)


def test_iterations_hardly_grow_with_the_grid():
    counts = []
    for n in (32, 64, 128):
        solver = Variable((n, n), 1 / n, [("neumann", "neumann")] * 2, rtol=1e-8)
        solver.solve(bubble((n, n), 1000, (False, False)), np.random.default_rng(9).standard_normal((n, n)))
        counts.append(solver.iterations)
    assert counts[-1] <= 25 and counts[-1] <= counts[0] + 8


def test_variable_starts_from_the_guess_and_stops_at_zero():
    ends = [("neumann", "dirichlet"), ("periodic", "periodic")]
    beta = bubble((24, 24), 10, (False, True))
    solver = Variable((24, 24), 0.1, ends)
    f = np.random.default_rng(10).standard_normal((24, 24))
    q = solver.solve(beta, f)
    first = q.copy()
    assert np.shares_memory(solver.solve(beta, f, q), q) and solver.iterations <= 1 and agree(q, first, 1e-9)
    assert not solver.solve(beta, np.zeros((24, 24))).any() and solver.iterations == 0


def test_not_converged_names_residual_and_iterations():
    solver = Variable((32, 32), 1 / 32, [("neumann", "neumann")] * 2, rtol=1e-10, most=3)
    with pytest.raises(NotConverged, match=r"residual \d\.\de[-+]\d+ .* 3 iterations, wanted 1.0e-10$") as caught:
        solver.solve(bubble((32, 32), 1000, (False, False)), np.random.default_rng(11).standard_normal((32, 32)))
    assert "\n" not in str(caught.value)
    with pytest.raises(NotConverged, match="nan"):
        solver.solve(bubble((32, 32), 1, (False, False)), np.full((32, 32), np.nan))


def test_a_second_solve_allocates_no_field():
    n, ends = (256, 256), [("neumann", "neumann")] * 2  # NumPy's own buffers: up to 0.2 MB
    direct, lines, variable = Direct(n, 0.1, ends), Lines(n, 0.1, ends), Variable(n, 0.1, ends)
    beta, f = bubble(n, 10, (False, False)), np.random.default_rng(12).standard_normal(n)
    for work in (lambda: direct.solve(f), lambda: lines.solve(f, 0.1), lambda: variable.solve(beta, f)):
        work()
        tracemalloc.start()
        work()
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < f.nbytes / 2
