"""What a run takes: fields, solvers, memory, steps, time; and the refusal of what does not fit into memory.

Arithmetic on the scene alone: nothing of the solver is loaded.
"""

import math
from dataclasses import dataclass

from fsiwork.scene import Body, Bubbles, Curve, Fluid, Markers, Membrane, Scene, SceneError, ShearMembrane

GHOSTS = 3  # as in core.grid, which this module does not load
SHARE = 0.8  # of the available memory
PROCESS = 270e6  # bytes of Python, NumPy, SciPy, Numba, xarray and the compiled kernels

# CPU time by stage: (2D, 3D) in ns a cell and step, one core; the last column is ns a step whatever the size.
# Measured stage by stage on the scenes of this repository, 64² and 256², 24³ and 64³ (Zen 4, a busy machine).
COST = {
    "advection none": (3.0, 9.0, 2e4),
    "advection central": (3.0, 9.0, 2e4),
    "advection upwind5": (4.5, 16.0, 2e4),
    "pressure, direct": (6.5, 18.0, 7e4),
    "pressure, multigrid": (315.0, 420.0, 5e5),
    "diffusion, lines": (3.3, 10.0, 4e4),
    "diffusion, direct": (16.0, 48.0, 8e4),
    "diffusion, multigrid": (150.0, 300.0, 5e5),
    "mixture": (18.0, 30.0, 1.2e5),
    "transport of a field": (14.0, 25.0, 4e4),
    "φ from the map": (9.0, 25.0, 1e5),
    "force": (2.0, 5.0, 3e4),
    "prediction of φ, direct": (8.0, 12.0, 6e4),
    "distance anew": (60.0, 300.0, 1e5),
    "gauges": (3.5, 7.0, 7e4),
    "geometric gauges": (0.0, 125.0, 0.0),  # in the plane a part of the gauges
}
START = 1.0  # seconds to load everything, kernels from the cache


@dataclass(frozen=True)
class Plan:
    """What a run takes.

    ``fields``: (what, how many, bytes of all of them); ``solvers``: (for what, which, bytes); ``bytes``: the peak of
    the process; ``stages``: (what, seconds over the run); ``seconds``: CPU time of the run on one core.
    """

    cells: tuple[int, ...]
    fields: tuple[tuple[str, int, int], ...]
    solvers: tuple[tuple[str, str, int], ...]
    bytes: int
    step: float
    steps: int
    stages: tuple[tuple[str, float], ...]
    seconds: float
    output_bytes: int


def estimate(scene: Scene) -> Plan:
    """Plan of a scene. Numbers of bytes and steps are counted, seconds are estimated (factor of two)."""
    box = scene.box
    padded = 8 * math.prod(k + 2 * GHOSTS for k in box.n)
    compact = 8 * math.prod(box.n)
    step = _step(scene)
    steps = math.ceil(scene.clock.end / step - 1e-9)
    fields = tuple((what, count, count * padded) for what, count in _fields(scene) if count)
    solvers = tuple((what, which, int(share * compact)) for what, which, share in _solvers(scene, step))
    stages = tuple((what, steps * _nanoseconds(what, count, box.n) * 1e-9) for what, count in _stages(scene, solvers))
    frame = _frame_bytes(scene, compact)
    state = (3 * box.dim + 2) * padded + sum(_carried(body, box.dim) for body in scene.bodies) * padded
    memory = PROCESS + sum(b for *_, b in fields) + sum(b for *_, b in solvers) + state + 2 * frame
    return Plan(
        box.n,
        fields,
        solvers,
        int(memory),
        step,
        steps,
        stages,
        START + sum(seconds for _, seconds in stages),
        frame * (scene.clock.frames + 1),
    )


def refuse(scene: Scene) -> None:
    """Raise `SceneError` when a run needs more than 80 % of the memory that is available now."""
    import psutil

    need, free = estimate(scene).bytes, psutil.virtual_memory().available
    if need > SHARE * free:
        raise SceneError(
            f"box.cells: the run needs {size(need)}, more than {SHARE:.0%} of the {size(free)} that are available"
        )


def describe(plan: Plan) -> str:
    """The plan as text."""
    lines = [f"cells      {' × '.join(map(str, plan.cells))} = {math.prod(plan.cells):,}"]
    lines += [f"field      {what:<28} {count:>3}  {size(b):>9}" for what, count, b in plan.fields]
    lines += [f"solver     {what:<28} {which:<22} {size(b):>9}" for what, which, b in plan.solvers]
    lines += [f"memory     {size(plan.bytes)}, of which {size(PROCESS)} for the process itself"]
    lines += [f"steps      {plan.steps:,} of {plan.step:.6g}"]
    lines += [f"stage      {what:<28} {duration(s):>9}" for what, s in plan.stages]
    lines += [
        f"time       about {duration(plan.seconds)} on one core, compiled kernels at hand (else up to a minute more)"
    ]
    lines += [f"output     up to {size(plan.output_bytes)} of fields before compression"]
    return "\n".join(lines)


def size(count: float) -> str:
    """Bytes in words."""
    for unit in ("B", "kB", "MB", "GB", "TB", "PB"):
        if count < 999.5 or unit == "PB":
            return f"{count:.3g} {unit}"
        count /= 1000
    raise AssertionError("unreachable")


def duration(seconds: float) -> str:
    """A time in words."""
    for limit, unit, name in ((0.1, 1e-3, "ms"), (100, 1, "s"), (6000, 60, "min"), (172800, 3600, "h")):
        if seconds < limit:
            return f"{seconds / unit:.3g} {name}"
    return f"{seconds / 86400:.3g} days"


def _variable(scene: Scene) -> bool:
    return any(body.inside or body.surface_mass for _, body in _membranes(scene))


def _carried(body: Body, dim: int) -> int:
    if isinstance(body, Markers):
        return 0
    return _levels(body) + dim * (body.transport.carry == "map")


def _levels(body: Body) -> int:
    """How many level sets: two meet in a curve, a label ends a fibre."""
    return 2 + (body.shape.kind == "fibre") if isinstance(body, Curve) else 1


def _fields(scene: Scene) -> list[tuple[str, int]]:
    """(what, how many padded fields), as core.flow, core.transport and bodies.membrane allocate them."""
    dim, fluid = scene.box.dim, scene.fluid
    if fluid is None:
        passive = [("velocity: now, at first", 2 * dim)]
        return passive + [line for i, body in enumerate(scene.bodies) for line in _passive(i, body, dim)]
    found = [("velocity: now, next, rate", 3 * dim), ("pressure, viscosity", 3), ("force", dim * bool(scene.bodies))]
    if _variable(scene):
        other = any(b.inside and _viscosity(b, fluid) != fluid.viscosity for _, b in _membranes(scene))
        found += [("mixture: ρ, μ, 1/ρ on faces, ψ", dim + 2 + other), ("force", 0 if scene.bodies else dim)]
    for i, body in enumerate(scene.bodies):
        if not isinstance(body, Membrane | Bubbles):
            found += _passive(i, body, dim)
            continue
        carry = _carried(body, dim)
        linear = getattr(body.energy, "kind", "") == "linear"
        form = body.form if body.form != "auto" else "normal-tangential" if linear else "divergence"
        pull = 2 * dim + 4 if form == "adjoint" else 1 + (form != "divergence") + dim * (form == "split")
        copies = 2 + dim * (body.transport.dtype != "float64")
        found += [(f"body {i}: φ{', Y' * (carry > 1)}", carry), (f"body {i}: tension, copies", pull + copies)]
        if body.coupling == "semi-implicit":
            found += [(f"body {i}: φ̃", 2)]
        if carry > 1:
            found += [(f"body {i}: φ₀(Y)", dim + 2 + bool(body.transport.restart))]
        if isinstance(body, Membrane):
            found += [(f"body {i}: bending", 3 * bool(body.bending)), (f"body {i}: lines anew", 2 * bool(body.renew))]
    return found


def _passive(i: int, body: Body, dim: int) -> list[tuple[str, int]]:
    """Fields of a body that only goes along: φ or Y, Runge-Kutta stages, velocity at the centres, φ₀(Y)."""
    if isinstance(body, Markers):
        return []
    carry = _carried(body, dim)
    return [(f"body {i}: φ{', Y' * (carry > 1)}", carry), (f"body {i}: stages, u at centres, scratch", 4 + dim)]


def _membranes(scene: Scene) -> list[tuple[int, Membrane | Bubbles]]:
    return [(i, body) for i, body in enumerate(scene.bodies) if isinstance(body, Membrane | Bubbles)]


def _viscosity(body: Membrane | Bubbles, fluid: Fluid) -> float:
    """Of the fluid inside; that of the fluid around it where none is given."""
    own = body.inside.viscosity
    return fluid.viscosity if own is None else own


def _solvers(scene: Scene, step: float) -> list[tuple[str, str, float]]:
    """(for what, which, bytes over those of one compact field)."""
    dim, fluid, h = scene.box.dim, scene.fluid, scene.box.h
    if fluid is None:
        return []
    variable = _variable(scene)
    found = [("pressure", "multigrid", 16.0) if variable else ("pressure", "direct", 2.5)]
    membranes = _membranes(scene)
    stabilised = any(body.coupling in ("stabilised", "iterated") for _, body in membranes)
    alpha = 0.0
    if fluid.diffusion != "explicit":
        nu = [(fluid.viscosity, fluid.density)]
        nu += [(_viscosity(b, fluid), b.inside.density) for _, b in membranes if b.inside]
        worst = max(mu for mu, _ in nu) / min(rho for _, rho in nu) if variable else fluid.viscosity / fluid.density
        alpha = (0.5 if fluid.diffusion == "implicit" and not variable else 1.0) * step * worst / h**2
    if variable and alpha > 0.0:
        found.append(("diffusion", "multigrid", 16.0 * dim))
    elif stabilised or alpha > 4.0:
        found.append(("diffusion", "direct", 1.0 * dim))
    elif alpha > 0.0:
        found.append(("diffusion", "lines", 0.0))
    for i, body in membranes:
        if body.coupling == "semi-implicit":
            found.append((f"body {i}: prediction of φ", "direct", 1.5))
    return found


def _stages(scene: Scene, solvers) -> list[tuple[str, float]]:
    """(name in COST, how many times a step)."""
    found = [(f"advection {scene.fluid.advection}", 1.0)] if scene.fluid else []
    passes = 2.0 if any(body.coupling == "iterated" for _, body in _membranes(scene)) else 1.0
    for what, which, _ in solvers:
        if "prediction" not in what:
            found.append((f"{what}, {which}", 1.0))
    if _variable(scene):
        found.append(("mixture", 1.0))
    for body in scene.bodies:
        if isinstance(body, Markers):
            continue
        mapped, fields = body.transport.carry == "map", _levels(body)
        found.append(("transport of a field", float(scene.box.dim if mapped else fields)))
        if mapped:
            found.append(("φ from the map", 1.0))
        if anew := getattr(body, "redistance", None):
            found.append(("distance anew", 1.0 / anew.every))
        if not isinstance(body, Membrane | Bubbles):
            continue
        found.append(("force", 1.0))
        if body.coupling == "semi-implicit":
            found.append(("prediction of φ, direct", 1.0))
    totals: dict[str, float] = {}
    for name, count in found:
        totals[name] = totals.get(name, 0.0) + passes * count
    totals["gauges"] = (1 + len(scene.bodies)) / scene.output.gauges_every
    if scene.output.geometric:
        totals["geometric gauges"] = len(scene.bodies) / scene.output.gauges_every
    return list(totals.items())


def _nanoseconds(what: str, count: float, n: tuple[int, ...]) -> float:
    flat, solid, base = COST[what]
    return count * (math.prod(n) * (flat if len(n) == 2 else solid) + base)


def _frame_bytes(scene: Scene, compact: int) -> int:
    dim, bodies = scene.box.dim, len(scene.bodies)
    counts = {"u": dim, "phi": bodies, "Y": dim * bodies}
    total = sum(counts.get(name, 1) for name in scene.output.fields)
    return total * compact // (1 if scene.output.dtype == "float64" else 2)


def _step(scene: Scene) -> float:
    """Δt of the clock; for ``auto`` the limits at t = 0, with (1.54) for the bodies."""
    if scene.clock.step != "auto":
        return scene.clock.step
    h, fluid, limits = scene.box.h, scene.fluid, [scene.clock.end]
    speed = _speed(scene)
    if speed > 0:
        limits.append(0.5 * h / speed)
    if fluid and fluid.diffusion == "explicit" and fluid.viscosity > 0:
        limits.append(h**2 * fluid.density / (4 * scene.box.dim * fluid.viscosity))
    limits += [limit for body in scene.bodies for limit in _of_body(scene, body)]
    return min(scene.clock.end, scene.clock.safety * min(limits))


def _of_body(scene: Scene, body: Body) -> list[float]:
    """Limits of the tension (1.54) and of bending, as `bodies.membrane` has them."""
    tension = _tension(body) if isinstance(body, Membrane | Bubbles | Markers | Curve | ShearMembrane) else 0.0
    if not tension > 0:
        return []
    h, fluid, inside = scene.box.h, scene.fluid, getattr(body, "inside", None)
    rho = min(fluid.density, inside.density) if inside else fluid.density
    mu = min(fluid.viscosity, _viscosity(body, fluid)) if inside else fluid.viscosity
    damped = inside or getattr(body, "surface_mass", 0.0) or fluid.diffusion == "backward-euler"
    eps = 2.0 * h if isinstance(body, Markers) else body.width.of(h)
    if isinstance(body, Markers | Curve):
        tension /= eps ** (scene.box.dim - 2)  # of a line in space
    gain, coupling = mu * eps if damped else 0.0, getattr(body, "coupling", "explicit")
    limit = (gain + math.hypot(gain, math.sqrt(0.5 * tension * rho * eps) * h)) / tension
    smooth = coupling in ("stabilised", "iterated")
    drop = isinstance(body, Membrane | Bubbles) and getattr(body.energy, "kind", "") == "linear"
    limits = [limit * (4.0 if smooth or (coupling == "semi-implicit" and drop) else 1.0)]
    if getattr(body, "bending", 0.0):
        slope = body.stretch if body.dirac == "plain" or (body.dirac == "auto" and drop) else 1.0
        limits.append(0.5 * h**2 * math.sqrt(rho * eps / (body.bending * slope)) * (10.0 if smooth else 1.0))
    return limits


def _tension(body: Membrane | Bubbles | Markers | Curve | ShearMembrane) -> float:
    """s E'(s), or the modulus of small waves where that is larger, at the first stretch s; with shear, both moduli."""
    if isinstance(body, ShearMembrane):
        return body.area + body.shear
    s, law = body.stretch, body.energy
    kind = getattr(law, "kind", "")
    if kind == "linear":
        return s * law.stiffness
    if kind == "quadratic":
        A, B = law.stiffness * s * (s - 1.0), law.stiffness * s * s
    else:
        A, B = float(s * law.dE(s)), float(s * s * law.ddE(s))
    return max(A, 0.0) if max(2.0 * A, 0.0) >= B else B * B / (4.0 * (B - A))


def _speed(scene: Scene) -> float:
    """Sum over the directions of the largest velocity that the scene itself names."""
    sides = [side for pair in scene.box.sides for side in pair]
    speeds = [sum(map(abs, side.velocity)) for side in sides if hasattr(side, "velocity")]
    if scene.motion:
        return scene.motion.top(scene.box.origin, scene.box.length)
    initial = scene.fluid.initial
    if initial.kind == "taylor-green":
        speeds.append(2 * abs(initial.amplitude))
    if initial.kind == "shear":
        speeds.append(abs(initial.rate) * scene.box.length[1] / 2)
    return max(speeds, default=0.0)
