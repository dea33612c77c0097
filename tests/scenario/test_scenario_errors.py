"""Parts that are each right, but do not go together, are reported all at once, each at its own line."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.diagnostics.diagnostic import ScenarioError
from insonify.model import field_error, field_errors, raise_errors
from insonify.scenario.load import load_scenario, parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.template import template_text
from insonify.scene.scene import Scene

NOMINAL = template_text("nominal")
AFTER_TARGETS = "\nsonar:\n"
BUOY = "  - {shape: point, label: buoy, position: [0 m, 100 m, 15 m]}\n"


def edited(**changes: str) -> str:
    """The nominal file with the first value of some keys replaced; its comments are gone."""
    bare = "\n".join(line.split(" #")[0].rstrip() for line in NOMINAL.splitlines())
    for key, value in changes.items():
        head, found, tail = bare.partition(f"\n  {key}: ")
        assert found, key
        bare = head + found + value + tail[tail.index("\n") :]
    return bare


def messages(text: str) -> list[str]:
    """The messages about a file, without file and line number."""
    with pytest.raises(ScenarioError) as caught:
        parse_model(Scenario, text, name="harbour.yaml")
    return [str(fault).split(" ", 1)[1] for fault in caught.value.faults]


def test_three_contradictions_get_three_lines_in_the_order_of_the_file():
    """In 14 m of water neither a buoy at 15 m, nor a point at 31 m, nor a sonar at 20 m has a place."""
    deep = edited(depth="14 m", position="[0 m, 0 m, 20 m]")
    points = BUOY + "  - {shape: point, position: [0 m, 100 m, 31 m]}\n"
    lines = messages(deep.replace(AFTER_TARGETS, "\n" + points + AFTER_TARGETS))
    assert [line.partition(": ")[0] for line in lines] == [
        "targets.1.position.2 (buoy)", "targets.2.position.2", "track.position.2",
    ]  # fmt: skip
    for line, value in zip(lines, ("15 m", "31 m", "20 m"), strict=True):
        assert f": {value} " in line and "14 m" in line


def test_contradictions_are_reported_together_in_python_too():
    """One error holds every line."""
    with pytest.raises(ValidationError) as caught:
        Scene(targets=[{"shape": "point", "position": (0, 1, 31)}, {"shape": "point", "position": (0, 1, 32)}])
    message = str(caught.value)
    assert all(part in message for part in ("position.2: 31 m", "position.2: 32 m", "targets.1.label: 'point'"))


def test_no_fault_raises_nothing_and_all_faults_are_kept_in_order():
    """Errors of errors unfold into one flat list."""
    raise_errors([])
    inner = field_errors([field_error("a", 1, "is odd."), field_error("b", 2, "is even.")])
    flat = field_errors([inner, field_error("c", None, "nothing")])
    assert str(flat) == "a: 1 is odd.\nb: 2 is even.\nc: nothing"


@pytest.mark.parametrize(
    ("typed", "line"),
    [
        ({"pitch": "2 deg"}, "track.pitch: 2 deg takes the beam out of"),
        ({"roll": "-1 deg"}, "track.roll: -1 deg takes the beam out of"),
    ],
)
def test_a_slice_is_one_vertical_plane_of_a_level_beam(typed, line):
    """A platform that leans takes its beam out of the plane; the whole scene has no such limit."""
    (message,) = messages(edited(geometry="slice", **typed))
    assert message.startswith(line) and "Write 0 deg, or paths.geometry: 3d." in message
    parse_model(Scenario, edited(geometry="3d", **typed))


def test_a_slice_looks_along_boresight():
    """Steered beams leave the plane, and several of them need the third dimension."""
    flat = edited(geometry="slice")
    before, _, after = flat.rpartition("steer: 0 deg")
    (one,) = messages(f"{before}steer: 3 deg{after}")
    (many,) = messages(f"{before}steer: [0 deg, 3 deg]{after}")
    assert one.startswith("sonar.receive.steer: 3 deg takes")
    assert many.startswith("paths.geometry: slice has one beam, but the sonar steers 2.")
    parse_model(Scenario, flat)


def test_the_suggested_depth_brings_every_array_into_the_water():
    """An array hangs 2 m below its platform: the range that is named is the range that works."""
    hung = edited(position="[0 m, 0 m, 19 m]").replace("offset: [0 m, 0 m, 0 m]", "offset: [0 m, 0 m, 2 m]", 1)
    (message,) = messages(hung)
    assert message.startswith("track.position.2: 19 m puts the transmit array at or below the seabed (20 m), at 21 m.")
    assert "between 0 and 18 m" in message
    for depth in (0.01, 17.99):
        parse_model(Scenario, hung.replace("0 m, 19 m]", f"0 m, {depth} m]"))


def box_at(north: float, *, speed: float = 1.0, height: float = 10.0, offset: float = 0.0) -> dict:
    """A line of 101 pings northward at 11 m depth past a box of 2 m, its receiver `offset` below."""
    array = {"kind": "line", "length": 1}
    return {
        "targets": [{"shape": "box", "label": "pier", "position": (north, 0), "size": (2, 2, height)}],
        "sonar": {
            "source_level_db": 200, "pulse": {"frequency": 1e5, "duration": 1e-3}, "transmit": array,
            "receive": array | {"offset": (0, 0, offset)},
        },
        "track": {"kind": "line", "start": (0, 0, 11), "speed": speed, "interval": 1, "pings": 101},
    }  # fmt: skip


@pytest.mark.parametrize(("north", "pings"), [(0, "0 to 1"), (50, "49 to 51"), (100, "99 to 100")])
def test_no_ping_may_be_sent_from_inside_a_box(north, pings):
    """At the first, a middle or the last ping of a line."""
    with pytest.raises(ValidationError, match=rf"targets\.0\.position: the platform is inside pier from ping {pings}"):
        Scenario(**box_at(north))


def test_an_array_may_not_be_inside_a_box_either():
    """The platform passes 1 m above the box, its receiver hangs 2 m lower."""
    with pytest.raises(ValidationError, match="the receive array is inside pier from ping 49 to 51"):
        Scenario(**box_at(50, height=8, offset=2))
    Scenario(**box_at(50, height=8))


def test_a_missing_file_has_no_line():
    """There is no line 1 in a file that is not there."""
    with pytest.raises(ScenarioError) as caught:
        load_scenario("/nowhere/harbour.yaml")
    assert str(caught.value).startswith("/nowhere/harbour.yaml: there is no such file. Start from")


def test_a_depth_too_many_points_to_the_base_of_the_box():
    """A box has no third coordinate, a point does."""
    (message,) = messages(edited().replace("[0 m, 150.5 m]", "[0 m, 150.5 m, 20 m]"))
    assert message.startswith("targets.0.position (box): [0 m, 150.5 m, 20 m] has 3 values (a list of 2).")
    assert "base_depth" in message


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ({"pings": "0"}, "track.pings: 0 pings are an empty track. Give 1 to 2000000."),
        ({"pings": ".nan"}, "track.pings: .nan is not a finite number (1 to 2000000)."),
        ({"pings": "3000000"}, "track.pings: 3000000 is out of range (1 to 2000000)."),
        ({"reflection": ".nan"}, "seabed.reflection: .nan is not a finite number (-1 to 1)."),
        ({"interval": ".inf"}, "track.interval: .inf is not a finite number (above 0, to 1000000 s)."),
        ({"pitch": "1e999 deg"}, "track.pitch: 1e999 deg is not a finite number (-1.5708 to 1.5708 rad)."),
    ],
)
def test_a_number_out_of_range_is_reported_with_the_range(typed, message):
    """Also where it is no number at all."""
    assert messages(edited(**typed)) == [message]


def test_a_row_of_steered_beams_may_be_given_by_its_ends():
    """Counted as a person counts; for a wrong step a right one is given, at its own key."""
    before, _, after = edited().rpartition("steer: 0 deg")
    fan = parse_model(Scenario, f"{before}steer: {{from: -6 deg, to: 6 deg, step: 0.25 deg}}{after}")
    np.testing.assert_allclose(np.degrees(fan.sonar.steers), np.arange(-24, 25) / 4, atol=1e-14)
    (message,) = messages(f"{before}steer: {{from: -6 deg, to: 6 deg, step: 0.7 deg}}{after}")
    assert message == (
        "sonar.receive.steer.step: 0.7 deg does not come out even from -6 to 6 deg. "
        "Write 0.705882353 deg, for 18 angles."
    )
