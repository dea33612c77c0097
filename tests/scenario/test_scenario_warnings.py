"""Scenarios that can be simulated but may not be meant get one warning, with its numbers, when they are checked."""

import warnings

import numpy as np
import pytest

from insonify.scenario.scenario import Scenario
from insonify.validity import PhysicsWarning

LINE = {"kind": "line", "length": 1.5}
SOUND_SPEED, FREQUENCY = 1500.0, 100e3


def warnings_of(
    *, receive: dict = LINE, pulse: dict | None = None, band: float = 20e3, water: dict | None = None,
    transmit: dict = LINE, record: str = "beams",
) -> list:  # fmt: skip
    """The cautions of a scenario."""
    sent = {"frequency": FREQUENCY, "duration": 0.2e-3, "taper_fraction": 0.2} | (pulse or {})
    sonar = {
        "source_level_db": 220, "pulse": sent,
        "transmit": transmit | {"steer": 0}, "receive": receive, "receiver": {"bandwidth": band, "record": record},
    }  # fmt: skip
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        Scenario(sonar=sonar, water=water or {}, track={"kind": "static", "position": (0, 0, 11)})
    assert all(word.category is PhysicsWarning for word in caught)
    return [str(word.message) for word in caught]


def test_the_nominal_sonar_gives_no_cause():
    """Its band leaves out 2.8 % of the pulse, its arrays are continuous, its water is ordinary."""
    assert warnings_of() == []


def test_water_outside_the_absorption_law_is_reported_before_the_run():
    """Law and range, once; a measured absorption requests no law."""
    (word,) = warnings_of(water={"temperature": 30})
    assert "Francois & Garrison" in word and "-2 to 22 degC" in word
    assert warnings_of(water={"temperature": 30, "absorption_db_per_m": 0.03}) == []


def test_an_absorption_of_decibels_per_kilometre_without_their_unit_is_warned_of():
    """34 dB/m is a thousand times that of the sea at 100 kHz; nine times that is taken as measured."""
    (word,) = warnings_of(water={"absorption_db_per_m": 34})
    assert word == (
        "water.absorption_db_per_m: 34 dB/m is 1011 times the 33.6 dB/km of the law at 100 kHz. "
        "Did you mean 34 dB/km? Write the unit."
    )
    assert warnings_of(water={"absorption_db_per_m": 0.3}) == []


@pytest.mark.parametrize(
    ("bounce", "reflections", "count"), [("statistical", 2, 1), ("explicit", 1, 1), ("explicit", 0, 0)]
)
def test_bubbles_beyond_the_range_of_their_law_are_warned_of_before_the_run(bounce, reflections, count):
    """At 300 kHz the handbook's bubble loss is an extrapolation, wherever a windy surface reflects a path."""
    array = {"kind": "line", "length": 0.1}
    sonar = {
        "source_level_db": 220,
        "pulse": {"frequency": 300e3, "duration": 0.2e-3},
        "transmit": array,
        "receive": array,
    }
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        Scenario(sonar=sonar, surface={"reflection": bounce, "wind_speed": 3}, paths={"max_reflections": reflections},
                 track={"kind": "static", "position": (0, 0, 11)})  # fmt: skip
    assert sum("trusted for frequency 10 to 100 kHz; 300 kHz" in str(word.message) for word in caught) == count


def test_a_receiver_narrower_than_its_sweep_is_reported_what_is_lost():
    """A sweep of 40 kHz spends half of its time, hence half of its energy, inside 20 kHz."""
    sweep = {"kind": "lfm", "bandwidth": 40e3, "duration": 20e-3, "taper": "none"}
    (word,) = warnings_of(pulse=sweep)
    assert word.startswith("sonar.receiver.bandwidth: 20 kHz is narrow for a pulse with a band of 40 kHz;")
    # the roll-off on either side passes 0.375 of its 2.5 kHz as energy (mean of cos^4)
    passed = (20 + 2 * 2.5 * 0.375) / 40
    lost = float(word.partition(";")[2].split("%")[0])
    assert abs(lost - 100 * (1 - passed)) < 1.5
    assert warnings_of(pulse=sweep, band=44e3) == []


def test_grating_lobes_are_counted_in_beams_and_the_nearest_is_named():
    """Elements d apart repeat a beam every wavelength / d in direction cosine; each beam has its own nearest."""
    steer = np.radians([0.0, 3.0, -20.0])
    (word,) = warnings_of(receive=LINE | {"elements": 25, "steer": tuple(steer)})
    period = SOUND_SPEED / FREQUENCY / (1.5 / 25)
    replicas = np.arcsin(np.sin(steer)[:, None] + np.array([-period, period]))
    nearest = np.degrees(np.abs(replicas - steer[:, None]).min())
    assert word.startswith("sonar.receive: grating lobes in 3 of 3 beams")
    assert f"the nearest stands {nearest:.1f} deg from its beam" in word


def test_only_beams_with_a_strong_replica_are_counted():
    """Elements 0.6 wavelengths apart repeat a beam steered to the side, not the one ahead."""
    half = LINE | {"length": 0.9, "elements": 100, "steer": (0.0, np.radians(60))}
    (word,) = warnings_of(receive=half)
    assert "in 1 of 2 beams" in word


def elements_warnings(count: int, *, element: str = "baffled", transmitter: float = 4e-3, **more: object) -> list:
    """Warnings about an array 0.24 m long whose elements are recorded, and a transmitter of a length [m]."""
    array = LINE | {"length": 0.24, "elements": count, "element": element} | more
    return warnings_of(receive=array, transmit=LINE | {"length": transmitter}, record="elements")


def test_recorded_elements_are_warned_of_where_two_insonified_directions_look_alike():
    """Elements d apart repeat a beam every wavelength / d of sine; a sector of 2 sin 75 deg takes 0.52 wavelengths."""
    (word,) = elements_warnings(24)
    assert word.startswith("sonar.receive: the elements are 0.67 wavelengths apart, and beams formed of them have")
    assert "-75 to 75 deg" in word and "Give at least 31 elements" in word
    assert elements_warnings(31) == [] and len(elements_warnings(30)) == 1


def test_recorded_elements_that_receive_one_beam_alone_are_not_warned_of():
    """A transmitter of 10 wavelengths lights up 5 deg; pistons 3/4 wavelength wide receive less than 1.33 of sine."""
    assert elements_warnings(8, transmitter=0.15) == []
    assert elements_warnings(22, element="piston") == [] and len(elements_warnings(12)) == 1


def test_beams_that_will_be_formed_of_elements_are_checked_as_recorded_ones_are():
    """The angles of sonar.receive.steer, with the words for beams."""
    (word,) = elements_warnings(22, steer=(0.0, np.radians(60)))
    assert word.startswith("sonar.receive: grating lobes in 1 of 2 beams")
    assert elements_warnings(22, steer=0.0) == []


@pytest.mark.parametrize("kind", ["planar", "point"])
def test_other_arrays_are_requested_as_well(kind):
    """A panel with sparse rows has lobes below and above; a point has none."""
    panel = {"kind": "planar", "width": 1, "height": 1, "rows": 20}
    words = warnings_of(receive=panel if kind == "planar" else {"kind": "point"})
    assert len(words) == (kind == "planar")
    if words:
        assert f"the nearest stands {np.degrees(np.arcsin(0.015 * 20)):.1f} deg" in words[0]
