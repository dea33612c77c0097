"""Claims about two simulated receivers one above the other: how alike they receive a bed, and where they put it."""

import numpy as np
import pytest

from insonify.processing import (
    complex_coherence,
    compressed_recording,
    elevation_to_phase,
    flat_bed_elevation,
    interferometric_bathymetry,
    phase_deviation,
)
from insonify.simulator import simulate
from oracles.interferometry import ALTITUDE, CARRIER, SPEED, TILT, WAVE, footprint, surveyed, tone

TONE, BAND = 1e-3, 4e3
BASELINES = (5, 10)
SWEEP = {"kind": "lfm", "duration": 1e-3, "bandwidth": 15e3}
RINGS = ((13.0, 16.0), (16.0, 22.0), (22.0, 30.0))
"""Slant ranges that are looked at together [m]."""


def flattening(slant, waves):
    """What takes a flat bed's phase out of the upper receiver [1]."""
    about = {"baseline": waves * WAVE, "tilt": TILT, "centre_frequency": CARRIER}
    return np.exp(-1j * elevation_to_phase(flat_bed_elevation(np.maximum(slant, ALTITUDE), ALTITUDE), **about))


def over_rings(pings):
    """Coherence over the looks of each ring, of the recording and of the integral over footprints, (baseline, ring)."""
    scenario = surveyed(BASELINES, {"kind": "cw", "duration": TONE}, BAND, (0.0172, 0.0412), pings=pings)
    held = simulate(scenario)
    slant = (held.time.values - TONE / 2) * SPEED / 2
    series = held.pressure.values / np.sqrt(np.mean(np.abs(held.pressure.values) ** 2, axis=(0, 1)))
    found, expected = np.zeros((2, len(BASELINES), len(RINGS)), complex)
    for row, waves in enumerate(BASELINES):
        turned = flattening(slant, waves)
        some = np.arange(0, slant.size, 3)  # the footprint changes slowly
        cross, upper, lower = footprint(held.time.values[some], waves, tone(TONE, BAND), TONE)
        level = np.sqrt(upper * lower)
        for column, (near, far) in enumerate(RINGS):
            ring = (slant > near) & (slant < far)
            pair = (series[:, 2 * row] * turned)[:, ring], series[:, 2 * row + 1][:, ring]
            found[row, column] = complex_coherence(*(one.ravel() for one in pair))
            of = ring[some]
            power = np.sum((upper / level)[of]) * np.sum((lower / level)[of])
            expected[row, column] = np.sum((cross / level * turned[some])[of]) / np.sqrt(power)
    return found, expected


def assert_coherence(pings, bar, turn):
    """Moduli within a bar and phases within another [rad], which shrinks as coherence grows."""
    found, expected = over_rings(pings)
    np.testing.assert_allclose(np.abs(found), np.abs(expected), atol=bar)
    assert np.abs(expected).min() < 0.8 and np.abs(expected).max() > 0.99
    off = np.angle(found * np.conj(expected))
    assert np.all(np.abs(off) < turn * np.sqrt(1 - np.abs(expected) ** 2) / np.abs(expected))


def test_coherence_is_the_integral_over_the_footprint():
    """1 ms of tone, baselines of 5 and 10 wavelengths, g from 0.79 to 0.996: 100 pings, 430 looks or more to a ring.

    Three standard errors at g = 0.79: 3 (1 - g^2) / sqrt(2 N) = 0.04; of the phase, 3 sqrt((1 - g^2) / (2 N)) / g.
    """
    assert_coherence(100, 0.04, 0.11)


@pytest.mark.validate
def test_coherence_is_the_integral_over_the_footprint_closely():
    """600 pings, 2600 looks or more: modulus within 0.02 (0.0055 standard error), phase within three of its own."""
    assert_coherence(600, 0.02, 0.045)


@pytest.fixture(scope="module")
def bed():
    """Twelve pings of a compressed sweep over a flat bed, 19 to 60 m away, with a baseline of five wavelengths."""
    return swath(12)


def swath(pings, window=(0.0255, 0.0825), **changes):
    """A recording of two receivers after its matched filter."""
    sparse = {"scatterers_per_cell": 2, **changes.pop("paths", {})}
    scenario = surveyed((5,), SWEEP, 20e3, window, pings=pings, hop=4.0, paths=sparse, **changes)
    return compressed_recording(simulate(scenario), scenario.sonar.pulse, window="hamming")


@pytest.mark.parametrize("altitude", [9.0, 8.5])
def test_a_flat_bed_is_where_it_is(bed, altitude):
    """Depth by phase, unbiased to 2 cm in each ten metres from 20 to 60 m; turns settled by an altitude 0.5 m off.

    One sounding strays by 3 cm at 20 m and by 13 cm at 60 m; the mean of ten metres by 6 mm at most.
    """
    found = interferometric_bathymetry(bed, altitude, looks=(1, 15))
    slant = bed.time.values * SPEED / 2
    for near in (20, 30, 40, 50):
        part = found.depth.values[:, (slant > near) & (slant < near + 10)]
        assert np.mean(part) == pytest.approx(20.0, abs=0.02)


def test_phase_strays_as_its_coherence_predicts(bed):
    """Phase over 12 looks: sqrt((1 - g^2) / (2 N g^2)) within 15 %; 40 m of range, about 400 phases: 4 % of error."""
    slant = bed.time.values * SPEED / 2
    upper, lower = bed.pressure.values[:, 0] * flattening(slant, 5), bed.pressure.values[:, 1]
    ratio = []
    for near in range(20, 60, 4):
        ring = (slant > near) & (slant < near + 4)
        coherence = np.abs(complex_coherence(upper[:, ring].ravel(), lower[:, ring].ravel()))
        phase = np.angle(np.sum(upper[:, ring] * np.conj(lower[:, ring]), axis=0))
        ratio.append(np.mean((phase / phase_deviation(coherence, len(upper))) ** 2))
    assert np.sqrt(np.mean(ratio)) == pytest.approx(1, abs=0.15)


def test_sound_by_way_of_the_surface_costs_coherence():
    """A mirror above, one bounce on a leg: from 30 to 45 m the sweep's coherence falls from 0.99 to under a half.

    What comes by the surface has other elevations, so the two receivers receive other phases of it. 600 looks: 0.03.
    """
    found = []
    for paths in ({}, {"max_reflections": 1, "families": ["D", "S"]}):
        held = swath(3, (0.0395, 0.0615), paths=paths)
        slant = held.time.values * SPEED / 2
        ring = (slant > 30) & (slant < 45)
        upper, lower = held.pressure.values[:, 0] * flattening(slant, 5), held.pressure.values[:, 1]
        found.append(abs(complex_coherence(upper[:, ring].ravel(), lower[:, ring].ravel())))
    assert found[0] > 0.97
    assert found[1] < 0.5
