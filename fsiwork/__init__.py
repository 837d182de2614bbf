"""Level-set fluid-structure interaction that anybody can run, check and trust.

The public surface, loaded when it is first used: the specs of a scene (`Scene`, `Box`, `Fluid`, `Membrane`, …),
`load` for one in YAML, `run` to simulate it, `open_run` and `open_study` to read what was written.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fsiwork.dataset import open_run, open_study
    from fsiwork.running import run
    from fsiwork.scene import Scene, load

_PLACES = {"run": "running", "open_run": "dataset", "open_study": "dataset"}
_SPECS = (
    "Ball", "Block", "Box", "Capsule", "Cassini", "Clock", "Edges", "Ellipsoid", "Fluid", "FreeSlip",
    "Inflow", "Inside", "Intersection", "Law", "Linear", "Membrane", "Minus", "Moved", "NoSlip", "Outflow",
    "Output", "Periodic", "Polygon", "Quadratic", "Rest", "Scene", "SceneError", "Shear", "Slot",
    "TaylorGreen", "Torus", "Transport", "Union", "Wall", "Width", "load",
)  # fmt: skip
_PLACES |= dict.fromkeys(_SPECS, "scene")

__all__ = ["Scene", "load", "open_run", "open_study", "run"]


def __getattr__(name: str):
    if name not in _PLACES:
        raise AttributeError(f"module 'fsiwork' has no attribute {name!r}")
    return getattr(import_module(f"fsiwork.{_PLACES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_PLACES})
