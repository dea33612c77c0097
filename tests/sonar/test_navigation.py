"""Claims about navigation logs: read as they are, never extrapolated, every fault with its file and line."""

import shutil

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.scenario.load import load_scenario, parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.sonar import NavigationTrack, true_poses
from insonify.sonar.navigation_file import local_plane_position, read_navigation

PLAIN = """# a comment
time [s],north,east [m],depth,heading [deg],pitch [deg],roll [deg]
10,0,5,8,358,1,0
11,2,5,8,0,2,0
12,4,5,9,2,3,-4
13,6,5,9,4,3,0
"""


@pytest.fixture
def log(tmp_path):
    """Write a table, with some of its text replaced."""

    def write(old="", new="", text=PLAIN):
        path = tmp_path / "log.csv"
        path.write_text(text.replace(old, new) if old else text, encoding="utf-8")
        return path

    return write


def track(path, **changes):
    """A track from a log, a ping every half second."""
    return NavigationTrack(**{"file": str(path), "interval": 0.5, "window": (0, 0.2)} | changes)


def test_poses_are_interpolated_in_time(log):
    """Half-way between rows, half-way in everything; and the heading goes through north the short way."""
    rows = true_poses(track(log()))
    assert len(rows) == 7
    np.testing.assert_allclose(rows.position[1], [1, 5, 8])
    np.testing.assert_allclose(rows.position[3], [3, 5, 8.5])
    np.testing.assert_allclose(np.degrees(rows.heading[:4]) % 360, [358, 359, 0, 1], atol=1e-9)
    np.testing.assert_allclose(np.degrees(rows.pitch[1]), 1.5)
    np.testing.assert_allclose(np.degrees(rows.roll[5]), -2)


def test_pings_are_a_part_of_the_log(log):
    """From a start on, as many as requested; as many as fit by default; one more is refused."""
    path = log()
    rows = true_poses(track(path, start=1.25, pings=2))
    np.testing.assert_allclose(rows.position[:, 0], [2.5, 3.5])
    assert track(path, start=2.0).ping_count == 3
    with pytest.raises(ValidationError, match=r"pings: 4 pings run beyond the end of the log, 3 s after its first row"):
        track(path, start=2.0, pings=4)
    with pytest.raises(ValidationError, match=r"start: 5 s is after the log's last row"):
        track(path, start=5.0)


def test_a_degree_is_as_long_as_on_the_ellipsoid():
    """Published lengths of a degree (WGS 84): 111.133 km of latitude about 45 deg, 55.800 km of longitude at 60 deg."""
    span = local_plane_position(np.array([45.05]), np.array([0.0]), (44.95, 0.0))
    np.testing.assert_allclose(span[0], [11113.2, 0], atol=0.5)
    span = local_plane_position(np.array([60.0]), np.array([10.1]), (60.0, 10.0))
    np.testing.assert_allclose(span[0], [0, 5580.0], atol=0.5)
    east = local_plane_position(np.array([0.0]), np.array([-179.95]), (0.0, 179.95))
    assert 11000 < east[0, 1] < 11200  # across the date line


def test_latitude_and_longitude_are_projected_on_a_plane(log):
    """About the first row, or about an origin."""
    text = "time,lat,lon,depth,heading [rad]\n0,48,-68,5,0\n1,48.001,-68,5,0\n"
    north = true_poses(track(log(text=text), interval=1.0)).position
    np.testing.assert_allclose(north, [[0, 0, 5], [111.2, 0, 5]], atol=0.1)
    moved = true_poses(track(log(text=text), interval=1.0, origin=(48.001, -68.0))).position
    np.testing.assert_allclose(moved - north, [[-111.2, 0, 0]] * 2, atol=0.1)


def test_dates_semicolons_and_units_are_understood(log):
    """ISO 8601 with or without a zone, columns in any order and unit, others passed over."""
    text = (
        "Heading (deg);Time;easting [ft];northing [km];z [cm];note\n"
        "90;2026-05-04T12:00:00Z;10;0.001;500;a\n"
        "90;2026-05-04T12:00:02.5;20;0.002;600;b\n"
    )
    read = read_navigation(log(text=text))
    np.testing.assert_allclose(read.time, [0, 2.5])
    np.testing.assert_allclose(read.position, [[1, 3.048, 5], [2, 6.096, 6]])
    np.testing.assert_allclose(read.attitude, [[np.pi / 2, 0, 0]] * 2)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("\n12,", "\n11,", "line 5, column 1 (time): 11 is not after the row before it"),
        ("8,0,2", "nan,0,2", "line 4, column 4 (depth): nan is not a finite number"),
        ("8,0,2", ",0,2", "line 4, column 4 (depth): nothing stands here"),
        ("8,0,2", "deep,0,2", "line 4, column 4 (depth): 'deep' is not a number"),
        ("8,0,2", "8,0", "line 4: 6 columns where the header has 7"),
        ("12,4,5", '12,"4,5', "line 5: a quote is opened and not closed"),
        ("\n11,", '\n# "\n\n11,"2', "line 6: a quote is opened and not closed"),
        ("heading [deg]", "heading", "line 2, column 5: heading has no unit. Write heading [deg] or heading [rad]"),
        ("depth", "depth [fathom]", "line 2, column 4: 'fathom' is not a unit of depth; use one of m, km"),
        ("east [m]", "weast", "no column is named east"),
        ("east [m]", "longitude", "line 2: positions both in metres and in degrees"),
        ("pitch [deg]", "north", "line 2, column 6: a second column of north"),
        ("-4", "-400", "line 5, column 7 (roll): -400 deg is not possible; roll is -180 to 180 deg"),
        ("10,0,5", "then,0,5", "line 3, column 1 (time): 'then' is neither a number nor a date and time"),
        (PLAIN, "", "line 1: the file is empty"),
        (PLAIN, PLAIN[:100].rsplit("\n", 1)[0], "line 3: the file ends after 1 row(s) of values; give at least two"),
    ],
)
def test_a_fault_in_a_log_is_named_with_its_line(log, old, new, message):
    """The line of the file as an editor counts it, the column, the value, the fix."""
    path = log(old, new)
    with pytest.raises(ValidationError) as run_refusal:
        track(path)
    assert f"{path}, " in str(run_refusal.value) and message in str(run_refusal.value)


def test_a_byte_that_is_no_text_is_named_with_its_line(log):
    """As from a binary file, or another encoding."""
    path = log()
    path.write_bytes(PLAIN.replace("11,2", "11,\xe9").encode("latin-1"))
    with pytest.raises(ValueError, match=r"line 4: not text"):
        read_navigation(path)


def test_a_ping_in_a_gap_is_refused(log):
    """With the line after the gap, and how to go on; a gap between pings does not matter."""
    path = log("\n13,", "\n63,")
    with pytest.raises(ValidationError, match=r"line 6: the log has a gap of 51 s before this line, and ping 5 falls"):
        track(path)
    assert track(path, pings=5).ping_count == 5
    assert track(path, longest_gap=60).ping_count == 107
    assert track(path, interval=53.0, window=(0, 1)).ping_count == 2


@pytest.mark.filterwarnings("ignore")
def test_a_scenario_finds_its_log_beside_itself_and_recognises_it_again(log, tmp_path):
    """A relative path starts at the scenario file; written down it is whole, with the log's digest."""
    path = log()
    here = tmp_path / "scenario.yaml"
    end = "{kind: line, length: 1 m}"
    here.write_text(
        "sonar: {source_level_db: 200, pulse: {kind: cw, frequency: 100 kHz, duration: 0.1 ms}, "
        f"transmit: {end}, receive: {end}}}\ntrack: {{kind: navigation, file: log.csv, window: [0, 0.02]}}\n"
    )
    scenario = load_scenario(here)
    assert scenario.track.ping_count == 11
    again = parse_model(Scenario, to_yaml(scenario))
    assert again == scenario and len(again.track.sha256) == 64
    shutil.copy(path, tmp_path / "kept.csv")
    log("8,0,2", "7,0,2")
    with pytest.raises(ValueError, match="is not the file that it was"):
        parse_model(Scenario, to_yaml(scenario))
    path.unlink()
    with pytest.raises(ValueError, match=r"track.file: .*cannot be read: No such file"):
        load_scenario(here)
