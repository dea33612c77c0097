"""Claims about absorption: printed values, limits, and one warning outside the law."""

import csv
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import absorption_db_per_m, absorption_filter
from insonify.ocean.absorption import MODELS
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
"""Acidity at which the boric term is 10^-45 of its usual size [1]; no water has it: the laws are called themselves."""


def _law(frequency, model="francois-garrison", temperature=10.0, salinity=35.0, depth=0.0, ph=8.0):
    """A law without the check of what water can be [dB/m]."""
    conditions = (np.asarray(c, dtype=float) for c in (frequency, temperature, salinity, depth, ph))
    return MODELS[model](*conditions) / 1e3


def _magnesium(frequency, salinity=35.0, depth=0.0):
    """What salt adds to water without boric acid [dB/m]."""
    salt, fresh = (_law(frequency, salinity=s, depth=depth, ph=NO_BORON) for s in (salinity, 0.0))
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


def test_less_acid_water_absorbs_more():
    """One unit of pH is a factor 10^0.78 of the boric term."""
    neutral, alkaline, without = _law(1e3, ph=[7.0, 8.0, NO_BORON])
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
    ("frequency", "condition", "range_stated"),
    [
        (1e5, {"temperature": 28.0}, "-2 to 22 degC"),
        (1e5, {"salinity": [7.0, 5.0]}, "30 to 35 g/kg"),
        (1e5, {"depth": 5000.0}, "0 to 3500 m"),
        ([2e6, 3e6], {}, "200 to 1e\\+06 Hz"),
    ],
)
def test_outside_the_law_one_warning_reports_it(frequency, condition, range_stated):
    """A number comes back, with one sentence naming law and range."""
    with pytest.warns(PhysicsWarning, match=f"Francois & Garrison.*{range_stated}") as caught:
        assert np.all(absorption_db_per_m(frequency, **condition) > 0)
    assert len(caught) == 1


def test_above_500_khz_warm_brackish_water_is_inside_the_law():
    """Where viscosity rules, the law holds from 0 to 30 degC and for any salt."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loss = absorption_db_per_m(700e3, temperature=28.0, salinity=10.0)
    assert 0.1 < loss < 0.3


def test_an_unknown_law_is_reported_with_the_known_ones():
    """The error lists what can be requested."""
    with pytest.raises(ValueError, match=r"'thorp'.*available are: francois-garrison"):
        absorption_db_per_m(1e5, model="thorp")


# Ainslie & McColm, and absorption as a filter


FREQUENCIES = np.geomspace(200, 1e6, 60)


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")  # 30 degC and 5 g/kg are beyond the older law
@pytest.mark.parametrize(
    "condition",
    [{"temperature": t} for t in (-2, 4, 10, 20, 30)]
    + [{"salinity": s} for s in (5, 20, 40)]
    + [{"depth": z} for z in (1e3, 3e3)]
    + [{"ph": ph} for ph in (7.7, 8.3)],
    ids=str,
)
def test_the_simple_law_stays_within_a_tenth_of_the_full_one(condition):
    """Ainslie & McColm (1998): 10 % of Francois & Garrison from 200 Hz to 1 MHz."""
    simple = absorption_db_per_m(FREQUENCIES, model="ainslie-mccolm", **condition)
    np.testing.assert_allclose(simple, absorption_db_per_m(FREQUENCIES, **condition), rtol=0.1)


def _simple(frequency, **water):
    return _law(frequency, "ainslie-mccolm", **water)


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_the_simple_law_lets_pressure_fade_each_cause_at_its_own_rate():
    """Magnesium by exp(-z/6 km), water by exp(-z/17 km), boron not at all; 17 is what careless copies lose."""
    water = _simple(1e6, salinity=0.0, depth=[0.0, 2000.0])
    assert water[1] / water[0] == pytest.approx(np.exp(-2 / 17), rel=1e-12)
    salt = _simple(1e5, ph=NO_BORON, depth=[0.0, 2000.0]) - _simple(1e5, salinity=0.0, depth=[0.0, 2000.0])
    assert salt[1] / salt[0] == pytest.approx(np.exp(-2 / 6), rel=1e-12)


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_the_simple_law_relaxes_where_its_ions_do():
    """At an ion's own frequency half of its share is left: 0.106 f1 / 2 and 0.52 (1 + T/43) f2 / 2 [dB/km]."""
    boron, magnesium = 0.78 * np.exp(10 / 26) * 1e3, 42 * np.exp(10 / 17) * 1e3
    boric = _simple(boron) - _simple(boron, ph=NO_BORON)
    assert boric * 1e3 == pytest.approx(0.106 * boron / 1e3 / 2, rel=1e-9)
    salt = _simple(magnesium, ph=NO_BORON) - _simple(magnesium, salinity=0.0)
    assert salt * 1e3 == pytest.approx(0.52 * (1 + 10 / 43) * magnesium / 1e3 / 2, rel=1e-9)
    alkaline, neutral, without = _simple(1e3, ph=[8.0, 7.0, NO_BORON])
    assert (alkaline - without) / (neutral - without) == pytest.approx(np.exp(1 / 0.56), rel=1e-9)


def test_in_the_simple_law_warm_water_is_less_viscous():
    """Fresh water loses 0.49 dB/m at 1 MHz and 0 degC, and e times less 27 degC warmer."""
    with pytest.warns(PhysicsWarning, match=r"Ainslie & McColm.*5 to 50 g/kg"):
        cold, warm = _simple(1e6, salinity=0.0, temperature=[0.0, 27.0])
    assert cold == pytest.approx(0.49, rel=1e-12)
    assert cold / warm == pytest.approx(np.e, rel=1e-12)


def test_a_filter_is_the_loss_over_the_way():
    """The absolute response in decibels is the absorption times the path, at every frequency and length."""
    f, path = np.array([[1e5], [3e5]]), np.array([0.0, 50.0, 200.0])
    response = absorption_filter(f, path)
    np.testing.assert_allclose(-20 * np.log10(response), absorption_db_per_m(f) * path, atol=1e-12)


def test_a_relative_filter_leaves_the_centre_alone():
    """Beside a loss charged at the centre the filter is 1 there, and both together are the absolute one."""
    f = np.linspace(3e5, 6e5, 7)
    relative = absorption_filter(f, 100.0, centre_frequency=4.5e5, temperature=15.0)
    assert relative[3] == pytest.approx(1, rel=1e-12)
    centre = absorption_filter(4.5e5, 100.0, temperature=15.0)
    np.testing.assert_allclose(relative * centre, absorption_filter(f, 100.0, temperature=15.0))


def test_two_stretches_of_water_filter_one_after_the_other():
    """Responses multiply where paths add."""
    f = np.linspace(1e5, 5e5, 5)
    np.testing.assert_allclose(
        absorption_filter(f, 30.0) * absorption_filter(f, 70.0), absorption_filter(f, 100.0), rtol=1e-12
    )


def test_a_wide_chirp_loses_its_high_notes():
    """Over 100 m the top of a 300-600 kHz chirp falls 8 to 10 dB below its bottom."""
    low, high = absorption_filter([3e5, 6e5], 100.0, centre_frequency=4.5e5)
    assert low > 1 > high
    assert 8 < 20 * np.log10(low / high) < 10


@pytest.mark.parametrize("model", ["francois-garrison", "ainslie-mccolm"])
def test_less_than_no_salt_is_refused(model):
    """A negative salinity has no meaning in any law."""
    with pytest.raises(ValueError, match="-2 g/kg"):
        absorption_db_per_m(1e5, salinity=-2.0, model=model)


@pytest.mark.parametrize(
    ("frequency", "condition", "message"),
    [
        (2e6, {}, "100 to 1e\\+06 Hz"),
        (1e5, {"temperature": 35.5}, "-6 to 35 degC"),
        (1e5, {"depth": 7.1e3}, "0 to 7000 m"),
        (1e5, {"ph": 8.4}, "7.7 to 8.3"),
        (1e5, {"ph": 7.6}, "7.7 to 8.3"),
    ],
)
def test_outside_the_simple_law_one_warning_reports_it(frequency, condition, message):
    """A number comes back, with one sentence naming law and range."""
    with pytest.warns(PhysicsWarning, match=f"Ainslie & McColm.*{message}") as caught:
        _simple(frequency, **condition)
    assert len(caught) == 1
