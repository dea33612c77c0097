"""Claims about wave spectra: published moments, closed forms, dispersion, and the fan of directions."""

import csv
import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean.directional_spreading import CosinePowerSpreading, ElfouhailySpreading
from insonify.ocean.elfouhaily import Elfouhaily, phase_speed
from insonify.ocean.jonswap import Jonswap
from insonify.ocean.pierson_moskowitz import MAST_WIND_RATIO, PHILLIPS, SHAPE, PiersonMoskowitz
from insonify.ocean.wave_spectrum import (
    GRAVITY,
    angular_frequency,
    height_variance,
    mean_square_slope,
    significant_height,
    vertical_speed_rms,
)
from insonify.validity import PhysicsWarning

PRINTED = list(csv.DictReader((Path(__file__).parents[1] / "published" / "stewart_2008_pierson_moskowitz.csv").open()))
winds = st.floats(3, 20)
spectra = {
    "Pierson-Moskowitz": PiersonMoskowitz(9.0),
    "JONSWAP": Jonswap(9.0, fetch=30e3),
    "Elfouhaily": Elfouhaily(9.0),
    "young Elfouhaily": Elfouhaily(9.0, inverse_age=2.0),
}


@pytest.mark.parametrize("row", PRINTED, ids=lambda row: row["quantity"])
def test_stewart_prints_these_moments(row):
    """The developed sea of Pierson and Moskowitz, to half of the last printed digit."""
    sea = PiersonMoskowitz(12.0)
    aloft = MAST_WIND_RATIO * 12.0
    ours = {
        "peak frequency times U19.5 over g": math.sqrt(GRAVITY * sea.peak) * aloft / GRAVITY,
        "variance times g^2 over U19.5^4": height_variance(sea) * GRAVITY**2 / aloft**4,
        "significant height times g over U19.5^2": significant_height(sea) * GRAVITY / aloft**2,
    }
    assert ours[row["quantity"]] == pytest.approx(float(row["value"]), abs=float(row["print_unit"]) / 2)


@given(winds)
def test_a_developed_sea_has_its_closed_form(wind):
    """Pierson and Moskowitz: variance alpha U^4 / (4 beta g^2), with U at 19.5 m."""
    expected = PHILLIPS * (MAST_WIND_RATIO * wind) ** 4 / (4 * SHAPE * GRAVITY**2)
    assert height_variance(PiersonMoskowitz(wind)) == pytest.approx(expected, rel=1e-5)


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")  # the norm holds for a sea past its age too
@given(winds, st.floats(1e3, 1e6), st.floats(1, 6))
def test_a_growing_sea_has_the_published_norm(wind, fetch, enhancement):
    """JONSWAP's variance is alpha g^2 / (5 omega_p^4 (1 - 0.287 ln gamma)) within 3 %, the norm of DNV-RP-C205."""
    sea = Jonswap(wind, fetch, enhancement)
    strength = 0.076 * (wind**2 / (fetch * GRAVITY)) ** 0.22
    expected = strength * GRAVITY**2 / (5 * sea.peak_frequency**4 * (1 - 0.287 * math.log(enhancement)))
    assert height_variance(sea) == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("name", spectra)
def test_the_peak_is_where_it_is_stated(name):
    """The dominant waves: the maximum over frequency, S(k) dk/d omega, lies at the named wavenumber within 10 %."""
    k = np.geomspace(0.3, 3, 20001) * spectra[name].peak
    top = k[np.argmax(spectra[name].density(k) * np.sqrt(k))]
    assert top == pytest.approx(spectra[name].peak, rel=0.1)


@pytest.mark.parametrize("name", ["Pierson-Moskowitz", "JONSWAP"])
def test_frequency_and_wavenumber_hold_the_same_sea(name):
    """The same variance over angular frequency as over wavenumber."""
    sea = spectra[name]
    omega = np.geomspace(0.3, 300, 20001) * math.sqrt(GRAVITY * sea.peak)
    assert np.trapezoid(sea.frequency_density(omega), omega) == pytest.approx(height_variance(sea), rel=1e-4)


def test_slope_of_a_saturated_sea():
    """Far above the peak every octave holds alpha / 2 ln 2 of slope."""
    octave = mean_square_slope(PiersonMoskowitz(10.0), 40.0, min_wavenumber=20.0)
    assert octave == pytest.approx(PHILLIPS / 2 * math.log(2), rel=1e-4)
    assert mean_square_slope(PiersonMoskowitz(10.0), 20.0, min_wavenumber=20.0) == 0


def test_heave_of_a_developed_sea():
    """Vertical speed: alpha U^2 sqrt(pi / beta) / 4, by Gamma(1/2), within 0.5 % (short waves left out, tension)."""
    expected = PHILLIPS * (MAST_WIND_RATIO * 10) ** 2 * math.sqrt(math.pi / SHAPE) / 4
    assert vertical_speed_rms(PiersonMoskowitz(10.0), 100.0) ** 2 == pytest.approx(expected, rel=5e-3)
    assert vertical_speed_rms(PiersonMoskowitz(10.0), 100.0, water_depth=5.0) ** 2 < 0.8 * expected


@pytest.mark.parametrize("wind", [5.0, 7.0, 10.0, 14.0])
def test_the_finest_ripples_glitter_as_the_sun_shows(wind):
    """Elfouhaily's total slope is Cox and Munk's 0.003 + 0.00512 U within 15 %, as the paper set out to have it."""
    assert mean_square_slope(Elfouhaily(wind), 2e4) == pytest.approx(0.003 + 5.12e-3 * wind, rel=0.15)


@given(winds)
def test_two_spectra_agree_on_a_developed_sea(wind):
    """Elfouhaily's developed sea is as high as Pierson and Moskowitz's within 20 %."""
    assert significant_height(Elfouhaily(wind)) == pytest.approx(significant_height(PiersonMoskowitz(wind)), rel=0.2)


@given(winds)
def test_a_sea_grows_with_its_fetch_until_it_is_old(wind):
    """Farther from the shore the waves are higher and longer; after thousands of kilometres they are of age."""
    near, far, ocean = (Elfouhaily.from_fetch(wind, x) for x in (3e4, 3e5, 1e9))
    assert significant_height(near) < significant_height(far)
    assert near.peak > far.peak
    assert ocean.inverse_age == pytest.approx(0.84)


def test_young_waves_are_quick():
    """JONSWAP: the peak frequency is 3.5 (g / U) (g X / U^2)^(-1/3) [Hz], to the last digit of 3.5."""
    sea, growth = Jonswap(10.0, 30e3), GRAVITY * 30e3 / 10.0**2
    expected = 3.5 * GRAVITY / 10.0 * growth ** (-1 / 3)
    assert sea.peak_frequency / (2 * math.pi) == pytest.approx(expected, rel=0.05 / 3.5)


def test_ripples_follow_the_friction_velocity_of_the_wind():
    """Elfouhaily at 370 rad/m: the saturation is half of 0.01 (1 + 3 ln(u*/0.23)), 0.01256 for u* = 0.381 at 10 m/s."""
    assert 370.0**3 * Elfouhaily(10.0).density(370.0) == pytest.approx(0.01256, rel=2e-3)


def test_a_sea_of_22000_has_a_known_age():
    """Where g X / U^2 is 2.2e4 the inverse wave age is 0.84 / tanh(1)^0.75 = 1.030."""
    assert Elfouhaily.from_fetch(10.0, 2.2e4 * 100 / GRAVITY).inverse_age == pytest.approx(1.030, abs=5e-4)


def test_light_wind_raises_no_ripples():
    """Below about 3 m/s the short waves of the fit would be negative: the saturation k^3 S has no bump."""
    with pytest.warns(PhysicsWarning, match="Elfouhaily.*3 to 21 m/s"):
        calm = Elfouhaily(2.0)
    assert np.all(calm.density(np.geomspace(0.1, 1e4, 50)) >= 0)
    k = np.geomspace(50, 1000, 30)
    assert np.all(np.diff(k**3 * calm.density(k)) < 0)
    assert not np.all(np.diff(k**3 * Elfouhaily(8.0).density(k)) < 0)


@given(st.floats(1e-3, 1e3))
def test_long_waves_feel_the_bottom(k):
    """Shallow water: all waves run at sqrt(g D). Deep water, no tension: omega^2 = g k."""
    depth, tension = 1e-3 / k, math.sqrt(1 + 7.2e-5 * k**2 / GRAVITY)
    assert angular_frequency(k, water_depth=depth) == pytest.approx(k * math.sqrt(GRAVITY * depth) * tension, rel=1e-6)
    assert angular_frequency(k) == pytest.approx(math.sqrt(GRAVITY * k + 7.2e-5 * k**3))
    assert angular_frequency(0.0) == 0 == angular_frequency(0.0, water_depth=10.0)


def test_no_wave_is_slower_than_23_cm_per_second():
    """Gravity hands over to surface tension at 1.7 cm: the slowest wave runs at 0.23 m/s (textbook value)."""
    k = np.geomspace(10, 1e4, 10001)
    speed = angular_frequency(k) / k
    assert speed.min() == pytest.approx(0.23, abs=0.005)
    assert 2 * math.pi / k[np.argmin(speed)] == pytest.approx(0.017, abs=0.0005)
    np.testing.assert_allclose(phase_speed(k), speed, rtol=0.02)


fans = {
    "all around": CosinePowerSpreading(0.0),
    "wind sea": CosinePowerSpreading(10.0),
    "swell": CosinePowerSpreading(200.0),
    "Elfouhaily": ElfouhailySpreading(Elfouhaily(9.0)),
}


@pytest.mark.parametrize("name", fans)
@pytest.mark.parametrize("k_over_peak", [0.5, 1.0, 30.0, 3000.0])
def test_every_wave_goes_somewhere(name, k_over_peak):
    """The fan holds all the waves, and its quantiles are where its integral states."""
    fan, k = fans[name], k_over_peak * spectra["Elfouhaily"].peak
    angle = np.linspace(-np.pi, np.pi, 20001)
    share = fan.density(angle, k)
    assert np.trapezoid(share, angle) == pytest.approx(1, rel=1e-6)
    for p in (0.01, 0.3, 0.5, 0.9):
        below = np.linspace(-np.pi, fan.quantile(p, k), 20001)
        assert np.trapezoid(fan.density(below, k), below) == pytest.approx(p, abs=1e-6)


@pytest.mark.parametrize("k", [0.1, 0.3, 3.0, 30.0, 370.0])
def test_a_photograph_of_the_moving_sea_is_the_published_fan(k):
    """Waves and their twins together: crosswind over upwind is (1 - Delta) / (1 + Delta)."""
    sea = Elfouhaily(9.0)
    fan = ElfouhailySpreading(sea)
    ahead, aside, behind = fan.density([0.0, np.pi / 2, np.pi], k)
    grip = math.sqrt((0.8 + 0.065 * 9) * 1e-3) * 9 / 0.23
    c = math.sqrt(9.81 / k * (1 + (k / 370) ** 2))
    delta = math.tanh(0.1733 + 4 * (c / (9 / 0.84)) ** 2.5 + 0.13 * grip * (0.23 / c) ** 2.5)
    assert 2 * aside / (ahead + behind) == pytest.approx((1 - delta) / (1 + delta), rel=2e-3)
    assert fan.anisotropy(k) == pytest.approx(delta, rel=1e-3)
    assert ahead > aside > behind


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PiersonMoskowitz(0.0), r"PiersonMoskowitz\.wind_speed is 0"),
        (lambda: Jonswap(-3.0, 1e4), r"Jonswap\.wind_speed is -3"),
        (lambda: Jonswap(5.0, 0.0), r"Jonswap\.fetch is 0"),
        (lambda: Jonswap(5.0, 1e4, 0.5), r"Jonswap\.enhancement is 0\.5"),
        (lambda: Elfouhaily(float("nan")), r"Elfouhaily\.wind_speed is nan"),
        (lambda: Elfouhaily(5.0, -1.0), r"Elfouhaily\.inverse_age is -1"),
        (lambda: Elfouhaily.from_fetch(5.0, -1.0), "fetch is -1"),
        (lambda: CosinePowerSpreading(-1.0), r"CosinePowerSpreading\.exponent is -1"),
    ],
)
def test_a_sea_that_cannot_be_is_refused(make, message):
    """No wind, no shore, no peak: the message names the value and a way out."""
    with pytest.raises(ValueError, match=message):
        make()


def test_inside_its_range_the_law_is_silent():
    """A wind of 9 m/s over an old sea is what the law was made for; an age of 6 is not."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Elfouhaily(9.0)
    with pytest.warns(PhysicsWarning, match=r"Elfouhaily.*0\.83 to 5"):
        Elfouhaily(9.0, 6.0)


@pytest.mark.parametrize(
    ("sea", "message"),
    [
        (lambda: PiersonMoskowitz(30.0), r"Pierson & Moskowitz.* 3 to 20 m/s; 30 m/s"),
        (lambda: Jonswap(5.0, 1e6), r"JONSWAP.*U\^2/g 0\.1 to 22000"),
        (lambda: Elfouhaily(30.0), r"Elfouhaily.* 3 to 21 m/s"),
    ],
)
def test_a_sea_outside_its_law_is_warned_of(sea, message):
    """Each spectrum names its range of winds, or of fetches: past 2.2e4 U^2/g a sea is grown, and grows no more."""
    with pytest.warns(PhysicsWarning, match=message):
        sea()
