"""One run from scene to file or to a dataset in memory."""

import os
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from fsiwork import provenance
from fsiwork.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

    from fsiwork.simulate import Frame


def run(scene: Scene, path: str | Path | None = None, *, max_seconds: float | None = None) -> "xr.Dataset":
    """Simulate a scene and return its frames and gauges as labelled data.

    With a ``path`` (``NAME.nc``) the file is written as the run goes on and then opened lazily; without one the data
    are in memory. ``ds.attrs["ended"]`` says whether the run is complete or has diverged. Raises what
    `fsiwork.plan.refuse` and `fsiwork.dataset.write` raise, and TimeoutError when ``max_seconds`` ended a run with a
    ``path`` (its state is kept).
    """
    from fsiwork import dataset
    from fsiwork.plan import refuse

    refuse(scene)
    if path is None:
        provenance.prepare(threads())
        return dataset.to_dataset(_frames(max_seconds), scene)
    ended = to_file(scene, path, max_seconds=max_seconds)
    if ended.startswith("stopped"):
        raise TimeoutError(ended)
    return dataset.open_run(path)


def to_file(
    scene: Scene,
    path: str | Path,
    *,
    resume: bool = False,
    max_seconds: float | None = None,
    watch: Callable[["Frame"], None] | None = None,
) -> str:
    """Simulate a scene into ``NAME.nc``; returns how the run ended.

    ``watch`` is called with every frame. See `fsiwork.dataset.write` for ``resume`` and for what is raised.
    """
    provenance.prepare(threads())
    from fsiwork.dataset import write

    return provenance.with_healed_cache(partial(write, _frames(max_seconds, watch), scene, path, resume=resume))


def threads() -> int:
    """Threads of the kernels: NUMBA_NUM_THREADS, or one."""
    text = os.environ.get("NUMBA_NUM_THREADS", "1")
    return max(1, int(text)) if text.isdecimal() else 1


def set_threads(count: int) -> None:
    """Choose the threads of the kernels; before the first run."""
    os.environ["NUMBA_NUM_THREADS"] = str(count)


def _frames(max_seconds: float | None, watch: Callable[["Frame"], None] | None = None):
    """`fsiwork.simulate.frames` with a limit and somebody who watches, as `fsiwork.dataset.write` wants it."""

    def frames(scene: Scene, resume=None) -> Iterator["Frame"]:
        from fsiwork import simulate

        for frame in simulate.frames(scene, resume, max_seconds):
            if watch:
                watch(frame)
            yield frame

    return frames
