"""Depth by phase and maps of fans, for sonars that stand, lean and look any way."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.frames import pose_rotation
from insonify.processing import (
    complex_coherence,
    elevation_to_phase,
    interferometric_bathymetry,
    interferometric_depth,
    sector_image,
    unwrap_to_reference,
)
from oracles.point_echoes import bell, received, speckle, two_way

SEEDS = st.integers(0, 10**6)


@settings(max_examples=60)
@given(SEEDS)
def test_a_point_anywhere_in_front_has_its_elevation(seed):
    """Baselines of 1 to 12 wavelengths, any tilt; an expectation wrong by up to a third of what would mislead it.

    Sine of the elevation to 1e-4 + (a / R)^2, the wavefront's curvature.
    """
    rng = np.random.default_rng(seed)
    f, c, tilt = rng.uniform(50e3, 400e3), rng.uniform(1430, 1550), rng.uniform(-0.3, 1.2)
    baseline, slant = rng.uniform(1, 12) * c / f, rng.uniform(15, 80)
    elevation = float(np.clip(tilt + rng.uniform(-1.1, 1.1), 0.02, 1.5))
    up = np.array([0.0, np.sin(tilt), -np.cos(tilt)]) * baseline / 2
    point = slant * np.array([[0.0, np.cos(elevation), np.sin(elevation)]])
    time = 2 * slant / c + np.arange(-20, 21) / 40e3
    upper, lower = received(time, two_way(point, np.zeros(3), np.stack([up, -up]), c), f, bell(5e3))
    about = {"baseline": baseline, "tilt": tilt, "centre_frequency": f, "sound_speed": c}
    # half a turn of phase is this much of elevation
    turn = c / f / (2 * baseline * np.cos(elevation - tilt))
    altitude = slant * np.sin(np.clip(elevation + rng.uniform(-1, 1) * turn / 3, 0.001, 1.57))
    across, depth, gamma = interferometric_depth(
        upper[None], lower[None], time * c / 2, altitude=altitude, looks=1, **about
    )
    far = time[20] * c / 2
    assert depth[0, 20] / far == pytest.approx(np.sin(elevation), abs=1e-4 + (baseline / slant) ** 2)
    assert across[0, 20] / far == pytest.approx(np.cos(elevation), abs=1e-4 + (baseline / slant) ** 2)
    assert gamma[0, 20] == pytest.approx(1, abs=1e-6)
    phase = np.angle(upper[20] * np.conj(lower[20]))
    expected = elevation_to_phase(elevation, **about)
    assert unwrap_to_reference(phase, expected) == pytest.approx(
        float(expected), abs=2 * np.pi * f / c * baseline**3 / slant**2 + 2e-3
    )


@settings(max_examples=6)
@given(SEEDS, st.sampled_from([-1, 1]))
def test_a_pair_that_stands_anywhere_on_a_ship_that_leans_finds_the_bed_where_it_is(seed, side):
    """Any heading, roll and place on board: depth of the bed to 6 cm, distance across from the ship's own middle."""
    rng = np.random.default_rng(seed)
    f, c, tilt, waves = 100e3, 1500.0, np.radians(40), 4
    up = np.array([0, side * np.sin(tilt), -np.cos(tilt)]) * waves * c / f / 2
    mounted = np.array([rng.uniform(-3, 3), rng.uniform(-1.5, 1.5), rng.uniform(0, 1)])
    heading, roll, place = rng.uniform(-3, 3), rng.uniform(-0.1, 0.1), np.array([*rng.uniform(-50, 50, 2), 2.0])
    body = pose_rotation(heading, 0.0, roll)
    elements = mounted + np.stack([up, -up])
    middle, starboard = place + body @ mounted, np.array([-np.sin(heading), np.cos(heading), 0.0])
    height = 12.0 - middle[2]
    along = side * rng.uniform(5, 26, 2500)
    points = middle * [1, 1, 0] + along[:, None] * starboard + [0, 0, 12.0]
    time = np.arange(2 * 14 / c, 2 * 22 / c, 1 / 30e3)
    delay = two_way(points, middle, place + elements @ body.T)
    turn = np.exp(2j * np.pi * rng.uniform(size=2500))
    recording = xr.Dataset(
        {"pressure": (("ping", "channel", "time"), speckle(time, delay, f, bell(6e3), turn, 2e-4)[None]),
         "element_position": (("channel", "axis"), elements), "position": (("ping", "axis"), place[None]),
         "attitude": (("ping", "axis"), np.array([[heading, 0.0, roll]]))},
        {"time": time, "side": ("channel", [side, side])}, {"centre_frequency": f},
    )  # fmt: skip
    found = interferometric_bathymetry(recording, height, looks=(1, 41))
    part = slice(40, -40)
    assert np.mean(found.depth.values[0, part]) == pytest.approx(12.0, abs=0.06)
    expected = side * np.sqrt((time * c / 2) ** 2 - height**2) + (middle - place) @ starboard
    assert np.mean(found.across.values[0, part] - expected[part]) == pytest.approx(0, abs=0.06)


@settings(max_examples=30)
@given(SEEDS)
def test_coherence_depends_on_neither_gain_nor_common_phase(seed):
    """|g| <= 1 (Schwarz); gains leave it, phases turn it, exchange conjugates it; over looks as over all."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, 5, 31)) + 1j * rng.normal(size=(2, 5, 31))
    gain = 10 ** rng.uniform(-4, 4, 2) * np.exp(2j * np.pi * rng.uniform(size=2))
    looks = [None, 5, (3, 7)][int(rng.integers(3))]
    plain = complex_coherence(a, b, looks)
    assert np.abs(plain).max() <= 1 + 1e-12
    phase = gain[0] * np.conj(gain[1]) / abs(gain[0] * gain[1])
    np.testing.assert_allclose(complex_coherence(gain[0] * a, gain[1] * b, looks), plain * phase, atol=1e-9)
    np.testing.assert_allclose(complex_coherence(b, a, looks), np.conj(plain), atol=1e-12)
    np.testing.assert_allclose(complex_coherence(a, a, looks), 1, atol=1e-12)


@settings(max_examples=40)
@given(SEEDS)
def test_a_fan_is_read_between_beams_and_samples(seed):
    """What is bilinear in bearing and range is itself anywhere in the fan, and nothing is beyond it; any middle."""
    rng = np.random.default_rng(seed)
    middle, width = rng.uniform(-3, 3), rng.uniform(0.2, 2.9)
    bearing = np.sort(middle + width * np.concatenate([[-1, 1], rng.uniform(-1, 1, 5)]))
    distance = np.sort(np.concatenate([[4.0, 20.0], rng.uniform(4, 20, 7)]))
    k = rng.normal(size=4)

    def value(angle, far):
        return k[0] + k[1] * (angle - middle) + k[2] * far + k[3] * (angle - middle) * far

    x, y = rng.uniform(-22, 22, 15), rng.uniform(-22, 22, 16)
    found = sector_image(value(bearing[:, None], distance), bearing, distance, x, y)
    towards = middle + np.angle(np.exp(1j * (np.arctan2(y, x[:, None]) - middle)))
    far = np.hypot(x[:, None], y)
    inside = (np.abs(towards - middle) < width) & (far > 4) & (far < 20)
    np.testing.assert_array_equal(np.isfinite(found), inside)
    np.testing.assert_allclose(found[inside], value(towards, far)[inside], atol=1e-9)
