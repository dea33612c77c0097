"""Claims about sub-bands: the error that is foretold is the one that is made."""

import numpy as np
import pytest

from insonify.cli import main
from insonify.estimates.sub_band_error import estimate_sub_band_error
from insonify.simulator import simulate
from insonify.sonar.band_error import MAX_ERROR_DB
from oracles.arrays import HEADING, START, elements_scenario

SWEEP = {"kind": "lfm", "frequency": 100e3, "bandwidth": 20e3, "duration": 2e-3}
LINE = {"kind": "line", "length": 1.5}


def wide(count, targets=((0.0, 20.0, 5.0),)):
    """A sidescan's 1.5 m arrays over a band of 20 kHz."""
    return elements_scenario(
        targets, pulse=SWEEP, transmit=LINE, receive=LINE, track={"speed": 0.0},
        receiver={"record": "beams", "bandwidth": 20e3, "sub_bands": count},
        paths={"max_reflections": 0, "contributions": ["target"]},
    )  # fmt: skip


def test_the_error_estimated_is_the_error_made():
    """48 targets of all phases, evenly across main lobe and first side lobes, one node against nine: 1.5 dB."""
    bearing = HEADING + np.pi / 2 + np.linspace(-0.02, 0.02, 48)
    away = 30 + 8 * np.random.default_rng(1).random(48)
    places = START + away[:, None] * np.stack([np.cos(bearing), np.sin(bearing), 0 * bearing], axis=1)
    one, nine = (simulate(wide(count, places)).pressure.values for count in (1, 9))
    made = 20 * np.log10(np.linalg.norm(one - nine) / np.linalg.norm(nine))
    assert estimate_sub_band_error(wide(1)).error_db == pytest.approx(made, abs=1.5)


def test_the_number_that_would_do_does():
    """One is -26 dB off and names a number; that number is within -30 dB, needs no more words, and is `auto`'s."""
    one = estimate_sub_band_error(wide(1))
    assert -29 < one.error_db < -23 and one.sufficient_count is not None
    expected = estimate_sub_band_error(wide(one.sufficient_count))
    assert (
        expected.error_db <= MAX_ERROR_DB
        and expected.summary() == ""
        and estimate_sub_band_error(wide(one.sufficient_count - 1)).error_db > MAX_ERROR_DB
    )
    assert estimate_sub_band_error(wide("auto")) == expected
    pressures = [simulate(wide(count)).pressure.values for count in ("auto", one.sufficient_count)]
    assert np.array_equal(*pressures)


def test_beams_that_look_down_are_judged_by_their_main_lobe():
    """The same error for a sonar that looks down as for one that looks ahead."""
    ahead, down = (estimate_sub_band_error(wide(1).with_("sonar.mounting.tilt", tilt)) for tilt in ("0 deg", "90 deg"))
    assert ahead.error_db == down.error_db


def test_a_narrow_band_needs_no_more_than_one():
    """Omnidirectional ends in water that takes nothing: no error at all."""
    assert estimate_sub_band_error(elements_scenario([(0, 20, 5)], track={"speed": 0.0})).error_db < -100


@pytest.mark.filterwarnings("ignore")
def test_check_states_how_many_would_do(tmp_path, capsys):
    """A line about sub_bands where one is not enough."""
    end = "{kind: line, length: 1.5 m}"
    path = tmp_path / "wide.yaml"
    path.write_text(
        "sonar: {source_level_db: 200, pulse: {kind: lfm, frequency: 100 kHz, bandwidth: 20 kHz, duration: 2 ms}, "
        f"transmit: {end}, receive: {end}, receiver: {{sub_bands: 1}}}}\n"
        "track: {kind: static, position: [0, 0, 9 m], window: [0 s, 50 ms]}\n"
    )
    assert main(["check", str(path)]) == 0
    assert "sonar.receiver.sub_bands: auto, here 2, would reach -30 dB or less" in capsys.readouterr().out
    path.write_text(path.read_text().replace(", receiver: {sub_bands: 1}", ""))
    assert main(["check", str(path)]) == 0
    assert "sub_bands" not in capsys.readouterr().out
