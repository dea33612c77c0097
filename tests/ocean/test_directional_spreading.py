"""Claims about the fan of directions: closed forms of its moments, its quantiles, and how it follows the wavelength."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import CosinePowerSpreading, Elfouhaily, ElfouhailySpreading

exponents = st.floats(0, 300)
ROUND = np.linspace(-np.pi, np.pi, 4096, endpoint=False)


def _mean(fan, function, k=1.0):
    """Mean over directions; the midpoint rule is exact for periodic functions as smooth as these."""
    return np.mean(fan.density(ROUND, k) * function(ROUND)) * 2 * np.pi


def test_without_an_exponent_every_direction_is_alike():
    """S = 0: the density is 1 / 2 pi and the quantiles are spread evenly."""
    fan = CosinePowerSpreading(0.0)
    np.testing.assert_allclose(fan.density(ROUND, 1.0), 1 / (2 * np.pi))
    np.testing.assert_allclose(
        fan.quantile([0.1, 0.25, 0.5, 0.8], 1.0), 2 * np.pi * np.array([-0.4, -0.25, 0, 0.3]), atol=1e-12
    )


def test_the_first_power_is_a_cardioid():
    """S = 1: (1 + cos) / 2 pi."""
    np.testing.assert_allclose(
        CosinePowerSpreading(1.0).density(ROUND, 1.0), (1 + np.cos(ROUND)) / (2 * np.pi), atol=1e-15
    )


@given(exponents)
def test_the_mean_cosine_has_its_closed_form(exponent):
    """<cos phi> = s / (s + 1), the first Fourier coefficient of cos^(2s)(phi / 2)."""
    assert _mean(CosinePowerSpreading(exponent), np.cos) == pytest.approx(exponent / (exponent + 1), abs=2e-4)


@given(st.floats(1, 300))
def test_the_second_harmonic_has_its_closed_form(exponent):
    """<cos 2 phi> = s (s - 1) / ((s + 1) (s + 2))."""
    expected = exponent * (exponent - 1) / ((exponent + 1) * (exponent + 2))
    assert _mean(CosinePowerSpreading(exponent), lambda a: np.cos(2 * a)) == pytest.approx(expected, abs=1e-6)


@given(exponents)
def test_a_crossing_wave_is_two_to_the_minus_s_of_the_leading_one(exponent):
    """cos^(2s) of 45 degrees, and nothing runs straight against the wind unless all directions are alike."""
    ahead, aside, behind = CosinePowerSpreading(exponent).density([0.0, np.pi / 2, np.pi], 1.0)
    assert aside / ahead == pytest.approx(2**-exponent, rel=1e-9)
    assert behind <= aside * (1 + 1e-12)


@given(exponents, st.floats(0.001, 0.999))
def test_as_many_waves_run_to_the_left_as_to_the_right(exponent, share):
    """Quantiles of p and 1 - p are mirror images, and the median is the mean direction."""
    fan = CosinePowerSpreading(exponent)
    left, right = fan.quantile([share, 1 - share], 1.0)
    assert left == pytest.approx(-right, abs=1e-9)
    assert fan.quantile(0.5, 1.0) == 0


def test_quantiles_span_the_whole_circle():
    """The ends of the probability are the two sides of straight behind, and the quantile grows in between."""
    angles = CosinePowerSpreading(5.0).quantile(np.linspace(0, 1, 101), 1.0)
    assert angles[0] == pytest.approx(-np.pi)
    assert angles[-1] == pytest.approx(np.pi)
    assert np.all(np.diff(angles) > 0)


def test_a_sharp_fan_is_a_bell():
    """For large s the fan is Gaussian with variance 2 / s: a sixth lies beyond one deviation on each side."""
    sigma = math.sqrt(2 / 2000)
    np.testing.assert_allclose(
        CosinePowerSpreading(2000.0).quantile([0.158655, 0.841345], 1.0), [-sigma, sigma], rtol=1e-3
    )


def test_one_fan_serves_all_lengths():
    """The cosine fan does not read the wavenumber, only its shape."""
    fan = CosinePowerSpreading(7.0)
    assert fan.density(0.3, np.array([0.1, 1.0, 100.0])).shape == (3,)
    assert len(set(fan.density(0.3, np.array([0.1, 1.0, 100.0])).tolist())) == 1
    assert fan.quantile(np.full((4, 1), 0.3), np.ones(5)).shape == (4, 5)


@pytest.mark.parametrize("exponent", [-1.0, math.inf, math.nan])
def test_a_fan_that_cannot_be_is_refused(exponent):
    """Less than all around, or a single direction."""
    with pytest.raises(ValueError, match=r"CosinePowerSpreading\.exponent is .*such as 10"):
        CosinePowerSpreading(exponent)


def test_the_wind_pulls_with_its_published_drag():
    """u* = sqrt((0.8 + 0.065 U) 1e-3) U: 0.381 m/s at 10 m/s, 0.918 m/s at 20 m/s."""
    assert Elfouhaily(10.0).friction_velocity == pytest.approx(0.3808, abs=5e-5)
    assert Elfouhaily(20.0).friction_velocity == pytest.approx(0.9165, abs=5e-5)


@pytest.mark.parametrize("wind", [5.0, 10.0, 18.0])
def test_wind_waves_are_narrow_at_the_peak_and_again_as_ripples(wind):
    """From the peak the fan opens towards shorter waves, and closes again at the slowest, near 370 rad/m."""
    sea = Elfouhaily(wind)
    fan = ElfouhailySpreading(sea)
    k = np.geomspace(sea.peak, 370.0, 200)
    narrow = fan.anisotropy(k)
    widest = int(np.argmin(narrow))
    assert 0 < widest < 199
    assert np.all(np.diff(narrow[: widest + 1]) < 0)
    assert np.all(np.diff(narrow[widest:]) > 0)
    assert fan.anisotropy(3000.0) < narrow[-1]


@pytest.mark.parametrize("inverse_age", [0.84, 2.0])
def test_at_the_peak_the_fan_is_four_and_a_sixth(inverse_age):
    """X = ln 2 / 4 + 4 where c = cp, whatever the age of the sea; ripples add less than a hundredth there."""
    sea = Elfouhaily(12.0, inverse_age)
    assert np.arctanh(ElfouhailySpreading(sea).anisotropy(sea.peak)) == pytest.approx(math.log(2) / 4 + 4, abs=0.01)


def test_more_wind_combs_the_ripples():
    """At 370 rad/m the fan narrows with the wind's grip on the water: x = ln 2 / 4 + 0.13 u* / 0.23, to 1 %."""
    for wind in (5.0, 10.0, 20.0):
        sea = Elfouhaily(wind)
        ripples = math.log(2) / 4 + 0.13 * sea.friction_velocity / 0.23
        assert np.arctanh(ElfouhailySpreading(sea).anisotropy(370.0)) == pytest.approx(ripples, rel=0.01)


@given(st.floats(0.05, 3000), st.floats(0.01, 0.99))
def test_a_quantile_of_a_wind_sea_undoes_its_share(k, share):
    """The density, summed up to the quantile, is the share that was requested."""
    fan = ElfouhailySpreading(Elfouhaily(8.0))
    angle = np.linspace(-np.pi, float(fan.quantile(share, k)), 4001)
    assert np.trapezoid(fan.density(angle, k), angle) == pytest.approx(share, abs=1e-5)
