"""Observed orders and extrapolated values of a sequence of ever finer runs."""

import numpy as np
from scipy.optimize import brentq


def observed_orders(h, error) -> np.ndarray:
    """Order between neighbours of a refinement: log(e_k/e_k+1)/log(h_k/h_k+1), shape (n - 1,).

    ``h`` are grid (or time) steps, ``error`` positive errors against something known, both shape (n,), n ≥ 2.
    """
    h, error = np.asarray(h, float), np.asarray(error, float)
    return np.diff(np.log(error)) / np.diff(np.log(h))


def slope(h, error) -> float:
    """One order for a whole refinement: least-squares slope of log e over log h; zero or non-finite errors raise."""
    h, error = np.asarray(h, float), np.asarray(error, float)
    if not (np.isfinite(error).all() and (error > 0).all()):
        raise ValueError("errors must be positive and finite to have an order")
    return float(np.polyfit(np.log(h), np.log(error), 1)[0])


def richardson(h, value, order: float | None = None) -> tuple[float, float]:
    """Value at h = 0 and the order, from q(h) = q₀ + C h^p on the three finest grids (two when ``order`` is given).

    Solves for p in [0.1, 12] and raises ValueError when the values do not converge monotonically in that range.
    """
    h, value = np.asarray(h, float), np.asarray(value, float)
    finest = np.argsort(h)[: 3 if order is None else 2]
    h, value = h[finest], value[finest]
    if order is None:
        steps = np.diff(value)

        def mismatch(p):
            return steps[1] / steps[0] - (h[2] ** p - h[1] ** p) / (h[1] ** p - h[0] ** p)

        if steps[0] == 0 or mismatch(0.1) * mismatch(12.0) > 0:
            raise ValueError("the three finest values do not converge monotonically")
        order = brentq(mismatch, 0.1, 12.0)
    constant = (value[1] - value[0]) / (h[1] ** order - h[0] ** order)
    return float(value[0] - constant * h[0] ** order), float(order)
