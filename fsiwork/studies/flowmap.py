"""The flow and the discrete operators of the checks of chapter 2.

The flow is compressible, changes in time and keeps the unit square or cube. Points ``x`` are arrays (d, ...): the first
axis is the component; matrices are (d, d, ...).
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates

TIME = 0.5


def component(x, t: float, a: int) -> np.ndarray:
    """Component ``a`` of u at d broadcastable coordinates; no flow through the sides of the box."""
    swing, near = 0.5 + 0.25 * np.sin(3 * t), x[(a + 1) % len(x)]
    return swing * np.sin(np.pi * x[a]) * (0.4 + 0.6 * np.cos(np.pi * near + a))


def velocity(x: np.ndarray, t: float) -> np.ndarray:
    """u at points, shape of ``x``."""
    return np.stack([component(x, t, a) for a in range(len(x))])


def scalar(x: np.ndarray, t: float) -> np.ndarray:
    """f, the integrand."""
    return np.cos(2 * x[0] + t) + x[1] ** 2 * (1 + t) + (np.sin(x[2]) if len(x) == 3 else 0.0)


def potential(x: np.ndarray, t: float) -> np.ndarray:
    """∫f dx₀: the flux of (potential, 0, 0) through a closed surface is ∫f over what it encloses."""
    rest = x[1] ** 2 * (1 + t) + (np.sin(x[2]) if len(x) == 3 else 0.0)
    return 0.5 * np.sin(2 * x[0] + t) + x[0] * rest


def stress(x: np.ndarray, t: float) -> np.ndarray:
    """σ, shape (d, d, ...), symmetric."""
    d = len(x)
    total = sum(x)
    return np.array([[np.sin(total + a + b) + (a == b) * x[a] * np.cos(t) for b in range(d)] for a in range(d)])


def density(x: np.ndarray) -> np.ndarray:
    """ρ₀."""
    return 1 + 0.3 * np.cos(np.pi * x[0]) * np.cos(np.pi * x[1])


def carried(x: np.ndarray, begin: float, end: float, steps: int) -> np.ndarray:
    """X(end; x, begin), shape of ``x`` (d, ...); backwards in time when ``end`` is earlier."""
    dt = (end - begin) / steps
    for k in range(steps):
        t = begin + k * dt
        a = velocity(x, t)
        b = velocity(x + 0.5 * dt * a, t + 0.5 * dt)
        c = velocity(x + 0.5 * dt * b, t + 0.5 * dt)
        x = x + dt / 6 * (a + 2 * (b + c) + velocity(x + dt * c, t + dt))
    return x


def centres(d: int, cells: int, ghosts: int = 0) -> np.ndarray:
    """Centres of the cells of the unit box, shape (d, cells + 2 ghosts, ...)."""
    line = (np.arange(-ghosts, cells + ghosts) + 0.5) / cells
    return np.stack(np.meshgrid(*[line] * d, indexing="ij"))


def gradient(q: np.ndarray, d: int, h: float) -> np.ndarray:
    """∂_j of q, shape (..., j, points) from (..., points): central differences, one point less on every side."""
    inner = (slice(1, -1),) * d
    shifts = [(np.roll(q, -1, j - d) - np.roll(q, 1, j - d))[(..., *inner)] / (2 * h) for j in range(d)]
    return np.stack(shifts, axis=q.ndim - d)


def slopes(function: Callable, x: np.ndarray, h: float) -> np.ndarray:
    """∂_j of a function of x at points (d, ...), shape (..., j, points): central differences over 2h."""
    axes = [np.reshape(e, (-1,) + (1,) * (x.ndim - 1)) for e in h * np.eye(len(x))]
    found = [(function(x + e) - function(x - e)) / (2 * h) for e in axes]
    return np.stack(found, axis=found[0].ndim - (x.ndim - 1))


def cofactor(matrix: np.ndarray) -> np.ndarray:
    """Cof F of matrices (d, d, ...)."""
    if len(matrix) == 2:
        return np.array([[matrix[1, 1], -matrix[1, 0]], [-matrix[0, 1], matrix[0, 0]]])
    rows = [np.cross(matrix[(i + 1) % 3], matrix[(i + 2) % 3], axis=0) for i in range(3)]
    return np.stack(rows)


def determinant(matrix: np.ndarray) -> np.ndarray:
    """det F of matrices (d, d, ...)."""
    return (matrix[0] * cofactor(matrix)[0]).sum(0)


def times(matrix: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Product of matrices (d, d, ...) with matrices or vectors (d, ...)."""
    return np.einsum("ij...,j...->i...", matrix, other)


def interpolated(field: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Cell-centred ``field`` (..., cells^d) of the unit box at points (d, ...) well inside, by cubic splines."""
    d, shape = len(x), field.shape[: field.ndim - len(x)]
    place = x * field.shape[-1] - 0.5
    flat = field.reshape(-1, *field.shape[field.ndim - d :])
    return np.stack([map_coordinates(q, place, order=3, mode="mirror") for q in flat]).reshape(*shape, *x.shape[1:])


def norm(vectors: np.ndarray) -> np.ndarray:
    """|v| of vectors (d, ...)."""
    return np.sqrt((vectors * vectors).sum(0))


class Patch(NamedTuple):
    """A mesh of a curve or a surface: ``corner`` (d, n + 1[, n + 1]), ``middle`` (d, n[, n]) of its pieces.

    ``normal``: a line in the plane is a surface, its element normal to it, or else a curve, its element along it.
    """

    corner: np.ndarray
    middle: np.ndarray
    normal: bool

    def carried(self, begin: float, end: float, steps: int) -> "Patch":
        """The mesh with every point taken along by the flow."""
        return Patch(carried(self.corner, begin, end, steps), carried(self.middle, begin, end, steps), self.normal)

    def element(self) -> np.ndarray:
        """Normal times area of each piece (half the product of its diagonals), or its chord, shape (d, n[, n])."""
        if self.corner.ndim == 2:
            chord = np.diff(self.corner, axis=1)
            return np.stack([chord[1], -chord[0]]) if self.normal else chord
        c = self.corner
        return 0.5 * np.cross(c[:, 1:, 1:] - c[:, :-1, :-1], c[:, :-1, 1:] - c[:, 1:, :-1], axis=0)


def _patch(function: Callable, dimension: int, count: int, normal: bool) -> Patch:
    """Of a map of [0, 1]^dimension into space, ``count`` pieces along each axis."""
    lines = np.arange(count + 1) / count, (np.arange(count) + 0.5) / count
    corner, middle = (np.stack(function(*np.meshgrid(*[line] * dimension, indexing="ij"))) for line in lines)
    return Patch(corner, middle, normal)


def surface(d: int, cells: int) -> Patch:
    """A wavy piece of surface (in the plane: of a line, with normals) within the middle of the box."""
    if d == 2:
        return _patch(lambda a: (0.3 + 0.4 * a, 0.5 + 0.1 * np.sin(3 * a)), 1, cells // 2, True)
    wave = lambda a, b: (0.3 + 0.4 * a, 0.3 + 0.4 * b, 0.5 + 0.1 * np.sin(3 * a) * np.cos(2 * b))  # noqa: E731
    return _patch(wave, 2, cells // 2, True)


def curve(d: int, cells: int) -> Patch:
    """A bent piece of curve within the middle of the box."""
    bent = lambda a: (0.3 + 0.4 * a, 0.5 + 0.15 * np.sin(4 * a), 0.4 + 0.2 * a * a)[:d]  # noqa: E731
    return _patch(bent, 1, cells // 2, False)


def sides(d: int, cells: int) -> Iterator[tuple[Patch, float]]:
    """The sides of the box from 1/4 to 3/4 along every axis, with the sign that turns their normals outwards."""
    for a in range(d):
        for high in (0, 1):

            def place(*q, a=a, high=high):
                others = iter(q)
                return [0.25 + 0.5 * (np.full_like(q[0], high) if b == a else next(others)) for b in range(d)]

            patch = _patch(place, d - 1, cells // 2, True)
            sign = 1.0 if patch.element()[a].sum() > 0 else -1.0
            yield patch, sign if high else -sign


def conserved(rho: np.ndarray, time: float, steps: int) -> np.ndarray:
    """∂ₜρ + div(ρu) = 0 from 0 to ``time`` on the unit box: fluxes of the mean of two cells, Runge–Kutta of order 4."""
    d, h, dt = rho.ndim, 1 / rho.shape[0], time / steps
    lines = [(np.arange(n) + 0.5) * h for n in rho.shape]

    def rate(q, t):
        out = np.zeros_like(q)
        for a in range(d):
            faces = [
                np.arange(1, n) * h if b == a else line for b, (n, line) in enumerate(zip(q.shape, lines, strict=True))
            ]
            low, high = ((slice(None),) * a + (s,) for s in (slice(0, -1), slice(1, None)))
            u = component(np.meshgrid(*faces, indexing="ij", sparse=True), t, a)
            flux = 0.5 * (q[low] + q[high]) * u / h
            out[low] -= flux
            out[high] += flux
        return out

    for k in range(steps):
        t = k * dt
        one = rate(rho, t)
        two = rate(rho + 0.5 * dt * one, t + 0.5 * dt)
        three = rate(rho + 0.5 * dt * two, t + 0.5 * dt)
        rho = rho + dt / 6 * (one + 2 * (two + three) + rate(rho + dt * three, t + dt))
    return rho


def largest(residual: np.ndarray, scale: np.ndarray) -> float:
    """Largest |residual| in parts of the largest |scale|."""
    return float(np.abs(residual).max() / np.abs(scale).max())


def shift(left: float, right: float) -> float:
    """|left - right| in parts of the left side."""
    return abs(left - right) / abs(left)
