"""Frames become files that describe themselves; files become studies and VTK."""

import hashlib
import json
import struct
import tracemalloc
import weakref
import xml.etree.ElementTree as ET

import cf_xarray  # noqa: F401  the accessor
import netCDF4
import numpy as np
import pytest
import xarray as xr
import xgcm
from compliance_checker.runner import CheckSuite, ComplianceChecker
from fake_run import Frame, fields, frames, scene

from fsiwork import dataset, layout
from fsiwork.export import export

pytestmark = pytest.mark.filterwarnings("ignore:The ioos_sos checker:DeprecationWarning")

KNOWN = ["grid_topology is not a valid cf_role value. It must be one of timeseries_id, profile_id, trajectory_id"]
BOXES = {
    "walls": {},
    "periodic": {"edges": "periodic"},
    "mixed": {"edges": {"x": [{"kind": "periodic"}] * 2, "y": [{"kind": "no-slip"}] * 2, "z": None}},
    "3D": {"cells": 8, "length": (2.0, 1.0, 1.5)},
}


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.fixture(params=BOXES)
def any_scene(request):
    return scene(frames=3, **BOXES[request.param])


@pytest.fixture
def run(tmp_path):
    """A small plane run between walls: its scene and its file."""
    path = tmp_path / "run.nc"
    dataset.write(frames, scene(), path)
    return scene(), path


def test_divergence_from_the_file_alone(any_scene, tmp_path):
    dataset.write(frames, any_scene, tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc") as ds:
        grid = xgcm.Grid(ds)
        found = 0.0
        for name, d in zip("uvw", "xyz", strict=False):
            if name in ds:
                h = float(ds[f"{d}_c"][1] - ds[f"{d}_c"][0])
                ring = {"padding": "periodic"} if ds.sizes[f"{d}_n"] == ds.sizes[f"{d}_c"] else {}
                found = found + grid.diff(ds[name], d.upper(), **ring) / h
        assert found.dims == ("t", *(f"{d}_c" for d in "zyx" if f"{d}_c" in ds.dims))
        want, geometry = 0.0, layout.geometry(any_scene)
        for (face,), q in (v for k, v in fields(any_scene, 1.0).items() if k in "uvw"):
            q = np.concatenate([q, np.take(q, [0], face)], face) if geometry.periodic[face] else q
            want = want + np.diff(q, axis=face) / geometry.h
        assert np.abs(found.isel(t=0).values - want.T).max() < 1e-12
        assert np.abs(want).max() > 1.0


def test_values_dimensions_and_words(run):
    small, path = run
    with dataset.open_run(path) as ds:
        assert ds.u.dims == ("t", "y_c", "x_n") and ds.v.dims == ("t", "y_n", "x_c")
        assert ds.p.dims == ("t", "y_c", "x_c")
        for name, (_, q) in fields(small, 1.0).items():
            assert np.array_equal(ds[name].isel(t=0).values, q.T)
        assert np.allclose(ds.t, 0.2 * np.arange(7)) and np.allclose(ds.t_step, 0.05 * np.arange(1, 25))
        assert ds.volume.dims == ("t_step",) and ds.x_n[0] == 0.5 and ds.x_n[-1] == 2.5
        assert json.loads(ds.scene) == small and ds.ended == "complete" and ds.source_hash
        assert json.loads(ds.versions)["numpy"] == np.__version__
        for name, variable in ds.variables.items():
            assert name == "grid" or (variable.attrs["long_name"] and variable.attrs["units"] == "1"), name
            assert "axis" not in variable.attrs
        assert ds.u.location == "edge1" and ds.v.location == "edge2" and ds.p.location == "face"
        assert "topology" in repr(ds.cf).lower() or "SGRID" in repr(ds.cf)
    with netCDF4.Dataset(path) as file:
        assert file["u"].chunking() == [1, 8, 17] and file["u"].dtype == "f8"
        assert file["u"].filters()["zlib"] and file["u"].filters()["shuffle"] and file["u"].filters()["complevel"] == 1
        assert not any("_FillValue" in v.ncattrs() for v in file.variables.values())


def test_f4_is_an_option_of_the_scene(tmp_path):
    small = scene(output={"dtype": "float32"})
    ds = dataset.to_dataset(frames, small)
    assert ds.u.dtype == np.float32 and ds.x_c.dtype == ds.volume.dtype == ds.t.dtype == np.float64


def findings(path, out):
    CheckSuite.load_all_available_checkers()
    ComplianceChecker.run_checker(str(path), ["cf:1.11"], 0, "normal", output_filename=str(out), output_format=["json"])
    report = json.loads(out.read_text())
    report = report.get("cf:1.11") or next(iter(report.values()))["cf:1.11"]
    return [m for level in ("high", "medium", "low") for r in report[f"{level}_priorities"] for m in r["msgs"]]


def test_cf_with_the_one_known_finding(any_scene, tmp_path):
    dataset.write(frames, any_scene, tmp_path / "run.nc")
    assert findings(tmp_path / "run.nc", tmp_path / "report.json") == KNOWN


def test_the_same_scene_gives_the_same_bytes(any_scene, tmp_path):
    for name in ("a.nc", "b.nc"):
        dataset.write(frames, any_scene, tmp_path / name)
    assert digest(tmp_path / "a.nc") == digest(tmp_path / "b.nc")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.cost.json", "a.nc", "b.cost.json", "b.nc"]


def test_interface_as_points(run):
    _, path = run
    with dataset.open_run(path) as ds:
        first = slice(0, int(ds.contour_count[0]))
        radius = np.hypot(ds.contour_x[first] - 1.5, ds.contour_y[first] - 1.0)
        assert np.abs(radius - 0.25).max() < 0.02
        assert ds.contour_count.sum() == ds.sizes["point"] and set(ds.contour_piece.values) == {0}
        assert ds.contour_count.sample_dimension == "point" and np.isfinite(ds.contour_x).all()


def test_interface_is_whole_across_a_periodic_side():
    grid = layout.geometry(scene(edges="periodic"))
    x, y = (grid.coordinates()[k] for k in ("x_c", "y_c"))
    far = np.minimum(abs(x - 0.5), abs(x - 2.5))  # a disc around the seam
    found = layout.contour(np.hypot(far[None, :], (y - 1.0)[:, None]) - 0.3, grid)
    assert found["x"].max() > 2.43 and found["x"].min() > 0.5 and set(found["piece"]) == {0, 1}
    assert len(layout.contour(np.full((8, 16), np.nan), grid)["x"]) == 0


def test_several_bodies_and_components(tmp_path):
    small, q = scene(), np.arange(16.0 * 8).reshape(16, 8)
    found = {("phi", 1): (None, q - 1), ("phi", 0): (None, q), "Y_x": (None, q), "Y_y": (None, 2 * q)}
    found["mu"] = (None, np.stack([q, -q]))
    gauges = {"t": np.zeros(1), "volume": np.array([[1.0, 2.0]])}
    ds = dataset.to_dataset([Frame(0.0, 0, found, gauges, ended="complete")], small)
    assert ds.phi.dims == ds.mu.dims == ("t", "body", "y_c", "x_c") and ds.volume.dims == ("t_step", "body")
    assert np.array_equal(ds.phi[0, 1], q.T - 1) and np.array_equal(ds.mu[0, 1], -q.T)
    assert ds.Y.dims == ("t", "component", "y_c", "x_c") and list(ds.component.values) == ["x", "y"]
    assert np.array_equal(ds.Y.sel(component="y")[0], 2 * q.T)


def test_a_diverged_run_is_data(tmp_path):
    def dying(scene, resume=None):
        yield from (f for f in frames(scene) if f.step <= 8)
        rows = {"t": np.array([0.45]), "dt": np.array([0.05]), "volume": np.array([np.inf])}
        yield Frame(0.45, 9, {}, rows, {}, "diverged at t=0.45 (step 9): |u| = inf at cell (3, 7)")

    assert dataset.write(dying, scene(), tmp_path / "run.nc").startswith("diverged")
    with dataset.open_run(tmp_path / "run.nc") as ds:
        assert ds.ended.startswith("diverged at t=0.45")
        assert ds.sizes["t"] == 3 and ds.sizes["t_step"] == 9 and np.isinf(ds.volume[-1])
        assert np.isfinite(ds.u).all()


def test_frames_do_not_gather_in_memory(tmp_path):
    seen, most = [], 0

    def watched(scene, resume=None):
        nonlocal most
        for frame in frames(scene):
            seen.append(weakref.ref(frame.fields["u"][1]))
            yield frame
            del frame
            most = max(most, sum(ref() is not None for ref in seen))

    dataset.write(watched, scene(frames=12), tmp_path / "run.nc")
    assert len(seen) == 13 and 1 <= most <= 2


@pytest.mark.parametrize("stop", [1, 4, 7, 23])
def test_a_stopped_run_goes_on_to_the_same_bytes(run, tmp_path, stop):
    small, reference = run
    path = tmp_path / "again.nc"
    ended = dataset.write(lambda s, resume=None: frames(s, resume, stop_after=stop), small, path)
    assert ended.startswith("stopped") and not path.exists()
    while ended != "complete":
        ended = dataset.write(lambda s, resume=None: frames(s, resume, stop_after=5), small, path, resume=True)
        assert path.exists() == (ended == "complete")
    assert digest(path) == digest(reference) and not path.with_name("again.nc.frames").exists()


def test_a_state_of_another_scene_is_refused(tmp_path):
    path = tmp_path / "run.nc"
    dataset.write(lambda s, resume=None: frames(s, resume, stop_after=5), scene(), path)
    with pytest.raises(ValueError, match=r"another scene or other sources; run without --resume$"):
        dataset.write(frames, scene(cells=32), path, resume=True)
    assert dataset.write(frames, scene(cells=32), path) == "complete"


def test_what_is_not_a_run_is_refused_in_one_line(run, tmp_path):
    _, path = run
    (tmp_path / "text.nc").write_text("hello")
    (tmp_path / "empty.nc").touch()
    (tmp_path / "short.nc").write_bytes(path.read_bytes()[:3000])
    xr.Dataset({"a": 1}).to_netcdf(tmp_path / "other.nc")
    with pytest.raises(FileNotFoundError, match=r"none\.nc: no such file$"):
        dataset.open_run(tmp_path / "none.nc")
    for name in ("text", "empty", "short", "other"):
        with pytest.raises(ValueError, match=rf"{name}\.nc: not a (netCDF|finished)") as error:
            dataset.open_run(tmp_path / f"{name}.nc")
        assert "\n" not in str(error.value)


# -------------------------------------------------------------------------------------------------------------- studies
def sweep(folder, **more):
    paths, points = [], []
    for cells in (16, 32):
        for scheme in ("explicit", "semi-implicit"):
            ended = "diverged at t=1" if (cells, scheme) == (32, "explicit") else "complete"
            paths.append(folder / f"{cells}_{scheme}.nc")
            points.append({"box.cells": cells, "bodies.0.coupling": scheme})
            dataset.write(lambda s, resume=None, e=ended: frames(s, end=e), scene(cells, **more), paths[-1])
    return paths, points


def test_a_study_has_its_dials_as_dimensions(tmp_path):
    paths, points = sweep(tmp_path)
    dataset.join(
        [*paths, tmp_path / "none.nc"], [*points, {"box.cells": 64, "bodies.0.coupling": "explicit"}], tmp_path / "s.nc"
    )
    with (
        dataset.open_study(tmp_path / "s.nc") as study,
        dataset.open_run(paths[3]) as run,
        dataset.open_run(paths[0]) as low,
    ):
        assert study.u.dims == ("cells", "coupling", "t", "y_c", "x_n") and study.u.chunks is not None
        assert list(study.cells.values) == [16, 32, 64] and list(study.coupling.values) == ["explicit", "semi-implicit"]
        point = study.sel(cells=32, coupling="semi-implicit")
        assert np.array_equal(point.u, run.u) and np.array_equal(point.volume, run.volume)
        small = study.u.sel(cells=16, coupling="explicit")
        assert (
            np.array_equal(small[:, :8, :17], low.u)
            and np.isnan(small[:, 8:]).all()
            and np.isnan(small[:, :, 17:]).all()
        )
        assert np.array_equal(study.x_c_of_run.sel(cells=16, coupling="explicit")[:16], low.x_c)
        assert np.array_equal(study.t, run.t) and study.volume.dims == ("cells", "coupling", "t_step")
        assert np.isnan(study.volume.sel(cells=[32, 64], coupling="explicit")).all()
        assert study.ended.sel(coupling="explicit").values.tolist() == ["complete", "diverged at t=1", "missing"]
        assert json.loads(str(study.scene.sel(cells=32, coupling="explicit").values)) == scene(32)
    assert findings(tmp_path / "s.nc", tmp_path / "report.json") == []


def test_a_study_of_chosen_variables_with_the_diverged(tmp_path):
    paths, points = sweep(tmp_path)
    dataset.join(paths, points, tmp_path / "s.nc", keep=["volume"], keep_diverged=True)
    with dataset.open_study(tmp_path / "s.nc") as study:
        assert set(study.data_vars) == {"volume", "ended", "scene"} and np.isfinite(study.volume).all()


def test_joining_takes_one_frame_at_a_time(tmp_path):
    paths, points = sweep(tmp_path, frames=30)
    tracemalloc.start()
    dataset.join(paths, points, tmp_path / "s.nc")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    with dataset.open_study(tmp_path / "s.nc") as study:
        assert peak < 0.5 * study.nbytes


def test_results_of_a_function_become_a_study(tmp_path):
    points = [{"box.cells": n} for n in (16, 32, 64)]
    results = [{"limit": 0.5, "curve": [1.0, 2.0, 3.0], "why": "found"}, {"limit": 0.25, "curve": np.ones(2)}, {}]
    dataset.tabulate(results, points, tmp_path / "s.nc")
    with dataset.open_study(tmp_path / "s.nc") as study:
        assert study.limit.values[:2].tolist() == [0.5, 0.25] and np.isnan(study.limit[2])
        assert study.curve.dims == ("cells", "curve_i") and np.isnan(study.curve[1, 2]) and study.curve[0, 2] == 3.0
        assert study.why.values.tolist() == ["found", "", ""]


def test_a_dial_may_have_the_name_of_a_gauge(tmp_path):
    paths, _ = sweep(tmp_path)
    dataset.join(paths[:2], [{"volume": 1.0}, {"volume": 2.0}], tmp_path / "s.nc", keep=["volume", "dt"])
    with dataset.open_study(tmp_path / "s.nc") as study, dataset.open_run(paths[1]) as run:
        assert list(study.volume.values) == [1.0, 2.0]
        assert np.array_equal(study.volume_of_run.sel(volume=2.0), run.volume)


def test_names_of_dials():
    names = dataset.axis_names(["box.cells", "bodies.0.width.length", "bodies.0.stretch", "bodies.1.stretch"])
    assert list(names.values()) == ["cells", "width_length", "bodies_0_stretch", "bodies_1_stretch"]


# ------------------------------------------------------------------------------------------------------------------ VTK
def vtk_arrays(path):
    """Arrays of an image file by name, flat (x fastest), and its extent."""
    head, _, tail = path.read_bytes().partition(b'<AppendedData encoding="raw">')
    tail = tail[tail.index(b"_") + 1 :]
    root, found = ET.fromstring(head + b"</VTKFile>"), {}
    for item in root.iter("DataArray"):
        start = int(item.attrib["offset"])
        (size,) = struct.unpack_from("<Q", tail, start)
        found[item.attrib["Name"]] = np.frombuffer(tail[start + 8 : start + 8 + size], "f8")
    return found, root.find("ImageData").attrib


@pytest.mark.parametrize("box", ["walls", "periodic", "3D"])
def test_export_has_everything_at_centres(tmp_path, box):
    small = scene(frames=2, **BOXES[box])
    dataset.write(frames, small, tmp_path / "run.nc")
    with dataset.open_run(tmp_path / "run.nc") as ds:
        series = export(ds, tmp_path / "vtk")
        times = [float(item.attrib["timestep"]) for item in ET.parse(series).getroot().iter("DataSet")]
        names = [item.attrib["file"] for item in ET.parse(series).getroot().iter("DataSet")]
        assert times == list(ds.t.values) and names == [f"frame_{k:05d}.vti" for k in range(3)]
        arrays, extent = vtk_arrays(tmp_path / "vtk" / names[1])
        n = layout.geometry(small).n
        assert [int(w) for w in extent["WholeExtent"].split()][1::2] == [*n, 1][:3]
        assert [float(w) for w in extent["Origin"].split()][:2] == [0.5, 0.5]
        assert np.array_equal(arrays["phi"], ds.phi[1].values.ravel())
        u = ds.u[1].values
        u = np.concatenate([u, u[..., :1]], -1) if box == "periodic" else u
        assert np.allclose(arrays["velocity"].reshape(-1, 3)[:, 0], (0.5 * (u[..., 1:] + u[..., :-1])).ravel())
