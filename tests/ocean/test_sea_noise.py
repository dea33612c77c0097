"""Claims about the sea's own noise: parts that add up to the whole, causes that can only add, thermal noise aside."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean.ambient_noise import noise_level_db, thermal_noise_db
from insonify.ocean.sea_noise import SeaNoise
from insonify.validity import PhysicsWarning

FREQUENCY = np.array([1e3, 10e3, 40e3])
WIND, RAIN, SHIPS = st.floats(0.5, 20), st.floats(0, 50), st.floats(0, 1)


def density(**settings):
    """What a hydrophone receives, from where; laws that are stretched are no matter here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        return SeaNoise(**settings).density(FREQUENCY)


@given(WIND, RAIN, SHIPS)
def test_from_wherever_it_comes_it_is_as_strong(wind, rain, ships):
    """One hydrophone has no direction.

    What comes from the surface and from everywhere adds up to the sum of all causes.
    """
    settings = {"wind_speed": wind, "rain_rate": rain, "shipping": ships}
    everywhere, has_parallax = density(**settings), density(**settings, directionality="surface")
    assert set(everywhere) == {"isotropic"} and set(has_parallax) == {"isotropic", "surface"}
    np.testing.assert_allclose(sum(has_parallax.values()), everywhere["isotropic"], rtol=1e-9)


@given(WIND, RAIN)
def test_thermal_noise_is_never_made_by_the_surface(wind, rain):
    """Mellen's level alone comes from all directions, whatever the weather."""
    has_parallax = density(wind_speed=wind, rain_rate=rain, directionality="surface")
    np.testing.assert_allclose(10 * np.log10(has_parallax["isotropic"]), thermal_noise_db(FREQUENCY), atol=1e-9)


@given(WIND, st.floats(0, 5), RAIN, st.floats(0, 20))
def test_more_weather_is_never_quieter(wind, gust, rain, shower):
    """Wind and rain can only add."""
    calm, storm = (
        density(wind_speed=w, rain_rate=r)["isotropic"] for w, r in ((wind, rain), (wind + gust, rain + shower))
    )
    assert (storm >= calm * (1 - 1e-12)).all()


@given(st.floats(-50, 150))
def test_a_measured_level_is_that_level_at_all_frequencies(level):
    """Decibels re 1 uPa^2/Hz, as power; from where it was stated to come."""
    for directionality in ("isotropic", "surface"):
        expected = density(level_db=level, directionality=directionality)
        assert set(expected) == {directionality}
        np.testing.assert_allclose(expected[directionality], 10 ** (level / 10), rtol=1e-12)


def test_the_level_is_that_of_the_laws():
    """The same number as the published laws give by themselves, for 8 m/s at 20 kHz."""
    alone = float(noise_level_db(20e3, wind_speed=8.0, shipping=0.5, rain_rate=0.0))
    found = SeaNoise(wind_speed=8.0).density(20e3)["isotropic"]
    assert 10 * np.log10(float(found)) == pytest.approx(alone, abs=1e-9)


@pytest.mark.parametrize("shape", [(), (3,), (2, 5)])
def test_results_have_the_shape_of_the_frequencies(shape):
    """Each part has the shape that was requested."""
    spectrum = SeaNoise(wind_speed=5.0, directionality="surface").density(np.full(shape, 2e4))
    assert all(np.shape(part) == shape for part in spectrum.values())
