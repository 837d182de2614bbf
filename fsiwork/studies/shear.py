"""The sphere of Sec. 3.6.2, sheared by (3.67), and the same with a pressure inside, as runs: radii, norms (3.68),
pressure on the axes, markers that go along, energy created, det ∇Y. `studies.shear_measures` makes numbers of them."""

import math
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

from fsiwork import simulate
from fsiwork.checkpoint import Kept
from fsiwork.core.grid import GHOSTS, Grid
from fsiwork.core.kernels.shear_survey import LEAST_DET
from fsiwork.scene import Scene

HISTORY = ("axis_x", "axis_z", "elastic_energy", "kinetic_energy", "rms_box", "rms_surface", "shear_mean",
           "volume", "Z1_max", "Z2_max")  # fmt: skip
PRESSURE = (0.1, 1.2)  # Figs 3.20, 3.21
SPEED = 0.5  # Fig. 3.19
SHOTS = tuple(0.5 * k for k in range(19))  # Fig. 3.18
STATIONS = np.linspace(0.0, 1.0, 201)
PARALLELS, MERIDIANS, AROUND = 9, 12, 49


def globe() -> np.ndarray:
    """Unit vectors of lines of constant latitude, then longitude, `AROUND` points each, shape (lines, points, 3)."""
    turn, rise = np.linspace(0, 2 * np.pi, AROUND), np.linspace(0, np.pi, AROUND)
    heights = np.pi * np.arange(1, PARALLELS + 1) / (PARALLELS + 1)
    flat = [np.stack([np.sin(p) * np.cos(turn), np.sin(p) * np.sin(turn), np.cos(p) + 0 * turn], -1) for p in heights]
    angles = 2 * np.pi * np.arange(MERIDIANS) / MERIDIANS
    up = [np.stack([np.sin(rise) * np.cos(a), np.sin(rise) * np.sin(a), np.cos(rise)], -1) for a in angles]
    return np.array(flat + up)


def twisted(points: np.ndarray, twist: float) -> np.ndarray:
    """Where (3.67) has what is at ``points`` when relaxed."""
    x, y, z = np.moveaxis(points, -1, 0)
    c, s = np.cos(twist * z), np.sin(twist * z)
    return np.stack([x * c - y * s, x * s + y * c, z], -1)


def at(grid: Grid, q: np.ndarray, points: np.ndarray, face: int | None = None, order: int = 1) -> np.ndarray:
    """A flat field at ``points`` (m, 3) by splines of an ``order``; linear ones by default."""
    where = [(points[:, a] - grid.origin[a]) / grid.h + GHOSTS - (0.0 if a == face else 0.5) for a in grid.axes]
    return map_coordinates(grid.padded(q), where, order=order, mode="nearest")


def _roundness(sim, radius: float) -> float:
    """Largest |r - radius|/radius of the surface over 500 directions, by the last zero of φ on each ray."""
    grid, body = sim.flow.grid, sim.bodies[0]
    k = np.arange(500) + 0.5
    z, turn = 1 - k / 250, np.pi * (1 + 5**0.5) * k
    rays = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], -1)
    r = np.linspace(0.5 * radius, 1.5 * radius, 201)
    phi = at(grid, body.phi, (rays[:, None] * r[:, None]).reshape(-1, 3), order=3).reshape(500, -1)
    inside = phi < 0
    last = inside.shape[1] - 1 - inside[:, ::-1].argmax(axis=1)
    if not inside.any(axis=1).all() or (last == inside.shape[1] - 1).any():
        return math.nan
    rows = np.arange(500)
    low, high = phi[rows, last], phi[rows, last + 1]
    found = r[last] + (r[1] - r[0]) * low / (low - high)
    return float(np.abs(found / radius - 1).max())


class Watched:
    """A run of one sphere and what is kept of it.

    Attributes
    ----------
    sim : the simulation
    table : name -> values at each frame; what a diverged run does not reach stays NaN
    found : markers and their speed, pressure and φ on the axes, by name and number of the moment
    """

    def __init__(self, scene: Scene):
        self.sim, spec = simulate.build(scene), scene.bodies[0]
        self.table = {name: np.full(scene.clock.frames + 1, math.nan) for name in ("t", *HISTORY, "created", "det_min")}
        self.found: dict[str, np.ndarray] = {}
        self._points = twisted(globe().reshape(-1, 3) * spec.shape.radius, spec.twist)
        self._total, self._made, self._least = math.nan, 0.0, math.inf
        self._due = [(t, f"markers_{k}", self._markers) for k, t in enumerate(SHOTS)]
        self._due += [(SPEED, "speed", self._speed), *((t, f"_{k}", self._profiles) for k, t in enumerate(PRESSURE))]
        self._due.sort(key=lambda one: one[0])

    def look(self) -> None:
        """Keep the gauges of this frame, and what is due at the first frame from a time on."""
        sim = self.sim
        row = sim.gauges()
        if sim.frame_number == 0:
            self._total = row["kinetic_energy"] + row["elastic_energy"]
        self._made += row["energy_residual"]
        self._least = min(self._least, row["det_min"])
        row |= {"created": self._made / self._total, "det_min": self._least}
        for name, values in self.table.items():
            values[sim.frame_number] = row[name]
        while self._due and sim.t >= self._due[0][0] - 1e-9:
            _, name, keep = self._due.pop(0)
            keep(name)

    def follow(self) -> None:
        """After a step: markers by the midpoint rule with the new velocity; det ∇Y."""
        halfway = self._points + 0.5 * self.sim.dt * self._velocity(self._points)
        self._points = self._points + self.sim.dt * self._velocity(halfway)
        self._least = min(self._least, float(self.sim.bodies[0].survey()[LEAST_DET]))

    def state(self) -> dict[str, np.ndarray]:
        """All that `restore` needs to go on."""
        parts = {"sim": self.sim.state(), "table": self.table, "found": self.found}
        state = {f"{part}/{name}": value for part, values in parts.items() for name, value in values.items()}
        return state | {"points": self._points, "sums": np.array([self._total, self._made, self._least])}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Go on from a `state` at a frame."""
        parts: dict[str, dict[str, np.ndarray]] = {"sim": {}, "table": {}, "found": {}}
        for key, value in state.items():
            part, _, name = key.partition("/")
            if name:
                parts[part][name] = value
        self.sim.restore(parts["sim"])
        self.table, self.found, self._points = parts["table"], parts["found"], state["points"]
        self._total, self._made, self._least = map(float, state["sums"])
        self._due = [one for one in self._due if self.sim.t < one[0] - 1e-9]

    def _velocity(self, points: np.ndarray) -> np.ndarray:
        flow = self.sim.flow
        return np.stack([at(flow.grid, q, points, face=a) for a, q in enumerate(flow.u)], -1)

    def _markers(self, name: str) -> None:
        self.found[name] = self._points.ravel()

    def _speed(self, name: str) -> None:
        self.found |= {name: np.linalg.norm(self._velocity(self._points), axis=1), "seen": self._points.ravel()}

    def _profiles(self, suffix: str) -> None:
        """Pressure and φ at `STATIONS` along x and z from the middle of the box."""
        flow, phi = self.sim.flow, self.sim.bodies[0].phi
        p = flow.grid.field()
        flow.grid.inside(p)[...] = self.sim.pressure()
        flow.edges.fill_scalar(p, "mirror")
        for name, axis in (("x", 0), ("z", 2)):
            points = np.zeros((STATIONS.size, 3))
            points[:, axis] = STATIONS
            self.found[f"p_{name}{suffix}"] = at(flow.grid, p, points)
            self.found[f"phi_{name}{suffix}"] = at(flow.grid, phi, points)


def relax(scene: Scene, point: dict[str, Any], kept: Kept | None = None) -> dict[str, Any]:
    """Run a scene with one sphere: gauges at its frames, the most energy created so far, pressure on the axes, markers;
    the largest deviation from the sphere at the end. Goes on from what ``kept`` has of an earlier try."""
    run, ended = Watched(scene), ""
    sim, spec = run.sim, scene.bodies[0]
    before = kept and kept.load()
    if before:
        run.restore(before)
    else:
        run.look()
    while sim.frame_number < scene.clock.frames and not (ended := sim.advance()):
        run.follow()
        while sim.at_frame() and sim.frame_number < scene.clock.frames:
            sim.frame_number += 1
            run.look()
            if kept:
                kept.save(run.state)
    out = run.found | {name: (("row",), values) for name, values in run.table.items()}
    away = math.nan if ended else _roundness(sim, spec.shape.radius)
    return out | {"away": away, "eps": spec.width.of(scene.box.h), "ended": ended or "complete", "n_steps": sim.steps}
