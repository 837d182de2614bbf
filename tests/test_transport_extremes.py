"""Fields at the edges of what a grid can hold, carried by every scheme, everywhere and in a band: finite, and right."""

from typing import get_args

import numpy as np
import pytest

from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.transport import Scheme, Transport

WAYS = [(scheme, band) for scheme in get_args(Scheme) for band in (None, 6)] + [("weno-z", "interface")]
# Error at a smooth interface [Δx]: first order smears, the neutral schemes let a kink ring, that at a band's edge too.
AT_INTERFACE = {"upwind1": 0.3, "centred": 0.15, "lax-wendroff": 0.1}
# Overshoot at a kink [Δx]: linear schemes of second order and more make one, the others hardly.
OVERSHOOT = {
    "upwind1": 1e-12, "eno2": 0.02, "eno3": 0.02, "weno5": 0.02, "weno-z": 0.05, "upwind5": 0.25, "fromm": 0.25,
    "semi-lagrangian": 0.25, "centred": 0.6, "lax-wendroff": 0.6, "beam-warming": 0.6,
}  # fmt: skip
SHARP = ("weno5", "weno-z", "eno2", "eno3")  # what happens at a kink stays there


def carrier(grid, way, dtype=np.float64, kind="no-slip"):
    scheme, band = way
    edges = Edges(grid, ((Side(kind),) * 2,) * grid.dim)
    if band == "interface":
        return Transport(grid, edges, scheme, dtype=dtype, from_interface=True)
    return Transport(grid, edges, scheme, dtype=dtype, band=band)


def sample(grid, function, dtype=np.float64):
    return grid.sample(function, dtype=dtype).copy()


def moved(grid, way, q, speed, time, kind="no-slip"):
    """``q`` in the box after ``time`` of a uniform flow; finite all the way."""
    u = [grid.field() + c for c in speed]
    transport = carrier(grid, way, q.dtype.type, kind)
    for _ in range(8):
        transport.advance([q], u, time / 8)
        assert np.isfinite(q).all()
    return grid.inside(q)


def disc(x, y, radius=0.2):
    return np.hypot(x - 0.4, y - 0.45) - radius


TIME, SPEED = 0.1, (0.8, 0.5)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("scale", [1.0, 1e12, 1e-12])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_scale_and_precision(way, scale, dtype):
    grid = Grid((48, 40), 1 / 48)
    found = moved(grid, way, sample(grid, lambda x, y: scale * disc(x, y), dtype), SPEED, TIME) / scale
    exact = grid.inside(sample(grid, lambda x, y: disc(x - TIME * SPEED[0], y - TIME * SPEED[1])))
    near = np.abs(exact) < 1.5 * grid.h
    assert near.sum() > 60
    limit = AT_INTERFACE.get(way[0], 0.05)
    assert np.abs(found - exact)[near].max() < limit * grid.h
    clear = np.abs(exact) > limit * grid.h
    np.testing.assert_array_equal(np.sign(found[clear]), np.sign(exact[clear]))


@pytest.mark.parametrize("way", WAYS)
def test_flat_fields_stay(way):
    grid = Grid((20, 17), 1 / 20)
    for value in (0.0, 3.7, -1e-12, 1e12):
        q = grid.field() + value
        found = moved(grid, way, q, SPEED, 0.2)
        np.testing.assert_allclose(found, value, rtol=1e-14)


@pytest.mark.parametrize("way", WAYS)
def test_an_empty_domain_stays_empty(way):
    grid = Grid((32, 32), 1 / 32)
    outside = moved(grid, way, sample(grid, lambda x, y: np.hypot(x + 1, y + 1) - 0.2), (0.1, 0.1), TIME)
    assert outside.min() > (0.1 if way[1] == 6 else 0.5)  # a band is clipped
    assert moved(grid, way, sample(grid, lambda x, y: -2.0 + 0 * (x + y)), (0.1, 0.1), TIME).max() < -1.9


@pytest.mark.parametrize("way", WAYS)
def test_kinks_and_plateaus_make_no_large_overshoot(way):
    grid = Grid((40, 40), 1 / 40)
    q = sample(grid, lambda x, y: np.clip(np.maximum(np.abs(x - 0.45), np.abs(y - 0.4)) - 0.2, -0.08, 0.1))
    found = moved(grid, way, q, SPEED, TIME)
    over = max(found.max() - 0.1, -0.08 - found.min())
    assert over < OVERSHOOT[way[0]] * grid.h


@pytest.mark.parametrize("way", WAYS)
def test_interface_through_nodes(way):
    grid = Grid((32, 24), 1 / 32)
    q = sample(grid, lambda x, y: x - 0.25 - 0.5 * grid.h + 0 * y)  # zero on a line of nodes
    assert (grid.inside(q) == 0.0).sum() == 24
    found = moved(grid, way, q, (1.0, 0.0), 4 * grid.h)
    crossed = np.abs(found[12])  # on nodes again, four cells on
    clipped = way[1] == 6 and way[0] not in SHARP
    assert crossed.max() < (0.15 if clipped else 1e-3) * grid.h
    assert (found[:12] < 0).all() and (found[13:] > 0).all()


@pytest.mark.parametrize("way", WAYS)
def test_two_interfaces_in_a_cell_and_a_body_below_two_cells(way):
    grid = Grid((48, 48), 1 / 48)
    for shape in (
        lambda x, y: np.abs(x - 0.41) - 0.3 * grid.h + 0 * y,  # a sheet of 0.6 cells
        lambda x, y: np.hypot(x - 0.41, y - 0.4) - 0.8 * grid.h,  # a body of 1.6 cells
    ):
        found = moved(grid, way, sample(grid, shape), SPEED, TIME)
        exact = grid.inside(sample(grid, lambda x, y, f=shape: f(x - TIME * SPEED[0], y - TIME * SPEED[1])))
        # what is smaller than the grid may vanish, but its trough is where it should be, and is not deeper
        low = np.unravel_index(np.argmin(found), found.shape)
        assert exact[low] < 1.5 * grid.h
        assert found.min() > exact.min() - 0.5 * grid.h
        far = (exact > 4 * grid.h) & (exact < 5 * grid.h)
        assert np.abs(found - exact)[far].max() < 0.6 * grid.h


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("n", [(8, 8), (8, 8, 8)])
@pytest.mark.parametrize("kind", ["no-slip", "periodic"])
def test_eight_cells(way, n, kind):
    grid = Grid(n, 1 / 8)
    axis = grid.dim - 1
    speed = [0.5 * (a == axis) for a in grid.axes]
    if kind == "periodic":
        q = sample(grid, lambda *x: np.abs((x[axis] + 0.01) % 1 - 0.5) - 0.22 + 0 * sum(x))
    else:
        q = sample(grid, lambda *x: x[axis] - 0.4 + 0 * sum(x))
    mean = grid.inside(q).mean()
    found = moved(grid, way, q, speed, 0.125, kind)
    if kind == "periodic":
        assert found.mean() == pytest.approx(mean, abs=0.01)
        assert np.sign(found).sum() == pytest.approx(np.sign(found.T).sum())
        assert (found < 0).any() and (found > 0).any()
    else:
        exact = grid.inside(sample(grid, lambda *x: x[axis] - 0.4 - 0.0625 + 0 * sum(x)))
        np.testing.assert_allclose(found, exact, atol=1e-13)


@pytest.mark.parametrize("way", WAYS)
def test_what_is_no_number_shows(way):
    grid = Grid((24, 24), 1 / 24)
    q = sample(grid, disc)
    grid.inside(q)[9, 9] = np.nan
    u = [grid.field() + c for c in SPEED]
    carrier(grid, way).advance([q], u, 0.01)
    assert np.isnan(grid.inside(q)).any()
    q = sample(grid, disc)
    grid.inside(u[0])[:] = np.nan
    carrier(grid, way).advance([q], u, 0.01)
    assert np.isnan(grid.inside(q)).any()
