"""Transport: against a textbook form, as slopes, and at the edges of what floating point can do."""

import platform
import tracemalloc

import numba
import numpy as np
import pytest

from fsiwork.core.edges import Edges, Side
from fsiwork.core.grid import Grid
from fsiwork.core.kernels import FASTMATH
from fsiwork.core.kernels import transport as kernels
from fsiwork.core.transport import TABLEAUX, Transport

SCHEMES = ("weno5", "weno-z", "upwind5", "upwind1")


def periodic(grid):
    return Edges(grid, ((Side("periodic"),) * 2,) * grid.dim)


def walls(grid):
    return Edges(grid, ((Side("no-slip"),) * 2,) * grid.dim)


def sample(grid, function, face=None, dtype=np.float64):
    return grid.sample(function, face, dtype).copy()  # ours to write to


def vortex(grid):
    """Divergence-free, periodic and smooth on the unit square; constant in z."""
    flow = (
        lambda x, y, *z: -(np.sin(np.pi * x) ** 2) * np.sin(2 * np.pi * y),
        lambda x, y, *z: np.sin(np.pi * y) ** 2 * np.sin(2 * np.pi * x),
        lambda x, y, *z: 0 * x,
    )
    return [sample(grid, f, face=a) for a, f in zip(grid.axes, flow, strict=False)]


def hill(x, y, *z):
    return np.exp(-(np.sin(np.pi * (x - 0.5)) ** 2 + np.sin(np.pi * (y - 0.7)) ** 2) / (np.pi * 0.2) ** 2)


def textbook(scheme, v, scale):
    """h ∂q from five differences v₁…v₅, upstream first, as printed by Jiang and Shu, and Borges et al."""
    v1, v2, v3, v4, v5 = v
    if scheme == "upwind1":
        return v3
    p = np.array([v1 / 3 - 7 * v2 / 6 + 11 * v3 / 6, -v2 / 6 + 5 * v3 / 6 + v4 / 3, v3 / 3 + 5 * v4 / 6 - v5 / 6])
    d = np.array([0.1, 0.6, 0.3]).reshape(3, *[1] * v3.ndim)
    s = np.array(
        [
            13 / 12 * (v1 - 2 * v2 + v3) ** 2 + (v1 - 4 * v2 + 3 * v3) ** 2 / 4,
            13 / 12 * (v2 - 2 * v3 + v4) ** 2 + (v2 - v4) ** 2 / 4,
            13 / 12 * (v3 - 2 * v4 + v5) ** 2 + (3 * v3 - 4 * v4 + v5) ** 2 / 4,
        ]
    )
    if scheme == "weno5":
        d = d / (s + 1e-6 * scale**2) ** 2
    elif scheme == "weno-z":
        d = d * (1 + ((s[0] - s[2]) / (s + 1e-40 * scale**2)) ** 2)
    return (d * p).sum(axis=0) / d.sum(axis=0)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(("n", "centring"), [((11, 14), 2), ((11, 14), 4), ((7, 9, 10), 4)])
def test_one_euler_step_is_the_textbook_formula(scheme, n, centring):
    grid = Grid(n, 0.1)
    rng = np.random.default_rng(0)
    u = [rng.uniform(-1, 1, grid.size) for _ in n]
    phi, dt = rng.uniform(-1, 1, grid.size), 0.01
    edges = periodic(grid)
    edges.fill_scalar(phi, "mirror")
    q = grid.padded(phi)

    def shifted(field, a, k):
        return field[tuple(slice(3 + k * (b == a), 3 + k * (b == a) + m) for b, m in enumerate(n))]

    scale = max(abs(shifted(q, a, 1) - shifted(q, a, 0)).max() for a in grid.axes)
    rate = 0
    for a in grid.axes:
        low, first, last, high = (shifted(grid.padded(u[a]), a, k) for k in (-1, 0, 1, 2))
        centre = (first + last) / 2 if centring == 2 else (9 * (first + last) - (low + high)) / 16
        v = [shifted(q, a, k) - shifted(q, a, k - 1) for k in range(-2, 4)]
        backward, forward = textbook(scheme, v[:5], scale), textbook(scheme, v[:0:-1], scale)
        rate = rate + centre * np.where(centre > 0, backward, forward) / grid.h
    wanted = shifted(q, 0, 0) - dt * rate
    transport = Transport(grid, edges, scheme, "euler", centring=centring)
    transport.advance([phi], u, dt)
    assert transport.substeps == 1
    np.testing.assert_allclose(grid.inside(phi), wanted, rtol=0, atol=1e-14)


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="reads x86-64 assembly")
@pytest.mark.parametrize("name", ["weno5_2d", "weno_z_2d"])
def test_compiled_weno_divides_packed_numbers(name):
    # Compiled afresh: what comes from the disk cache cannot be inspected.
    kernel = numba.njit(parallel=True, error_model="numpy", fastmath=FASTMATH)(getattr(kernels, name).py_func)
    field, whole = numba.float64[::1], numba.int64
    kernel.compile((*[field] * (3 + int(name[-2])), whole[::1], whole, whole[::1], field))
    code = " ".join(kernel.inspect_asm().values()).splitlines()
    packed = [line for line in code if "vdivpd" in line and ("%ymm" in line or "%zmm" in line)]
    assert packed, "lost its SIMD: look for a call, a select between loads, or an output that aliases an input"


def there_and_back(scheme, n):
    """Mean error of a smooth hill carried by the vortex and back, with a small step."""
    grid = Grid((n, n), 1 / n)
    transport = Transport(grid, periodic(grid), scheme)
    phi, u = sample(grid, hill), vortex(grid)
    start = phi.copy()
    steps, time = 4 * n, 0.5
    for sign in (1, -1):
        flow = [sign * c for c in u]
        for _ in range(steps):
            transport.advance([phi], flow, time / steps, "linear")
    return np.abs(grid.inside(phi - start)).mean()


@pytest.mark.parametrize(("scheme", "order"), [("weno5", 4.7), ("weno-z", 4.8), ("upwind5", 4.8), ("upwind1", 0.7)])
def test_order_on_a_smooth_reversed_vortex(scheme, order):
    coarse, fine = there_and_back(scheme, 96), there_and_back(scheme, 192)
    assert np.log2(coarse / fine) > order


@pytest.mark.parametrize(("tableau", "order"), [("euler", 1), ("ssp-rk2", 2), ("ssp-rk3", 3)])
def test_order_in_time(tableau, order):
    grid = Grid((32, 32), 1 / 32)
    start, u, time = sample(grid, hill), vortex(grid), 0.16

    def end(steps, tableau):
        transport, phi = Transport(grid, periodic(grid), "upwind5", tableau), start.copy()
        for _ in range(steps):
            transport.advance([phi], u, time / steps)
        assert transport.substeps == 1
        return grid.inside(phi).copy()

    exact = end(640, "ssp-rk3")
    coarse, fine = (np.abs(end(steps, tableau) - exact).mean() for steps in (20, 40))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.15)


def test_long_steps_are_divided():
    grid = Grid((16, 16), 1 / 16)
    u = [grid.field() + 1.0, grid.field() - 0.5]
    short, long = sample(grid, hill), sample(grid, hill)
    transport = Transport(grid, periodic(grid), "upwind5")
    step = 1 / 64  # 1.5 * (1/64) * 16 = 0.375 of a cell
    for _ in range(4):
        transport.advance([short], u, step)
        assert transport.substeps == 1
    transport.advance([long], u, 4 * step)
    assert transport.substeps == 3
    transport.advance([long], u, 0.0)
    assert transport.substeps == 1
    np.testing.assert_allclose(grid.inside(long), grid.inside(short), atol=2e-3)
    exact = sample(grid, lambda x, y: hill(x - 4 * step, y + 2 * step))
    np.testing.assert_allclose(grid.inside(long), grid.inside(exact), atol=5e-3)
    transport.advance([long], u, 0.5 / 16 / 1.5)  # the limit itself is one step
    assert transport.substeps == 1


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_extruded_field_gives_the_plane_result(scheme, axis):
    n = (19, 22)
    plane = Grid(n, 1 / 20)
    deep = Grid((*n[:axis], 5, *n[axis:]), 1 / 20)
    rng = np.random.default_rng(1)
    phi, *u = (rng.uniform(-1, 1, plane.size) for _ in range(3))

    def extrude(q):
        full = np.broadcast_to(np.expand_dims(plane.padded(q), axis), deep.shape)
        return np.ascontiguousarray(full).ravel()

    phi3, u3 = extrude(phi), [extrude(c) for c in u]
    u3.insert(axis, deep.field())
    Transport(plane, walls(plane), scheme).advance([phi], u, 0.02)
    Transport(deep, walls(deep), scheme).advance([phi3], u3, 0.02)
    found = np.moveaxis(deep.inside(phi3), axis, 0)
    ulp = np.spacing(np.abs(plane.inside(phi)).max())
    assert np.abs(found - plane.inside(phi)).max() <= 4 * ulp


@pytest.mark.parametrize("scheme", SCHEMES)
def test_mirrored_flow_gives_the_mirrored_result(scheme):
    grid = Grid((17, 20), 0.05)
    rng = np.random.default_rng(2)
    phi, *u = (rng.uniform(-1, 1, grid.size) for _ in range(3))
    for a, c in enumerate(u):  # nothing beyond the box, where one cannot mirror
        inside = grid.inside(c, face=a).copy()
        c[:] = 0.0
        grid.inside(c, face=a)[:] = inside
    flipped = grid.field()
    grid.inside(flipped)[:] = grid.inside(phi)[::-1]
    back = [grid.field(), grid.field()]
    grid.inside(back[0], face=0)[:] = -grid.inside(u[0], face=0)[::-1]
    grid.inside(back[1], face=1)[:] = grid.inside(u[1], face=1)[::-1]
    transport = Transport(grid, walls(grid), scheme)
    transport.advance([phi], u, 0.02)
    transport.advance([flipped], back, 0.02)
    np.testing.assert_allclose(grid.inside(flipped)[::-1], grid.inside(phi), rtol=0, atol=1e-14)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_any_magnitude_and_flat_regions_stay_finite(scheme, dtype):
    grid = Grid((24, 20), 1 / 24)
    u = vortex(grid)
    plateau = sample(grid, lambda x, y: np.clip(np.hypot(x - 0.5, y - 0.7) - 0.15, -0.1, 0.1), dtype=dtype)
    transport = Transport(grid, walls(grid), scheme, dtype=dtype)
    results = []
    for scale in (1.0, 1e-12, 1e12):
        phi = plateau * dtype(scale)
        for _ in range(5):
            transport.advance([phi], u, 0.02)
        assert np.isfinite(phi).all()
        results.append(grid.inside(phi) / dtype(scale))
    tolerance = 200 * np.finfo(dtype).eps
    np.testing.assert_allclose(results[1], results[0], atol=tolerance)
    np.testing.assert_allclose(results[2], results[0], atol=tolerance)
    for constant in (0.0, 3.7):
        phi = grid.field(dtype) + dtype(constant)
        transport.advance([phi], u, 0.02)
        np.testing.assert_allclose(phi, dtype(constant), rtol=2 * np.finfo(dtype).eps)


def test_single_precision_follows_double():
    grid = Grid((32, 32), 1 / 32)
    double, u = sample(grid, lambda x, y: np.hypot(x - 0.5, y - 0.75) - 0.15), vortex(grid)
    single = double.astype(np.float32)
    wide, narrow = Transport(grid, walls(grid)), Transport(grid, walls(grid), dtype=np.float32)
    for _ in range(20):
        wide.advance([double], u, 0.01)
        narrow.advance([single], u, 0.01)
    assert single.dtype == np.float32
    assert np.abs(grid.inside(single) - grid.inside(double)).max() < 1e-5


def test_linear_fields_move_exactly_through_open_ends():
    for n in ((16, 12), (9, 10, 11)):
        grid = Grid(n, 0.1)
        speed = (0.7, -0.4, 0.3)[: grid.dim]
        phi = sample(grid, lambda *x: x[0] - 2 * x[1] + 0.5 * x[-1])
        drift = speed[0] - 2 * speed[1] + 0.5 * speed[-1]
        wanted = phi - 0.3 * drift
        for scheme in SCHEMES:
            q = phi.copy()
            Transport(grid, walls(grid), scheme).advance([q], [grid.field() + c for c in speed], 0.3)
            np.testing.assert_allclose(q, wanted, atol=1e-13)


def test_weno_makes_no_overshoot_where_the_linear_scheme_does():
    grid = Grid((40, 8), 1 / 40)
    u = [grid.field() + 1.0, grid.field()]
    extremes = {}
    for scheme in ("weno5", "upwind5", "upwind1"):
        step = sample(grid, lambda x, y: np.where((x > 0.3) & (x < 0.7), 1.0, 0.0) + 0 * y)
        transport = Transport(grid, periodic(grid), scheme)
        for _ in range(40):
            transport.advance([step], u, 0.5 / 40)
        extremes[scheme] = grid.inside(step).max() - 1
    assert extremes["upwind1"] < 1e-14
    assert extremes["weno5"] < 2e-3
    assert extremes["upwind5"] > 2e-2


def test_several_fields_are_carried_alike_and_nothing_is_allocated():
    grid = Grid((64, 64), 1 / 64)
    u = vortex(grid)
    for dtype in (np.float64, np.float32):
        fields = [sample(grid, hill, dtype=dtype) for _ in range(2)]
        transport = Transport(grid, walls(grid), dtype=dtype)
        transport.advance(fields, u, 0.05)
        tracemalloc.start()
        transport.advance(fields, u, 0.05)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        np.testing.assert_array_equal(*fields)
        assert peak < fields[0].nbytes / 4


def test_a_diverged_field_or_velocity_shows():
    grid = Grid((12, 12), 1 / 12)
    phi, u = sample(grid, hill), vortex(grid)
    transport = Transport(grid, walls(grid))
    grid.inside(phi)[5, 5] = np.nan
    transport.advance([phi], u, 0.05)
    assert np.isnan(grid.inside(phi)).any()
    phi = sample(grid, hill)
    grid.inside(u[0])[:] = np.inf
    transport.advance([phi], u, 0.05)
    assert transport.substeps == 1
    assert not np.isfinite(grid.inside(phi)).all()


def test_stages_are_convex_and_consistent():
    for stages in TABLEAUX.values():
        assert all(a + b == pytest.approx(1) and a >= 0 and b > 0 for a, b in stages)


def test_unknown_names_are_refused():
    grid = Grid((8, 8), 0.1)
    with pytest.raises(ValueError, match="scheme"):
        Transport(grid, walls(grid), "weno7")
    with pytest.raises(ValueError, match="tableau"):
        Transport(grid, walls(grid), "weno5", "rk4")
