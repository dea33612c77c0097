"""Claims about GeoTIFF files, read by rasterio: targets land on their coordinates, on slopes as well."""

import numpy as np
import pytest

import insonify
from insonify.formats.store_description import StoreError
from insonify.recording_run import record
from oracles.few_of import few_of
from oracles.surveys import ORIGIN, UTM, plane, sidescan

rasterio = pytest.importorskip("rasterio")
QUIET = {"water": {"sound_speed": 1500.0, "noise_level_db": None}}
BOX = {"shape": "box", "label": "box", "position": (1.0, 9.0), "size": (1.0, 1.0, 1.0)}
ALONE = QUIET | {"paths": {"max_reflections": 0, "contributions": ("target",)}}


def brightest(path):
    """Easting and northing of the middle of the brightest pixel, its size, and the open file's profile."""
    with rasterio.open(path) as file:
        level = file.read(1)
        row, column = np.unravel_index(np.nanargmax(level), level.shape)
        return np.array(file.xy(row, column)), file.res[0], file.profile


@few_of((0, 2), ("slopes", "heading"), [(None, "200 deg"), ((0.0, 0.25), "30 deg"), ((0.2, -0.2), "200 deg")])
def test_a_known_target_lands_within_a_pixel(tmp_path, slopes, heading):
    """On a flat bed and on slopes along and across, to either side of a platform that rolls, pitches and yaws."""
    north, east = 3.0, 7.0
    depth = 10.0 if slopes is None else 10 + slopes[0] * north + slopes[1] * east
    target = {"shape": "point", "label": "p", "position": (north, east, depth - 0.02), "target_strength_db": 20.0}
    bed = {"depth": 10.0} if slopes is None else {"relief": [plane(tmp_path, *slopes)], "depth": 10.0}
    start = (1.46, 2.0, 6.0) if heading == "30 deg" else (8.24, 2.63, 6.0)
    track = {"heading": heading, "start": start, "interval": 0.05, "window": (0.0, 0.014)}
    scenario = sidescan(targets=[target], pings=75, seabed=bed, track=track, **ALONE)
    recording = insonify.simulate(scenario, threads=1)
    place, pixel, profile = brightest(insonify.export(recording, tmp_path / "a.tif"))
    expected = np.array([east, north]) + (0 if slopes is None else UTM[::-1])
    assert np.all(np.abs(place - expected) <= pixel), (place - expected, pixel)
    assert pixel <= 0.2 and profile["dtype"] == "float32"
    assert profile["crs"].to_epsg() == (None if slopes is None else 32631)


def test_a_mosaic_on_earth_has_its_coordinate_system(tmp_path):
    """A scene of known latitude and longitude lies on a plane about them, to millimetres."""
    recording = insonify.simulate(sidescan(pings=3), threads=1).assign_attrs(ORIGIN)
    with rasterio.open(insonify.export(recording, tmp_path / "a.tif")) as file:
        longitude, latitude = rasterio.warp.transform(file.crs, "EPSG:4326", [0.0], [0.0])
    np.testing.assert_allclose([latitude[0], longitude[0]], [54.0, 3.0], atol=1e-9)


def test_labels_and_waterfall_lie_where_the_target_is(tmp_path):
    """Highlight on the box and its shadow behind it on the map; the waterfall's highlight at its ground range."""
    track = {"heading": "0 deg", "start": (-3.0, 0.0, 6.0), "interval": 0.2, "window": (0.0, 0.024), "motion": {}}
    scenario = sidescan(targets=[BOX], pings=20, track=track, **QUIET)
    record(scenario, tmp_path / "a.zarr", with_labels=True, threads=1)
    with rasterio.open(insonify.export(tmp_path / "a.zarr", tmp_path / "labels.tif", "labels")) as file:
        kind, label = file.read()
        assert "1 highlight" in file.descriptions[0] and "box" in file.descriptions[1]
        places = {code: np.array(file.xy(*[axis.mean() for axis in np.nonzero(kind == code)])) for code in (1, 2)}
        assert set(np.unique(label[(kind == 1) | (kind == 2)])) == {int(file.descriptions[1].split(" box")[0][-1])}
    assert abs(places[1][1] - 1.0) < 0.3 and 7.3 < places[1][0] < 9.2  # its near faces, and its top at shorter range
    assert abs(places[2][1] - 1.0) < 0.3 and 9.5 < places[2][0] < 12.5
    with rasterio.open(insonify.export(tmp_path / "a.zarr", tmp_path / "w.tif", "waterfall")) as file:
        level = file.read(1)
        row, column = np.unravel_index(np.nanargmax(level), level.shape)
        across, along = file.xy(row, column)
    assert level.shape[0] == 20 and 7.3 < across < 9.2 and abs(along - 4.0) < 1.0
    with pytest.raises(StoreError, match="--labels"):
        insonify.export(insonify.simulate(scenario.with_("track.pings", 1), threads=1), tmp_path / "l.tif", "labels")
