"""Settings with which elements and moving sonars cannot be recorded are refused, with the least value that would do."""

import re

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.scenario.element_errors import passed_energy_fraction
from insonify.sonar.pulse import Pulse
from insonify.sonar.receiver import Receiver
from oracles.arrays import HEADING, START, elements_scenario

AHEAD = [START + 30 * np.array([np.cos(HEADING), np.sin(HEADING), 0])]
TONE = {"kind": "cw", "frequency": 100e3, "duration": 10e-3}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"field": "incoherent"}, "field: coherent, or sonar.receiver.record: beams"),
        ({"output": {"labels": True}}, "labels: false"),
        ({"field": "incoherent", "receiver": {"record": "beams", "sub_bands": 2}}, "Leave sub_bands out"),
        ({"receive": {"kind": "planar", "width": 0.1, "height": 13, "rows": 20, "columns": 1}}, "puts element 0 at or"),
        ({"pulse": {**TONE, "duration": 0.1}, "track": {"speed": 20.0}}, "stop_and_hop: true, or give a shorter pulse"),
        ({"paths": {"geometry": "slice", "contributions": ["target"]}}, "need the third dimension"),
    ],
)  # fmt: skip
def test_what_does_not_go_together_is_refused(settings, message):
    """Each with the key to change."""
    with pytest.raises(ValidationError, match=re.escape(message)):
        elements_scenario(AHEAD, **settings)


def test_a_band_that_echoes_leave_is_refused_with_the_least_that_holds_them():
    """10 ms of tone at 3 m/s, 400 Hz of shift: 0.5 kHz of band is too little, the least that is named is enough."""
    with pytest.raises(ValidationError, match=r"sonar\.receiver\.band") as caught:
        elements_scenario(AHEAD, pulse=TONE, receiver={"bandwidth": 500.0})
    least = float(re.search(r"Give a band of ([\d.]+) kHz", str(caught.value)).group(1)) * 1e3
    assert 700 < least < 1000  # the shift on both sides, less what the roll-off lets pass
    elements_scenario(AHEAD, pulse=TONE, receiver={"bandwidth": least})
    with pytest.raises(ValidationError, match=r"sonar\.receiver\.band"):
        elements_scenario(AHEAD, pulse=TONE, receiver={"bandwidth": 0.97 * least})
    elements_scenario(AHEAD, pulse=TONE, receiver={"bandwidth": 500.0}, track={"stop_and_hop": True})
    elements_scenario(AHEAD, pulse=TONE, receiver={"bandwidth": 500.0}, track={"speed": 0.1})


def test_a_sonar_that_looks_abeam_may_have_a_narrow_band():
    """A beam of 2 degrees abeam receives a fiftieth of the shift that one ahead does."""
    line = {"kind": "line", "length": 0.4}
    settings = {"bandwidth": 500.0, "record": "beams"}
    assert elements_scenario(AHEAD, pulse=TONE, transmit=line, receive=line, receiver=settings) is not None


def test_all_of_a_wide_band_is_kept():
    """A sweep of 8 kHz in a band of 20 kHz: all but 4e-3 with and without 400 Hz; none of it 15 kHz aside."""
    pulse = Pulse(kind="lfm", frequency=100e3, bandwidth=8e3, duration=1e-3)
    assert (
        passed_energy_fraction(pulse, Receiver(bandwidth=20e3), 0.0) > 0.996
        and passed_energy_fraction(pulse, Receiver(bandwidth=20e3), 4e-3) > 0.996
    )
    assert passed_energy_fraction(pulse, Receiver(bandwidth=5e3), 0.15) < 1e-2
