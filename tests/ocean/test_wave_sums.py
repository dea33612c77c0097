"""Claims about waves added up: sums written out by hand, moments of the spectrum, limits of the dispersion."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import CosinePowerSpreading, Elfouhaily, Jonswap, PiersonMoskowitz, SeaSurface, angular_frequency
from insonify.ocean.wave_spectrum import height_variance, mean_square_slope, vertical_speed_rms

WIND = PiersonMoskowitz(7.0)
SEA = SeaSurface(WIND, CosinePowerSpreading(5.0), seed=3, bands=12, directions=6, shortest_wavelength=2.0)
SHALLOW = SeaSurface(
    WIND, CosinePowerSpreading(5.0), seed=3, bands=12, directions=6, shortest_wavelength=2.0, water_depth=4.0
)


def _places(count, seed=1):
    random = np.random.default_rng(seed)
    return random.uniform(-500, 500, (2, count)), random.uniform(0, 600, count)


def _by_hand(sea, place, time):
    """Elevation, slopes and vertical speed as numpy sums of complex waves, sharing no code with the kernels."""
    (kn, ke), omega = sea.wavenumber, sea.frequency
    phase = kn * place[0][:, None] + ke * place[1][:, None] - omega * time[:, None] + 2 * np.pi * sea.phase
    wave = sea.amplitude * np.exp(1j * phase)
    return (
        wave.real.sum(1),
        (1j * kn * wave).real.sum(1),
        (1j * ke * wave).real.sum(1),
        (-1j * omega * wave).real.sum(1),
    )


@pytest.mark.parametrize("sea", [SEA, SHALLOW], ids=["deep", "shallow"])
@pytest.mark.parametrize("count", [1, 255, 256, 257, 700])
def test_the_sea_is_the_sum_of_its_waves(sea, count):
    """Height, both slopes and vertical speed against complex exponentials, also where a block of places ends."""
    place, time = _places(count)
    motion = sea.motion(*place, time)
    found = motion.elevation, motion.slope_north, motion.slope_east, motion.vertical_velocity
    for column, expected in zip(found, _by_hand(sea, place, time), strict=True):
        np.testing.assert_allclose(column, expected, atol=2e-8)


def test_height_alone_is_height_with_its_slopes():
    """Two kernels, one height, bit for bit."""
    place, time = _places(600)
    np.testing.assert_array_equal(SEA.elevation(*place, time), SEA.motion(*place, time).elevation)


@pytest.mark.parametrize("order", [slice(None, None, -1), slice(1, None, 3), slice(37, 38)])
def test_a_place_has_the_same_bits_in_any_company(order):
    """Reversed, thinned out or alone: slopes and speed keep their bits as height does."""
    place, time = _places(600)
    whole, part = SEA.motion(*place, time), SEA.motion(*place[:, order], time[order])
    for name in ("elevation", "slope_north", "slope_east", "vertical_velocity"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[order])


def test_arguments_broadcast():
    """A grid of places at one time, and one place at many times."""
    assert SEA.elevation(np.zeros((3, 1)), np.zeros(4), 0.0).shape == (3, 4)
    assert SEA.motion(0.0, 0.0, np.zeros(5)).normal.shape == (5, 3)


def test_every_wave_satisfies_the_wave_equation_of_its_kind():
    """Waves that run downwind: d/dt of the height is minus the phase speed times its slope, for one wave alone."""
    one = SeaSurface(WIND, CosinePowerSpreading(50.0), seed=5, bands=1, directions=1)
    place, time = _places(50)
    motion = one.motion(*place, time)
    (kn, ke), omega = one.wavenumber[:, 0], one.frequency[0]
    ahead = (kn * motion.slope_north + ke * motion.slope_east) / np.hypot(kn, ke)
    np.testing.assert_allclose(motion.vertical_velocity, -omega / np.hypot(kn, ke) * ahead, atol=1e-9)


def test_a_normal_is_a_unit_vector_across_both_slopes():
    """In north, east, down: along the surface z changes by minus the slope, and the normal receives none of it."""
    motion = SEA.motion(*_places(100)[0], 3.0)
    normal = motion.normal
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1)
    np.testing.assert_allclose(normal[:, 0] - motion.slope_north * normal[:, 2], 0, atol=1e-15)
    np.testing.assert_allclose(normal[:, 1] - motion.slope_east * normal[:, 2], 0, atol=1e-15)
    assert np.all(normal[:, 2] > 0)


def test_an_old_sea_stays_as_rough_as_a_young_one():
    """Waves neither die nor grow: over many seas the variance is that of the band at time 0 and a day later."""
    kept = 2 * np.pi / 2.0
    place = np.random.default_rng(2).uniform(-1e4, 1e4, (2, 40_000))
    for time in (0.0, 86_400.0):
        assert np.var(SEA.elevation(*place, time)) == pytest.approx(
            height_variance(WIND, max_wavenumber=kept), rel=0.05
        )


def test_the_sea_heaves_and_leans_as_its_spectrum_predicts():
    """Sampled vertical speed and slope against the moments of the spectrum down to the shortest wave, to 5 %."""
    place = np.random.default_rng(2).uniform(-1e4, 1e4, (2, 40_000))
    sea = SeaSurface(WIND, seed=4, shortest_wavelength=2.0)
    motion = sea.motion(*place, 11.0)
    shortest = 2 * np.pi / 2.0
    leaning = np.mean(motion.slope_north**2 + motion.slope_east**2)
    assert leaning == pytest.approx(mean_square_slope(WIND, shortest), rel=0.05)
    assert np.std(motion.vertical_velocity) == pytest.approx(vertical_speed_rms(WIND, shortest), rel=0.05)


def test_crests_lie_across_the_wind():
    """Slopes along the travel exceed those across it, the more the narrower the fan: <cos^2> of its angles."""
    place = np.random.default_rng(6).uniform(-1e4, 1e4, (2, 40_000))
    motion = SeaSurface(
        WIND, CosinePowerSpreading(30.0), seed=4, wave_direction=np.pi / 2, shortest_wavelength=2.0
    ).motion(*place, 0.0)
    # <cos^2 phi> = (1 + s (s - 1) / ((s + 1) (s + 2))) / 2 for cos^(2s)(phi / 2)
    along = (1 + 30 * 29 / (31 * 32)) / 2
    share = np.mean(motion.slope_east**2) / np.mean(motion.slope_east**2 + motion.slope_north**2)
    assert share == pytest.approx(along, abs=0.01)


@given(st.floats(1e-3, 300), st.floats(0.1, 1e4))
def test_deep_and_shallow_water_are_limits(k, depth):
    """No wave is quicker than in deep water, nor than sqrt(g D) allows a long one; half a wavelength deep is deep."""
    here, deep = angular_frequency(k, water_depth=depth), angular_frequency(k)
    assert here <= deep * (1 + 1e-12)
    if k * depth > 10:
        assert here == pytest.approx(deep, rel=1e-8)
    if k * depth < 0.01:
        assert here == pytest.approx(k * math.sqrt(9.81 * depth), rel=1e-4)


def test_long_waves_in_shallow_water_all_run_alike():
    """No dispersion: phase and group speed are both sqrt(g D) for 5 m of water and waves of a kilometre."""
    k = 2 * np.pi / np.array([5000.0, 5001.0])
    omega = angular_frequency(k, water_depth=5.0)
    np.testing.assert_allclose(omega / k, math.sqrt(9.81 * 5), rtol=1e-4)
    assert np.diff(omega)[0] / np.diff(k)[0] == pytest.approx(math.sqrt(9.81 * 5), rel=1e-4)


def test_energy_in_deep_water_runs_at_half_the_speed_of_crests():
    """Group speed over phase speed: 1/2 for gravity waves, 3/2 where surface tension rules."""
    for k, ratio, tolerance in ((0.1, 0.5, 1e-3), (2e4, 1.5, 1e-3)):
        step = k * 1e-4
        group = (angular_frequency(k + step) - angular_frequency(k - step)) / (2 * step)
        assert group / (angular_frequency(k) / k) == pytest.approx(ratio, rel=tolerance)


@pytest.mark.parametrize("spectrum", [WIND, Jonswap(10.0, 5e4), Elfouhaily(8.0)], ids=lambda s: type(s).__name__)
def test_bands_of_waves_add_up(spectrum):
    """Height and slope of two neighbouring bands are those of both together, wherever the cut lies.

    To 1e-5: JONSWAP's width changes at its peak, and an integral that steps over the change notices.
    """
    for cut in (2 * spectrum.peak, 1.0, 17.0):
        parts = height_variance(spectrum, max_wavenumber=cut) + height_variance(spectrum, min_wavenumber=cut)
        assert parts == pytest.approx(height_variance(spectrum), rel=1e-5)
        slopes = mean_square_slope(spectrum, cut) + mean_square_slope(spectrum, 300.0, min_wavenumber=cut)
        assert slopes == pytest.approx(mean_square_slope(spectrum, 300.0), rel=1e-5)


@pytest.mark.parametrize("spectrum", [WIND, Jonswap(10.0, 5e4), Elfouhaily(8.0)], ids=lambda s: type(s).__name__)
def test_moments_are_the_integrals_they_claim(spectrum):
    """Two rules of integration: Gauss in the package, trapezes over a fine logarithmic grid here."""
    k = np.geomspace(spectrum.peak / 8, 50.0, 40_001)
    per_log = spectrum.density(k) * k
    for power, found in (
        (1, height_variance(spectrum, max_wavenumber=50.0)),
        (k**2, mean_square_slope(spectrum, 50.0)),
    ):
        assert np.trapezoid(per_log * power, np.log(k)) == pytest.approx(found, rel=1e-5)
    heave = np.trapezoid(per_log * angular_frequency(k, water_depth=9.0) ** 2, np.log(k)) ** 0.5
    assert vertical_speed_rms(spectrum, 50.0, water_depth=9.0) == pytest.approx(heave, rel=1e-5)


def test_a_band_without_waves_holds_nothing():
    """An empty band, and one below the longest wave, have neither height nor slope."""
    assert height_variance(WIND, min_wavenumber=5.0, max_wavenumber=5.0) == 0
    assert mean_square_slope(WIND, WIND.peak / 10) == 0


@given(st.floats(3, 20), st.floats(1.1, 2))
def test_a_developed_sea_scales_with_the_square_of_the_wind(wind, factor):
    """Only U^2 / g is a length: heights grow as U^2, slopes of scaled waves stay."""
    slow, fast = PiersonMoskowitz(wind), PiersonMoskowitz(wind * factor)
    assert height_variance(fast) == pytest.approx(factor**4 * height_variance(slow), rel=1e-3)
    assert fast.peak == pytest.approx(slow.peak / factor**2)
    k = np.array([1.0, 4.0]) * slow.peak
    np.testing.assert_allclose(fast.density(k / factor**2), factor**6 * slow.density(k), rtol=1e-9)


@given(st.floats(4, 20), st.floats(1e4, 5e5), st.floats(1.1, 3))
def test_a_growing_sea_scales_with_wind_and_fetch(wind, fetch, factor):
    """JONSWAP knows g X / U^2 only: wind by f and fetch by f^2 is the same sea, f^2 times as large."""
    small, large = Jonswap(wind, fetch), Jonswap(wind * factor, fetch * factor**2)
    k = np.array([0.9, 1.0, 3.0]) * small.peak
    assert large.peak == pytest.approx(small.peak / factor**2, rel=1e-9)
    np.testing.assert_allclose(large.density(k / factor**2), factor**6 * small.density(k), rtol=1e-9)


def test_a_swell_has_no_height_beyond_its_peak_enhancement():
    """At the peak itself gamma multiplies the density, and far from it nothing changes."""
    flat, sharp = Jonswap(10.0, 1e5, 1.0), Jonswap(10.0, 1e5, 5.0)
    peak = flat.peak_frequency
    assert sharp.frequency_density(peak) / flat.frequency_density(peak) == pytest.approx(5)
    # one width of 0.07 below the peak and 0.09 above, the exponent has fallen to exp(-1/2)
    for side in (1 - 0.07, 1 + 0.09):
        ratio = sharp.frequency_density(side * peak) / flat.frequency_density(side * peak)
        assert ratio == pytest.approx(5 ** math.exp(-0.5))
    assert sharp.frequency_density(3 * peak) == pytest.approx(float(flat.frequency_density(3 * peak)))


@given(st.floats(0.3, 5))
def test_without_enhancement_a_growing_sea_has_the_shape_of_a_developed_one(part):
    """JONSWAP with gamma = 1 is alpha g^2 omega^-5 exp(-1.25 (omega_p / omega)^4), and its maximum lies at omega_p."""
    sea = Jonswap(10.0, 1e5, 1.0)
    omega = part * sea.peak_frequency
    alpha = 0.076 * (100 / (1e5 * 9.81)) ** 0.22
    expected = alpha * 9.81**2 * omega**-5 * math.exp(-1.25 * part**-4)
    assert sea.frequency_density(omega) == pytest.approx(expected, rel=1e-9)
    assert sea.frequency_density(omega) <= sea.frequency_density(sea.peak_frequency)


def test_a_developed_sea_outruns_its_wind():
    """Its dominant waves run at 1.14 of the wind at 19.5 m and 1.17 of that at 10 m (Stewart 2008, section 16.4)."""
    assert math.sqrt(9.81 / PiersonMoskowitz(10.0).peak) / 10 == pytest.approx(1.17, abs=0.005)
