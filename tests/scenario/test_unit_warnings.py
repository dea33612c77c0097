"""Claims about numbers without a unit: degrees, kilohertz or milliseconds that were meant are not taken silently."""

import warnings

import numpy as np
import pytest

from insonify.cli import main
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.scenario.load import load_scenario
from insonify.sonar.pulse import Pulse
from insonify.sonar.track import LineTrack
from insonify.units import unit_warning
from insonify.validity import PhysicsWarning


def written(folder, *changes):
    """The nominal template with some of its text replaced."""
    path = folder / "scene.yaml"
    if not path.exists():
        main(["new", str(folder / "scene")])
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def warned(path):
    """Messages while a file is read."""
    with warnings.catch_warnings(record=True) as output:
        warnings.simplefilter("always")
        load_scenario(path)
    return [str(one.message) for one in output]


@pytest.mark.parametrize("key", ["heading", "pitch", "roll"])
@pytest.mark.parametrize("typed", ["1", "1.5", "-1"])
def test_a_bare_angle_of_few_digits_gets_one_warning_with_its_line(tmp_path, key, typed):
    """1 is 57 degrees; the file, the line, the key and both readings are named."""
    path = written(tmp_path)
    text = path.read_text()
    line = next(n for n, row in enumerate(text.splitlines()) if row.startswith(f"  {key}: 0 deg"))
    path.write_text(text.replace(f"\n  {key}: 0 deg", f"\n  {key}: {typed}", 1))
    (output,) = (one for one in warned(path) if key in one)
    assert f"{path}:{line + 1}: track.{key}: {typed} without a unit is read as" in output
    assert f"'{float(typed):g} deg'" in output and f"'{float(typed):g} rad'" in output


@pytest.mark.parametrize("typed", ["0", "0.5", "1.571", "1.5 deg", "1.5 rad", "-0.26"])
def test_a_plausible_angle_gets_none(tmp_path, typed):
    """Small numbers, radians with their digits, and whatever has a unit."""
    assert not [one for one in warned(written(tmp_path, ("\n  roll: 0 deg", f"\n  roll: {typed}"))) if "roll" in one]


def test_a_heading_of_five_is_mentioned_by_check_and_done(tmp_path, capsys):
    """On the command line: one line on stderr, exit code 0."""
    path = written(tmp_path, ("\n  heading: 0 deg", "\n  heading: 5"))
    assert main(["check", str(path)]) == 0
    output = capsys.readouterr()
    assert output.err.count("track.heading: 5 without a unit is read as 5 rad (286.5 deg)") == 1
    assert "but the warning above" in output.out


def test_a_whole_angle_in_python_gets_a_warning_and_a_float_none():
    """An int was typed; a float was computed, or read back from a recording."""
    line = {"start": (0, 0, 5), "speed": 2, "pings": 1, "window": (0, 0.1)}
    with pytest.warns(PhysicsWarning, match="heading: 5 without a unit"):
        assert LineTrack(heading=5, **line).heading == 5
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        LineTrack(heading=5.0, **line)
        LineTrack(heading=0, **line)
        LineTrack(heading="5 deg", **line)


def test_a_frequency_in_hertz_is_blamed_not_the_duration(tmp_path):
    """100 for 100 kHz: the message stands at the frequency and knows what was meant."""
    with pytest.raises(ScenarioError) as run_refusal:
        load_scenario(written(tmp_path, ("frequency: 100 kHz", "frequency: 100")))
    (fault,) = run_refusal.value.faults
    assert fault.field == "sonar.pulse.frequency"
    assert "100 Hz" in str(fault) and "Did you mean 100 kHz?" in str(fault)
    with pytest.raises(ValueError, match="Did you mean 450 kHz"):
        Pulse(kind="lfm", frequency=450, duration=1e-3, bandwidth=20e3)
    with pytest.raises(ValueError, match="duration"):  # a frequency that is one: then it is the pulse that is short
        Pulse(frequency=100e3, duration=5e-6)


def test_a_frequency_in_hertz_that_fits_its_pulse_gets_a_warning(tmp_path):
    """100 beside a duration in seconds: two slips that fit each other."""
    path = written(tmp_path, ("frequency: 100 kHz", "frequency: 100"), ("duration: 0.2 ms", "duration: 0.2"),
                   ("bandwidth: 20 kHz", "bandwidth: 100 Hz"))  # fmt: skip
    output = " ".join(warned(path))
    assert "sonar.pulse.frequency: 100 without a unit is read as 100 Hz" in output
    assert "sonar.pulse.duration: 200 ms" in output


@pytest.mark.parametrize("typed", ["0.2", "0.2 s", "200 ms", "30 ms"])
def test_a_pulse_that_fills_the_recording_gets_a_warning(tmp_path, typed):
    """Seconds for milliseconds: what part of the window it takes, and how long its echoes are."""
    (output,) = (
        one for one in warned(written(tmp_path, ("duration: 0.2 ms", f"duration: {typed}"))) if "duration" in one
    )
    assert "sonar.pulse.duration: " in output and "of track.window" in output
    assert ("Did you mean 0.2 ms?" in output) == (typed != "30 ms")


def test_a_usual_pulse_gets_none(tmp_path):
    """Of 0.2 ms, and a compressed sweep of 15 ms."""
    assert not [one for one in warned(written(tmp_path)) if "duration" in one]
    sweep = ("kind: cw", "kind: lfm"), ("duration: 0.2 ms", "duration: 15 ms"), ("bandwidth: 0 Hz", "bandwidth: 15 kHz")
    path = written(tmp_path, *sweep, ("matched_filter: false", "matched_filter: true"))
    assert not [one for one in warned(path) if "duration" in one]


def test_doubts_follow_digits_and_dimension():
    """The rule itself, at its edges."""
    assert unit_warning("1", "angle") and not unit_warning("0.9", "angle")
    assert unit_warning("6.2", "angle") and not unit_warning("6.28", "angle")
    assert unit_warning("2000", "frequency") and not unit_warning("2001", "frequency")
    assert not unit_warning("0", "frequency") and not unit_warning("100 Hz", "frequency")
    assert not unit_warning("5", "length") and not unit_warning("five", "angle")
    assert f"{np.degrees(2):.4g} deg" in unit_warning("2", "angle")
