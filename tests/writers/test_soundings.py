"""Claims about exported soundings: a known target within 5 cm, the same points in every format, depths of the bed."""

import csv
import json

import numpy as np
import pytest

import insonify
from insonify.formats.store_description import StoreError
from insonify.frames import pose_rotation
from oracles.few_of import few_of
from oracles.surveys import ORIGIN, multibeam, sidescan


def table(path):
    """Rows of a table of soundings, by column."""
    with open(path, encoding="utf-8") as file:
        found = list(csv.DictReader(file))
    return {name: np.array([row[name] for row in found]) for name in found[0]}


@few_of((0, 1), "angle", [-40.0, 5.0, 50.0])
def test_a_known_target_is_sounded_within_5_cm(tmp_path, angle):
    """A point in the plane of the fan of a ship that heads to 40 deg and rolls, to port, below and to starboard."""
    alone = {"max_reflections": 0, "contributions": ("target",)}
    start = insonify.simulate(multibeam(pings=1, paths=alone), threads=1)
    beam = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    body = pose_rotation(*start.attitude.values[0])
    there = start.position.values[0] + 9.0 * body @ np.array([0.0, *beam])
    point = {"shape": "point", "label": "p", "position": there.tolist(), "target_strength_db": 10.0}
    recording = insonify.simulate(multibeam(targets=[point], pings=1, paths=alone, seabed={"depth": 30.0}), threads=1)
    found = table(insonify.export(recording, tmp_path / "a.csv"))
    places = np.stack([found[name].astype(float) for name in ("north_m", "east_m", "depth_m")], axis=1)
    angles = np.linspace(-64, 64, 256)[found["beam"].astype(int)]
    own = np.argmin(np.abs(angles - angle))
    miss = np.linalg.norm(places[own] - there)
    assert miss < 0.05 + 9.0 * np.radians(abs(angles[own] - angle)), miss


@pytest.fixture(scope="module")
def bed():
    """Two pings of a multibeam over a flat bed at 10 m, on Earth."""
    return insonify.simulate(multibeam(), threads=1).assign_attrs(ORIGIN)


def test_all_formats_hold_the_same_soundings(bed, tmp_path):
    """GeoJSON points at the longitudes and latitudes of the table, heights negative; rasters at its positions."""
    found = table(insonify.export(bed, tmp_path / "a.csv"))
    points = json.loads(insonify.export(bed, tmp_path / "a.geojson").read_text())["features"]
    given = np.array([point["geometry"]["coordinates"] for point in points])
    expected = np.stack([found[name].astype(float) for name in ("longitude_deg", "latitude_deg", "depth_m")], axis=1)
    np.testing.assert_array_equal(given, expected * [1, 1, -1])
    north = (expected[:, 1] - 54) * 111_284.0
    np.testing.assert_allclose(north, found["north_m"].astype(float), atol=0.01)
    steep = np.abs(np.linspace(-64, 64, 256)[found["beam"].astype(int)]) < 45
    assert abs(np.median(expected[steep, 2]) - 10.0) < 0.1 and steep.sum() > 200
    rasterio = pytest.importorskip("rasterio")
    with rasterio.open(insonify.export(bed, tmp_path / "a.tif", "bathymetry")) as file:
        elevation, count, truth = file.read()
        assert file.crs.to_dict()["lat_0"] == 54.0
        at = next(iter(file.sample([(float(found["east_m"][60]), float(found["north_m"][60]))])))
    assert count.sum() == steep.size and np.all(truth == -10.0)
    assert at[1] > 0 and abs(at[0] + float(found["depth_m"][60])) < 1.0 and np.isnan(elevation[count == 0]).all()


def test_an_interferometer_sounds_the_bed_on_both_sides(tmp_path):
    """Two receivers on each side of a northward line over a flat bed: depths to 2 %, port to the west."""
    array = {"kind": "elements", "positions": [[0, 0, -0.02], [0, 0, 0.02]], "size": [0.3, 0.01]}
    sonar = {
        "source_level_db": 210, "pulse": {"kind": "cw", "frequency": 150e3, "duration": 0.2e-3},
        "transmit": {"kind": "planar", "width": 0.3, "height": 0.01}, "receive": array,
        "receiver": {"bandwidth": 8e3, "record": "elements"}, "mounting": {"bearing": "90 deg", "tilt": "30 deg"},
        "sides": ["port", "starboard"],
    }  # fmt: skip
    track = {"heading": 0.0, "start": (0.0, 0.0, 2.0), "window": (0.012, 0.03), "motion": {}}
    recording = insonify.simulate(sidescan(pings=3, sonar=sonar, track=track, field="coherent"), threads=1)
    found = table(insonify.export(recording, tmp_path / "a.csv"))
    east, depth = found["east_m"].astype(float), found["depth_m"].astype(float)
    for side in (east < 0, east > 0):
        assert side.sum() > 100 and abs(np.median(depth[side]) - 10) < 0.2
    assert set(found["ping"]) == {"0", "1", "2"}


def test_a_sidescan_has_no_soundings(tmp_path):
    """Advice, and no file."""
    with pytest.raises(StoreError, match="multibeam or interferometric"):
        insonify.export(insonify.simulate(sidescan(pings=1), threads=1), tmp_path / "a.csv")
    assert not list(tmp_path.iterdir())
