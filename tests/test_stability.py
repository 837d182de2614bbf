"""The linear model of section 1.6 against itself in real space, (1.54), and the search for a largest step."""

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fsiwork import scene
from fsiwork.studies import exact, linear, orders, stability

SCENES = Path(__file__).parents[1] / "configs" / "scenes"


def real_space_step(scheme, mu, lam, eps, dt, n):
    """Matrix of one step for (u, φ) on an n × n grid, from the five-point Laplacian itself."""
    dx = 2 * np.pi / n
    second = (np.roll(np.eye(n), 1, 0) + np.roll(np.eye(n), -1, 0) - 2 * np.eye(n)) / dx**2
    laplacian = np.kron(second, np.eye(n)) + np.kron(np.eye(n), second)
    one, zero = np.eye(n * n), np.zeros((n * n, n * n))
    viscous, force = one - dt * mu * laplacian, -dt * lam / eps * laplacian
    if scheme == "explicit":
        new, old = [[viscous, zero], [dt * one, one]], [[one, force], [zero, one]]
    elif scheme == "crank-nicolson":
        half = 0.5 * dt * mu * laplacian
        new, old = [[one - half, zero], [dt * one, one]], [[one + half, force], [zero, one]]
    elif scheme == "old-velocity":
        new, old = [[viscous, zero], [zero, one]], [[one, force], [-dt * one, one]]
    elif scheme == "implicit":
        new, old = [[viscous, -force], [dt * one, one]], [[one, zero], [zero, one]]
    else:
        power = 3 if scheme == "predictor-printed" else 2
        psi = np.linalg.inv(one - dt**power * lam / eps * laplacian)
        new, old = [[viscous, zero], [dt * one, one]], [[one - dt * force @ psi, force @ psi], [zero, one]]
    return np.linalg.solve(np.block(new), np.block(old))


@pytest.mark.parametrize("scheme", linear.SCHEMES)
@pytest.mark.parametrize("ratio", [0.4, 1.3])
def test_modes_are_those_of_the_scheme_on_a_grid(scheme, ratio):
    n, mu, lam, width = 4, 0.3, 2.0, 1.5
    case = tuple(np.array([q]) for q in (mu, lam, width))
    dt = ratio * linear.predicted(case, n)
    by_modes = linear.radius(scheme, *linear.numbers(case, dt, n), dt).max()
    matrix = real_space_step(scheme, mu, lam, width * 2 * np.pi / n, dt[0], n)
    values = np.abs(np.linalg.eigvals(matrix))
    # the mean mode, eigenvalue 1 twice (defective), is no part of the analysis
    values = np.sort(values[np.abs(values - 1) > 1e-6])
    assert values[-1] == pytest.approx(by_modes, rel=1e-9)


def test_1_54_is_necessary_and_sufficient_in_936_cases():
    scan = stability.linear_scan(None, {"cells": 8, "steps": 20000})
    deviation, excess = scan["deviation"][1], scan["excess"][1]
    assert deviation.shape == excess.shape == (936,)
    assert np.abs(deviation).max() <= 1e-12
    assert excess.min() >= 0
    assert excess.max() <= 2e-4
    assert scan["implicit_radius"] < 1
    assert scan["semi_implicit_radius"] <= 1 + 1e-12
    assert scan["predictor_printed_radius"] > 2


def test_excess_of_time_stepping_falls_like_one_over_steps():
    case = tuple(np.array([q]) for q in (0.0, 10.0, 1.5))
    viscous = tuple(np.array([q]) for q in (100.0, 10.0, 1.5))
    for columns in (case, viscous):
        few, many = (linear.stepping_limits(columns, 8, steps)[0] - 1 for steps in (200, 2000))
        assert 0 <= many < few / 5


def test_predictor_as_printed_is_unstable_where_the_corrected_one_is_not():
    for viscosity in (0.0, 0.01):
        point = {"ratio": 1.5, "viscosity": viscosity}
        assert stability.spectral_radius(None, {**point, "scheme": "predictor-printed"})["radius"] > 1.5
        assert stability.spectral_radius(None, {**point, "scheme": "predictor-corrected"})["radius"] < 1
    # the worked example of ERRATA 1: Δt = 0.01, Δx = 0.01, ε = 0.05, λ = 1, μ = 0.001: spectral radius 62
    g, d = 4 * 0.01**2 / (0.05 * 0.01**2), 4 * 0.001 * 0.01 / 0.01**2
    assert linear.radius("predictor-printed", g, d, 0.01) > 50
    assert linear.radius("semi-implicit", g, d) < 1


def test_old_velocity_is_stable_up_to_its_own_limit_only():
    mu, lam, width, n = 0.3, 2.0, 1.5, 16
    case = tuple(np.array([q]) for q in (mu, lam, width))
    limit = exact.step_limit_old_velocity(mu=mu, lam=lam, eps=width * 2 * np.pi / n)
    for factor, stable in ((0.999, True), (1.001, False)):
        dt = np.array([factor * limit])
        radius = linear.radius("old-velocity", *linear.numbers(case, dt, n)).max()
        assert bool(radius <= 1 + 1e-12) == stable


def test_crank_nicolson_gains_nothing_from_viscosity():
    width, n = 1.5, 16
    dx = 2 * np.pi / n
    for mu in (0.0, 0.03, 3.0):
        case = tuple(np.array([q]) for q in (mu, 2.0, width))
        for factor in (0.999, 1.001):
            dt = np.array([factor * exact.step_limit(2.0, mu, width * dx, dx, theta=0.5)])
            radius = linear.radius("crank-nicolson", *linear.numbers(case, dt, n)).max()
            assert bool(radius <= 1 + 1e-12) == (factor < 1)
    assert exact.step_limit(2.0, 3.0, 0.1, 0.01, theta=0.5) == exact.step_limit(2.0, 0.0, 0.1, 0.01)


def test_one_point_of_a_study_says_what_the_scan_says():
    point = {"viscosity": 0.1, "tension": 10.0, "width": 3.0, "cells": 8, "steps": 2000}
    dx = 2 * np.pi / 8
    spectral, stepping = stability.spectral_limit(None, point), stability.stepping_limit(None, point)
    assert spectral["predicted"] == pytest.approx(exact.step_limit(10.0, 0.1, 3 * dx, dx))
    assert abs(spectral["deviation"]) < 1e-12
    assert 0 <= stepping["excess"] < 2e-3
    assert stepping["limit"] == pytest.approx(stepping["predicted"] * (1 + stepping["excess"]))
    with pytest.raises(ValueError, match="even"):
        stability.spectral_limit(None, {**point, "cells": 7})
    with pytest.raises(ValueError, match="no scheme"):
        stability.spectral_radius(None, {**point, "ratio": 1.0, "scheme": "magic"})


def oscillator(omega):
    """Symplectic Euler for x'' = -ω²x stays bounded exactly up to Δt = 2/ω."""

    def stable(dt):
        x, v = 1.0, 0.0
        for _ in range(400):
            v -= dt * omega**2 * x
            x += dt * v
        return abs(x) < 100

    return stable


@pytest.mark.parametrize("start", [0.001, 0.0199, 0.05, 0.2])
def test_bisection_finds_a_known_limit_from_either_side(start):
    answer = stability.limit(oscillator(100.0), start)
    assert answer.found == 1
    assert 0.02 / 1.01 <= answer.step <= 0.02 * (1 + 1e-3)
    assert 3 <= answer.trials <= 25


def test_bisection_says_so_when_there_is_no_limit():
    assert stability.limit(lambda dt: True, 0.01, largest=0.24)[:2] == (0.24, 0)
    never = stability.limit(lambda dt: False, 0.01)
    assert never.found == -1
    assert math.isnan(never.step)
    assert stability.limit(oscillator(1.0), 5.0, largest=0.24)[:2] == (0.24, 0)


def datasets(limits=(2.0, 1.5), found=(1, 1)):
    schemes = ["explicit", "implicit", "semi-implicit", "predictor-printed", "predictor-corrected"]
    ratios = [0.99, 1.01]
    radius = [[stability.spectral_radius(None, {"scheme": s, "ratio": r})["radius"] for r in ratios] for s in schemes]
    drop = {"limit": ("width", list(limits)), "found": ("width", list(found))}
    drop |= {"predicted_lambda": ("width", [1.0, 1.0]), "predicted_scheme": ("width", [0.5, 0.5])}
    return {
        "stability_spectral": xr.Dataset({"deviation": ("tension", [1e-14, -3e-14])}),
        "stability_stepping": xr.Dataset({"excess": ("tension", [1e-5, 4e-5])}),
        "stability_schemes": xr.Dataset(
            {"radius": (("scheme", "ratio"), radius)}, {"scheme": schemes, "ratio": ratios}
        ),
        "stability_drop": xr.Dataset(drop, {"width": [1.5, 3.0]}),
    }


def test_measures_of_the_artefact():
    measured = stability.measure_1_54(datasets())
    assert measured["spectral_deviation"] == 3e-14
    assert (measured["stepping_excess_min"], measured["stepping_excess_max"]) == (1e-5, 4e-5)
    assert measured["explicit_below"] <= 1 + 1e-9 < measured["explicit_above"]
    assert max(measured["implicit_radius"], measured["semi_implicit_radius"], measured["corrected_radius"]) < 1
    assert measured["printed_radius"] > 1.1
    assert (measured["drop_ratio_min"], measured["drop_ratio_max"]) == (1.5, 2.0)
    assert (measured["drop_scheme_ratio_min"], measured["drop_scheme_ratio_max"]) == (3.0, 4.0)
    # a case that is unstable at every step must not pass for a good one, one without a limit counts apart
    assert stability.measure_1_54(datasets((math.nan, 1.5), (-1, 1)))["drop_ratio_min"] == 0
    free = stability.measure_1_54(datasets((0.24, 1.5), (0, 1)))
    assert (free["drop_ratio_max"], free["drop_no_limit"]) == (1.5, 1)


@pytest.mark.parametrize("name", ["oscillating_drop", "elliptic_membrane"])
def test_largest_step_of_the_whole_solver(name):
    overrides = {"box.cells": 32, "bodies.0.coupling": "explicit", "bodies.0.width.cells": 3, "fluid.viscosity": 0.01}
    made = scene.load(SCENES / f"{name}.yaml", overrides)
    answer = stability.largest_step(made, {"horizon": 0.5})
    assert answer["found"] == 1
    assert answer["n_cells"] == 32
    body = made.bodies[0]
    tension = 1.0 if name == "oscillating_drop" else body.stretch * 10 * (body.stretch - 1)
    assert answer["predicted_tension"] == pytest.approx(exact.step_limit(tension, 0.01, 3 / 16, 1 / 16))
    assert 1 < answer["limit"] / answer["predicted_scheme"] < 4
    released = stability.releasable(made)
    for factor, stable in ((0.95, True), (1.1, False)):
        assert stability.stays_bounded(made, factor * answer["limit"], 0.5, released)[0] is stable


def test_energy_that_can_be_released_is_that_of_the_exact_ellipse():
    length, circle = exact.ellipse_perimeter(0.75, 0.5), 2 * np.pi * np.sqrt(0.375)
    drop = scene.load(SCENES / "oscillating_drop.yaml", {"box.cells": 16, "bodies.0.width.cells": 1})
    assert stability.outline(drop.bodies[0].shape, drop.box) == pytest.approx((length, 0.375 * np.pi), rel=2e-5)
    assert stability.releasable(drop) == pytest.approx(length - circle, rel=1e-3)
    membrane = scene.load(
        SCENES / "elliptic_membrane.yaml", {"bodies.0.stretch": exact.ellipse_stretch(0.75, 0.5, 0.5)}
    )
    energies = [exact.membrane_energy(s, 0.5, 10.0) for s in (membrane.bodies[0].stretch, np.sqrt(0.375) / 0.5)]
    assert stability.releasable(membrane) == pytest.approx(energies[0] - energies[1], rel=1e-3)


def test_largest_step_wants_one_body_in_the_plane():
    with pytest.raises(ValueError, match="in the plane"):
        stability.largest_step(scene.load(SCENES / "two_drops.yaml"), {})


def test_orders_of_a_made_up_refinement():
    h = np.array([0.1, 0.05, 0.025])
    error = 3 * h**2
    assert orders.observed_orders(h, error) == pytest.approx([2, 2])
    assert orders.slope(h, error) == pytest.approx(2)
    for steps in (h, h[::-1], np.array([0.1, 0.04, 0.03])):
        assert orders.richardson(steps, 7 - 3 * steps**1.7) == pytest.approx((7, 1.7))
    assert orders.richardson(h[:2], 7 - 3 * h[:2] ** 2, order=2.0) == pytest.approx((7, 2))
    with pytest.raises(ValueError, match="monotonically"):
        orders.richardson(h, [1.0, 1.1, 1.05])
    with pytest.raises(ValueError, match="positive"):
        orders.slope(h, [1.0, 0.0, 0.1])
