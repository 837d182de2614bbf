"""Two parts of an image or a volume in any units, by active contours (1.29), with lengths in cells."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from fsiwork.core.contours import Contours, State, Watch, descend
from fsiwork.core.grid import Grid

SMALLEST = 8  # cells in a direction
STARTS = ("around", "levels")


@dataclass(frozen=True)
class Segmentation:
    """Two parts of an image: φ < 0 ``inside``; levels in the image's units; the energy after each step.

    ``energy`` [level² × cells², of the image scaled to 0 and 1] and ``fresh`` (redistanced; E may have risen) have the
    shape ``(rows,)``; ``ended`` as by `descend`.
    """

    phi: np.ndarray
    outside: float
    inside: float
    energy: np.ndarray
    fresh: np.ndarray
    steps: int
    ended: str


def segment(
    image: np.ndarray,
    smoothing: float = 2.5,
    eps: float = 3.0,
    start: str = "around",
    steps: int = 4000,
    watch: Watch | None = None,
) -> Segmentation:
    """Part an image of two levels by (1.29), which moves contours and makes no new ones.

    Parameters
    ----------
    image : shape (x, y[, z]), at least 8 cells in each direction, finite, any units
    smoothing : radius [cells] below which a disc of full contrast is taken for noise
    eps : half-width of the contour [cells]
    start : ``around``, a contour along the sides (holes stay closed; should it vanish, the other), or ``levels``, where
        the smoothed image is halfway between its two levels

    Raises ValueError, in one line, when nothing can be parted.
    """
    if start not in STARTS:
        raise ValueError(f"start must be one of {', '.join(STARTS)}, got {start!r}")
    q = np.asarray(image, float)
    if q.ndim not in (2, 3) or min(q.shape) < SMALLEST:
        raise ValueError(f"at least {SMALLEST} cells in two or three directions, got {' × '.join(map(str, q.shape))}")
    if wrong := np.count_nonzero(~(np.abs(q) < 1e300)):
        raise ValueError(f"{wrong} values are not finite")
    smooth = gaussian_filter(q, smoothing)
    low, high = two_levels(smooth)
    contours = Contours(Grid(q.shape, 1.0), (q - low) / (high - low), smoothing, eps)
    energy, fresh = [], []

    def keep(step: int, state: State, new: bool) -> None:
        energy.append(state.energy)
        fresh.append(new)
        if watch:
            watch(step, state, new)

    halfway = threshold(smooth, 0.5 * (low + high))
    first = surrounding(q.shape, eps) if start == "around" else halfway
    state, ended = descend(contours, first, steps=steps, watch=keep)
    if ended == "empty" and start == "around":  # both sides had the same level at first, and the length won
        state, ended = descend(contours, halfway, steps=steps, watch=keep)
    levels = (low + (high - low) * c for c in (state.outside, state.inside))
    count = len(fresh) - sum(fresh)
    return Segmentation(state.phi, *levels, np.array(energy), np.array(fresh), count, ended)


def surrounding(n: tuple[int, ...], eps: float = 3.0) -> np.ndarray:
    """Distance [cells] to a box 2ε within the sides (less in small images), negative in it, in the maximum norm."""
    margin = min(2 * eps, min(n) / 4)
    lines = (margin - k / 2 + np.abs(np.arange(k) + 0.5 - k / 2) for k in n)
    return np.maximum.reduce([np.broadcast_to(line, n) for line in np.meshgrid(*lines, indexing="ij", sparse=True)])


def threshold(q: np.ndarray, level: float) -> np.ndarray:
    """A level set of ``q = level``, negative on the side that has less of the sides of the box."""
    rim = np.ones(q.shape, bool)
    rim[(slice(1, -1),) * q.ndim] = False
    return q - level if np.mean(q[rim] > level) > 0.5 else level - q


def two_levels(q: np.ndarray) -> tuple[float, float]:
    """Mean levels below and above the threshold that parts the histogram best (Otsu 1979).

    Raises ValueError when all values are one.
    """
    first, last = float(q.min()), float(q.max())
    if not (last - first > 1e-9 * max(abs(first), abs(last)) and np.isfinite(last - first)):
        raise ValueError(f"all values are {first:.6g}: there is nothing to part")
    count, edges = np.histogram(q, 256)
    below = np.cumsum(count)[:-1]
    mean = np.cumsum(count * 0.5 * (edges[1:] + edges[:-1] - 2 * first))
    between = (mean[-1] * below / q.size - mean[:-1]) ** 2 / (below * (q.size - below))
    high = q >= edges[1 + int(np.argmax(between))]
    return float(q[~high].mean()), float(q[high].mean())
