"""The command that segments pictures: what it writes, which way is up, and one line for a bad file."""

import netCDF4
import numpy as np
import pytest
from PIL import Image

from fsiwork import segmenting
from fsiwork.__main__ import main

RNG = np.random.default_rng(4)


@pytest.fixture(scope="module")
def levels():
    """Rows from the top: a disc in the upper right part of a picture of 60 × 48 pixels, under noise."""
    y, x = np.mgrid[:48, :60]
    return np.where(np.hypot(x - 42, y - 15) < 9, 200.0, 60.0) + RNG.normal(0, 20, (48, 60))


def call(capsys, *arguments):
    code = main(["segment", *map(str, arguments)])
    out, err = capsys.readouterr()
    return code, out, err.splitlines()


@pytest.mark.parametrize(
    ("name", "mode"), [("a.png", "L"), ("a.jpg", "L"), ("a.png", "RGB"), ("a.png", "RGBA"), ("a.png", "I;16")]
)
def test_a_picture_becomes_a_file(levels, tmp_path, capsys, name, mode):
    grey = Image.fromarray(levels.clip(0, 255).astype(np.uint8))
    picture = Image.fromarray((levels * 200).clip(0, 65535).astype(np.uint16)) if mode == "I;16" else grey.convert(mode)
    picture.save(tmp_path / name)
    code, out, err = call(capsys, tmp_path / name, "-o", tmp_path / "out.nc")
    assert (code, err) == (0, [])
    assert "settled" in out
    with netCDF4.Dataset(tmp_path / "out.nc") as file:
        assert file["mask"].dimensions == ("y_c", "x_c")
        mask, phi = file["mask"][:], file["phi"][:]
        assert mask.shape == (48, 60)
        assert ((phi < 0) == (mask == 1)).all()
        y, x = np.nonzero(mask)
        assert file["x_c"][x].mean() == pytest.approx(42.5, abs=0.5)
        assert file["y_c"][y].mean() == pytest.approx(48 - 15.5, abs=0.5)  # y points up
        assert mask.sum() == pytest.approx(np.pi * 81, rel=0.08)
        falls = np.diff(file["energy"][:])[file["redistanced"][1:] == 0]
        assert falls.size > 10
        assert falls.max() < 0
        assert file.level_inside > 2 * file.level_outside
        assert file.ended == "settled"
        assert file.smoothing == 2.5
        assert len(file.image_sha256) == 64
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([name, "out.nc"])


def test_a_volume_becomes_a_file(tmp_path, capsys):
    z, y, x = np.mgrid[:14, :16, :20]
    volume = (np.sqrt((x - 12) ** 2 + (y - 8) ** 2 + (z - 6) ** 2) < 4.2) + RNG.normal(0, 0.2, z.shape)
    np.save(tmp_path / "v.npy", volume)
    code, _, err = call(capsys, tmp_path / "v.npy", "-o", tmp_path / "new" / "out.nc", "--smoothing", 0.5)
    assert (code, err) == (0, [])
    with netCDF4.Dataset(tmp_path / "new" / "out.nc") as file:
        assert file["mask"].dimensions == ("z_c", "y_c", "x_c")
        assert (np.asarray(file["image"][:]) == volume).all()
        centre = [np.mean(q) for q in np.nonzero(file["mask"][:])]
        assert centre == pytest.approx([6, 8, 12], abs=0.5)


BAD = {
    "missing.png": None,
    "text.png": b"hello",
    "empty.png": b"",
    "empty.npy": b"",
    "folder.png": "folder",
    "cut.png": "cut",
    "nan.npy": np.where(np.eye(20) > 0, np.nan, 1.0),
    "objects.npy": np.array([None] * 9),
    "words.npy": np.array([["a"] * 9] * 9),
    "none.npy": np.zeros((0, 9)),
    "small.npy": np.eye(7),
    "line.npy": np.arange(99.0),
    "flat.npy": np.ones((20, 20)),
    "complex.npy": np.ones((20, 20)) * 1j,
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_one_line_and_leaves_nothing(name, levels, tmp_path, capsys):
    path, content = tmp_path / name, BAD[name]
    if isinstance(content, np.ndarray):
        np.save(path, content, allow_pickle=True)
    elif isinstance(content, bytes):
        path.write_bytes(content)
    elif content == "folder":
        path.mkdir()
    elif content == "cut":
        Image.fromarray(levels.clip(0, 255).astype(np.uint8)).save(path)
        path.write_bytes(path.read_bytes()[:1500])
    before = sorted(tmp_path.iterdir())
    code, out, err = call(capsys, path, "-o", tmp_path / "out.nc")
    assert (code, out, len(err)) == (2, "", 1)
    assert err[0].startswith(f"{path}: ")
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    "arguments",
    [("-o", "out.txt"), ("-o", "."), ("-o", "out.nc", "--smoothing", "0"), ("-o", "out.nc", "--start", "x")],
)
def test_bad_options_are_one_line(arguments, levels, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("a.npy", levels)
    code, _, err = call(capsys, "a.npy", *arguments)
    assert (code, len(err)) == (2, 1)
    assert [p.name for p in tmp_path.iterdir()] == ["a.npy"]


def test_not_a_number_is_no_smoothing(levels, tmp_path, capsys):
    np.save(tmp_path / "a.npy", levels)
    code, _, err = call(capsys, tmp_path / "a.npy", "-o", tmp_path / "out.nc", "--smoothing", "nan")
    assert (code, len(err)) == (2, 1)


def test_a_failed_write_leaves_the_file_that_was_there(levels, tmp_path, monkeypatch):
    np.save(tmp_path / "a.npy", levels)
    segmenting.to_file(tmp_path / "a.npy", tmp_path / "out.nc")
    before = (tmp_path / "out.nc").read_bytes()

    def broken(*_):
        raise RuntimeError("no")

    monkeypatch.setattr(segmenting, "_energy", broken)
    with pytest.raises(RuntimeError):
        segmenting.to_file(tmp_path / "a.npy", tmp_path / "out.nc")
    assert (tmp_path / "out.nc").read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.npy", "out.nc"]
