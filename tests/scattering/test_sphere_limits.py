"""Claims about spheres and plates at the ends of their range: Rayleigh's, the shadow's, and scale."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scattering import (
    curved_strength_db,
    cylinder_strength_db,
    disc_strength_db,
    plate_strength_db,
    sphere_series_strength_db,
    sphere_strength_db,
)
from insonify.scattering.sphere_series import partial_waves, sphere_amplitude

AROUND = np.linspace(0, np.pi, 13)


def _total(ka, boundary):
    """Scattered power over incident intensity and cross section, by Gauss over the cosine of the angle."""
    nodes, weights = np.polynomial.legendre.leggauss(int(2 * ka + 40))
    amplitude = sphere_amplitude(ka, np.arccos(nodes), boundary=boundary)
    return float(2 * np.sum(weights * np.abs(amplitude) ** 2))


def test_a_tiny_rigid_sphere_pushes_and_bulges():
    """Rayleigh: F / a = (ka)^2 (1 - 1.5 cos) / 3 in size, a monopole and a dipole, at every angle."""
    ka = 0.01
    found = np.abs(sphere_amplitude(ka, AROUND)) / ka**2
    np.testing.assert_allclose(found, np.abs(1 - 1.5 * np.cos(AROUND)) / 3, atol=1e-4)


def test_a_tiny_soft_sphere_pulses():
    """F = -a in all directions: pressure turned over, the same everywhere."""
    np.testing.assert_allclose(sphere_amplitude(0.002, AROUND, boundary="soft"), -1, atol=3e-3)


def test_small_spheres_scatter_these_powers_in_all():
    """Total over pi a^2: 7/9 (ka)^4 for the rigid sphere, 4 for the soft one."""
    assert _total(0.01, "rigid") / 0.01**4 == pytest.approx(7 / 9, rel=1e-3)
    assert _total(0.002, "soft") == pytest.approx(4, rel=5e-3)


def test_a_small_rigid_sphere_is_dark_at_48_degrees():
    """Monopole and dipole cancel at acos(2/3), 48 degrees from forward."""
    angle = np.linspace(0.5, 1.2, 7001)
    darkest = angle[np.argmin(np.abs(sphere_amplitude(0.02, angle)))]
    assert darkest == pytest.approx(np.arccos(2 / 3), abs=1e-3)


@pytest.mark.parametrize("boundary", ["rigid", "soft"])
def test_a_large_sphere_takes_twice_its_shadow(boundary):
    """Once for what it hits and once for the shadow: 2 within the edge's (ka)^(-2/3)."""
    assert _total(300.0, boundary) == pytest.approx(2, abs=2 * 300 ** (-2 / 3))


@pytest.mark.parametrize("boundary", ["rigid", "soft"])
def test_straight_ahead_a_large_sphere_is_its_shadow(boundary):
    """Forward, |F| is that of an opening of the sphere's outline: k a^2 / 2, within the edge's (ka)^(-2/3)."""
    assert abs(sphere_amplitude(300.0, 0.0, boundary=boundary)) == pytest.approx(150, rel=2 * 300 ** (-2 / 3))


@settings(max_examples=20)
@given(st.floats(0.01, 50), st.floats(0, np.pi))
def test_a_sphere_does_not_distinguish_left_from_right(ka, angle):
    """The amplitude is even in the angle, and one turn is none."""
    one, other, around = sphere_amplitude(ka, np.array([angle, -angle, angle + 2 * np.pi]))
    assert other == pytest.approx(one, abs=1e-9)
    assert around == pytest.approx(one, abs=1e-9)


@settings(max_examples=20)
@given(st.floats(0.01, 1), st.floats(1e3, 1e5), st.floats(0.5, 2))
def test_only_size_in_wavelengths_counts(radius, frequency, factor):
    """Everything twice as large at half the frequency is 6 dB stronger; so it is in water of twice the sound speed."""
    small = sphere_series_strength_db(radius, frequency)
    large = sphere_series_strength_db(radius * factor, frequency / factor)
    slow = sphere_series_strength_db(radius, frequency * factor, sound_speed=1500.0 * factor)
    assert large - small == pytest.approx(20 * np.log10(factor), abs=1e-6)
    assert slow == pytest.approx(float(small), abs=1e-6)


@pytest.mark.parametrize("boundary", ["rigid", "soft"])
def test_enough_partial_waves_are_summed(boundary):
    """The last order adds less than a millionth of the largest, from tiny spheres to large ones."""
    for ka in (0.01, 1.0, 30.0, 1000.0):
        eta = np.abs(partial_waves(ka, boundary)) * (2 * np.arange(partial_waves(ka, boundary).size) + 1)
        assert eta[-1] < 1e-6 * eta.max()


def test_ten_is_where_a_sphere_becomes_a_mirror_ball():
    """Beyond ka = 10 the rigid series stays within 1.3 dB of 20 log10(a / 2)."""
    ka = np.linspace(10, 60, 200)
    frequency = ka * 1500 / (2 * np.pi * 0.5)
    deviation = sphere_series_strength_db(0.5, frequency) - sphere_strength_db(0.5)
    assert np.abs(deviation).max() < 1.3
    assert np.abs(deviation[-20:]).max() < np.abs(deviation[:20]).max()


@given(st.floats(0.1, 10), st.floats(0.1, 10))
def test_curvatures_count_alike(one, other):
    """The two radii may be exchanged, and ten times both is 20 dB."""
    assert curved_strength_db(one, other) == pytest.approx(float(curved_strength_db(other, one)))
    factor = curved_strength_db(10 * one, 10 * other) - curved_strength_db(one, other)
    assert factor == pytest.approx(20)


@given(st.floats(0, 0.7))
def test_bodies_tilted_either_way_are_alike(tilt):
    """Plate, disc and cylinder do not depend on the sign of a tilt, and none is stronger than face on."""
    for body in (
        lambda b: plate_strength_db(0.4, 0.3, 100e3, tilt=b),
        lambda b: disc_strength_db(0.2, 100e3, tilt=b),
        lambda b: cylinder_strength_db(0.2, 0.5, 100e3, tilt=b),
    ):
        assert body(tilt) == pytest.approx(float(body(-tilt)))
        assert body(tilt) <= body(0.0) + 1e-9


def test_a_plate_is_silent_where_its_ends_are_half_a_wave_apart():
    """First null of a 0.4 m plate at 100 kHz: sin(tilt) = wavelength / (2 side), one way and back."""
    tilt = np.linspace(1e-4, 0.03, 30_001)
    deepest = tilt[np.argmin(plate_strength_db(0.4, 0.3, 100e3, tilt=tilt))]
    assert np.sin(deepest) == pytest.approx(0.015 / 0.8, rel=1e-3)


def test_a_disc_is_silent_at_airys_first_zero():
    """X = 2 k a sin(tilt) = 3.8317 for a disc of 0.2 m at 100 kHz."""
    tilt = np.linspace(0.005, 0.03, 30_001)
    deepest = tilt[np.argmin(disc_strength_db(0.2, 100e3, tilt=tilt))]
    assert 2 * (2 * np.pi / 0.015) * 0.2 * np.sin(deepest) == pytest.approx(3.8317, rel=1e-3)


def test_all_of_them_grow_with_frequency_as_their_shape_predicts():
    """Ten times the frequency, face on: plates and discs +20 dB, a cylinder +10 dB, a sphere none."""
    assert np.diff(plate_strength_db(0.4, 0.3, [5e4, 5e5]))[0] == pytest.approx(20)
    assert np.diff(disc_strength_db(0.3, [5e4, 5e5]))[0] == pytest.approx(20)
    assert np.diff(cylinder_strength_db(0.3, 0.5, [5e4, 5e5]))[0] == pytest.approx(10)
