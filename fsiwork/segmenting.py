"""From a picture or a volume to its two parts in a netCDF file."""

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fsiwork import layout, provenance, running, sources
from fsiwork.dataset import BOOK, CONVENTIONS
from fsiwork.netcdf import Writer, written

if TYPE_CHECKING:
    from fsiwork.core.segmentation import Segmentation

DEEP = ("1", "I", "I;16", "I;16B", "I;16L", "F")  # modes of Pillow whose values are levels as they are


def read(path: str | Path) -> np.ndarray:
    """Levels of a picture (what Pillow reads; colours become their luminance) or of an array (``.npy``).

    Returns the axes (x, y[, z]): x to the right, y upwards. An array has its axes in the order of the files of this
    package, (y, x) or (z, y, x). Raises ValueError, in one line, when the file is missing or is neither.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path}: no such file")
    try:
        q = _array(path) if path.suffix == ".npy" else _picture(path)
    except MemoryError:
        raise
    except Exception as error:  # decoders of untrusted files raise nearly anything
        what = "array of numbers" if path.suffix == ".npy" else "picture"
        raise ValueError(f"{path}: no {what} that can be read ({type(error).__name__})") from error
    return q.T


def _array(path: Path) -> np.ndarray:
    q = np.load(path, allow_pickle=False)
    if q.dtype.kind not in "biuf":
        raise TypeError(q.dtype)
    return q.astype(float)


def _picture(path: Path) -> np.ndarray:
    from PIL import Image

    with Image.open(path) as picture:
        grey = picture if picture.mode in DEEP else picture.convert("L")
        return np.asarray(grey, dtype=float)[::-1]


def to_file(image: str | Path, path: str | Path, smoothing: float = 2.5, start: str = "around") -> str:
    """Segment the picture or volume ``image`` and write ``NAME.nc``; returns one line about what was found.

    Raises ValueError, in one line, for a bad image or name, and what `fsiwork.netcdf.written` raises.
    """
    path = Path(path)
    if path.suffix != ".nc" or path.is_dir():
        raise ValueError(f"{path}: the file of a segmentation ends in .nc and is no folder")
    q = read(image)
    provenance.prepare(running.threads())
    from fsiwork.core.segmentation import segment

    try:
        found = segment(q, smoothing, start=start)
    except ValueError as error:
        raise ValueError(f"{image}: {error}") from error
    with written(path, _attributes(image, found, smoothing, start), 3.0 * q.nbytes) as out:
        _fields(out, q, found)
        _energy(out, found)
    inside = int((found.phi < 0).sum())
    return f"{found.ended}, {inside} of {q.size} cells inside, levels {found.inside:.6g} and {found.outside:.6g}"


def _attributes(image: str | Path, found: "Segmentation", smoothing: float, start: str) -> dict:
    installed = sources.versions()
    return {
        "Conventions": CONVENTIONS,
        "title": f"Segmentation of {Path(image).name}",
        "source": f"fsiwork {installed['fsiwork']}",
        "history": f"fsiwork segment {Path(image).name} --smoothing {smoothing:g} --start {start}",
        "references": f"{BOOK}. Active contours (1.29), corrected",
        "image_sha256": hashlib.sha256(Path(image).read_bytes()).hexdigest(),
        "smoothing": smoothing,
        "start": start,
        "level_inside": found.inside,
        "level_outside": found.outside,
        "steps": found.steps,
        "source_hash": sources.source_hash("core", "segmenting"),
        "ended": found.ended,
    }


def _fields(out: Writer, q: np.ndarray, found: "Segmentation") -> None:
    """Image, φ and mask at the pixels, whose sides are 1 long."""
    grid = layout.Geometry(q.shape, 1.0, (0.0,) * q.ndim, (False,) * q.ndim)
    for a, name in enumerate(layout.DIRECTIONS[: q.ndim]):
        out.dimension(f"{name}_c", q.shape[a])
        out.variable(f"{name}_c", (f"{name}_c",), "f8", {"long_name": f"{name} of pixels", "units": "1"})
        out.put(f"{name}_c", grid.coordinates()[f"{name}_c"])
    for name, values, words in (
        ("image", q, "level of the image"),
        ("phi", found.phi, "distance [pixels] to the contour, negative inside, constant far from it"),
        ("mask", (found.phi < 0).astype(np.int8), "1 inside, 0 outside"),
    ):
        out.variable(name, grid.dims(None), values.dtype, {"long_name": words, "units": "1"})
        out.put(name, values.T)


def _energy(out: Writer, found: "Segmentation") -> None:
    out.dimension("row", len(found.energy))
    out.variable(
        "energy", ("row",), "f8", {"long_name": "energy of (1.29) at the start and after a step", "units": "1"}
    )
    out.put("energy", found.energy)
    words = {"long_name": "1 after redistancing, when the energy may have risen, 0 after a step", "units": "1"}
    out.variable("redistanced", ("row",), "i1", words)
    out.put("redistanced", found.fresh.astype(np.int8))
