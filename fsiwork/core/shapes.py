"""Signed distances of shapes: negative inside. ``distance(*x)`` takes one coordinate array a direction.

The arrays need only broadcast against each other (an open mesh will do); lengths in any one unit. Distances
are exact unless a docstring says *bound*: then the sign is exact and the magnitude never too large.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

Vector = tuple[float, ...]


class Shape(Protocol):
    """What all shapes can do."""

    def distance(self, *x: np.ndarray) -> np.ndarray:
        """Signed distance of points [length]; raises ValueError when the number of directions does not fit."""
        ...


def _from(centre: Vector, x: tuple[np.ndarray, ...]) -> list[np.ndarray]:
    return [c - o for c, o in zip(x, centre, strict=True)]


def _norm(x) -> np.ndarray:
    return np.sqrt(sum(c * c for c in x))


@dataclass(frozen=True)
class Ball:
    """A disc or a ball."""

    centre: Vector
    radius: float

    def distance(self, *x):
        """See `Shape.distance`."""
        return _norm(_from(self.centre, x)) - self.radius


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipse or an ellipsoid along the axes, by the root of its secular equation.

    The nearest point has the coordinates a²y/(a² + t). With s = t + min a² and p = a y/(a² + t), Newton's
    method for 1/|p| = 1 starts left of the root; the function is concave and almost straight, so that it
    climbs to the root without overshoot.
    """

    centre: Vector
    semi_axes: Vector

    def distance(self, *x):
        """See `Shape.distance`."""
        least = min(self.semi_axes)
        # On a plane of symmetry the root may be double: keep clear of it by less than round-off.
        y = np.broadcast_arrays(*(np.abs(c) for c in _from(self.centre, x)))
        y = [np.maximum(c, 1e-20 * a) for c, a in zip(y, self.semi_axes, strict=True)]
        extra = [(a - least) * (a + least) for a in self.semi_axes]
        s = np.maximum.reduce([a * c - d for a, c, d in zip(self.semi_axes, y, extra, strict=True)])
        for _ in range(60):
            p = [a * c / (s + d) for a, c, d in zip(self.semi_axes, y, extra, strict=True)]
            square = sum(q * q for q in p)
            step = (np.sqrt(square) - 1) * square / sum(q * q / (s + d) for q, d in zip(p, extra, strict=True))
            s = s + np.maximum(step, 0)
            if np.all(step <= 1e-15 * s):
                break
        return (s - least**2) * _norm([c / (s + d) for c, d in zip(y, extra, strict=True)])


@dataclass(frozen=True)
class Box:
    """A rectangle or a box along the axes with full side ``lengths``."""

    centre: Vector
    lengths: Vector

    def distance(self, *x):
        """See `Shape.distance`."""
        d = [np.abs(c) - length / 2 for c, length in zip(_from(self.centre, x), self.lengths, strict=True)]
        d = np.broadcast_arrays(*d)
        return _norm([np.maximum(c, 0) for c in d]) + np.minimum(np.maximum.reduce(d), 0)


@dataclass(frozen=True)
class Polygon:
    """A simple polygon in two dimensions, its corners in order, either way round."""

    points: tuple[tuple[float, float], ...]

    def distance(self, x, y):
        """See `Shape.distance`. One pass over the points for each side of the polygon."""
        square, inside = np.inf, False
        for (ax, ay), (bx, by) in zip(self.points, self.points[1:] + self.points[:1], strict=True):
            square = np.minimum(square, _to_segment((ax, ay), (bx, by), (x, y)))
            if ay != by:  # does the ray to the right of the point cross this side?
                spans = (ay <= y) != (by <= y)
                inside = inside ^ (spans & (x < ax + (y - ay) * ((bx - ax) / (by - ay))))
        return np.where(inside, -1.0, 1.0) * np.sqrt(square)


def _to_segment(start: Vector, end: Vector, x) -> np.ndarray:
    """Square of the distance to a segment."""
    along = [b - a for a, b in zip(start, end, strict=True)]
    rel = _from(start, x)
    square = sum(c * c for c in along)
    t = np.clip(sum(c * d for c, d in zip(rel, along, strict=True)) / square, 0, 1) if square else 0.0
    return sum((c - t * d) ** 2 for c, d in zip(rel, along, strict=True))


@dataclass(frozen=True)
class Capsule:
    """All points within ``radius`` of the segment from ``start`` to ``end``."""

    start: Vector
    end: Vector
    radius: float

    def distance(self, *x):
        """See `Shape.distance`."""
        return np.sqrt(_to_segment(self.start, self.end, x)) - self.radius


@dataclass(frozen=True)
class Tablet:
    """All points within ``edge`` of the flat disc of ``radius`` across z: a cylinder with a round rim."""

    centre: Vector
    radius: float
    edge: float

    def distance(self, *x):
        """See `Shape.distance`."""
        x, y, z = _from(self.centre, x)
        beyond = _norm([x, y]) - self.radius
        return np.where(beyond > 0, _norm([beyond, z]), np.abs(z)) - self.edge


@dataclass(frozen=True)
class Torus:
    """A ring about the z direction (book, 7.1): ``radius`` to the middle of its tube, ``tube`` of the tube."""

    centre: Vector
    radius: float
    tube: float

    def distance(self, *x):
        """See `Shape.distance`."""
        x, y, z = _from(self.centre, x)
        return _norm([_norm([x, y]) - self.radius, z]) - self.tube


@dataclass(frozen=True)
class Cassini:
    """A Cassini oval |x - f₁||x - f₂| = b², foci at centre ± ``a`` along x; in 3D turned about that axis.

    In polar form r² = a² cos 2θ + √(b⁴ - a⁴ sin² 2θ); the nearest point by Newton's method inside the bracket
    around the nearest of many samples (distance exact to about 1e-12 of the size).
    Raises ValueError unless b > a > 0 (one oval).
    """

    centre: Vector
    a: float
    b: float

    SAMPLES = 4096

    def __post_init__(self):
        if not self.b > self.a > 0:
            raise ValueError(f"one oval needs b > a > 0, got a = {self.a}, b = {self.b}")

    def distance(self, *x):
        """See `Shape.distance`."""
        x, *rest = _from(self.centre, x)
        x, y = np.broadcast_arrays(np.abs(x), np.abs(rest[0]) if len(rest) == 1 else _norm(rest))
        outside = _norm([x - self.a, y]) * _norm([x + self.a, y]) - self.b**2
        theta = np.linspace(0, np.pi / 2, self.SAMPLES)
        tree = cKDTree(np.stack(self._curve(theta)[0], axis=-1))
        nearest = tree.query(np.stack([x, y], axis=-1))[1]
        spacing = theta[1]
        t, low, high = theta[nearest], theta[nearest] - spacing, theta[nearest] + spacing
        for _ in range(10):
            (px, py), (dx, dy), (ex, ey) = self._curve(t)
            f = (px - x) * dx + (py - y) * dy
            slope = dx * dx + dy * dy + (px - x) * ex + (py - y) * ey
            low, high = np.where(f < 0, t, low), np.where(f < 0, high, t)
            new = t - f / np.where(slope > 0, slope, np.inf)
            t = np.where((slope > 0) & (low <= new) & (new <= high), new, (low + high) / 2)
        px, py = self._curve(t)[0]
        return np.copysign(np.hypot(px - x, py - y), outside)

    def _curve(self, t):
        """Point of the oval at the angle t, and its first and second derivatives."""
        a2, c, s = self.a**2, np.cos(2 * t), np.sin(2 * t)
        q = np.sqrt(self.b**4 - (a2 * s) ** 2)
        r = np.sqrt(a2 * c + q)
        r1 = -a2 * s * r / q
        r2 = -a2 * (2 * c * r + s * r1 + 2 * (a2 * s / q) ** 2 * c * r) / q
        x, y = np.cos(t), np.sin(t)
        return (r * x, r * y), (r1 * x - r * y, r1 * y + r * x), ((r2 - r) * x - 2 * r1 * y, (r2 - r) * y + 2 * r1 * x)


@dataclass(frozen=True)
class Slot:
    """Zalesak's disc: a slot ``width`` wide cut ``depth`` deep into a disc from below (-y).

    Exact in two dimensions; in three, a ball with a slot along z, a bound.
    Raises ValueError unless the slot's upper corners lie in the disc.
    """

    centre: Vector
    radius: float
    width: float
    depth: float

    def __post_init__(self):
        if not np.hypot(self.width / 2, self.depth - self.radius) < self.radius:
            raise ValueError(f"the slot's corners must lie in the disc, got {self}")

    def distance(self, *x):
        """See `Shape.distance`."""
        x, y, *rest = _from(self.centre, x)
        side, top = self.width / 2, self.depth - self.radius
        x = np.abs(x)
        disc = _norm([x, y, *rest]) - self.radius
        gap = _norm([np.maximum(x - side, 0), np.maximum(y - top, 0)]) + np.minimum(np.maximum(x - side, y - top), 0)
        bound = np.maximum(disc, -gap)
        if rest:
            return bound
        corner = (side, -np.sqrt(self.radius**2 - side**2))
        wall = np.minimum(_to_segment(corner, (side, top), (x, y)), _to_segment((-side, top), (side, top), (x, y)))
        # Below the mouth the rim has no foot point: the corner, an end of the wall, is nearest.
        mouth = (y < 0) & (x * self.radius < side * (disc + self.radius))
        return np.copysign(np.sqrt(np.where(mouth, wall, np.minimum(wall, disc * disc))), bound)


@dataclass(frozen=True)
class Union:
    """What lies in any of the ``parts``: exact outside, a bound inside where parts overlap."""

    parts: tuple[Shape, ...]

    def distance(self, *x):
        """See `Shape.distance`."""
        return np.minimum.reduce(np.broadcast_arrays(*(part.distance(*x) for part in self.parts)))


@dataclass(frozen=True)
class Intersection:
    """What lies in all of the ``parts``: exact inside, a bound outside (near the edges where parts meet)."""

    parts: tuple[Shape, ...]

    def distance(self, *x):
        """See `Shape.distance`."""
        return np.maximum.reduce(np.broadcast_arrays(*(part.distance(*x) for part in self.parts)))


@dataclass(frozen=True)
class Minus:
    """What lies in ``shape`` and not in ``cut``: exact inside, a bound outside (in the cut and near its edges)."""

    shape: Shape
    cut: Shape

    def distance(self, *x):
        """See `Shape.distance`."""
        return np.maximum(self.shape.distance(*x), -self.cut.distance(*x))


@dataclass(frozen=True)
class Moved:
    """``shape`` turned about the origin by ``angle`` [rad], in 3D about ``axis`` (Rodrigues), then shifted."""

    shape: Shape
    shift: Vector
    angle: float = 0.0
    axis: Vector = (0.0, 0.0, 1.0)

    def distance(self, *x):
        """See `Shape.distance`."""
        back = self.rotation(len(x)).T
        rel = _from(self.shift, x)
        return self.shape.distance(*(sum(m * c for m, c in zip(row, rel, strict=True)) for row in back))

    def rotation(self, dim: int) -> np.ndarray:
        """The matrix of the turn, shape ``(dim, dim)``."""
        k = np.array(self.axis if dim == 3 else (0.0, 0.0, 1.0))
        k = k / np.linalg.norm(k)
        cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
        turn = np.eye(3) + np.sin(self.angle) * cross + (1 - np.cos(self.angle)) * cross @ cross
        return turn[:dim, :dim]
