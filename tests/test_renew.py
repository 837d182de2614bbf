"""Lines φ = c drawn anew beside a membrane: the interface and its stretch stay, the rest is distance times stretch."""

import numpy as np
import pytest

from fsiwork.bodies.laws import Linear
from fsiwork.bodies.layers import Layers
from fsiwork.bodies.membrane import Membrane
from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.integrals import length_and_area
from fsiwork.core.transport import Transport
from fsiwork.studies.orders import slope

EPS, OFFSET = 0.12, 0.0137
AXES = (0.6, 0.45)


def box(n, dim=2, sides=("no-slip", "no-slip", "periodic")):
    grid = Grid((n, n, 8)[:dim], 2.0 / n, (-1.0, -1.0, 0.0)[:dim])
    return grid, Edges(grid, tuple((Side(kind), Side(kind)) for kind in sides[:dim]))


def polar(x, y):
    return np.hypot(x - OFFSET, y), np.arctan2(y, x - OFFSET)


def stretch(turn):
    return 1.2 + 0.2 * np.sin(2 * turn) + 0.1 * np.cos(turn)


def wanted(x, y, *_):
    """Distance to a circle of radius 1/2 times a stretch that varies along it."""
    r, turn = polar(x, y)
    return (r - 0.5) * stretch(turn)


def wound(x, y, *_):
    """The same circle with the same stretch, lines beside it bent and crowded."""
    d = polar(x, y)[0] - 0.5
    return wanted(x, y) * np.exp(1.5 * d + 2 * d * x)


def near(grid, width=EPS):
    x, y = (q[..., 0] if grid.dim == 3 else q for q in grid.points(ghosts=0)[:2])
    return np.broadcast_to(np.abs(np.hypot(x - OFFSET, y) - 0.5) < width, grid.n[:2])


def renewed(grid, edges, function, times=1, every=1, dtype=np.float64):
    phi, layers = grid.sample(function, dtype=dtype), Layers(grid, edges, EPS, every)
    for _ in range(times):
        layers.moved(phi)
    return phi


def test_it_is_the_distance_times_the_stretch_to_second_order():
    errors, steps = [], []
    for n in (32, 64, 128):
        grid, edges = box(n)
        found = grid.inside(renewed(grid, edges, wound)) - grid.inside(grid.sample(wanted))
        errors.append(np.abs(found[near(grid)]).max())
        steps.append(grid.h)
    assert slope(steps, errors) > 1.9
    assert errors[-1] < 3e-4 < 1e-2 < np.abs(grid.inside(grid.sample(wound) - grid.sample(wanted))[near(grid)]).max()


def test_the_interface_stays_however_often():
    grid, edges = box(64)
    once, often = (length_and_area(grid, renewed(grid, edges, wound, k)) for k in (0, 50))
    assert often == pytest.approx(once, rel=3e-7)


def test_a_band_that_reaches_the_walls_makes_no_new_line():
    grid, edges = box(32)
    phi = renewed(grid, edges, wound, 20)
    assert length_and_area(grid, phi) == pytest.approx((np.pi, 0.25 * np.pi), rel=1e-5)
    r = polar(*grid.points())[0]
    assert np.array_equal(grid.padded(phi) < 0, r < 0.5)


def test_the_stretch_of_a_distance_times_stretch_stays_to_second_order():
    errors, steps = [], []
    for n in (32, 64, 128):
        grid, edges = box(n)
        change = grid.inside(renewed(grid, edges, wanted, 10) - grid.sample(wanted))[near(grid, 0.06)]
        errors.append(np.abs(change).max() / 0.06)
        steps.append(grid.h)
    assert slope(steps, errors) > 1.4  # of the ratio of two differences, at nodes that differ from grid to grid
    assert errors[-1] < 3e-3


def test_where_the_stretch_is_the_same_everywhere_it_stays():
    grid, edges = box(32)

    def even(x, y):
        return 1.3 * (polar(x, y)[0] - 0.5)

    change = grid.inside(renewed(grid, edges, even, 50) - grid.sample(even))[near(grid)]
    assert np.abs(change).max() < 2e-4 * EPS


def test_noise_of_the_stretch_dies_out():
    grid, edges = box(64)
    noise = 1e-2 * np.random.default_rng(1).standard_normal(grid.shape)

    def spread(times):
        phi = renewed(grid, edges, lambda x, y: 1.3 * (polar(x, y)[0] - 0.5) * (1 + noise), times)
        away = grid.inside(phi) - 1.3 * grid.inside(grid.sample(lambda x, y: polar(x, y)[0] - 0.5))
        return np.sqrt((away[near(grid)] ** 2).mean())

    assert spread(20) < 0.5 * spread(0)


def test_every_so_many_moves():
    grid, edges = box(32)
    start = grid.sample(wound)
    assert np.array_equal(renewed(grid, edges, wound, 2, every=3), start)
    assert np.array_equal(renewed(grid, edges, wound, 3, every=3), renewed(grid, edges, wound, 1))
    assert np.array_equal(renewed(grid, edges, wound, 9, every=0), start)


def test_a_slice_of_a_cylinder_is_the_plane():
    (plane, flat), (block, round_) = box(32), box(32, 3)
    found, expected = block.inside(renewed(block, round_, wound)), plane.inside(renewed(plane, flat, wound))
    assert np.abs(found - found[..., :1]).max() < 1e-12
    assert np.abs(found[..., 0] - expected)[near(plane)].max() < 1e-6


def test_across_a_periodic_side_as_in_the_middle():
    grid, edges = box(32, sides=("periodic", "periodic"))
    middle = grid.inside(renewed(grid, edges, wound))
    phi = np.zeros(grid.shape)
    phi[3:-3, 3:-3] = np.roll(grid.inside(grid.sample(wound)), 16, axis=0)
    edges.fill_scalar(phi.ravel(), "linear")
    phi = phi.ravel()
    Layers(grid, edges, EPS, 1).renew(phi)
    assert np.abs(np.roll(grid.inside(phi), -16, axis=0) - middle)[near(grid)].max() < 1e-9


def test_single_precision_and_no_interface():
    grid, edges = box(32)
    phi = renewed(grid, edges, wound, dtype=np.float32)
    assert phi.dtype == np.float32
    assert np.abs(phi - renewed(grid, edges, wound))[np.abs(grid.sample(wanted)) < EPS].max() < 1e-5
    assert np.array_equal(
        renewed(grid, edges, lambda x, y: 1.0 + x**2 + y**2), grid.sample(lambda x, y: 1.0 + x**2 + y**2)
    )


def test_a_map_is_not_renewed():
    grid, edges = box(16)
    with pytest.raises(ValueError, match="renew"):
        Membrane(grid, edges, wanted, Linear(1.0), EPS, transport=Transport(grid, edges), carry="map", renew=2)
