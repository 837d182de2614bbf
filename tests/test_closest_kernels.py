"""Parts of redistancing by closest points: interpolants, rasters, seeds; its benchmark."""

import numpy as np
import pytest

from benchmarks import redistancing
from fsiwork.core.closest import WEIGHTS
from fsiwork.core.curvature import of_ellipsoid
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import closest_2d, closest_3d, rasters


@pytest.mark.parametrize(("kernels", "p"), [(closest_2d, 4), (closest_2d, 6), (closest_3d, 4), (closest_3d, 6)])
def test_interpolants_are_exact_for_polynomials(kernels, p):
    """Value, slopes and second derivatives of a polynomial of the interpolant's own degree in every direction."""
    dim, half = (2, p // 2 - 1) if kernels is closest_2d else (3, p // 2 - 1)
    poly = [np.polynomial.Polynomial(np.random.default_rng(a).normal(size=p)) for a in range(dim)]
    s = np.array([0.3, 0.8, 0.1][:dim])
    values = poly[0](np.arange(p) - half)
    for a in range(1, dim):
        values = np.multiply.outer(values, poly[a](np.arange(p) - half))
    which = kernels.cubic if p == 4 else kernels.quintic

    def wanted(*orders):
        return np.prod([poly[a].deriv(m)(s[a]) if m else poly[a](s[a]) for a, m in enumerate(orders)])

    if dim == 2:
        found = which(values.ravel(), 0, p, *s, np.empty((6, p)))
        exact = [wanted(*o) for o in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))]
    else:
        found = np.empty(10)
        which(values.ravel(), 0, p * p, p, tuple(s), np.empty((3, 3, p)), found)
        e = np.eye(3, dtype=int)
        pairs = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
        exact = [wanted(0, 0, 0), *(wanted(*e[a]) for a in range(3)), *(wanted(*(e[a] + e[b])) for a, b in pairs)]
    assert np.allclose(found, exact, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("n", [(1, 40, 30), (14, 12, 13)])
def test_rasters_and_rings_find_nearest_points(n):
    """Against all distances, within the excess that four (six) neighbours allow."""
    rng = np.random.default_rng(3)
    first = int(n[0] > 1)
    found = rng.uniform(0, 1, (25, 3)) * (np.array(n) - 1)
    near = np.unique(np.ravel_multi_index(np.rint(found).astype(int).T, n)).astype(np.int32)
    found = np.column_stack(np.unravel_index(near, n)) + rng.uniform(-0.3, 0.3, (near.size, 3)) * (first, 1, 1)
    nodes = np.column_stack(np.unravel_index(np.arange(np.prod(n)), n))
    all_distances = np.linalg.norm(nodes[:, None] - found[None], axis=2)
    seed = rasters.sweep(n, near, found)
    reached, ring = rasters.spread(n, near, found, 4.0)
    least = all_distances.min(axis=1)
    assert (all_distances[np.arange(seed.size), seed] - least).max() < 0.4
    assert (all_distances[reached, ring[reached]] - least[reached]).max() < 0.4
    assert set(np.flatnonzero(least < 4.0)) <= set(reached)
    assert (np.delete(ring, reached) == -1).all()


def test_seeds_carry_the_curvatures():
    """Sum and product of the principal ones are H and G of an ellipsoid (7.1); 1/R of a circle."""
    grid = Grid((24, 24), 1.0, (-12.2, -11.9))
    phi = grid.sample(lambda x, y: x**2 + y**2 - 64.0)
    near, _ = rasters.scan(phi, (1, *grid.shape), np.empty_like(phi), 6.0)
    start = rasters.crossings(phi, (1, *grid.shape), near, WEIGHTS[3])
    assert closest_2d.seeds(phi, grid.shape, near, start, 3)[:, 5] == pytest.approx(1 / 8)
    axes = (9.0, 6.0, 7.0)
    grid = Grid((24,) * 3, 1.0, (-12.2, -11.9, -12.05))
    phi = grid.sample(lambda *x: sum((c / a) ** 2 for c, a in zip(x, axes, strict=True)) - 1)
    near, _ = rasters.scan(phi, grid.shape, np.empty_like(phi), 6.0)
    start = rasters.crossings(phi, grid.shape, near, WEIGHTS[5])
    found = closest_3d.seeds(phi, grid.shape, near, start, 5)
    points = (found[:, :3] + np.array(grid.origin) + 0.5 - GHOSTS).T
    assert sum((c / a) ** 2 for c, a in zip(points, axes, strict=True)) == pytest.approx(1, abs=1e-12)
    mean, gauss = of_ellipsoid(axes, *points)
    assert found[:, 6] + found[:, 8] == pytest.approx(mean)
    assert found[:, 6] * found[:, 8] - found[:, 7] ** 2 == pytest.approx(gauss)


@pytest.mark.parametrize("there", [True, False])
def test_benchmarks_beside_scikit_fmm(monkeypatch, there):
    """Without the peer nothing is decided, and the row says why."""
    if not there:
        monkeypatch.setattr(redistancing, "peer", lambda: None)
    elif redistancing.peer() is None:
        pytest.skip("scikit-fmm is not installed")
    for names, cells in ((("fmm_band", "fmm_band_quintic"), 48), (("fmm_3d",), 16)):
        for name, row in zip(names, redistancing.compare(names, cells, 0.0, 1), strict=True):
            assert row["benchmark"] == name
            assert row["measured"] > 0
            assert (row["pass"] is None) == (not there)
            assert ("not installed" in row["note"]) == (not there)
