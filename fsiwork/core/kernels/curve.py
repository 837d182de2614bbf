"""An elastic curve φ¹ = φ² = 0 on nodes (low corners): where it is, what the fields are there, its force on the faces.

All at the nodes and by compact differences of the eight cells around, as in `kernels.membrane`: a saw-tooth in a field
is resisted. The tube around a curve holds few cells, so these loops are serial.
"""

from numba import njit

from fsiwork.core.kernels import FASTMATH, point

FIRST, SECOND, W = 0, 1, 2  # rows of what `sample` finds: means of both fields, then the three components of w
serial = njit(error_model="numpy", fastmath=FASTMATH, cache=True)


@point
def mean(q, i, s):
    """Mean of the eight cells around a node."""
    a, b, c = s[0], s[1], s[2]
    low = (q[i - c] + q[i - a - c]) + (q[i - b - c] + q[i - a - b - c])
    return 0.125 * ((q[i] + q[i - a]) + (q[i - b] + q[i - a - b]) + low)


@point
def slope(q, i, a, b, c):
    """4h times the difference along ``a`` at a node."""
    near = (q[i] - q[i - a]) + (q[i - b] - q[i - a - b])
    return near + ((q[i - c] - q[i - a - c]) + (q[i - b - c] - q[i - a - b - c]))


@serial
def find(nodes, p, q, start, n, s, eps):
    """Flat indices of the nodes with both means below ε, into ``nodes``; returns how many, also beyond its size."""
    count = 0
    for r in range(start.size):
        for i in range(start[r], start[r] + n):
            if abs(mean(p, i, s)) < eps and abs(mean(q, i, s)) < eps:
                if count < nodes.size:
                    nodes[count] = i
                count += 1
    return count


@serial
def sample(out, p, q, nodes, s, h):
    """Means of both fields and w = ∇φ¹ × ∇φ² at the nodes: rows of ``out`` (5, nodes)."""
    a, b, c = s[0], s[1], s[2]
    k = 0.25 / h
    for m in range(nodes.size):
        i = nodes[m]
        px, py, pz = k * slope(p, i, a, b, c), k * slope(p, i, b, a, c), k * slope(p, i, c, a, b)
        qx, qy, qz = k * slope(q, i, a, b, c), k * slope(q, i, b, a, c), k * slope(q, i, c, a, b)
        out[FIRST, m], out[SECOND, m] = mean(p, i, s), mean(q, i, s)
        out[W, m], out[W + 1, m], out[W + 2, m] = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx


@serial
def average(out, q, nodes, s):
    """Means of a field at the nodes."""
    for m in range(nodes.size):
        out[m] = mean(q, nodes[m], s)


@serial
def pull(force, a, b, c, w, weight, nodes, s, h):
    """Add Σ_d ∂_d T_ad, T = ``weight`` w ⊗ w at the nodes, to the force along ``a`` on its low faces.

    T_aa goes to the centres around a node, T_ab to the two edges along c beside it: what it adds sums to zero.
    """
    sa, sb, sc = s[a], s[b], s[c]
    for m in range(nodes.size):
        along, i = weight[m] * w[a, m], nodes[m]
        t = 0.125 * along * w[a, m] / h
        for k in (i, i - sb, i - sc, i - sb - sc):
            force[k - sa] += t
            force[k + sa] -= t
        t = 0.5 * along * w[b, m] / h
        force[i - sb] += t
        force[i - sb - sc] += t
        force[i] -= t
        force[i - sc] -= t
        t = 0.5 * along * w[c, m] / h
        force[i - sc] += t
        force[i - sb - sc] += t
        force[i] -= t
        force[i - sb] -= t
