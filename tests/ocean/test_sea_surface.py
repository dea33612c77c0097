"""Claims about the moving sea: its height, spectrum, speed and direction, and that a place keeps its waves."""

import math
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import j0

from insonify.ocean.directional_spreading import CosinePowerSpreading, ElfouhailySpreading
from insonify.ocean.elfouhaily import Elfouhaily
from insonify.ocean.jonswap import Jonswap
from insonify.ocean.pierson_moskowitz import PiersonMoskowitz
from insonify.ocean.sea_surface import SeaSurface
from insonify.ocean.wave_kernels import BLOCK, cosine_of_cycles
from insonify.ocean.wave_spectrum import height_variance, mean_square_slope, significant_height
from oracles.few_of import few_of

WIND = Elfouhaily(8.0)
SEAS = {
    "Pierson-Moskowitz": (PiersonMoskowitz(8.0), CosinePowerSpreading(10.0)),
    "JONSWAP": (Jonswap(8.0, 50e3), CosinePowerSpreading(10.0)),
    "Elfouhaily": (WIND, ElfouhailySpreading(WIND)),
}


def _places(count, extent, seed=5):
    return np.random.default_rng(seed).uniform(-extent, extent, (2, count))


@pytest.mark.parametrize("name", SEAS)
def test_the_sea_is_as_high_as_requested(name):
    """Significant height within 3 %: 8 seas, 4000 places each over 40 km and an hour, N = 32 000 (error 0.4 %)."""
    spectrum, spreading = SEAS[name]
    north, east = _places(4000, 20e3)
    time = np.linspace(0, 3600, north.size)
    seas = [SeaSurface(spectrum, spreading, seed=seed) for seed in range(8)]
    heights = np.array([sea.elevation(north, east, time) for sea in seas])
    assert 4 * heights.std() == pytest.approx(significant_height(spectrum), rel=0.03)
    assert np.abs(heights.mean()) < 4 * heights.std() / math.sqrt(heights.size)
    # Sums of a thousand waves: kurtosis 3 within four standard errors sqrt(24 / N).
    kurtosis = np.mean(heights**4) / np.mean(heights**2) ** 2
    assert kurtosis == pytest.approx(3, abs=4 * math.sqrt(24 / heights.size))


@pytest.mark.parametrize("name", SEAS)
def test_every_sea_has_all_the_variance_of_its_band(name):
    """No draw is richer or poorer: the waves' energies add up to the spectrum down to the shortest, to 1e-4."""
    spectrum, spreading = SEAS[name]
    expected = height_variance(spectrum, max_wavenumber=2 * math.pi / 0.3)
    for seed, bands, directions in ((0, 64, 16), (1, 20, 5)):
        sea = SeaSurface(spectrum, spreading, seed=seed, bands=bands, directions=directions)
        assert np.sum(sea.amplitude**2) / 2 == pytest.approx(expected, rel=1e-4)


def test_the_sea_has_the_requested_spectrum():
    """At a fixed post, third-octave levels from 0.8 to 12 times the peak are the spectrum's within 1 dB (64 seas)."""
    spectrum, step, count = PiersonMoskowitz(8.0), 0.2, 8192
    peak = math.sqrt(9.81 * spectrum.peak)
    time, window = step * np.arange(count), np.hanning(count)
    power = np.zeros(count // 2 + 1)
    for seed in range(64):
        post = SeaSurface(spectrum, seed=seed, shortest_wavelength=0.5).elevation(0.0, 0.0, time)
        power += np.abs(np.fft.rfft(post * window)) ** 2 / 64
    density = power * 2 * step / np.sum(window**2) / (2 * math.pi)
    omega = 2 * math.pi * np.fft.rfftfreq(count, step)
    edges = 0.8 * peak * 2 ** (np.arange(0, 12) / 3)
    assert edges[-1] < math.sqrt(9.81 * 2 * math.pi / 0.5)
    for low, high in pairwise(edges):
        inside = (omega >= low) & (omega < high)
        level = 10 * np.log10(density[inside].mean() / spectrum.frequency_density(omega[inside]).mean())
        assert abs(level) < 1, f"{level:.2f} dB at {low / peak:.2f} of the peak"


def test_the_mean_over_seas_has_the_exact_correlation():
    """All directions alike: E[h(0) h(r)] is the integral of S(k) J0(k r), within 3 standard errors (400 seas x 64)."""
    spectrum, lags = PiersonMoskowitz(6.0), np.array([0.0, 3.0, 8.0, 15.0, 30.0])
    k = np.geomspace(spectrum.peak / 8, 2 * math.pi / 0.3, 40001)
    expected = np.trapezoid(spectrum.density(k) * j0(k * lags[:, None]), k, axis=1)
    north, east = _places(64, 1e4)
    products = []
    for seed in range(400):
        sea = SeaSurface(spectrum, CosinePowerSpreading(0.0), seed=seed, bands=12, directions=4)
        h = sea.elevation(north + lags[:, None], east, 0.0)
        products.append((h * h[0]).mean(axis=1))
    error = np.std(products, axis=0) / math.sqrt(400)
    assert np.all(error < 0.02 * expected[0])
    assert np.all(np.abs(np.mean(products, axis=0) - expected) < 3 * error + 1e-4 * expected[0])


@pytest.mark.parametrize("water_depth", [1000.0, 4.0])
@few_of((1,), "going_to_deg", [0.0, 180.0])
def test_waves_run_at_their_own_speed(water_depth, going_to_deg):
    """Along the wind, in space and time: 98 % of the energy swings at sqrt(g k tanh k D), and goes where it is sent."""
    sea = SeaSurface(
        PiersonMoskowitz(6.0),
        CosinePowerSpreading(1e5),
        wave_direction=math.radians(going_to_deg),
        water_depth=water_depth,
        shortest_wavelength=4.0,
    )
    north, time = 1.0 * np.arange(512), 0.5 * np.arange(512)
    h = sea.elevation(north[:, None], 0.0, time) * np.outer(np.hanning(512), np.hanning(512))
    # exp(-j omega t + j K n): the transform in time is conjugated to read omega as positive.
    power = np.abs(np.fft.fft(np.fft.ifft(h, axis=1), axis=0)) ** 2
    k, omega = 2 * math.pi * np.fft.fftfreq(512, 1.0), 2 * math.pi * np.fft.fftfreq(512, 0.5)
    k = k[:, None] * math.cos(math.radians(going_to_deg))
    sailing, rising = np.maximum(k, 1e-6), omega > 0
    theory = np.sqrt(9.81 * sailing * np.tanh(np.minimum(sailing * water_depth, 50)))
    # Three cells of the transform: a step of frequency, and one of wavenumber at no more than the phase speed.
    blurred = 3 * (2 * math.pi / 256 + theory / sailing * 2 * math.pi / 512)
    on_curve = (np.abs(omega - theory) < blurred) & (k > 0)
    assert power[on_curve & rising].sum() > 0.98 * power[:, rising].sum()
    # What satisfies is a thin line in the plane: the claim is no truism.
    assert np.mean(on_curve[:, rising]) < 0.05


@pytest.mark.parametrize("water_depth", [math.inf, 6.0])
def test_slopes_and_speed_are_derivatives_of_height(water_depth):
    """By central differences of the elevation, at 50 places."""
    sea = SeaSurface(WIND, water_depth=water_depth, seed=3)
    (north, east), time, d = _places(50, 500.0), np.linspace(0, 60, 50), 1e-4
    motion = sea.motion(north, east, time)
    for column, (dn, de, dt) in {
        "slope_north": (d, 0, 0),
        "slope_east": (0, d, 0),
        "vertical_velocity": (0, 0, d),
    }.items():
        rise = sea.elevation(north + dn, east + de, time + dt) - sea.elevation(north - dn, east - de, time - dt)
        np.testing.assert_allclose(getattr(motion, column), rise / (2 * d), atol=2e-5)
    np.testing.assert_array_equal(motion.elevation, sea.elevation(north, east, time))


def test_slopes_are_as_steep_as_requested():
    """Slope variance within 3 % of the spectrum's down to the shortest wave (N = 24 000), more of it along the wind."""
    sea = SeaSurface(WIND, ElfouhailySpreading(WIND), wave_direction=math.pi / 2)
    motion = sea.motion(*_places(24000, 20e3), 0.0)
    along, across = np.var(motion.slope_east), np.var(motion.slope_north)
    assert along + across == pytest.approx(mean_square_slope(WIND, 2 * math.pi / 0.3), rel=0.03)
    assert along > 1.2 * across


def test_depth_is_down():
    """A crest is less deep than the mean, and the normal into the water leans the way the crest leans."""
    motion = SeaSurface(WIND).motion(*_places(100, 500.0), 7.0)
    np.testing.assert_array_equal(motion.depth, -motion.elevation)
    np.testing.assert_allclose(np.linalg.norm(motion.normal, axis=-1), 1)
    assert np.all(motion.normal[:, 2] > 0.5)
    # In the surface, one metre north goes down by minus the slope: that direction is square to the normal.
    along = np.stack((np.ones(100), np.zeros(100), -motion.slope_north), axis=-1)
    np.testing.assert_allclose(np.sum(along * motion.normal, axis=-1), 0, atol=1e-12)
    np.testing.assert_array_equal(SeaSurface(WIND).depth(1.0, 2.0, 3.0), -SeaSurface(WIND).elevation(1.0, 2.0, 3.0))


@pytest.mark.parametrize("going_to_deg", [0, 90, 200])
def test_waves_go_to_where_they_are_sent(going_to_deg):
    """The mean direction of the energy is the requested heading, clockwise from north, within 2 degrees."""
    sea = SeaSurface(WIND, wave_direction=math.radians(going_to_deg))
    north, east = (sea.wavenumber * sea.amplitude**2 / np.hypot(*sea.wavenumber)).sum(axis=1)
    assert math.cos(math.atan2(east, north) - math.radians(going_to_deg)) > math.cos(math.radians(2))


def test_a_turned_world_has_the_same_sea():
    """Wind and places turned together about the origin see the same heights."""
    north, east = _places(100, 300.0)
    turn = 0.7
    n, e = north * np.cos(turn) - east * np.sin(turn), north * np.sin(turn) + east * np.cos(turn)
    still, turned = SeaSurface(WIND, seed=2), SeaSurface(WIND, seed=2, wave_direction=turn)
    np.testing.assert_allclose(turned.elevation(n, e, 5.0), still.elevation(north, east, 5.0), atol=1e-8)


def test_a_place_keeps_its_waves():
    """Same seed, same bits: requested alone, in any order, in threads, or by a sea built again."""
    sea = SeaSurface(WIND, seed=11)
    north, east = _places(3 * BLOCK + 17, 1e4)
    whole = sea.motion(north, east, 12.5)
    order = np.random.default_rng(0).permutation(north.size)
    again = SeaSurface(WIND, seed=11).motion(north[order], east[order], 12.5)
    for column in ("elevation", "slope_north", "slope_east", "vertical_velocity"):
        np.testing.assert_array_equal(getattr(again, column), getattr(whole, column)[order])
    with ThreadPoolExecutor(2) as pool:
        parts = pool.map(lambda p: sea.elevation(north[p], east[p], 12.5), np.array_split(np.arange(north.size), 7))
    np.testing.assert_array_equal(np.concatenate(list(parts)), whole.elevation)
    assert sea.elevation(north[40], east[40], 12.5) == whole.elevation[40]


def test_another_seed_is_another_sea():
    """Heights of two seeds are uncorrelated, as are those of one seed a kilometre apart (4 / sqrt(N), N = 4000)."""
    north, east = _places(4000, 2e4)
    one, other = (SeaSurface(WIND, seed=s).elevation(north, east, 0.0) for s in (0, 1))
    far = SeaSurface(WIND, seed=0).elevation(north + 1234.5, east, 0.0)
    assert abs(np.corrcoef(one, other)[0, 1]) < 4 / math.sqrt(4000)
    assert abs(np.corrcoef(one, far)[0, 1]) < 4 / math.sqrt(4000) + 0.05


def test_phases_are_independent_of_directions():
    """A wave's phase is uniform, and independent of its direction's place in the sector (4 / sqrt(N))."""
    sea = SeaSurface(WIND, CosinePowerSpreading(0.0), directions=16)
    place = np.arctan2(sea.wavenumber[1], sea.wavenumber[0]) / (2 * math.pi) * 16
    for turned in (sea.phase, place, sea.phase - place, sea.phase + place):
        assert abs(np.mean(np.exp(2j * math.pi * turned))) < 4 / math.sqrt(sea.phase.size)


@given(st.floats(-1e6, 1e6))
def test_the_quick_cosine_is_a_cosine(cycles):
    """To 1e-9 of the library's, over a million cycles."""
    assert cosine_of_cycles(cycles) == pytest.approx(math.cos(2 * math.pi * math.fmod(cycles, 1)), abs=1e-9)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"shortest_wavelength": 500.0}, r"SeaSurface\.shortest_wavelength is 500"),
        ({"shortest_wavelength": 0.0}, r"SeaSurface\.shortest_wavelength is 0"),
        ({"water_depth": -5.0}, r"SeaSurface\.water_depth is -5"),
        ({"bands": 0}, "bands is 0"),
    ],
)
def test_a_sea_that_cannot_be_is_refused(wrong, message):
    """Waves shorter than nothing, water less than nothing."""
    with pytest.raises(ValueError, match=message):
        SeaSurface(WIND, **wrong)
