"""Distances by Godunov's upwinding from nodes next to the interface outwards: fast marching and fast sweeping.

Fields are flat, padded by two walls on each side, which are never read or written: ``d`` unsigned distances [cells],
``state`` what a node is, ``n`` the padded shape in three directions (1 for a missing one), ``s`` the strides of the
directions there are.
"""

import numpy as np
from numba import njit

from fsiwork.core.kernels import point

FAR, TRIAL, KNOWN, SEED, WALL = range(5)

# One node after the other: nothing to do in parallel.
serial = njit(error_model="numpy", cache=True)


@point
def solve(t, w, m):
    """Largest root u of Σ w² (u - t)² = 1 over the first m axes, without those with t ≥ u. Sorts ``t`` and ``w``."""
    for i in range(1, m):
        for j in range(i, 0, -1):
            if t[j] < t[j - 1]:
                t[j], t[j - 1] = t[j - 1], t[j]
                w[j], w[j - 1] = w[j - 1], w[j]
    u = t[0] + 1 / w[0]
    a, b, first = w[0] * w[0], 0.0, t[0]
    c = -1.0
    for i in range(1, m):
        if t[i] >= u:
            break
        shift, square = t[i] - first, w[i] * w[i]  # measured from the least t: no cancellation
        a, b, c = a + square, b + square * shift, c + square * shift * shift
        u = first + (b + np.sqrt(max(b * b - a * c, 0.0))) / a
    return u


@serial
def linear_seeds(q, d, state, s, nodes):
    """Distances of nodes next to a change of sign: to the plane through the nearest linear crossing on each axis."""
    for node in nodes:
        total = 0.0
        for axis in range(s.size):
            nearest = np.inf
            for step in (-s[axis], s[axis]):
                if state[node + step] != WALL and (q[node] > 0) != (q[node + step] > 0):
                    nearest = min(nearest, q[node] / (q[node] - q[node + step]))
            if nearest == 0:
                total = np.inf
            total += 1 / (nearest * nearest)
        d[node] = 1 / np.sqrt(total)
        state[node] = SEED


@serial
def sweep(d, state, n, s, most):
    """Gauss and Seidel's iteration over all orders of the nodes until nothing moves, at most ``most`` rounds."""
    t, w = np.empty(3), np.empty(3)
    for _ in range(most):
        moved = 0.0
        for order in range(8 if n[0] > 1 else 4):
            for i0 in range(n[0]):
                i = n[0] - 1 - i0 if order & 4 else i0
                for j0 in range(n[1]):
                    j = n[1] - 1 - j0 if order & 2 else j0
                    row = (i * n[1] + j) * n[2]
                    for k0 in range(n[2]):
                        node = row + (n[2] - 1 - k0 if order & 1 else k0)
                        if state[node] >= SEED:
                            continue
                        m = 0
                        for axis in range(s.size):
                            least = min(d[node - s[axis]], d[node + s[axis]])
                            if least < d[node]:
                                t[m], w[m] = least, 1.0
                                m += 1
                        if m:
                            u = solve(t, w, m)
                            if u < d[node]:
                                moved = max(moved, d[node] - u)
                                d[node] = u
        if moved < 1e-9:
            break


@point
def push(keys, nodes, size, key, node):
    """Add to the heap; grown arrays are returned."""
    if size == keys.size:
        more = np.empty(2 * size)
        more[:size] = keys
        keys = more
        others = np.empty(2 * size, np.int64)
        others[:size] = nodes
        nodes = others
    i = size
    while i > 0:
        up = (i - 1) >> 1
        if keys[up] <= key:
            break
        keys[i], nodes[i] = keys[up], nodes[up]
        i = up
    keys[i], nodes[i] = key, node
    return keys, nodes


@point
def pull(keys, nodes, size):
    """Close the gap at the heap's top with its last entry."""
    key, node = keys[size - 1], nodes[size - 1]
    last = size - 1
    i = 0
    while True:
        child = 2 * i + 1
        if child >= last:
            break
        if child + 1 < last and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[i], nodes[i] = keys[child], nodes[child]
        i = child
    keys[i], nodes[i] = key, node


@point
def update(q, d, state, s, node, second, t, w):
    """Distance of a node from its known neighbours; with ``second`` from two in a row where the pair is upwind.

    A second neighbour across the interface enters with its sign: as a negative distance.
    """
    m = 0
    for axis in range(s.size):
        least, side = np.inf, 0
        for step in (-s[axis], s[axis]):
            if (state[node + step] == KNOWN or state[node + step] == SEED) and d[node + step] < least:
                least, side = d[node + step], step
        if side == 0:
            continue
        t[m], w[m] = least, 1.0
        beyond = node + 2 * side
        if second and (state[beyond] == KNOWN or state[beyond] == SEED):
            value = d[beyond] if (q[beyond] > 0) == (q[node] > 0) else -d[beyond]
            if value <= least:
                t[m], w[m] = (4 * least - value) / 3, 1.5
        m += 1
    return solve(t, w, m)


@serial
def march(q, d, state, s, front, second, reach):
    """Freeze nodes in the order of their distance from the seeds ``front`` on, up to ``reach`` [cells]."""
    keys, nodes = np.empty(max(4 * front.size, 64)), np.empty(max(4 * front.size, 64), np.int64)
    t, w = np.empty(3), np.empty(3)
    size = 0
    for node in front:
        keys, nodes = push(keys, nodes, size, d[node], node)
        size += 1
    while size > 0:
        key, node = keys[0], nodes[0]
        pull(keys, nodes, size)
        size -= 1
        if key > reach:
            break
        if state[node] == KNOWN or key > d[node]:
            continue
        if state[node] == TRIAL:
            state[node] = KNOWN
        for axis in range(s.size):
            for step in (-s[axis], s[axis]):
                other = node + step
                if state[other] > TRIAL:
                    continue
                u = update(q, d, state, s, other, second, t, w)
                if u < d[other]:
                    d[other] = u
                    state[other] = TRIAL
                    keys, nodes = push(keys, nodes, size, u, other)
                    size += 1
