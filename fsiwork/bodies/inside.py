"""What an interface encloses: volume, centroid, half-extents."""

import math

import numpy as np

from fsiwork.bodies.band import Band
from fsiwork.core.edges import Edges
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels import interface as kernels


class Inside:
    """Measures the set φ < 0 of a box.

    Parameters
    ----------
    grid, edges : where
    eps : half-width of H_ε(φ) [unit of φ]
    """

    def __init__(self, grid: Grid, edges: Edges, eps: float):
        self.grid, self.edges, self.eps = grid, edges, eps
        self._sums = np.zeros((grid.rows()[0].size, 3))
        # In a periodic direction the centroid is the angle of the mean of exp(2πi x/L).
        angles = [2.0 * np.pi * (grid.coordinate(a) - grid.origin[a]) / grid.length[a] for a in grid.axes]
        self._moments = [
            np.array([np.cos(angles[a]), np.sin(angles[a])])
            if edges.periodic(a)
            else np.array([grid.coordinate(a), np.zeros(grid.n[a])])
            for a in grid.axes
        ]
        self._last = np.zeros((4, grid.n[-1] + 1))
        self._last[:2, :-1] = self._moments[-1]
        self._last[2:, 1:] = np.cumsum(self._moments[-1], axis=1)

    def volume(self, phi: np.ndarray, band: Band) -> tuple[float, tuple[float, ...]]:
        """∫χ [length^d] and the centroid ∫xχ/∫χ, χ = 1 - H_ε(φ); NaN for the centroid of nothing."""
        g, (start, n) = self.grid, self.grid.rows()
        kernels.inside_sums(self._sums, phi, start, n, band.flags, band.row, self._last, self.eps)
        total = float(self._sums[:, 0].sum())
        if not total > 0.0:
            return 0.0, (np.nan,) * g.dim
        rows = self._sums[:, 0].reshape(g.n[:-1])
        lines = [rows.sum(axis=tuple(b for b in range(rows.ndim) if b != a)) for a in g.axes[:-1]]
        sums = [self._moments[a] @ line for a, line in enumerate(lines)] + [self._sums[:, 1:].sum(axis=0)]
        return total * g.cell_volume, tuple(self._mean(a, q, total) for a, q in enumerate(sums))

    def _mean(self, a: int, q: np.ndarray, total: float) -> float:
        g = self.grid
        if not self.edges.periodic(a):
            return float(q[0] / total)
        turn = math.atan2(q[1], q[0]) / (2.0 * math.pi)
        return g.origin[a] + turn % 1.0 * g.length[a]

    def half_extent(self, phi: np.ndarray, centre: tuple[float, ...], a: int) -> float:
        """Half the distance [length] of the two zeros of φ (flat, ghosts filled) next to ``centre`` along ``a``.

        φ is interpolated by cubics, across to the line and along it. If the centre lies outside (a crescent), the first
        and the last zero count; 0.0 if there are not two.
        """
        grid, line = self.grid, self.grid.padded(phi)
        base = [math.floor((x - o) / grid.h - 0.5) for x, o in zip(centre, grid.origin, strict=True)]
        for b in reversed(grid.axes):
            if b != a:
                t = (centre[b] - grid.origin[b]) / grid.h - 0.5 - base[b]
                near = slice(GHOSTS + base[b] - 1, GHOSTS + base[b] + 3)
                line = np.moveaxis(line[(slice(None),) * b + (near,)], b, -1) @ _weights(t)
        middle = base[a]
        if self.edges.periodic(a):
            n = grid.n[a]
            inner = np.roll(line[GHOSTS : GHOSTS + n], n // 2 - middle)
            line, middle = np.concatenate([inner[-GHOSTS:], inner, inner[:GHOSTS]]), n // 2
        middle += GHOSTS
        inside = line < 0.0
        zeros = np.flatnonzero(inside[1:-2] != inside[2:-1]) + 1
        if zeros.size < 2:
            return 0.0
        low, high = zeros[zeros < middle], zeros[zeros >= middle]
        first, last = (low[-1], high[0]) if inside[middle] and low.size and high.size else (zeros[0], zeros[-1])
        return 0.5 * grid.h * (_zero(line, int(last)) - _zero(line, int(first)))


def _weights(t: float) -> np.ndarray:
    """Cubic weights at -1, 0, 1, 2 for the place 0 ≤ t ≤ 1."""
    p, m, q = t + 1.0, t - 1.0, t - 2.0
    return np.array([-t * m * q / 6.0, p * m * q / 2.0, -p * t * q / 2.0, p * t * m / 6.0])


def _zero(v: np.ndarray, i: int) -> float:
    """Zero of the cubic through v[i-1 … i+2], between i and i+1: Newton, kept in that interval."""
    a, b, c, d = (float(q) for q in v[i - 1 : i + 3])
    c3, c2 = (d - a) / 6.0 + (b - c) / 2.0, (a + c) / 2.0 - b
    c1 = c - a / 3.0 - b / 2.0 - d / 6.0
    t = b / (b - c) if b != c else 0.5
    for _ in range(8):
        slope = c1 + t * (2.0 * c2 + 3.0 * t * c3)
        step = (b + t * (c1 + t * (c2 + t * c3))) / slope if slope else 0.0
        t = min(max(t - step, 0.0), 1.0)
        if abs(step) < 1e-14:
            break
    return i + t
