"""Kernels that fill ghost layers, one line at a time (a line runs along the direction being filled)."""

from numba import prange

from fsiwork.core.kernels import loop


@loop
def reflect(q, line, ghost, mirror, step, count, sign, value):
    """q[ghost_k] = (1 - sign) value + sign q[mirror_k]: odd (sign -1) or even (sign 1) about an edge.

    ``line`` holds flat starts; ghost_k = start + ghost + k step and mirror_k = start + mirror - k step.
    """
    for r in prange(line.size):
        base = (1.0 - sign) * value[r % value.size]
        for k in range(count):
            q[line[r] + ghost + k * step] = base + sign * q[line[r] + mirror - k * step]


@loop
def extrapolate(q, line, edge, step, count):
    """Continue q linearly beyond its last value at start + edge: three ghosts in the direction of ``step``."""
    for r in prange(line.size):
        last = q[line[r] + edge]
        slope = last - q[line[r] + edge - step]
        for k in range(1, count + 1):
            q[line[r] + edge + k * step] = last + k * slope


@loop
def put(q, line, at, value):
    """q = value on the boundary faces."""
    for r in prange(line.size):
        q[line[r] + at] = value[r % value.size]


@loop
def copy(q, line, to, source, step, count):
    """q[to + k step] = q[source + k step]: periodic images, or zero normal derivative for a single source."""
    for r in prange(line.size):
        for k in range(count):
            q[line[r] + to + k * step] = q[line[r] + source + k * step]
