"""Distance to the line or surface φ = 0 of any level set with the right zeros: several methods behind one door."""

from collections.abc import Callable
from importlib import import_module

import numpy as np

from fsiwork.core.grid import Grid

METHODS: dict[str, str] = {
    "pde": "relaxation.pde",
    "subcell": "relaxation.subcell",
    "fast-marching-1": "marching.fast_marching_1",
    "fast-marching-2": "marching.fast_marching_2",
    "fast-sweeping": "marching.fast_sweeping",
    "closest-cubic": "closest.cubic",
    "closest-quintic": "closest.quintic",
    "sweep": "closest.sweep",
}
"""Name → module and function of `fsiwork.core`, imported when asked for: (grid, phi, band) → new flat field."""


def named(name: str) -> Callable[[Grid, np.ndarray, float | None], np.ndarray]:
    """The function of one of `METHODS`. Raises ValueError for another name."""
    if name not in METHODS:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, got {name!r}")
    module, function = METHODS[name].split(".")
    return getattr(import_module(f"fsiwork.core.{module}"), function)


def redistance(grid: Grid, phi: np.ndarray, method: str, band: float | None = None) -> np.ndarray:
    """A new field with the zero line and the signs of ``phi`` whose values are distances.

    Zeros are seen by the signs of nodes: what lies between two nodes, thinner than a cell, is dropped.

    Parameters
    ----------
    phi : flat field at centres, shape ``(grid.size,)``, ghosts filled; any scale
    method : one of `METHODS`
    band : reach on each side of the interface [cells]; None: the method's own

    Returns
    -------
    Flat field [length] of the type of ``phi``. The closest-point methods fill its ghosts too; after the others the
    caller fills them.
    """
    if phi.shape != (grid.size,):
        raise ValueError(f"a flat field has the shape ({grid.size},), got {phi.shape}")
    if band is not None and not band > 0:
        raise ValueError(f"band must be positive, got {band}")
    return named(method)(grid, phi, band)
