"""From a scene to states: `build`, `step`, `frames`. Files, progress and tests are consumers of the states."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from fsiwork.bodies.body import Body
from fsiwork.bodies.interface import measures
from fsiwork.build import parts
from fsiwork.core import energy
from fsiwork.core.flow import Flow
from fsiwork.core.grid import Grid
from fsiwork.core.motion import Motion
from fsiwork.core.poisson import NotConverged
from fsiwork.scene import Scene

RUNAWAY = 100.0  # a velocity that crosses this many cells a step has diverged


def step(flow: Flow, bodies: tuple[Body, ...], dt: float) -> None:
    """Advance one Δt: (3.62)-(3.64) for elastic bodies."""
    flow.begin()  # ρ, μ of the fluid; nothing else acts
    for body in bodies:
        body.blend(flow, dt)  # ρ, μ of the mixture                       (3.19)
    for body in bodies:
        body.push(flow, dt)  # F[φ̃]; stiffness of the predictor          (3.62), (3.63)
    for body in bodies:
        body.hold(flow, dt)  # drag towards a given velocity, source
    flow.predict(dt)  # advection, forces; diffusion                      (3.63)
    flow.project(dt)  # div(Δt ∇p/ρ) = div u                              (3.63)
    for body in bodies:
        body.move(flow, dt)  # φ or Y carried by the new velocity         (3.64)


def carry(motion: Motion, bodies: tuple[Body, ...], dt: float) -> None:
    """Advance one Δt with a prescribed velocity."""
    motion.begin(dt)  # its mean over the step
    for body in bodies:
        body.move(motion, dt)
    motion.end(dt)


def iterate(flow: Flow, bodies: tuple[Body, ...], dt: float, times: int) -> None:
    """One step in several passes: forces at the last pass's interface, stabiliser on the difference to its velocity."""
    before = flow.state(), [body.state() for body in bodies]
    for sweep in range(times):
        if sweep:
            flow.guess = [q.copy() for q in flow.u]
            guesses = [body.state() for body in bodies]
            flow.restore(before[0])
            for body, state, guess in zip(bodies, before[1], guesses, strict=True):
                body.restore(state)
                body.guess = guess
        step(flow, bodies, dt)
    flow.guess = None
    for body in bodies:
        body.guess = None


def longest_step(flow: Flow | Motion, bodies: tuple[Body, ...]) -> dict[str, float]:
    """Every limit on Δt by name [time]; infinite where nothing limits."""
    limits = flow.longest_step() if isinstance(flow, Motion) else _of_flow(flow)
    for body in bodies:
        for name, limit in body.longest_step(flow).items():
            limits[name] = min(limit, limits.get(name, math.inf))
    return limits


def _of_flow(flow: Flow) -> dict[str, float]:
    h, dim = flow.grid.h, flow.grid.dim
    sides = [side.velocity for pair in flow.edges.sides for side in pair if side.velocity]
    speed = sum(max(flow.largest(u), *(abs(v[a]) for v in sides), 0.0) for a, u in enumerate(flow.u))
    limits = {"advective": 0.5 * h / speed if speed > 0.0 else math.inf}
    if flow.theta == 0.0 and flow.viscosity > 0.0:
        limits["viscous"] = h**2 * flow.density / (4 * dim * flow.viscosity)  # AB2 ends at -1 on the real axis
    return limits


@dataclass(frozen=True)
class Frame:
    """One moment of a run.

    ``fields``: name -> (face axis or None for centres, interior array with axes x, y[, z]); ``gauges``: one row a step
    since the frame before; ``state()``: all that the next step reads; ``ended``: "" while the run goes on.
    """

    t: float
    step: int
    fields: dict[str, tuple[int | None, np.ndarray]]
    gauges: dict[str, np.ndarray]
    state: Callable[[], dict[str, np.ndarray]] = field(repr=False)
    ended: str = ""


class Simulation:
    """A scene under way: flow (or a prescribed motion), bodies and clock."""

    def __init__(self, scene: Scene, flow: Flow | Motion, bodies: tuple[Body, ...]):
        self.scene, self.flow, self.bodies = scene, flow, bodies
        self.passes = max((body.passes for body in bodies), default=1)
        clock = scene.clock
        self.automatic = clock.step == "auto"
        self.total = 0 if self.automatic else max(1, math.ceil(clock.end / clock.step - 1e-9))
        self.t, self.steps, self.frame_number = 0.0, 0, 0
        self.rows: list[dict[str, float]] = []
        self.limits: dict[str, float] = {}
        self._before: dict[str, float] = {}  # energies at the last gauge
        self.dt = 0.0 if self.automatic else clock.end / self.total

    @property
    def frame_time(self) -> float:
        """Time of the next frame."""
        return self.scene.clock.end * ((self.frame_number + 1) / self.scene.clock.frames)

    def advance(self) -> str:
        """One step; returns why the run has diverged, or nothing."""
        left = 0  # steps to the next frame, as far as one knows
        if self.automatic:
            self.limits = longest_step(self.flow, self.bodies)
            rest, longest = self.frame_time - self.t, self.scene.clock.safety * min(self.limits.values())
            left = max(1, math.ceil(rest / longest - 1e-9)) if longest > 0.0 else 1
            self.dt = rest / left
        try:
            if isinstance(self.flow, Motion):
                carry(self.flow, self.bodies, self.dt)
            elif self.passes > 1:
                iterate(self.flow, self.bodies, self.dt, self.passes)
            else:
                step(self.flow, self.bodies, self.dt)
        except NotConverged as error:
            return self._obituary(str(error))
        self.steps += 1
        if not self.automatic:
            self.t = self.scene.clock.end * (self.steps / self.total)
        else:
            self.t = self.frame_time if left == 1 else self.t + self.dt
        fault = self._guard()
        if not fault:
            self._blend()
        return fault

    def _blend(self) -> None:
        """ρ and μ of this moment, for those who look: the step used those of its beginning."""
        if self.flow.rho is not None or self.flow.mu is not None:
            self.flow.begin()
            for body in self.bodies:
                body.blend(self.flow, 0.0)

    def at_frame(self) -> bool:
        """Whether the next frame is due."""
        if self.automatic:
            return self.t >= self.frame_time
        return self.steps >= round(self.total * (self.frame_number + 1) / self.scene.clock.frames)

    def gauges(self) -> dict[str, float | list[float]]:
        """Numbers of this moment: of a flow energies, power and residual of (3.23) since the last call, and what bodies
        measure."""
        fluid, answers = isinstance(self.flow, Flow), [self._of(body) for body in self.bodies]
        row = {"t": self.t, "dt": self.dt} | (_energies(self.flow) if fluid else {})
        for name in dict.fromkeys(name for answer in answers for name in answer):
            values = [answer.get(name, math.nan) for answer in answers]
            row[name] = values[0] if len(values) == 1 else values
        stored = sum(answer.get("elastic_energy", 0.0) for answer in answers)
        return self._balanced(row, stored) if fluid else row

    def _of(self, body: Body) -> dict[str, float]:
        """What a body measures, and its volume and area by height functions if the scene asks for them."""
        row, phi = body.gauges(self.flow), body.fields().get("phi")
        if not self.scene.output.geometric or phi is None:
            return row
        return row | {f"geometric_{name}": value for name, value in measures(self.flow.grid, phi).items()}

    def _balanced(self, row: dict, stored: float) -> dict:
        """The row with the residual of (3.23); ``stored``: elastic energy of all bodies."""
        total = row["kinetic_energy"] + stored
        gain = row["power"] - row["dissipation"]
        was = self._before
        row["energy_residual"] = total - was["total"] - 0.5 * (self.t - was["t"]) * (gain + was["gain"]) if was else 0.0
        self._before = {"t": self.t, "total": total, "gain": gain}
        return row

    def pressure(self) -> np.ndarray:
        """Pressure of this moment, interior array, mean zero: that of the book's form of the forces, which leaves out
        what is a gradient in the form in use (`Body.potential`)."""
        p = self.flow.pressure()
        for body in self.bodies:
            extra = body.potential()
            p = p if extra is None else p - extra
        return p - p.mean()

    def fields(self, names: tuple[str, ...]) -> dict[str, tuple[int | None, np.ndarray]]:
        """Copies of the named fields (``u`` is the whole velocity) without ghosts."""
        g, flow, found = self.flow.grid, self.flow, {}
        velocity = dict(zip("uvw", g.axes, strict=False))
        wanted = [n for name in names for n in (list(velocity)[: g.dim] if name == "u" else [name])]
        answers = [body.fields() for body in self.bodies]
        for name in dict.fromkeys(wanted):
            if name in velocity:
                a = velocity[name]
                found[name] = a, g.inside(flow.u[a], None if flow.edges.periodic(a) else a).copy()
            elif name == "p":
                found[name] = None, self.pressure()
            elif name in ("rho", "mu"):
                q = getattr(flow, name)
                constant = flow.density if name == "rho" else flow.viscosity
                found[name] = None, np.full(g.n, constant) if q is None else g.inside(q).copy()
            elif name == "vorticity":
                found[name] = None, vorticity(flow)
            else:
                found |= _of_bodies(name, answers, g)
        return found

    def state(self) -> dict[str, np.ndarray]:
        """All that the next step reads; `restore` goes on from it bit for bit."""
        state = {f"flow.{k}": v for k, v in self.flow.state().items()}
        for i, body in enumerate(self.bodies):
            state |= {f"body{i}.{k}": v for k, v in body.state().items()}
        clock = [self.t, self.steps, self.frame_number, self.dt]
        before = [self._before.get(k, math.nan) for k in ("t", "total", "gain")]
        state |= {"clock": np.array(clock), "before": np.array(before)}
        state |= {f"limit.{k}": np.array(v) for k, v in self.limits.items()}
        return state | {f"row.{k}": v for k, v in _columns(self.rows).items()}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a `state`."""
        self.flow.restore(_part(state, "flow."))
        for i, body in enumerate(self.bodies):
            body.restore(_part(state, f"body{i}."))
        self._blend()
        self.t, self.steps, self.frame_number, self.dt = (
            kind(x) for kind, x in zip(KINDS, state["clock"], strict=True)
        )
        if not np.isnan(state["before"]).any():
            self._before = dict(zip(("t", "total", "gain"), map(float, state["before"]), strict=True))
        self.limits = {k: float(v) for k, v in _part(state, "limit.").items()}
        columns = _part(state, "row.")
        length = len(next(iter(columns.values()))) if columns else 0
        self.rows = [{k: v[i] for k, v in columns.items()} for i in range(length)]

    def frame(self, ended: str = "", names: tuple[str, ...] | None = None) -> Frame:
        """The present moment; empties the rows of gauges unless the run was only stopped."""
        stopped = ended.startswith("stopped")
        gauges = {} if stopped else _columns(self.rows)
        if not stopped:
            self.rows = []
        return Frame(self.t, self.steps, self.fields(names or self.scene.output.fields), gauges, self.state, ended)

    def _guard(self) -> str:
        """Look at velocity and bodies every step."""
        g = self.flow.grid
        if not all(self.flow.largest(u) * self.dt <= RUNAWAY * g.h for u in self.flow.u):  # false for NaN
            return self._obituary(_worst(dict(zip("uvw", map(g.inside, self.flow.u), strict=False))))
        for body in self.bodies:
            for name, q in body.fields().items():
                if not math.isfinite(q.sum()):
                    return self._obituary(_worst({name: g.inside(q)}))
        return ""

    def _obituary(self, reason: str) -> str:
        """When, where and why: ``diverged at t=… (step …): |u| = inf at cell (3, 7); Δt = … exceeds …``."""
        broken = [f"{name} {limit:.3g}" for name, limit in self.limits.items() if self.dt > limit]
        why = f"Δt = {self.dt:.3g} exceeds {', '.join(broken)}" if broken else "no known limit was exceeded"
        return f"diverged at t={self.t:.6g} (step {self.steps}): {reason}; {why}"


KINDS = (float, int, int, float)


def frames(
    scene: Scene, resume: dict[str, np.ndarray] | None = None, max_seconds: float | None = None
) -> Iterator[Frame]:
    """Run a scene: the frame at t = 0, then ``clock.frames`` more; the last one says how the run ended.

    ``resume`` is a `Frame.state` of an earlier run: the frames after it follow, bit for bit the same. With
    ``max_seconds`` the run may end as ``stopped at t=…``; its frame then only serves to go on from.
    """
    began = time.monotonic()
    sim = build(scene)
    if resume is not None:
        sim.restore(resume)
    else:
        sim.rows.append(sim.gauges())
        yield sim.frame()
    while sim.frame_number < scene.clock.frames:
        if max_seconds is not None and time.monotonic() - began > max_seconds:
            yield sim.frame(f"stopped at t={sim.t:.6g} (step {sim.steps}): the time allowed is over")
            return
        if not sim.automatic and sim.steps % 16 == 0:
            sim.limits = longest_step(sim.flow, sim.bodies)
        died = sim.advance()
        if died:
            yield Frame(sim.t, sim.steps, {}, _columns(sim.rows), sim.state, died)
            return
        due = sim.at_frame()
        if due or sim.steps % scene.output.gauges_every == 0:
            sim.rows.append(sim.gauges())
        if due:
            while sim.at_frame() and sim.frame_number < scene.clock.frames:  # two at once: more frames than steps
                sim.frame_number += 1
            yield sim.frame("complete" if sim.frame_number == scene.clock.frames else "")


def build(scene: Scene) -> Simulation:
    """A scene at t = 0."""
    flow, bodies = parts(scene)
    for body in bodies:
        body.blend(flow, 0.0)
    return Simulation(scene, flow, bodies)


def _energies(flow: Flow) -> dict[str, float]:
    kinetic, dissipation = energy.kinetic_energy(flow), energy.dissipation(flow)
    return {"kinetic_energy": kinetic, "dissipation": dissipation, "power": energy.power(flow)}


def vorticity(flow: Flow | Motion) -> np.ndarray:
    """∂_x v - ∂_y u at centres (in 3D the z component), interior array [1/time]."""
    g, h = flow.grid, flow.grid.h
    u, v = g.padded(flow.u[0]), g.padded(flow.u[1])
    curl = ((v - np.roll(v, 1, 0)) - (u - np.roll(u, 1, 1))) / h  # on the low corner
    corners = curl + np.roll(curl, -1, 0)
    return g.inside(0.25 * (corners + np.roll(corners, -1, 1))).copy()


def _worst(fields: dict[str, np.ndarray]) -> str:
    """The largest value of some fields, and the cell where it is; what is no number counts as infinite."""
    sizes = {name: np.where(np.isnan(q), np.inf, np.abs(q)) for name, q in fields.items()}
    name = max(sizes, key=lambda key: sizes[key].max())
    cell = np.unravel_index(int(sizes[name].argmax()), sizes[name].shape)
    return f"|{name}| = {sizes[name].max():.3g} at cell ({', '.join(str(int(k)) for k in cell)})"


def _of_bodies(name: str, answers: list[dict], grid: Grid) -> dict[str | tuple[str, int], tuple[None, np.ndarray]]:
    """Copies of a field of the bodies (Y with its components), keyed with the body's number when there are several."""
    found = {}
    for number, answer in enumerate(answers):
        for key, q in answer.items():
            if key == name or (name == "Y" and key.startswith("Y_")):
                found[key if len(answers) == 1 else (key, number)] = None, grid.inside(q).copy()
    return found


def _part(state: dict[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    return {k.removeprefix(prefix): v for k, v in state.items() if k.startswith(prefix)}


def _columns(rows: list[dict]) -> dict[str, np.ndarray]:
    return {k: np.array([row[k] for row in rows]) for k in rows[0]} if rows else {}
