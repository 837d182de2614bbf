"""Curvatures of surfaces: exact cases, orders, oracles against each other, extremes, and the numbers of section 7.1."""

import math

import numpy as np
import pytest
import xarray as xr

from fsiwork.core import curvature as curvature_of
from fsiwork.core import levelset
from fsiwork.core.curvature import curvatures, of_ellipsoid, of_torus, shifted
from fsiwork.core.grid import Grid
from fsiwork.core.shapes import Ball, Torus
from fsiwork.studies import curvature

RNG = np.random.default_rng(7)


def near(grid, phi, cells=1.0):
    start, n = grid.rows()
    nodes = np.add.outer(start, np.arange(n)).ravel()
    return nodes[np.abs(phi[nodes]) < cells * grid.h]


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_a_quadratic_ball_is_exact(order, scale):
    grid = Grid((16, 16, 16), 0.125, (-1.0, -1.0, -1.0))
    phi = grid.sample(lambda x, y, z: scale * (x * x + y * y + z * z - 0.49))
    nodes = near(grid, phi / scale)
    x, y, z = (np.broadcast_to(c, grid.shape).ravel()[nodes] for c in grid.points())
    radius = np.sqrt(x * x + y * y + z * z)
    mean, gauss = curvatures(grid, phi, order, nodes)
    assert mean == pytest.approx(2 / radius, rel=1e-11)
    assert gauss == pytest.approx(1 / radius**2, rel=1e-11)


def test_the_inside_out_surface_has_the_other_mean_and_the_same_gauss():
    grid = Grid((12, 12, 12), 0.1)
    phi = grid.sample(Torus((0.6, 0.6, 0.6), 0.3, 0.15).distance)
    mean, gauss = curvatures(grid, phi, 4)
    other, same = curvatures(grid, -phi, 4)
    assert (other == -mean).all()
    assert same == pytest.approx(gauss, rel=1e-12)


def test_second_order_is_the_curvature_of_the_flow():
    grid = Grid((10, 12, 14), 0.1)
    phi = grid.sample(Ball((0.5, 0.6, 0.7), 0.3).distance)
    assert curvatures(grid, phi)[0] == pytest.approx(grid.inside(levelset.curvature(grid, phi)).ravel(), rel=1e-10)


@pytest.mark.parametrize("order", [2, 4])
def test_order_on_a_turned_torus(order):
    """Turned, so that every mixed difference counts."""
    turn, _ = np.linalg.qr(RNG.normal(size=(3, 3)))
    errors = []
    for cells in (48, 96):
        grid = Grid((cells,) * 3, 2 / cells, (-1.0, -1.0, -1.0))

        def own(*x):
            return [sum(turn[a, b] * x[b] for b in range(3)) for a in range(3)]

        phi = grid.sample(lambda *x: Torus((0.0, 0.0, 0.0), 0.6, 0.25).distance(*own(*x)))
        nodes = near(grid, phi)
        points = own(*(np.broadcast_to(c, grid.shape).ravel()[nodes] for c in grid.points()))
        pairs = zip(curvatures(grid, phi, order, nodes), of_torus(0.6, *points), strict=True)
        errors.append([np.abs(a - b).max() / np.abs(b).max() for a, b in pairs])
    assert (np.log2(np.array(errors[0]) / errors[1]) > order - 0.1).all()


def test_oracles_agree_on_a_ball_and_with_themselves():
    x = RNG.normal(size=(3, 50))
    radius = np.sqrt((x**2).sum(axis=0))
    mean, gauss = of_ellipsoid((2.0, 2.0, 2.0), *x)
    assert mean == pytest.approx(2 / radius)
    assert gauss == pytest.approx(1 / radius**2)
    mean, gauss = shifted(mean, gauss, 0.3)
    assert mean == pytest.approx(2 / (radius + 0.3))
    assert gauss == pytest.approx(1 / (radius + 0.3) ** 2)
    # the outermost circle of a torus: principal curvatures 1/r and 1/(R + r)
    mean, gauss = of_torus(0.6, np.array([0.85]), np.array([0.0]), np.array([0.0]))
    assert mean[0] == pytest.approx(1 / 0.25 + 1 / 0.85)
    assert gauss[0] == pytest.approx(1 / (0.25 * 0.85))


def test_total_curvature_of_the_torus_formulas():
    """∫H² = 4π²R²/(r√(R² - r²)), ∫G = 0 (Gauss and Bonnet)."""
    big, small = 0.6, 0.25
    t = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    ring = big + small * np.cos(t)
    mean, gauss = of_torus(big, ring, 0 * t, small * np.sin(t))
    weight = small * 2 * np.pi * ring * (2 * np.pi / t.size)
    assert (mean**2 * weight).sum() == pytest.approx(4 * np.pi**2 * big**2 / (small * math.sqrt(big**2 - small**2)))
    assert (gauss * weight).sum() == pytest.approx(0, abs=1e-10)


@pytest.mark.parametrize("order", [2, 4])
def test_extremes(order):
    grid = Grid((8, 8, 8), 0.125)
    for flat in (np.zeros(grid.size), np.ones(grid.size)):
        assert not np.any(curvatures(grid, flat, order))
    single = grid.sample(lambda x, y, z: 1e-6 * ((x - 0.5) ** 2 + (y - 0.5) ** 2 + (z - 0.5) ** 2), dtype=np.float32)
    nodes = near(grid, np.abs(single) * 1e6 - 0.1)
    mean, gauss = curvatures(grid, single, order, nodes)
    assert mean.dtype == np.float32
    assert np.isfinite(mean).all()
    assert (mean > 0).all()
    assert (gauss > 0).all()
    broken = np.array(grid.sample(Ball((0.5, 0.5, 0.5), 0.3).distance))
    grid.padded(broken)[7, 7, 7] = math.nan
    assert np.isnan(curvatures(grid, broken, order)[0]).any()


def test_wrong_arguments_are_refused():
    with pytest.raises(ValueError, match="order must be 2 or 4"):
        curvatures(Grid((4, 4, 4), 1.0), np.zeros(1000), 3)
    with pytest.raises(ValueError, match="three directions"):
        curvatures(Grid((4, 4), 1.0), np.zeros(100))


def test_section_7_1_on_small_grids():
    cells, orders = [48, 64, 96], [2, 4]
    found = [
        [[curvature.surface(None, {"surface": s, "order": o, "cells": n}) for n in cells] for o in orders]
        for s in curvature.SURFACES
    ]
    dims = ("surface", "order", "cells")
    data = {k: (dims, [[[one[k] for one in row] for row in page] for page in found]) for k in curvature.QUANTITIES}
    study = xr.Dataset(data, {"surface": list(curvature.SURFACES), "order": orders, "cells": cells})
    measured = curvature.curvature_7_1({"curvature": study})
    assert measured["quadratic_largest"] < 1e-12
    assert all(measured[f"{name}_2_ellipsoid_distance_order"] > 1.9 for name in curvature.QUANTITIES)
    assert all(measured[f"{name}_4_ellipsoid_distance_order"] > 3.8 for name in curvature.QUANTITIES)
    assert math.isnan(measured["mean_4_torus_128"])  # that grid is not in this study
    header, rows = curvature.rows_7_1({"curvature": study}, measured)
    assert [row[0] for row in rows] == cells
    assert {len(row) for row in rows} == {len(header)}


def test_willmore_energy_and_area_of_a_ball_a_torus_and_a_part():
    """8π; 2π²c²/√(c² - 1), c = R/r; and an eighth of the ball, whatever the scale of φ."""
    grid, c = Grid((48,) * 3, 1 / 24, (-1.0,) * 3), 0.55 / 0.3
    ball = curvature_of.willmore(grid, grid.sample(lambda x, y, z: 7 * ((x - 0.01) ** 2 + y * y + z * z - 0.36)))
    torus = curvature_of.willmore(grid, grid.sample(Torus((0.0, 0.013, 0.0), 0.55, 0.3).distance))
    assert ball == pytest.approx((8 * math.pi, 4 * math.pi * 0.36), rel=1e-4)
    exact = 2 * math.pi**2 * c * c / math.sqrt(c * c - 1), 4 * math.pi**2 * 0.55 * 0.3
    assert torus == pytest.approx(exact, rel=3e-4)
    part = Grid((24,) * 3, 1 / 24)
    found = curvature_of.willmore(part, part.sample(Ball((0.0, 0.0, 0.0), 0.6).distance))
    assert found == pytest.approx((math.pi, 0.5 * math.pi * 0.36), rel=1e-3)
