"""Bending: the force of curves and surfaces, and the energy."""

import numpy as np
import pytest

from fsiwork.bodies.band import Band
from fsiwork.bodies.bending import FORMS, Bending
from fsiwork.core.grid import Grid
from fsiwork.core.shapes import Ball, Ellipsoid
from fsiwork.studies import willmore


def made(n, shape, dim=2, form="pointwise", eps=4):
    grid = Grid((n,) * dim, 2 / n, (-1.0,) * dim)
    phi = np.array(grid.sample(shape.distance))
    band = Band(grid, eps * grid.h, True)
    band.find(phi)
    return grid, phi, band, Bending(grid, 2.0, eps * grid.h, True, form)


@pytest.mark.parametrize("form", FORMS)
def test_a_circle_bends_outward_by_half_its_curvature_cubed(form):
    """k(κ_ss + ½κ³) = k/(2R³), at order two."""
    errors = []
    for n in (48, 96):
        grid, phi, band, bending = made(n, Ball((0.0, 0.0), 0.6), form=form)
        near = np.abs(grid.inside(phi)) < grid.h
        found = grid.inside(bending.resistance(phi, band))[near]
        radius = 0.6 + grid.inside(phi)[near]
        errors.append(np.abs(found / (2.0 / (2 * radius**3)) - 1).max())
    assert errors[1] < 2e-2
    assert np.log2(errors[0] / errors[1]) > 1.8


@pytest.mark.parametrize("form", FORMS)
def test_a_plane_field_extruded_has_the_forces_of_its_plane(form):
    shape = Ellipsoid((0.0, 0.0), (0.6, 0.4))
    forces = {}
    for dim in (2, 3):
        n = (24, 24, 8)[:dim]
        grid = Grid(n, 2 / 24, (-1.0,) * dim)
        phi = np.array(grid.sample(lambda *x: shape.distance(*x[:2]) + 0 * x[-1]))
        band = Band(grid, 3 * grid.h, True)
        band.find(phi)
        force = [grid.field() for _ in grid.axes]
        Bending(grid, 1.0, 3 * grid.h, True, form).add(force, phi, band)
        forces[dim] = grid, force
    (flat, two), (solid, three) = forces[2], forces[3]
    for a in range(2):
        plane, layers = flat.inside(two[a]), solid.inside(three[a])
        assert np.abs(plane).max() > 1.0
        assert np.abs(layers - plane[:, :, None]).max() <= 1e-12 * np.abs(plane).max()
    assert np.abs(solid.inside(three[2])).max() <= 1e-12


def test_the_force_of_an_ellipse_falls_as_its_energy_says():
    """Power of the force in a solenoidal velocity is minus the rate of ∫½kκ² along it, to a few percent of ε."""
    shape, d = Ellipsoid((0.0, 0.0), (0.6, 0.45)), 1e-4
    grid, phi, band, bending = made(128, shape)
    force = [grid.field() for _ in grid.axes]
    bending.add(force, phi, band)
    power = sum(
        force[a] @ np.ravel(grid.sample(lambda *x, a=a: (x[0], -x[1])[a] + 0 * x[0] * x[1], face=a)) for a in grid.axes
    )
    energies = []
    for sign in (1, -1):
        stretched = Ellipsoid((0.0, 0.0), (0.6 * np.exp(sign * d), 0.45 * np.exp(-sign * d)))
        q = np.array(grid.sample(stretched.distance))
        band.find(q)
        energies.append(bending.energy(q, band))
    rate = (energies[0] - energies[1]) / (2 * d)
    assert power * grid.cell_volume == pytest.approx(-rate, rel=0.05)


def test_energy_of_a_circle_and_a_sphere():
    """Of a circle a little more: the mean of 1/(R + d) over the band."""
    _, phi, band, bending = made(96, Ball((0.0, 0.0), 0.6))
    assert bending.energy(phi, band) == pytest.approx(2.0 * np.pi / 0.6, rel=4e-3)
    _, phi, band, bending = made(48, Ball((0.0, 0.0, 0.0), 0.6), dim=3)
    assert bending.energy(phi, band) == pytest.approx(2.0 * 8 * np.pi, rel=3e-3)


@pytest.mark.parametrize("surface", willmore.SURFACES)
def test_surfaces_have_the_exact_force(surface):
    errors = [willmore.force(None, {"cells": n, "surface": surface, "form": "pointwise"})["error"] for n in (32, 64)]
    assert np.log2(errors[0] / errors[1]) > 1.7


def test_exact_forces_agree_where_both_are_known():
    """A torus against differences of its own curvature, along the tube."""
    angle = np.linspace(0.1, 3.0, 7)
    r, R = willmore.TUBE, willmore.RADIUS
    x = R + r * np.cos(angle)
    found = willmore.exact_torus(x, 0 * x, r * np.sin(angle))
    d = 1e-4

    def H(t):
        return 1 / r + np.cos(t) / (R + r * np.cos(t))

    def flux(t):
        return (R + r * np.cos(t)) * (H(t + d) - H(t - d)) / (2 * d)

    spread = (flux(angle + d) - flux(angle - d)) / (2 * d) / (r**2 * x)
    gauss = np.cos(angle) / (r * x)
    assert found == pytest.approx(spread + 0.5 * H(angle) * (H(angle) ** 2 - 4 * gauss), rel=1e-4)


def test_an_unknown_form_is_refused():
    with pytest.raises(ValueError, match="form must be one of pointwise, divergence"):
        Bending(Grid((8, 8), 0.1), 1.0, 0.3, True, "weak")
