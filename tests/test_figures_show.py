"""`fsiwork show` and the style of figures: the data that reach the picture, and the bytes that reach the disk."""

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

from fsiwork.figures import chapter1, show, style


def run(n=(12, 8), frames=3, periodic=False, bodies=0, deep=0):
    """A run by formula: u = x² (faces), v = 0, p = x, φ a disc of radius 0.3 about (1.5, 1); ``deep`` cells along z."""
    h = 3.0 / n[0]
    x_c, y_c = (np.arange(n[0]) + 0.5) * h, (np.arange(n[1]) + 0.5) * h
    x_n, y_n = np.arange(n[0] + (not periodic)) * h, np.arange(n[1] + (not periodic)) * h
    t, t_step = np.linspace(0, 1, frames), np.linspace(0, 1, 11)
    coords = {"t": t, "x_c": x_c, "y_c": y_c, "x_n": x_n, "y_n": y_n, "t_step": t_step}
    phi = np.hypot(x_c - 1.5, y_c[:, None] - 1.0) - 0.3
    fields = {
        "u": (("y_c", "x_n"), np.tile(x_n**2, (n[1], 1))),
        "v": (("y_n", "x_c"), np.zeros((y_n.size, n[0]))),
        "p": (("y_c", "x_c"), np.tile(x_c, (n[1], 1))),
        "phi": (("y_c", "x_c"), phi),
    }
    if deep:
        coords["z_c"] = (np.arange(deep) + 0.5) * h
        fields = {k: (("z_c", *dims), np.stack([q * (i + 1) for i in range(deep)])) for k, (dims, q) in fields.items()}
    variables = {k: (("t", *dims), np.stack([q] * frames)) for k, (dims, q) in fields.items()}
    if bodies:
        pair = np.stack([phi, phi + 0.1], 0)[:bodies]
        variables["phi"] = (("t", "body", "y_c", "x_c"), np.stack([pair] * frames))
    gauge = (("t_step", "body"), np.stack([1 + t_step] * bodies, 1)) if bodies else (("t_step",), 1 + t_step)
    variables |= {"volume": gauge, "elastic_energy": gauge, "kinetic_energy": (("t_step",), t_step)}
    return xr.Dataset(variables, coords, {"title": "by formula", "ended": "complete"})


@pytest.mark.parametrize("periodic", [False, True])
def test_speed_is_the_mean_of_the_faces_around_a_centre(periodic):
    ds = run(periodic=periodic)
    speed = show._plane(ds, "speed", 0)
    u = ds["u"].isel(t=0, y_c=0).values
    faces = np.append(u, u[0]) if periodic else u
    assert speed == pytest.approx(np.tile(0.5 * (faces[1:] + faces[:-1]), (8, 1)))


def test_middle_plane_and_union_of_bodies():
    deep = run(deep=5)
    assert show._plane(deep, "p", 0) == pytest.approx(3 * np.tile(deep["x_c"], (8, 1)))
    both = show._plane(run(bodies=2), "phi", 0)
    assert both == pytest.approx(run()["phi"].isel(t=0).values)


def test_overview_draws_fields_interface_and_gauges():
    figure = show.overview(run(frames=5))
    titled = {ax.get_title(loc="left"): ax for sub in figure.subfigs for ax in sub.axes}
    for label in ("speed |u|", "pressure p"):
        for t in ("0", "0.5", "1"):
            ax = titled[f"{label}, t = {t}"]
            line = np.concatenate([p.vertices for c in ax.collections for p in c.get_paths()])
            assert np.hypot(line[:, 0] - 1.5, line[:, 1] - 1.0) == pytest.approx(0.3, abs=0.06)
    assert not any("level set" in title for title in titled)  # its zero line is drawn already
    gauges = {ax.get_ylabel(): ax for sub in figure.subfigs for ax in sub.axes}
    volume = gauges["change [%]"].get_lines()[0].get_ydata()
    assert volume == pytest.approx(100 * np.linspace(0, 1, 11))
    sums = [line for line in gauges["energy"].get_lines() if line.get_label() == "sum"]
    assert sums[0].get_ydata() == pytest.approx(1 + 2 * np.linspace(0, 1, 11))


@pytest.mark.parametrize(
    "ds",
    [
        run(periodic=True, bodies=2),
        run(deep=4),
        run()[["phi"]],
        run()[["volume"]],
        run(frames=1),
        run().where(run()["t"] < 0.9).assign_attrs(title="x", ended="diverged at t=0.9"),
    ],
    ids=["bodies", "space", "phi alone", "gauges alone", "one frame", "diverged"],
)
def test_any_run_can_be_shown(ds, tmp_path):
    with Image.open(show.show(ds, tmp_path / "a.png")) as picture:
        assert picture.width > 200
        assert len(np.unique(np.asarray(picture.convert("RGB")).reshape(-1, 3), axis=0)) > 20
    assert (tmp_path / "a.png").stat().st_size <= 150_000


def test_title_says_how_a_run_ended():
    ds = run().assign_attrs(ended="diverged at t=0.31")
    assert show.overview(ds).get_suptitle() == "by formula — diverged at t=0.31"
    assert show.overview(run()).get_suptitle() == "by formula"


def test_film_has_a_picture_for_every_frame_that_differs(tmp_path):
    ds = run(frames=4)
    ds["u"] = ds["u"] * (1 + ds["t"])
    with Image.open(show.show(ds, tmp_path / "a.gif")) as film:
        assert film.n_frames == 4
        first = np.asarray(film.convert("RGB")).astype(int)
        film.seek(3)
        last = np.asarray(film.convert("RGB")).astype(int)
    assert np.abs(first - last).max() > 50


def test_what_cannot_be_shown_is_refused(tmp_path):
    with pytest.raises(ValueError, match="neither fields nor gauges"):
        show.show(run()[["t"]], tmp_path / "a.png")
    with pytest.raises(ValueError, match="no fields"):
        show.show(run()[["volume"]], tmp_path / "a.gif")
    with pytest.raises(ValueError, match=r"end in \.png"):
        show.show(run(), tmp_path / "a.pdf")
    assert not list(tmp_path.iterdir())


def test_pictures_are_small_and_the_same_every_time(tmp_path):
    noise = np.random.default_rng(0).random((150, 150))
    for name in "ab":
        figure, ax = style.sheet()
        ax.imshow(noise)
        style.save(figure, tmp_path / f"{name}.png", largest=60_000)
    a, b = ((tmp_path / f"{name}.png").read_bytes() for name in "ab")
    assert a == b
    assert len(a) <= 60_000
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.png", "b.png"]


def test_cost_adds_up_what_datasets_say():
    one = xr.Dataset({"cpu_seconds": ("n", [1.0, np.nan, 2.0]), "n_steps": ("n", [1000, 200, 34]), "n_cells": 64})
    two = xr.Dataset({"n_cells": ("n", [128, 64])})
    assert style.cost({"a": one, "b": two}) == "Cost: 3 CPU seconds, 1 230 steps, 64 to 128 cells along a side"
    assert style.cost([xr.Dataset()]) == ""


def test_band_covers_what_a_check_accepts():
    _, ax = style.sheet()
    style.band(ax, 2.0, 0.25, label="book")
    box = ax.patches[0].get_extents().transformed(ax.transData.inverted())
    assert (box.y0, box.y1) == pytest.approx((1.75, 2.25))
    assert ax.get_lines()[0].get_ydata() == pytest.approx([2.0, 2.0])


def test_picture_of_1_54_shows_measured_over_predicted():
    schemes = ["explicit", "implicit", "semi-implicit", "predictor-printed", "predictor-corrected"]
    axes = {"viscosity": [0.0, 0.1], "tension": [1.0, 10.0], "width": [1.5, 3.0]}
    limit = xr.DataArray(
        [[2.0, 4.0], [3.0, 9.0]], {"width": [1.5, 3.0], "viscosity": [0.01, 0.1]}, ("width", "viscosity")
    )
    found = xr.DataArray([[1, 1], [1, 0]], limit.coords, limit.dims)
    datasets = {
        "stability_spectral": xr.Dataset({"deviation": (tuple(axes), np.full((2, 2, 2), 1e-14))}, axes),
        "stability_stepping": xr.Dataset({"excess": (tuple(axes), np.full((2, 2, 2), 1e-5))}, axes),
        "stability_schemes": xr.Dataset(
            {"radius": (("scheme", "ratio"), np.ones((5, 2)))}, {"scheme": schemes, "ratio": [0.99, 1.01]}
        ),
        "stability_drop": xr.Dataset({"limit": limit, "found": found, "predicted_lambda": xr.ones_like(limit)}),
    }
    figure = chapter1.stability_1_54(datasets, {"spectral_deviation": 1e-14})
    assert isinstance(figure, Figure)
    linear, _, real = figure.axes
    assert sorted(set(linear.get_lines()[0].get_ydata())) == [1e-14]
    lines = {line.get_label(): line.get_ydata() for line in real.get_lines()}
    assert lines["μ = 0.01"] == pytest.approx([2.0, 3.0])
    assert lines["μ = 0.1"] == pytest.approx([4.0, np.nan], nan_ok=True)  # no limit found: an open mark instead
