"""The length of a circle by height functions, against the sum over a Dirac on the whole grid."""

import numpy as np

from benchmarks.rows import Row, row
from benchmarks.timing import least
from fsiwork.core import levelset
from fsiwork.core.grid import Grid
from fsiwork.core.integrals import length, length_and_area, smeared
from fsiwork.core.shapes import Ball

CELLS = 1.5  # ε/Δx


def geometric(n: int = 512, seconds: float = 2.0) -> Row:
    """Milliseconds for the length (and the area with it) of one circle on n²; peer: Σ D_ε|∇φ|, cosine, renormalised.

    The note says what the sum costs in arrays kept from before, and how far both are from the length.
    """
    grid, radius = Grid((n, n), 1 / n), 0.3
    phi = grid.sample(Ball((0.503, 0.498), radius).distance)
    eps, density, slope = CELLS * grid.h, grid.field(), grid.field()

    def kept():
        levelset.dirac(phi, eps, "cosine", "renormalised", grid, density)
        np.multiply(density, levelset.gradient_norm(grid, phi, slope), out=slope)
        return grid.inside(slope).sum() * grid.cell_volume

    stages = {
        "ours": lambda: length_and_area(grid, phi),
        "dirac": lambda: smeared(grid, phi, eps, "cosine", "renormalised"),
        "kept": kept,
    }
    took = {name: 1e3 * t for name, t in least(stages, seconds).items()}
    exact = 2 * np.pi * radius
    errors = [abs(q / exact - 1) for q in (length(grid, phi), kept())]
    note = f"{took['kept']:.2g} ms in arrays kept from before; errors {errors[0]:.0e} and {errors[1]:.0e}"
    peer = ("sum over a full-grid Dirac", took["dirac"])
    return row("geometric_length", took["ours"], "ms", "ratio <= 1", against=peer, note=note)
