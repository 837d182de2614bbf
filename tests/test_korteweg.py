"""The Korteweg form of a membrane's force (3.24)-(3.27) against exact stresses and the divergence form (3.16)."""

import numpy as np
import pytest

from fsiwork import scene as scenes
from fsiwork.bodies.laws import Linear, Quadratic
from fsiwork.bodies.membrane import Membrane
from fsiwork.core import levelset
from fsiwork.core.edges import Edges, Side
from fsiwork.core.flow import Flow
from fsiwork.core.grid import Grid
from fsiwork.core.shapes import Ball
from fsiwork.core.transport import Transport
from fsiwork.studies import korteweg
from fsiwork.studies.orders import slope

EPS = 0.2


def level(x, y, z=0.0):
    """Level function of an ellipse or ellipsoid with a stretch that varies along it."""
    return 1.2 * (np.sqrt((x / 0.6) ** 2 + (y / 0.45) ** 2 + (z / 0.5) ** 2) - 1.0) * (0.5 + 0.1 * np.sin(np.pi * x))


def tank(n, dim=2):
    grid = Grid((n,) * dim, 2 / n, (-1.0,) * dim)
    return Flow(grid, Edges(grid, ((Side("no-slip"),) * 2,) * dim), 1.0, 0.01)


def force(flow, phi, law, form="korteweg", dirac="plain", eps=EPS):
    body = Membrane(
        flow.grid, flow.edges, phi, law, eps, transport=Transport(flow.grid, flow.edges), form=form, dirac=dirac
    )
    flow.begin()
    body.push(flow, 0.01)
    return [flow.grid.inside(f, face=a).copy() for a, f in enumerate(flow.force)]


def primitive(r):
    """∫√ζ, √ζ = cos(πr/2)."""
    return 2 / np.pi * np.sin(0.5 * np.pi * np.clip(r, -1, 1))


def test_a_korteweg_fluid_has_the_force_of_its_density():
    """E = ½r²: -div(∇ψ⊗∇ψ) = -Δψ∇ψ - ½∇|∇ψ|², ψ' = √D_ε; derivatives of ψ by small differences."""
    d, steps, errors = 1e-3, [], []

    def psi(x, y):
        return np.sqrt(EPS) * primitive(level(x, y) / EPS)

    for n in (48, 96, 192):
        flow = tank(n)
        found = force(flow, flow.grid.sample(level), korteweg.Fluid(1.0))[0]
        x, y = flow.grid.points(face=0, ghosts=0)
        x = np.append(x[:, 0], x[-1, 0] + flow.grid.h)[:, None]
        east, west, north, south, here = psi(x + d, y), psi(x - d, y), psi(x, y + d), psi(x, y - d), psi(x, y)
        ux, uy = (east - west) / (2 * d), (north - south) / (2 * d)
        uxx, uyy = (east + west - 2 * here) / d**2, (north + south - 2 * here) / d**2
        uxy = (psi(x + d, y + d) + psi(x - d, y - d) - psi(x + d, y - d) - psi(x - d, y + d)) / (4 * d**2)
        wanted = -(uxx + uyy) * ux - (ux * uxx + uy * uxy)
        steps.append(flow.grid.h)
        errors.append(np.abs(found - wanted).mean() / np.abs(wanted).mean())
    assert slope(steps, errors) > 1.8
    assert errors[-1] < 0.01


@pytest.mark.parametrize("law", [Quadratic(10.0), Linear(1.0)])
@pytest.mark.parametrize(("dim", "cells"), [(2, (48, 96, 192)), (3, (24, 36, 48))])
def test_it_differs_from_the_divergence_form_by_a_gradient(law, dim, cells):
    steps, errors = [], []
    for n in cells:
        flow = tank(n, dim)
        phi, g = flow.grid.sample(level), flow.grid
        one, other = (force(flow, phi, law, form, eps=0.3) for form in ("divergence", "korteweg"))
        r = levelset.gradient_norm(g, phi)
        q = g.padded(law.dE(r) * r * levelset.dirac(phi, 0.3))
        middle = (slice(3, -3),) * dim  # q vanishes at walls and beyond
        wrong = size = 0.0
        for a in g.axes:
            gradient = (np.diff(q, axis=a, prepend=0) / g.h)[middle]
            shift = (one[a] - other[a])[tuple(slice(0, n) for _ in g.axes)]
            wrong, size = wrong + np.abs(shift - gradient).mean(), size + np.abs(gradient).mean()
        steps.append(g.h)
        errors.append(wrong / size)
    assert slope(steps, errors) > 1.6
    assert errors[-1] < {2: 0.01, 3: 0.12}[dim]


def test_it_sums_to_zero_and_has_the_jump_of_laplace():
    flow = tank(128)
    found = force(flow, flow.grid.sample(level), Quadratic(10.0), dirac="renormalised")
    for f in found:
        assert abs(f.sum()) < 1e-11 * np.abs(f).sum()
    circle = flow.grid.sample(lambda x, y: 1.3 * Ball((0.0, 0.0), 0.5).distance(x, y))
    inward = force(flow, circle, Quadratic(10.0), eps=0.1)[0]
    assert inward[:64, 63:65].mean(axis=1).sum() * flow.grid.h == pytest.approx(3.0 / 0.5, rel=0.01)


def test_a_law_given_as_functions_equals_the_built_in_one():
    class Called:
        def dE(self, r):
            return 10.0 * (r - 1.0)

        def E(self, r):
            return 5.0 * (r - 1.0) ** 2

        def ddE(self, r):
            return np.full_like(r, 10.0)

    flow = tank(48)
    phi = flow.grid.sample(level)
    for a, b in zip(force(flow, phi, Quadratic(10.0)), force(flow, phi, Called()), strict=True):
        np.testing.assert_allclose(b, a, atol=1e-12 * np.abs(a).max())


def test_a_plane_and_its_extrusion_have_the_same_force_bit_for_bit():
    plane, block = Grid((26, 20), 0.08, (-1.04, -0.8)), Grid((26, 20, 5), 0.08, (-1.04, -0.8, 0.0))
    wall, periodic = (Side("no-slip"),) * 2, (Side("periodic"),) * 2
    forces = []
    for grid, sides in ((plane, (wall, wall)), (block, (wall, wall, periodic))):
        flow = Flow(grid, Edges(grid, sides), 1.0, 0.01)
        forces.append(force(flow, grid.sample(lambda x, y, *_: level(x, y)), Quadratic(10.0)))
    for a in (0, 1):
        np.testing.assert_array_equal(forces[1][a], np.repeat(forces[0][a][:, :, None], 5, axis=2))
    assert np.abs(forces[0][0]).max() > 1.0 and not forces[1][2].any()


@pytest.mark.parametrize("dirac", ["plain", "renormalised"])
@pytest.mark.parametrize(
    "phi",
    [lambda x, y: 0 * x + 0 * y, lambda x, y: 0 * x + 0 * y + 7.0, lambda x, y: np.hypot(x, y) - 0.01,
     lambda x, y: 1e12 * level(x, y), lambda x, y: 1e-12 * level(x, y), lambda x, y: x + 0 * y],
)  # fmt: skip
def test_extremes_stay_finite(phi, dirac):
    """Flat, empty, thinner than a cell, steep, shallow, an interface through nodes; eight cells."""
    flow = tank(8)
    for f in force(flow, flow.grid.sample(phi), Linear(1.0), dirac=dirac):
        assert np.isfinite(f).all()


def test_both_forms_move_the_fluid_alike():
    """In a scene, to t = 0.1; the pressures differ by E'|∇φ|D_ε."""
    found = []
    for cells in (32, 64):
        changes = {"box.cells": cells, "clock.end": 0.1, "clock.step": 0.002}
        body = {"coupling": "explicit", "dirac": "plain", "width": {"length": 0.1875}}
        scene = scenes.load(
            "configs/scenes/elliptic_membrane.yaml", changes | {f"bodies.0.{k}": v for k, v in body.items()}
        )
        found.append(korteweg.together(scene, {"law": "membrane"}))
    assert found[1]["difference"] < 0.07
    assert found[0]["difference"] > 3 * found[1]["difference"]
    assert found[1]["pressure"] < 0.1
