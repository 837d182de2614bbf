"""Killed, out of space, damaged: a file is right or it is not there."""

import hashlib
import multiprocessing
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import netCDF4
import numpy as np
import pytest
from fake_run import frames, scene

from fsiwork import dataset, netcdf
from fsiwork.checkpoint import Damaged, DiskFull, Store, load_state, save_state

TRIALS = int(os.environ.get("FSIWORK_SOAK", "20"))
SCENE = scene(32, frames=12)


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def write(path, resume):
    dataset.write(frames, SCENE, path, resume=resume, every=0.002)


@pytest.mark.skipif(os.name != "posix", reason="needs fork and SIGKILL")
def test_a_kill_at_any_moment_leaves_nothing_that_opens_and_is_wrong(tmp_path):
    write(tmp_path / "right.nc", False)
    right, chance = digest(tmp_path / "right.nc"), random.Random(7)
    began = time.monotonic()
    write(tmp_path / "right.nc", False)
    usual = time.monotonic() - began
    killed = finished = 0
    for k in range(TRIALS):
        path = tmp_path / f"{k}" / "run.nc"
        path.parent.mkdir()
        for attempt in range(2):  # killed, and killed again while it goes on
            child = multiprocessing.get_context("fork").Process(target=write, args=(path, attempt > 0))
            child.start()
            time.sleep(chance.uniform(0.0, 1.2 * usual))
            child.kill()
            child.join()
            killed += child.exitcode == -signal.SIGKILL
            for file in path.parent.rglob("run.nc*"):
                with suppress(ValueError, OSError):
                    with dataset.open_run(file) as found, dataset.open_run(tmp_path / "right.nc") as whole:
                        assert found.identical(whole), file
                    assert file != path or digest(file) == right
                    finished += 1
        write(path, True)
        assert digest(path) == right
        assert sorted(p.name for p in path.parent.iterdir()) == ["run.cost.json", "run.nc"]
        shutil.rmtree(path.parent)
    assert killed >= TRIALS / 2, (killed, finished)


def test_the_script_of_a_run_can_be_killed_and_goes_on(tmp_path):
    path = tmp_path / "run.nc"
    words = [sys.executable, str(Path(__file__).with_name("fake_run.py")), str(path)]
    child = subprocess.Popen(words)
    limit = time.monotonic() + 30.0
    while not (path.with_name("run.nc.frames") / "000002.npz").exists() and child.poll() is None:
        assert time.monotonic() < limit
        time.sleep(0.001)
    child.kill()
    child.wait()
    subprocess.run([*words, "--resume"], check=True)
    with dataset.open_run(path) as ds:
        assert ds.ended == "complete" and ds.sizes["t"] == 41


def test_two_processes_do_not_write_the_same_run(tmp_path):
    store = Store(tmp_path / "run.nc", {})
    with pytest.raises(RuntimeError, match=r"another process is writing this run$"):
        dataset.write(frames, SCENE, tmp_path / "run.nc")
    store.close(keep=False)
    assert dataset.write(frames, SCENE, tmp_path / "run.nc") == "complete"


def test_what_is_read_back_is_compared(tmp_path, monkeypatch):
    path, close = tmp_path / "run.nc", netcdf.Writer.close

    def spoil(writer, attributes):
        name = writer.file.filepath()
        close(writer, attributes)
        with netCDF4.Dataset(name, "a") as file:
            file["u"][3, 2, 1] += 1e-15

    monkeypatch.setattr(netcdf.Writer, "close", spoil)
    with pytest.raises(OSError, match="u was not written as it should be"):
        write(path, False)
    assert not list(tmp_path.glob("*.nc")) and not list(tmp_path.glob("*.tmp.*"))
    monkeypatch.undo()
    write(path, True)  # the frames were kept: only the file is written
    write(tmp_path / "right.nc", False)
    assert digest(path) == digest(tmp_path / "right.nc")


# ------------------------------------------------------------------------------------------------------------ disk full
@pytest.fixture
def small_disk(tmp_path):
    """A disk of two megabytes."""
    disk = tmp_path / "disk"
    disk.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=2m", "none", str(disk)]
    if not shutil.which("mount") or subprocess.run(words, capture_output=True).returncode:
        pytest.skip("a small tmpfs may not be mounted here")
    yield disk
    subprocess.run(["umount", "-l", disk], check=True)


def one_line(error):
    text = str(error.value)
    assert text.startswith("disk full: ") and text.endswith("MB needed") and "MB free, " in text and "\n" not in text
    return True


def test_a_full_disk_is_seen_before_the_run(small_disk):
    with pytest.raises(DiskFull) as error:
        dataset.write(frames, scene(64, frames=500), small_disk / "run.nc")
    assert one_line(error) and not list(small_disk.iterdir())


@pytest.mark.parametrize("moment", ["a frame", "the file"])
def test_a_disk_that_fills_up_gives_one_line_and_leaves_no_file(small_disk, moment):
    ballast, path = small_disk / "ballast", small_disk / "run.nc"

    def filling(scene, resume=None):
        for frame in frames(scene, resume):
            if (frame.step == 12 if moment == "a frame" else frame.ended) and not resume:
                room = shutil.disk_usage(small_disk).free - (12000 if moment == "a frame" else 60000)
                ballast.write_bytes(b"0" * room)
            yield frame

    with pytest.raises(DiskFull) as error:
        dataset.write(filling, SCENE, path, every=0.0)
    assert one_line(error) and not path.exists() and not list(small_disk.rglob("*.tmp.*"))
    ballast.unlink()
    dataset.write(frames, SCENE, path, resume=True)
    write(small_disk / "right.nc", False)
    assert digest(path) == digest(small_disk / "right.nc")


# ---------------------------------------------------------------------------------------------------------- checkpoints
def test_a_state_comes_back_bit_for_bit(tmp_path):
    state = {
        "u": np.array([np.nan, -0.0, 1e-320, np.inf]),
        "n": np.int64(3),
        "f": np.ones((2, 3), "f4"),
        "none": np.zeros(0),
    }
    save_state(tmp_path / "s.npz", state, {"step": 3})
    found, meta = load_state(tmp_path / "s.npz")
    assert meta == {"step": 3} and list(found) == list(state)
    for key, value in state.items():
        assert found[key].tobytes() == value.tobytes() and found[key].dtype == value.dtype
        assert found[key].shape == value.shape
    assert os.listdir(tmp_path) == ["s.npz"]


def test_a_damaged_state_is_refused(tmp_path):
    path, chance = tmp_path / "s.npz", random.Random(3)
    save_state(path, {"u": np.arange(300.0), "step": np.array(7)}, {"step": 3})
    whole = path.read_bytes()
    refused = 0
    for k in range(300):
        broken = bytearray(whole)
        if k % 3:
            broken[chance.randrange(len(broken))] ^= 1 << chance.randrange(8)
        else:
            del broken[chance.randrange(len(broken)) :]
        path.write_bytes(broken)
        try:
            found, meta = load_state(path)
        except Damaged as error:
            assert "damaged checkpoint" in str(error) and "\n" not in str(error)
            refused += 1
        else:  # a bit that nobody reads, of a date for example
            assert np.array_equal(found["u"], np.arange(300.0)) and found["step"] == 7 and meta == {"step": 3}
    assert refused > 270


def test_a_damaged_last_state_falls_back_to_the_one_before(tmp_path):
    path = tmp_path / "run.nc"
    write(tmp_path / "right.nc", False)
    dataset.write(lambda s, resume=None: frames(s, resume, stop_after=14), SCENE, path, every=0.0)
    states = sorted(tmp_path.glob("run.nc.frames/state-*"))
    assert len(states) == 2
    states[1].write_bytes(states[1].read_bytes()[:-40])
    write(path, True)
    assert digest(path) == digest(tmp_path / "right.nc")


def test_no_good_state_is_one_clear_line(tmp_path):
    path = tmp_path / "run.nc"
    dataset.write(lambda s, resume=None: frames(s, resume, stop_after=14), SCENE, path, every=0.0)
    for state in tmp_path.glob("run.nc.frames/state-*"):
        state.write_bytes(b"nothing")
    with pytest.raises(Damaged, match=r"state-\d+\.npz: damaged checkpoint \(\w+\)$"):
        write(path, True)
    write(path, False)
    assert path.exists()
