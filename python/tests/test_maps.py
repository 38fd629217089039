"""Maps in Python and in files: the bytes that the program writes, and the way back."""

import os
import pickle
import subprocess

import numpy as np
import pytest
import tiltrim
from conftest import ROOT
from written_models import held_ball

pytest.importorskip("xarray")

STUDIES = {
    "map_corridor": (ROOT / "studies/map_corridor.toml").read_text(),
    "levitation": (ROOT / "studies/levitation.toml").read_text(),  # two conditions, a [model]
    # second branches beyond the fold at 9.15 m/s, points without a trim, an axis in degrees
    "stall": """
[[condition]]
name = "level"
V = 15.0
gamma_deg = 0.0
eta_deg = 0.0
[[condition]]
name = "descent"
V = 15.0
gamma_deg = -4.0
eta_deg = 0.0
[[sweep.axis]]
key = "V"
values = [8.0, 9.16, 9.2, 9.4, 12.0]
with = [{key = "eta_deg", values = [0.0, 0.0, 0.0, 0.0, 30.0]}]
[[sweep.axis]]
key = "gains.K_Lp"
values = [0.5, 1.0, 8.0]
""",
}


@pytest.fixture(scope="module", params=STUDIES)
def maps(request, tmp_path_factory):
    """The program's file, and the Dataset of the same study."""
    folder = tmp_path_factory.mktemp("maps")
    study = folder / "study.toml"
    study.write_text(STUDIES[request.param])
    path = os.environ.get("TILTRIM_PROGRAM", str(ROOT / "build/bin/tiltrim"))
    done = subprocess.run([path, "sweep", study, "-o", folder / "map.nc"], capture_output=True)
    assert done.returncode in (0, 1), done.stderr
    return folder / "map.nc", tiltrim.sweep(tiltrim.read_study(study))


def variables(file):
    """Every variable of a file: dimensions, type, attributes and bytes; and its own attributes."""
    netCDF4 = pytest.importorskip("netCDF4")
    with netCDF4.Dataset(file) as data:
        data.set_auto_maskandscale(False)
        data.set_auto_chartostring(False)
        found = {
            name: (v.dimensions, v.dtype.str, repr(v.__dict__), v[...].tobytes())
            for name, v in data.variables.items()
        }
        return {**found, "": repr(data.__dict__)}


def test_a_saved_map_is_the_programs(maps, tmp_path):
    file, ds = maps
    tiltrim.save(ds, tmp_path / "own.nc")
    own, programs = variables(tmp_path / "own.nc"), variables(file)
    assert list(own) == list(programs)
    for name, value in programs.items():
        assert own[name] == value, name
    assert (tmp_path / "own.nc").read_bytes() == file.read_bytes()


def test_an_opened_map_is_the_one_that_was_swept(maps, tmp_path):
    file, ds = maps
    opened = tiltrim.open_map(file)
    assert opened.identical(ds)
    assert opened.identical(pickle.loads(pickle.dumps(ds)))
    tiltrim.save(opened, tmp_path / "again.nc")
    assert (tmp_path / "again.nc").read_bytes() == file.read_bytes()
    assert len(opened.spectral_abscissa.to_dataframe()) == opened.status.size


def test_the_words_are_the_files_flags(maps):
    """The file as xarray reads it, decoded by its own flag_meanings."""
    xarray = pytest.importorskip("xarray")
    file, ds = maps
    with xarray.open_dataset(file, mask_and_scale=False) as raw:
        for name in ("status", "verdict", "crossing_kind", "interval_verdict"):
            words = [*raw[name].attrs["flag_meanings"].split(), ""]
            assert [words[k] for k in raw[name].values.ravel()] == ds[name].values.ravel().tolist()
        kept = [name for name in ds.variables if name in raw.variables and ds[name].dtype == float]
        assert len(kept) > 12
        for name in kept:
            scale = raw[name].attrs.get("scale_factor", 1.0)
            np.testing.assert_allclose(ds[name].values, raw[name].values * scale, rtol=1e-15)
            assert ds[name].attrs.get("units") == raw[name].attrs.get("units")
            assert ds[name].attrs["long_name"] == raw[name].attrs["long_name"]


def test_the_stall_has_what_the_comparison_needs():
    ds = tiltrim.sweep(tiltrim.parse_study(STUDIES["stall"], "stall.toml"))
    assert ds.sizes["second"] == ds.second_branch.values.sum() > 0
    assert "" in ds.verdict.values and len(ds.reason_text) > 1 and ds.sizes["crossing"] > 0
    assert ds.eta_deg.attrs["si"] == "eta_deg_si"
    np.testing.assert_allclose(ds.eta_deg_si, np.radians(ds.eta_deg), rtol=1e-15)
    at = np.unravel_index(int(ds.second_point[0]), ds.status.shape)
    one = np.append(ds.second_eigenvalue.values[0], ds.eigenvalue.values[at])
    assert np.isfinite(one).all() and len(np.unique(one)) > 6  # two equilibria


def test_a_map_of_a_model_comes_back(tmp_path):
    """Without inputs and without a study; an axis named like a variable of the file."""
    ball = held_ball()
    ds = tiltrim.sweep([ball], axes={"mode": {"k_p": [80.0, 120.0]}, "k_d": [1.0, 2.0]})
    assert ds.status.dims == ("condition", "mode_axis", "k_d")
    tiltrim.save(ds, tmp_path / "map.nc")
    assert tiltrim.open_map(tmp_path / "map.nc").identical(ds)
    alone = tiltrim.sweep(ball, axes={"mode": {"k_p": [80.0, 120.0]}, "k_d": [1.0, 2.0]})
    tiltrim.save(alone, tmp_path / "alone.nc")
    assert (tmp_path / "alone.nc").read_bytes() == (tmp_path / "map.nc").read_bytes()
    assert tiltrim.open_map(tmp_path / "alone.nc").isel(condition=0).identical(alone)


def test_what_is_no_map_is_refused(tmp_path):
    ds = tiltrim.sweep([held_ball()], axes={"k_p": [80.0, 120.0], "k_d": [1.0, 2.0]})
    file = tmp_path / "map.nc"
    for part, why in (
        (ds.isel(k_d=0), r"a map over condition, k_p, whose axes were k_p, k_d"),
        (ds.drop_vars("status"), "no map"),
        (ds.assign(verdict=ds.verdict.where(False, "good")), "verdict 'good'"),
        (ds.assign(second_branch=ds.second_branch | True), "second branches are at other points"),
    ):
        with pytest.raises(tiltrim.InvalidArgument, match=why):
            tiltrim.save(part, file)
    assert not file.exists()
    with pytest.raises(FileNotFoundError):
        tiltrim.open_map(file)
    file.write_text("no map")
    with pytest.raises(OSError, match="is not a NetCDF-4 file"):
        tiltrim.open_map(file)
    with pytest.raises(OSError, match="No such file"):
        tiltrim.save(ds, tmp_path / "missing" / "map.nc")
