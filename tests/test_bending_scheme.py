"""A membrane that bends in the fluid: equilibrium, the stabilised step, what is refused."""

import numpy as np
import pytest
from pydantic import ValidationError

from fsiwork import scene
from fsiwork.simulate import build, frames

SCENE = {
    "box": {"length": [2.0, 2.0], "cells": 32, "edges": "walls"},
    "fluid": {"density": 1.0, "viscosity": 0.1},
    "bodies": [
        {
            "kind": "membrane",
            "shape": {"kind": "ellipse", "centre": [1.0, 1.0], "semi_axes": [0.6, 0.4]},
            "energy": {"kind": "quadratic", "stiffness": 1.0},
            "bending": 0.1,
            "width": {"cells": 4},
            "coupling": "stabilised",
        }
    ],
    "clock": {"end": 0.3, "step": 0.01, "frames": 1},
}


def made(**changes):
    body = {**SCENE["bodies"][0], **{k: v for k, v in changes.items() if k != "clock"}}
    return scene.Scene.model_validate(
        {**SCENE, "bodies": [body], "clock": {**SCENE["clock"], **changes.get("clock", {})}}
    )


def gauges(made):
    rows = {}
    for frame in frames(made):
        for name, values in frame.gauges.items():
            rows.setdefault(name, []).append(values)
    return frame.ended, {name: np.concatenate(values) for name, values in rows.items()}


def test_bending_rounds_an_ellipse_and_loses_energy():
    ended, found = gauges(made())
    assert ended == "complete"
    total = found["kinetic_energy"] + found["elastic_energy"]
    assert (np.diff(total) <= 1e-4 * total[0]).all()
    assert found["axis_x"][-1] < 0.56
    assert (found["bending_energy"] <= found["elastic_energy"]).all()
    angle = np.linspace(0, 2 * np.pi, 2001)[:-1]
    speed = np.hypot(0.6 * np.sin(angle), 0.4 * np.cos(angle))
    squares = ((0.6 * 0.4 / speed**3) ** 2 * speed).mean() * 2 * np.pi  # ∮κ²
    assert found["bending_energy"][0] == pytest.approx(0.5 * 0.1 * squares, rel=0.1)


def test_beyond_its_limit_the_explicit_step_fails_and_the_stabilised_one_does_not():
    sim = build(made(coupling="explicit"))
    step = 8 * sim.bodies[0].longest_step(sim.flow)["bending"]
    found = {c: gauges(made(coupling=c, clock={"step": step})) for c in ("explicit", "stabilised")}
    energies = {c: g["kinetic_energy"] + g["elastic_energy"] for c, (_, g) in found.items()}
    assert not energies["explicit"].max() < 1.1 * energies["explicit"][0]
    assert energies["stabilised"].max() < 1.01 * energies["stabilised"][0]


@pytest.mark.parametrize("viscosity", [0.001, 10.0])
def test_the_stabilised_step_serves_two_viscosities(viscosity):
    """A hundred times less or more inside, eight times the explicit step: it rounds, and gains no energy."""
    inside = {"inside": {"density": 1.0, "viscosity": viscosity}}
    sim = build(made(coupling="explicit"))
    step = 8 * sim.bodies[0].longest_step(sim.flow)["bending"]
    ended, found = gauges(made(**inside, clock={"step": step}))
    assert ended == "complete"
    total = found["kinetic_energy"] + found["elastic_energy"]
    assert total.max() <= total[0]
    assert total[-1] < 0.99 * total[0]


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"bending": -1.0}, "bodies.0.bending: must not be negative, got -1"),
        ({"coupling": "iterated"}, "bodies.0.coupling: with bending it must be explicit"),
        ({"inside": {"density": 2.0, "viscosity": 0.1}}, "bodies.0.coupling: with bending and another density"),
        ({"surface_mass": 1.0}, "bodies.0.coupling: with bending and a surface mass it must be explicit"),
    ],
)
def test_what_does_not_fit_is_said(changes, fault):
    with pytest.raises(ValidationError) as caught:
        made(**changes)
    assert any(line.startswith(fault) for line in scene.faults(caught.value)), scene.faults(caught.value)
