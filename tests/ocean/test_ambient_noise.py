"""Claims about the noise of the sea."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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
from insonify.units import intensity_ratio
from insonify.validity import PhysicsWarning

PUBLISHED = Path(__file__).parents[1] / "published"
BOLTZMANN = 1.380649e-23
FREQUENCIES = np.geomspace(10, 1e5, 41)


def test_thermal_noise_is_half_a_kt_in_each_mode():
    """Equipartition: 4 pi k T rho f^2 / c per hertz; Mellen's -15 + 20 log f[kHz] is within 0.4 dB of it."""
    f = np.array([1e4, 1e5, 1e6])
    pascal = 4 * np.pi * BOLTZMANN * 283.15 * 1025 * f**2 / 1490
    np.testing.assert_allclose(thermal_noise_db(f), 10 * np.log10(pascal * 1e12), atol=0.4)


def test_each_cause_has_the_slope_of_its_physics():
    """Per decade, far from any corner: thermal +20 dB, turbulence -30, wind +20 then -20, ships -34 at the top."""
    two = np.array([1.0, 10.0])
    assert np.diff(thermal_noise_db(two * 1e4)) == pytest.approx(20)
    assert np.diff(turbulence_noise_db(two)) == pytest.approx(-30)
    assert np.diff(wind_noise_db(two)) == pytest.approx(20, abs=0.5)
    assert np.diff(wind_noise_db(two * 1e4)) == pytest.approx(-20, abs=1)
    assert np.diff(shipping_noise_db(two * 1e3)) == pytest.approx(-34, abs=1)


def test_the_published_fits_at_one_kilohertz():
    """Where log f is 0 the coefficients stand alone: -15, 17, and 40 and 50 less their corners."""
    assert thermal_noise_db(1e3) == pytest.approx(-15)
    assert turbulence_noise_db(1e3) == pytest.approx(17)
    assert shipping_noise_db(1e3, 0.5) == pytest.approx(40 - 60 * np.log10(1.03))
    assert wind_noise_db(1e3, 4.0) == pytest.approx(50 + 15 - 40 * np.log10(1.4))
    assert rain_noise_db(5e3, 10.0) == pytest.approx(42.4 + 15.4)


def test_wind_noise_is_what_is_read_from_wenzs_curves():
    """Wenz (1962), as tabulated by Beaufort force: 2 dB at 1 kHz; at 19 kHz the fit lies 5 dB below what is read."""
    rows = np.loadtxt(PUBLISHED / "wenz_wind_noise.csv", delimiter=",", skiprows=4)
    frequency, wind, level = rows.T
    away = wind_noise_db(1e3 * frequency, wind) - level
    assert np.max(np.abs(away[frequency == 1])) < 2
    assert -6 < away[frequency == 19][0] < -4


def test_two_models_of_wind_noise_agree():
    """Vagle, Large & Farmer (1990), quoted, not verified: 20 log10(53.91 U - 104.5) dB at 8 kHz; 4 dB apart at most."""
    wind = np.array([5.0, 7.5, 10.0, 15.0])
    np.testing.assert_allclose(wind_noise_db(8e3, wind), 20 * np.log10(53.91 * wind - 104.5), atol=4)


def test_the_busiest_sea_is_20_db_stronger_than_the_remotest():
    """Shipping from 0 to 1 spans 20 dB at every frequency."""
    np.testing.assert_allclose(shipping_noise_db(FREQUENCIES, 1.0) - shipping_noise_db(FREQUENCIES, 0.0), 20)


@given(st.floats(0, 20), st.floats(0, 1), st.floats(0, 100))
def test_causes_add_as_powers(wind, shipping, rain):
    """The sum of all powers, never below the strongest cause nor 7 dB (five equal ones) above it."""
    f = FREQUENCIES[20:30]
    causes = noise_components_db(f, wind_speed=wind, shipping=shipping, rain_rate=rain)
    total = noise_level_db(f, wind_speed=wind, shipping=shipping, rain_rate=rain)
    np.testing.assert_allclose(intensity_ratio(total), sum(intensity_ratio(c) for c in causes.values()))
    strongest = np.max(list(causes.values()), axis=0)
    assert np.all((total >= strongest) & (total <= strongest + 7))


@given(st.floats(0, 19), st.floats(0, 0.9), st.floats(0, 99))
def test_more_weather_and_more_ships_are_never_quieter(wind, shipping, rain):
    """The level grows with wind, ships and rain."""
    f = np.array([1e3, 5e3, 3e4])
    here = noise_level_db(f, wind_speed=wind, shipping=shipping, rain_rate=rain)
    for more in ((wind + 1, shipping, rain), (wind, shipping + 0.1, rain), (wind, shipping, rain + 1)):
        assert np.all(noise_level_db(f, wind_speed=more[0], shipping=more[1], rain_rate=more[2]) >= here)


def test_the_dominant_source_of_each_band():
    """Eddies at 1 Hz, ships at 50 Hz, wind at 10 kHz, molecules at 400 kHz."""
    for frequency, ruler in ((1.0, "turbulence"), (50.0, "shipping"), (1e4, "wind"), (4e5, "thermal")):
        causes = noise_components_db(frequency)
        assert max(causes, key=lambda name: causes[name]) == ruler


def test_above_a_megahertz_only_molecules_are_received():
    """The whole is the thermal limit, and no fit needs a warning."""
    assert noise_level_db(1e6) == pytest.approx(thermal_noise_db(1e6), abs=0.05)


def test_no_rain_is_silent():
    """Nothing falls, nothing is added."""
    assert rain_noise_db(1e4, 0.0) == -np.inf
    assert noise_level_db(1e4, rain_rate=0.0) == noise_level_db(1e4)


def test_rain_is_flat_below_20_khz_and_falls_above():
    """The shape that we state: level to 20 kHz, then 20 dB a decade."""
    np.testing.assert_allclose(rain_noise_db([2e3, 1e4, 2e4], 10.0), rain_noise_db(5e3, 10.0))
    assert rain_noise_db(2e5, 10.0) == pytest.approx(rain_noise_db(2e4, 10.0) - 20)


def test_weather_beyond_what_was_received_warns():
    """A hurricane, and a cloudburst of 300 mm/h."""
    with pytest.warns(PhysicsWarning, match="wind noise.*0 to 20 m/s; 40 m/s"):
        wind_noise_db(1e4, 40.0)
    with pytest.warns(PhysicsWarning, match="rain noise.*0 to 200 mm/h; 300 mm/h"):
        rain_noise_db(1e4, 300.0)


def test_a_measured_spectrum_is_straight_over_the_logarithm_of_frequency():
    """Half-way in octaves is half-way in level, measured points are reached, and it adds like any other cause."""
    shrimps = NoiseSpectrum([1e3, 1e5], [60.0, 40.0])
    assert shrimps.level_db(1e4) == pytest.approx(50)
    np.testing.assert_allclose(shrimps.level_db([1e3, 1e5]), [60, 40])
    power = intensity_ratio(noise_level_db(1e4)) + intensity_ratio(50.0)
    assert intensity_ratio(noise_level_db(1e4, spectrum=shrimps)) == pytest.approx(power)


def test_outside_the_measured_band_its_end_is_held_with_a_warning():
    """No slope is invented."""
    with pytest.warns(PhysicsWarning, match="measured noise spectrum.*1000 to 100000 Hz"):
        assert NoiseSpectrum([1e3, 1e5], [60.0, 40.0]).level_db(2e5) == 40


def test_a_fit_outside_its_range_warns_only_where_it_is_received():
    """A gale at 150 kHz is stronger than the molecules and beyond what anyone fitted; at 1 MHz it is neither."""
    with pytest.warns(PhysicsWarning, match=r"fit of wind noise.*1 to 100000 Hz; 150000 Hz"):
        noise_level_db([150e3, 1e6], wind_speed=20.0)


@pytest.mark.parametrize(
    ("attempt", "message"),
    [
        (lambda: noise_level_db(0.0), "frequency is 0 Hz"),
        (lambda: wind_noise_db(1e3, -1.0), "wind_speed is -1 m/s"),
        (lambda: shipping_noise_db(1e3, [0.5, 2.0]), "shipping is 2"),
        (lambda: rain_noise_db(1e3, -3.0), "rain_rate is -3 mm/h"),
        (lambda: NoiseSpectrum([1e3, 1e2], [1.0, 2.0]), "positive and increase"),
        (lambda: NoiseSpectrum([1e3, 1e4], [1.0]), "one for each"),
    ],
)
def test_what_no_sea_has_is_refused(attempt, message):
    """The error names the quantity, its value and its limit."""
    with pytest.raises(ValueError, match=message):
        attempt()


def test_arguments_broadcast():
    """Frequencies against winds give a table."""
    assert noise_level_db([[1e3], [1e4], [5e4]], wind_speed=[2.0, 10.0]).shape == (3, 2)


@pytest.mark.parametrize("contribution", [turbulence_noise_db, shipping_noise_db, wind_noise_db])
def test_a_contribution_evaluated_alone_names_its_range(contribution):
    """At 1 MHz none of the fits to Wenz's curves was measured; beside the others it is not received, and silent."""
    with pytest.warns(PhysicsWarning, match=r"The fit of .* noise is trusted for frequency"):
        contribution(1e6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        noise_components_db(1e6)
