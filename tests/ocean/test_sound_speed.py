"""Claims about sound speed: printed values, and laws that know nothing of one another."""

import csv
from pathlib import Path

import gsw
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import pressure_dbar, sound_speed, sound_speed_at_pressure
from insonify.validity import PhysicsWarning

PUBLISHED = Path(__file__).parents[1] / "published"
WONG_ZHU = list(csv.DictReader((PUBLISHED / "wong_zhu_1995_sound_speed.csv").open()))
CHECK_POINTS = list(csv.DictReader((PUBLISHED / "sound_speed_check_points.csv").open()))
TEOS10 = list(csv.DictReader((PUBLISHED / "teos10_sound_speed.csv").open()))


@pytest.mark.parametrize("row", WONG_ZHU, ids=lambda row: "/".join(list(row.values())[:3]))
def test_wong_and_zhu_print_these_values(row):
    """The refit on the temperature scale of 1990, to half of the last printed digit."""
    t, s, bar = (float(row[name]) for name in ("temperature_degc", "salinity", "pressure_bar"))
    printed, unit = float(row["sound_speed_m_per_s"]), float(row["print_unit"])
    assert sound_speed_at_pressure(t, s, bar * 10, model="chen-millero") == pytest.approx(printed, abs=unit / 2)


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")  # check points stand at the ends of laws
@pytest.mark.parametrize("row", CHECK_POINTS, ids=lambda row: f"{row['model']} {row['sound_speed_m_per_s']}")
def test_each_law_gives_its_authors_check_value(row):
    """Mackenzie's 1550.744 m/s, UNESCO's 1731.995 m/s, to half of the last printed digit."""
    t, s = float(row["temperature_degc_its90"]), float(row["salinity"])
    if row["depth_m"]:
        speed = sound_speed(t, s, float(row["depth_m"]), model=row["model"])
    else:
        speed = sound_speed_at_pressure(t, s, float(row["pressure_dbar"]), model=row["model"])
    assert speed == pytest.approx(float(row["sound_speed_m_per_s"]), abs=float(row["print_unit"]) / 2)


@pytest.mark.parametrize("row", TEOS10, ids=lambda row: row["pressure_dbar"])
def test_teos_10_gives_the_values_of_its_documentation(row):
    """Conservative temperature turned into what a thermometer reads, and sound speed from that."""
    names = ("absolute_salinity", "conservative_temperature_degc", "pressure_dbar", "sound_speed_m_per_s")
    salinity, conservative, pressure, printed = (float(row[name]) for name in names)
    in_situ = gsw.t_from_CT(salinity, conservative, pressure)
    assert sound_speed_at_pressure(in_situ, salinity, pressure) == pytest.approx(printed, abs=1e-6)


def test_teos_10_distinguishes_thermometers_from_conservative_temperature():
    """30 degC on the thermometer is not 30 degC of heat content: 0.04 m/s between them."""
    mistaken = gsw.sound_speed(35.0, 30.0, 0.0)
    assert abs(sound_speed(30.0, 35.0, 0.0) - mistaken) == pytest.approx(0.037, abs=2e-3)


SHELF = np.meshgrid(np.arange(2.0, 31.0, 4), np.arange(25.0, 41.0, 5), [0.0, 20.0, 100.0, 200.0])


@pytest.mark.parametrize("model", ["chen-millero", "mackenzie", "medwin"])
def test_four_laws_agree_in_shelf_seas(model):
    """Fits of four decades, sharing no code, agree with TEOS-10 in 0.35 m/s: 2 to 30 degC, 25 to 40, 0 to 200 m."""
    t, s, z = SHELF
    absolute = s * 35.16504 / 35
    assert np.max(np.abs(sound_speed(t, s, z, model=model) - sound_speed(t, absolute, z))) < 0.35


@given(st.floats(0, 40), st.floats(0, 40), st.floats(0, 10000))
def test_the_refit_changed_the_scale_and_not_the_sea(temperature, salinity, pressure):
    """UNESCO's coefficients on the scale of 1968 and Wong & Zhu's on that of 1990 agree within 0.012 m/s."""
    old, new = (sound_speed_at_pressure(temperature, salinity, pressure, model=m) for m in ("unesco", "chen-millero"))
    assert old == pytest.approx(new, abs=0.012)


MODELS = ["teos10", "mackenzie", "chen-millero", "medwin", "unesco"]


@pytest.mark.parametrize("model", MODELS)
@given(st.floats(2, 29), st.floats(25, 39), st.floats(0, 900))
def test_warmth_salt_and_weight_all_make_it_faster(model, temperature, salinity, depth):
    """Every law grows with each of the three, below 30 degC."""
    here = sound_speed(temperature, salinity, depth, model=model)
    assert sound_speed(temperature + 1, salinity, depth, model=model) > here
    assert sound_speed(temperature, salinity + 1, depth, model=model) > here
    assert sound_speed(temperature, salinity, depth + 10, model=model) > here


@pytest.mark.parametrize("model", MODELS)
def test_a_hundred_metres_weigh_1_6_metres_per_second(model):
    """The rule of thumb of every sonar operator, to 10 %."""
    top, bottom = sound_speed(10.0, 35.0, [0.0, 100.0], model=model)
    assert bottom - top == pytest.approx(1.63, rel=0.1)


@pytest.mark.parametrize(("model", "gram"), [("mackenzie", 1.340 - 1.025e-2 * 20), ("medwin", 1.34 - 0.010 * 20)])
def test_a_gram_of_salt_counts_less_in_warm_water(model, gram):
    """At 20 degC both short laws print what one more gram adds: 1.34 m/s less a hundredth per degree."""
    fresher, saltier = sound_speed(20.0, [34.0, 35.0], 0.0, model=model)
    assert saltier - fresher == pytest.approx(gram, abs=1e-9)


def test_medwins_rules_of_thumb():
    """Per degree 4.6 - 0.11 T + 0.00087 T^2 m/s, per metre 0.016: the slopes that his six terms print."""
    for t in (0.0, 10.0, 30.0):
        below, above = sound_speed(t + np.array([0.0, 1e-3]), 35.0, 0.0, model="medwin")
        assert (above - below) / 1e-3 == pytest.approx(4.6 - 0.11 * t + 0.00087 * t**2, abs=1e-3)
    assert np.diff(sound_speed(10.0, 35.0, [0.0, 500.0], model="medwin")) == pytest.approx(8.0)


def test_depth_reaches_the_laws_of_pressure_through_the_standard_ocean():
    """Evaluation at a depth is evaluation at the pressure there."""
    by_depth = sound_speed(12.0, 34.0, 500.0, model="chen-millero")
    assert by_depth == sound_speed_at_pressure(12.0, 34.0, pressure_dbar(500.0), model="chen-millero")


def test_teos_10_is_the_default():
    """The first law named in the contract is the default."""
    assert sound_speed(10.0, 35.0, 50.0) == sound_speed(10.0, 35.0, 50.0, model="teos10")
    assert sound_speed_at_pressure(10.0, 35.0, 50.0) == sound_speed_at_pressure(10.0, 35.0, 50.0, model="teos10")


@pytest.mark.parametrize("model", MODELS)
def test_arguments_broadcast(model):
    """Three temperatures at two depths give a table."""
    assert sound_speed([[5.0], [10.0], [15.0]], 35.0, [0.0, 50.0], model=model).shape == (3, 2)


@pytest.mark.parametrize(
    ("model", "conditions", "message"),
    [
        ("mackenzie", (35.0, 35.0, 0.0), "Mackenzie.*2 to 30 degC"),
        ("mackenzie", (10.0, 5.0, 0.0), "Mackenzie.*25 to 40 g/kg"),
        ("mackenzie", (10.0, 35.0, 9000.0), "Mackenzie.*0 to 8000 m"),
        ("medwin", (10.0, 35.0, 1500.0), "Medwin.*0 to 1000 m"),
        ("medwin", (36.0, 35.0, 0.0), "Medwin.*0 to 35 degC"),
        ("medwin", (10.0, 46.0, 0.0), "Medwin.*0 to 45 g/kg"),
        ("chen-millero", (10.0, 41.0, 0.0), "Wong & Zhu.*0 to 40;"),
        ("chen-millero", (10.0, 35.0, 10e3), "Wong & Zhu.*0 to 10000 dbar"),
        ("unesco", (41.0, 35.0, 0.0), "UNESCO.*0 to 40 degC"),
        ("unesco", (10.0, 35.0, 10e3), "UNESCO.*0 to 10000 dbar"),
        ("teos10", (41.0, 35.0, 0.0), "TEOS-10.*-6 to 40 degC"),
        ("teos10", (10.0, 35.0, 10e3), "TEOS-10.*0 to 10000 dbar"),
        ("chen-millero", (-1.5, 34.0, 0.0), "Wong & Zhu.*0 to 40 degC"),
        ("unesco", (10.0, 41.0, 0.0), "UNESCO.*0 to 40"),
        ("teos10", (10.0, 43.0, 0.0), "TEOS-10.*0 to 42 g/kg"),
    ],
)
def test_outside_a_law_one_warning_reports_it(model, conditions, message):
    """A number comes back, with one sentence naming law and range."""
    with pytest.warns(PhysicsWarning, match=message) as caught:
        assert np.isfinite(sound_speed(*conditions, model=model))
    assert len(caught) == 1


def test_an_unknown_law_is_reported_with_the_known_ones():
    """The error lists what can be requested, and states how to request a law of depth from a pressure."""
    with pytest.raises(ValueError, match="available are: teos10, chen-millero, unesco, mackenzie, medwin"):
        sound_speed(10, 35, 0, model="wilson")
    with pytest.raises(ValueError, match="mackenzie works from depth"):
        sound_speed_at_pressure(10, 35, 0, model="mackenzie")


@pytest.mark.parametrize("model", MODELS)
def test_less_than_no_salt_is_refused(model):
    """A negative salinity has no meaning in any law."""
    with pytest.raises(ValueError, match="-1 g/kg"):
        sound_speed(10, [35, -1], 0, model=model)
