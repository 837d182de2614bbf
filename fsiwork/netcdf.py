"""Write a netCDF file that is right or absent: temporary name, read back and compared, renamed."""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np

from fsiwork.checkpoint import replacing


class Writer:
    """An open netCDF file; remembers a hash of each block that is put into it."""

    def __init__(self, path: Path):
        self.file = netCDF4.Dataset(path, "w", format="NETCDF4")
        self.blocks: list[tuple[str, Any, str]] = []

    def dimension(self, name: str, size: int) -> None:
        """Declare a dimension; an empty one is allowed."""
        if name not in self.file.dimensions:
            self.file.createDimension(name, size or None)  # a fixed size of 0 would mean unlimited anyway

    def variable(
        self, name: str, dims: tuple[str, ...], dtype: Any, attributes: dict, whole: int = 0, fill: Any = False
    ) -> None:
        """Declare a variable: compressed (zlib 1, shuffle) if it has dimensions, as a rule without a fill value.

        One chunk holds one index of the first ``whole`` dimensions and everything of the others. With ``fill``
        what is never put reads as that value.
        """
        sizes = [max(len(self.file.dimensions[d]), 1) for d in dims]
        chunks = [1] * whole + sizes[whole:] if dims else None
        text = dtype is str
        packed = {} if text or not dims else {"compression": "zlib", "complevel": 1, "shuffle": True}
        target = self.file.createVariable(
            name, dtype, dims, fill_value=None if text else fill, chunksizes=chunks, **packed
        )
        target.setncatts(attributes)

    def put(self, name: str, values: Any, index: Any = ...) -> None:
        """Write ``values`` at ``index`` of a variable."""
        target = self.file[name]
        values = np.asarray(values, dtype=object if target.dtype is str else target.dtype)
        if values.size:
            target[index] = values
            self.blocks.append((name, index, _hash(values)))

    def close(self, attributes: dict[str, Any]) -> None:
        """Write the global attributes and close; ``ended`` only when all else is in the file, because a file that a
        kill left half closed may open: without ``ended`` nobody takes it for finished."""
        path = self.file.filepath()
        self.file.setncatts({name: value for name, value in attributes.items() if name != "ended"})
        self.file.close()
        with netCDF4.Dataset(path, "a") as file:
            file.ended = attributes["ended"]


def _hash(values: np.ndarray) -> str:
    if values.dtype == object:
        return repr(values.tolist())
    return hashlib.sha256(np.ascontiguousarray(values)).hexdigest()


def opened(path: Path) -> netCDF4.Dataset:
    """Open a file that fsiwork wrote, for reading, values as they are.

    Raises FileNotFoundError or ValueError, in one line, when it is missing, not netCDF, or not finished.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        found = netCDF4.Dataset(path)
    except (OSError, RuntimeError) as error:
        raise ValueError(f"{path}: not a netCDF file, or a damaged one") from error
    found.set_auto_maskandscale(False)
    if missing := [name for name in ("source_hash", "ended") if name not in found.ncattrs()]:
        found.close()
        raise ValueError(f"{path}: not a finished file of fsiwork (no attribute {missing[0]!r})")
    return found


@contextmanager
def written(path: Path, attributes: dict[str, Any], need: float = 0.0) -> Iterator[Writer]:
    """Give a `Writer`; after the block the file is closed, read back, compared and moved to ``path``.

    Raises `fsiwork.checkpoint.DiskFull` when ``need`` bytes are not free or space runs out; OSError when what is
    read back is not what was written.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path, need) as spare:
        writer = Writer(spare)
        try:
            yield writer
            writer.close(attributes)
        finally:
            if writer.file.isopen():
                with suppress(RuntimeError):  # what broke the block says why
                    writer.file.close()
        with netCDF4.Dataset(spare) as copy:
            copy.set_auto_mask(False)
            for name, index, digest in writer.blocks:
                found = np.asarray(copy[name][index], dtype=object if copy[name].dtype is str else None)
                if _hash(found) != digest:
                    raise OSError(f"{path}: {name} was not written as it should be")
