"""Claims about the shape of the sea's noise: where each cause peaks, where they cross, and how levels add."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from insonify.ocean import (
    NoiseSpectrum,
    noise_components_db,
    noise_level_db,
    rain_noise_db,
    shipping_noise_db,
    thermal_noise_db,
    turbulence_noise_db,
    wind_noise_db,
)

FINE = np.geomspace(1, 1e6, 60_001)
frequencies = st.floats(1, 1e6)
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")


def test_wind_is_strongest_at_400_hertz():
    """20 log f - 40 log(f + 0.4) has its maximum where f = 0.4 kHz, at any wind."""
    for wind in (0.0, 5.0, 15.0):
        assert FINE[np.argmax(wind_noise_db(FINE, wind))] == pytest.approx(400, rel=1e-3)


def test_ships_are_strongest_at_23_hertz():
    """26 log f - 60 log(f + 0.03) has its maximum where 26 (f + 0.03) = 60 f: at 22.94 Hz."""
    assert FINE[np.argmax(shipping_noise_db(FINE, 0.3))] == pytest.approx(1e3 * 0.78 / 34, rel=1e-3)


def test_the_peaks_are_as_strong_as_printed():
    """At 0.4 kHz wind is 50 - 20 log 1.6 + 7.5 sqrt(w) dB; at 30 Hz ships are 40 + 26 log .03 - 60 log .06."""
    assert wind_noise_db(400.0, 0.0) == pytest.approx(50 - 20 * np.log10(1.6))
    assert wind_noise_db(400.0, 16.0) - wind_noise_db(400.0, 4.0) == pytest.approx(15)
    assert shipping_noise_db(30.0, 0.5) == pytest.approx(40 + 26 * np.log10(0.03) - 60 * np.log10(0.06))


def test_wind_falls_by_six_decibels_an_octave_above_ten_kilohertz():
    """The classical rule above the knee, to 0.5 dB: -6 dB from 10 to 20 kHz and from 20 to 40 kHz."""
    steps = np.diff(wind_noise_db([1e4, 2e4, 4e4], 8.0))
    np.testing.assert_allclose(steps, -20 * np.log10(2), atol=0.5)


@given(st.floats(1, 100), st.floats(1.1, 3))
def test_ten_times_the_rain_is_15_decibels_stronger(rate, octaves):
    """15.4 dB per decade of the rate at every frequency: the coefficient of Ma and Nystuen."""
    f = 1e3 * 2**octaves
    assert rain_noise_db(f, 10 * rate) - rain_noise_db(f, rate) == pytest.approx(15.4)
    assert rain_noise_db(5e3, 1.0) == pytest.approx(42.4)


@given(frequencies, st.floats(1.01, 10))
def test_molecules_are_a_power_law(frequency, factor):
    """Thermal noise grows as f^2 and turbulence falls as f^-3, over any interval."""
    up = thermal_noise_db(frequency * factor) - thermal_noise_db(frequency)
    down = turbulence_noise_db(frequency * factor) - turbulence_noise_db(frequency)
    assert up == pytest.approx(20 * np.log10(factor), abs=1e-9)
    assert down == pytest.approx(-30 * np.log10(factor), abs=1e-9)


def test_wind_and_molecules_cross_between_100_and_300_khz():
    """In a breeze of 5 m/s the molecules take over at some 200 kHz; more wind moves the crossing up."""

    def crossing(wind):
        return brentq(lambda f: float(wind_noise_db(f, wind) - thermal_noise_db(f)), 1e4, 1e7)

    assert 100e3 < crossing(5.0) < 300e3
    assert crossing(2.0) < crossing(5.0) < crossing(10.0)


@given(frequencies, st.floats(0, 20), st.floats(0, 1), st.floats(0, 100))
def test_the_level_is_the_logarithm_of_a_sum(frequency, wind, ships, rain):
    """Two ways to add: powers in the package, log-sum-exp of the levels here."""
    levels = noise_components_db(frequency, wind_speed=wind, shipping=ships, rain_rate=rain)
    expected = np.logaddexp.reduce([float(x) * np.log(10) / 10 for x in levels.values()]) * 10 / np.log(10)
    assert noise_level_db(frequency, wind_speed=wind, shipping=ships, rain_rate=rain) == pytest.approx(expected)


@given(st.floats(10, 9e4))
def test_a_measured_copy_of_the_sea_makes_it_three_decibels_stronger(frequency):
    """The sea's own level, measured and added to itself, is 10 log 2 above it."""
    grid = np.geomspace(10, 1e5, 2001)
    copy = NoiseSpectrum(grid, noise_level_db(grid))
    total = noise_level_db(frequency, spectrum=copy)
    assert total - noise_level_db(frequency) == pytest.approx(10 * np.log10(2), abs=1e-3)


@given(st.floats(100, 1e5), st.floats(-40, 40), st.floats(20, 120))
def test_a_measured_power_law_is_reproduced_everywhere(frequency, slope, level):
    """Level linear in the logarithm of frequency is interpolated exactly, from three points."""
    f = np.array([100.0, 3e3, 1e5])
    law = NoiseSpectrum(f, level + slope * np.log10(f / 1e3))
    assert law.level_db(frequency) == pytest.approx(level + slope * np.log10(frequency / 1e3), abs=1e-9)


def test_a_measured_spectrum_keeps_its_own_numbers():
    """A list changed afterwards does not change what was measured."""
    level = np.array([60.0, 50.0])
    spectrum = NoiseSpectrum([1e3, 1e4], level)
    level[0] = 0.0
    assert spectrum.level_db(1e3) == 60
    assert spectrum.level_db([[1e3, 1e4]]).shape == (1, 2)


def test_every_cause_has_its_name():
    """Five causes, six with a measured one; rain is there when it is silent."""
    assert list(noise_components_db(1e3)) == ["thermal", "turbulence", "shipping", "wind", "rain"]
    assert list(noise_components_db(1e3, spectrum=NoiseSpectrum([1e3], [40.0])))[-1] == "measured"
    assert noise_components_db(1e3)["rain"] == -np.inf


def test_the_defaults_are_a_breeze_and_some_ships():
    """5 m/s, shipping 0.5 and no rain, stated or unsaid."""
    f = np.array([50.0, 1e3, 5e4])
    stated = noise_level_db(f, wind_speed=5.0, shipping=0.5, rain_rate=0.0)
    np.testing.assert_array_equal(noise_level_db(f), stated)
