"""The stabilised scheme for membranes with shear, which the book leaves open (its Sec. 7.5): the explicit limit, how
far the stabilised step is stable, what it costs and what it loses."""

import math
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from fsiwork.bodies.shear import LIMIT, REFRESH, STABILISER
from fsiwork.core import energy
from fsiwork.core.kernels import shear_survey as surveys
from fsiwork.scene import Scene
from fsiwork.simulate import Simulation, build, step
from fsiwork.studies import stability

RAISED = 1.1  # a run whose energy rises above this many times the first is unstable (MEASURED-coupling 6)
EXPLICIT, STABILISED = 60, 30  # steps that an explicit and a stabilised run have to survive at least
MULTIPLES = np.array([1.0, 10.0, 30.0, 100.0])  # of the explicit limit
LENGTHS = np.array([0.25, 0.5, 1.0, 2.0])  # √c_s Δt over ε, the length over which the stabiliser smooths
MEASURED = {0.5: 5.0, 1.0: 15.0, 2.0: 30.0}  # errors at these, percent (MEASURED-coupling 6)
REFERENCE = 4  # the explicit reference takes that many steps for one at the limit
ROWS = 60  # times at which the kinetic energy is kept


class Run:
    """A scene's sphere under way with one of both couplings; its energies after each step."""

    def __init__(self, scene: Scene, coupling: str):
        body = scene.bodies[0].model_copy(update={"coupling": coupling})
        self.sim: Simulation = build(scene.model_copy(update={"bodies": (body,)}))
        self.t, self.steps, self.rows = 0.0, 0, []
        self.note()

    def note(self) -> None:
        """Keep t, kinetic energy and all energy of this moment."""
        kinetic = energy.kinetic_energy(self.sim.flow)
        self.rows.append((self.t, kinetic, kinetic + float(self.sim.bodies[0].survey()[surveys.ENERGY])))

    @property
    def unit(self) -> float:
        """Δx √(ρε/M) now, M the largest modulus of small waves over the band [time]."""
        body, flow = self.sim.bodies[0], self.sim.flow
        return flow.grid.h * math.sqrt(flow.density * body.eps / float(body.survey()[surveys.STIFF]))

    def go(self, dt: float) -> bool:
        """One step; whether the energy still is below `RAISED` times the first."""
        step(self.sim.flow, self.sim.bodies, dt)
        self.steps, self.t = self.steps + 1, self.t + dt
        self.note()
        return bool(self.rows[-1][2] <= RAISED * self.rows[0][2])  # false for NaN

    def until(self, dt: float, end: float, least: int = 1) -> "Run":
        """Equal steps to ``end``, or ``least`` of them, as long as it is stable; then the simulation is let go."""
        count = max(math.ceil(end / dt - 1e-9), least)
        while self.steps < count and self.go(dt):
            pass
        del self.sim
        return self

    @property
    def stable(self) -> bool:
        """Whether the energy stayed below."""
        return max(row[2] for row in self.rows) <= RAISED * self.rows[0][2]

    def kinetic(self, times: np.ndarray) -> np.ndarray:
        """Kinetic energy at ``times``, beyond the last one NaN."""
        t, kinetic, _ = np.array(self.rows).T
        return np.interp(times, t, kinetic, right=math.nan)


def survives(scene: Scene, multiple: float) -> tuple[bool, int]:
    """Whether the explicit run is stable with Δt = ``multiple`` Δx√(ρε/M), M that of each moment; its steps."""
    run = Run(scene, "explicit")
    while run.t < scene.clock.end or run.steps < EXPLICIT:
        if not run.go(multiple * run.unit):
            return False, run.steps
    return True, run.steps


def costs(scene: Scene, dt: float, rounds: int = 4) -> dict[str, float]:
    """CPU seconds a step of both couplings in turn: least mean over `REFRESH` steps, a look at M among them."""
    runs = {c: Run(scene, c).sim for c in ("explicit", "stabilised")}
    least = dict.fromkeys(runs, math.inf)
    for _ in range(rounds):
        for coupling, sim in runs.items():
            before = time.thread_time()
            for _ in range(REFRESH):
                step(sim.flow, sim.bodies, dt)
            least[coupling] = min(least[coupling], (time.thread_time() - before) / REFRESH)
    return {f"seconds_{coupling}": seconds for coupling, seconds in least.items()}


def coupled(scene: Scene, point: dict[str, Any]) -> dict[str, Any]:
    """The explicit ``limit`` over Δx√(ρε/M) to 5 % by bisection; by `MULTIPLES` of 2.8 of the stabilised coupling the
    most ``energy`` over the first; by `LENGTHS` the kinetic energy over time; CPU seconds a step of both."""
    taken = 0

    def stable(multiple: float) -> bool:
        nonlocal taken
        good, steps = survives(scene, multiple)
        taken += steps
        return good

    found, end = stability.limit(stable, LIMIT, largest=20.0, tolerance=0.05), scene.clock.end
    unit = Run(scene, "explicit").unit
    h, eps = scene.box.h, scene.bodies[0].width.of(scene.box.h)
    far = [Run(scene, "stabilised").until(q * LIMIT * unit, end, STABILISED) for q in MULTIPLES]
    steps = LENGTHS * eps / h * unit / math.sqrt(STABILISER)
    times = np.linspace(0, end, ROWS)
    exact = Run(scene, "explicit").until(LIMIT * unit / REFERENCE, end)
    both = {c: [Run(scene, c).until(dt, end) for dt in steps] for c in ("explicit", "stabilised")}
    runs = [*far, exact, *both["explicit"], *both["stabilised"]]
    return {
        "limit": found.step if found.found == 1 else math.nan,
        "energy": (("multiple",), np.array([max(r[2] for r in run.rows) / run.rows[0][2] for run in far])),
        "t": (("time",), times),
        "kinetic": (("time",), exact.kinetic(times)),
        **{
            f"kinetic_{c}_{k}": (("time",), run.kinetic(times) if run.stable else np.full(ROWS, math.nan))
            for c, many in both.items()
            for k, run in enumerate(many)
        },
        **costs(scene, steps[0]),
        "n_steps": taken + sum(run.steps for run in runs),
        "n_cells": scene.box.cells,
    }


def errors(one: xr.Dataset, coupling: str) -> np.ndarray:
    """By `LENGTHS`, largest deviation of the kinetic energy from the reference's, percent of its most. NaN:
    unstable."""
    runs = np.array([one[f"kinetic_{coupling}_{k}"].values for k in range(LENGTHS.size)])
    exact = one["kinetic"].values
    return 100 * np.abs(runs - exact).max(axis=1) / exact.max()


def measure(datasets: Mapping[str, xr.Dataset]) -> dict[str, float]:
    """By start: explicit limit over 2.8, least and most of the grids; largest multiple up to which all are stable;
    errors of both couplings by the step on the finest grid, and their ratio at ¼ ε; cost of a stabilised step over an
    explicit one."""
    data = datasets["coupling_shear"]
    out = {"cost": float((data["seconds_stabilised"] / data["seconds_explicit"]).max())}
    finest = data["cells"].max()
    for start in data["start"].values:
        one = data.sel(start=start)
        ratio = one["limit"] / LIMIT
        out[f"limit_least_{start}"] = float(ratio.min(skipna=False))
        out[f"limit_most_{start}"] = float(ratio.max(skipna=False))
        good = np.cumprod((one["energy"] <= RAISED).all("cells").values).astype(bool)
        out[f"stable_{start}"] = float(MULTIPLES[good].max()) if good.any() else 0.0
        for coupling in ("explicit", "stabilised"):
            found = errors(one.sel(cells=finest), coupling)
            out |= {f"error_{coupling}_{start}_{q:g}": float(e) for q, e in zip(LENGTHS, found, strict=True)}
        out[f"loss_{start}"] = out[f"error_stabilised_{start}_0.25"] / out[f"error_explicit_{start}_0.25"]
    out["stable"] = min(out[f"stable_{start}"] for start in data["start"].values)
    return out


def rows(datasets: Mapping[str, xr.Dataset], measured: Mapping[str, float]) -> tuple[list[str], list[list]]:
    """A row for each start and grid."""
    data = datasets["coupling_shear"]
    header = ["start", "N", "limit over Δx√(ρε/M)", "energy over the first, 100 times the limit"]
    header += [f"error of {c}, % at {q:g} ε" for c in ("explicit", "stabilised") for q in LENGTHS]
    table = []
    for start in data["start"].values:
        for n in data["cells"].values:
            one = data.sel(start=start, cells=n)
            found = [round(float(e), 1) for c in ("explicit", "stabilised") for e in errors(one, c)]
            cells = [str(start), int(n), round(float(one["limit"]), 2), round(float(one["energy"][-1]), 3)]
            table.append([*cells, *("unstable" if math.isnan(e) else e for e in found)])
    return header, table
