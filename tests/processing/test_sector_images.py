"""Claims about the fan: what lies where."""

import numpy as np
import pytest

from insonify.processing import sector_image

BEARINGS, RANGES = np.radians(np.linspace(-60, 60, 121)), np.linspace(5, 50, 451)


def test_a_function_of_place_keeps_its_position():
    """Intensity x^2 + 3 y + 200 over beams and ranges, at any place of the grid: to the error of a straight line."""
    bearing, slant = np.meshgrid(BEARINGS, RANGES, indexing="ij")
    x, y = slant * np.cos(bearing), slant * np.sin(bearing)
    ahead, starboard = np.linspace(4, 40, 50), np.linspace(-30, 30, 61)
    got = sector_image(x**2 + 3 * y + 200, BEARINGS, RANGES, ahead, starboard)
    truth = ahead[:, None] ** 2 + 3 * starboard + 200
    inside = (np.abs(np.arctan2(starboard, ahead[:, None])) <= BEARINGS[-1]) & (
        np.abs(np.hypot(starboard, ahead[:, None]) - 27.5) <= 22.5
    )
    np.testing.assert_array_equal(np.isfinite(got), inside)
    np.testing.assert_allclose(got[inside], truth[inside], rtol=2e-4)


def test_a_sample_on_the_grid_keeps_its_value():
    """Ahead and 60 degrees to starboard, the last of all."""
    power = np.random.default_rng(1).exponential(size=(2, 121, 451))
    got = sector_image(power, BEARINGS, RANGES, [10.0, 25.0], [0.0, 25 * np.sqrt(3)])
    np.testing.assert_allclose(got[:, 0, 0], power[:, 60, 50])
    np.testing.assert_allclose(got[:, 1, 1], power[:, 120, 450])


def test_bearings_may_pass_astern():
    """A fan that looks back, across +-180 degrees."""
    bearings = np.radians(np.linspace(120, 240, 121))
    power = np.broadcast_to(np.degrees(bearings)[:, None], (121, 451))
    got = sector_image(power, bearings, RANGES, [-20.0], [-5.0, 0.0, 5.0])
    np.testing.assert_allclose(got[0], 180 + np.degrees(np.arctan([0.25, 0, -0.25])))


def test_what_does_not_fit_is_refused():
    """The value, and what would fit."""
    with pytest.raises(ValueError, match="bearings is not an increasing row"):
        sector_image(np.ones((121, 451)), BEARINGS[::-1], RANGES, [1.0], [1.0])
    with pytest.raises(ValueError, match=r"require \(..., 121, 451\)"):
        sector_image(np.ones((120, 451)), BEARINGS, RANGES, [1.0], [1.0])
