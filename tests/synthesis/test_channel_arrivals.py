"""Claims about arrivals of elements and of sonars moving: received again, row by row, they are the recording."""

import numpy as np
import pytest

from insonify.explanation.sample_report import SampleArrivals, explain_sample
from insonify.simulator import arrivals, build_simulator, levels, simulate
from oracles.arrays import HEADING, START, elements_scenario, line_of, some_targets
from oracles.arrival_sum import coherent_from_arrivals
from oracles.underway import CARRIER, SPEED
from synthesis.oracle import relative_rms

PROFILE = {"profile": [[0, 1520], [8, 1518], [12, 1495], [20, 1490]], "smoothing": 1.0, "noise_level_db": None}
ROLLING = {"motion": {"roll": {"rms": "3 deg", "period": "5 s"}, "yaw": {"rms": "2 deg", "period": "7 s"}}}
BEAMS = {"receive": {"kind": "line", "length": 0.3, "steer": (0.0, 0.3)}, "transmit": {"kind": "line", "length": 0.02}}
HEAD = {"kind": "arc", "radius": 0.2, "arc_angle": "120 deg", "elements": 5, "element": "cosine"}


@pytest.mark.parametrize(
    "settings",
    [
        {"receiver": {"errors": {"gain_db": 1.0, "phase": "20 deg", "position": 0.001}}},
        {"track": {"speed": 0.0}},
        {"track": ROLLING},
        {"water": PROFILE},
        {"receive": HEAD},
        {"receiver": {"sub_bands": 3}, "transmit": {"kind": "line", "length": 0.3}},
        {**BEAMS, "receiver": {"record": "beams"}},
        {**BEAMS, "receiver": {"record": "beams", "sub_bands": 3}, "track": {"speed": 0.0}},
        {**BEAMS, "receiver": {"record": "beams"}, "water": PROFILE},
    ],
    ids=["errors", "still", "rolling", "layered", "arc", "sub-bands", "beams", "beams in bands", "layered beams"],
)
def test_arrivals_received_again_are_the_recording(settings):
    """Each channel's own arrivals, with their Doppler factors, give that channel back to 1e-5 of its rms."""
    scenario = elements_scenario(some_targets(), **settings)
    received, simulator = simulate(scenario).pressure.values[0], build_simulator(scenario)
    strongest = np.linalg.norm(received, axis=1).max()
    for channel in (0, len(received) - 1):
        found, here = arrivals(scenario, channel=channel), simulator.ping_geometry(0, channel=channel)
        again = coherent_from_arrivals(found, here, simulator.grid, channel=channel)[0]
        assert np.linalg.norm(again - received[channel]) < 1e-5 * strongest


def test_arrivals_of_elements_need_a_choice_of_element():
    """Arrivals of one element are not those of another: without a channel there is no result."""
    scenario = elements_scenario(some_targets(2))
    simulator = build_simulator(scenario)
    with pytest.raises(ValueError, match="each element has arrivals of its own"):
        coherent_from_arrivals(arrivals(scenario), simulator.ping_geometry(0), simulator.grid)


def test_delays_and_doppler_of_a_closing_target_are_closed_form():
    """Straight at a target at speed v: delay 2 R / (c + v), factor (c + v) / (c - v); a sonar at rest has neither."""
    away, v = 30.0, 3.0
    ahead = START + away * np.array([np.cos(HEADING), np.sin(HEADING), 0])
    point = {"kind": "point", "element": "omni"}
    direct = {"max_reflections": 0, "contributions": ["target"]}
    found = arrivals(elements_scenario([ahead], receive=point, paths=direct))
    assert found.delay.item() == pytest.approx(2 * away / (SPEED + v), abs=1e-11)
    assert found.doppler.item() == pytest.approx((SPEED + v) / (SPEED - v) - 1, rel=1e-9)
    hop = arrivals(elements_scenario([ahead], receive=point, paths=direct, track={"stop_and_hop": True}))
    assert hop.delay.item() == pytest.approx(2 * away / SPEED, abs=1e-12) and hop.doppler.item() == 0


def test_explain_adds_up_for_an_element_under_way():
    """The arrivals behind a sample sum to it, 1e-4 of the strongest, and the page gives element and shift."""
    ahead = START + 30 * np.array([np.cos(HEADING), np.sin(HEADING), 0])
    scenario = elements_scenario(
        [ahead, *some_targets(2)], pulse={"kind": "cw", "frequency": CARRIER, "duration": 2e-3}, receive=line_of(3)
    )
    held = simulate(scenario)
    series = held.pressure.values[0, 2]
    sample = int(np.argmax(np.abs(series)))
    behind = SampleArrivals(scenario, 0, float(held.time[sample]), 2)
    assert abs(behind.pressure.sum() - series[sample]) < 1e-4 * abs(series[sample])
    page = explain_sample(held, 0, 0.0408, channel=2)
    assert "element 2" in page and "shift" in page and " 400." in page


def test_levels_of_an_element_are_its_own():
    """A head's elements expect the echo by where they face: the cosine of the angle, in dB."""
    ahead = START + 30 * np.array([np.cos(HEADING), np.sin(HEADING), 0])
    scenario = elements_scenario(
        [ahead], receive={**HEAD, "arc_angle": "180 deg"}, paths={"contributions": ["target"], "max_reflections": 0}
    )
    peaks = [
        levels(scenario, channel=row).level_db.sel(contribution="target", pair="all").max().item() for row in (0, 1, 4)
    ]
    # boresight is 90 deg to the right of the target: the first element faces it, the second 45 deg aside
    assert peaks[1] - peaks[0] == pytest.approx(20 * np.log10(np.cos(np.radians(45))), abs=0.01) and peaks[2] == -np.inf
    with pytest.raises(ValueError, match="labels are those of beams"):
        from insonify.simulator import labels

        labels(scenario)


def test_a_sub_band_is_no_more_than_it_should_be():
    """Through the first side lobe of a 0.75 m line over 20 kHz, 60 m of way: the closed form at every frequency.

    Line of length L: sinc(L f sin a / c); absorption as the water states at f; six nodes, 1e-3; one node is 20 times
    worse.
    """
    off, away, length = np.radians(2.2), 30.0, 0.75
    bearing = HEADING + np.pi / 2 + off
    place = START + away * np.array([np.cos(bearing), np.sin(bearing), 0])
    settings = {
        "pulse": {"kind": "lfm", "frequency": CARRIER, "bandwidth": 20e3, "duration": 2e-3},
        "transmit": {"kind": "line", "length": length, "element": "omni"}, "track": {"speed": 0.0},
        "receive": {"kind": "point", "element": "omni"}, "paths": {"max_reflections": 0, "contributions": ["target"]},
        "water": {"noise_level_db": None, "sound_speed": SPEED},
    }  # fmt: skip
    errors = {}
    for count in (1, 6):
        scenario = elements_scenario(
            [place], receiver={"bandwidth": 25e3, "record": "beams", "sub_bands": count}, **settings
        )
        received = simulate(scenario).pressure.values[0, 0]
        simulator = build_simulator(scenario)
        rate, bins = scenario.sonar.receiver.sample_rate, 4096
        offset = np.fft.fftfreq(bins, 1 / rate)
        frequency = CARRIER + offset
        lost = scenario.water.absorption(frequency) * 2 * away
        gain = np.sinc(length * frequency / SPEED * np.sin(off)) * 10 ** (-lost / 20) * 1e10 / away**2
        turn = np.exp(-2j * np.pi * frequency * 2 * away / SPEED)
        known = np.fft.ifft(simulator.pulse.spectrum(offset) * gain * turn) * rate
        errors[count] = relative_rms(received, known[: len(received)])
    assert errors[6] < 1e-3 and errors[1] > 20 * errors[6]
