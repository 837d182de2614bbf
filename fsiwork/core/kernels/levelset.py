"""Smeared Heaviside and Dirac functions, and the differential geometry of level sets, at cell centres.

The kernels of geometry are written once, in three dimensions: in two, the third stride is 0, so that every
difference along it is exactly zero and an extruded field gives the two-dimensional result bit for bit.
"""

import math

import numpy as np
from numba import prange

from fsiwork.core.kernels import loop, point

ONE, TWO, QUARTER = np.float32(1), np.float32(2), np.float32(0.25)
SERIES = tuple((-1) ** k * (math.pi / 2) ** (2 * k) / math.factorial(2 * k) for k in range(12))


@point
def cosine(r):
    """ζ(r) = (1 + cos πr)/2 = cos²(πr/2), 0 beyond ±1, by a series: a call of cos would stop vectorisation."""
    t = min(r * r, 1.0)
    c = SERIES[-1]
    for k in range(len(SERIES) - 1):
        c = c * t + SERIES[len(SERIES) - 2 - k]
    return c * c if t < 1 else 0.0


@loop
def heaviside(out, phi, eps):
    """ℋ(φ/ε) = (1 + r + sin(πr)/π)/2 between 0 inside and 1 outside."""
    for i in prange(phi.size):
        r = phi[i] / eps
        if r <= -1:
            out[i] = 0
        elif r >= 1:
            out[i] = 1
        else:
            out[i] = 0.5 * (1 + r + math.sin(math.pi * r) / math.pi)


@loop
def dirac_cosine(out, phi, eps):
    for i in prange(phi.size):
        out[i] = cosine(phi[i] / eps) / eps


@loop
def dirac_hat(out, phi, eps):
    for i in prange(phi.size):
        out[i] = (eps - min(abs(phi[i]), eps)) / (eps * eps)


@loop
def dirac_cosine_scaled(out, phi, eps):
    """As `dirac_cosine` with the half-width ε ``out``: the slope of φ on entry, overwritten."""
    for i in prange(phi.size):
        w = eps * out[i]
        inside = abs(phi[i]) < w
        w = w if inside else eps
        out[i] = cosine(phi[i] / w) / w if inside else 0


@loop
def dirac_hat_scaled(out, phi, eps):
    """As `dirac_hat` with the half-width ε ``out``: the slope of φ on entry, overwritten."""
    for i in prange(phi.size):
        w = eps * out[i]
        if abs(phi[i]) < w:
            out[i] = (w - abs(phi[i])) / (w * w)
        else:
            out[i] = 0


@loop
def central(out, q, start, n, s, c):
    """out = c (q₊ - q₋) along the stride ``s``."""
    for r in prange(start.size):
        I = start[r]
        o, west, east = out[I : I + n], q[I - s : I - s + n], q[I + s : I + s + n]
        for i in range(n):
            o[i] = c * (east[i] - west[i])


@loop
def slope(out, q, start, n, x, y, z, c):
    """Euclidean norm of the central gradient."""
    for r in prange(start.size):
        I = start[r]
        o = out[I : I + n]
        xm, xp = q[I - x : I - x + n], q[I + x : I + x + n]
        ym, yp = q[I - y : I - y + n], q[I + y : I + y + n]
        zm, zp = q[I - z : I - z + n], q[I + z : I + z + n]
        for i in range(n):
            a, b, d = xp[i] - xm[i], yp[i] - ym[i], zp[i] - zm[i]
            o[i] = c * math.sqrt(a * a + b * b + d * d)


@loop
def slope_one(out, q, start, n, x, y, z, c):
    """1-norm of the central gradient."""
    for r in prange(start.size):
        I = start[r]
        o = out[I : I + n]
        xm, xp = q[I - x : I - x + n], q[I + x : I + x + n]
        ym, yp = q[I - y : I - y + n], q[I + y : I + y + n]
        zm, zp = q[I - z : I - z + n], q[I + z : I + z + n]
        for i in range(n):
            o[i] = c * (abs(xp[i] - xm[i]) + abs(yp[i] - ym[i]) + abs(zp[i] - zm[i]))


@loop
def divide(out, q, start, n, floor):
    """out /= q, and 0 where q is 0."""
    for r in prange(start.size):
        I = start[r]
        o, d = out[I : I + n], q[I : I + n]
        for i in range(n):
            o[i] = o[i] / (d[i] + floor)


@loop
def curvature(out, q, start, n, x, y, z, c, floor):
    """div(∇q/|∇q|) of central differences; ``c`` = 1/h, ``floor`` added to h²|∇q|² so that a flat field gives 0."""
    for r in prange(start.size):
        I = start[r]
        o, p = out[I : I + n], q[I : I + n]
        xm, xp = q[I - x : I - x + n], q[I + x : I + x + n]
        ym, yp = q[I - y : I - y + n], q[I + y : I + y + n]
        zm, zp = q[I - z : I - z + n], q[I + z : I + z + n]
        xmym, xmyp = q[I - x - y : I - x - y + n], q[I - x + y : I - x + y + n]
        xpym, xpyp = q[I + x - y : I + x - y + n], q[I + x + y : I + x + y + n]
        xmzm, xmzp = q[I - x - z : I - x - z + n], q[I - x + z : I - x + z + n]
        xpzm, xpzp = q[I + x - z : I + x - z + n], q[I + x + z : I + x + z + n]
        ymzm, ymzp = q[I - y - z : I - y - z + n], q[I - y + z : I - y + z + n]
        ypzm, ypzp = q[I + y - z : I + y - z + n], q[I + y + z : I + y + z + n]
        for i in range(n):
            a, b, d = (xp[i] - xm[i]) / TWO, (yp[i] - ym[i]) / TWO, (zp[i] - zm[i]) / TWO
            aa = (xp[i] - p[i]) - (p[i] - xm[i])
            bb = (yp[i] - p[i]) - (p[i] - ym[i])
            dd = (zp[i] - p[i]) - (p[i] - zm[i])
            ab = ((xpyp[i] - xpym[i]) - (xmyp[i] - xmym[i])) * QUARTER
            ad = ((xpzp[i] - xpzm[i]) - (xmzp[i] - xmzm[i])) * QUARTER
            bd = ((ypzp[i] - ypzm[i]) - (ymzp[i] - ymzm[i])) * QUARTER
            # The unit normal first: a division by g³ᐟ² lets LLVM form g³, which underflows in single precision.
            k = ONE / math.sqrt(a * a + b * b + d * d + floor)
            a, b, d = a * k, b * k, d * k
            f = (bb + dd) * a * a + (aa + dd) * b * b + (aa + bb) * d * d
            o[i] = c * k * (f - TWO * (a * b * ab + a * d * ad + b * d * bd))
