"""Claims about the ground: where a level bed is reached, and how high the sonar is above it."""

import numpy as np
import pytest

from insonify.processing import first_bottom_return, slant_to_ground_range

SLANT = np.arange(2000) * 0.05


def test_an_echo_comes_to_lie_where_it_came_from():
    """Slant range 50 m from 30 m up is 40 m on the ground: 3-4-5."""
    level = np.full((1, len(SLANT)), -100.0)
    level[0, 1000] = 0.0
    ground = (np.arange(1500) + 0.5) * 0.05
    found = slant_to_ground_range(level, SLANT, np.array([30.0]), ground)
    assert ground[np.nanargmax(found[0])] == pytest.approx(40, abs=0.07)


def test_energy_is_kept_by_the_change_of_range():
    """Power times slant length is the same, cell by cell, as in the samples that each cell spans."""
    rng = np.random.default_rng(1)
    power = rng.exponential(size=(2, len(SLANT)))
    ground = (np.arange(60) + 0.5) * 1.3
    found = 10 ** (slant_to_ground_range(10 * np.log10(power), SLANT, np.array([12.0, 20.0]), ground) / 10)
    for row, height in enumerate((12.0, 20.0)):
        near, far = (np.hypot(ground + side * 0.65, height) for side in (-1, 1))
        fine = np.linspace(near, far, 4001)  # a plain sum of nearest samples
        nearest = power[row, np.clip(np.round(fine / 0.05).astype(int), 0, len(SLANT) - 1)].mean(axis=0)
        np.testing.assert_allclose(found[row], nearest, rtol=0.02)


def test_beyond_the_recording_there_is_nothing():
    """NaN, also for a ping that is not there."""
    ground = (np.arange(3000) + 0.5) * 0.05
    level = np.zeros((2, len(SLANT)))
    level[1] = np.nan
    found = slant_to_ground_range(level, SLANT, np.array([30.0, 30.0]), ground)
    last = np.sqrt(SLANT[-1] ** 2 - 900)
    assert np.isnan(found[0][ground > last + 0.1]).all() and np.isfinite(found[0][ground < last - 0.1]).all()
    assert np.isnan(found[1]).all()


def test_the_first_return_is_the_altitude():
    """Reverberation that begins at 8 to 12 m, over silence or over noise, with one ping missing."""
    rng = np.random.default_rng(6)
    altitude = np.linspace(8, 12, 40)
    for floor in (1e-20, 1e-4):
        power = floor * rng.exponential(size=(40, 2, len(SLANT)))
        for row, height in enumerate(altitude):
            begins = np.searchsorted(SLANT, height)
            power[row, :, begins:] += (SLANT[begins:] / height) ** -5 * rng.exponential(size=(2, len(SLANT) - begins))
        level = 10 * np.log10(power)
        level[20] = np.nan
        np.testing.assert_allclose(first_bottom_return(level, SLANT), altitude, atol=0.5)


def test_silence_has_no_altitude():
    """NaN rather than a guess."""
    assert np.isnan(first_bottom_return(np.full((3, len(SLANT)), -np.inf), SLANT)).all()
