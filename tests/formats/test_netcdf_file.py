"""Claims about recordings as netCDF files: ranges, positions on Earth, round trips."""

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import insonify
from insonify.formats import netcdf_file
from insonify.formats.netcdf_file import read_netcdf, write_netcdf
from insonify.formats.zarr_store import StoreError, open_recording
from insonify.plotting import recording as drawn
from insonify.processing import multibeam_soundings
from insonify.recording_run import record
from oracles.arrays import elements_scenario
from oracles.few_of import few_of
from oracles.scenes import nominal, point

SMALL = {"paths": {"geometry": "slice"}, "track": {"window": (0.1, 0.11), "pings": 2}}
RECEIVER = {"receiver_track": {"kind": "static", "position": (5.0, 0.0, 11.0), "pings": 2, "window": (0.1, 0.11)}}


@pytest.fixture(scope="module", params=["coherent", "incoherent"])
def sound(request):
    """A small recording of either field."""
    return insonify.simulate(nominal(field=request.param, **SMALL))


@pytest.mark.parametrize("engine", ["netcdf4", "scipy"])
def test_a_recording_comes_back_bit_by_bit(sound, tmp_path, monkeypatch, engine):
    """Values, coordinates, units and attributes; as netCDF 4, and as netCDF 3 where nothing else is installed."""
    if engine == "netcdf4":
        pytest.importorskip("netCDF4")
    monkeypatch.setattr(netcdf_file, "_engine", lambda: engine)
    back = insonify.read_netcdf(insonify.write_netcdf(sound, tmp_path / "sound.nc"))
    xr.testing.assert_equal(back, sound)
    assert set(back.coords) == set(sound.coords)
    for name, value in sound.attrs.items():
        assert back.attrs[name] == value, name
    for name in sound.variables:
        assert back[name].attrs == sound[name].attrs, name
        assert back[name].dtype == sound[name].dtype or engine == "scipy"


def test_a_stored_recording_and_labels_can_be_written_too(tmp_path):
    """As opened from the folder of a run."""
    scenario = nominal(**SMALL)
    record(scenario, tmp_path / "a.zarr", with_labels=True)
    opened = open_recording(tmp_path / "a.zarr")
    xr.testing.assert_equal(read_netcdf(write_netcdf(opened, tmp_path / "a.nc")), opened.load())
    labels = insonify.labels(scenario)
    xr.testing.assert_equal(read_netcdf(write_netcdf(labels, tmp_path / "labels.nc")), labels)


@few_of((0, 2, 3), "options", [{}, {"engine": "netcdf4"}, {"engine": "scipy"}, {"auto_complex": True}])
def test_the_plain_method_of_xarray_writes_a_recording(sound, tmp_path, options):
    """Simulated, opened from a folder or one ping of it, however xarray writes it: every bit comes back."""
    if options != {"engine": "scipy"}:
        pytest.importorskip("netCDF4")
    record(nominal(field="coherent" if "pressure" in sound else "incoherent", **SMALL), tmp_path / "a.zarr")
    for whole in (sound, open_recording(tmp_path / "a.zarr").isel(ping=[1])):
        whole.to_netcdf(tmp_path / "a.nc", **options)
        back = read_netcdf(tmp_path / "a.nc")
        xr.testing.assert_equal(back, whole.load())
        assert dict(back.attrs) == dict(whole.attrs)
        for name in whole.variables:
            assert back[name].attrs == whole[name].attrs and (
                back[name].dtype == whole[name].dtype or "scipy" in str(options)
            )


def test_parts_are_packed_as_the_whole_would_be(tmp_path):
    """An encoding given for the pressure is that of its real and of its imaginary part."""
    pytest.importorskip("netCDF4")
    sound = insonify.simulate(nominal(**SMALL))
    sound.to_netcdf(tmp_path / "a.nc", encoding={"pressure": {"zlib": True}, "time": {"zlib": False}})
    with xr.open_dataset(tmp_path / "a.nc") as plain:
        assert plain["pressure_real"].encoding["zlib"] and plain["pressure_imag"].encoding["zlib"]
        assert not plain["time"].encoding["zlib"]


def test_the_parts_are_plain_variables(tmp_path):
    """For programs that know nothing of this one: real and imaginary part, with units."""
    sound = insonify.simulate(nominal(**SMALL))
    with xr.open_dataset(write_netcdf(sound, tmp_path / "a.nc"), decode_times=False) as plain:
        assert plain["pressure_real"].attrs["units"] == "uPa"
        np.testing.assert_array_equal(plain["pressure_imag"].values, sound["pressure"].values.imag)


def test_what_cannot_be_written_or_read_is_refused(tmp_path):
    """Names that collide, files that are not there, files of another kind."""
    twice = xr.Dataset({"p": ("t", np.ones(2, complex)), "p_imag": ("t", np.ones(2))})
    with pytest.raises(ValueError, match="p and p_imag"):
        write_netcdf(twice, tmp_path / "a.nc")
    with pytest.raises(StoreError, match="no such file"):
        read_netcdf(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("not netCDF")
    with pytest.raises(StoreError, match="cannot be read as netCDF"):
        read_netcdf(tmp_path / "text.nc")


def test_an_echo_lies_at_its_slant_range(tmp_path):
    """A point 80 m away: in memory, and as stored; between two platforms there is no such range."""
    scenario = nominal(targets=[point(0, 80, 11)], paths={"contributions": ["target"], "max_reflections": 0},
                       track={"window": (0.1, 0.11)})  # fmt: skip
    sound = insonify.simulate(scenario)
    record(scenario, tmp_path / "a.zarr")
    for held in (sound, open_recording(tmp_path / "a.zarr")):
        assert held["slant_range"].dims == ("time",) and held["slant_range"].attrs["units"] == "m"
        assert "slant_range" in held.coords
        strongest = int(np.abs(held["pressure"].values[0, 0]).argmax())
        assert float(held["slant_range"][strongest]) == pytest.approx(80 + 0.075, abs=0.1)  # the middle of the pulse
    apart = insonify.simulate(nominal(**SMALL | RECEIVER | {"paths": {"contributions": []}}))
    assert "slant_range" not in apart


def test_a_recording_and_its_soundings_hold_their_position(tmp_path):
    """Of a grid in degrees: latitude and longitude of the origin; of one in metres its northing and easting."""
    netcdf = pytest.importorskip("netCDF4")
    north, east = np.arange(48.0, 48.002, 1e-4), np.arange(-68.0, -67.998, 1e-4)
    with netcdf.Dataset(tmp_path / "bed.nc", "w") as file:
        for name, at in (("lat", north), ("lon", east)):
            file.createDimension(name, len(at))
            file.createVariable(name, "f8", (name,))[:] = at
            file[name].units = "degrees_north" if name == "lat" else "degrees_east"
        file.createVariable("depth", "f4", ("lat", "lon"))[:] = 20.0
    np.savez(tmp_path / "bed.npz", depth=np.full((20, 20), 20.0), north=5e6 + np.arange(20), east=4e5 + np.arange(20))
    base = {**SMALL, "paths": {"contributions": []}}
    grid = {"kind": "grid", "file": str(tmp_path / "bed.nc"), "latitude": "48.001 deg", "longitude": "-67.999 deg"}
    attributes = insonify.simulate(nominal(seabed={"relief": [grid]}, **base)).attrs
    assert attributes["origin_latitude"] == pytest.approx(48.001) and attributes["origin_longitude"] == pytest.approx(
        -67.999
    )
    assert attributes["crs"] == "EPSG:4326"
    metric = {"kind": "grid", "file": str(tmp_path / "bed.npz"), "origin": [5e6 + 5, 4e5 + 7]}
    attributes = insonify.simulate(nominal(seabed={"relief": [metric]}, **base)).attrs
    assert (attributes["origin_northing"], attributes["origin_easting"]) == (
        5e6 + 5,
        4e5 + 7,
    ) and "origin_latitude" not in attributes
    assert "origin_latitude" not in insonify.simulate(nominal(**base)).attrs
    elements = elements_scenario([(0, 20, 15)])
    received = insonify.simulate(elements, pings=0).assign_attrs(attributes)
    assert multibeam_soundings(received, [0.0]).attrs["origin_northing"] == 5e6 + 5


def test_a_projected_grid_has_its_latitude(tmp_path):
    """UTM zone 32, 500 km east, on its central meridian: 9 degrees east."""
    rasterio = pytest.importorskip("rasterio")
    turn = rasterio.transform.from_origin(500_000 - 20, 5_300_000 + 20, 1, 1)
    with rasterio.open(tmp_path / "bed.tif", "w", driver="GTiff", width=40, height=40, count=1, dtype="float32",
                       crs="EPSG:32632", transform=turn) as file:  # fmt: skip
        file.write(np.full((40, 40), -20, np.float32), 1)
    grid = {"kind": "grid", "file": str(tmp_path / "bed.tif"), "origin": [5_300_000, 500_000]}
    attributes = insonify.simulate(nominal(seabed={"relief": [grid]}, **SMALL | {"paths": {"contributions": []}})).attrs
    assert attributes["origin_longitude"] == pytest.approx(9.0, abs=1e-6)
    assert attributes["origin_latitude"] == pytest.approx(
        47.853, abs=2e-3
    )  # 5300 km along the meridian, by the UTM series
    assert "UTM" in attributes["crs"]


def test_a_log_in_degrees_gives_the_origin(tmp_path):
    """Its first row, or the origin that the scenario names."""
    rows = "\n".join(f"{t},{48 + t * 1e-5:.6f},-68.0,11,0" for t in range(5))
    (tmp_path / "log.csv").write_text(f"time,latitude,longitude,depth,heading [deg]\n{rows}\n")
    track = {"kind": "navigation", "file": str(tmp_path / "log.csv"), "pings": 1, "window": (0.1, 0.11)}
    base = {"paths": {"contributions": []}}
    attributes = insonify.simulate(nominal(**base, receive={}, transmit={}).with_("track", track)).attrs
    assert (attributes["origin_latitude"], attributes["origin_longitude"]) == (48.0, -68.0)
    attributes = insonify.simulate(nominal(**base).with_("track", {**track, "origin": [48.001, -68.001]})).attrs
    assert (attributes["origin_latitude"], attributes["origin_longitude"]) == (48.001, -68.001)


def test_a_picture_is_a_figure_or_a_file(sound, tmp_path):
    """Without a path the figure comes back, with its axes; a folder of a run is drawn as what it holds."""
    figure = drawn(sound)
    assert figure.axes and figure.axes[0].get_xlabel()
    figure.axes[0].axvline(80)
    assert drawn(sound, tmp_path / "a.png") == tmp_path / "a.png" and (tmp_path / "a.png").stat().st_size > 1000
    record(nominal(**SMALL), tmp_path / "b.zarr")
    assert drawn(tmp_path / "b.zarr", ping=1).axes
    with pytest.raises(StoreError, match="not a recording"):
        drawn(tmp_path / "none.zarr")


@pytest.mark.parametrize(
    ("package", "extra"), [("trimesh", "targets"), ("netCDF4", "io"), ("rasterio", "io"), ("fsspec", "remote")]
)
def test_a_missing_package_is_reported_with_a_command_that_works(package, extra):
    """From a checkout: its own extra, by its place; nothing that an index would have to know of this project."""
    from insonify.data_file import EXTRAS, install_advice

    attributes = install_advice(extra)
    assert package in EXTRAS[extra]
    assert attributes.startswith("pip install ") and "'insonify[" not in attributes
    if attributes.endswith(f"[{extra}]'"):
        folder = attributes.removeprefix("pip install '").removesuffix(f"[{extra}]'")
        listed = subprocess.run([sys.executable, "-c", f"import tomllib; print(tomllib.load(open({folder!r} + "
                                "'/pyproject.toml', 'rb'))['project']['optional-dependencies'])"],
                                capture_output=True, text=True, check=True)  # fmt: skip
        assert package in listed.stdout


def test_an_installation_without_a_checkout_names_the_packages(tmp_path, monkeypatch):
    """There is no extra to install from, but its packages have names."""
    from insonify import data_file

    monkeypatch.setattr(data_file, "__file__", str(tmp_path / "site-packages" / "insonify" / "data_file.py"))
    assert data_file.install_advice("io") == "pip install netCDF4 rasterio h5py"
