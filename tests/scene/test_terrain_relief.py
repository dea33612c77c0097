"""Claims about relief: one endless terrain, with the given spectrum and structure."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.special import gamma

from insonify.scattering import Sediment
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.terrain import PowerLaw, Ripples, RoughnessCutoff, build_terrain, upward_normal
from insonify.scene.terrain.octaves import Octaves, quantiles
from insonify.validity import PhysicsWarning
from oracles.few_of import few_of
from oracles.roughness import residual_rms, residual_spectrum, structure

HILLS = PowerLaw(exponent=3.25, rms=0.1, outer_scale=20.0)
SAND = PowerLaw.of_sediment(Sediment.named("medium sand"))
EVERYTHING = (HILLS, Ripples(wavelength=1.5, height=0.1, direction=0.4))
exponents = st.floats(2.4, 3.9)


def _patch(side, count, *, corner=(0.0, 0.0)):
    step = np.arange(count) * side / count
    return np.meshgrid(corner[0] + step, corner[1] + step, indexing="ij")


def test_the_same_place_has_the_same_bits_in_any_company():
    """A patch requested whole, reversed, shuffled, or point by point: identical heights and slopes."""
    ground = build_terrain(EVERYTHING, seed=5, cutoff=RoughnessCutoff(wavelength=0.3))
    north, east = (x.ravel() for x in _patch(12.0, 40, corner=(-300.0, 5000.0)))
    whole = ground.sample(north, east)
    order = np.random.default_rng(1).permutation(north.size)
    shuffled = ground.sample(north[order], east[order])
    assert np.array_equal(whole.height[order], shuffled.height)
    assert np.array_equal(whole.slope[order], shuffled.slope)
    for n in range(0, north.size, 97):
        alone = ground.sample(north[n], east[n])
        assert alone.height == whole.height[n]
        assert np.array_equal(alone.slope, whole.slope[n])


def test_slopes_are_the_exact_gradient():
    """Central differences of the height, fractal and ripples together, to 1e-7, near and far from the origin."""
    ground = build_terrain(
        EVERYTHING,
        seed=5,
        cutoff=RoughnessCutoff(wavelength=0.3),
        scatterer_grid=ScattererGrid(heading=0.7, origin=(3.0, -8.0)),
    )
    rng, h = np.random.default_rng(2), 1e-5
    north, east = rng.uniform(-50, 50, (2, 300))
    slope = ground.slope(north, east)
    to_north = (ground.height(north + h, east) - ground.height(north - h, east)) / (2 * h)
    to_east = (ground.height(north, east + h) - ground.height(north, east - h)) / (2 * h)
    np.testing.assert_allclose(slope, np.stack([to_north, to_east], axis=-1), atol=1e-7)


def test_the_normal_stands_on_the_ground():
    """Across any two steps along the ground, and up: NED, so up is negative."""
    slope = np.random.default_rng(3).normal(size=(50, 2))
    normal = upward_normal(slope)
    # a step north raises the ground by slope, and depth is minus height
    np.testing.assert_allclose(normal[:, 0] - normal[:, 2] * slope[:, 0], 0, atol=1e-12)
    np.testing.assert_allclose(normal[:, 1] - normal[:, 2] * slope[:, 1], 0, atol=1e-12)
    assert np.all(normal[:, 2] < 0)


def test_generated_ground_has_the_requested_spectrum():
    """Mean periodogram of 32 patches within 1 dB of the requested law over 1.5 decades of wavenumber.

    Patches of 32 m, from 3 to 96 cycles per patch; outer scale 40 m, so the bend of the spectrum is in view.
    """
    law, side, count, patches = PowerLaw(exponent=3.25, rms=0.3, outer_scale=40.0), 32.0, 288, 32
    ground = build_terrain([law], seed=11, cutoff=RoughnessCutoff(wavelength=0.17))
    window = np.hanning(count + 1)[:-1]
    window = np.outer(window, window) / np.sqrt(np.mean(window**2)) ** 2
    power = np.zeros((count, count))
    for n in range(patches):
        north, east = _patch(side, count, corner=(1000.0 * n, -777.0 * n))
        height = ground.height(north, east)
        power += np.abs(np.fft.fft2(window * (height - height.mean()))) ** 2 / patches
    power *= (side / count) ** 4 / side**2 / (2 * np.pi) ** 2
    cycles = np.fft.fftfreq(count, 1 / count)
    radius = np.hypot(*np.meshgrid(cycles, cycles))
    edges = np.geomspace(3, 96, 13)
    for low, high in pairwise(edges):
        ring = (radius >= low) & (radius < high)
        specified = law.spectrum(2 * np.pi / side * radius[ring])
        # each bin against its own requested level, so that the steepness inside a ring does not count
        assert abs(10 * np.log10(np.mean(power[ring] / specified))) < 1.0, (low, high)


@few_of((0, 2), "hurst", [0.4, 0.625, 0.8])
def test_generated_ground_has_the_requested_structure(hurst):
    """Mean square difference over a lag within 5 % of the closed form: 96 patches, lags up to a twentieth of one.

    Roughness below the split has forgotten itself at these lags: it would add twice its mean square.
    """
    law, side = PowerLaw(hurst=hurst, rms=0.2, outer_scale=10.0), 64.0
    ground = build_terrain([law], seed=3, cutoff=RoughnessCutoff(wavelength=0.08))
    corner = np.random.default_rng(4).uniform(-1e5, 1e5, (96, 2))
    inside = np.random.default_rng(5).uniform(0, side, (96, 700, 2))
    place = corner[:, None] + inside
    here = ground.height(place[..., 0], place[..., 1])
    for lag in (1.2, 2.0, 3.2):
        turn = np.random.default_rng(6).uniform(0, 2 * np.pi, here.shape)
        there = ground.height(place[..., 0] + lag * np.cos(turn), place[..., 1] + lag * np.sin(turn))
        specified = float(structure(law, lag))
        assert 2 * residual_rms(ground) ** 2 < 0.06 * specified
        assert np.mean((there - here) ** 2) == pytest.approx(specified - 2 * residual_rms(ground) ** 2, rel=0.05)


@given(exponents, st.floats(2, 100))
def test_octaves_add_up_to_the_law(exponent, outer_scale):
    """Expected spectrum of the drawn octaves: within 0.6 dB of the law from K0/10 to a third of the split."""
    law = PowerLaw(exponent=exponent, rms=1.0, outer_scale=outer_scale)
    split = RoughnessCutoff(wavelength=outer_scale / 40)
    wavenumber = np.geomspace(law.outer_wavenumber / 10, split.wavenumber / 3, 60)
    octaves = law.build_relief(seed=0, layer=0, cutoff=split)
    error = 10 * np.log10(octaves.spectrum(wavenumber) / law.spectrum(wavenumber))
    assert np.max(np.abs(error)) < 0.6


@settings(max_examples=15)
@given(exponents)
def test_the_integral_of_the_spectrum_is_the_variance(exponent):
    """Parseval: requested law and drawn octaves, by quadrature, rms, and mean square slope below the split."""
    law, split = PowerLaw(exponent=exponent, rms=0.1), RoughnessCutoff(wavelength=0.5)
    wavenumber = np.geomspace(1e-4, 1e7, 1500)
    ring = 2 * np.pi * wavenumber**2
    whole = np.trapezoid(ring * law.spectrum(wavenumber), np.log(wavenumber))
    assert whole == pytest.approx(0.01, rel=0.02)  # an exponent near 2 has energy beyond any limit
    assert law.band_variance() == pytest.approx(0.01)
    octaves = law.build_relief(seed=0, layer=0, cutoff=split)
    near = wavenumber[wavenumber < 1e3]
    ring = ring[: near.size]
    drawn = ring * octaves.spectrum(near)
    assert np.trapezoid(drawn, np.log(near)) == pytest.approx(octaves.variance, rel=1e-3)
    assert np.trapezoid(near**2 * drawn, np.log(near)) == pytest.approx(octaves.slope_variance, rel=1e-3)
    below = np.geomspace(1e-4, split.wavenumber, 1500)
    steep = np.trapezoid(2 * np.pi * below**4 * law.spectrum(below), np.log(below))
    assert octaves.slope_variance == pytest.approx(steep, rel=1e-3)


def test_ground_is_as_rough_and_as_steep_as_its_octaves():
    """Sampled variance of height and gradient against the expected ones, and nearly normal heights."""
    octaves = HILLS.build_relief(seed=9, layer=0, cutoff=RoughnessCutoff(wavelength=0.5))
    found = octaves.sample(*np.random.default_rng(7).uniform(-1e6, 1e6, (2, 60_000)))
    assert np.mean(found.height**2) == pytest.approx(octaves.variance, rel=0.03)
    assert np.mean(np.sum(found.slope**2, axis=-1)) == pytest.approx(octaves.slope_variance, rel=0.03)
    assert np.mean(found.height**4) / octaves.variance**2 == pytest.approx(3, abs=0.25)


def test_structure_follows_the_constant_of_the_handbook():
    """Well below the outer scale D(r) = C^2 r^(2 H) with TR 9407's structure constant."""
    alpha, lag = SAND.gamma / 2 - 1, 1e-3
    constant = 2 * np.pi * SAND.w2 * gamma(2 - alpha) * 2 ** (-2 * alpha) / (alpha * (1 - alpha) * gamma(1 + alpha))
    far = SAND.model_copy(update={"outer_scale": 1e4})
    assert structure(far, lag) == pytest.approx(constant * lag ** (2 * alpha), rel=1e-3)


def test_a_finer_split_adds_detail_to_the_same_ground():
    """Ground split at 0.2 m less ground split at 2 m: nothing but the finest coarse octave and those below it."""
    place = np.random.default_rng(8).uniform(-500, 500, (2, 20_000))
    coarse, fine = (build_terrain([HILLS], seed=1, cutoff=RoughnessCutoff(wavelength=w)) for w in (2.0, 0.2))
    before, after = coarse.resolved.parts[0], fine.resolved.parts[0]
    count = before.amplitude.size
    grown = after.amplitude.copy()
    grown[:count] -= before.amplitude
    assert np.all(grown[: count - 1] == 0)
    added = fine.height(*place) - coarse.height(*place)
    assert np.mean(added**2) == pytest.approx(np.sum(grown**2) * (151 / 315) ** 2, rel=0.05)
    assert np.mean(added**2) < 0.1 * coarse.resolved.parts[0].variance


@settings(max_examples=40)
@given(st.floats(0.1, 5.0), exponents)
def test_nothing_is_counted_twice_or_lost(wavelength, exponent):
    """Resolved and residual spectrum are the requested one, within the octaves' own 0.3 dB."""
    law, split = PowerLaw(exponent=exponent, rms=0.1), RoughnessCutoff(wavelength=wavelength)
    ground = build_terrain([law], seed=2, cutoff=split)
    wavenumber = np.geomspace(0.05, 300, 80)
    (octaves,) = ground.resolved.parts
    assert isinstance(octaves, Octaves)
    both = octaves.spectrum(wavenumber) + residual_spectrum(ground, wavenumber)
    assert np.max(np.abs(10 * np.log10(both / law.spectrum(wavenumber)))) < 0.3


def test_neighbouring_seeds_and_layers_are_different_grounds():
    """Correlation below 5 % between seeds, and between two like reliefs of one scene."""
    place = np.random.default_rng(9).uniform(-2000, 2000, (2, 20_000))
    one, other = (build_terrain([HILLS], seed=s).height(*place) for s in (1, 2))
    twice = build_terrain([HILLS, HILLS], seed=1).height(*place) - one
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.05
    assert abs(np.corrcoef(one, twice)[0, 1]) < 0.05


def test_a_scene_moved_as_a_whole_keeps_its_ground():
    """Scatterer grid, ripples and points turned and shifted together: the same heights, slopes turned."""
    turn, shift = 0.9, np.array([40.0, -70.0])
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s], [s, c]])
    place = np.random.default_rng(10).uniform(-50, 50, (200, 2))
    moved = place @ rotation.T + shift
    here = build_terrain(EVERYTHING, seed=4)
    ripples = EVERYTHING[1].model_copy(update={"direction": 0.4 + turn})
    there = build_terrain((HILLS, ripples), seed=4, scatterer_grid=ScattererGrid(origin=(40.0, -70.0), heading=turn))
    before, after = here.sample(*place.T), there.sample(*moved.T)
    np.testing.assert_allclose(after.height, before.height, atol=1e-12)
    np.testing.assert_allclose(after.slope, before.slope @ rotation.T, atol=1e-12)


def test_no_relief_is_flat_ground():
    """Nothing requested: height and slope 0, and no roughness left over."""
    ground = build_terrain([], seed=0)
    assert np.all(ground.height(np.zeros((2, 3)), 1.0) == 0)
    assert ground.slope(0.0, np.zeros(4)).shape == (4, 2)
    assert residual_rms(ground) == 0


def test_drawn_numbers_have_unit_variance():
    """The table of quantiles, uniform inside each step: mean 0 and mean square 1 exactly."""
    q = quantiles()
    assert np.mean((q[:-1] ** 2 + q[:-1] * q[1:] + q[1:] ** 2) / 3) == pytest.approx(1, abs=1e-12)
    np.testing.assert_allclose(q, -q[::-1], atol=1e-12)
    assert np.all(np.diff(q) > 0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"exponent": 3.0},
        {"rms": 0.1},
        {"exponent": 3.0, "hurst": 0.5, "rms": 0.1},
        {"hurst": 0.5, "rms": 1, "strength": 1},
    ],
)
def test_a_fractal_needs_one_shape_and_one_size(wrong):
    """Exponent or Hurst, strength or rms: neither or both is refused with the choice named."""
    with pytest.raises(ValidationError, match="exactly one of"):
        PowerLaw(**wrong)


def test_exponents_no_seabed_has_are_reported():
    """Exponent 2.2: one warning that names the range."""
    with pytest.warns(PhysicsWarning, match="2.4 to 3.9"):
        PowerLaw(exponent=2.2, rms=0.1)


def test_hurst_and_rms_give_the_same_as_exponent_and_strength():
    """Exponent = 2 H + 2, and w2 from the variance: two ways to request one ground."""
    one = PowerLaw(hurst=0.625, rms="10 cm")
    other = PowerLaw(exponent=3.25, strength=one.w2)
    assert other.band_variance() == pytest.approx(0.01)
    place = np.arange(10.0)
    np.testing.assert_allclose(
        build_terrain([one], seed=1).height(place, 0.0), build_terrain([other], seed=1).height(place, 0.0)
    )
