"""The studies of real recordings: their statistics against closed forms, and the recordings where they are at hand."""

import numpy as np
import pytest

from insonify.studies import harbour_angular_response as angular
from insonify.studies import harbour_echo_trains as trains


def test_speckle_of_single_looks_is_rayleigh() -> None:
    """Exponential intensities: 10 log10(e) pi / sqrt(6) = 5.57 dB and skew -1.14, widened by the mean of neighbours."""
    angle, rng = np.linspace(40, 75, 20_000), np.random.default_rng(2)
    spread, skew = angular._speckle(angle, 10 * np.log10(rng.exponential(size=angle.size)))
    own = (10 / np.log(10)) ** 2 * np.pi**2 / 6
    neighbours = (10 / np.log(10)) ** 2 / angular.NEIGHBOURS  # variance of the level of a mean of n looks, large n
    assert spread == pytest.approx(np.sqrt(own + neighbours), abs=0.1)
    assert skew == pytest.approx(-1.14, abs=0.12)


def test_insonified_area_is_limited_by_pulse_or_beam() -> None:
    """Oblique: width x range x pulse / sine; vertical: the beam's footprint."""
    slant, angle, length = np.array([10.0, 8.0]), np.array([60.0, 0.0]), np.array([0.05, 0.05])
    found = 10 ** (angular._area_db(slant, angle, 0.02, 0.03, length) / 10)
    assert found == pytest.approx([0.02 * 10 * 0.05 / np.sin(np.pi / 3), 0.02 * 0.03 * 64])


def test_energy_in_the_gate_is_that_of_the_echo() -> None:
    """A constant level over 0.2 m within the gate has 0.2 of the energy of one over a metre."""
    slant = np.arange(0, 10, 0.001)
    level = np.where(np.abs(slant - 5) < 0.1, -20.0, -300.0)
    assert trains._gated(slant, level, 5.0) == pytest.approx(-20 + 10 * np.log10(0.2), abs=0.03)


def test_a_perfect_mirror_has_an_apparent_reflection_of_zero() -> None:
    """A bed that mirrors all: the echo's apparent reflection is 0 dB, spreading and absorption undone."""
    import insonify

    scenario = insonify.load_scenario("examples/nominal.yaml").with_({
        "targets": [], "seabed.scattering": None, "seabed.reflection": 1.0, "surface.reflection": "flat",
        "surface.wind_speed": None, "paths.families": ["D", "B"], "sonar.mounting.tilt": "90 deg",
        "water.sound_speed": trains.SOUND_SPEED, "sonar.transmit": {"kind": "point"},
        "sonar.receive": {"kind": "point"},
        "track.window": ["5 ms", "25 ms"], "sonar.pulse.taper": "hann", "sonar.pulse.duration": "0.5 ms",
    })  # fmt: skip
    slant, level = trains._apparent(insonify.simulate(scenario), scenario)
    peak = int(np.argmax(level))
    assert slant[peak] == pytest.approx(9 + 0.5e-3 / 2 * trains.SOUND_SPEED / 2, abs=0.05)  # the middle of the pulse
    assert level[peak] - 20 * np.log10(slant[peak] / 9) == pytest.approx(0, abs=0.1)
