"""Transport of centre fields by a velocity on the faces: ∂t q + u·∇q = 0 (1.2)."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from fsiwork.core.grid import Grid
from fsiwork.core.kernels import transport as kernels

Scheme = Literal["weno5", "weno-z", "upwind5", "upwind1"]

# Shu-Osher form: each stage is q <- a q(t) + b (q - dt u·∇q).
TABLEAUX = {
    "euler": ((0.0, 1.0),),
    "ssp-rk2": ((0.0, 1.0), (1 / 2, 1 / 2)),
    "ssp-rk3": ((0.0, 1.0), (3 / 4, 1 / 4), (1 / 3, 2 / 3)),
}

# Floor of the smoothness indicators over the square of the largest difference in the field.
FLOORS = {
    ("weno5", np.float64): 1e-6,
    ("weno5", np.float32): 1e-6,
    ("weno-z", np.float64): 1e-40,
    ("weno-z", np.float32): 1e-6,
}

COURANT = 0.5  # dt Σ|u_i|/h; SSP-RK3 with WENO5 is stable to 1.43 in 1D
MOST_SUBSTEPS = 10_000  # beyond this the velocity has diverged: stop chasing it and let the run show it


class Transport:
    """Carries centre fields with the flow; planned once for a grid, a scheme and a Runge-Kutta tableau.

    Parameters
    ----------
    grid : the grid
    edges : fills ghosts with ``fill_scalar(q, rule)``
    scheme : ``weno5`` (Jiang and Shu's weights), ``weno-z`` (fifth order at critical points too),
        ``upwind5`` (their linear limit: for smooth fields such as x - Y) or ``upwind1``
    tableau : ``ssp-rk3``, ``ssp-rk2`` or ``euler`` (the last sharpens kinks with WENO: for figures only)
    centring : order of the velocity at the centres. 4, (-1, 9, 9, -1)/16, keeps the volume of an oscillating
        drop 3 to 8 times better from 128 cells on; 2 is the adjoint of how a membrane's force goes to the faces, and
        with 4 a membrane makes energy
    dtype : of the fields; float32 is safe at any magnitude of the field because the weights are relative

    Attributes
    ----------
    substeps : number of substeps of the last `advance`

    Raises
    ------
    ValueError : unknown scheme or tableau
    """

    def __init__(
        self,
        grid: Grid,
        edges,
        scheme: Scheme = "weno5",
        tableau: str = "ssp-rk3",
        dtype=np.float64,
        centring: Literal[2, 4] = 2,
    ):
        name = scheme.replace("-", "_")
        if scheme not in ("weno5", "weno-z", "upwind5", "upwind1"):
            raise ValueError(f"transport scheme must be weno5, weno-z, upwind5 or upwind1, got {scheme!r}")
        if tableau not in TABLEAUX:
            raise ValueError(f"tableau must be one of {', '.join(TABLEAUX)}, got {tableau!r}")
        self.grid, self.edges, self.stages = grid, edges, TABLEAUX[tableau]
        self.dtype, self.centring = np.dtype(dtype), centring
        self.weighted = scheme.startswith("weno")
        self.floor = FLOORS.get((scheme, self.dtype.type), 1.0)
        self._stage, self._steepest, self._fastest = (
            getattr(kernels, f"{verb}_{grid.dim}d") for verb in (name, "steepest", "fastest")
        )
        self.substeps = 0
        self._strides = np.array(grid.strides[:-1])
        self._k = np.empty(5, self.dtype)
        self._top = np.empty(grid.rows()[0].size, self.dtype)
        self._copies = [grid.field(self.dtype) for _ in self.stages[:2]]
        self._u: list[np.ndarray] = []

    def advance(self, fields: Sequence[np.ndarray], u: Sequence[np.ndarray], dt: float, rule: str = "linear") -> None:
        """Carry every field over ``dt`` in place; ghosts are filled on entry of each stage and at the end.

        ``fields`` are flat fields at centres of the dtype given; ``u`` the components on their low faces
        [length/time], ghosts filled, constant in time; ``rule`` is handed to ``edges.fill_scalar``. Takes
        as many equal substeps as keep dt Σ|u_i|/h at or below `COURANT`.
        """
        u = self._centred(u)
        dt = dt / self._count(u, dt)
        for q in fields:
            self._weights(q, rule)
            for _ in range(self.substeps):
                self._substep(q, u, dt, rule)

    def _centred(self, u: Sequence[np.ndarray]) -> Sequence[np.ndarray]:
        """Face values of the fields' dtype whose plain average is the velocity at the centres."""
        if self.centring == 2 and all(c.dtype == self.dtype for c in u):
            return u
        if not self._u:
            self._u = [self.grid.field(self.dtype) for _ in u]
        for copy, c, s in zip(self._u, u, self.grid.strides, strict=True):
            if self.centring == 2:
                np.copyto(copy, c, casting="same_kind")
            else:
                kernels.sharpen(copy, c, *self.grid.rows(0, 1), s)
        return self._u

    def _count(self, u, dt: float) -> int:
        self._fastest(self._top, *u, *self.grid.rows(), self._strides)
        courant = abs(dt) * float(self._top.max()) / self.grid.h
        # A hair's breadth above: a step chosen as exactly the limit must not fall over it by rounding.
        needed = np.ceil(courant / COURANT * (1 - 1e-12)) if np.isfinite(courant) else 1
        self.substeps = int(min(max(needed, 1), MOST_SUBSTEPS))
        return self.substeps

    def _weights(self, q: np.ndarray, rule: str) -> None:
        """Scale and floor of the smoothness indicators: their ratio is `floor` times the largest squared difference."""
        self.edges.fill_scalar(q, rule)
        self._k[3:] = 1.0
        if not self.weighted:
            return
        self._steepest(self._top, q, *self.grid.rows(), self._strides)
        # The kernel has 12 S. Both by the root of the floor: powers of S then stay in the middle of the range.
        floor = np.sqrt(12 * self.floor)
        scale = float(self._top.max()) ** 2 * floor
        if np.finfo(self.dtype).tiny < scale < np.inf:
            self._k[3:] = 1 / scale, floor

    def _substep(self, q: np.ndarray, u, dt: float, rule: str) -> None:
        now, (start, n) = q, self.grid.rows()
        for stage, (a, b) in enumerate(self.stages):
            if stage:
                self.edges.fill_scalar(now, rule)
            self._k[:3] = a, b, b * dt / (2 * self.grid.h)
            out = self._copies[stage % 2]
            self._stage(out, q, now, *u, start, n, self._strides, self._k)
            now = out
        np.copyto(self.grid.inside(q), self.grid.inside(now))
        self.edges.fill_scalar(q, rule)
