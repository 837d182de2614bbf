"""What a run's file holds: the variables with their names, units and places, and the dimensions of the grid."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

DIRECTIONS = "xyz"


@dataclass(frozen=True)
class Variable:
    """One variable of a file: what it is, where it sits on the grid (or ``step``, ``frame``), and its unit."""

    long_name: str
    position: str
    units: str = "1"


VARIABLES = {
    "t": Variable("time of a frame", "frame"),
    "t_step": Variable("time at the end of a step", "step"),
    "u": Variable("velocity along x", "face x"),
    "v": Variable("velocity along y", "face y"),
    "w": Variable("velocity along z", "face z"),
    "p": Variable("pressure, with mean zero", "centre"),
    "phi": Variable("level-set function, negative inside", "centre"),
    "rho": Variable("density", "centre"),
    "mu": Variable("dynamic viscosity", "centre"),
    "vorticity": Variable("vorticity", "centre"),
    "Y": Variable("backward map: where a point came from", "centre"),
    "contour_x": Variable("interface, coordinate x", "point"),
    "contour_y": Variable("interface, coordinate y", "point"),
    "contour_piece": Variable("number of the curve within its frame", "point"),
    "contour_count": Variable("number of points of the interface in a frame", "frame"),
    "dt": Variable("length of the step in time", "step"),
    "volume": Variable("volume (2D: area) inside the interface", "step"),
    "length": Variable("length (3D: area) of the interface", "step"),
    "geometric_volume": Variable("volume (2D: area) inside the interface by height functions", "step"),
    "geometric_area": Variable("area of the interface by height functions", "step"),
    "geometric_length": Variable("length of the interface by height functions", "step"),
    "bending_energy": Variable("elastic energy of bending, a part of elastic_energy", "step"),
    "axis_x": Variable("half of the extent of the interface along x", "step"),
    "axis_y": Variable("half of the extent of the interface along y", "step"),
    "axis_z": Variable("half of the extent of the interface along z", "step"),
    "centroid_x": Variable("centre of the inside, coordinate x", "step"),
    "centroid_y": Variable("centre of the inside, coordinate y", "step"),
    "centroid_z": Variable("centre of the inside, coordinate z", "step"),
    "stretch_min": Variable("smallest stretch of the interface", "step"),
    "stretch_max": Variable("largest stretch of the interface", "step"),
    "kinetic_energy": Variable("kinetic energy", "step"),
    "elastic_energy": Variable("elastic energy", "step"),
    "dissipation": Variable("rate of viscous dissipation", "step"),
    "power": Variable("rate of work of gravity, walls and inflow", "step"),
    "energy_residual": Variable("energy that the balance missed since the row before", "step"),
    "momentum_x": Variable("momentum along x", "step"),
    "momentum_y": Variable("momentum along y", "step"),
    "momentum_z": Variable("momentum along z", "step"),
    "max_divergence": Variable("largest divergence of the velocity", "step"),
    "ended": Variable("how the run ended", "point of a study"),
    "scene": Variable("scene of the run", "point of a study"),
    "max_speed": Variable("largest speed", "step"),
}


def described(name: str) -> dict[str, str]:
    """``long_name`` and ``units`` of a variable; a name that is not in the table describes itself."""
    entry = VARIABLES.get(name) or Variable(name.replace("_", " "), "")
    return {"long_name": entry.long_name, "units": entry.units}


@dataclass(frozen=True)
class Geometry:
    """Cells, side of a cell [length], low corner [length] and periodicity in the directions x, y[, z]."""

    n: tuple[int, ...]
    h: float
    origin: tuple[float, ...]
    periodic: tuple[bool, ...]

    @property
    def dim(self) -> int:
        return len(self.n)

    def coordinates(self) -> dict[str, np.ndarray]:
        """Centres ``x_c`` and faces ``x_n`` in each direction; a periodic one has as many faces as centres."""
        found = {}
        for a, name in enumerate(DIRECTIONS[: self.dim]):
            found[f"{name}_c"] = self.origin[a] + (np.arange(self.n[a]) + 0.5) * self.h
            found[f"{name}_n"] = self.origin[a] + np.arange(self.n[a] + (not self.periodic[a])) * self.h
        return found

    def dims(self, face: int | None) -> tuple[str, ...]:
        """Dimensions of a field in the order of the file, ``(z, y, x)``; ``face`` is the direction of its faces."""
        return tuple(f"{DIRECTIONS[a]}_{'n' if a == face else 'c'}" for a in reversed(range(self.dim)))

    def grid_attributes(self) -> dict[str, Any]:
        """Attributes of the scalar ``grid`` variable (SGRID 0.3)."""
        names = DIRECTIONS[: self.dim]
        cells = " ".join(
            f"{name}_c: {name}_n (padding: {'high' if periodic else 'none'})"
            for name, periodic in zip(names, self.periodic, strict=True)
        )
        return {
            "long_name": "topology of the staggered grid",
            "cf_role": "grid_topology",
            "topology_dimension": np.int32(self.dim),
            "node_dimensions": " ".join(f"{name}_n" for name in names),
            "face_dimensions" if self.dim == 2 else "volume_dimensions": cells,
        }

    def location(self, face: int | None) -> str:
        """SGRID's word for where a field sits."""
        if face is None:
            return "face" if self.dim == 2 else "volume"
        return f"{'edge' if self.dim == 2 else 'face'}{face + 1}"


def plain(scene: Any) -> dict[str, Any]:
    """The scene as plain data (of a pydantic model, a mapping, or JSON text)."""
    if hasattr(scene, "model_dump"):
        return scene.model_dump(mode="json")
    return json.loads(scene) if isinstance(scene, str) else dict(scene)


def geometry(scene: Any) -> Geometry:
    """The grid of a scene: ``cells`` along the longest side, square cells."""
    box = plain(scene)["box"]
    length = box["length"]
    h = max(length) / box["cells"]
    return Geometry(
        n=tuple(round(side / h) for side in length),
        h=h,
        origin=tuple(box.get("origin") or (0.0,) * len(length)),
        periodic=tuple(_periodic(box.get("edges", "walls"), a) for a in range(len(length))),
    )


def _periodic(edges: Any, a: int) -> bool:
    if isinstance(edges, dict):
        edges = edges.get("kind") or edges.get(DIRECTIONS[a], "walls")
    elif isinstance(edges, list | tuple):
        edges = edges[a]
    while isinstance(edges, list | tuple):
        edges = edges[0]
    return (edges.get("kind") if isinstance(edges, dict) else edges) == "periodic"


def arranged(fields: dict, grid: Geometry) -> dict[str, tuple[tuple[str, ...], int | None, np.ndarray]]:
    """Fields of a frame in the order of the file: ``name -> (dims, face, values)``, ``values`` contiguous.

    Keys are names, or ``(name, body)`` for the fields of several bodies, which get a dimension ``body``; values are
    ``(face direction or None, array)`` with the array's axes ``([body,] x, y[, z])``. The components ``Y_x``, ``Y_y``
    … become one variable with a dimension ``component``.
    """
    groups: dict[str, list] = {}
    for key, (face, values) in fields.items():
        name, body = key if isinstance(key, tuple) else (key, 0)
        groups.setdefault(name, []).append((body, _direction(face), values))
    ready: dict[str, tuple] = {}
    for name, group in groups.items():
        group.sort(key=lambda item: item[0])
        face = group[0][1]
        values = np.stack([item[2] for item in group]) if len(group) > 1 else group[0][2]
        axes = tuple(reversed(range(values.ndim - grid.dim, values.ndim)))
        values = np.transpose(values, tuple(range(values.ndim - grid.dim)) + axes)
        ready[name] = (("body",) * (values.ndim - grid.dim) + grid.dims(face), face, values)
    return {name: (dims, face, np.ascontiguousarray(q)) for name, (dims, face, q) in _joined(ready, grid).items()}


def _direction(face: Any) -> int | None:
    if isinstance(face, tuple):
        face = face[0] if face else None
    return DIRECTIONS.index(face) if isinstance(face, str) else face


def _joined(ready: dict, grid: Geometry) -> dict:
    parts = [f"Y_{name}" for name in DIRECTIONS[: grid.dim]]
    if not all(part in ready for part in parts):
        return ready
    dims, face, first = ready[parts[0]]
    axis = first.ndim - grid.dim
    stacked = np.stack([ready[part][2] for part in parts], axis=axis)
    rest = {name: value for name, value in ready.items() if name not in parts}
    return rest | {"Y": ((*dims[:axis], "component", *dims[axis:]), face, stacked)}


def contour(phi: np.ndarray, grid: Geometry) -> dict[str, np.ndarray]:
    """Points of the line φ = 0 of a plane field in the file's order, shape ``([body,] n_y, n_x)``.

    Returns ``x``, ``y`` [length] and ``piece``, the number of the curve that a point belongs to. Several bodies
    count as their union. Nothing where the field is not finite.
    """
    if phi.ndim > 2:
        phi = phi.min(axis=0)
    lines = []
    if np.isfinite(phi).all():
        from contourpy import contour_generator

        wrap = [(0, int(p)) for p in reversed(grid.periodic)]
        x, y = (grid.origin[a] + (np.arange(grid.n[a] + grid.periodic[a]) + 0.5) * grid.h for a in (0, 1))
        lines = contour_generator(x, y, np.pad(phi, wrap, mode="wrap"), name="serial").lines(0.0)
    points = np.concatenate([*lines, np.zeros((0, 2))])
    piece = np.repeat(np.arange(len(lines), dtype=np.int32), [len(line) for line in lines])
    return {"x": points[:, 0].copy(), "y": points[:, 1].copy(), "piece": piece}
