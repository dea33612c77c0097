"""Bathymetry files of four kinds: what was written is read, the right way up, and nothing is guessed."""

import os
from pathlib import Path

import numpy as np
import pytest

from insonify.scene.seabed import Seabed
from insonify.scene.terrain.bathymetry_file import GridError, metres_per_degree, read_grid

REAL = Path(os.environ.get("INSONIFY_DATA", "data"), "jd211-bathymetry-utm2n.bag")
DEPTH = 20 + np.arange(20.0).reshape(4, 5)  # rows to the north, columns to the east


def tif(path, values, *, crs="EPSG:32602", origin=(7_000_000.0, 600_000.0), step=2.0, nodata=None, turn=0.0):
    """A GeoTIFF, rows from the north down as rasters are."""
    rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed: pip install '.[io]'")
    top = origin[0] + (len(values) - 0.5) * step
    transform = rasterio.Affine(step, turn, origin[1] - step / 2, turn, -step, top)
    with rasterio.open(path, "w", driver="GTiff", height=values.shape[0], width=values.shape[1], count=1,
                       dtype="float32", crs=crs, transform=transform, nodata=nodata) as file:  # fmt: skip
        file.write(values[::-1].astype(np.float32), 1)
    return str(path)


def nc(path, values, *, name="elevation", axes=("y", "x"), at=None, units="m", axis_units="m", **attributes):
    """A netCDF grid."""
    netcdf = pytest.importorskip("netCDF4", reason="netCDF4 is not installed: pip install '.[io]'")
    with netcdf.Dataset(path, "w") as file:
        for axis, count in zip(axes, values.shape, strict=True):
            file.createDimension(axis, count)
            file.createVariable(axis, "f8", (axis,))[:] = np.arange(count) * 2.0 if at is None else at[axis]
            file[axis].units = axis_units
        grid = file.createVariable(name, "f4", axes, fill_value=-9999.0)
        grid[:] = np.ma.masked_invalid(values)
        grid.units = units
        for key, value in attributes.items():
            setattr(grid, key, value)
    return str(path)


def npz(path, **arrays):
    """A numpy file."""
    np.savez(path, **arrays)
    return str(path)


def test_a_geotiff_is_read_north_up_with_its_gaps(tmp_path):
    """Elevations, cells by their middles, no-data as holes."""
    values = -DEPTH.copy()
    values[2, 3] = -32768
    found = read_grid(tif(tmp_path / "a.tif", values, nodata=-32768))
    np.testing.assert_array_equal(np.isnan(found.elevation), values == -32768)
    np.testing.assert_allclose(found.elevation[values > -1000], -DEPTH[values > -1000])
    assert (found.north, found.east, found.north_step, found.east_step) == (7_000_000, 600_000, 2, 2)
    assert "elevations by their sign" in found.description


@pytest.mark.parametrize("key", ["crs_wkt", "spatial_ref"])
def test_netcdf_states_its_coordinate_system(tmp_path, key):
    """The system of the grid mapping is the grid's, so that recordings have latitudes."""
    netcdf = pytest.importorskip("netCDF4", reason="netCDF4 is not installed: pip install '.[io]'")
    crs = pytest.importorskip("rasterio.crs", reason="rasterio is not installed: pip install '.[io]'")
    path = nc(tmp_path / "a.nc", -DEPTH, grid_mapping="utm")
    assert read_grid(path).crs == ""
    with netcdf.Dataset(path, "a") as file:
        setattr(file.createVariable("utm", "i4"), key, crs.CRS.from_epsg(32631).to_wkt())
    assert crs.CRS.from_wkt(read_grid(path).crs).to_epsg() == 32631


@pytest.mark.parametrize(
    ("values", "description"), [(-DEPTH, "elevations by their sign"), (DEPTH, "depths by their sign")]
)
def test_depths_and_elevations_are_distinguished_by_their_sign(tmp_path, values, description):
    """Both mean the same bed, and it is reported how that is known."""
    found = read_grid(tif(tmp_path / "a.tif", values))
    np.testing.assert_allclose(found.elevation, -DEPTH)
    assert description in found.description


def test_netcdf_is_read_in_either_order_of_its_dimensions(tmp_path):
    """(y, x) and (x, y), rising or falling coordinates: the same grid."""
    plain = read_grid(nc(tmp_path / "a.nc", -DEPTH))
    turned = read_grid(nc(tmp_path / "b.nc", -DEPTH.T, axes=("x", "y")))
    fallen = read_grid(nc(tmp_path / "c.nc", -DEPTH[::-1], at={"y": np.array([6.0, 4, 2, 0]), "x": np.arange(5) * 2.0}))
    for found in (plain, turned, fallen):
        np.testing.assert_allclose(found.elevation, -DEPTH)
        assert (found.north, found.east, found.north_step, found.east_step) == (0, 0, 2, 2)
    assert "elevations, positive up" in plain.description


def test_netcdf_states_its_sign_and_its_units(tmp_path):
    """An attribute positive wins over the name; feet and centimetres become metres; kilometres of coordinates too."""
    down = read_grid(nc(tmp_path / "a.nc", DEPTH, name="z", positive="down"))
    np.testing.assert_allclose(down.elevation, -DEPTH)
    centimetres = read_grid(nc(tmp_path / "b.nc", 100 * DEPTH, name="depth", units="cm"))
    np.testing.assert_allclose(centimetres.elevation, -DEPTH, rtol=1e-6)
    wide = read_grid(nc(tmp_path / "c.nc", DEPTH, name="depth", axis_units="km"))
    assert wide.north_step == pytest.approx(2000)


def test_degrees_become_metres_about_the_scene(tmp_path):
    """A grid in latitude and longitude: a minute of latitude is 1852 m within 0.6 %, cells lie where they should."""
    at = {"lat": 54 + np.arange(4) / 6000, "lon": 8 + np.arange(5) / 6000}
    path = nc(tmp_path / "a.nc", -DEPTH, axes=("lat", "lon"), at=at, axis_units="degrees_north")
    place = {"latitude": "54.0005 deg", "longitude": "8 deg"}
    bed = Seabed(relief={"kind": "grid", "file": path, **place}, depth=30.0).terrain
    assert bed.depth_at(0.0, 0.0) == pytest.approx(DEPTH[3, 0], abs=1e-3)
    assert metres_per_degree(54.0)[0] / 60 == pytest.approx(1852, rel=6e-3)
    east = metres_per_degree(54.0005)[1] / 6000
    assert bed.depth_at(0.0, east) == pytest.approx(DEPTH[3, 1], abs=1e-3)


def test_a_degree_has_the_ellipsoids_length():
    """WGS 84: 110 574 m of latitude and 111 320 m of longitude at the equator, 111 694 m of latitude at the pole."""
    np.testing.assert_allclose(metres_per_degree(0.0), (110574.3, 111319.5), atol=0.1)
    assert metres_per_degree(90.0)[0] == pytest.approx(111693.9, abs=0.1)


def test_latitude_and_longitude_find_their_place_in_a_projected_grid(tmp_path):
    """UTM zone 2 N: its central meridian, 171 W, is at 500 km east; on the equator north is 0."""
    path = tif(tmp_path / "a.tif", -DEPTH, origin=(0.0, 500_000.0))
    bed = Seabed(relief={"kind": "grid", "file": path, "latitude": "0 deg", "longitude": "-171 deg"}).terrain
    assert bed.depth_at(0.0, 0.0) == pytest.approx(DEPTH[0, 0], abs=1e-3)
    assert bed.depth_at(2.0, 4.0) == pytest.approx(DEPTH[1, 2], abs=1e-3)


def test_numpy_files_hold_a_grid_and_its_coordinates(tmp_path):
    """Names state what is what."""
    found = read_grid(npz(tmp_path / "a.npz", depth=DEPTH, north=np.arange(4.0), east=np.arange(5.0)))
    np.testing.assert_allclose(found.elevation, -DEPTH)


def wrong_files(tmp_path):
    """Files that are no bathymetry, with the field and the words of the result."""
    axes = {"north": np.arange(4.0), "east": np.arange(5.0)}
    uneven = {"north": np.array([0.0, 1, 2, 4]), "east": np.arange(5.0)}
    (tmp_path / "junk.npz").write_bytes(b"junk")
    (tmp_path / "junk.nc").write_bytes(b"junk")
    (tmp_path / "junk.tif").write_bytes(b"junk")
    return [
        (str(tmp_path / "gone.tif"), "there is no such file"),
        (str(tmp_path / "junk.npz"), "cannot be read"),
        (str(tmp_path / "junk.nc"), "cannot be read"),
        (str(tmp_path / "junk.tif"), "cannot be read"),
        (npz(tmp_path / "1.npz", depth=DEPTH, **uneven), "north is not evenly spaced"),
        (npz(tmp_path / "2.npz", depth=DEPTH, north=np.arange(4.0)), "no array east"),
        (
            npz(tmp_path / "3.npz", depth=DEPTH, north=np.arange(3.0), east=np.arange(5.0)),
            "north has 3 values for 4 cells",
        ),
        (npz(tmp_path / "4.npz", one=DEPTH, two=DEPTH, **axes), "which of one, two"),
        (npz(tmp_path / "5.npz", depth=1000 * DEPTH, **axes), "millimetres"),
        (npz(tmp_path / "6.npz", depth=-DEPTH, **axes), "positive: up"),
        (npz(tmp_path / "7.npz", z=DEPTH - 25, **axes), "elevations with land"),
        (npz(tmp_path / "8.npz", z=DEPTH * np.nan, **axes), "no cell holds a number"),
        (nc(tmp_path / "9.nc", DEPTH, units="fathom"), "'fathom'"),
        (nc(tmp_path / "10.nc", DEPTH, axes=("a", "b")), "no directions"),
        (tif(tmp_path / "11.tif", -DEPTH, crs="EPSG:2225"), "US survey foot"),
        (tif(tmp_path / "12.tif", -DEPTH, crs=None, step=0.0001), "probably degrees"),
        (tif(tmp_path / "13.tif", -DEPTH, turn=0.5), "gdalwarp"),
    ]


def test_every_fault_is_reported_with_the_file_and_a_fix(tmp_path):
    """Seventeen wrong files; each message names the file and what to do."""
    for path, words in wrong_files(tmp_path):
        with pytest.raises(GridError) as caught:
            read_grid(path)
        assert words in str(caught.value) and path in str(caught.value), (path, str(caught.value))


@pytest.mark.skipif(not REAL.is_file(), reason="JD211, a public survey grid, is not in the folder INSONIFY_DATA")
def test_a_real_survey_lies_as_its_papers_state():
    """JD211: 1707 x 1478 cells of 2 m in UTM 2 N, 46 % filled, -52.96 to -50.99 m, elevations positive up."""
    pytest.importorskip("rasterio", reason="rasterio is not installed: pip install '.[io]'")
    seabed = Seabed(relief={"kind": "grid", "file": str(REAL)})
    shallowest, mean, deepest = seabed.grid.depths
    assert (shallowest, deepest) == (pytest.approx(50.99, abs=0.005), pytest.approx(52.96, abs=0.005))
    assert seabed.depth == pytest.approx(mean, abs=0.01) and seabed.grid.measured_fraction == pytest.approx(
        0.46, abs=0.005
    )
    assert "1707 x 1478 cells of 2 x 2 m, elevations, positive up" in seabed.grid.description
    east = np.arange(-100.0, 100.0)
    assert np.std(seabed.terrain.depth_at(0.0, east)) < 0.3 and np.isnan(seabed.terrain.depth_at(5000.0, 0.0))
