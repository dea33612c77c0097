"""Claims about depth from phase: geometry, coherence of a footprint, bias and spread of a flat bed."""

import numpy as np
import pytest

from insonify.processing import (
    complex_coherence,
    elevation_to_phase,
    flat_bed_elevation,
    interferometric_depth,
    phase_deviation,
    phase_to_elevation,
    unwrap_to_reference,
)
from oracles.few_of import few_of
from oracles.point_echoes import bell, received, speckle, two_way

F, C, ALTITUDE = 150e3, 1500.0, 9.0
WAVE = C / F
TILT = np.radians(35)


def receivers(baseline, tilt=TILT):
    """Upper and lower receiver in the plane of ahead (unused), starboard, down; broadside looks `tilt` down."""
    up = np.array([0.0, np.sin(tilt), -np.cos(tilt)])
    return np.stack([up, -up]) * baseline / 2


def bed(across):
    """Points of a level bed."""
    return np.stack([0 * across, across, 0 * across + ALTITUDE], axis=-1)


@pytest.mark.parametrize("elevation_deg", [5.0, 35.0, 70.0])
def test_the_phase_of_an_echo_gives_its_elevation(elevation_deg):
    """A point at 40 m received by two receivers 5 wavelengths apart, from pressures to an angle within 0.01 deg."""
    elevation = np.radians(elevation_deg)
    point = 40 * np.array([[0, np.cos(elevation), np.sin(elevation)]])
    delay = two_way(point, np.zeros(3), receivers(5 * WAVE))
    upper, lower = received(delay[0, :1], delay, F, bell(5e3))[:, 0]
    about = {"baseline": 5 * WAVE, "tilt": TILT, "centre_frequency": F, "sound_speed": C}
    phase = unwrap_to_reference(np.angle(upper * np.conj(lower)), elevation_to_phase(elevation + 0.05, **about))
    assert np.degrees(phase_to_elevation(phase, **about)) == pytest.approx(elevation_deg, abs=0.01)


@pytest.mark.parametrize("off_deg", [-50.0, 20.0, 45.0, 80.0])
def test_a_wavefront_close_by_is_estimated_nearer_to_broadside(off_deg):
    """Ways from a place to both receivers, a / R of 1/5: by (a / 4 R)^2 sin(2 angle), but for (a / R)^4."""
    baseline, slant, off = 0.2, 1.0, np.radians(off_deg)
    place = slant * np.array([0, np.cos(TILT + off), np.sin(TILT + off)])
    upper, lower = np.linalg.norm(place - receivers(baseline), axis=1)
    expected = phase_to_elevation(2 * np.pi / WAVE * (lower - upper), baseline=baseline, tilt=TILT, centre_frequency=F)
    shorter = (baseline / (4 * slant)) ** 2 * np.sin(2 * off)
    assert TILT + off - expected == pytest.approx(shorter, abs=0.1 * (baseline / slant) ** 4)


def test_phase_and_elevation_undo_each_other():
    """Anywhere in front, within rounding of the largest angle; beyond the baseline's reach there is no angle."""
    about = {"baseline": 0.1, "tilt": 0.3, "centre_frequency": F}
    elevation = np.linspace(-1.2, 1.8, 31)
    found = phase_to_elevation(elevation_to_phase(elevation, **about), **about)
    np.testing.assert_allclose(found, elevation, atol=1e-15)  # an elevation near 0 is the tilt less an angle near it
    assert np.isnan(phase_to_elevation(100.0, **about))
    np.testing.assert_allclose(flat_bed_elevation([18.0, 9.0, 3.0], 9.0), [np.pi / 6, np.pi / 2, np.pi / 2])


@few_of((0, 3), "waves", [2, 5, 10, 15])
def test_coherence_is_the_integral_over_the_footprint(waves):
    """1 ms of tone on a bed 9 m below, received at 13 m slant range, 12,000 looks: within 0.02 of the integral.

    Coherence over looks has a standard error of (1 - g^2) / sqrt(2 N), 0.005 at the most; its phase one of
    sqrt((1 - g^2) / (2 N g^2)).
    """
    rng, looks, count = np.random.default_rng(waves), 12_000, 60
    two = receivers(waves * WAVE)
    slants = np.array([12.25, 13.0])
    across = np.sqrt(slants**2 - ALTITUDE**2)
    places = rng.uniform(across[0] - 0.05, across[1] + 0.05, (looks, count))
    turn = np.exp(2j * np.pi * rng.uniform(size=places.shape))
    delay = two_way(bed(places.ravel()), np.zeros(3), two).reshape(looks, count, 2)
    inside = np.abs(delay - 2 * slants.mean() / C) < 0.5e-3
    series = np.sum(turn[..., None] * inside * np.exp(-2j * np.pi * ((F * delay) % 1)), axis=1)
    got = complex_coherence(series[:, 0], series[:, 1])
    fine = np.linspace(across[0], across[1], 4001)
    late = two_way(bed(fine), np.zeros(3), two)
    both = np.all(np.abs(late - 2 * slants.mean() / C) < 0.5e-3, axis=1)
    either = [np.mean(np.abs(two_way(bed(np.linspace(across[0] - 0.3, across[1] + 0.3, 4001)), np.zeros(3), two)[:, i]
              - 2 * slants.mean() / C) < 0.5e-3) * (across[1] - across[0] + 0.6) for i in (0, 1)]  # fmt: skip
    step = fine[1] - fine[0]
    exact = np.sum(both * np.exp(-2j * np.pi * F * (late[:, 0] - late[:, 1]))) * step / np.sqrt(either[0] * either[1])
    assert abs(got) == pytest.approx(abs(exact), abs=0.02)
    error = float(phase_deviation(abs(exact), looks))
    assert abs(np.angle(got * np.conj(exact))) < 4 * error + 0.01


def flat_bed(pings, baseline, seed=3):
    """Speckle of a level bed from 15 to 62 m, six scatterers to 7.5 cm."""
    rng = np.random.default_rng(seed)
    time, two = np.arange(2 * 18 / C, 2 * 61 / C, 1 / 30e3), receivers(baseline)
    rows = []
    for _ in range(pings):
        across = rng.uniform(12, 62, 4000)
        turn = np.exp(2j * np.pi * rng.uniform(size=across.size))
        delay = two_way(bed(across), np.zeros(3), two)
        rows.append(speckle(time, delay, F, bell(8e3), turn, 1.2e-4))
    series = np.array(rows)
    return time * C / 2, series[:, 0], series[:, 1]


@pytest.fixture(scope="module")
def surveyed():
    """Twenty-five pings with a baseline of 5 wavelengths."""
    return flat_bed(25, 5 * WAVE)


def test_a_flat_bed_is_where_it_is(surveyed):
    """Depth unbiased to 2 cm from 20 to 60 m, in four parts; the altitude that settles turns may be wrong by 0.5 m."""
    slant, upper, lower = surveyed
    for altitude in (9.0, 8.5):
        across, depth, gamma = interferometric_depth(
            upper, lower, slant, altitude=altitude, baseline=5 * WAVE, tilt=TILT, centre_frequency=F, looks=(25, 15)
        )
        for near, far in ((20, 30), (30, 40), (40, 50), (50, 60)):
            part = (slant > near) & (slant < far)
            assert np.mean(depth[12, part]) == pytest.approx(ALTITUDE, abs=0.02)
        part = (slant > 20) & (slant < 60)
        np.testing.assert_allclose(np.hypot(across, depth)[12, part], slant[part])
        assert np.all(gamma[12, part] > 0.9)


def test_the_spread_of_phase_is_that_of_its_coherence(surveyed):
    """25 independent looks: sqrt((1 - g^2) / (2 N g^2)) within 15 %; over 1000 samples, a third of them independent."""
    slant, upper, lower = surveyed
    part = (slant > 20) & (slant < 45)
    about = {"baseline": 5 * WAVE, "tilt": TILT, "centre_frequency": F}
    expected = elevation_to_phase(flat_bed_elevation(slant, ALTITUDE), **about)
    flat = upper * np.exp(-1j * expected)
    phase = np.angle(np.sum(flat * np.conj(lower), axis=0))[part]
    gamma = np.abs(complex_coherence(flat[:, part].ravel(), lower[:, part].ravel()))
    assert phase.std() == pytest.approx(float(phase_deviation(gamma, 25)), rel=0.15)


def test_the_bound_has_its_two_ends():
    """No spread of a perfect phase, an infinite one of none; the root of the looks in between."""
    np.testing.assert_allclose(phase_deviation([1.0, 0.0], 4), [0, np.inf])
    assert phase_deviation(0.8, 9) == pytest.approx(phase_deviation(0.8, 1) / 3)
    assert phase_deviation(0.6, 2) == pytest.approx(np.sqrt(0.64 / (4 * 0.36)))


def test_what_does_not_fit_is_refused():
    """The value, and what would fit."""
    about = {"altitude": 9.0, "baseline": 0.05, "tilt": TILT, "centre_frequency": F}
    series = np.zeros((3, 50), np.complex64)
    with pytest.raises(ValueError, match=r"slant_range \(49,\); give"):
        interferometric_depth(series, series, np.linspace(9, 20, 49), **about)
    with pytest.raises(ValueError, match="baseline is 0"):
        interferometric_depth(series, series, np.linspace(9, 20, 50), **about | {"baseline": 0.0})
