"""Claims about sound-speed profiles, from numbers and from files."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import SoundSpeedProfile, read_profile, sound_speed
from insonify.validity import PhysicsWarning

SUMMER = SoundSpeedProfile([0.0, 10.0, 15.0, 40.0], [1520.0, 1519.0, 1500.0, 1501.0])


def test_knots_are_reproduced_exactly():
    """At a measured depth the speed is the measured one, bit for bit."""
    np.testing.assert_array_equal(SUMMER.at(SUMMER.depth), SUMMER.speed)


@given(st.floats(0, 40), st.floats(0, 40))
def test_the_gradient_is_what_the_speed_does(a, b):
    """Integrated from one depth to another, the gradient is the difference of speeds."""
    ends = np.sort([a, b])
    edges = np.unique(np.clip(np.concatenate([ends, SUMMER.depth]), *ends))
    rise = np.sum(SUMMER.gradient((edges[1:] + edges[:-1]) / 2) * np.diff(edges))
    assert SUMMER.at(ends[1]) - SUMMER.at(ends[0]) == pytest.approx(rise, abs=1e-9)


def test_at_a_knot_the_gradient_is_that_of_the_layer_below():
    """The last knot has no layer below, and outside the profile nothing changes."""
    np.testing.assert_allclose(SUMMER.gradient([0.0, 10.0, 15.0, 40.0]), [-0.1, -3.8, 0.04, 0.04])
    np.testing.assert_array_equal(SUMMER.gradient([-1.0, 41.0]), [0.0, 0.0])
    np.testing.assert_array_equal(SUMMER.at([-1.0, 41.0]), [1520.0, 1501.0])


def test_results_have_the_shape_of_the_arguments():
    """One depth, or a grid of depths."""
    assert SUMMER.at(5.0).shape == () and SUMMER.gradient(5.0).shape == ()
    assert SUMMER.at(np.zeros((2, 3))).shape == (2, 3) and SUMMER.gradient(np.zeros((2, 3))).shape == (2, 3)


def test_temperature_and_salinity_become_speed_by_the_law():
    """At each depth of the probe the profile is the law's; one salinity may stand for all."""
    z, t = np.array([0.0, 20.0, 50.0]), np.array([18.0, 12.0, 9.0])
    made = SoundSpeedProfile.from_temperature_salinity(z, t, 34.0, model="mackenzie")
    np.testing.assert_array_equal(made.at(z), sound_speed(t, 34.0, z, model="mackenzie"))
    assert SoundSpeedProfile.from_temperature_salinity(z, t, 34.0) != made
    assert SoundSpeedProfile.from_temperature_salinity(z, 9.0, 34.0).gradient(30.0) == pytest.approx(0.0163, rel=0.05)


def test_a_profile_is_frozen():
    """Neither its own numbers nor the list it was made from can change it."""
    speeds = np.array([1500.0, 1510.0])
    profile = SoundSpeedProfile([0, 10], speeds)
    speeds[0] = 0
    with pytest.raises(ValueError, match="read-only"):
        profile.speed[0] = 0
    assert profile.at(0) == 1500
    assert profile == SoundSpeedProfile([0, 10], [1500, 1510]) and len({profile, profile.extended(5)}) == 1
    assert repr(profile) == "SoundSpeedProfile: 2 knots, 0-10 m, 1500.0-1510.0 m/s"


def test_a_profile_that_does_not_reach_the_seabed_is_refused():
    """Too shallow or begun too deep is an error with the fix, and the fix works."""
    cast = SoundSpeedProfile([1.5, 30.0], [1500.0, 1490.0])
    with pytest.raises(ValueError, match=r"begins at 1.5 m.*extended\(50\)"):
        cast.require_depth(50.0)
    whole = cast.extended(50.0)
    whole.require_depth(50.0)
    np.testing.assert_array_equal(whole.at([0.0, 1.5, 30.0, 50.0]), [1500, 1500, 1490, 1490])
    assert whole.extended(50.0) is whole
    with pytest.raises(ValueError, match=r"ends at 50 m; the water is 60 m deep"):
        whole.require_depth(60.0)


@pytest.mark.parametrize(
    ("depth", "speed", "message"),
    [
        ([0.0], [1500.0], "1 knot"),
        ([0.0, 10.0], [1500.0], r"shape \(2,\), speed \(1,\)"),
        ([[0.0, 10.0]], [[1500.0, 1500.0]], "two lists"),
        ([0.0, 10.0, 10.0], [1500.0, 1501.0, 1502.0], r"depth\[2\] is 10 m after 10 m"),
        ([0.0, 20.0, 10.0], [1500.0, 1501.0, 1502.0], r"depth\[2\] is 10 m after 20 m"),
        ([0.0, np.nan], [1500.0, 1500.0], r"depth\[1\] is nan"),
        ([0.0, 10.0], [1500.0, np.inf], r"speed\[1\] is inf"),
        ([0.0, 10.0], [1500.0, 15.0], r"speed\[1\] is 15 m/s.*1300 to 1700"),
    ],
)
def test_impossible_profiles_are_refused(depth, speed, message):
    """What, where, the value and the limit."""
    with pytest.raises(ValueError, match=message):
        SoundSpeedProfile(depth, speed)


@pytest.mark.parametrize(
    "text",
    [
        "depth,speed\n0,1500\n10,1490\n",
        "# cast 7\n\ndepth,speed\nm,m/s\n0,1500\n# the thermocline\n10,1490\n",
        "Depth [m], Sound_Speed [m/s]\n0, 1500\n10, 1490\n",
        "\ufeffspeed;note;depth\n1500;calm;0\n1490;;10\n",
        "depth (km)\tspeed (km/h)\n0\t5400\n0.01\t5364\n",
        "depth,temperature,salinity,speed\n0,9,35,1500\n10,8,35,1490\n",
    ],
)
def test_one_profile_may_be_written_in_many_ways(tmp_path, text):
    """Comments, units in either place, other separators and orders, a byte-order mark: the same water."""
    path = tmp_path / "cast.csv"
    path.write_text(text, encoding="utf-8")
    read = read_profile(path)
    np.testing.assert_allclose([read.depth, read.speed], [[0, 10], [1500, 1490]], rtol=1e-12)


def test_a_cast_of_temperature_and_salinity_is_read_by_the_law_requested(tmp_path):
    """The file and the numbers make the same profile."""
    path = tmp_path / "ctd.csv"
    path.write_text("temperature,depth,salinity\ndegC,m,PSU\n18,0,34\n9,50,35\n")
    made = SoundSpeedProfile.from_temperature_salinity([0, 50], [18, 9], [34, 35], model="mackenzie")
    assert read_profile(str(path), model="mackenzie") == made
    assert read_profile(path) == SoundSpeedProfile.from_temperature_salinity([0, 50], [18, 9], [34, 35])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: the file is empty"),
        ("# only talk\n", "line 1: the file is empty"),
        ("0,1500\n10,1490\n", "line 1, column 1.*no column is named depth"),
        ("depth,temprature,salinity\n0,9,35\n9,9,35\n", "line 1, column 2.*'depth, temprature, salinity'.*temperature"),
        ("depth,speed,depth\n0,1500,0\n9,1500,9\n", "line 1, column 3: a second column of depth"),
        ("depth [fathom],speed\n0,1500\n9,1500\n", "line 1, column 1: 'fathom' is not a unit of depth; use one of m,"),
        ("depth,speed\nm,knots\n0,1500\n9,1500\n", "line 2, column 2: 'knots' is not a unit of speed"),
        ("depth,speed\n0,1500\n10,fast\n", r"line 3, column 2 \(speed\): 'fast' is not a number"),
        ("depth,speed\n# note\n0,1500\n\n10,\n", r"line 5, column 2 \(speed\): '' is not a number"),
        ("depth,speed\n0,1500\n10\n", "line 3: 1 columns where the header has 2"),
        ("depth;speed\n0,0;1500\n9;1500\n", r"line 2, .*'0,0' is not a number\. The decimal mark is a point: 0\.0\."),
        ("depth,speed\n0,1500\n-9,1500\n", r"line 3, .*They are positive downwards: leave out the minus\."),
        ("depth,speed\n0,1500\n0,1501\n", r"line 3, .*Keep one row of each depth\."),
        ("depth,speed\n0,1500\n10,1490,7\n", "line 3: 3 columns where the header has 2"),
        ("depth,speed\n0,1500\n10,nan\n", r"line 3, column 2 \(speed\): nan m/s is not possible"),
        ("depth,speed\n0,1500\n10,149\n", r"line 3, column 2 \(speed\): 149 m/s .*1300 to 1700"),
        ("speed,depth\n1500,5\n1490,5\n", r"line 3, column 2 \(depth\): 5 m after 5 m"),
        ("depth,temperature,salinity\n0,9,35\n9,99,35\n", r"line 3, column 2 \(temperature\): 99 degC"),
        ("depth,temperature,salinity\n0,9,-1\n9,9,35\n", r"line 2, column 3 \(salinity\): -1 g/kg"),
        ("depth,speed\n0,1500\n", "line 2: the file ends after 1 row"),
    ],
)
def test_every_fault_of_a_file_is_reported_with_its_location(tmp_path, text, message):
    """File, line and column, and what to do."""
    path = tmp_path / "broken.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"broken\.csv, {message}"):
        read_profile(path)


def test_a_picture_is_not_a_profile(tmp_path):
    """Bytes that are no text are reported with their line."""
    path = tmp_path / "cast.csv"
    path.write_bytes(b"depth,speed\n\xff\xd8\xff")
    with pytest.raises(ValueError, match=r"cast\.csv, line 2: not text"):
        read_profile(path)


def test_a_missing_file_is_missed(tmp_path):
    """Python's own words name the file."""
    with pytest.raises(FileNotFoundError, match="nowhere"):
        read_profile(tmp_path / "nowhere.csv")


def test_a_law_outside_its_range_warns_for_a_file_too(tmp_path):
    """An estuary is no place for Mackenzie."""
    path = tmp_path / "estuary.csv"
    path.write_text("depth,temperature,salinity\n0,9,2\n9,9,12\n")
    with pytest.warns(PhysicsWarning, match="Mackenzie.*25 to 40 g/kg"):
        read_profile(path, model="mackenzie")
