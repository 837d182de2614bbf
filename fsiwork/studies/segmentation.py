"""Fig. 1.3: noisy pictures of known shapes and a volume, parted by active contours from one curve around everything."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.core.grid import Grid
from fsiwork.core.segmentation import Segmentation, segment, surrounding
from fsiwork.core.shapes import Ball, Box, Capsule, Ellipsoid, Polygon, Torus
from fsiwork.layout import Geometry, contour

NOISE = 0.3  # standard deviation, in parts of the contrast
FRAMES = 7
EVERY = 8  # steps


def _clover(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    radius, angle = np.hypot(x - 0.7, y - 0.7), np.arctan2(y - 0.7, x - 0.7)
    return radius - 0.15 * (1 + 0.3 * np.cos(5 * angle))


PICTURES: dict[str, tuple[int, float, float, tuple[Callable[..., np.ndarray], ...]]] = {
    "discs": (
        11,
        1.0,
        0.0,
        (
            Ball((0.28, 0.3), 0.12).distance,
            Ball((0.7, 0.25), 0.09).distance,
            Ball((0.3, 0.72), 0.14).distance,
            Box((0.72, 0.68), (0.12, 0.4)).distance,
        ),
    ),
    "others": (
        2027,
        40.0,
        210.0,
        (
            _clover,
            Polygon(((0.15, 0.55), (0.45, 0.6), (0.2, 0.88))).distance,
            lambda x, y: Ellipsoid((0.0, 0.0), (0.26, 0.09)).distance(
                0.8 * (x - 0.35) + 0.6 * (y - 0.27), 0.8 * (y - 0.27) - 0.6 * (x - 0.35)
            ),
            Capsule((0.75, 0.15), (0.85, 0.38), 0.05).distance,
        ),
    ),
    "volume": (5, 1.0, 0.0, (Torus((0.5, 0.5, 0.35), 0.25, 0.1).distance, Ball((0.5, 0.5, 0.68), 0.14).distance)),
}
"""Seed, level inside, level outside, and shapes in the unit box. No parameter was chosen on ``others`` and
``volume``."""


def picture(name: str, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """The clean shapes (True inside) and the noisy image on ``cells`` along each side; volumes have three."""
    seed, inside, outside, shapes = PICTURES[name]
    grid = Grid((cells,) * (3 if name == "volume" else 2), 1 / cells)
    x = grid.points(ghosts=0)
    clean = np.broadcast_to(np.minimum.reduce([np.broadcast_to(f(*x), grid.n) for f in shapes]), grid.n) < 0
    noise = np.random.default_rng(seed).normal(0, NOISE * abs(inside - outside), grid.n)
    return clean, np.where(clean, inside, outside) + noise


def segmented(_scene, point: dict[str, Any]) -> dict[str, Any]:
    """Dice coefficient against the clean picture, rises of the energy in steps, pieces, and what the figure shows."""
    from scipy.ndimage import label

    cells, name = int(point["cells"]), point["picture"]
    clean, image = picture(name, cells)
    frames = [surrounding(image.shape)]
    found = segment(image, watch=lambda step, state, fresh: None if step % EVERY or fresh else frames.append(state.phi))
    mask = found.phi < 0
    out: dict[str, Any] = {
        "dice": 2 * int((mask & clean).sum()) / int(mask.sum() + clean.sum()),
        "largest_rise": largest_rise(found),
        "energy_fall": found.energy[-1] / found.energy[0],
        "pieces": label(mask)[1],
        "pieces_wrong": abs(label(mask)[1] - label(clean)[1]),
        "first_pieces": label(frames[0] < 0)[1],
        "surrounded": bool((frames[0][clean] < 0).all()),
        "level_error": abs((found.inside - found.outside) / (PICTURES[name][1] - PICTURES[name][2]) - 1),
        "settled": found.ended == "settled",
        "n_steps": found.steps,
        "n_cells": cells,
    }
    if image.ndim == 2:
        out |= _shown(image, frames, found)
    return out


def largest_rise(found: Segmentation) -> float:
    """Largest rise of the energy in a step, over the first energy; negative when it always falls. Redistancing, across
    which it may rise, is no step."""
    rises = np.diff(found.energy)[~found.fresh[1:]]
    return float(rises.max() / found.energy[0]) if rises.size else math.nan


def _shown(image: np.ndarray, frames: list[np.ndarray], found: Segmentation) -> dict[str, Any]:
    """The image, row by row from below, scaled by the levels found; points of the contour on its way and at
    the end, pieces parted by NaN; the energy after each step in parts of the first."""
    way = [0] + [k for k in range(1, len(frames)) if ((frames[k] < 0) != (frames[k - 1] < 0)).mean() > 0.001]
    chosen = np.array(way)[np.linspace(0, len(way) - 1, min(FRAMES, len(way))).round().astype(int)]
    grid = Geometry(image.shape, 1 / image.shape[0], (0.0, 0.0), (False, False))
    points: list[list[float]] = [[], [], []]
    for number, phi in enumerate([*(frames[k] for k in chosen), found.phi]):
        line = contour(phi.T, grid)
        ends = 1 + np.flatnonzero(np.diff(line["piece"], append=-1))
        for row, name in zip(points, "xy", strict=False):
            row += np.insert(line[name], ends, np.nan).round(5).tolist()
        points[2] += [float(number)] * (len(points[0]) - len(points[2]))
    scaled = (image - found.outside) / (found.inside - found.outside)
    return {
        "image": (("pixel",), scaled.T.ravel().round(3)),
        **{
            f"contour_{name}": (("vertex",), np.array(row))
            for name, row in zip(("x", "y", "frame"), points, strict=True)
        },
        "energy": (("row",), found.energy / found.energy[0]),
        "redistanced": (("row",), found.fresh.astype(float)),
    }


def fig_1_3(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """Dice coefficients and energies of both pictures and of the volume; the worst of all where nothing is named."""
    flat, solid = datasets["segmentation"].squeeze("cells"), datasets["segmentation_volume"]

    def worst(name: str, pick: str) -> float:
        return float(getattr(np, pick)([getattr(data[name], pick)(skipna=False) for data in (flat, solid)]))

    out = {f"dice_{name}": float(flat["dice"].sel(picture=name)) for name in ("discs", "others")}
    return out | {
        "dice_volume": float(solid["dice"].min()),
        "largest_rise": worst("largest_rise", "max"),
        "energy_fall": worst("energy_fall", "max"),
        "pieces_discs": float(flat["pieces"].sel(picture="discs")),
        "pieces_wrong": worst("pieces_wrong", "max"),
        "first_pieces": worst("first_pieces", "max"),
        "surrounded": worst("surrounded", "min"),
        "settled": worst("settled", "min"),
        "level_error": worst("level_error", "max"),
    }
