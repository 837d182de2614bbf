"""Transport of centre fields by a velocity on the faces: ∂t q + u·∇q = 0 (1.2)."""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from fsiwork.core.grid import Grid
from fsiwork.core.kernels import annex, foot
from fsiwork.core.kernels import pieces as some
from fsiwork.core.kernels import transport as kernels
from fsiwork.core.pieces import Pieces

Scheme = Literal[
    "weno5", "weno-z", "upwind5", "upwind1", "centred", "eno2", "eno3",
    "lax-wendroff", "beam-warming", "fromm", "semi-lagrangian",
]  # fmt: skip
ALL_AXES = ("weno5", "weno-z", "upwind5", "upwind1")  # in one pass
SPLIT = ("lax-wendroff", "beam-warming", "fromm")  # the whole step, one axis after the other

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
BACKWARD = 2.0  # the same for semi-Lagrangian transport: feet stay within the ghosts
MOST_SUBSTEPS = 10_000  # beyond this the velocity has diverged: stop chasing it and let the run show it


class Transport:
    """Carries centre fields with the flow; planned once for a grid, a scheme and a Runge-Kutta tableau.

    Parameters
    ----------
    grid : the grid
    edges : fills ghosts with ``fill_scalar(q, rule)``
    scheme : ``weno5`` (Jiang and Shu's weights), ``weno-z`` (fifth order at critical points too), ``upwind5`` (their
        linear limit: for smooth fields such as x - Y), ``upwind1``; the annex's (7.4) ``centred``, ``eno2``, ``eno3``,
        and its one-step schemes ``lax-wendroff``, ``beam-warming``, ``fromm``: these are one-dimensional by nature and
        go along one axis after the other and back (Strang), of second order; ``semi-lagrangian``: q at the foot of the
        characteristic, a tensor cubic and two Runge-Kutta stages back, of third order when dt ~ Δx, with long steps
    tableau : ``ssp-rk3``, ``ssp-rk2`` or ``euler`` (the last sharpens kinks with WENO: for figures only);
        the one-step schemes and the semi-Lagrangian one have a step of their own
    centring : order of the velocity at the centres. 4, (-1, 9, 9, -1)/16, keeps the volume of an oscillating
        drop 3 to 8 times better from 128 cells on; 2 is the adjoint of how a membrane's force goes to the faces, and
        with 4 a membrane makes energy
    dtype : of the fields; float32 is safe at any magnitude of the field because the weights are relative
    band : half-width [cells] of the band around q = 0 that is carried, see `core.pieces`; None: everywhere. Beyond it
        q becomes flat: for a φ that is kept near a distance, not for a map or a membrane's stretch
    from_interface : take u at x - q∇q/|∇q|², the nearest point of the interface: with |∇q| = 1 that is
        ∂t q + u(x - q∇q)·∇q = 0 of 1.5.1, which keeps a distance a distance; so is any other constant |∇q| kept

    Attributes
    ----------
    substeps : number of substeps of the last `advance`

    Raises
    ------
    ValueError : unknown scheme or tableau; a band too narrow; ``from_interface`` with fourth-order centring or with a
        scheme other than the Runge-Kutta ones
    """

    def __init__(
        self,
        grid: Grid,
        edges,
        scheme: Scheme = "weno5",
        tableau: str = "ssp-rk3",
        dtype=np.float64,
        centring: Literal[2, 4] = 2,
        *,
        band: float | None = None,
        from_interface: bool = False,
    ):
        self._check(scheme, tableau, centring, from_interface)
        self.grid, self.edges, self.scheme, self.stages = grid, edges, scheme, TABLEAUX[tableau]
        self.dtype, self.centring = np.dtype(dtype), 2 if scheme == "semi-lagrangian" else centring
        self.weighted = scheme.startswith("weno")
        self.floor = FLOORS.get((scheme, self.dtype.type), 1.0)
        self.substeps = 0
        self._pieces = None if band is None else Pieces(grid, band)
        self._ahead = [grid.field(self.dtype) for _ in grid.axes] if from_interface else []
        self._joined = np.array([from_interface and edges.periodic(a) for a in grid.axes])
        self._plan()

    def advance(self, fields: Sequence[np.ndarray], u: Sequence[np.ndarray], dt: float, rule: str = "linear") -> None:
        """Carry every field over ``dt`` in place; ghosts are filled on entry of each stage and at the end.

        ``fields`` are flat fields at centres of the dtype given; ``u`` the components on their low faces
        [length/time], ghosts filled, constant in time; ``rule`` is handed to ``edges.fill_scalar``. Takes
        as many equal substeps as keep dt Σ|u_i|/Δx at or below `COURANT`, or `BACKWARD`.
        """
        u = self._centred(u)
        rows = self.grid.rows()
        if not self._pieces:
            self._count(u, dt, rows)
        for q in fields:
            self.edges.fill_scalar(q, rule)
            if self._pieces:
                rows = self._near(q)
                self._count(u, dt, rows)
            else:
                self._weights(self._slope(q))
            for turn in range(self.substeps):
                if self._pieces and turn:
                    rows = self._near(q)
                now = self._step(q, u, dt / self.substeps, rule, rows)
                some.copy(q, now, *rows)
                self._fill(q, rule)

    @staticmethod
    def _check(scheme, tableau, centring, from_interface):
        if scheme not in get_args(Scheme):
            raise ValueError(f"transport scheme must be one of {', '.join(get_args(Scheme))}, got {scheme!r}")
        if tableau not in TABLEAUX:
            raise ValueError(f"tableau must be one of {', '.join(TABLEAUX)}, got {tableau!r}")
        if from_interface and (scheme in (*SPLIT, "semi-lagrangian") or centring == 4):
            raise ValueError("from_interface needs a Runge-Kutta scheme and centring 2")

    def _plan(self):
        grid, name = self.grid, self.scheme.replace("-", "_")
        if self.scheme == "semi-lagrangian":
            self._kernel = getattr(foot, f"{name}_{grid.dim}d")
        elif self.scheme in ALL_AXES:
            self._kernel = getattr(kernels, f"{name}_{grid.dim}d")
        else:
            self._kernel = getattr(annex, name)
        self._steepest, self._fastest = (getattr(kernels, f"{verb}_{grid.dim}d") for verb in ("steepest", "fastest"))
        self._strides, self._every, self._box = (np.array(x) for x in (grid.strides[:-1], grid.strides, grid.n))
        self._k = np.empty(5, self.dtype)
        self._top = np.empty(grid.rows()[0].size * (1 if self._pieces is None else grid.n[-1]), self.dtype)
        self._copies = [grid.field(self.dtype) for _ in range(2)]
        self._u: list[np.ndarray] = []

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

    def _count(self, u, dt: float, rows) -> None:
        self._fastest(self._top, *u, *rows, self._strides)
        courant = abs(dt) * float(self._top[: rows[0].size].max(initial=0.0)) / self.grid.h
        limit = BACKWARD if self.scheme == "semi-lagrangian" else COURANT
        # A hair's breadth above: a step chosen as exactly the limit must not fall over it by rounding.
        needed = np.ceil(courant / limit * (1 - 1e-12)) if np.isfinite(courant) else 1
        self.substeps = int(min(max(needed, 1), MOST_SUBSTEPS))

    def _slope(self, q: np.ndarray) -> float:
        """Largest difference of neighbours, for the schemes that ask."""
        if not self.weighted:
            return 0.0
        self._steepest(self._top, q, *self.grid.rows(), self._strides)
        return float(self._top.max())

    def _weights(self, slope: float) -> None:
        """Scale and floor of the smoothness indicators: their ratio is `floor` times the largest squared difference."""
        # The kernel has 12 S. Both by the root of the floor: powers of S then stay in the middle of the range.
        floor = np.sqrt(12 * self.floor)
        scale = slope**2 * floor
        usable = self.weighted and np.finfo(self.dtype).tiny < scale < np.inf
        self._k[3:] = (1 / scale, floor) if usable else 1.0

    def _fill(self, q: np.ndarray, rule: str) -> None:
        if not (self._pieces and self._pieces.inner):
            self.edges.fill_scalar(q, rule)

    def _near(self, q: np.ndarray) -> tuple[np.ndarray, int]:
        """Starts and length of the pieces of the band of ``q``; the copies get what stencils read beside them."""
        self._pieces.find(q)
        self._weights(self._pieces.steepest)
        for copy in self._copies:
            some.copy(copy, q, self._pieces.around, self._pieces.n)
        return self._pieces.start, self._pieces.n

    def _step(self, q: np.ndarray, u, dt: float, rule: str, rows) -> np.ndarray:
        """One substep into a copy, which is returned; ``q`` stays."""
        if self.scheme == "semi-lagrangian":
            self._kernel(self._copies[0], q, *u, *rows, self._every, self._box, dt / self.grid.h)
            return self._copies[0]
        now = q
        if self.scheme in SPLIT:
            halves = [(a, 0.5) for a in self.grid.axes[:-1]]
            for sweep, (a, part) in enumerate((*halves, (self.grid.dim - 1, 1.0), *reversed(halves))):
                if sweep:
                    self._fill(now, rule)
                out = self._copies[sweep % 2]
                self._kernel(out, now, u[a], *rows, self.grid.strides[a], part * dt / (2 * self.grid.h))
                now = out
            return now
        for stage, (a, b) in enumerate(self.stages):
            if stage:
                self._fill(now, rule)
            self._k[:3] = a, b, b * dt / (2 * self.grid.h)
            out = self._copies[stage % 2]
            self._stage(out, q, now, self._ahead_of(u, now, *rows), *rows)
            now = out
        return now

    def _stage(self, out, base, q, u, start, n) -> None:
        if self.scheme in ALL_AXES:
            self._kernel(out, base, q, *u, start, n, self._strides, self._k)
        else:
            self._kernel(out, base, q, tuple(u), start, n, self._every, self._k)

    def _ahead_of(self, u, q, start, n):
        """The velocity at the interface, on the faces that a stage reads; or ``u`` as it is."""
        if not self._ahead:
            return u
        kernel = getattr(foot, f"at_interface_{self.grid.dim}d")
        for a, (out, c) in enumerate(zip(self._ahead, u, strict=True)):
            faces = np.union1d(start, start + self.grid.strides[a])
            last = a == self.grid.dim - 1
            kernel(out, c, q, start if last else faces, n + last, self._every, a, self._box, self._joined)
        return self._ahead
