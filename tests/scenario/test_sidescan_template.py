"""The sidescan template: what it shows is right, and what it offers in comments can be used."""

import warnings

import pytest

from insonify.diagnostics.diagnostic import ScenarioError
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.template import template_text

TEXT = template_text("sidescan")


def test_the_sidescan_template_has_nothing_wrong():
    """Two sides, two legs, a turn, and not even a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scenario = parse_model(Scenario, TEXT)
    assert scenario.sonar.channel_count == 2 and scenario.track.kind == "waypoints"
    assert 100 < scenario.track.ping_count < 200


def test_the_track_in_its_comments_follows_a_log(tmp_path):
    """Uncommented, it is a track; all that it lacks is the file."""
    head, tail = TEXT.split("# A track from a log.")
    before = head.split("track:")[0]
    lines = [line[2:] for line in tail.splitlines() if line.startswith(("# track:", "#   "))]
    rest = tail.splitlines()[-1]
    (tmp_path / "survey.csv").write_text("time,north,east,depth,heading [deg]\n0,0,0,12,0\n3,6,0,12,0\n")
    scenario = parse_model(Scenario, "\n".join([before, *lines, rest]), folder=tmp_path)
    assert scenario.track.kind == "navigation" and scenario.track.ping_count == 21


@pytest.mark.parametrize(
    ("old", "new", "field", "message"),
    [
        ("[20 m, 0 m, 12 m]", "[20 m, 0 m]", "track.waypoints.1", "value 3 is missing"),
        ("[20 m, 0 m, 12 m]", "[20 m, 0 m, 12 kg]", "track.waypoints.1.2", "12 kg is not a length"),
        (
            "[20 m, 0 m, 12 m]",
            "[20 m, 0 m, 26 m]",
            "track.waypoints",
            "puts the port transmit array at or below the seabed (20 m)",
        ),
        ("  waypoints: [", "  points: [", "track.points", "unknown key 'points'; did you mean 'waypoints'?"),
        ("turn_radius: 24", "radius_turn: 24", "track.radius_turn", "unknown key 'radius_turn' (known here: "),
        ("turn_radius: 24 m", "turn_radius: 1 km", "track.waypoints.1", "Write a turn_radius of 103.9 m or less"),
        ("70 ms]", "200 s]", "track.window.1", "200 s is too late; 100 s"),
        ("period: 6 s, ", "", "track.motion.roll.period", "needs either a period or a spectrum"),
        ("drift: 0 m/s", "drift: 1 deg/s", "track.navigation_errors.north.drift", "1 deg/s is not a speed"),
        ("[port, starboard]", "[left, right]", "sonar.sides.0", "one of port, starboard"),
        ("pings: null", "pings: 5000", "track.pings", "5000 pings run beyond the last waypoint"),
    ],
)
def test_a_fault_points_to_its_field_and_line(old, new, field, message):
    """Though `waypoints` is a kind of track and a key of it, the way to the value is that of the file."""
    with pytest.raises(ScenarioError) as run_refusal:
        parse_model(Scenario, TEXT.replace(old, new, 1))
    fault = run_refusal.value.faults[0]
    assert fault.field == field and message in str(fault)
    key = [step for step in field.split(".") if not step.isdigit()][-1]
    line = TEXT.replace(old, new, 1).splitlines()[fault.line - 1]
    assert f"{key}:" in line or (key == "period" and "roll:" in line)
