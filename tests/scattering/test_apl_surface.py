"""Claims about APL-UW's sea surface: its terms alone, its joins, reciprocity, and what may be requested."""

import math
import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.scattering.apl_surface import AplSurface, apl_surface_strength_db
from insonify.scattering.bubbles import Bubbles, bubble_loss_db
from insonify.validity import PhysicsWarning

winds, tones = st.floats(0, 20), st.floats(1e4, 1e5)
angles, azimuths = st.floats(1e-3, np.pi / 2), st.floats(-np.pi, np.pi)


def _report_db(wind, frequency, grazing_deg):
    """TR 9407's eqs. 1-16 written out for one angle, independent of the law's code."""
    theta, f = math.radians(grazing_deg), frequency / 1e3
    veil = 10 ** (-5.2577 + 0.4701 * min(wind, 11)) * (f / 25) ** 0.85 * max(wind / 11, 1) ** 3.5
    beta = veil / math.sin(theta)
    bubbles = veil * 0.0136 / (4 * math.pi * 0.0255 * f ** (1 / 3))
    bubbles *= (1 + 8 * beta * math.exp(-2 * beta) - math.exp(-4 * beta)) / (2 * beta)
    s2 = 4.6e-3 * math.log(2.1 * wind**2) if wind >= 1 else 0.0034

    def glint(deg):
        t2 = math.tan(math.radians(90 - deg)) ** 2
        return (1 + t2) ** 2 / (4 * math.pi * s2) * math.exp(-t2 / s2)

    low, high = 30.0, 90.0
    for _ in range(60):  # by halving: where the glint is 15 dB below its peak
        middle = (low + high) / 2
        low, high = (middle, high) if glint(middle) < glint(90) * 10**-1.5 else (low, middle)
    ripples = 1.3e-5 * wind**2 * math.tan(theta) ** 4 if grazing_deg <= 85 else 0.0
    join = 1 / (1 + math.exp(0.524 * (low - grazing_deg)))
    loss = 1.26e-3 * max(wind, 6) ** 1.57 * f**0.85 / math.sin(theta) * math.exp(1.2 * min(wind - 6, 0))
    rough = (join * glint(grazing_deg) + (1 - join) * ripples) * 10 ** (-loss / 10)
    return 10 * math.log10(rough + bubbles)


@given(winds, tones, st.floats(1, 90))
def test_straight_back_is_the_report(wind, frequency, grazing_deg):
    """Two programs of eqs. 1-16 that share no code agree to 1e-5 dB (the join's angle is found by halving)."""
    strength = apl_surface_strength_db(wind, frequency, np.radians(grazing_deg))
    assert strength == pytest.approx(_report_db(wind, frequency, grazing_deg), abs=1e-5)


@given(winds, tones, angles, angles, azimuths)
def test_reciprocity(wind, frequency, a, b, azimuth):
    """Swapping source and receiver changes nothing."""
    law = AplSurface(wind, frequency)
    assert law.cross_section(a, b, azimuth) == pytest.approx(law.cross_section(b, a, azimuth), rel=1e-10)


@given(winds, tones, st.floats(0.01, np.pi / 2))
def test_the_bistatic_law_ends_in_the_monostatic_one(wind, frequency, grazing):
    """In backscatter the law is the printed strength, above half a degree."""
    strength = 10 * np.log10(AplSurface(wind, frequency).cross_section(grazing, grazing, np.pi))
    assert strength == pytest.approx(apl_surface_strength_db(wind, frequency, grazing), abs=1e-9)


def test_low_down_the_sea_is_its_bubbles():
    """At 10 m/s, 50 kHz and 5 degrees the surface itself adds less than 0.1 dB to the veil."""
    low = np.radians(5.0)
    veil = 10 * np.log10(Bubbles(10, 50e3).cross_section(low, low, np.pi))
    assert apl_surface_strength_db(10, 50e3, low) == pytest.approx(veil, abs=0.1)


def test_from_straight_below_the_sea_glints():
    """At the vertical: 1 / (4 pi s^2), less what the veil takes."""
    strength = apl_surface_strength_db(5, 30e3, np.pi / 2)
    mirror = -10 * np.log10(4 * np.pi * 4.6e-3 * np.log(2.1 * 25)) - bubble_loss_db(5, 30e3, np.pi / 2)
    assert strength == pytest.approx(mirror, abs=0.01)


@given(winds, tones)
def test_below_half_a_degree_the_level_is_a_straight_line(wind, frequency):
    """In decibels against angle, through the values at 0.5 and 1 degree, without a step."""
    level = apl_surface_strength_db(wind, frequency, np.radians([0, 0.25, 0.5 - 1e-9, 0.5, 1.0]))
    assert level[3] == pytest.approx(level[2], abs=1e-6)
    assert level[3] - level[0] == pytest.approx(level[4] - level[3], abs=1e-6)
    assert level[1] == pytest.approx((level[0] + level[3]) / 2, abs=1e-6)


def test_wind_and_tone_and_angle_broadcast():
    """Two winds, three tones and four angles give a table; each entry is the one requested alone."""
    angle = np.radians([2, 20, 50, 80])
    table = apl_surface_strength_db(np.array([4, 9])[:, None, None], np.array([2e4, 4e4, 9e4])[:, None], angle)
    assert table.shape == (2, 3, 4)
    assert table[1, 2, 0] == apl_surface_strength_db(9, 9e4, angle[0])


def test_ripples_fade_smoothly_into_the_mirror_direction():
    """Forward, where first order grows without bound, facets have taken over: no infinity, no NaN."""
    out = np.linspace(0.05, np.pi / 2, 400)
    sigma = AplSurface(6, 30e3).cross_section(0.6, out, 0.0)
    assert np.all(np.isfinite(sigma)) and np.argmax(sigma) == pytest.approx(np.argmin(np.abs(out - 0.6)), abs=40)


def test_nothing_comes_from_behind_the_surface():
    """A direction above the surface receives nothing."""
    assert np.all(AplSurface(8, 50e3).cross_section([-0.1, 0.3, 0.0], [0.3, -0.1, 0.0], np.pi) == 0)


@pytest.mark.parametrize(("wind", "frequency", "grazing"), [(-1, 5e4, 0.3), (7, -5e4, 0.3), (7, 5e4, 2.0)])
def test_what_means_nothing_is_refused(wind, frequency, grazing):
    """Negative winds and tones, and angles past the vertical."""
    with pytest.raises(ValueError, match=r"wind_speed|frequency|grazing"):
        apl_surface_strength_db(wind, frequency, grazing)


def test_outside_the_law_one_warning_reports_it():
    """At 400 kHz a number comes back with one sentence; the bistatic form then stays silent."""
    with pytest.warns(PhysicsWarning, match="TR 9407.*Hz") as caught:
        law = AplSurface(7, 4e5)
    assert len(caught) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert law.cross_section(0.3, 0.4, 1.0) > 0
