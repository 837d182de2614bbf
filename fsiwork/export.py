"""Runs for ParaView: one VTK image a frame, with everything at cell centres, and a series that names their times."""

from pathlib import Path
from typing import Any

import numpy as np

from fsiwork.layout import DIRECTIONS

VELOCITY = "uvw"


def export(ds: Any, folder: str | Path) -> Path:
    """Write a run as ``frame_NNNNN.vti`` and ``run.pvd`` into ``folder``; returns the path of the series.

    Scalars at cell centres are written as they are, the velocity as the mean of the two faces of each cell, for
    plane runs with a third component of zero. Raises OSError when the folder cannot be written.
    """
    from pyevtk.hl import imageToVTK
    from pyevtk.vtk import VtkGroup

    folder = Path(folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    dim = sum(f"{d}_c" in ds.dims for d in DIRECTIONS)
    names = DIRECTIONS[:dim]
    h = float(ds.x_c[1] - ds.x_c[0])
    corner = [float(ds[f"{d}_n"][0]) for d in names] + [0.0] * (3 - dim)
    series = VtkGroup(str(folder / "run"))
    for k, t in enumerate(ds.t.values):
        name = str(folder / f"frame_{k:05d}")
        imageToVTK(name, origin=tuple(corner), spacing=(h, h, h), cellData=_cells(ds.isel(t=k), names))
        series.addFile(f"{name}.vti", float(t))
    series.save()
    return folder / "run.pvd"


def _cells(frame: Any, names: str) -> dict[str, Any]:
    """Arrays at cell centres with the axes (x, y, z), as VTK wants them; one for each body and each component."""
    centres = tuple(f"{d}_c" for d in names)
    data: dict[str, Any] = {}
    for name, q in frame.data_vars.items():
        more = [d for d in q.dims if d not in centres]
        if len(q.dims) - len(more) < len(centres):
            continue
        for index in np.ndindex(*(q.sizes[d] for d in more)):
            labels = [str(q[d].values[i]) for d, i in zip(more, index, strict=True)]
            part = q.isel(dict(zip(more, index, strict=True)))
            data["_".join([str(name), *labels])] = _solid(part.transpose(*centres).values)
    if all(VELOCITY[a] in frame for a in range(len(names))):
        parts = [_centred(frame[VELOCITY[a]], d, names, frame.sizes[f"{d}_c"]) for a, d in enumerate(names)]
        parts += [np.zeros_like(parts[0])] * (3 - len(names))
        data["velocity"] = tuple(parts)
    return data


def _centred(q: Any, d: str, names: str, n: int) -> np.ndarray:
    """Mean over the two faces of each of the ``n`` cells in direction ``d``; a periodic direction closes on itself."""
    faces, axis = q.transpose(*(f"{e}_{'n' if e == d else 'c'}" for e in names)).values, names.index(d)
    high = np.take(faces, np.arange(1, n + 1) % faces.shape[axis], axis)
    return _solid(0.5 * (np.take(faces, np.arange(n), axis) + high))


def _solid(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values.reshape(values.shape + (1,) * (3 - values.ndim)))
