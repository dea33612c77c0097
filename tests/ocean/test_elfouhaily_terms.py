"""Claims about Elfouhaily's spectrum term by term: a second program of it, and limits in closed form."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import Elfouhaily

pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")


def _second_program(k, wind, omega):
    """The spectrum as one scalar formula after the published one, height curvature first: S = (B_l + B_h) / k^3."""
    g, km, cm = 9.81, 370.0, 0.23
    kp = g * (omega / wind) ** 2
    c, cp = math.sqrt(g / k + g * k / km**2), wind / omega
    pierson = math.exp(-5 * kp**2 / (4 * k**2))
    sigma = 0.08 + 0.32 / omega**3
    gamma = 1.7 if omega < 1 else 1.7 + 6 * math.log10(omega)
    jonswap = math.exp(math.log(gamma) * math.exp(-((math.sqrt(k / kp) - 1) ** 2) / (2 * sigma**2)))
    long = 0.5 * 6e-3 * omega**0.5 * cp / c * math.exp(-omega * (math.sqrt(k / kp) - 1) / 10**0.5)
    friction = wind * math.sqrt(8e-4 + 6.5e-5 * wind)
    log = math.log(friction / cm)
    alpha = 1e-2 * (1 + log) if friction < cm else 1e-2 * (1 + 3 * log)
    short = 0.5 * max(alpha, 0) * cm / c * math.exp(-((k - km) ** 2) / (4 * km**2))
    return (long + short) * pierson * jonswap / k**3


@pytest.mark.parametrize("omega", [0.84, 1.0, 2.0, 4.5])
@pytest.mark.parametrize("wind", [4.0, 7.0, 12.0, 20.0])
def test_two_programs_agree(wind, omega):
    """From a third of the peak to 3000 rad/m, old seas and young, to 1e-9."""
    sea = Elfouhaily(wind, omega)
    k = np.geomspace(sea.peak / 3, 3000, 60)
    np.testing.assert_allclose(sea.density(k), [_second_program(x, wind, omega) for x in k], rtol=1e-9)


def test_very_near_the_shore_waves_age_as_the_fetch_to_the_minus_three_tenths():
    """Tanh is its argument there: Omega = 0.84 (g X / 2.2e4 U^2)^(-0.4 x 0.75)."""
    one, ten = (Elfouhaily.from_fetch(10.0, x).inverse_age for x in (10.0, 100.0))
    assert one / ten == pytest.approx(10**0.3, rel=1e-3)
    assert one == pytest.approx(0.84 * (9.81 * 10 / (2.2e4 * 100)) ** -0.3, rel=1e-3)


@given(st.floats(3.5, 20))
def test_the_dominant_waves_run_with_the_wind_over_their_age(wind):
    """The peak's phase speed g / k, squared, is (U / Omega)^2, long waves being heavy."""
    sea = Elfouhaily(wind, 1.5)
    assert math.sqrt(9.81 / sea.peak) == pytest.approx(wind / 1.5)


def test_nothing_is_longer_than_the_longest_waves():
    """At an eighth of the peak's wavenumber the density is below 1e-30 of the peak's."""
    sea = Elfouhaily(10.0)
    assert sea.density(sea.peak / 8) < 1e-30 * sea.density(sea.peak)


def test_a_shore_that_is_none_is_refused():
    """No fetch, no sea; the message states what to give."""
    with pytest.raises(ValueError, match="fetch is 0"):
        Elfouhaily.from_fetch(10.0, 0.0)
