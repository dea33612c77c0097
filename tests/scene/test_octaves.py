"""One octave of noise, and laws made of octaves: splines, closed forms, scales and limits, none of them drawn twice."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from scipy.special import gamma, j0

from insonify.random_keys import TERRAIN, philox, stream_key
from insonify.scattering.sediments import Sediment
from insonify.scene.terrain import CompositeRelief, PowerLaw, Ripples, RoughnessCutoff, build_terrain, upward_normal
from insonify.scene.terrain.octaves import SPLINE_ENERGY, Octaves, quantiles, spline_spectrum, unit_octave
from insonify.scene.terrain.relief import MAX_COORDINATE
from oracles.roughness import roughness_rms, structure

SEVENTH = BSpline.basis_element(np.arange(-4.0, 5.0), extrapolate=False)
"""The cubic B-spline's correlation with itself is the B-spline of degree seven."""


def correlation(lag, pitch=1.0):
    """Mean over all directions of an octave's correlation over a lag [1], from the splines alone."""
    angle = (np.arange(720) + 0.5) * np.pi / 1440
    apart = np.multiply.outer(np.atleast_1d(lag) / pitch, np.stack([np.cos(angle), np.sin(angle)]))
    parts = np.nan_to_num(SEVENTH(apart))
    return np.mean(parts[:, 0] * parts[:, 1], axis=-1) / SPLINE_ENERGY**2


def octave(pitch=2.0, amplitude=1.0, seed=5, layer=0, level=7):
    """One octave of a chosen name."""
    return Octaves(np.array([pitch]), np.array([amplitude]), seed, layer, np.array([level]))


def somewhere(count=500, reach=300.0, seed=1):
    """Places within a square."""
    return np.random.default_rng(seed).uniform(-reach, reach, (2, count))


def by_hand(one, north, east):
    """Height of one octave at a place: numbers on 16 nodes, each its own draw, times splines of scipy."""
    turn, shift_a, shift_b, _ = one.placement()[0]
    c, s = np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn)
    a, b = (c * north + s * east) / one.pitch[0] + shift_a, (c * east - s * north) / one.pitch[0] + shift_b
    height, spline = 0.0, BSpline.basis_element(np.arange(-2.0, 3.0), extrapolate=False)
    for i in range(math.floor(a) - 1, math.floor(a) + 3):
        for j in range(math.floor(b) - 1, math.floor(b) + 3):
            words = philox(i, (j + 1) // 4, int(one.octave[0]), 2 * one.layer, *stream_key(one.seed, TERRAIN))
            number = np.interp(float(words[(j + 1) % 4]) * 2.0**-32 * 1024, np.arange(1025), quantiles())
            height += number * float(spline(a - i)) * float(spline(b - j))
    return one.amplitude[0] * height


@pytest.mark.parametrize("reach", [3.0, 60.0, 1e5])
def test_an_octave_is_splines_of_numbers_on_nodes(reach):
    """Places in one window of nodes, in several, and each on its own, 61 of them: a sum written out anew, to 1e-12."""
    one, (north, east) = octave(0.7, amplitude=0.3), somewhere(61, reach)
    expected = [by_hand(one, *place) for place in zip(north.tolist(), east.tolist(), strict=True)]
    np.testing.assert_allclose(one.height(north, east), expected, rtol=0, atol=1e-12 * (1 + reach / 100))


def test_unknown_positions_do_not_affect_others():
    """NaN among places in order and in none: NaN there, the same bits everywhere else."""
    one = octave()
    for north, east in (somewhere(300, 4.0), somewhere(300, 4000.0)):
        holes, hidden = np.arange(300) % 7 == 3, north.copy()
        hidden[holes] = np.nan
        found = one.height(hidden, east)
        assert np.isnan(found[holes]).all()
        np.testing.assert_array_equal(found[~holes], one.height(north, east)[~holes])


def test_energies_of_the_spline_are_values_of_the_seventh():
    """Integrals of B^2 and B'^2 are the value and minus the curvature of its correlation at 0: 151/315 and 2/3."""
    noise = unit_octave(3.0, seed=1, layer=0)
    assert float(SEVENTH(0.0)) == pytest.approx(SPLINE_ENERGY, rel=1e-12)
    assert noise.variance == pytest.approx(1.0, rel=1e-12)
    steep = 2 * -float(SEVENTH.derivative(2)(0.0)) / float(SEVENTH(0.0)) / 9
    assert noise.slope_variance == pytest.approx(steep, rel=1e-12)


@pytest.mark.parametrize("pitch", [0.5, 4.0])
def test_spectrum_and_correlation_of_an_octave_are_one_another(pitch):
    """Wiener and Khinchin: the Hankel transform of the spectrum is the correlation of splines, to 1e-3 at any lag."""
    noise = unit_octave(pitch, seed=1, layer=0)
    K = np.linspace(0, 25 / pitch, 20_001)
    lag = pitch * np.array([0.0, 0.3, 1.0, 2.0, 3.5, 6.0])
    found = [np.trapezoid(2 * np.pi * K * noise.spectrum(K) * j0(K * r), K) for r in lag]
    np.testing.assert_allclose(found, correlation(lag, pitch), atol=1e-3)


def test_slopes_are_the_second_moment_of_the_spectrum():
    """Integral of 2 pi K^3 W(K): the mean square gradient of the splines."""
    noise = unit_octave(2.0, seed=1, layer=0)
    K = np.linspace(0, 15, 20_001)
    assert np.trapezoid(2 * np.pi * K**3 * noise.spectrum(K), K) == pytest.approx(noise.slope_variance, rel=1e-3)


def test_long_waves_of_a_spline_are_those_of_a_gaussian():
    """To second order the spectrum is exp(-s^2 / 3): a spline's four boxes have a variance of 1/3 together."""
    s = np.array([0.0, 0.01, 0.1, 0.3])
    np.testing.assert_allclose(spline_spectrum(s), np.exp(-(s**2) / 3), rtol=2e-4)
    assert spline_spectrum(np.array([0.0]))[0] == 1.0


def test_drawn_ground_is_correlated_as_splines_are():
    """40 000 pairs of places in random directions: products of heights within 0.03 of the correlation, at four lags."""
    noise, rng = unit_octave(1.0, seed=11, layer=0), np.random.default_rng(2)
    north, east = rng.uniform(-2e4, 2e4, (2, 40_000))
    here = noise.height(north, east)
    for lag in (0.5, 1.0, 2.0, 5.7):
        bearing = rng.uniform(0, 2 * np.pi, north.size)
        there = noise.height(north + lag * np.cos(bearing), east + lag * np.sin(bearing))
        assert np.mean(here * there) == pytest.approx(correlation(lag)[0], abs=0.03)


def test_no_place_is_higher_than_the_highest_number_drawn():
    """B-splines add up to one everywhere: heights are means of drawn numbers, and none of these is beyond 3.9."""
    table = quantiles()
    np.testing.assert_allclose(table, -table[::-1], atol=1e-12)
    assert np.all(np.diff(table) > 0) and table[-1] < 3.9
    height = octave(amplitude=0.3).height(*somewhere(100_000))
    assert np.abs(height).max() <= 0.3 * table[-1]
    assert height.std() == pytest.approx(0.3 * SPLINE_ENERGY, rel=0.05)


@given(st.integers(-6, 6), st.integers(0, 2**32))
@settings(max_examples=15, deadline=None)
def test_a_stretched_octave_is_the_same_map_at_another_scale(power, seed):
    """Pitch and places by a power of two: the same bits of height, slopes by its inverse."""
    scale, (north, east) = 2.0**power, somewhere(60)
    one, other = octave(pitch=2.0, seed=seed), octave(pitch=2.0 * scale, seed=seed)
    here, there = one.sample(north, east), other.sample(scale * north, scale * east)
    np.testing.assert_array_equal(there.height, here.height)
    np.testing.assert_array_equal(there.slope * scale, here.slope)


def test_octaves_are_the_sum_of_each():
    """Three octaves at once are the three alone, added: heights, slopes, variances and spectra."""
    pitch, amplitude, level = np.array([4.0, 2.0, 1.0]), np.array([0.5, 0.3, 0.1]), np.array([3, 2, 1])
    whole = Octaves(pitch, amplitude, 9, 4, level)
    parts = [octave(*each[:2], seed=9, layer=4, level=each[2]) for each in zip(pitch, amplitude, level, strict=True)]
    found, places = whole.sample(*somewhere()), somewhere()
    np.testing.assert_allclose(found.height, sum(part.height(*places) for part in parts), atol=1e-12)
    np.testing.assert_allclose(found.slope, sum(part.slope(*places) for part in parts), atol=1e-12)
    assert whole.variance == pytest.approx(sum(part.variance for part in parts))
    np.testing.assert_allclose(whole.spectrum([0, 1, 3]), sum(part.spectrum([0, 1, 3]) for part in parts))


def test_ground_is_smooth_to_its_curvature():
    """Cubic splines: slopes have no corner; across any cell edge they change by curvature times the step."""
    noise = octave(pitch=1.0)
    north = np.arange(0, 12, 1e-4)
    slope = noise.slope(north, 0.37)
    step = np.diff(slope, axis=0) / 1e-4
    assert np.abs(np.diff(step, axis=0)).max() < 1e-4 * 40


def test_octaves_are_equal_by_their_numbers_and_cannot_be_changed():
    """The same numbers are the same ground and the same key; a column cannot be written to."""
    one, same, other = octave(), octave(), octave(seed=6)
    assert one == same and hash(one) == hash(same) and one != other and one != octave(level=8)
    with pytest.raises(ValueError, match="read-only"):
        one.pitch[0] = 3.0
    assert "1 (2 to 2 m)" in repr(one)


def test_brownian_relief_decorrelates_exponentially():
    """Hurst exponent 1/2 has a closed form: the mean square difference over r is 2 rms^2 (1 - exp(-K0 r))."""
    law, lag = PowerLaw(hurst=0.5, rms=0.2, outer_scale=5.0), np.array([0.0, 0.01, 0.3, 2.0, 40.0])
    expected = 2 * 0.2**2 * (1 - np.exp(-2 * np.pi / 5 * lag))
    np.testing.assert_allclose(structure(law, lag), expected, rtol=1e-9, atol=1e-15)


@given(st.floats(0.2, 0.9), st.floats(0.01, 2.0), st.floats(1.0, 100.0))
def test_far_apart_heights_are_independent_of_each_other(hurst, rms, outer_scale):
    """The structure function ends at twice the variance, and grows to it without a turn."""
    law = PowerLaw(hurst=hurst, rms=rms, outer_scale=outer_scale)
    found = structure(law, outer_scale * np.geomspace(1e-3, 10, 60))
    assert found[-1] == pytest.approx(2 * rms**2, rel=1e-6)
    assert np.all(np.diff(found) >= -1e-12 * rms**2)


@given(st.floats(0.2, 0.75))
def test_near_by_ground_is_a_fractal(hurst):
    """Well below the outer scale doubling the lag raises the mean square by 2^(2 H), with Matern's own constant."""
    law, lag = PowerLaw(hurst=hurst, rms=1.0, outer_scale=1e5), 0.01
    x = law.outer_wavenumber * lag
    expected = 2 * gamma(1 - hurst) / gamma(1 + hurst) * (x / 2) ** (2 * hurst)
    near = structure(law, [lag, 2 * lag])
    assert near[0] == pytest.approx(expected, rel=0.02)
    assert near[1] / near[0] == pytest.approx(4**hurst, rel=0.02)


@given(st.floats(2.4, 3.9), st.floats(0.01, 50))
def test_variance_beyond_a_wavenumber_is_what_the_waves_below_it_leave(exponent, low):
    """From 0 on it is all of it; the two parts add up."""
    law = PowerLaw(exponent=exponent, rms=0.3, outer_scale=12.0)
    assert float(law.variance_beyond(np.array(0.0))) == pytest.approx(0.09, rel=1e-9)
    assert float(law.variance_beyond(np.array(low))) + law.band_variance(0, low) == pytest.approx(0.09, rel=1e-9)


@pytest.mark.parametrize("name", ["medium silt", "medium sand", "sandy gravel"])
def test_only_wavelengths_decide_the_split(name):
    """Frequency and sound speed by one factor leave it; it follows the sound's wavelength to the power 1 / alpha."""
    bed = Sediment.named(name)
    one = RoughnessCutoff.of_sediment(bed, 50e3, sound_speed=1500.0)
    assert RoughnessCutoff.of_sediment(bed, 55e3, sound_speed=1650.0).wavelength == pytest.approx(
        one.wavelength, rel=1e-9
    )
    twice = RoughnessCutoff.of_sediment(bed, 100e3, sound_speed=1500.0)
    alpha = bed.spectral_exponent / 2 - 1
    assert twice.wavelength == pytest.approx(one.wavelength * 0.5 ** (1 / alpha), rel=1e-9)


def test_the_finest_wave_of_the_ground_is_that_of_its_parts():
    """A fractal ends at the split, ripples at half their length; what is below the split is no ground."""
    fractal, coarse, fine = PowerLaw(hurst=0.6, rms=0.1), Ripples(wavelength=0.8), Ripples(wavelength=0.3)
    split = RoughnessCutoff(wavelength=0.5)
    for kinds, expected in (
        ((), 0.5),
        ((fractal,), 0.5),
        ((coarse,), 0.4),
        ((fine,), 0.5),
        ((fractal, coarse, fine), 0.4),
    ):
        assert build_terrain(kinds, seed=1, cutoff=split).shortest_wavelength == pytest.approx(expected), kinds


def test_band_and_whole_agree_whatever_is_resolved():
    """Variance between wavenumbers, requested as an array or as an rms height, with and without ripples in the band."""
    ground = build_terrain([PowerLaw(hurst=0.6, rms=0.1), Ripples(wavelength=0.8)], seed=1)
    low = np.array([0.1, 1.0, 2 * np.pi / 0.8 * 0.999, 2 * np.pi / 0.8 * 1.001, 20.0])
    found = ground.band_variance(low, 30.0)
    np.testing.assert_allclose(np.sqrt(found), [roughness_rms(ground, k, 30.0) for k in low], rtol=1e-9)
    assert np.all(np.diff(found) < 0)
    assert ground.band_variance(np.array([40.0]), 30.0)[0] == 0.0


def test_spans_add_and_hold_the_ground():
    """Lowest and highest of a sum are the sums of its parts, and no place of 20 000 is beyond them."""
    kinds = [PowerLaw(hurst=0.6, rms=0.1), Ripples(wavelength=0.8)]
    whole = build_terrain(kinds, seed=2)
    alone = [part.span for part in whole.resolved.parts]
    np.testing.assert_allclose(whole.span, np.sum(alone, axis=0))
    height = whole.height(*somewhere(20_000))
    assert whole.span[0] < height.min() and height.max() < whole.span[1]
    assert build_terrain([], seed=2).span == (0.0, 0.0)


def test_a_place_that_is_none_is_reported_with_its_name():
    """Too far for centimetres, or a word: the axis is named; a gap stays a gap and spoils no neighbour."""
    ground: CompositeRelief = build_terrain([PowerLaw(hurst=0.6, rms=0.1)], seed=1)
    with pytest.raises(ValueError, match="north"):
        ground.height(2 * MAX_COORDINATE, 0.0)
    with pytest.raises(ValueError, match="east"):
        ground.height(0.0, "far")
    found = ground.height([0.0, math.nan, 2.0], 1.0)
    assert np.isnan(found[1])
    np.testing.assert_array_equal(found[[0, 2]], ground.height([0.0, 2.0], 1.0))
    with pytest.raises(ValueError, match=r"slope has shape \(3,\)"):
        upward_normal([0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match="give reliefs"):
        build_terrain(["sand"], seed=1)
