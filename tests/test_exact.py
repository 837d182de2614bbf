"""Reference numbers of studies/exact.py against published or independently computed values."""

import numpy as np
import pytest

from fsiwork.studies import exact

REST = np.sqrt(0.375)


@pytest.mark.parametrize(
    ("radius", "mu", "omega", "gamma"),
    [(REST, 0.001, 3.544985, 0.072087), (REST, 0.01, 3.394587, 0.246261), (0.5, 0.01, 4.5855, 0.3531)],
)
def test_drop_mode_reproduces_the_reference(radius, mu, omega, gamma):
    mode = exact.drop_mode(1.0, radius, mu)
    digits = 1e-4 if radius == 0.5 else 1e-6
    assert mode.omega == pytest.approx(omega, abs=digits / 2)
    assert mode.gamma == pytest.approx(gamma, abs=digits / 2)


@pytest.mark.parametrize(("mu", "omega", "gamma"), [(0.001, 5.312238, 0.107547), (0.01, 5.080916, 0.347874)])
def test_membrane_mode_reproduces_the_reference(mu, omega, gamma):
    mode = exact.membrane_mode(10.0, REST / 0.5, REST, mu)
    assert mode == pytest.approx((omega, gamma), abs=6e-7)


def test_drop_without_viscosity_is_lambs():
    mode = exact.drop_mode(2.0, 0.7, 1e-9, rho=3.0, n=3)
    assert mode.omega == pytest.approx(exact.lamb_frequency(2.0, 0.7, 3, (3.0, 3.0)), rel=1e-4)
    assert 0 < mode.gamma < 1e-3


def test_modes_scale_with_length_time_and_mass():
    length, time, mass = 1.7, 0.4, 2.3  # two-dimensional: density mass/length², viscosity mass/time
    unit = exact.membrane_mode(10.0, 1.3, 0.6, 0.02)
    stiffness, mu, rho = 10.0 * mass * length / time**2, 0.02 * mass / time, mass / length**2
    scaled = exact.membrane_mode(stiffness, 1.3, 0.6 * length, mu, rho)
    assert np.array(scaled) == pytest.approx(np.array(unit) / time, rel=1e-9)


def test_taylor_green_solves_the_navier_stokes_equations():
    x, y, t, nu, d = 0.7, 1.9, 0.3, 0.05, 1e-4
    u, v, _ = exact.taylor_green(x, y, t, nu, 1.3, 2.0)

    def f(q, dx=0.0, dy=0.0, dt=0.0):
        return exact.taylor_green(x + dx, y + dy, t + dt, nu, 1.3, 2.0)[q]

    def first(q, **step):
        ((name, s),) = step.items()
        return (f(q, **{name: s}) - f(q, **{name: -s})) / (2 * s)

    def laplacian(q):
        return sum(f(q, **{n: d}) + f(q, **{n: -d}) - 2 * f(q) for n in ("dx", "dy")) / d**2

    assert abs(first(0, dx=d) + first(1, dy=d)) < 1e-7
    for q, n in ((0, "dx"), (1, "dy")):
        inertia = first(q, dt=d) + u * first(q, dx=d) + v * first(q, dy=d)
        assert inertia == pytest.approx(nu * laplacian(q) - first(2, **{n: d}), abs=1e-6)


def test_ellipse_and_its_equilibrium():
    assert exact.ellipse_perimeter(0.75, 0.5) == pytest.approx(3.9663598973, abs=5e-11)
    assert exact.ellipse_perimeter(1.5, 0.75) == pytest.approx(7.2663361654, abs=5e-11)
    assert exact.ellipse_perimeter(2.0, 2.0) == pytest.approx(4 * np.pi, rel=1e-15)
    stretch = exact.ellipse_stretch(0.5, 0.75, 0.5)
    assert stretch == pytest.approx(1.26253157, abs=5e-9)
    end = exact.membrane_equilibrium(0.375 * np.pi, 0.5, stiffness=10.0)
    assert end == pytest.approx((0.6123724, 1.2247449, 3.670068), abs=5e-7)
    assert exact.membrane_energy(stretch, 0.5) == pytest.approx(0.5 * 0.2625316**2 * np.pi, rel=1e-6)


def test_cavity_tables_have_a_value_for_every_point():
    for reynolds in (100, 1000):
        y, u = exact.cavity(reynolds)
        assert y.shape == u.shape == (11,)
        assert (np.diff(y) < 0).all()
        assert -0.4 < u.min() < 0 < u.max() < 0.9
    with pytest.raises(KeyError):
        exact.cavity(400)


def test_step_limit_in_its_two_regimes_and_forms():
    lam, eps, dx = 3.0, 0.05, 0.01
    assert exact.step_limit(lam, 0.0, eps, dx) == pytest.approx(np.sqrt(eps / (2 * lam)) * dx)
    assert exact.step_limit(lam, 1e6, eps, dx) == pytest.approx(2e6 * eps / lam)
    plain = exact.step_limit(lam, 0.1, eps, dx)
    assert plain == pytest.approx((0.1 * eps + np.sqrt(0.01 * eps**2 + 0.5 * lam * eps * dx**2)) / lam)
    # density ρ: λ -> λ/ρ, μ -> μ/ρ; ζ(0) = ½: ε -> 2ε; a flow in the plane: ½ -> 1
    assert exact.step_limit(lam, 0.1, eps, dx, 2.0) == pytest.approx(exact.step_limit(lam / 2, 0.05, eps, dx))
    assert exact.step_limit(lam, 0.1, eps, dx, peak=0.5) == pytest.approx(exact.step_limit(lam, 0.1, 2 * eps, dx))
    line = exact.step_limit(lam, 0.1, eps, dx, directions=1)
    assert line == pytest.approx(exact.step_limit(lam, 0.1, eps, dx * np.sqrt(2)))
    assert exact.step_limit_old_velocity(lam, 0.1, eps) < plain / 2


@pytest.mark.parametrize(("omega", "gamma"), [(5.08, 0.35), (1.0, 0.02), (30.0, 0.5), (4.0, 1.5)])
def test_damped_mode_finds_what_was_put_in(omega, gamma):
    t = np.sort(np.random.default_rng(1).uniform(0, 8, 300))
    signal = 0.6 + 0.01 * np.exp(-gamma * t) * np.cos(omega * t + 0.3)
    assert exact.damped_mode(t, signal) == pytest.approx((omega, gamma), rel=1e-8)
    noisy = signal + 1e-4 * np.random.default_rng(0).normal(size=t.size)
    assert exact.damped_mode(t + 3.0, noisy) == pytest.approx((omega, gamma), rel=0.1, abs=0.005)


def test_damped_mode_refuses_what_it_cannot_fit():
    with pytest.raises(ValueError, match="eight finite"):
        exact.damped_mode(np.arange(5), np.arange(5))
    with pytest.raises(ValueError, match="eight finite"):
        exact.damped_mode(np.arange(9), np.full(9, np.nan))
