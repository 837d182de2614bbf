"""Files that a killed process cannot spoil: whole or absent, checked when read; the frames and states of a run."""

import errno
import json
import os
import shutil
import time
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

Arrays = dict[str, np.ndarray]


class DiskFull(OSError):
    """No space left for a file; says in one line how much there is and how much is needed."""

    def __init__(self, path: Path, need: float):
        free = shutil.disk_usage(_folder(path)).free
        self.message = f"disk full: {path}, {free / 1e6:.1f} MB free, {need / 1e6:.1f} MB needed"
        super().__init__(errno.ENOSPC, self.message)

    def __str__(self) -> str:
        return self.message


class Damaged(ValueError):
    """A file of a checkpoint is not what was written."""


def _folder(path: Path) -> Path:
    return next(folder for folder in (path, *path.absolute().parents) if folder.is_dir())


def need_space(path: Path, need: float) -> None:
    """Raise `DiskFull` unless ``need`` bytes are free where ``path`` will be."""
    if shutil.disk_usage(_folder(path)).free < need:
        raise DiskFull(path, need)


@contextmanager
def replacing(path: Path, need: float = 0.0, durable: bool = True) -> Iterator[Path]:
    """Give a temporary name in the folder of ``path``; move it there when the block succeeds, delete it otherwise.

    A ``durable`` file is on the disk before it gets its name, whatever happens to the power.
    Raises `DiskFull` before and when space runs out.
    """
    need_space(path, need)
    spare = path.with_name(f"{path.name}.tmp.{os.getpid()}")
    try:
        yield spare
        if durable:
            _settle(spare)
        os.replace(spare, path)
    except (OSError, RuntimeError) as error:
        written = spare.stat().st_size if spare.exists() else 0
        full = getattr(error, "errno", None) in (errno.ENOSPC, errno.EDQUOT)
        full = full or shutil.disk_usage(_folder(path)).free < max(need - written, 65536)
        spare.unlink(missing_ok=True)
        if full and not isinstance(error, DiskFull):
            raise DiskFull(path, max(need, written)) from error
        raise
    finally:
        spare.unlink(missing_ok=True)


def _settle(path: Path) -> None:
    with open(path, "rb+") as file:
        os.fsync(file.fileno())


def save_state(path: Path, state: Arrays, meta: dict[str, Any], durable: bool = True) -> None:
    """Write arrays, bit for bit, and a few words about them (JSON); the file is whole or absent."""
    arrays = {key: np.asarray(value) for key, value in state.items()}
    header = json.dumps({"meta": meta, "arrays": list(arrays)})
    words = np.frombuffer(header.encode(), np.uint8)
    size = sum(value.nbytes for value in arrays.values()) + 4096.0
    with replacing(Path(path), size, durable) as spare, open(spare, "wb") as file:
        np.savez(file, header=words, **{f"array:{key}": value for key, value in arrays.items()})


def load_state(path: Path, prefix: str = "") -> tuple[Arrays, dict[str, Any]]:
    """Arrays whose names start with ``prefix`` (by default all) and the words of `save_state`.

    Raises `Damaged` when a checksum is wrong or something is missing, FileNotFoundError when there is no file.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            header = json.loads(bytes(file["header"]))
            state = {key: file[f"array:{key}"] for key in header["arrays"] if key.startswith(prefix)}
        return state, header["meta"]
    except FileNotFoundError:
        raise
    except (OSError, ValueError, KeyError, EOFError, RuntimeError, NotImplementedError) as error:
        raise Damaged(f"{path}: damaged checkpoint ({type(error).__name__})") from error
    except (zipfile.BadZipFile, zlib.error, MemoryError, OverflowError, SyntaxError) as error:
        raise Damaged(f"{path}: damaged checkpoint ({type(error).__name__})") from error


class Kept:
    """The state of a long computation, one file ``NAME.state``, from which the next try goes on.

    Parameters
    ----------
    path : the file
    identity : what a state must agree with (scene, sources); another one is as good as none
    every : least time between two states [s]

    Attributes
    ----------
    before : CPU seconds of the tries before, once their state was loaded
    """

    def __init__(self, path: Path, identity: dict[str, str], every: float = 60.0):
        self.path, self.identity, self.every, self.before = Path(path), identity, every, 0.0
        self._began, self._last = time.process_time(), time.monotonic()
        for stray in self.path.parent.glob(f"{self.path.name}.tmp.*"):
            stray.unlink(missing_ok=True)

    def load(self) -> Arrays | None:
        """The newest state, or None when there is no good one."""
        try:
            state, meta = load_state(self.path)
        except (FileNotFoundError, Damaged):
            return None
        if meta["identity"] != self.identity:
            return None
        self.before = meta["cpu_seconds"]
        return state

    def save(self, state: Callable[[], Arrays]) -> None:
        """Keep what ``state`` returns, unless the last one is younger than ``every``."""
        if time.monotonic() - self._last >= self.every:
            spent = self.before + time.process_time() - self._began
            save_state(self.path, state(), {"identity": self.identity, "cpu_seconds": spent})
            self._last = time.monotonic()

    def drop(self) -> None:
        """It is done: the file is no longer needed."""
        self.path.unlink(missing_ok=True)


class Store:
    """Folder ``NAME.nc.frames`` of a run that is going on: one file a frame, and the last two states.

    Parameters
    ----------
    path : the file that the run will be
    identity : what a state must agree with (scene, sources) so that a run may go on from it
    resume : keep what is there and go on from the newest good state; otherwise begin with an empty folder

    Raises
    ------
    RuntimeError : when another process is writing the same run.
    Damaged : when there are states but none is good.
    ValueError : when the state belongs to another scene or other sources.
    """

    def __init__(self, path: Path, identity: dict[str, str], resume: bool = False):
        self.folder = path.with_name(f"{path.name}.frames")
        self.identity = identity
        self.state: Arrays | None = None
        self.meta: dict[str, Any] = {}
        self.folder.mkdir(parents=True, exist_ok=True)
        self._hold()
        names = f"{path.name}.tmp.*", f"{path.stem}.cost.json.tmp.*", f"{self.folder.name}/*.tmp.*"
        for stray in (file for name in names for file in path.parent.glob(name)):
            stray.unlink(missing_ok=True)
        try:
            if resume:
                self._find()
        except BaseException:
            self._release()
            raise
        self.count = self.meta.get("frames", 0)
        self.last_step = self.meta.get("last_step", -1)
        self._settled = self.count
        for file in self.folder.glob("[0-9]*.npz"):
            if int(file.stem) >= self.count:
                file.unlink()
        if self.state is None:
            for file in self._states():
                file.unlink()

    def _hold(self) -> None:
        self._lock = open(self.folder / "lock", "a")  # noqa: SIM115  held as long as the run
        with suppress(ImportError):
            import fcntl

            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                self._lock.close()
                raise RuntimeError(f"{self.folder}: another process is writing this run") from None

    def _release(self) -> None:
        self._lock.close()

    def _states(self) -> list[Path]:
        return sorted(self.folder.glob("state-*.npz"))

    def _find(self) -> None:
        fault = None
        for file in reversed(self._states()):
            try:
                state, meta = load_state(file)
            except Damaged as error:
                fault = fault or error
                continue
            if meta["identity"] != self.identity:
                raise ValueError(f"{file}: belongs to another scene or other sources; run without --resume")
            self.state, self.meta = state, meta
            return
        if fault:
            raise fault

    def keep_state(self, state: Arrays, step: int, meta: dict[str, Any]) -> None:
        """Write a state of the run after ``step``; the one before the last is deleted."""
        while self._settled < self.count:  # a state must find its frames
            _settle(self.folder / f"{self._settled:06d}.npz")
            self._settled += 1
        words = {"identity": self.identity, "frames": self.count, "last_step": self.last_step, **meta}
        save_state(self.folder / f"state-{step:012d}.npz", state, words)
        for file in self._states()[:-2]:
            file.unlink()

    def add(self, arrays: Arrays, step: int, meta: dict[str, Any]) -> None:
        """Store the next frame."""
        save_state(self.folder / f"{self.count:06d}.npz", arrays, meta, durable=False)
        self.count += 1
        self.last_step = step

    def frame(self, k: int, prefix: str = "") -> tuple[Arrays, dict[str, Any]]:
        """Frame ``k``: its arrays whose names start with ``prefix``, and its words."""
        return load_state(self.folder / f"{k:06d}.npz", prefix)

    def close(self, keep: bool) -> None:
        """Let go of the folder, and delete it unless ``keep`` and a state is in it."""
        if not (keep and self._states()):
            for file in reversed(self._states()):  # first: without states nobody looks for the frames
                file.unlink()
            shutil.rmtree(self.folder, ignore_errors=True)
        self._release()
