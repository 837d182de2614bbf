"""Pressure and viscous increments with variable coefficients: multigrid-preconditioned conjugate gradients."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from fsiwork.core.ends import Ends, check_ends, is_singular
from fsiwork.core.kernels.multigrid import DIAGONAL, D, Q, R, conjugate_gradients, merge_along, merge_rows, relaxation

END_FACES = {"neumann": 0.0, "dirichlet": 2.0, "node": 1.0}  # flux out of an end face = this × β q/h
SMALL = 3  # an axis with so few cells is not merged any more
DAMPING = 0.85  # of Jacobi
STRETCH = 0.55  # factor on summed faces between merged cells: 1/2 for the doubled distance, a little more measured best


class NotConverged(RuntimeError):
    """An iterative solver that missed its tolerance; the text names the residual and the iterations."""


class Level:
    """Where one grid of the hierarchy lies in the flat buffers."""

    def __init__(self, n: tuple[int, ...], offset: int):
        self.n = n
        self.shape = tuple(k + 2 for k in n)
        self.offset = offset
        self.size = int(np.prod(self.shape))
        self.strides = tuple(int(np.prod(self.shape[a + 1 :])) for a in range(len(n)))
        self.rows = int(np.prod(n[:-1]))

    def start(self, index: Sequence[np.ndarray]) -> np.ndarray:
        """Places in the buffer of the cells with these indices along all axes but the last."""
        place = self.offset + 1
        for i, stride in zip(index, self.strides, strict=False):
            place = place + (i + 1) * stride
        return place

    def padded(self, field: np.ndarray) -> np.ndarray:
        """View of this level of a flat buffer, with its ghosts."""
        return field[self.offset : self.offset + self.size].reshape(self.shape)

    def faces(self, c: np.ndarray, a: int) -> np.ndarray:
        """View of all faces of direction ``a`` of this level, n_a + 1 along a."""
        inside = tuple(slice(1, k + 1 + (b == a)) for b, k in enumerate(self.n))
        return self.padded(c[len(self.n) - 1 - a])[inside]

    def cells(self, field: np.ndarray) -> np.ndarray:
        """View without ghosts."""
        return self.padded(field)[(slice(1, -1),) * len(self.n)]

    def ghosts(self, periodic: Sequence[bool]) -> np.ndarray:
        """(place, where its value is found) of every ghost cell across a periodic side, shape (pairs, 2)."""
        place = self.padded(np.arange(self.offset + self.size))
        pairs = [np.zeros((0, 2), np.int64)]
        for a in (a for a, is_periodic in enumerate(periodic) if is_periodic):
            line = np.moveaxis(place, a, 0)[(slice(None), *(slice(1, -1),) * (len(self.n) - 1))]
            pairs += [np.stack([line[g].ravel(), line[v].ravel()], axis=1) for g, v in ((0, -2), (-1, 1))]
        return np.concatenate(pairs)


def merged(k: int) -> int:
    """Cells left of ``k`` after merging pairs; an odd one stays alone."""
    return (k + 1) // 2 if k > SMALL else k


class Variable:
    """d q − div(β grad q) = f at cell centres with second-order face fluxes, by conjugate gradients and a V(1,1) cycle.

    Cells are merged in pairs (an odd last one stays alone, so any ``n`` works), the coefficients of faces between
    merged cells and the d of merged cells are summed, corrections carried back piecewise constant: robust to jumps of
    d and β by 1000 and more. "Cells" are any unknowns on a uniform grid, such as one component's faces.

    Parameters
    ----------
    n : cells along each axis (two or three axes)
    h : grid step [length]
    ends : as in `fsiwork.core.poisson.Direct`, of "periodic", "neumann", "dirichlet" and "node"
    rtol : tolerance of |f − A q| / |f| (2-norm)
    most : iterations after which it gives up
    diagonal : whether there is a d (with one, nothing is singular)
    name : of what is solved for, in the text of `NotConverged`

    Raises ValueError for ends or a number of axes it has no stencil for. ``iterations`` and ``residual`` (relative)
    tell about the last solve. Everything is float64.
    """

    def __init__(
        self,
        n: Sequence[int],
        h: float,
        ends: Ends,
        rtol: float = 1e-10,
        most: int = 200,
        diagonal: bool = False,
        name: str = "pressure",
    ):
        self.n = tuple(int(k) for k in n)
        if len(self.n) not in (2, 3):
            raise ValueError(f"two or three axes are needed, got {len(self.n)}")
        self.h = float(h)
        self.ends = check_ends(self.n, ends)
        if any("node-neumann" in pair for pair in self.ends):
            raise ValueError(f"a variable coefficient has no stencil for node-neumann ends, got {self.ends}")
        self.rtol, self.most, self.diagonal, self.name = float(rtol), int(most), bool(diagonal), name
        self.iterations, self.residual = 0, 0.0
        self._periodic = [pair[0] == "periodic" for pair in self.ends]
        self._singular = is_singular(self.ends) and not self.diagonal
        self._plan()

    def _plan(self) -> None:
        """The hierarchy and its buffers."""
        levels = [Level(self.n, 0)]
        while max(levels[-1].n) > SMALL:
            levels.append(Level(tuple(merged(k) for k in levels[-1].n), levels[-1].offset + levels[-1].size))
        size = levels[-1].offset + levels[-1].size
        self._grids = levels
        self._fields, self._c = np.zeros((7, size)), np.zeros((3 + self.diagonal, size))
        table, starts, children, pairs = [], [], [], []
        self._face_rows = [[] for _ in levels]  # of each slow direction: where they start, and what they are made of
        first = known = 0
        for k, level in enumerate(levels):
            index = np.indices(level.n[:-1]).reshape(len(self.n) - 1, -1)
            starts.append(level.start(index))
            children.append(self._children(levels[k - 1], level, index) if k else np.full((level.rows, 4), -1))
            for a in range(len(self.n) - 1) if k else ():
                faces = np.indices([m + (b == a) for b, m in enumerate(level.n[:-1])]).reshape(len(self.n) - 1, -1)
                self._face_rows[k].append((level.start(faces), self._children(levels[k - 1], level, faces, a)))
            pairs.append(level.ghosts(self._periodic))
            t = level.strides[0] if len(self.n) == 3 else 0
            table.append((first, level.rows, level.n[-1], level.strides[-2], t, known, len(pairs[-1])))
            first, known = first + level.rows, known + len(pairs[-1])
        self._levels = np.array(table)
        self._starts, self._table, self._pairs = (np.concatenate(x) for x in (starts, children, pairs))
        self._parts = np.zeros(levels[0].rows)
        self._q = np.zeros(self.n)

    @staticmethod
    def _children(fine: Level, coarse: Level, index: np.ndarray, face: int | None = None) -> np.ndarray:
        """Starts of the fine rows that make each coarse row, −1 where there is none; shape (rows, 4).

        With ``face``, rows of faces of that direction: the fine ones that lie on the coarse ones.
        """
        found = np.full((index.shape[1], 4), -1)
        two = [fine.n[a] > coarse.n[a] for a in range(len(index))]
        for k, step in enumerate(product(*((0, 1) if yes and a != face else (0,) for a, yes in enumerate(two)))):
            rows = [i * (1 + yes) + d for i, yes, d in zip(index, two, step, strict=True)]
            if face is not None:
                rows[face] = np.minimum(rows[face], fine.n[face])
            inside = np.all([i < fine.n[a] + (a == face) for a, i in enumerate(rows)], axis=0)
            found[:, k] = np.where(inside, fine.start(rows), -1)
        return found

    def _coefficients(self, beta: Sequence[np.ndarray], diagonal: np.ndarray | None) -> np.ndarray:
        """Faces and d h² of every level, Jacobi factors, and the dense inverse of the coarsest level."""
        finest = self._grids[0]
        if self.diagonal:
            np.multiply(diagonal, self.h**2, out=finest.cells(self._c[DIAGONAL]))
        for a, (low, high) in enumerate(self.ends):
            faces = finest.faces(self._c, a)
            faces[...] = beta[a]
            line = np.moveaxis(faces, a, 0)
            if self._periodic[a]:
                line[-1] = line[0]
            else:
                line[0] *= END_FACES[low]
                line[-1] *= END_FACES[high]
        for k, (first, rows, n, s, t, *_) in enumerate(self._levels):
            if k:
                self._merge(k)
            relaxation(self._fields[D], self._c, self._starts[first : first + rows], n, s, t, DAMPING)
        return self._dense_inverse()

    def _merge(self, k: int) -> None:
        """Coefficients of level k: sums over the fine faces between merged cells, × STRETCH where their distance
        doubled, and over the d of merged cells."""
        fine, coarse = self._grids[k - 1].n, self._grids[k].n
        m, n, here = coarse[-1], fine[-1], slice(self._levels[k, 0], self._levels[k, 0] + self._levels[k, 1])
        factor = [STRETCH if two else 1.0 for two in np.less(coarse, fine)]
        start, children = self._starts[here], self._table[here]
        merge_along(self._c[0], start, children, m, n, factor[-1])
        for a, (faces, parts) in enumerate(self._face_rows[k]):
            merge_rows(self._c[len(self.n) - 1 - a], faces, parts, m, n, factor[a])
        if self.diagonal:
            merge_rows(self._c[DIAGONAL], start, children, m, n, 1.0)

    def _dense_inverse(self) -> np.ndarray:
        level = self._grids[-1]
        number = np.arange(np.prod(level.n)).reshape(level.n)
        matrix = np.zeros((number.size, number.size))
        if self.diagonal:
            matrix += np.diag(level.cells(self._c[DIAGONAL]).ravel())
        for a in range(len(self.n)):
            line, face = np.moveaxis(number, a, 0), np.moveaxis(level.faces(self._c, a), a, 0)
            np.add.at(matrix, (line, line), face[:-1] + face[1:])
            np.add.at(matrix, (line[1:], line[:-1]), -face[1:-1])
            np.add.at(matrix, (line[:-1], line[1:]), -face[1:-1])
            if self._periodic[a]:
                np.add.at(matrix, (line[0], line[-1]), -face[0])
                np.add.at(matrix, (line[-1], line[0]), -face[0])
        if self._singular:  # lift the constant, which the residual does not contain
            matrix += matrix.trace() / number.size**2
        return np.linalg.inv(matrix)

    def solve(
        self,
        beta: Sequence[np.ndarray],
        f: np.ndarray,
        q0: np.ndarray | None = None,
        diagonal: np.ndarray | None = None,
    ) -> np.ndarray:
        """q at cell centres, shape ``n``; the array belongs to the solver and is overwritten by the next solve.

        ``beta``: one array an axis, on all faces of that axis (n_a + 1 along a; both end faces are the same one when
        periodic; faces of Neumann ends are not used), positive. ``f``: shape ``n``. ``q0``: first guess (dropped
        when worse than zero). ``diagonal``: d ≥ 0, not everywhere zero, shape ``n``; given if and only if announced.
        With Neumann and periodic ends only, the mean of f is dropped and q has mean zero.
        Raises ValueError for wrong shapes, `NotConverged` when ``rtol`` is missed after ``most`` iterations.
        """
        wanted = [tuple(k + (a == b) for b, k in enumerate(self.n)) for a in range(len(self.n))]
        if [np.shape(b) for b in beta] != wanted or np.shape(f) != self.n:
            raise ValueError(f"faces {wanted} and cells {self.n} are needed, got {[b.shape for b in beta]}, {f.shape}")
        if (diagonal is not None) != self.diagonal or (self.diagonal and diagonal.shape != self.n):
            raise ValueError(f"a diagonal of shape {self.n} is needed if and only if it was announced")
        inverse = self._coefficients(beta, diagonal)
        q, r = (self._grids[0].cells(self._fields[k]) for k in (Q, R))
        q[...] = 0.0 if q0 is None else q0
        np.multiply(f, self.h**2, out=r)
        if self._singular:
            r -= r.mean()
        axes = "ijk"[: r.ndim]
        size = float(np.sqrt(np.einsum(f"{axes},{axes}->", r, r)))
        self.iterations, left = conjugate_gradients(
            self._fields,
            self._c,
            self._levels,
            self._starts,
            self._table,
            self._pairs,
            inverse,
            self._parts,
            size,
            self.rtol,
            self.most,
        )
        self.residual = left / size if size > 0 else left
        if not left <= self.rtol * size:
            raise NotConverged(
                f"{self.name}: relative residual {self.residual:.1e} after {self.iterations} iterations,"
                f" wanted {self.rtol:.1e}"
            )
        self._q[...] = q
        if self._singular:
            self._q -= self._q.mean()
        return self._q
