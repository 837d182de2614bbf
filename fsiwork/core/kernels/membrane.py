"""Forces of a membrane on the faces (3.18), walked over the pieces of rows that its band occupies.

``runs[r] = (first flat index, length, offset)``: one piece of a row; ``offset`` counts the cells of the pieces before.
``s`` holds three strides. In two dimensions the third is 0, so that every difference along it vanishes and one source
serves both: an extruded field gives the forces of its plane. ``numbers = (h, eps, renormalised 0|1, lam)``; ``kind`` is
a code of `bodies.laws` (0: E' = λ, 1: E' = λ(r - 1), 2: E' is read from ``given``, packed like the runs).
Scratch fields are zero outside the runs.
"""

import numpy as np
from numba import njit, prange

from fsiwork.core.kernels import FASTMATH, point

TINY = 1e-60  # added to |∇φ|²: a vanishing gradient stays finite and gives no force

# Sums in the order written: SIMD bodies and remainders of loops, hence rows of any length, then round alike.
loop = njit(parallel=True, error_model="numpy", fastmath=FASTMATH - {"reassoc"}, cache=True)


@point
def quarter_sine(t):
    """sin(πt/2) for 0 ≤ t ≤ 1, to rounding; a polynomial, because a call of libm would not use SIMD."""
    x = t * t * 2.4674011002723395
    y = 1.0 - x * (1 / 420.0) * (1.0 - x * (1 / 506.0))
    y = 1.0 - x * (1 / 272.0) * (1.0 - x * (1 / 342.0) * y)
    y = 1.0 - x * (1 / 156.0) * (1.0 - x * (1 / 210.0) * y)
    y = 1.0 - x * (1 / 72.0) * (1.0 - x * (1 / 110.0) * y)
    y = 1.0 - x * (1 / 20.0) * (1.0 - x * (1 / 42.0) * y)
    return 1.5707963267948966 * t * (1.0 - x * (1 / 6.0) * y)


@point
def bell(r):
    """ζ(r) = ½(1 + cos πr) on [-1, 1], else 0."""
    c = quarter_sine(1.0 - min(abs(r), 1.0))
    return c * c


@point
def ramp(r):
    """ℋ(r) = ½(1 + r + sin(πr)/π) between 0 (r < -1) and 1 (r > 1)."""
    q = min(abs(r), 1.0)
    wave = quarter_sine(2.0 * min(q, 1.0 - q)) * 0.3183098861837907
    return 0.5 * (1.0 + q + wave) if r > 0.0 else 0.5 * (1.0 - q - wave)


@point
def dirac(phi, g, eps, renormalised):
    """D_ε: (1/ε) ζ(φ/ε), or with ε|∇φ| in place of ε."""
    w = eps * g if renormalised else eps
    return bell(phi / w) / w


@point
def tension(kind, lam, r, given):
    """E'(r)."""
    return lam if kind == 0 else (lam * (r - 1.0) if kind == 1 else given)


@loop
def clear(q, runs):
    """q = 0 on the runs."""
    for r in prange(runs.shape[0]):
        q[runs[r, 0] : runs[r, 0] + runs[r, 1]] = 0.0


@loop
def stretch_at_centres(out, phi, runs, s, h):
    """Packed |∇φ| at centres, by central differences."""
    a, b, c, k = s[0], s[1], s[2], 0.5 / h
    for r in prange(runs.shape[0]):
        I, n, o = runs[r, 0], runs[r, 1], runs[r, 2]
        q, ae, aw, be, bw = out[o : o + n], phi[I + a :], phi[I - a :], phi[I + b :], phi[I - b :]
        ce, cw = phi[I + c :], phi[I - c :]
        for i in range(n):
            ga, gb, gc = k * (ae[i] - aw[i]), k * (be[i] - bw[i]), k * (ce[i] - cw[i])
            q[i] = np.sqrt(ga * ga + gb * gb + gc * gc + TINY)


@loop
def stretch_at_nodes(out, phi, runs, s, h):
    """Packed |∇φ| at nodes (low corners in every direction), by differences of the points around."""
    a, b, c, k = s[0], s[1], s[2], 0.25 / h
    for r in prange(runs.shape[0]):
        I, n, o = runs[r, 0], runs[r, 1], runs[r, 2]
        q, p, pa, pb, pab = out[o : o + n], phi[I:], phi[I - a :], phi[I - b :], phi[I - a - b :]
        w, wa, wb, wab = phi[I - c :], phi[I - c - a :], phi[I - c - b :], phi[I - c - a - b :]
        for i in range(n):
            p0, p1, p2, p3, w0, w1, w2, w3 = p[i], pa[i], pb[i], pab[i], w[i], wa[i], wb[i], wab[i]
            ga = k * (((p0 - p1) + (p2 - p3)) + ((w0 - w1) + (w2 - w3)))
            gb = k * (((p0 - p2) + (p1 - p3)) + ((w0 - w2) + (w1 - w3)))
            gc = k * (((p0 - w0) + (p1 - w1)) + ((p2 - w2) + (p3 - w3)))
            q[i] = np.sqrt(ga * ga + gb * gb + gc * gc + TINY)


@loop
def stress_at_nodes(out, phi, runs, s, shear, kind, numbers, given):
    """T = E'(|∇φ|) |∇φ| (I - nn) D_ε at nodes: T_ab if ``shear``, else T_aa, for the directions of s[0] and s[1].

    All of T at the same points, by compact differences: a saw-tooth in φ is resisted, while with T_aa at centres
    from central differences (which do not see it) the membrane's energy grows.
    """
    a, b, c = s[0], s[1], s[2]
    h, eps, renormalised, lam = numbers[0], numbers[1], numbers[2] > 0.0, numbers[3]
    k = 0.25 / h
    for r in prange(runs.shape[0]):
        I, n, o = runs[r, 0], runs[r, 1], runs[r, 2]
        T, p, pa, pb, pab, e1 = out[I : I + n], phi[I:], phi[I - a :], phi[I - b :], phi[I - a - b :], given[o:]
        w, wa, wb, wab = phi[I - c :], phi[I - c - a :], phi[I - c - b :], phi[I - c - a - b :]
        for i in range(n):
            p0, p1, p2, p3, w0, w1, w2, w3 = p[i], pa[i], pb[i], pab[i], w[i], wa[i], wb[i], wab[i]
            ga = k * (((p0 - p1) + (p2 - p3)) + ((w0 - w1) + (w2 - w3)))
            gb = k * (((p0 - p2) + (p1 - p3)) + ((w0 - w2) + (w1 - w3)))
            gc = k * (((p0 - w0) + (p1 - w1)) + ((p2 - w2) + (p3 - w3)))
            across = gb * gb + gc * gc
            g = np.sqrt(ga * ga + across + TINY)
            mean = 0.125 * (((p0 + p3) + (p1 + p2)) + ((w0 + w3) + (w1 + w2)))
            along = tension(kind, lam, g, e1[i] if kind == 2 else 0.0) / g * dirac(mean, g, eps, renormalised)
            T[i] = along * (-ga * gb if shear else across)


@loop
def add_normal(out, T, runs, s, h):
    """out_a += ∂_a T_aa on low faces of a, T_aa at centres the mean of the nodes around."""
    a, b, c, k = s[0], s[1], s[2], 0.125 / h
    for r in prange(runs.shape[0]):
        I, n = runs[r, 0], runs[r, 1]
        q, e0, e1, e2, e3 = out[I : I + n], T[I + a :], T[I + a + b :], T[I + a + c :], T[I + a + b + c :]
        w0, w1, w2, w3 = T[I - a :], T[I - a + b :], T[I - a + c :], T[I - a + b + c :]
        for i in range(n):
            q[i] += k * (((e0[i] - w0[i]) + (e1[i] - w1[i])) + ((e2[i] - w2[i]) + (e3[i] - w3[i])))


@loop
def add_shear(out, T, runs, b, c, h):
    """out_a += ∂_b T_ab on low faces of a, T_ab on edges the mean of the two nodes along c (strides b, c)."""
    k = 0.5 / h
    for r in prange(runs.shape[0]):
        I, n = runs[r, 0], runs[r, 1]
        q, e0, e1, w0, w1 = out[I : I + n], T[I + b :], T[I + b + c :], T[I:], T[I + c :]
        for i in range(n):
            q[i] += k * ((e0[i] - w0[i]) + (e1[i] - w1[i]))


@loop
def bend(out, tau, phi, runs, s, kind, numbers, given):
    """out = E'H and tau = E' at centres; H = div n by central differences, at most 2/h in size."""
    a, b, c = s[0], s[1], s[2]
    h, lam = numbers[0], numbers[3]
    k, kk, kx, top = 0.5 / h, 1.0 / (h * h), 0.25 / (h * h), 2.0 / h
    for r in prange(runs.shape[0]):
        I, n, o = runs[r, 0], runs[r, 1], runs[r, 2]
        K, W, p, e1 = out[I : I + n], tau[I : I + n], phi[I:], given[o:]
        ae, aw, be, bw, ce, cw = phi[I + a :], phi[I - a :], phi[I + b :], phi[I - b :], phi[I + c :], phi[I - c :]
        abee, abww, abew, abwe = phi[I + a + b :], phi[I - a - b :], phi[I + a - b :], phi[I - a + b :]
        acee, acww, acew, acwe = phi[I + a + c :], phi[I - a - c :], phi[I + a - c :], phi[I - a + c :]
        bcee, bcww, bcew, bcwe = phi[I + b + c :], phi[I - b - c :], phi[I + b - c :], phi[I - b + c :]
        for i in range(n):
            ga, gb, gc = k * (ae[i] - aw[i]), k * (be[i] - bw[i]), k * (ce[i] - cw[i])
            twice = 2.0 * p[i]
            aa, bb, cc = kk * (ae[i] + aw[i] - twice), kk * (be[i] + bw[i] - twice), kk * (ce[i] + cw[i] - twice)
            ab = kx * ((abee[i] + abww[i]) - (abew[i] + abwe[i]))
            ac = kx * ((acee[i] + acww[i]) - (acew[i] + acwe[i]))
            bc = kx * ((bcee[i] + bcww[i]) - (bcew[i] + bcwe[i]))
            g2 = ga * ga + gb * gb + gc * gc + TINY
            g = np.sqrt(g2)
            square = (bb + cc) * ga * ga + (aa + cc) * gb * gb + (aa + bb) * gc * gc
            H = (square - 2.0 * (ab * ga * gb + ac * ga * gc + bc * gb * gc)) / (g2 * g)
            W[i] = tension(kind, lam, g, e1[i] if kind == 2 else 0.0)
            K[i] = W[i] * max(-top, min(top, H))


@loop
def pull_balanced(out, K, phi, runs, s, numbers):
    """F_a -= E'H ∂_a H_ε(φ) on low faces: with a constant E'H this is a gradient, which pressure balances exactly."""
    a, h, eps = s[0], numbers[0], numbers[1]
    for r in prange(runs.shape[0]):
        I, n = runs[r, 0], runs[r, 1]
        q, p, pw, k, kw = out[I : I + n], phi[I:], phi[I - a :], K[I:], K[I - a :]
        for i in range(n):
            q[i] -= 0.5 * (k[i] + kw[i]) * (ramp(p[i] / eps) - ramp(pw[i] / eps)) / h


@loop
def pull(out, K, tau, phi, runs, s, numbers):
    """F_a += (∇_ΓE' - E'H n)_a |∇φ| D_ε on low faces (3.18)."""
    a, b, c = s[0], s[1], s[2]
    h, eps, renormalised = numbers[0], numbers[1], numbers[2] > 0.0
    for r in prange(runs.shape[0]):
        I, n = runs[r, 0], runs[r, 1]
        q, p, pw, k, kw, t, tw = out[I : I + n], phi[I:], phi[I - a :], K[I:], K[I - a :], tau[I:], tau[I - a :]
        bn, bs, bnw, bsw = phi[I + b :], phi[I - b :], phi[I - a + b :], phi[I - a - b :]
        cn, cs, cnw, csw = phi[I + c :], phi[I - c :], phi[I - a + c :], phi[I - a - c :]
        tbn, tbs, tbnw, tbsw = tau[I + b :], tau[I - b :], tau[I - a + b :], tau[I - a - b :]
        tcn, tcs, tcnw, tcsw = tau[I + c :], tau[I - c :], tau[I - a + c :], tau[I - a - c :]
        for i in range(n):
            ga = (p[i] - pw[i]) / h
            gb = 0.25 * ((bn[i] - bs[i]) + (bnw[i] - bsw[i])) / h
            gc = 0.25 * ((cn[i] - cs[i]) + (cnw[i] - csw[i])) / h
            g2 = ga * ga + gb * gb + gc * gc + TINY
            g = np.sqrt(g2)
            ta = (t[i] - tw[i]) / h
            tb = 0.25 * ((tbn[i] - tbs[i]) + (tbnw[i] - tbsw[i])) / h
            tc = 0.25 * ((tcn[i] - tcs[i]) + (tcnw[i] - tcsw[i])) / h
            along = (ta * (gb * gb + gc * gc) - ga * (gb * tb + gc * tc)) / g
            D = dirac(0.5 * (p[i] + pw[i]), g, eps, renormalised)
            q[i] += D * (along - 0.5 * (k[i] + kw[i]) * ga)


@loop
def pull_split(out, K, phi, Ga, Gb, Gc, runs, s, numbers):
    """F_a += (G - n n·G - E'H |∇φ| D_ε n)_a on low faces, G the force in divergence form on all faces."""
    a, b, c = s[0], s[1], s[2]
    h, eps, renormalised = numbers[0], numbers[1], numbers[2] > 0.0
    for r in prange(runs.shape[0]):
        I, n = runs[r, 0], runs[r, 1]
        q, p, pw, k, kw, G = out[I : I + n], phi[I:], phi[I - a :], K[I:], K[I - a :], Ga[I:]
        bn, bs, bnw, bsw = phi[I + b :], phi[I - b :], phi[I - a + b :], phi[I - a - b :]
        cn, cs, cnw, csw = phi[I + c :], phi[I - c :], phi[I - a + c :], phi[I - a - c :]
        b0, b1, b2, b3 = Gb[I:], Gb[I - a :], Gb[I + b :], Gb[I + b - a :]
        c0, c1, c2, c3 = Gc[I:], Gc[I - a :], Gc[I + c :], Gc[I + c - a :]
        for i in range(n):
            ga = (p[i] - pw[i]) / h
            gb = 0.25 * ((bn[i] - bs[i]) + (bnw[i] - bsw[i])) / h
            gc = 0.25 * ((cn[i] - cs[i]) + (cnw[i] - csw[i])) / h
            g2 = ga * ga + gb * gb + gc * gc + TINY
            Gbi, Gci = 0.25 * (b0[i] + b1[i] + b2[i] + b3[i]), 0.25 * (c0[i] + c1[i] + c2[i] + c3[i])
            along = (G[i] * (gb * gb + gc * gc) - ga * (gb * Gbi + gc * Gci)) / g2
            D = dirac(0.5 * (p[i] + pw[i]), np.sqrt(g2), eps, renormalised)
            q[i] += along - 0.5 * (k[i] + kw[i]) * D * ga
