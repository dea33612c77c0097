"""Claims about the echoes of simple bodies: Kirchhoff's integral, optics, and the exact series."""

import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scattering.sphere_series import partial_waves, sphere_amplitude, sphere_series_strength_db
from insonify.scattering.target_strength import (
    curved_strength_db,
    cylinder_strength_db,
    disc_strength_db,
    plate_strength_db,
    sphere_strength_db,
)
from insonify.validity import PhysicsWarning

PRINTED = list(csv.DictReader((Path(__file__).parents[1] / "published" / "jech_2015_sphere.csv").open()))
FREQUENCY, SPEED = 100e3, 1500.0
K = 2 * np.pi * FREQUENCY / SPEED
boundaries = st.sampled_from(["rigid", "soft"])
sizes = st.floats(0.05, 60)


def _kirchhoff_db(position, normal_area, tilt):
    """|sum of facets n.d exp(2 i k d.r)| / wavelength for a line of sight tilted from x towards z [dB]."""
    sight = np.array([np.cos(tilt), 0.0, np.sin(tilt)])
    lit = np.maximum(normal_area @ sight, 0)
    return 20 * np.log10(np.abs(np.sum(lit * np.exp(2j * K * (position @ sight)))) * K / (2 * np.pi))


def _midpoints(side, count):
    return (np.arange(count) + 0.5) / count * side - side / 2


@pytest.mark.parametrize("row", PRINTED, ids=lambda row: f"{row['boundary']} {row['frequency_khz']} kHz")
def test_the_benchmark_prints_these_spheres(row):
    """Jech et al. (2015): rigid and pressure-release spheres, to 0.05 dB."""
    found = sphere_series_strength_db(
        float(row["radius_m"]), 1e3 * float(row["frequency_khz"]), boundary=row["boundary"],
        sound_speed=float(row["sound_speed_m_per_s"]),
    )  # fmt: skip
    assert found == pytest.approx(float(row["target_strength_db"]), abs=0.05)


@settings(max_examples=30)
@given(sizes, boundaries)
def test_what_is_missing_forward_went_elsewhere(ka, boundary):
    """Optical theorem: 4 pi / k times the imaginary part of the forward amplitude is all the scattered power.

    For exp(+j omega t) the forward amplitude has a negative imaginary part: a shadow.
    """
    cosine, weight = np.polynomial.legendre.leggauss(200)
    power = np.abs(sphere_amplitude(ka, np.arccos(cosine), boundary=boundary)) ** 2
    shadow = -4 * np.pi / ka * sphere_amplitude(ka, 0.0, boundary=boundary).imag
    assert 2 * np.pi * np.sum(weight * power) == pytest.approx(shadow, rel=1e-8)


@given(sizes, boundaries)
def test_a_sphere_that_takes_nothing_sends_out_all_it_gets(ka, boundary):
    """Unitarity: |1 - 2 eta_n| = 1 for every partial wave."""
    np.testing.assert_allclose(np.abs(1 - 2 * partial_waves(ka, boundary)), 1, atol=1e-10)


def test_a_tiny_sphere_scatters_as_rayleigh_predicts():
    """Rigid: |F| = a (ka)^2 5/6 backwards (Rayleigh 1872); soft: |F| = a."""
    ka = 0.01
    assert abs(sphere_amplitude(ka)) == pytest.approx(5 / 6 * ka**2, rel=1e-3)
    assert abs(sphere_amplitude(ka, boundary="soft")) == pytest.approx(1, rel=0.02)


@pytest.mark.parametrize("boundary", ["rigid", "soft"])
def test_a_large_sphere_is_a_mirror_ball(boundary):
    """Sizes ka = 400 and 5000: the series is 20 log10(a / 2) to 0.1 dB."""
    for ka in (400.0, 5000.0):
        found = sphere_series_strength_db(1.0, ka * 1500 / (2 * np.pi), boundary=boundary)
        assert found == pytest.approx(float(sphere_strength_db(1.0)), abs=0.1)


def test_a_soft_front_turns_the_echo_over_and_a_rigid_one_does_not():
    """At ka = 300 the echo comes from the front of the sphere, exp(+2 j k a), with the sign of the reflection."""
    for boundary, sign in (("rigid", 1), ("soft", -1)):
        assert sphere_amplitude(300.0, boundary=boundary) * np.exp(-600j) == pytest.approx(sign / 2, abs=0.01)


@pytest.mark.parametrize("tilt_deg", [0.0, 0.3, 1.0, 5.0, 20.0])
def test_a_plate_is_the_sum_of_its_facets(tilt_deg):
    """Kirchhoff's integral over 0.4 m x 0.3 m at 100 kHz, by midpoints: closed form to 0.02 dB."""
    z, y = np.meshgrid(_midpoints(0.4, 1200), _midpoints(0.3, 3), indexing="ij")
    position = np.stack([0 * z, y, z], axis=-1).reshape(-1, 3)
    area = np.tile([0.4 * 0.3 / z.size, 0, 0], (z.size, 1))
    tilt = np.radians(tilt_deg)
    assert plate_strength_db(0.4, 0.3, FREQUENCY, tilt=tilt) == pytest.approx(
        _kirchhoff_db(position, area, tilt), abs=0.02
    )


@pytest.mark.parametrize("tilt_deg", [0.0, 0.5, 2.0, 7.0])
def test_a_disc_is_the_sum_of_its_facets(tilt_deg):
    """Kirchhoff's integral over a disc of 0.2 m, as strips of its chords: closed form to 0.02 dB."""
    z = 0.2 * np.sin(_midpoints(np.pi, 4000))
    strip = 2 * np.sqrt(0.2**2 - z**2) * np.pi / 4000 * np.sqrt(0.2**2 - z**2)
    position = np.stack([0 * z, 0 * z, z], axis=-1)
    area = np.stack([strip, 0 * z, 0 * z], axis=-1)
    tilt = np.radians(tilt_deg)
    assert disc_strength_db(0.2, FREQUENCY, tilt=tilt) == pytest.approx(_kirchhoff_db(position, area, tilt), abs=0.02)


@pytest.mark.parametrize("tilt_deg", [0.0, 0.4, 2.0, 29.2])
def test_a_cylinder_is_the_sum_of_its_facets(tilt_deg):
    """Kirchhoff's integral over the lit side, a = 0.5 m and L = 0.3 m: to 0.15 dB at ka = 209, cos and not cos^2.

    The facets' own shadow edge is smoothed away: physical optics invents an echo there.
    """
    radius, length, tilt = 0.5, 0.3, np.radians(tilt_deg)
    turn = _midpoints(np.pi, 3000)
    z, turn = np.meshgrid(_midpoints(length, 500), turn, indexing="ij")
    position = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=-1).reshape(-1, 3)
    taper = np.where(np.abs(turn) < 1, 1.0, 0.5 + 0.5 * np.cos(np.pi * (np.abs(turn) - 1) / (np.pi / 2 - 1)))
    facet = taper * radius * length * np.pi / turn.size
    area = np.stack([facet * np.cos(turn), facet * np.sin(turn), 0 * turn], axis=-1).reshape(-1, 3)
    found = cylinder_strength_db(radius, length, FREQUENCY, tilt=tilt)
    assert found == pytest.approx(_kirchhoff_db(position, area, tilt), abs=0.15)


def test_a_sphere_is_a_curved_surface_of_equal_radii():
    """sqrt(R1 R2) / 2 at R1 = R2, and -6 dB at 1 m."""
    assert sphere_strength_db(1.0) == pytest.approx(-6.02, abs=0.005)
    assert curved_strength_db(2.0, 8.0) == sphere_strength_db(4.0)


def test_a_plate_face_on_is_its_area_in_wavelengths():
    """1 m^2 at 15 mm: 20 log10(1 / 0.015) = 36.5 dB; a disc of the same area likewise."""
    assert plate_strength_db(2.0, 0.5, FREQUENCY) == pytest.approx(36.478, abs=1e-3)
    assert disc_strength_db(np.sqrt(1 / np.pi), FREQUENCY) == pytest.approx(36.478, abs=1e-3)


def test_arrays_broadcast():
    """A row of frequencies by a column of tilts."""
    tilts = np.radians([[0.0], [1.0], [2.0]])
    assert plate_strength_db(1.0, 1.0, np.array([1e5, 2e5]), tilt=tilts).shape == (3, 2)
    assert sphere_series_strength_db(np.array([0.01, 0.02]), 1e5).shape == (2,)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: sphere_strength_db(0.0), "radius"),
        (lambda: plate_strength_db(1.0, -1.0, 1e5), "side"),
        (lambda: disc_strength_db(1.0, 0.0), "frequency"),
        (lambda: disc_strength_db(1.0, 1e5, tilt=2.0), "tilt"),
        (lambda: cylinder_strength_db(1.0, 1.0, 1e5, sound_speed=0.0), "sound_speed"),
        (lambda: sphere_series_strength_db(-1.0, 1e5), "radius"),
        (lambda: sphere_amplitude(1e6), "5000"),
    ],
)
def test_bodies_that_cannot_be_are_refused(call, named):
    """Zero sizes, no sound, angles behind the body: the wrong value is named."""
    with pytest.raises(ValueError, match=named):
        call()


def test_bodies_too_small_for_optics_are_reported():
    """A cylinder of ka = 0.4: one warning with law and range."""
    with pytest.warns(PhysicsWarning, match="Kirchhoff cylinder"):
        cylinder_strength_db(0.001, 1.0, FREQUENCY)
