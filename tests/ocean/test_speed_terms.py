"""Claims about single terms of the sound-speed laws, the pressure behind them, and the profiles that they make."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import (
    SoundSpeedProfile,
    depth_from_pressure,
    pressure_dbar,
    read_profile,
    sound_speed,
    sound_speed_at_pressure,
)
from oracles.few_of import few_of

pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
LAWS = ["teos10", "chen-millero", "unesco", "mackenzie", "medwin"]


def test_mackenzies_nine_terms_one_at_a_time():
    """Differences that leave one term each: published coefficients by elimination, to their last digit."""

    def c(t, s, z):
        return float(sound_speed(t, s, z, model="mackenzie"))

    assert c(0, 35, 0) == 1448.96
    cubic = np.polynomial.polynomial.polyfit([0, 10, 20, 30], [c(t, 35, 0) for t in (0, 10, 20, 30)], 3)
    np.testing.assert_allclose(cubic, [1448.96, 4.591, -5.304e-2, 2.374e-4], rtol=1e-6)
    assert c(0, 36, 0) - c(0, 35, 0) == pytest.approx(1.340)
    assert (c(10, 36, 0) - c(10, 35, 0)) - (c(0, 36, 0) - c(0, 35, 0)) == pytest.approx(-0.1025)
    weight = np.polynomial.polynomial.polyfit([0, 2000, 4000], [c(0, 35, z) - 1448.96 for z in (0, 2000, 4000)], 2)
    np.testing.assert_allclose(weight[1:], [1.630e-2, 1.675e-7], rtol=1e-6)
    together = (c(10, 35, 6000) - c(10, 35, 0)) - (c(0, 35, 6000) - c(0, 35, 0))
    assert together == pytest.approx(-7.139e-13 * 10 * 6000**3, rel=1e-6)


def test_in_the_deep_sea_mackenzie_and_teos_10_agree():
    """At 2 degC and absolute salinity 35.165, 0 to 6 km, two laws that share no code differ by less than 0.5 m/s."""
    z = np.arange(0, 6001.0, 1000)
    short, long = sound_speed(2.0, 35.0, z, model="mackenzie"), sound_speed(2.0, 35.165, z, model="teos10")
    np.testing.assert_allclose(short, long, atol=0.5)


@pytest.mark.parametrize("model", LAWS)
def test_warmer_water_gains_less_and_less(model):
    """Sound speed of the sea's surface is concave in temperature from 0 to 35 degC."""
    assert np.all(np.diff(sound_speed(np.linspace(0, 35, 36), 35.0, 0.0, model=model), 2) < 0)


@pytest.mark.parametrize("model", ["teos10", "chen-millero", "unesco"])
def test_ice_cold_fresh_water_is_slow(model):
    """Pure water carries sound at 1402.4 m/s at 0 degC (Del Grosso & Mader 1972, not verified), each law to 0.3."""
    assert sound_speed(0.0, 0.0, 0.0, model=model) == pytest.approx(1402.4, abs=0.3)


@given(st.floats(0, 11_000), st.floats(-90, 90))
def test_pressure_grows_by_the_weight_of_the_water(metres, latitude):
    """dp/dz = rho g: between 1.000 and 1.072 times 1000 kg/m^3 and 9.78 to 9.87 m/s^2, and it grows with depth."""
    step = 10.0
    per_metre = float(pressure_dbar(metres + step, latitude) - pressure_dbar(metres, latitude)) / step * 1e4
    assert 1025 * 9.78 < per_metre < 1076 * 9.87
    assert pressure_dbar(metres + 500, latitude) - pressure_dbar(metres, latitude) > 500 * per_metre / 1e4 * 0.9999


def test_the_deepest_place_weighs_eleven_hundred_atmospheres():
    """The quartic in full: 10000 m at 45 degrees are 100.818 + 2.465 - 0.125 + 0.0028 MPa.

    The paper's gravity at 45 degrees, 9.7803 (1 + 0.0053 / 2), is 1e-5 more than the 9.80612 it divides by.
    """
    gravity = (9.7803 * (1 + 0.0053 / 2) - 0.2) / (9.80612 - 0.2)
    assert pressure_dbar(10_000.0) == pytest.approx(100 * (100.818 + 2.465 - 0.125 + 0.0028) * gravity, rel=1e-9)


@given(st.floats(0, 90), st.floats(0, 90), st.floats(1, 8000))
def test_the_same_pressure_lies_deeper_towards_the_equator(one, other, dbar):
    """Gravity grows with latitude: nowhere does the order of latitudes turn over."""
    low, high = min(one, other), max(one, other)
    assert depth_from_pressure(dbar, low) >= depth_from_pressure(dbar, high) - 1e-9


def test_45_degrees_is_the_default_latitude():
    """Both ways, bit for bit."""
    assert pressure_dbar(1234.0) == pressure_dbar(1234.0, 45.0)
    assert depth_from_pressure(1234.0) == depth_from_pressure(1234.0, 45.0)
    assert depth_from_pressure(pressure_dbar([[10.0], [4000.0]], [0.0, 60.0]), [0.0, 60.0]).shape == (2, 2)


@pytest.mark.parametrize("model", ["teos10", "chen-millero", "unesco"])
def test_evaluation_by_pressure_or_by_its_depth_is_the_same(model):
    """At 45 degrees a probe at p and one at depth(p) are the same probe, to 1e-6 m/s."""
    p = np.array([0.0, 10, 500, 4000])
    np.testing.assert_allclose(
        sound_speed(8.0, 34.0, depth_from_pressure(p), model=model),
        sound_speed_at_pressure(8.0, 34.0, p, model=model),
        atol=1e-6,
    )


knots = st.lists(st.tuples(st.floats(0.1, 300), st.floats(1400, 1600)), min_size=2, max_size=8)


def _profile(drawn):
    steps, speeds = zip(*drawn, strict=True)
    return SoundSpeedProfile(np.cumsum(steps) - steps[0], np.array(speeds))


@given(knots, st.floats(0, 1))
def test_a_profile_never_overshoots_its_knots(drawn, place):
    """Between two knots the speed lies between theirs, and it is on the line that the gradient states."""
    profile = _profile(drawn)
    z = float(place * profile.depth[-1])
    row = int(np.clip(np.searchsorted(profile.depth, z, side="right") - 1, 0, profile.depth.size - 2))
    ends = profile.speed[row : row + 2]
    assert ends.min() - 1e-9 <= profile.at(z) <= ends.max() + 1e-9
    assert profile.at(z) == pytest.approx(ends[0] + profile.gradient(z) * (z - profile.depth[row]), abs=1e-9)


@given(knots, st.floats(0.01, 0.99))
def test_a_knot_more_on_the_line_changes_nothing(drawn, place):
    """Straight lines may be cut anywhere: speeds and gradients stay."""
    profile = _profile(drawn)
    z = float(place * profile.depth[-1])
    if np.min(np.abs(profile.depth - z)) < 1e-3:
        return
    cut = SoundSpeedProfile(
        np.sort(np.append(profile.depth, z)), np.insert(profile.speed, np.searchsorted(profile.depth, z), profile.at(z))
    )
    depths = np.linspace(-5, profile.depth[-1] + 5, 37)
    np.testing.assert_allclose(cut.at(depths), profile.at(depths), atol=1e-9)


@given(knots, st.floats(1, 5000))
def test_extending_twice_is_extending_once(drawn, water_depth):
    """The extension reaches the seabed, keeps every knot, and has nothing left to do."""
    profile = _profile(drawn)
    longer = profile.extended(water_depth)
    longer.require_depth(water_depth)
    assert longer.extended(water_depth) is longer
    np.testing.assert_array_equal(longer.at(profile.depth), profile.speed)
    assert longer.gradient(longer.depth[-1] + 1.0) == 0


def test_a_profile_begun_below_the_surface_is_held_upwards():
    """The first speed that was measured stands up to the surface, without a gradient."""
    profile = SoundSpeedProfile([5.0, 20.0], [1500.0, 1470.0]).extended(30.0)
    assert profile.depth.tolist() == [0, 5, 20, 30]
    assert profile.gradient([2.0, 10.0, 25.0]).tolist() == [0, -2, 0]


def test_equal_profiles_are_one_key_and_print_their_span():
    """Profiles are values: equal ones hash alike, others differ, and a lab notebook could hold the line."""
    one, two = (SoundSpeedProfile([0.0, 12.5], [1500.0, 1490.25]) for _ in range(2))
    assert one == two
    assert len({one, two, SoundSpeedProfile([0.0, 12.5], [1500.0, 1491.0])}) == 2
    assert one != "profile"
    assert repr(one) == "SoundSpeedProfile: 2 knots, 0-12.5 m, 1490.2-1500.0 m/s"


@few_of((0, 2), "mark", [",", ";", "\t"])
@given(knots)
def test_a_profile_written_down_is_read_back(tmp_path_factory, mark, drawn):
    """Any profile, printed to the last digit with any separator: the same bits."""
    profile = _profile(drawn)
    rows = [f"{z!r}{mark}{c!r}" for z, c in zip(profile.depth.tolist(), profile.speed.tolist(), strict=True)]
    path = tmp_path_factory.mktemp("cast") / "profile.csv"
    path.write_text("\n".join([f"depth [m]{mark}speed [m/s]", *rows]), encoding="utf-8")
    assert read_profile(path) == profile


def test_units_in_the_header_and_in_a_row_are_one_water(tmp_path):
    """Kilometres and km/h stated twice over in two ways: 20 m and 1490 m/s at the last knot."""
    header, row = tmp_path / "header.csv", tmp_path / "row.csv"
    header.write_text("depth (km);sound speed (km/h)\n0;5400\n0.02;5364\n")
    row.write_text("# cast 7\ndepth;sound_velocity\n[km];[km/h]\n0;5400\n\n0.02;5364\n")
    assert read_profile(header) == read_profile(row)
    np.testing.assert_allclose(read_profile(header).depth, [0, 20], rtol=1e-12)
    np.testing.assert_allclose(read_profile(header).speed, [1500, 1490], rtol=1e-12)
