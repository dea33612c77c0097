"""Claims about water whose sound speed is written down as a profile."""

import hashlib

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.ocean import SoundSpeedProfile, Water

ROWS = [[0, 1510], [8, 1510], [14, 1490], [20, 1490]]
TABLE = "depth,speed\n0,1510\n8,1510\n14,1490\n20,1490\n"


def refused(**water) -> str:
    """The messages."""
    with pytest.raises(ValidationError) as caught:
        Water(**water)
    return caught.value.errors()[0]["msg"]


def test_one_water_may_be_written_in_many_ways(tmp_path):
    """A table, rows, columns, units and a profile state the same."""
    (tmp_path / "cast.csv").write_text(TABLE)
    expected = SoundSpeedProfile(*np.array(ROWS, dtype=float).T)
    depth, speed = ([row[i] for row in ROWS] for i in (0, 1))
    with_units = [[f"{z} m", f"{c / 1000} km/h"] for z, c in np.array(ROWS) * [1, 3600]]
    for written in (ROWS, with_units, {"depth": depth, "speed": speed}, expected, tmp_path / "cast.csv"):
        found = Water(profile=written).profile_to_depth(20.0)
        np.testing.assert_allclose([found.depth, found.speed], [expected.depth, expected.speed], rtol=1e-14)


def test_temperature_and_salinity_may_stand_for_speed():
    """As in a table, by the same law."""
    columns = {"depth": [0, 20], "temperature": ["18 degC", 9], "salinity": [34, 35]}
    law = SoundSpeedProfile.from_temperature_salinity([0, 20], [18, 9], [34, 35])
    assert Water(profile=columns).profile_to_depth(20.0) == law


def test_a_table_is_named_and_hashed_and_needed_no_more(tmp_path, monkeypatch):
    """What was read stays: the water reads back from its own values when the file has gone."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cast.csv").write_text(TABLE)
    water = Water(profile="cast.csv")
    assert water.profile.file == "cast.csv"
    assert water.profile.sha256 == hashlib.sha256(TABLE.encode()).hexdigest()
    (tmp_path / "cast.csv").unlink()
    assert Water.model_validate(water.model_dump()) == water


def test_layered_water_has_the_speeds_of_its_profile():
    """At the knots, between them, and over all of the way down."""
    water = Water(profile=ROWS)
    assert water.layered and (water.min_sound_speed, water.max_sound_speed) == (1490.0, 1510.0)
    np.testing.assert_allclose(water.sound_speed_at([[0.0, 11.0], [14.0, 25.0]]), [[1510, 1500], [1490, 1490]])
    z = (np.arange(200_000) + 0.5) * 1e-4
    assert water.sound_speed == pytest.approx(1 / np.mean(1 / water.sound_speed_at(z)), rel=1e-10)


@pytest.mark.parametrize("water", [Water(sound_speed=1480), Water(profile=[[0, 1480], [3, 1480], [30, 1480]])])
def test_a_profile_of_one_speed_bends_no_ray(water):
    """It counts as water of one speed, that speed exactly."""
    assert not water.layered
    assert water.min_sound_speed == water.max_sound_speed == water.sound_speed == 1480.0
    np.testing.assert_array_equal(water.sound_speed_at([0.0, 12.0]), [1480, 1480])
    np.testing.assert_array_equal(water.profile_to_depth(30.0).at([0.0, 30.0]), [1480, 1480])


def test_smoothing_rounds_the_corners():
    """As the profile itself would."""
    water = Water(profile=ROWS, smoothing="2 m")
    smooth = SoundSpeedProfile(*np.array(ROWS, dtype=float).T).smoothed(2.0)
    assert water.profile_to_depth(20.0) == smooth
    assert water.sound_speed_at(8.0) == smooth.at(8.0) < 1510


def test_water_deeper_than_its_profile_is_reported():
    """With the fix."""
    with pytest.raises(ValueError, match=r"ends at 20 m; the water is 25 m deep"):
        Water(profile=ROWS).profile_to_depth(25.0)


def test_one_of_speed_and_profile_must_go():
    """Neither silently wins."""
    assert "one of the two must go" in refused(sound_speed=1500, profile=ROWS)
    assert "there is none. Delete the line" in refused(smoothing=1)


@pytest.mark.parametrize(
    ("profile", "message"),
    [
        ([[0, 1500]], "1 depth(s) make no profile"),
        ([], "0 depth(s) make no profile"),
        (1500, "1500 is no sound-speed profile; write a table's name"),
        (" ", "' ' is not a file name"),
        ([[0, 1500], [0, 1500]], "1.0: 0 m comes after 0 m"),
        ([[0, 1500], 1490], "1: 1490 is no row"),
        ([[0, 1500], [9]], "1: has 1 values"),
        ([[0, 1500], [9, np.nan]], "1.1: nan m/s is no speed of any water (1300 to 1700 m/s)"),
        ([[0, 1500], [9, 149]], "1.1: 149 m/s is no speed of any water"),
        ([[0, 1500], [9, "fast"]], "1.1: 'fast' is not a speed"),
        ([[0, 1500], [9, None]], "1.1: nothing is no speed"),
        ([[0, 1500], [True, 1500]], "1.0: True is no depth"),
        ([[1500, 0], [1500, 9]], "Are depth and speed exchanged?"),
        ({"depth": [0, 9]}, "the column speed is missing"),
        ({"depth": [0, 9], "temperature": [9, 9]}, "the column salinity is missing"),
        ({"depth": [0, 9], "speed": [1500]}, "speed: has 1 values for 2 depths"),
        ({"depth": [0, 9], "speed": 1500}, "speed: 1500 is no column"),
        ({"depth": 0, "speed": [1500]}, "depth: 0 is no column"),
        ({"depth": [0, 9], "spede": [1500, 1500]}, "spede: is no column of a profile"),
        ({"depth": [0, 9], "speed": [1500, 1800]}, "speed.1: 1800 m/s is no speed"),
        ({"depth": [0, 9], "temperature": [9, 99], "salinity": [35, 35]}, "temperature.1: 99 degC is no temperature"),
        ({"depth": [9, 0], "speed": [1500, 1500]}, "depth.1: 0 m comes after 9 m"),
    ],
)
def test_what_is_no_profile_is_reported_with_its_location(profile, message):
    """Row and column, value, limits."""
    assert message in refused(profile=profile)


def test_all_errors_of_a_profile_are_reported_at_once():
    """All errors of a profile are reported together."""
    messages = refused(profile=[[0, 1200], [9, 1900], ["deep", 1500]]).splitlines()
    assert sorted(line.split(":")[0] for line in messages) == ["0.1", "1.1", "2.0"]


def test_a_table_that_is_missing_or_broken_is_reported_by_name(tmp_path, monkeypatch):
    """The folder, what is there instead, or the line of the table."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cast.csv").write_text("depth,speed\n0,1510\n8,fast\n")
    assert "cst.csv is not in the folder" in refused(profile="cst.csv")
    assert "Tables in it: cast.csv." in refused(profile="cst.csv")
    assert "cast.csv, line 3, column 2 (speed): 'fast' is not a number" in refused(profile="cast.csv")
    assert "cannot be read" in refused(profile=".")
