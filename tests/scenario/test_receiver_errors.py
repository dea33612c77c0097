"""Noise and receivers in scenario files: what is refused, what is warned of, what is written back."""

import re
import warnings

import numpy as np
import pytest

from insonify.scenario.citations import citations
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.validity import PhysicsWarning
from oracles.arrays import elements_scenario
from oracles.scenes import PULSE, nominal


def quiet(receive=None, *, water=None, frequency=100e3, **receiver):
    """A scene without echoes, 0.5 ms of sweep, 12 ms of window."""
    pulse = {"kind": "lfm", "frequency": frequency, "bandwidth": 6e3, "duration": 0.5e-3}
    track = {"speed": 0.0, "window": (0.0, 0.012)}
    return elements_scenario(
        [], receive=receive, receiver=receiver, pulse=pulse, water=water or {"noise_level_db": 40.0}, track=track
    )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"matched_filter": True, "blanking": 1e-3}, "compressed_recording"),
        ({"matched_filter": True, "adc": {"full_scale_db": 150}}, "after adc"),
        ({"record": "beams", "crosstalk": {"neighbours_db": -30}}, "Write record: elements"),
        ({"blanking": "11.5 ms"}, "nothing is recorded"),
        ({"self_noise": {"tones": [{"frequency": "50 kHz", "level_db": 60}]}}, "87.5 to 112.5 kHz"),
        ({"gain": {"start": "5 ms", "stop": "4 ms"}}, "Give a later stop"),
        ({"adc": {"full_scale_db": 150, "bits": 1}}, "bits"),
    ],
)  # fmt: skip
def test_what_a_receiver_cannot_do_is_refused_with_the_fix(settings, message):
    """Each with the key to change."""
    receive = {"kind": "point"} if settings.get("record") == "beams" else None
    with pytest.raises(ValueError, match=re.escape(message)):
        quiet(receive, **settings)


@pytest.mark.parametrize(
    ("water", "message"),
    [
        ({"noise_level_db": 40, "noise": {"level_db": 40}}, "Delete one of them"),
        ({"noise": {}}, "Give level_db, or wind_speed"),
        ({"noise": {"level_db": 40, "wind_speed": 5}}, "or level_db"),
        ({"noise": {"wind_speed": -5}}, "wind_speed"),
    ],
)
def test_what_states_noise_twice_or_not_at_all_is_refused(water, message):
    """A level, or its causes; in each channel, or in the water."""
    with pytest.raises(ValueError, match=re.escape(message)):
        quiet(water=water)


def test_more_elements_than_their_covariance_fits_are_refused():
    """4900 elements with the sea's noise; with noise of their own they may be."""
    panel = {"kind": "planar", "width": 0.5, "height": 0.5, "columns": 70, "rows": 70, "element": "omni"}
    with pytest.raises(ValueError, match="record 4096 or fewer"):
        quiet(panel)
    assert quiet(panel, water={"noise": None}, self_noise={"level_db": 30}).sonar.channel_count == 4900


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"gain": {"tvg_db_per_decade": 30}}, "without a converter there is nothing between"),
        ({"adc": {"full_scale_db": 80}}, "noise alone is 83 dB"),
        ({"adc": {"full_scale_db": 200, "bits": 8}}, "rounded to 0"),
        ({"gain": {"fixed_db": 60}, "adc": {"full_scale_db": 140}}, "at full gain it takes 80 dB"),
    ],
)
def test_receivers_that_may_not_be_meant_are_reported(settings, message):
    """40 dB re 1 uPa^2/Hz over 21.9 kHz of filter is 83 dB."""
    with pytest.warns(PhysicsWarning, match=message):
        quiet(**settings)


@pytest.mark.parametrize(("dead", "words"), [([0, 1, 3], 0), ([3, 1, 2, 0], 1), ([0, 0, 1, 2], 0)])
def test_an_array_without_a_living_element_is_reported(dead, words):
    """Of four elements any one alive is enough; the same one twice is one."""
    with warnings.catch_warnings(record=True) as message:
        warnings.simplefilter("always")
        quiet(errors={"dead": dead})
    assert sum("all 4 elements are among them" in str(word.message) for word in message) == words


@pytest.mark.parametrize(("duration", "words"), [(12e-3, 0), (12.1e-3, 1)])
def test_a_pulse_that_outlasts_the_window_is_reported(duration, words):
    """A window that ends at 12 ms receives the end of no longer pulse."""
    with warnings.catch_warnings(record=True) as message:
        warnings.simplefilter("always")
        nominal(track={"window": (0.0, 0.012)}, sonar={"pulse": {**PULSE, "duration": duration}})
    assert sum("no echo is recorded whole" in str(word.message) for word in message) == words


def test_a_receiver_that_fits_is_not_warned_of_and_is_written_back():
    """Round trip through YAML with units, all parts there; the same scenario, and its sources are named."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scenario = quiet(
            {"kind": "line", "length": "25 cm", "elements": 20},
            water={"noise": {"wind_speed": "3 m/s", "rain_rate": 0, "directionality": "surface", "shipping": 0.2}},
            self_noise={"level_db": "25 dB", "tones": [{"frequency": "58 kHz", "level_db": "60 dB"}]},
            crosstalk={"feedthrough_db": -120, "neighbours_db": -40}, blanking="1 ms",
            gain={"tvg_db_per_decade": 30, "absorption_db_per_m": "34 dB/km", "start": "2 ms", "stop": "10 ms",
                  "max_db": 80},
            adc={"full_scale_db": "150 dB", "bits": 20}, bandwidth=8e3, frequency=60e3,
        )  # fmt: skip
    assert parse_model(Scenario, to_yaml(scenario)) == scenario
    assert scenario.sonar.receiver.gain.absorption_db_per_m == pytest.approx(0.034)
    assert scenario.sonar.receiver.stages == ("crosstalk", "blanking", "adc")
    for name in ("Cox (1973)", "Cron & Sherman", "Wenz"):
        assert any(name in line for line in citations(scenario))


def test_a_law_outside_its_range_is_reported_when_the_file_is_checked():
    """Wind noise at 100 kHz and more, with the band: an extrapolation."""
    with pytest.warns(PhysicsWarning, match="fit of wind noise"):
        quiet(water={"noise": {"wind_speed": np.float64(10.0)}})
