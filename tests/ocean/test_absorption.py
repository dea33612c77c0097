"""Claims about absorption: printed values, limits, and one warning outside the law."""

import csv
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import absorption_db_per_m
from insonify.validity import PhysicsWarning

PRINTED = list(csv.DictReader((Path(__file__).parents[1] / "published" / "francois_garrison_1982_table4.csv").open()))


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")  # the table goes to 30 degC
@pytest.mark.parametrize("row", PRINTED, ids=lambda row: f"{row['frequency_khz']} kHz")
def test_francois_and_garrison_print_these_values(row):
    """Table IV of the paper, to half of the last printed digit, from 0.4 kHz to 1 MHz."""
    alpha = absorption_db_per_m(
        float(row["frequency_khz"]) * 1e3,
        temperature=float(row["temperature_degc"]),
        salinity=float(row["salinity"]),
        depth=float(row["depth_m"]),
        ph=float(row["ph"]),
    )
    printed, unit = float(row["absorption_db_per_km"]), float(row["print_unit"])
    assert alpha * 1e3 == pytest.approx(printed, abs=unit / 2 * (1 + 1e-9))


def test_a_sidescan_loses_34_db_per_km_at_100_khz():
    """Francois & Garrison, Table IV: 33.6 dB/km at 10 degC, 35 g/kg, surface, and these are the defaults."""
    assert absorption_db_per_m(100e3) == pytest.approx(33.6e-3, abs=0.05e-3)


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_fresh_water_is_only_viscous():
    """Without salt the loss grows with the square of frequency, and there is none at 0 Hz."""
    loss = absorption_db_per_m([0.0, 50e3, 100e3], salinity=0.0)
    assert loss[0] == 0
    assert loss[2] / loss[1] == pytest.approx(4)


@given(st.floats(1e3, 5e5), st.floats(-2, 22), st.floats(30, 35), st.floats(7.5, 8.3))
def test_higher_frequencies_are_lost_sooner(frequency, temperature, salinity, ph):
    """Absorption grows with frequency, in any sea."""
    low, high = absorption_db_per_m([frequency, 1.1 * frequency], temperature=temperature, salinity=salinity, ph=ph)
    assert 0 < low < high


NO_BORON = -50.0
"""Acidity at which the boric term is 10^-45 of its usual size [1]."""


def _magnesium(frequency, salinity=35.0, depth=0.0):
    """What salt adds to water without boric acid [dB/m]."""
    salt, fresh = (absorption_db_per_m(frequency, salinity=s, depth=depth, ph=NO_BORON) for s in (salinity, 0.0))
    return salt - fresh


def _speed(salinity=35.0, depth=0.0):
    return 1412 + 3.21 * 10 + 1.19 * salinity + 0.0167 * depth


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_pressure_frees_the_magnesium_ion():
    """A kilometre down the magnesium term keeps P2 = 1 - 0.137 + 0.0062 of its size, over the sound speed's growth."""
    kept = _magnesium(100e3, depth=1000.0) / _magnesium(100e3)
    assert kept == pytest.approx((1 - 0.137 + 0.0062) * _speed() / _speed(depth=1000.0), rel=1e-9)


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_pressure_stiffens_water():
    """A kilometre down, fresh water keeps P3 = 1 - 0.0383 + 0.00049 of its viscous loss."""
    surface, deep = absorption_db_per_m(700e3, salinity=0.0, depth=[0.0, 1000.0])
    assert deep / surface == pytest.approx(1 - 0.0383 + 0.00049, rel=1e-12)


def test_less_acid_water_is_deafer():
    """One unit of pH is a factor 10^0.78 of the boric term."""
    neutral, alkaline, without = absorption_db_per_m(1e3, ph=[7.0, 8.0, NO_BORON])
    assert (alkaline - without) / (neutral - without) == pytest.approx(10**0.78, rel=1e-9)


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_salt_shifts_the_magnesium_relaxation():
    """Far below its relaxation the term goes as S / (c f2), with f2 as 1 / (1 + 0.0018 (S - 35))."""
    ratio = _magnesium(1e3, salinity=30.0) / _magnesium(1e3)
    assert ratio == pytest.approx(30 / 35 * _speed() / _speed(salinity=30.0) * (1 - 0.009), rel=1e-5)


def test_the_two_fits_of_pure_water_meet_at_20_degc():
    """The paper's own step between its two cubics is below 0.1 %."""
    below, above = absorption_db_per_m(1e6, temperature=[20.0, 20.0 + 1e-9])
    assert above == pytest.approx(below, rel=1e-3)


def test_arguments_broadcast():
    """Three frequencies at two depths give a table."""
    assert absorption_db_per_m([[1e4], [1e5], [4e5]], depth=[0.0, 50.0]).shape == (3, 2)


@pytest.mark.parametrize(
    ("frequency", "condition", "range_said"),
    [
        (1e5, {"temperature": 28.0}, "-2 to 22 degC"),
        (1e5, {"salinity": [7.0, 5.0]}, "30 to 35 g/kg"),
        (1e5, {"depth": 5000.0}, "0 to 3500 m"),
        ([2e6, 3e6], {}, "200 to 1e\\+06 Hz"),
    ],
)
def test_outside_the_law_one_warning_says_so(frequency, condition, range_said):
    """A number comes back, with one sentence naming law and range."""
    with pytest.warns(PhysicsWarning, match=f"Francois & Garrison.*{range_said}") as heard:
        assert np.all(absorption_db_per_m(frequency, **condition) > 0)
    assert len(heard) == 1


def test_above_500_khz_warm_brackish_water_is_inside_the_law():
    """Where viscosity rules, the law holds from 0 to 30 degC and for any salt."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        absorption_db_per_m(700e3, temperature=28.0, salinity=10.0)


def test_an_unknown_law_is_answered_with_the_known_ones():
    """The error lists what can be asked."""
    with pytest.raises(ValueError, match=r"'thorp'.*available are: francois-garrison"):
        absorption_db_per_m(1e5, model="thorp")
