"""Small oscillations of a drop and of a membrane against linear theory: sharp, and with the band of half-width ε.

The sharp theory (`exact.drop_mode`, `exact.membrane_mode`) knows no ε. `smeared_mode` solves the same linear problem
for the force (3.16) or (3.18) spread over |φ| < ε|∇φ|, so that a deviation can be told apart: what the model does at
this ε, and what the grid adds to it.
"""

import math

import numpy as np
import scipy.sparse as sp
import xarray as xr
from scipy.sparse import linalg

from fsiwork import scene as scenes
from fsiwork.studies import exact
from fsiwork.studies.sweep import curve

SETTLED = 0.5  # time from which the fit looks: the quick tangential waves of the start are gone
OUTER = 5.0  # outer wall of the smeared problem, in radii


def smeared_mode(body, radius: float, eps: float, mu: float, rho: float = 1.0, n: int = 2) -> exact.Mode:
    """Mode n of a circle whose force is spread over the band of half-width ``eps`` [length], in a round box of 5 radii.

    Streamfunction f(r)e^(inθ+st) and radial displacement X(r) of every level, with levels φ = s(r - R) of uniform
    stretch s at rest. The tension T = E'|∇φ| D_ε(φ) answers to |∇φ|' and φ' (plain D_ε for ``linear`` energies,
    renormalised for ``quadratic``, as `bodies.membrane` chooses); vorticity obeys ρ s L f = μ L²f - curl F. Second
    order differences, ε/80 apart. ``body`` is a scene's: ``energy.kind``, ``energy.stiffness``, ``stretch``.
    Raises ArithmeticError if no oscillating mode is found near the sharp one.
    """
    stiffness, stretch = body.energy.stiffness, body.stretch
    linear = body.energy.kind == "linear"
    sharp = exact.drop_mode(stiffness, radius, mu, rho, n) if linear else None
    sharp = sharp or exact.membrane_mode(stiffness, stretch, radius, mu, rho, n)
    h = eps / 80
    r = np.arange(1, int(OUTER * radius / h)) * h
    first = sp.diags_array([-0.5 / h, 0.5 / h], offsets=[-1, 1], shape=(r.size, r.size))
    second = sp.diags_array([1 / h**2, -2 / h**2, 1 / h**2], offsets=[-1, 0, 1], shape=(r.size, r.size))
    laplacian = second + _times(1 / r) @ first - _times(n**2 / r**2)
    curl = _curl_of_force(r, first, n, *_tensions(r - radius, first, eps, stiffness, stretch, linear))
    left = sp.block_array([[mu * laplacian @ laplacian, -curl], [_times(n / r), None]]).tocsc()
    right = sp.block_array([[rho * laplacian, None], [None, sp.eye_array(r.size)]]).tocsc()
    return _nearest(left, right, complex(-sharp.gamma, 0.9 * sharp.omega))


def _times(values: np.ndarray) -> sp.dia_array:
    return sp.diags_array(values)


def _tensions(distance, first, eps, stiffness, stretch, linear):
    """T(r) at rest, and the operator that makes the change of T (up to the factor i) from X."""
    x = distance / eps if not linear else stretch * distance / eps
    band = np.abs(x) < 1
    hat = np.where(band, 0.5 * (1 + np.cos(np.pi * x)), 0.0) / eps
    slope = np.where(band, -0.5 * np.pi * np.sin(np.pi * x), 0.0) / eps**2
    if linear:  # T = λ|∇φ| ζ(φ/ε)/ε: |∇φ|' = -s X_r, φ' = -s X
        change = -stiffness * stretch * (_times(hat) @ first + _times(stretch * slope))
        return stiffness * stretch * hat, change
    force = stiffness * (stretch - 1)  # T = E'(|∇φ|) ζ(d/ε)/ε with d = φ/|∇φ|: d' = -X + d X_r
    moved = -sp.eye_array(distance.size) + _times(distance) @ first
    return force * hat, -stiffness * stretch * _times(hat) @ first + force * _times(slope) @ moved


def _curl_of_force(r, first, n, tension, change):
    """curl div(T(I - nn)), linearised, as an operator on X (both up to the factor i)."""
    radial = -(n**2) * _times(tension / r**2) - _times(1 / r) @ change
    around = first @ _times(tension / r) + _times(1 / r) @ change + _times(2 * tension / r**2)
    return -n * _times(1 / r) @ first @ _times(r) @ around + n * _times(1 / r) @ radial


def _nearest(left, right, guess: complex) -> exact.Mode:
    """The eigenvalue nearest to a guess, by shift and inverse."""
    factors = linalg.splu((left - guess * right).tocsc())
    operator = linalg.LinearOperator(left.shape, lambda q: factors.solve(right @ q.astype(complex)), dtype=complex)
    start = np.ones(left.shape[0], complex)
    try:
        value = linalg.eigs(operator, 1, ncv=40, tol=1e-9, v0=start, return_eigenvectors=False)[0]
    except linalg.ArpackNoConvergence as error:
        raise ArithmeticError("no smeared mode found") from error
    found = guess + 1 / value
    if not abs(found - guess) < 0.5 * abs(guess) or found.imag <= 0:
        raise ArithmeticError(f"no oscillating smeared mode found near {guess:.3g}")
    return exact.Mode(float(found.imag), float(-found.real))


def oscillation(data: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Times and the difference of the half-axes [length], from `SETTLED` on."""
    times, along = curve(data, "axis_x")
    difference = along - curve(data, "axis_y")[1]
    late = times >= SETTLED
    return times[late], difference[late]


def references(data: xr.Dataset) -> tuple[exact.Mode, exact.Mode]:
    """Modes of the sharp and of the smeared theory for the run in a study without axes."""
    scene = scenes.loads(str(data["scene"].values))
    body, mu, rho = scene.bodies[0], scene.fluid.viscosity, scene.fluid.density
    radius = math.sqrt(math.prod(body.shape.semi_axes))
    law = body.energy
    if law.kind == "linear":
        sharp = exact.drop_mode(law.stiffness, radius, mu, rho)
    else:
        sharp = exact.membrane_mode(law.stiffness, body.stretch, radius, mu, rho)
    return sharp, smeared_mode(body, radius, body.width.of(scene.box.h), mu, rho)


def _measure(data: xr.Dataset) -> dict[str, float]:
    """Fitted ω and γ, in parts of the sharp theory and of the one with the same ε."""
    sharp, smeared = references(data)
    if str(data["ended"].values) == "complete":
        found = exact.damped_mode(*oscillation(data))
    else:
        found = exact.Mode(math.nan, math.nan)
    return {
        "omega": float(found.omega),
        "gamma": float(found.gamma),
        "omega_over_sharp": float(found.omega / sharp.omega),
        "gamma_over_sharp": float(found.gamma / sharp.gamma),
        "omega_smeared": smeared.omega,
        "gamma_smeared": smeared.gamma,
        "omega_over_smeared": float(found.omega / smeared.omega),
        "gamma_over_smeared": float(found.gamma / smeared.gamma),
    }


def measure_drop(datasets: dict[str, xr.Dataset]) -> dict[str, float]:
    """ω and γ of the small oscillation of a drop."""
    return _measure(datasets["mode_drop"])


def measure_membrane(datasets: dict[str, xr.Dataset]) -> dict[str, float]:
    """ω and γ of the small oscillation of a stretched membrane."""
    return _measure(datasets["mode_membrane"])
