"""The pressure equation between walls, against the cosine transforms that the usual solver takes."""

import numpy as np
import scipy.fft

from benchmarks.rows import Row, row
from benchmarks.timing import least, triad
from fsiwork.core.poisson import Direct


def poisson(n: int = 512, seconds: float = 2.0) -> Row:
    """Nanoseconds a cell of one solve on n²; peer: `dctn` there and back alone, without the division between."""
    f = np.random.default_rng(7).standard_normal((n, n))
    ours, theirs = f - f.mean(), f.copy()
    solver = Direct((n, n), np.pi / n, (("neumann", "neumann"),) * 2)  # smallest eigenvalue 1: no drift to denormals

    def solve():
        solver.solve(ours)

    def transforms():
        q = scipy.fft.dctn(theirs, type=2, overwrite_x=True, workers=1)
        scipy.fft.idctn(q, type=2, overwrite_x=True, workers=1)

    took = least({"ours": solve, "theirs": transforms}, seconds)
    ns, peer = took["ours"] / n**2 * 1e9, took["theirs"] / n**2 * 1e9
    roof = 16.0 / triad(n * n) * 1e9  # f read, q written
    return row("poisson_2d", ns, "ns a cell", "<= 6", against=("scipy dctn + idctn", peer), share=roof / ns)
