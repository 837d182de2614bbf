"""Lagrangian markers (1.1): a closed line in the plane carried by a velocity, its stretching, splits and joins.

A velocity is a function (x, t) -> u of positions, both shape (2, m), its gradient (x, t) -> ∂_j u_i, shape (2, 2, m).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

Velocity = Callable[[np.ndarray, float], np.ndarray]
FEWEST = 8  # markers that one local interpolant reads
MOST = 1_000_000  # beyond this a line is not resolved but torn, as by tangents that do not belong to it
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True)
class Line:
    """A closed line γ(θ) given at markers, in the order of the parameter; the last is joined to the first.

    theta : parameters of the markers, shape (m,), increasing within one ``period``
    x : positions γ [length], shape (2, m)
    slope : tangents ∂γ/∂θ, shape (2, m), carried with the markers; None: taken from the positions when asked for

    Between two markers γ is a polynomial of degree 7: through four markers and their tangents, or through eight.
    Raises ValueError for fewer than eight markers or parameters out of order.
    """

    theta: np.ndarray
    x: np.ndarray
    slope: np.ndarray | None = None
    period: float = 1.0

    def __post_init__(self):
        if self.theta.size < FEWEST:
            raise ValueError(f"a closed line needs at least {FEWEST} markers, got {self.theta.size}")
        if not (np.diff(self.theta, append=self.theta[0] + self.period) > 0).all():
            raise ValueError("the parameters of the markers must increase within one period")

    def at(self, fraction: np.ndarray | float, segments: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """γ and ∂γ/∂θ, shape (2, k), a ``fraction`` in [0, 1] of the way along ``segments`` (marker i to i + 1; all).

        Error of γ: eighth order in the distance of the markers, of ∂γ/∂θ seventh.
        """
        start = np.arange(self.theta.size) if segments is None else np.asarray(segments)
        reach = FEWEST // 2 if self.slope is None else FEWEST // 4
        index = start + np.arange(1 - reach, 1 + reach)[:, None]
        lap, index = np.divmod(index, self.theta.size)
        nodes, values = self.theta[index] + lap * self.period, self.x[:, index]
        width = nodes[reach] - nodes[reach - 1]
        origin = nodes[reach - 1]
        if self.slope is None:
            return _newton((nodes - origin) / width, values, None, fraction, width)
        return _newton((nodes - origin) / width, values, self.slope[:, index] * width, fraction, width)

    def tangent(self) -> np.ndarray:
        """∂γ/∂θ at the markers [length], shape (2, m)."""
        return self.at(0.0)[1] if self.slope is None else self.slope

    def chords(self) -> np.ndarray:
        """Straight distances from each marker to the next [length], shape (m,)."""
        return np.hypot(*(np.roll(self.x, -1, axis=1) - self.x))

    def length_and_area(self) -> tuple[float, float]:
        """∮|∂γ/∂θ|dθ [length] and ½∮γ × ∂γ/∂θ dθ [length²] (positive anticlockwise), five Gauss points a segment."""
        width = np.diff(self.theta, append=self.theta[0] + self.period)
        length = area = 0.0
        for point, weight in zip(0.5 + 0.5 * _GAUSS, 0.5 * _WEIGHTS, strict=True):
            x, slope = self.at(point)
            length += weight * float((np.hypot(*slope) * width).sum())
            area += 0.5 * weight * float(((x[0] * slope[1] - x[1] * slope[0]) * width).sum())
        return length, area

    def turns(self) -> np.ndarray:
        """Angle between the tangents at each marker and the next [rad], from 0 to π, shape (m,)."""
        angle = np.arctan2(*self.tangent()[::-1])
        return np.abs((np.diff(angle, append=angle[0]) + np.pi) % (2 * np.pi) - np.pi)

    def split(self, longest: float, sharpest: float = np.inf) -> "Line":
        """A marker more in the middle (of θ) of segments longer than ``longest`` [length] or turning by more than
        ``sharpest`` [rad], until there is none; at a kink segments are no longer cut below a thousandth of ``longest``.

        Raises ValueError when ``longest`` or ``sharpest`` is not positive, when a marker is not finite, or beyond a
        million markers.
        """
        if not (longest > 0 and sharpest > 0):
            raise ValueError(f"the longest segment and the sharpest turn must be positive, got {longest}, {sharpest}")
        line = self
        while (cut := np.flatnonzero(line._too_coarse(longest, sharpest))).size:
            if line.theta.size + cut.size > MOST:
                raise ValueError(f"more than {MOST} markers: does the gradient belong to the velocity?")
            x, slope = line.at(0.5, cut)
            after = np.append(line.theta[1:], line.theta[0] + self.period)
            line = replace(
                line,
                theta=np.insert(line.theta, cut + 1, 0.5 * (line.theta + after)[cut]),
                x=np.insert(line.x, cut + 1, x, axis=1),
                slope=None if line.slope is None else np.insert(line.slope, cut + 1, slope, axis=1),
            )
        return line

    def join(self, shortest: float, sharpest: float = np.inf) -> "Line":
        """Without every other marker, as long as its two segments together are shorter than ``shortest`` [length] and
        turn by less than ``sharpest`` [rad].

        Keeps the first marker and eight at least. Half of what splits, or less, never undoes a split.
        """
        size, chords = self.theta.size, self._finite_chords()
        drop = (np.arange(size) % 2 == 1) & (chords + np.roll(chords, 1) < shortest)
        if np.isfinite(sharpest):
            turns = self.turns()
            drop &= turns + np.roll(turns, 1) < sharpest
        keep = ~drop | (np.cumsum(drop) > size - FEWEST)
        slope = None if self.slope is None else self.slope[:, keep]
        return replace(self, theta=self.theta[keep], x=self.x[:, keep], slope=slope)

    def _too_coarse(self, longest: float, sharpest: float) -> np.ndarray:
        chords = self._finite_chords()
        long = chords > longest
        return long | ((self.turns() > sharpest) & (chords > 1e-3 * longest)) if np.isfinite(sharpest) else long

    def _finite_chords(self) -> np.ndarray:
        chords = self.chords()
        if not np.isfinite(chords).all():
            raise ValueError(f"{np.count_nonzero(~np.isfinite(chords))} segments of the line are not finite")
        return chords


def circle(centre: tuple[float, float], radius: float, count: int, slopes: bool = True) -> Line:
    """A circle with ``count`` equidistant markers, anticlockwise; θ is the angle over 2π."""
    theta = np.arange(count) / count
    away = radius * np.stack([np.cos(2 * np.pi * theta), np.sin(2 * np.pi * theta)])
    x = np.reshape(centre, (2, 1)) + away
    return Line(theta, x, 2 * np.pi * np.stack([-away[1], away[0]]) if slopes else None)


def carry(line: Line, velocity: Velocity, t: float, dt: float, gradient: Velocity | None = None) -> Line:
    """The line after one step of the classical Runge–Kutta method of order 4 of ∂ₜX = u(X, t), equation (1.1).

    With ``gradient`` and slopes the tangents go along, ∂ₜ(∂X/∂θ) = ∇u ∂X/∂θ. Raises ValueError when the line has
    slopes and there is no gradient.
    """
    if line.slope is not None and gradient is None:
        raise ValueError("tangents are carried by the gradient of the velocity, and none is given")
    carried = line.slope is not None
    y = np.concatenate([line.x, line.slope]) if carried else line.x

    def rate(y: np.ndarray, t: float) -> np.ndarray:
        u = velocity(y[:2], t)
        return np.concatenate([u, np.einsum("ijm,jm->im", gradient(y[:2], t), y[2:])]) if carried else u

    a = rate(y, t)
    b = rate(y + 0.5 * dt * a, t + 0.5 * dt)
    c = rate(y + 0.5 * dt * b, t + 0.5 * dt)
    y = y + dt / 6 * (a + 2 * (b + c) + rate(y + dt * c, t + dt))
    return replace(line, x=y[:2], slope=y[2:] if carried else None)


def _newton(nodes, values, slopes, s, width) -> tuple[np.ndarray, np.ndarray]:
    """Value and derivative at ``s`` of the polynomial through ``values`` (2, n, k) and ``slopes`` at ``nodes`` (n, k).

    Newton's form; with slopes every node counts twice. Nodes, ``s`` and slopes in units of a segment of ``width``.
    """
    if slopes is not None:
        nodes, values = np.repeat(nodes, 2, axis=0), np.repeat(values, 2, axis=1)
    table = values.copy()  # becomes the divided differences, from the back
    for order in range(1, len(nodes)):
        step = nodes[order:] - nodes[:-order]
        rise = table[:, order:] - table[:, order - 1 : -1]
        if order == 1 and slopes is not None:
            step[::2], rise[:, ::2] = 1.0, slopes
        table[:, order:] = rise / step
    value, derivative = table[:, -1], np.zeros_like(table[:, -1])
    for k in range(len(nodes) - 2, -1, -1):
        away = s - nodes[k]
        derivative = derivative * away + value
        value = value * away + table[:, k]
    return value, derivative / width
