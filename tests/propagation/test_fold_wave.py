"""Rays against the wave equation, which knows no rays: amplitude, phase, and what a fold caustic does to both."""

import numpy as np
import pytest

from insonify.ocean import SoundSpeedProfile
from insonify.propagation import _eigenray_kernel as kernel
from insonify.propagation.caustic import fold_factor
from insonify.propagation.eigenray_record import exact_solutions
from insonify.propagation.sound_speed_layers import SoundSpeedLayers
from oracles.wave import direct_field

FREQUENCY = 10e3
SOURCE, POINT = 43.0, 51.0
CORNER = SoundSpeedProfile(np.array([0.0, 40.0, 60.0]), np.array([1690.0, 1490.0, 1490.0])).smoothed(4.0)
"""Speed rises upward from still water: rays that leave steeply and turn, and flat ones, meet in a fold at 184 m."""
ONE_DB = 10 ** (1 / 20) - 1


def rays(profile, distance):
    """The direct family to each distance: rays (n, MAX_RAYS, COLUMNS), silent beyond the count."""
    water = SoundSpeedLayers(np.array(profile.depth), np.array(profile.speed))
    found, count, _ = exact_solutions(water, "D", SOURCE, np.full(distance.size, POINT), distance)
    for row, n in zip(found, count, strict=True):
        row[n:], row[n:, kernel.FOLD], row[n:, kernel.FOLD_CURVATURE] = 0, np.inf, 1
    return found, count


def summed(found, *, limited=True, turn=1j):
    """Pressure of all rays together, and the level that they have without interference."""
    column = {name: found[..., getattr(kernel, name)] for name in ("AMPLITUDE", "DELAY", "CAUSTICS")}
    amplitude = column["AMPLITUDE"].astype(complex)
    if limited:
        fold = [found[..., getattr(kernel, name)] for name in ("FOLD", "FOLD_CURVATURE", "FOLD_SIDE")]
        amplitude = np.where(np.isfinite(amplitude), amplitude, 0.0) * fold_factor(*fold, FREQUENCY)
    phase = turn ** column["CAUSTICS"] * np.exp(-2j * np.pi * FREQUENCY * column["DELAY"])
    return np.sum(amplitude * phase, axis=1), np.sqrt(np.sum(np.abs(amplitude) ** 2, axis=1))


def test_the_wave_oracle_is_exact_in_isovelocity_water():
    """exp(-j k r) / r, within a few thousandths of a dB."""
    distance = np.array([50.0, 150.0, 260.0])
    slant = np.hypot(distance, POINT - SOURCE)
    found = direct_field([0, 60], [1500, 1500], SOURCE, POINT, distance, FREQUENCY)
    np.testing.assert_allclose(found * slant, np.exp(-2j * np.pi * FREQUENCY * slant / 1500), rtol=0, atol=1e-4)


@pytest.mark.parametrize("gradient", [-0.7, 1.5])
def test_where_rays_do_not_cross_they_are_the_wave(gradient):
    """Amplitude and phase of a refracted ray at 10 kHz, within 0.01 dB and 0.1 degrees."""
    profile = SoundSpeedProfile(np.array([0.0, 100.0]), np.array([1500.0, 1500.0 + 100 * gradient]))
    distance = np.array([30.0, 80.0, 150.0])
    found, count = rays(profile, distance)
    assert count.tolist() == [1, 1, 1]
    wave = direct_field(profile.depth, profile.speed, SOURCE, POINT, distance, FREQUENCY)
    np.testing.assert_allclose(summed(found)[0] / wave, 1, rtol=0, atol=1.5e-3)


def test_the_fold_is_as_strong_as_the_wave_has_it():
    """From 0.2 m behind the caustic on within 1 dB of the local level.

    Rays alone are 3 dB and more too strong there.
    """
    distance = np.arange(184.4, 197.0, 0.9)
    found, count = rays(CORNER, distance)
    assert np.all(count == 3)
    wave = direct_field(CORNER.depth, CORNER.speed, SOURCE, POINT, distance, FREQUENCY)
    pressure, level = summed(found)
    assert np.all(np.abs(pressure - wave) < ONE_DB * level)
    alone = summed(found, limited=False)[0]
    assert 20 * np.log10(np.abs(alone[0] / wave[0])) > 3


def test_a_caustic_advances_the_phase_by_90_degrees():
    """Behind the fold the wave agrees with +90 degrees for exp(+j omega t), and with nothing else."""
    distance = np.arange(190.0, 206.0, 2.5)
    found, _ = rays(CORNER, distance)
    wave = direct_field(CORNER.depth, CORNER.speed, SOURCE, POINT, distance, FREQUENCY)
    right, level = summed(found)
    assert np.abs((right - wave) / level).mean() < 0.05
    for turn in (1, -1j, -1):
        wrong, _ = summed(found, turn=turn)
        assert np.abs((wrong - wave) / level).mean() > 0.5
