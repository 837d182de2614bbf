"""Transport schemes on a line: exactness, order, symmetry, stability, and the numbers of Fig. 7.7."""

import numpy as np
import pytest
import xarray as xr

from fsiwork.core import schemes1d
from fsiwork.studies import schemes
from fsiwork.studies.orders import slope

ORDERS = {
    "upwind": 1, "centred": 2, "lax-wendroff": 2, "beam-warming": 2, "fromm": 2,
    "eno2": 2, "eno3": 3, "weno5": 5, "weno-z": 5, "upwind5": 5,
}  # fmt: skip


def carried(n, scheme, stepping="rk3", courant=0.5):
    """Error of a bump carried over a tenth of [0, 1]; steps short enough that space decides."""
    x = np.arange(n) / n
    bump = lambda y: np.exp(-(((y - 0.4) / 0.1) ** 2))  # noqa: E731
    steps = round(0.1 * n / courant)
    return float(np.abs(schemes1d.advance(bump(x), 0.1 * n / steps, steps, scheme, stepping) - bump(x - 0.1)).mean())


@pytest.mark.parametrize(("scheme", "order"), ORDERS.items())
def test_order_in_space(scheme, order):
    cells = np.array([64, 128, 256])
    errors = [carried(n, scheme, courant=0.5 if order < 4 else 0.05) for n in cells]
    assert slope(1 / cells, errors) > order - 0.25


@pytest.mark.parametrize("scheme", schemes1d.ONE_STEP)
def test_complete_schemes_are_second_order_with_one_euler_step(scheme):
    cells = np.array([64, 128, 256])
    assert slope(1 / cells, [carried(n, scheme, "euler") for n in cells]) > 1.75


@pytest.mark.parametrize("scheme", ["upwind", *schemes1d.ONE_STEP])
def test_a_step_of_one_cell_is_a_shift(scheme):
    q = np.exp(-(np.linspace(-4, 4, 60) ** 2))
    assert np.abs(schemes1d.advance(q, 1.0, 1, scheme)[2:] - q[1:-1]).max() < 1e-15


@pytest.mark.parametrize("scheme", schemes1d.SCHEMES)
def test_a_turned_line_gives_the_turned_result(scheme):
    q = np.random.default_rng(1).random(50)
    one = schemes1d.advance(q, 0.2, 5, scheme, "rk3", inflow=0.3)
    other = schemes1d.advance(q[::-1], -0.2, 5, scheme, "rk3", inflow=0.3)
    assert (one == other[::-1]).all()


@pytest.mark.parametrize("scheme", schemes1d.SCHEMES)
@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_flat_and_scaled_profiles_stay_finite(scheme, scale):
    q = np.where(np.arange(40) < 20, scale, 0.0)
    moved = schemes1d.advance(q, 0.2, 20, scheme, "rk3", inflow=scale)
    assert np.isfinite(moved).all()
    assert np.abs(moved).max() < 1.5 * scale


def test_euler_with_the_weights_of_smooth_data_is_unstable_at_every_step():
    assert all(schemes1d.growth("upwind5", c) > 1 for c in (0.01, 0.1, 0.2, 0.5))
    assert schemes1d.growth("upwind5", 0.2) ** 500 == pytest.approx(4e4, rel=0.1)
    assert schemes1d.growth("upwind5", 1.4, "rk3") < 1 + 1e-12 < schemes1d.growth("upwind5", 1.5, "rk3")
    assert schemes1d.growth("centred", 0.2) > 1.01
    assert schemes1d.growth("lax-wendroff", 0.9) < 1 + 1e-12


def test_growth_is_that_of_the_scheme():
    theta = np.linspace(0, np.pi, 400)
    assert schemes1d.growth("upwind", 0.5) == pytest.approx(1.0, abs=1e-15)
    exact = np.abs(1 - 0.2j * np.sin(theta)).max()
    assert schemes1d.growth("centred", 0.2) == pytest.approx(exact, rel=1e-12)


def test_wrong_names_are_refused():
    q = np.zeros(10)
    with pytest.raises(ValueError, match="scheme must be one of upwind"):
        schemes1d.advance(q, 0.2, 1, "magic")
    with pytest.raises(ValueError, match="euler or rk3"):
        schemes1d.advance(q, 0.2, 1, "upwind", "rk4")
    with pytest.raises(ValueError, match="not linear"):
        schemes1d.growth("weno5", 0.2)
    with pytest.raises(ValueError, match="distance or gaussian"):
        schemes.profile("hat", q)


@pytest.fixture(scope="module")
def study():
    """The whole study, small enough to be computed here."""
    names = ("distance", "gaussian"), ("printed", "rk3"), tuple(schemes1d.SCHEMES)
    dims = ("profile", "stepping", "scheme")
    keys = ("l1", "linf", "overshoot")
    numbers = np.zeros((2, 2, 10, 3))
    with np.errstate(over="ignore"):
        for index in np.ndindex(2, 2, 10):
            point = {dim: words[k] for dim, words, k in zip(dims, names, index, strict=True)}
            found = schemes.carried(None, point)
            numbers[index] = [found[key] for key in keys]
    coords = {dim: list(words) for dim, words in zip(dims, names, strict=True)}
    return xr.Dataset({key: (dims, numbers[..., k]) for k, key in enumerate(keys)}, coords)


def test_fig_7_7_is_what_was_measured(study):
    measured = schemes.fig_7_7({"schemes": study})
    assert max(measured[f"deviation_{error}"] for error in ("l1", "linf", "overshoot")) < 0.2
    assert measured["monotone_overshoot"] < 1e-12
    assert measured["weno5_over_next"] < 1
    assert measured["euler_over_rk3"] > 100
    header, rows = schemes.rows_7_7({"schemes": study}, measured)
    assert {len(row) for row in rows} == {len(header)}


def test_a_missing_error_fails_the_measure(study):
    broken = study.copy(deep=True)
    broken["l1"].loc[{"profile": "distance", "stepping": "rk3", "scheme": "eno2"}] = np.nan
    assert np.isnan(schemes.fig_7_7({"schemes": broken})["deviation_l1"])
