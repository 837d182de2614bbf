"""Level-set functions against one-liners, exact curvatures, lengths, and the plane inside the extruded box."""

import numpy as np
import pytest

from fsiwork.core import levelset
from fsiwork.core.grid import GHOSTS, Grid

KINDS = {
    "cosine": lambda r: np.where(abs(r) < 1, (1 + np.cos(np.pi * r)) / 2, 0),
    "hat": lambda r: np.maximum(1 - abs(r), 0),
}


def sample(grid, function, dtype=np.float64):
    return grid.sample(function, dtype=dtype).copy()


def ring(grid, q, ghosts=1):
    """Cells and ``ghosts`` layers around them."""
    return grid.padded(q)[tuple(slice(GHOSTS - ghosts, GHOSTS + k + ghosts) for k in grid.n)]


def unit_box(n, dim):
    return Grid((n,) * dim, 2 / n, (-1.0,) * dim)


def test_heaviside_and_its_derivative():
    phi, eps = np.linspace(-0.4, 0.4, 801), 0.25
    found = levelset.heaviside(phi, eps)
    r = np.clip(phi / eps, -1, 1)
    np.testing.assert_allclose(found, (1 + r + np.sin(np.pi * r) / np.pi) / 2, atol=1e-15)
    assert (found[phi <= -eps] == 0).all() and (found[phi >= eps] == 1).all()
    slope = (levelset.heaviside(phi + 1e-5, eps) - levelset.heaviside(phi - 1e-5, eps)) / 2e-5
    np.testing.assert_allclose(levelset.dirac(phi, eps), slope, atol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_dirac_is_the_formula_and_zero_outside(kind, dtype):
    grid, eps = Grid((12, 10), 0.1), 0.3
    phi = sample(grid, lambda x, y: np.sin(3 * x) + 0.7 * y**2 - 0.5, dtype)
    tolerance = 20 * np.finfo(dtype).eps / eps
    plain = levelset.dirac(phi, eps, kind)
    assert plain.dtype == dtype
    np.testing.assert_allclose(plain, KINDS[kind](phi / eps) / eps, atol=tolerance)
    assert (plain[abs(phi) >= eps] == 0).all()
    slopes = [np.gradient(grid.padded(phi).astype(float), grid.h, axis=a) for a in grid.axes]
    inside = (slice(2, -2),) * 2
    for scaling, slope in (("renormalised", np.hypot(*slopes)), ("one-norm", abs(slopes[0]) + abs(slopes[1]))):
        found = grid.padded(levelset.dirac(phi, eps, kind, scaling, grid))[inside]
        w = eps * slope[inside]
        wanted = KINDS[kind](grid.padded(phi)[inside] / w) / w
        np.testing.assert_allclose(found, wanted, atol=100 * tolerance)


def test_one_norm_hat_gives_an_inclined_line_its_length():
    grid = Grid((16, 32), 1 / 16, (0.0, -1.0))
    errors = {}
    for scaling in ("one-norm", "renormalised"):
        error = 0.0
        for shift in np.linspace(0, 1 / 16, 7):
            # One period of the line x + 2y = shift, at a slope |∇φ| = 3√5 that must not matter.
            phi = sample(grid, lambda x, y, c=shift: 3 * (x + 2 * y - c))
            delta = levelset.dirac(phi, grid.h, "hat", scaling, grid) * levelset.gradient_norm(grid, phi)
            error = max(error, abs(grid.inside(delta).sum() * grid.cell_volume - np.sqrt(1.25)))
        errors[scaling] = error
    assert errors["one-norm"] < 1e-13
    assert errors["renormalised"] > 1e-4


def test_length_and_area_of_a_distorted_ellipse():
    """φ with a slope that varies along the curve: the renormalised Dirac measures it (ellipse 0.75 × 0.5)."""
    grid = unit_box(128, 2)
    phi = sample(grid, lambda x, y: (x / 0.75) ** 2 + (y / 0.5) ** 2 - 1)
    delta = levelset.dirac(phi, 3 * grid.h, "cosine", "renormalised", grid) * levelset.gradient_norm(grid, phi)
    assert grid.inside(delta).sum() * grid.cell_volume == pytest.approx(3.9663599, rel=2e-3)
    inside = 1 - levelset.heaviside(phi, 3 * grid.h)
    assert grid.inside(inside).sum() * grid.cell_volume == pytest.approx(np.pi * 0.375, rel=3e-4)


@pytest.mark.parametrize("dim", [2, 3])
def test_gradient_of_a_quadratic_is_exact_with_one_ghost_layer(dim):
    grid = Grid((7, 9, 8)[:dim], 0.1)
    phi = sample(grid, lambda *x: sum((a + 1) * c * c for a, c in enumerate(x)) + x[0] * x[1])
    x = grid.points()
    wanted = [2 * (a + 1) * x[a] + (x[1 - a] if a < 2 else 0) + 0 * sum(x) for a in grid.axes]
    found = levelset.gradient(grid, phi)
    for f, w in zip(found, wanted, strict=True):
        np.testing.assert_allclose(ring(grid, f), ring(grid, w.ravel()), atol=1e-12)
        assert (grid.padded(f)[0] == 0).all()
    length = np.sqrt(sum(w * w for w in wanted)).ravel()
    np.testing.assert_allclose(ring(grid, levelset.gradient_norm(grid, phi)), ring(grid, length), atol=1e-12)
    for f, w in zip(levelset.normal(grid, phi), wanted, strict=True):
        np.testing.assert_allclose(ring(grid, f), ring(grid, w.ravel() / length), atol=1e-11)


def test_curvature_of_quadratic_level_sets_is_exact():
    """Ellipse and ellipsoid, on every level set (book, 7.1): central differences make no error."""
    a, b = 0.8, 0.5
    grid = Grid((16, 16), 1 / 16, (0.1, 0.1))
    phi = sample(grid, lambda x, y: (x / a) ** 2 + (y / b) ** 2 - 1)
    x, y = grid.points()
    wanted = ((x / a) ** 2 + (y / b) ** 2) / (a * b) ** 2 / (x**2 / a**4 + y**2 / b**4) ** 1.5
    np.testing.assert_allclose(ring(grid, levelset.curvature(grid, phi)), ring(grid, wanted.ravel()), rtol=1e-10)

    s = (0.8, 0.6, 0.45)
    grid = Grid((8, 8, 8), 1 / 8, (0.1, 0.2, 0.1))
    phi = sample(grid, lambda *x: sum((c / k) ** 2 for c, k in zip(x, s, strict=True)) - 1)
    parts = [(c / k) ** 2 for c, k in zip(grid.points(), s, strict=True)]
    square = sum(k * k for k in s)
    above = sum(p * (square - k * k) for p, k in zip(parts, s, strict=True))
    wanted = above / np.prod(s) ** 2 / sum(p / k**2 for p, k in zip(parts, s, strict=True)) ** 1.5
    np.testing.assert_allclose(ring(grid, levelset.curvature(grid, phi)), ring(grid, wanted.ravel()), rtol=1e-10)


def error_of_curvature(n, dim):
    grid = unit_box(n, dim)
    if dim == 2:
        phi = sample(grid, lambda x, y: np.hypot(x, y) - 0.5)
        exact = 1 / np.sqrt(sum(c * c for c in grid.points()))
    else:
        phi = sample(grid, lambda x, y, z: np.hypot(np.hypot(x, y) - 0.6, z) - 0.25)
        x, y, z = grid.points()
        q = np.hypot(x, y)
        exact = (2 - 0.6 / q) / np.hypot(q - 0.6, z)
    near = abs(grid.inside(phi)) < 2 / n
    return abs(grid.inside(levelset.curvature(grid, phi)) - grid.inside(exact.ravel()))[near].max()


@pytest.mark.parametrize(("dim", "n"), [(2, 64), (3, 64)])
def test_curvature_is_second_order(dim, n):
    coarse, fine = error_of_curvature(n, dim), error_of_curvature(2 * n, dim)
    assert np.log2(coarse / fine) > 1.95
    assert fine < (2e-3 if dim == 2 else 2e-2)


def test_curvature_does_not_depend_on_the_magnitude():
    grid = unit_box(24, 2)
    phi = sample(grid, lambda x, y: np.hypot(x - 0.01, y) - 0.5)
    wanted = ring(grid, levelset.curvature(grid, phi))
    for scale in (1e-12, 1e12):
        np.testing.assert_allclose(ring(grid, levelset.curvature(grid, scale * phi)), wanted, rtol=1e-9, atol=1e-9)
    single = ring(grid, levelset.curvature(grid, phi.astype(np.float32)))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, wanted, atol=2e-3)
    np.testing.assert_allclose(ring(grid, levelset.curvature(grid, -phi)), -wanted, rtol=1e-12)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_flat_fields_have_no_geometry_and_no_nan(dtype):
    grid = Grid((6, 5), 0.1)
    for value in (0.0, 2.5):
        phi = grid.field(dtype) + dtype(value)
        fields = [levelset.curvature(grid, phi), *levelset.normal(grid, phi), levelset.gradient_norm(grid, phi)]
        fields += [levelset.dirac(phi, 0.1, "cosine", s, grid) for s in ("renormalised", "one-norm")]
        assert all((f == 0).all() for f in fields)


def test_extruded_field_gives_the_plane_result_bit_for_bit():
    plane, deep = Grid((13, 18), 0.1), Grid((13, 18, 5), 0.1)
    flat = np.random.default_rng(0).uniform(-1, 1, plane.size)
    thick = np.ascontiguousarray(np.broadcast_to(plane.padded(flat)[..., None], deep.shape)).ravel()
    functions = {
        "curvature": levelset.curvature,
        "slope": levelset.gradient_norm,
        "x": lambda g, q: levelset.gradient(g, q)[0],
        "y": lambda g, q: levelset.normal(g, q)[1],
        "cosine": lambda g, q: levelset.dirac(q, 0.2, "cosine", "renormalised", g),
        "hat": lambda g, q: levelset.dirac(q, 0.2, "hat", "one-norm", g),
        "heaviside": lambda g, q: levelset.heaviside(q, 0.2),
    }
    for name, function in functions.items():
        wanted, found = ring(plane, function(plane, flat)), ring(deep, function(deep, thick))
        assert (wanted != 0).any()
        for k in range(found.shape[-1]):
            np.testing.assert_array_equal(found[..., k], wanted, err_msg=name)
    assert (levelset.gradient(deep, thick)[2] == 0).all()


def test_results_go_where_they_are_asked_to():
    grid = Grid((6, 5), 0.1)
    phi = sample(grid, lambda x, y: x * x + y)
    for function in (levelset.curvature, levelset.gradient_norm):
        out = grid.field()
        assert function(grid, phi, out) is out
        np.testing.assert_array_equal(out, function(grid, phi))
    out = grid.field()
    assert levelset.heaviside(phi, 0.1, out) is out
    assert levelset.dirac(phi, 0.1, out=out) is out
    two = [grid.field(), grid.field()]
    assert levelset.normal(grid, phi, two) is two


def test_unknown_words_are_refused():
    phi = np.zeros(3)
    with pytest.raises(ValueError, match="kind"):
        levelset.dirac(phi, 0.1, "box")
    with pytest.raises(ValueError, match="scaling"):
        levelset.dirac(phi, 0.1, "hat", "two-norm")
    with pytest.raises(ValueError, match="grid"):
        levelset.dirac(phi, 0.1, "hat", "one-norm")
