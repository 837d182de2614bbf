"""Redistancing by closest points: orders, drift, sides of the box, extremes."""

import numpy as np
import pytest

from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.redistance import METHODS, redistance
from fsiwork.core.shapes import Ball, Box, Ellipsoid

CLOSEST = ("closest-cubic", "closest-quintic", "sweep")
AXES = {2: (0.35, 0.2), 3: (0.35, 0.2, 0.25)}


def distorted(n, dim=2, reach=6):
    """An ellipse times (x - .35)² + (y - .25)² + .1 on the unit box, and its exact distance within ``reach`` cells."""
    grid = Grid((n,) * dim, 1 / n, (-0.5,) * dim)
    x = np.broadcast_arrays(*grid.points())
    scaled = np.sqrt(sum((c / a) ** 2 for c, a in zip(x, AXES[dim], strict=True))) - 1
    near = np.abs(scaled) * 0.2 <= reach * grid.h
    exact = np.full(grid.shape, np.nan)
    exact[near] = Ellipsoid((0.0,) * dim, AXES[dim]).distance(*(c[near] for c in x))
    return grid, (scaled * ((x[0] - 0.35) ** 2 + (x[1] - 0.25) ** 2 + 0.1)).ravel(), exact.ravel()


def error(grid, phi, exact, cells=3.0):
    return np.abs(phi - exact)[np.abs(exact) < cells * grid.h].max()


def errors(method, sizes, dim=2, cells=3.0):
    found = []
    for n in sizes:
        grid, phi, exact = distorted(n, dim)
        found.append(error(grid, redistance(grid, phi, method), exact, cells))
    return np.array(found)


@pytest.mark.parametrize(
    ("method", "order", "dim", "sizes", "last"),
    [
        ("closest-cubic", 3.9, 2, (64, 128, 256), 1e-8),
        ("closest-quintic", 5.8, 2, (64, 128, 256), 1e-11),
        ("sweep", 3.9, 2, (64, 128, 256), 1e-8),
        ("closest-cubic", 3.9, 3, (32, 64), 3e-6),
        ("closest-quintic", 5.7, 3, (32, 64), 4e-8),
        ("sweep", 3.9, 3, (32, 64), 3e-6),
    ],
)
def test_orders(method, order, dim, sizes, last):
    found = errors(method, sizes, dim, 1.2)
    assert (np.log2(found[:-1] / found[1:]) > order).all()
    assert found[-1] < last


def far_error(n):
    """Of the distance outside an ellipse, where there is no medial axis."""
    grid, phi, exact = distorted(n, 2, np.inf)
    return np.abs(redistance(grid, phi, "sweep") - exact)[exact > 0].max()


def test_far_from_the_interface_sweeps_are_of_third_order():
    assert np.log2(far_error(128) / far_error(512)) / 2 > 2.8
    assert far_error(256) < 3e-7


@pytest.mark.parametrize(("method", "most"), [("closest-cubic", 2e-3), ("closest-quintic", 1e-4)])
def test_drift_after_a_hundred_times(method, most):
    """In Δx at N = 128."""
    grid, phi, exact = distorted(128)
    for _ in range(100):
        phi = redistance(grid, phi, method)
    assert error(grid, phi, exact, 1.0) / grid.h < most


@pytest.mark.parametrize("method", CLOSEST)
@pytest.mark.parametrize("dim", [2, 3])
def test_a_plane_is_exact_up_to_the_sides_and_ghosts(method, dim):
    """Its normal is turned, it goes through the sides; any scale and both signs give the same field."""
    grid = Grid((12, 9, 10)[:dim], 0.1)
    normal = np.array([0.6, 0.8] if dim == 2 else [2 / 3, 1 / 3, 2 / 3])
    flat = grid.sample(lambda *x: sum(a * c for a, c in zip(normal, x, strict=True)) - 0.77)
    reach = 0.3 if method != "sweep" else np.inf
    for scale in (1.0, 1e-12, 1e12, -1.0):
        found = redistance(grid, scale * flat, method, None if method == "sweep" else 3.0)
        wanted = np.sign(scale) * np.clip(flat, -reach, reach)
        inside = np.abs(grid.inside(found) - grid.inside(wanted))
        assert inside.max() < 1e-13 if method != "sweep" else inside[np.abs(grid.inside(flat)) < 0.3].max() < 1e-13


@pytest.mark.parametrize("method", CLOSEST)
@pytest.mark.parametrize("dim", [2, 3])
def test_periodic_boxes(method, dim):
    """A ball over a corner: distances go through the sides."""
    n = 24
    grid = Grid((n,) * dim, 1 / n)
    wrapped = [(c + 0.5) % 1 - 0.5 for c in grid.points()]
    r = np.sqrt(sum(np.broadcast_arrays(*[c**2 for c in wrapped])))
    found = grid.padded(redistance(grid, (r**2 - 0.09).ravel(), method))
    band = 6 * grid.h if method != "sweep" else np.inf
    ridge = np.max(np.abs(np.broadcast_arrays(*wrapped)), axis=0) > 0.5 - grid.h
    sure = (r > 4 * grid.h) & ~ridge
    assert np.abs(found - np.clip(r - 0.3, -band, band))[sure].max() < 2e-4
    for a in range(dim):
        lines, known = np.moveaxis(found, a, 0), np.moveaxis(sure, a, 0)
        assert np.abs(lines[:GHOSTS] - lines[n : n + GHOSTS])[known[:GHOSTS]].max() < 2e-4


def test_a_direction_whose_ghosts_are_one_value_is_not_periodic():
    grid = Grid((32, 32), 1 / 32)
    phi = np.clip(grid.sample(Ball((0.3, 0.5), 0.1).distance), -0.06, 0.06)
    assert np.abs(redistance(grid, phi, "sweep") - grid.sample(Ball((0.3, 0.5), 0.1).distance)).max() < 1e-3


@pytest.mark.parametrize("method", CLOSEST)
@pytest.mark.parametrize("dim", [2, 3])
def test_no_interface(method, dim):
    """± the band, ± the diagonal of the array for the whole box."""
    grid = Grid((8,) * dim, 0.1)
    most = 0.6 if method != "sweep" else 0.1 * np.sqrt(dim) * 14
    for sign in (1.0, -1.0):
        assert redistance(grid, np.full(grid.size, 7 * sign), method) == pytest.approx(sign * most)
        assert redistance(grid, np.full(grid.size, 7 * sign), method, 2.0) == pytest.approx(sign * 0.2)


@pytest.mark.parametrize("method", CLOSEST)
@pytest.mark.parametrize("dim", [2, 3])
def test_flat_regions(method, dim):
    """φ = 0 everywhere is distance 0 everywhere; a plateau around a plateau (a step) has its line half-way."""
    grid = Grid((12,) * dim, 0.1)
    assert (redistance(grid, grid.field(), method) == 0).all()
    step = grid.sample(lambda *x: np.where(x[0] < 0.6, -1.0, 1.0) + 0 * sum(x))
    wanted = grid.sample(lambda *x: x[0] - 0.6 + 0 * sum(x))
    found = redistance(grid, step, method)
    near = np.abs(wanted) < 0.5
    assert np.abs(found - wanted)[near].max() < 1e-9


@pytest.mark.parametrize("method", CLOSEST)
@pytest.mark.parametrize("dim", [2, 3])
def test_kinks_cost_a_fraction_of_a_cell(method, dim):
    """The nodes' own φ leaves the place of a corner open by so much."""
    grid = Grid((40,) * dim, 1 / 40)
    exact = grid.sample(Box((0.5,) * dim, (0.26, 0.22, 0.24)[:dim]).distance)
    found = redistance(grid, exact, method)
    near = np.abs(exact) < 4 * grid.h
    assert np.abs(found - exact)[near].max() < 0.5 * grid.h
    assert np.abs(found - exact)[near].mean() < 0.1 * grid.h


@pytest.mark.parametrize("method", CLOSEST)
@pytest.mark.parametrize("dim", [2, 3])
def test_an_interface_through_nodes(method, dim):
    """On nodes φ = 0: these get 0; the rest is exact."""
    grid = Grid((16,) * dim, 0.125, (-1.0625,) * dim)
    plane = grid.sample(lambda *x: x[0] + 0 * sum(x))
    found = redistance(grid, plane, method)
    near = np.abs(plane) < 5.5 * grid.h
    assert np.abs(found - plane)[near].max() < 1e-13
    diagonal = grid.sample(lambda *x: (x[0] - x[1] + 0 * sum(x)) / np.sqrt(2))
    gap = grid.inside(redistance(grid, 3 * diagonal, method) - diagonal)[np.abs(grid.inside(diagonal)) < 3 * grid.h]
    assert np.abs(gap).max() < 1e-13


@pytest.mark.parametrize("method", CLOSEST)
@pytest.mark.parametrize("dim", [2, 3])
def test_two_interfaces_within_a_cell(method, dim):
    """A sheet 0.6 cells thick around one row of nodes, its φ quadratic."""
    grid = Grid((16,) * dim, 1.0)
    x = grid.sample(lambda *x: x[0] - 8.4 + 0 * sum(x))
    found = redistance(grid, x**2 - 0.09, method, 4.0)
    wanted = np.clip(np.abs(x) - 0.3, -4.0, 4.0)
    assert np.abs(found - wanted).max() < 1e-12


@pytest.mark.parametrize("method", CLOSEST)
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("radius", [0.6, 0.9])
def test_a_body_smaller_than_two_cells(method, dim, radius):
    """φ is a polynomial: right to round-off."""
    grid = Grid((16,) * dim, 1.0)
    r = grid.sample(lambda *x: np.sqrt(sum((c - 8.4) ** 2 for c in x)))
    found = redistance(grid, r**2 - radius**2, method, 4.0)
    wanted = np.clip(r - radius, -4.0, 4.0)
    assert np.isfinite(found).all()
    assert np.abs(found - wanted).max() < 1e-10


@pytest.mark.parametrize("method", CLOSEST)
def test_eight_cells(method):
    grid = Grid((8, 8), 0.125)
    exact = grid.sample(Ball((0.5, 0.5), 0.25).distance)
    found = redistance(grid, (exact + 0.25) ** 2 - 0.0625, method)
    assert np.abs(grid.inside(found) - grid.inside(exact)).max() < 1e-3


@pytest.mark.parametrize("method", CLOSEST)
def test_float32(method):
    """Same answer as from the same numbers in float64, of the field's own type; the field itself is left alone."""
    grid, phi, exact = distorted(64)
    single = phi.astype(np.float32)
    kept = single.copy()
    found = redistance(grid, single, method)
    assert found.dtype == np.float32
    assert (single == kept).all()
    assert np.abs(found - redistance(grid, single.astype(np.float64), method)).max() < 1e-6
    assert error(grid, found, exact) < 1e-5


@pytest.mark.parametrize("method", CLOSEST)
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_no_nan_is_hidden(method, bad):
    grid, phi, _ = distorted(16)
    phi[200] = bad
    assert np.isnan(redistance(grid, phi, method)).all()


def test_bad_words_and_shapes():
    grid = Grid((8, 8), 0.1)
    with pytest.raises(ValueError, match="method must be one of"):
        redistance(grid, grid.field(), "magic")
    with pytest.raises(ValueError, match="flat field"):
        redistance(grid, np.zeros((14, 14)), "sweep")
    for band in (0.0, -1.0, np.nan):
        with pytest.raises(ValueError, match="band must be positive"):
            redistance(grid, grid.field(), "sweep", band)
    assert set(CLOSEST) <= set(METHODS)


@pytest.mark.parametrize("method", CLOSEST)
@pytest.mark.parametrize("dim", [2, 3])
def test_noise(method, dim):
    """Any field: signs stay, nodes beside a change of sign are a cell from the interface at most. Between nodes the
    distance changes by no more than one cell and another: one may see a line that no sign shows, the other not."""
    grid = Grid((14,) * dim, 1.0)
    phi = np.random.default_rng(dim).normal(size=grid.size)
    found = redistance(grid, phi, method)
    assert (np.sign(found) == np.sign(phi)).all()
    q, d = grid.padded(phi), grid.padded(np.abs(found))
    for a in range(dim):
        change = np.moveaxis(np.diff(np.signbit(q), axis=a), a, 0)
        assert np.moveaxis(d, a, 0)[:-1][change].max() <= 1
        assert np.abs(np.diff(d, axis=a)).max() < 2
