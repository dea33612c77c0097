"""Claims about simulated recordings, processed: simulation and processing share no code, and agree on the world."""

import numpy as np
import pytest

from insonify.frames import direction
from insonify.processing import beamform_delay_sum, compressed_recording, synthetic_aperture_image
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from oracles.scenes import nominal, point

C = 1500.0
TARGET = np.array([1.0, 18.0, 17.0])
SWEEP = {"kind": "lfm", "frequency": 100e3, "duration": 1e-3, "bandwidth": 20e3}


@pytest.fixture(scope="module")
def recording():
    """A single transducer that creeps north at 0.1 m/s past two point targets, 41 pings on 4 m."""
    omni = {"kind": "point", "length": None}
    described = nominal(
        transmit=omni, receive=omni, sonar={"pulse": SWEEP}, paths={"contributions": ["target"], "max_reflections": 0},
        targets=[point(*TARGET, label="one"), point(2.0, 20.0, 17.0, label="two", strength=-6.0)],
    )  # fmt: skip
    track = {
        "kind": "line",
        "start": (-1.0, 0, 11),
        "speed": 0.1,
        "pings": 41,
        "interval": 1.0,
        "window": (0.02, 0.034),
    }
    scenario = Scenario(**described.model_dump(mode="json", exclude={"track"}), track=track)
    held = simulate(scenario)
    held["element_position"] = (("channel", "axis"), np.zeros((1, 3)))
    return compressed_recording(held, scenario.sonar.pulse, window="hamming")


@pytest.mark.parametrize(("place", "strength"), [((1.0, 18.0), 0.0), ((2.0, 20.0), -6.0)])
def test_point_targets_stand_where_the_scenario_put_them(recording, place, strength):
    """Peak within a pixel of 5 mm along and 10 mm across; level by the sonar equation, spreading varying by 0.1 dB."""
    north, east = place[0] + np.arange(-8, 9) * 0.005, place[1] + np.arange(-8, 9) * 0.01
    image = np.abs(synthetic_aperture_image(recording, north, east, TARGET[2]).pressure.values)
    i, j = np.unravel_index(np.argmax(image), image.shape)
    assert north[i] == pytest.approx(place[0], abs=0.006)
    assert east[j] == pytest.approx(place[1], abs=0.011)
    slant = np.sqrt((recording.position.values[:, 0] - place[0]) ** 2 + place[1] ** 2 + 6**2)
    relative_absorption = float(recording.attrs.get("absorption_db_per_m", 0.03))
    expected = 220 + strength + 20 * np.log10(np.mean(slant**-2 * 10 ** (-relative_absorption * slant / 10)))
    assert 20 * np.log10(image.max()) == pytest.approx(expected, abs=0.5)


def test_a_log_without_sway_costs_focus(recording):
    """1.5 mm of sway at random, logged but not sailed: the peak falls to exp(-(2 k s cos)^2 / 2) in the mean (Ruze).

    41 draws know the mean of such phasors to 0.1; the truth, requested, is as sharp as ever.
    """
    sway = np.random.default_rng(3).normal(size=41) * 0.0015
    wrong = recording.copy()
    wrong["logged_position"] = recording.logged_position + sway[:, None] * np.array([0, 1.0, 0])
    place = ([1.0], [18.0], TARGET[2])
    sharp = np.abs(synthetic_aperture_image(recording, *place).pressure.values)[0, 0]
    blurred = np.abs(synthetic_aperture_image(wrong, *place).pressure.values)[0, 0]
    true = np.abs(synthetic_aperture_image(wrong, *place, navigation="true").pressure.values)[0, 0]
    turn = 2 * (2 * np.pi * 100e3 / C) * 0.0015 * 18 / np.hypot(18, 6)
    assert blurred / sharp == pytest.approx(np.exp(-(turn**2) / 2), abs=0.2)
    assert true == pytest.approx(sharp, rel=1e-5)


def test_elements_summed_are_the_beams_that_are_simulated():
    """Sixteen simulated elements by delay and sum are the simulator's own far-field beams, to -40 dB (rms).

    Half a wavelength apart; beams at -10, 0 and 10 degrees; three targets at 140 m.
    """
    steers, pitch, count = np.radians([-10.0, 0, 10]), C / 100e3 / 2, 16
    bearings = np.radians([88.0, 97.0, 101.5])
    targets = [point(140 * np.cos(b), 140 * np.sin(b), 11.0, label=f"{b:.2f}") for b in bearings]
    about = {
        "transmit": {"kind": "point", "length": None}, "targets": targets,
        "sonar": {"pulse": {"kind": "cw", "frequency": 100e3, "duration": 1e-3, "taper": "hann"}},
        "paths": {"contributions": ["target"], "max_reflections": 0}, "track": {"window": (0.184, 0.192)},
    }  # fmt: skip
    whole = {"length": count * pitch, "elements": count, "element": "omni", "steer": tuple(steers)}
    beams = simulate(nominal(receive=whole, **about))
    places = np.zeros((count, 3))
    places[:, 0] = (np.arange(count) - (count - 1) / 2) * pitch
    rows = [
        simulate(nominal(receive={"kind": "point", "length": None, "offset": tuple(place)}, **about))
        for place in places
    ]
    series = np.concatenate([row.pressure.values[0] for row in rows])
    # the array faces starboard, so to the right of it is astern
    looks = direction(np.pi / 2 + steers)
    formed = beamform_delay_sum(series, places, rows[0].time.values, looks, centre_frequency=100e3, focus="far",
                                sound_speed=C)  # fmt: skip
    simulated = beams.pressure.values[0]
    assert np.abs(simulated).max() > 1
    off = np.sqrt(np.mean(np.abs(formed - simulated) ** 2)) / np.sqrt(np.mean(np.abs(simulated) ** 2))
    assert 20 * np.log10(off) < -40


def test_the_two_targets_do_not_touch(recording):
    """Between them, half way, 35 dB less than at the stronger one."""
    peak = np.abs(synthetic_aperture_image(recording, [1.0], [18.0], 17.0).pressure.values)
    between = np.abs(synthetic_aperture_image(recording, [1.5], [19.0], 17.0).pressure.values)
    assert between[0, 0] < 10 ** (-35 / 20) * peak[0, 0]
