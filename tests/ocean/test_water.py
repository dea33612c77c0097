"""Claims about the water as a thing of the scenario."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.ocean import Water, absorption_db_per_m


def test_default_water_is_the_papers():
    """1500 m/s, and the absorption of Francois & Garrison at 10 degC and 35 g/kg."""
    water = Water()
    assert water.sound_speed == 1500
    assert water.absorption(100e3) == absorption_db_per_m(100e3)


def test_colder_or_deeper_water_is_not_the_same():
    """Temperature, salinity, acidity and depth all reach the law."""
    water = Water(temperature="4 degC", salinity=33, ph=7.7)
    assert water.absorption(3e4, depth=50) == absorption_db_per_m(3e4, temperature=4, salinity=33, ph=7.7, depth=50)


@pytest.mark.parametrize("stated", [0.034, "0.034 dB/m", "34 dB/km"])
def test_a_measured_absorption_overrules_the_law(stated):
    """One number for every frequency; per metre or per kilometre, stated in words."""
    water = Water(absorption_db_per_m=stated)
    np.testing.assert_allclose(water.absorption([1e4, 1e6]), [0.034, 0.034])


def test_lossless_and_silent_water_can_be_requested():
    """Zero absorption is a number like any other; no noise is None."""
    water = Water(absorption_db_per_m=0, noise_level_db=None)
    assert water.absorption(1e5) == 0
    assert water.noise_level_db is None


@pytest.mark.parametrize(
    "wrong",
    [
        {"sound_speed": 150},
        {"sound_speed": "1500 kn"},
        {"sound_speed": float("nan")},
        {"salinity": -1},
        {"ph": 5},
        {"noise_level_db": float("inf")},
        {"absorption_db_per_m": -0.1},
        {"absorption_db_per_m": "34 dB"},
        {"absorption_db_per_m": "34 dB/mile"},
        {"temprature": 10},
    ],
)
def test_impossible_water_is_refused(wrong):
    """Numbers no sea has, wrong units, NaN and misspelt fields are errors that name the field."""
    with pytest.raises(ValidationError, match=next(iter(wrong))):
        Water(**wrong)


def test_words_and_numbers_describe_the_same_water():
    """Units in words are SI inside."""
    assert Water(sound_speed="1.48e3 m/s", noise_level_db="40 dB re 1 uPa^2/Hz") == Water(
        sound_speed=1480, noise_level_db=40
    )
