"""Integrals of chapter 2 over what moves with the flow: changes of variables and the Reynolds formulas.

Volumes are sums over the cells of a sub-box on one side, fluxes through its deformed sides on the other; surfaces and
curves are deformed meshes.
"""

import numpy as np

from fsiwork.studies import flowmap as flow
from fsiwork.studies.flowmap import TIME, cofactor, determinant, interpolated, largest, shift, slopes, times


def integrals(d: int, cells: int) -> dict[str, float]:
    """(2.8), (2.10) to (2.14), (2.28): a sub-box, a surface and a curve, deformed, against their references."""
    h = 1 / cells
    deformation = flow.gradient(flow.carried(flow.centres(d, cells, 1), 0.0, TIME, cells // 4), d, h)
    out = {}
    for name, patch in (("surface", flow.surface(d, cells)), ("curve", flow.curve(d, cells))):
        x, deformed = flow.carried(patch.middle, 0.0, TIME, cells // 4), patch.carried(0.0, TIME, cells // 4)
        F, first, last = interpolated(deformation, patch.middle), patch.element(), deformed.element()
        mapped = times(cofactor(F) if name == "surface" else F, first)
        f, size, wanted = flow.scalar(x, TIME), flow.norm(mapped), flow.norm(last)
        out[name] = shift(float((f * wanted).sum()), float((f * size).sum()))
        out[{"surface": "normal", "curve": "tangent"}[name]] = largest(mapped / size - last / wanted, np.ones(1))
        if name == "surface":
            force = [times(flow.stress(x, TIME), q).reshape(d, -1).sum(1) for q in (last, mapped)]
            out["flux"] = largest(force[0] - force[1], force[0])
    return out | _volumes(d, cells)


def _volumes(d: int, cells: int) -> dict[str, float]:
    """(2.8), (2.28): sums over the cells of the sub-box against sums over its deformed sides."""
    h = 1 / cells
    xi = flow.centres(d, cells, 2)
    x = flow.carried(xi, 0.0, TIME, cells // 4)
    F = flow.gradient(x, d, h)
    inner, quarter = (slice(None), *(slice(1, -1),) * d), cells // 4
    first = times(flow.stress(x[inner], TIME), cofactor(F))
    pull = np.einsum("ijj...->i...", flow.gradient(first, d, h))
    middle = (..., *(slice(quarter, -quarter),) * d)
    force = pull[middle].reshape(d, -1).sum(1) * h**d
    J, place = determinant(F)[inner[1:]][middle], x[(slice(None), *(slice(2, -2),) * d)][middle]
    volume = float((flow.scalar(place, TIME) * J).sum()) * h**d
    push, enclosed = np.zeros(d), 0.0
    for side, sign in flow.sides(d, cells):
        moved = side.carried(0.0, TIME, cells // 4)
        ds = sign * moved.element()
        push += times(flow.stress(moved.middle, TIME), ds).reshape(d, -1).sum(1)
        enclosed += float((flow.potential(moved.middle, TIME) * ds[0]).sum())
    return {"volume": shift(enclosed, volume), "piola": largest(push - force, push)}


def reynolds(d: int, cells: int) -> dict[str, float]:
    """(2.15), (2.16), (2.19): rates of integrals over what moves against the integrals of the rates."""
    h, out = 1 / cells, {}

    def rate(q, x, t):
        """∂ₜ of a function of (x, t)."""
        return (q(x, t + h) - q(x, t - h)) / (2 * h)

    for name, patch in (("surface", flow.surface(d, cells)), ("curve", flow.curve(d, cells))):
        totals = []
        for k in (-1, 0, 1):
            moved = patch.carried(0.0, TIME + k * h, cells // 4)
            totals.append(float((flow.scalar(moved.middle, TIME + k * h) * flow.norm(moved.element())).sum()))
            if k == 0:
                x, ds = moved.middle, moved.element()
        size = flow.norm(ds)
        along = ds / size
        strain = slopes(lambda q: flow.velocity(q, TIME), x, h)
        f, grad = flow.scalar(x, TIME), slopes(lambda q: flow.scalar(q, TIME), x, h)
        stretch = (times(strain, along) * along).sum(0)
        growth = np.trace(strain) - stretch if name == "surface" else stretch
        still = rate(flow.scalar, x, TIME) + (flow.velocity(x, TIME) * grad).sum(0)
        found = (totals[2] - totals[0]) / (2 * h)
        out[f"reynolds_{name}"] = shift(found, float(((still + f * growth) * size).sum()))
        if name == "curve":
            out["printed_2_19"] = shift(found, float(((still + growth) * size).sum()))
    return out | {"reynolds_volume": _reynolds_volume(d, cells, rate)}


def _reynolds_volume(d: int, cells: int, rate) -> float:
    h, quarter = 1 / cells, cells // 4
    totals = []
    for k in (-1, 1):
        moved = [(side.carried(0.0, TIME + k * h, cells // 4), sign) for side, sign in flow.sides(d, cells)]
        totals.append(sum(s * float((flow.potential(m.middle, TIME + k * h) * m.element()[0]).sum()) for m, s in moved))
    x = flow.carried(flow.centres(d, cells, 1), 0.0, TIME, cells // 4)
    middle = (..., *(slice(quarter, -quarter),) * d)
    J, place = determinant(flow.gradient(x, d, h))[middle], x[(slice(None), *(slice(1, -1),) * d)][middle]
    outflow = np.trace(slopes(lambda q: flow.scalar(q, TIME) * flow.velocity(q, TIME), place, h))
    return shift(
        (totals[1] - totals[0]) / (2 * h), float(((rate(flow.scalar, place, TIME) + outflow) * J).sum()) * h**d
    )
