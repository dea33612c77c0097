"""Claims about Lambert's law: energy, reciprocity, and what may be requested."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from insonify.scattering import Lambert

angles = st.floats(0, np.pi / 2)
azimuths = st.floats(0, 2 * np.pi)
BACK = np.array(np.pi)


@given(angles, angles, azimuths)
def test_reciprocity(a, b, azimuth):
    """Swapping source and receiver changes nothing."""
    law = Lambert()
    assert law.cross_section(a, b, azimuth) == pytest.approx(law.cross_section(b, a, azimuth), rel=1e-12)


@pytest.mark.parametrize("grazing_in_deg", [5, 30, 90])
def test_a_white_patch_returns_what_it_got(grazing_in_deg):
    """White furnace: at strength 1/pi the sound scattered over the hemisphere is the sound received."""
    grazing, dazimuth = np.linspace(0, np.pi / 2, 2001), 2 * np.pi
    came_in = np.radians(grazing_in_deg)
    sigma = Lambert(strength_db=10 * np.log10(1 / np.pi)).cross_section(came_in, grazing, np.zeros_like(grazing))
    assert dazimuth * np.trapezoid(sigma * np.cos(grazing), grazing) == pytest.approx(np.sin(came_in), rel=1e-6)


@pytest.mark.parametrize("grazing_deg", [1, 4, 10, 45, 90])
def test_backscatter_is_minus_27_plus_20_log_sine(grazing_deg):
    """Mackenzie (1961): S = -27 dB + 20 log10 sin(grazing) back to the sonar."""
    grazing = np.radians(grazing_deg)
    strength = 10 * np.log10(Lambert().cross_section(grazing, grazing, BACK))
    assert strength == pytest.approx(-27 + 20 * np.log10(np.sin(grazing)))


def test_nothing_comes_through_from_behind():
    """A patch turned away from either end is dark."""
    law = Lambert()
    assert law.cross_section(-0.1, 0.3, BACK) == 0
    assert law.cross_section(0.3, -0.1, BACK) == 0
    assert law.cross_section(-0.1, -0.1, BACK) == 0


def test_angles_broadcast():
    """Every way in against every way out."""
    ways = np.linspace(0.1, 1.0, 4)
    assert Lambert().cross_section(ways[:, None], ways[:3], np.zeros((4, 3))).shape == (4, 3)


@pytest.mark.parametrize("strength_db", [-4.9, 0.0, float("nan"), float("-inf")])
def test_more_sound_out_than_in_is_refused(strength_db):
    """Above 10 log10(1/pi) = -4.97 dB a patch would amplify; NaN is no strength at all."""
    with pytest.raises(ValueError, match=r"Lambert\.strength_db is .*-27"):
        Lambert(strength_db=strength_db)


def test_a_scenario_may_state_the_strength_in_words():
    """From a file the strength may carry its unit."""
    assert TypeAdapter(Lambert).validate_python({"strength_db": "-30 dB"}) == Lambert(strength_db=-30.0)


@pytest.mark.parametrize("wrong", [{"strenght_db": -27}, {"strength_db": "-27 m"}, {"strength_db": 3}])
def test_a_scenario_may_not_misspell_it(wrong):
    """A misspelt field, a wrong unit and an amplifying patch are errors of the file."""
    with pytest.raises(ValidationError):
        TypeAdapter(Lambert).validate_python(wrong)
