"""Active contours: the gradient is that of the energy, every step goes down, and units do not matter."""

import math
from itertools import pairwise

import numpy as np
import pytest

from fsiwork.core.contours import Contours, descend
from fsiwork.core.grid import Grid
from fsiwork.core.segmentation import segment, surrounding, two_levels
from fsiwork.studies import segmentation
from fsiwork.studies.orders import slope

RNG = np.random.default_rng(12)


def noisy(n, noise=0.3):
    """A ball in the middle third under noise, its mask, and the image."""
    x = np.meshgrid(*(np.arange(k) + 0.5 - k / 2 for k in n), indexing="ij", sparse=True)
    clean = sum(c * c for c in x) < (min(n) / 3.5) ** 2
    return clean, clean + RNG.normal(0, noise, n)


def bumpy(n):
    """A level set with a curved interface that is no distance."""
    x = np.meshgrid(*(np.arange(k) / k for k in n), indexing="ij", sparse=True)
    return 8 * (sum((c - 0.5) ** 2 for c in x) - 0.08 + 0.05 * np.sin(9 * x[0]) * x[1])


@pytest.mark.parametrize("n", [(24, 20), (14, 12, 16)])
def test_the_rate_is_minus_the_gradient(n):
    contours = Contours(Grid(n, 0.5), noisy(n)[1], 0.7, 1.5)
    phi, psi = bumpy(n), RNG.normal(size=n)
    rate, s = contours.rate(contours.state(phi)), 1e-6
    change = (contours.state(phi + s * psi).energy - contours.state(phi - s * psi).energy) / (2 * s)
    assert change == pytest.approx(-np.vdot(rate, psi) * contours.grid.cell_volume, rel=1e-6)


@pytest.mark.parametrize("n", [(32, 28), (14, 16, 12)])
def test_every_step_decreases_the_energy(n):
    contours = Contours(Grid(n, 1.0), noisy(n)[1], 0.3, 2.0)
    energies = []

    def watch(step, state, fresh):
        energies.append((state.energy, fresh))

    descend(contours, bumpy(n), every=10, steps=40, watch=watch)
    falls = [b[0] - a[0] for a, b in pairwise(energies) if not b[1]]
    assert len(falls) >= 20
    assert max(falls) < 0


def test_with_the_sign_of_the_print_no_step_goes_down(monkeypatch):
    _, image = noisy((32, 32))
    contours = Contours(Grid(image.shape, 1.0), image, 1.0, 2.0)
    right = contours.rate
    monkeypatch.setattr(contours, "rate", lambda state: -right(state))
    assert contours.step(contours.state(bumpy(image.shape)), 1.0) == (None, 0.0)


def test_the_length_in_the_energy_is_that_of_a_circle():
    errors, cells = [], (32, 64, 128)
    for n in cells:
        grid = Grid((n, n), 2 / n, (-1.0, -1.0))
        x, y = grid.points(ghosts=0)
        contours = Contours(grid, np.zeros(grid.n), 1.0, 0.25)  # an image without levels: the energy is β times length
        errors.append(abs(contours.state(np.hypot(x, y) - 0.6).energy / (1.2 * np.pi) - 1))
    assert slope(2 / np.array(cells), errors) > 1.7
    assert errors[-1] < 5e-3


@pytest.mark.parametrize("n", [(40, 36), (18, 20, 16)])
def test_a_noisy_ball_is_found(n):
    clean, image = noisy(n)
    found = segment(image, smoothing=1.5)
    assert found.ended == "settled"
    mask = found.phi < 0
    assert 2 * (mask & clean).sum() / (mask.sum() + clean.sum()) > 0.93
    assert segmentation.largest_rise(found) < 0
    assert found.inside == pytest.approx(1, abs=0.15)
    assert found.outside == pytest.approx(0, abs=0.15)


@pytest.mark.parametrize(("scale", "shift"), [(1e12, 0.0), (1e-12, 0.0), (-3.0, 100.0)])
def test_units_do_not_matter(scale, shift):
    _, image = noisy((36, 36))
    one, other = segment(image), segment(scale * image + shift)
    assert ((one.phi < 0) == (other.phi < 0)).all()
    assert other.inside == pytest.approx(scale * one.inside + shift, rel=1e-6)


def test_directions_and_precision_do_not_matter():
    _, image = noisy((36, 30))
    one = segment(image).phi < 0
    assert (segment(image.T).phi.T < 0).mean() == pytest.approx(one.mean(), abs=2e-3)
    assert ((segment(image.astype(np.float32)).phi < 0) == one).mean() > 0.998


def test_contours_split_and_spots_are_noise():
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(64) + 0.5, indexing="ij")
    discs = [np.hypot(x - a, y - b) < r for a, b, r in ((20, 32, 9), (46, 40, 8), (40, 14, 1.4))]
    found = segment(np.logical_or.reduce(discs).astype(float), smoothing=2.5).phi < 0
    assert found[20, 32]
    assert found[46, 40]
    assert not found[33, 36]  # between the discs
    assert not found[40, 14]  # the spot


def test_a_shape_at_the_side_is_kept():
    image = np.zeros((40, 40))
    image[:12, 10:30] = 1.0
    found = segment(image, smoothing=1.0)  # the first contour vanishes: it has as much of the shape outside as inside
    assert ((found.phi < 0) == (image > 0)).mean() > 0.98
    assert (segment(1 - image, smoothing=1.0).phi < 0)[5, 20]


def test_holes_are_found_from_the_levels_only():
    x, y = np.meshgrid(np.arange(48) - 23.5, np.arange(48) - 23.5, indexing="ij")
    clean = (np.hypot(x, y) < 17) & (np.hypot(x, y) > 8)
    image = 5 - 2 * clean + RNG.normal(0, 0.6, x.shape)  # dark
    around, levels = (segment(image, start=start).phi < 0 for start in ("around", "levels"))
    assert around[24, 24]
    assert not levels[24, 24]
    assert (levels == clean).mean() > 0.97


@pytest.mark.parametrize("shape", [(8, 8), (8, 9, 8)])
def test_the_smallest_images(shape):
    image = np.zeros(shape)
    image[(slice(2, 6),) * len(shape)] = 1.0
    found = segment(image, smoothing=0.3, eps=1.5)
    assert np.isfinite(found.phi).all()
    assert found.phi[(4,) * len(shape)] < 0 < found.phi[(0,) * len(shape)]


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (np.zeros((9, 9)), "nothing to part"),
        (np.full((9, 9), 1e300) * np.array([-1] + [1] * 8) * 1e8, "not finite"),
        (np.zeros((7, 9)), "at least 8 cells"),
        (np.zeros(99), "at least 8 cells"),
        (np.where(np.eye(9) > 0, np.nan, 0.0), "9 values are not finite"),
    ],
)
def test_what_cannot_be_parted_is_refused(image, words):
    with pytest.raises(ValueError, match=words):
        segment(image)


@pytest.mark.parametrize(("smoothing", "eps"), [(0.0, 1.0), (1.0, 0.0), (math.nan, 1.0), (-1.0, 1.0)])
def test_bad_numbers_are_refused(smoothing, eps):
    with pytest.raises(ValueError, match="positive"):
        segment(noisy((9, 9))[1], smoothing, eps)
    with pytest.raises(ValueError, match="around, levels"):
        segment(noisy((9, 9))[1], start="inside")
    with pytest.raises(ValueError, match="shape"):
        Contours(Grid((9, 9), 1.0), np.zeros((9, 8)), 1.0, 1.0)


def test_two_levels_of_two_values():
    image = np.where(np.arange(900).reshape(30, 30) % 7 == 0, 12.0, -3.0)
    assert two_levels(image) == pytest.approx((-3.0, 12.0))


def test_the_first_contour_is_inside_the_sides_and_around_everything():
    phi = surrounding((40, 30))
    assert phi[0].min() > 0
    assert phi[:, -1].min() > 0
    assert (phi[7:-7, 7:-7] < 0).all()
