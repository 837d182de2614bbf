"""Redistancing beside scikit-fmm of second order: the same φ, timed in turn, errors against the exact distance.

φ = (√(Σ x²/a²) - 1)((x - .35)² + (y - .25)² + .1) on the unit box around the origin; half-axes .35, .2 and .25.
"""

import math
from types import ModuleType

import numpy as np

from benchmarks.rows import Row, row
from benchmarks.timing import least
from fsiwork.core.grid import Grid
from fsiwork.core.redistance import redistance
from fsiwork.core.shapes import Ellipsoid

AXES = (0.35, 0.2, 0.25)
BAND = 6  # cells
NEAR = 3  # errors are the largest so many cells from the interface
MARKS = {
    "fmm_full": ("sweep", None, 2, 5.0),
    "fmm_band": ("closest-cubic", BAND, 2, 3.0),
    "fmm_band_quintic": ("closest-quintic", BAND, 2, 2.0),
    "fmm_3d": ("sweep", None, 3, 3.0),
    "fmm_3d_band": ("closest-cubic", BAND, 3, 1.3),
}
"""Row → method, band [cells], directions, how many times faster it is to be."""
BETTER = {2: 1000.0, 3: 500.0}  # how many times smaller the error is to be


def peer() -> ModuleType | None:
    """scikit-fmm, where it is installed."""
    try:
        import skfmm
    except ImportError:
        return None
    return skfmm


def distorted(cells: int, dim: int) -> tuple[Grid, np.ndarray]:
    """Flat field of φ on ``cells`` a side, ghosts included."""
    grid = Grid((cells,) * dim, 1 / cells, (-0.5,) * dim)

    def phi(*x):
        scaled = np.sqrt(sum((c / a) ** 2 for c, a in zip(x, AXES, strict=False))) - 1
        return scaled * ((x[0] - 0.35) ** 2 + (x[1] - 0.25) ** 2 + 0.1)

    return grid, grid.sample(phi)


def error(grid: Grid, distance: np.ndarray) -> float:
    """Largest error of an array of cells within `NEAR` Δx of the interface [length]."""
    x = np.broadcast_arrays(*grid.points(ghosts=0))
    scaled = np.sqrt(sum((c / a) ** 2 for c, a in zip(x, AXES, strict=False))) - 1
    some = np.abs(scaled) * min(AXES) <= NEAR * grid.h  # at most the distance
    exact = Ellipsoid((0.0,) * grid.dim, AXES[: grid.dim]).distance(*(c[some] for c in x))
    return float(np.abs(distance[some] - exact)[np.abs(exact) <= NEAR * grid.h].max())


def compare(names: tuple[str, ...], cells: int, seconds: float = 2.0, rounds: int = 10) -> list[Row]:
    """Rows of some of `MARKS`; all of one dimension and either in full or in a band."""
    skfmm = peer()
    dim, band = MARKS[names[0]][2], MARKS[names[0]][1]
    grid, phi = distorted(cells, dim)
    stages = {name: lambda name=name: redistance(grid, phi, *MARKS[name][:2]) for name in names}
    if skfmm is not None:
        box = np.ascontiguousarray(grid.inside(phi))
        narrow = 0.0 if band is None else band * grid.h
        stages["peer"] = lambda: skfmm.distance(box, dx=grid.h, order=2, narrow=narrow)
    took = least(stages, seconds, rounds)
    errors = {name: error(grid, grid.inside(stages[name]())) for name in names}
    far = error(grid, stages["peer"]()) if skfmm is not None else math.nan
    return [_row(name, cells, took, errors[name], far) for name in names]


def _row(name: str, cells: int, took: dict[str, float], error: float, far: float) -> Row:
    method, band, dim, faster = MARKS[name]
    what = f"{method}, {cells}{'²' if dim == 2 else '³'}, {'whole box' if band is None else f'{band} cells'}"
    mark = f"ratio <= {1 / faster:.3g}"
    if "peer" not in took:
        note = f"{what}, error {error:.1e}; scikit-fmm is not installed"
        return row(name, 1e3 * took[name], "ms", mark, against=("scikit-fmm", None), note=note)
    note = f"{what}: {took['peer'] / took[name]:.1f} times faster, error {error:.1e} against {far:.1e}"
    peer_ms = 1e3 * took["peer"]
    ours = {"against": ("scikit-fmm", peer_ms), "besides": BETTER[dim] * error <= far, "note": note}
    return row(name, 1e3 * took[name], "ms", mark, **ours)


def full() -> list[Row]:
    """1024², the whole box."""
    return compare(("fmm_full",), 1024)


def narrow() -> list[Row]:
    """1024², a band: cubic and quintic."""
    return compare(("fmm_band", "fmm_band_quintic"), 1024)


def space() -> list[Row]:
    """128³: the whole box, and a band."""
    return [*compare(("fmm_3d",), 128, 1.0, 3), *compare(("fmm_3d_band",), 128, 1.0, 5)]
