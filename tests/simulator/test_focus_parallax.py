"""Claims about where patterns receive from: every element from its own place, at the moment when the echo comes."""

import numpy as np
import pytest

from insonify.processing import beam_recording, complex_coherence, compressed_recording
from insonify.scenario.scenario import Scenario
from insonify.simulator import arrivals, build_simulator, simulate
from oracles.aperture import ALTITUDE, strip
from oracles.arrays import HEADING, START, elements_scenario, some_targets
from oracles.arrival_sum import coherent_from_arrivals
from oracles.scenes import nominal, point
from synthesis.oracle import relative_rms


def test_channels_of_one_array_with_one_phase_centre_receive_one_speckle():
    """A sonar moves on by 20 cm, and an element 40 cm astern takes the place of the first: coherence at least 0.995.

    Elements of 0.1 m at 150 kHz and 30 m: patterns evaluated at directions from the array's centre would lose 0.009.
    About 100 looks: known to 1e-4.
    """
    track = {"start": (0.0, 0.0, 20.0 - ALTITUDE), "pings": 2, "window": (0.0370, 0.0435)}
    scenario = strip(places=[0.0, -0.4], track=track, paths={"contributions": ["seabed"], "beam_cutoff_db": -40},
                 sonar={"transmit": {"kind": "line", "length": 0.1}})  # fmt: skip
    held = compressed_recording(simulate(scenario), scenario.sonar.pulse, window="hamming").pressure.values[..., 10:-60]
    assert abs(complex_coherence(held[0, 0], held[1, 1])) >= 0.995


def test_arrivals_of_an_element_come_from_their_positions():
    """Pistons of 0.1 m, 0.5 m from the centre, targets 15 m off and more, moving: arrivals are the recording, 1e-5.

    The direction of each is that from the element at the moment when the echo comes: to a milliradian.
    """
    targets = some_targets()
    pair = {"kind": "elements", "positions": [(0.0, -0.5, 0.0), (0.0, 0.5, 0.0)], "size": (0.1, 0.0)}
    scenario = elements_scenario(targets, receive=pair)
    held, simulator = simulate(scenario).pressure.values[0], build_simulator(scenario)
    here = simulator.ping_geometry(0)
    way = 3.0 * np.array([np.cos(HEADING), np.sin(HEADING), 0])
    for channel, right in enumerate((-0.5, 0.5)):
        rows = arrivals(scenario, channel=channel)
        again = coherent_from_arrivals(rows, here, simulator.grid, channel=channel)[0]
        assert relative_rms(again, held[channel]) < 1e-5
        direct = rows.take(rows.receive_family == "D")
        place = START - right * way / 3 + direct.delay[:, None] * way
        expected = direct.position - place
        expected /= np.linalg.norm(expected, axis=1)[:, None]
        np.testing.assert_allclose(direct.arrival, expected, atol=1e-3)


@pytest.mark.parametrize("speed", [1.5, 3.0])
def test_a_moving_beam_receives_a_place_abeam_from_where_it_has_come_to(speed):
    """1.5 m at 100 kHz, a target 100 m abeam as the pulse leaves: it comes back v t / R off the beam's axis.

    2.4 dB at 3 m/s: sinc(L / wavelength 2 v / c), within 0.1 dB; elements by delay and sum lose as much, to -40 dB.
    """
    whole = {"kind": "line", "length": 1.5, "elements": 200, "element": "omni"}
    track = {"kind": "line", "start": (0, 0, 11.0), "speed": speed, "window": (0.13, 0.137)}

    def received(record, hop):
        scene = nominal(targets=[point(0.0, 100.0, 11.0)], paths={"contributions": ["target"], "max_reflections": 0},
                        transmit={"kind": "point", "length": None}, receive=whole,
                        sonar={"receiver": {"bandwidth": 20e3, "record": record}})  # fmt: skip
        expected = scene.model_dump(mode="json", exclude={"track"})
        return simulate(Scenario(**expected, track={**track, "stop_and_hop": hop}))

    hopping, moving = (np.abs(received("beams", hop).pressure.values[0, 0]) for hop in (True, False))
    expected = 20 * np.log10(np.sinc(1.5 / 0.015 * 2 * speed / 1500))
    assert 20 * np.log10(moving.max() / hopping.max()) == pytest.approx(expected, abs=0.1)
    elements = received("elements", False)
    formed = np.abs(beam_recording(elements, [np.pi / 2], transmitter_position=(0, 0, 0)).pressure.values[0, 0])
    assert np.abs(formed - moving).max() < 0.01 * moving.max()
