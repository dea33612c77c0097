"""Claims about pressure and depth."""

import csv
from pathlib import Path

import gsw
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import depth_from_pressure, pressure_dbar
from insonify.validity import PhysicsWarning

PUBLISHED = Path(__file__).parents[1] / "published"
PRINTED = list(csv.DictReader((PUBLISHED / "unesco_1983_depth.csv").open()))


@pytest.mark.parametrize("row", PRINTED, ids=lambda row: row["pressure_dbar"])
def test_unesco_prints_this_depth(row):
    """10000 dbar at 30 degrees are 9712.653 m, to the 0.1 m that its authors state."""
    found = depth_from_pressure(float(row["pressure_dbar"]), float(row["latitude_deg"]))
    assert found == pytest.approx(float(row["depth_m"]), abs=float(row["stated_accuracy_m"]))


@given(st.floats(0, 11000), st.floats(-90, 90))
def test_there_and_back_is_where_we_began(metres, latitude):
    """Depth undoes pressure to a micrometre, anywhere."""
    assert depth_from_pressure(pressure_dbar(metres, latitude), latitude) == pytest.approx(metres, abs=1e-6)


@pytest.mark.parametrize("latitude", [0.0, 45.0, 70.0])
def test_two_standard_oceans_weigh_the_same(latitude):
    """Leroy & Parthiot's polynomial and TEOS-10's equation of state agree to 2e-5 in the upper kilometre."""
    z = np.array([1.0, 10.0, 100.0, 1000.0])
    np.testing.assert_allclose(pressure_dbar(z, latitude), gsw.p_from_z(-z, latitude), rtol=2e-5)


def test_water_at_the_pole_weighs_half_a_per_cent_more():
    """Gravity at the pole over gravity at the equator is 1.0053."""
    assert pressure_dbar(1.0, 90.0) / pressure_dbar(1.0, 0.0) == pytest.approx(1.0053, abs=1e-6)


def test_at_45_degrees_the_polynomial_stands_alone():
    """The formula's own reference latitude: 1000 m are 10.08180 + 0.02465 - 0.000125 + 0.00000028 MPa."""
    assert pressure_dbar(1000.0) == pytest.approx(1010.632528, rel=1e-5)


def test_south_is_as_north():
    """Latitudes on either side of the equator weigh alike, and none is heavier than its shape states."""
    assert pressure_dbar([10.0, 200.0], -60.0) == pytest.approx(pressure_dbar([10.0, 200.0], 60.0))
    assert depth_from_pressure([[10.0], [20.0]], [0.0, 30.0, 60.0]).shape == (2, 3)


def test_below_the_deepest_trench_one_warning_reports_it():
    """There is no ocean of 13 km."""
    with pytest.warns(PhysicsWarning, match="Leroy & Parthiot.*0 to 12000 m"):
        pressure_dbar(13e3)
