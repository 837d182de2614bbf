"""What one run of a study tells over time: whether it was stable, where it swings, where it comes to rest."""

import json
import math
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.studies.stability import releasable
from fsiwork.studies.sweep import curve


def history(data: xr.Dataset, gauge: str, **point: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a gauge at a point of a study, as far as it was finite: two arrays of shape (rows,)."""
    t, q = curve(data, gauge, **point)
    there = np.isfinite(q)
    return t[there], q[there]


def complete(data: xr.Dataset, **point: Any) -> bool:
    """Whether the run at a point came to its end."""
    return str(data["ended"].sel(point).item()) == "complete"


def spec(data: xr.Dataset, **point: Any) -> dict[str, Any]:
    """The scene of the run at a point, as plain data."""
    return json.loads(str(data["scene"].sel(point).item()))


def unstable_from(data: xr.Dataset, **point: Any) -> float:
    """First time at which a run with one body was unstable; infinite for a run that never was.

    Unstable (MEASURED-coupling 1): kinetic energy above 1.1 times the elastic energy that can be released, interface
    longer than 1.01 times at first, not finite, or ended as diverged. The whole run counts.
    """
    from fsiwork import scene

    most = 1.1 * releasable(scene.Scene.model_validate(spec(data, **point)))
    t, kinetic = curve(data, "kinetic_energy", **point)
    length = curve(data, "length", **point)[1]
    with np.errstate(invalid="ignore"):
        good = (kinetic <= most) & (length <= 1.01 * length[0])  # false for NaN
    if good.all():
        return math.inf if complete(data, **point) else float(t[-1])
    return float(t[~good][0])


def first_minimum(t: np.ndarray, q: np.ndarray, around: float = 0.2) -> tuple[float, float]:
    """Time and value of the first minimum of q(t), by a parabola through the lowest three rows.

    It is the first inner row that no row within ± ``around`` of time undercuts. (nan, nan) when there is none.
    """
    for i in range(1, t.size - 1):
        if q[i] <= q[np.abs(t - t[i]) <= around].min() and t[i] + around <= t[-1]:
            fit = np.polyfit(t[i - 1 : i + 2] - t[i], q[i - 1 : i + 2], 2)
            if not fit[0] > 0.0:
                return float(t[i]), float(q[i])
            shift = -0.5 * fit[1] / fit[0]
            return float(t[i] + shift), float(np.polyval(fit, shift))
    return math.nan, math.nan


def late_mean(t: np.ndarray, q: np.ndarray, span: float = 0.5) -> float:
    """Mean of q over the last ``span`` of time."""
    return float(q[t >= t[-1] - span].mean())


def swing(data: xr.Dataset, gauge: str = "axis_x", **point: Any) -> tuple[float, float, float]:
    """First value of a gauge, and time and value of its first minimum; NaN where the run did not get there."""
    t, q = history(data, gauge, **point)
    return (float(q[0]), *first_minimum(t, q)) if t.size > 2 else (math.nan,) * 3
