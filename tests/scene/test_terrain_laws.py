"""Claims about relief as arithmetic: variances that add, terrain that scales, ripples by hand, maps by geometry."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scattering import Sediment
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.terrain import (
    PowerLaw,
    ReliefSum,
    Ripples,
    RoughnessCutoff,
    SedimentMap,
    SedimentPatches,
    SedimentRegion,
    SedimentStrip,
    build_terrain,
    upward_normal,
)
from oracles.roughness import residual_rms, roughness_rms

FRACTAL = PowerLaw(exponent=3.2, rms=0.2, outer_scale=10.0)
REGULAR = Ripples(wavelength=1.0, height=0.1, direction=0.7, sharpness=0.2, irregularity=0.0)
WILD = Ripples(wavelength=1.0, height=0.1, direction=0.7, sharpness=0.2, irregularity=0.4)
exponents = st.floats(2.4, 3.9)


def _places(count=300, seed=1, reach=200.0, centre=0.0):
    return centre + np.random.default_rng(seed).uniform(-reach, reach, (2, count))


@given(exponents, st.floats(0.1, 500), st.floats(0.1, 500))
def test_bands_of_relief_add_up(exponent, one, other):
    """Below, between and above two wavenumbers: three bands hold the whole variance, the square of the rms height."""
    law = PowerLaw(exponent=exponent, rms=0.3, outer_scale=15.0)
    low, high = min(one, other), max(one, other)
    parts = law.band_variance(0, low) + law.band_variance(low, high) + law.band_variance(high)
    assert parts == pytest.approx(0.09, rel=1e-9)
    assert law.band_variance() == pytest.approx(0.09, rel=1e-9)


@given(exponents, st.floats(0.5, 100))
def test_height_and_slope_are_integrals_of_the_spectrum(exponent, stop):
    """Two ways: closed forms, and 2 pi K W and 2 pi K^3 W added up by trapezes to a wavenumber."""
    law = PowerLaw(exponent=exponent, rms=0.3, outer_scale=8.0)
    k = np.geomspace(1e-5, stop, 20_001)
    per_log = 2 * np.pi * k**2 * law.spectrum(k)
    assert law.band_variance(0, stop) == pytest.approx(np.trapezoid(per_log, np.log(k)), rel=1e-4)
    assert law.slope_variance(stop) == pytest.approx(np.trapezoid(per_log * k**2, np.log(k)), rel=1e-4)


@settings(max_examples=20)
@given(exponents, st.floats(0.3, 2))
def test_ground_and_roughness_hold_all_the_height(exponent, wavelength):
    """Variance of the octaves drawn plus that of the residual is the whole, within the octaves' 5 %."""
    law, split = PowerLaw(exponent=exponent, rms=0.3, outer_scale=15.0), RoughnessCutoff(wavelength=wavelength)
    ground = build_terrain([law], seed=1, cutoff=split)
    whole = law.build_relief(seed=1, layer=0, cutoff=split).variance + residual_rms(ground) ** 2
    assert whole == pytest.approx(law.band_variance(), rel=0.05)


@given(st.floats(0.01, 100), st.floats(0.01, 100), st.floats(1.01, 5))
def test_roughness_of_two_bands_adds_as_squares(one, width, more):
    """Neighbouring bands of wavenumber, fractal and ripples together; a ripple counts in one of them only."""
    ground = build_terrain([FRACTAL, REGULAR], seed=1)
    middle, high = one + width, (one + width) * more
    parts = np.hypot(roughness_rms(ground, one, middle), roughness_rms(ground, middle, high))
    assert roughness_rms(ground, one, high) == pytest.approx(parts, rel=1e-9)


@pytest.mark.parametrize("factor", [0.1, 3.0])
def test_rougher_ground_is_the_same_ground_taller(factor):
    """Rms height by a factor: every height and slope by that factor, and the spectrum by its square."""
    taller = PowerLaw(exponent=3.2, rms=0.2 * factor, outer_scale=10.0)
    one, other = (build_terrain([law], seed=3).sample(*_places()) for law in (FRACTAL, taller))
    np.testing.assert_allclose(other.height, factor * one.height, rtol=1e-9)
    np.testing.assert_allclose(other.slope, factor * one.slope, rtol=1e-9)
    np.testing.assert_allclose(taller.spectrum([0.1, 9.0]), factor**2 * FRACTAL.spectrum([0.1, 9.0]))


def test_ground_twice_as_large_is_the_same_kind_of_ground():
    """Outer scale, split and rms doubled: variance by 4 and slopes as before, to the last digit of the closed forms."""
    large = PowerLaw(exponent=3.2, rms=0.4, outer_scale=20.0)
    assert large.slope_variance(5.0) == pytest.approx(FRACTAL.slope_variance(10.0), rel=1e-12)
    small = FRACTAL.build_relief(seed=1, layer=0, cutoff=RoughnessCutoff(wavelength=0.5))
    big = large.build_relief(seed=1, layer=0, cutoff=RoughnessCutoff(wavelength=1.0))
    assert big.variance == pytest.approx(4 * small.variance, rel=1e-9)
    assert big.slope_variance == pytest.approx(small.slope_variance, rel=1e-9)


@pytest.mark.parametrize("centre", [1e4, -3e6])
def test_ground_has_no_edge(centre):
    """Thousands of kilometres away it is as rough and as steep as here, and its slopes are still its gradient."""
    ground = build_terrain([FRACTAL], seed=5)
    octaves = FRACTAL.build_relief(seed=5, layer=0, cutoff=RoughnessCutoff())
    survey = ground.sample(*_places(6000, reach=2e4, centre=centre))
    assert np.mean(survey.height**2) == pytest.approx(octaves.variance, rel=0.1)
    assert np.mean(np.sum(survey.slope**2, axis=-1)) == pytest.approx(octaves.slope_variance, rel=0.1)
    n, e = _places(200, centre=centre)
    step = 2.0**-8  # exact beside 3e6
    for axis, (dn, de) in enumerate(((step, 0), (0, step))):
        rise = ground.height(n + dn, e + de) - ground.height(n - dn, e - de)
        np.testing.assert_allclose(rise / (2 * step), ground.slope(n, e)[:, axis], atol=2e-3)


def test_reliefs_stand_on_top_of_one_another():
    """Heights and slopes of a sum are the sums; in a turned frame, too, where the slopes turn back."""
    n, e = _places()
    parts = build_terrain([FRACTAL, REGULAR], seed=2).resolved.parts
    both, first, second = ReliefSum(parts).sample(n, e), *(part.sample(n, e) for part in parts)
    np.testing.assert_allclose(both.height, first.height + second.height)
    np.testing.assert_allclose(both.slope, first.slope + second.slope)
    turned = ReliefSum(parts, ScattererGrid(origin=(10.0, -4.0), heading=0.9))
    step = 1e-4
    for axis, (dn, de) in enumerate(((step, 0), (0, step))):
        rise = (turned.height(n + dn, e + de) - turned.height(n - dn, e - de)) / (2 * step)
        np.testing.assert_allclose(rise, turned.slope(n, e)[:, axis], atol=1e-5)


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_a_normal_is_a_unit_vector_that_points_up(north, east):
    """One long, up is negative, and both tangents (1, 0, -slope) lie across it."""
    normal = upward_normal(np.array([north, east]))
    assert np.linalg.norm(normal) == pytest.approx(1)
    assert normal[2] < 0
    assert normal @ [1, 0, -north] == pytest.approx(0, abs=1e-12)
    assert normal @ [0, 1, -east] == pytest.approx(0, abs=1e-12)


def test_regular_ripples_are_two_harmonics():
    """Height / 2 (cos psi + s cos 2 psi), written out: crest at the origin, phase along the compass direction."""
    n, e = _places()
    psi = 2 * np.pi * (np.cos(0.7) * n + np.sin(0.7) * e)
    found = build_terrain([REGULAR], seed=1).sample(n, e)
    np.testing.assert_allclose(found.height, 0.05 * (np.cos(psi) + 0.2 * np.cos(2 * psi)), atol=1e-12)
    steep = -0.05 * 2 * np.pi * (np.sin(psi) + 0.4 * np.sin(2 * psi))
    np.testing.assert_allclose(found.slope, steep[:, None] * [np.cos(0.7), np.sin(0.7)], atol=1e-11)


def test_ripples_have_no_front_and_no_back():
    """The opposite direction is the same field; a right angle away it is not."""
    n, e = _places()
    here, opposite, across = (
        build_terrain([REGULAR.model_copy(update={"direction": 0.7 + turn})], seed=1).height(n, e)
        for turn in (0, np.pi, np.pi / 2)
    )
    np.testing.assert_allclose(opposite, here, atol=1e-10)
    assert np.abs(across - here).max() > 0.05


def test_wandering_ripples_lean_as_they_rise():
    """The gradient includes the wander of crests and heights: central differences, near and far."""
    ground, step = build_terrain([WILD], seed=4), 1e-4
    for centre in (0.0, 1e5):
        n, e = _places(centre=centre)
        for axis, (dn, de) in enumerate(((step, 0), (0, step))):
            rise = (ground.height(n + dn, e + de) - ground.height(n - dn, e - de)) / (2 * step)
            np.testing.assert_allclose(rise, ground.slope(n, e)[:, axis], atol=2e-5)


def test_ripples_keep_their_compass_direction_on_a_turned_lattice():
    """A lattice's heading turns the draws, not the crests: regular ripples are the same from any frame."""
    n, e = _places()
    turned = build_terrain([REGULAR], seed=1, scatterer_grid=ScattererGrid(heading=1.1)).sample(n, e)
    plain = build_terrain([REGULAR], seed=1).sample(n, e)
    np.testing.assert_allclose(turned.height, plain.height, atol=1e-10)
    np.testing.assert_allclose(turned.slope, plain.slope, atol=1e-9)


def test_crests_bend_where_they_will_however_high_they_are():
    """The wander of crests and that of heights are independent: correlation below 5 % over a large field."""
    field = WILD.build_relief(seed=3, layer=0, cutoff=RoughnessCutoff())
    n, e = _places(5000, reach=1e5)
    assert abs(np.corrcoef(field.crest_wander.height(n, e), field.height_variation.height(n, e))[0, 1]) < 0.05
    assert np.std(field.crest_wander.height(n, e)) == pytest.approx(1, rel=0.05)
    assert np.std(field.height_variation.height(n, e)) == pytest.approx(1, rel=0.05)


def test_the_variance_of_ripples_is_that_of_two_harmonics():
    """Mean square over whole periods: (height / 2)^2 (1 + s^2) / 2, and its root is what the split leaves over."""
    along = np.arange(64) / 64
    height = build_terrain([REGULAR], seed=1).height(np.cos(0.7) * along, np.sin(0.7) * along)
    assert np.mean(height**2) == pytest.approx(REGULAR.variance, rel=1e-9)
    fine = build_terrain([REGULAR], seed=1, cutoff=RoughnessCutoff(wavelength=2.0))
    assert residual_rms(fine) == pytest.approx(np.sqrt(np.mean(height**2)))
    assert REGULAR.wavenumber == pytest.approx(2 * np.pi)


def test_relief_of_a_sediment_is_that_sediments():
    """The fractal that continues a bed has its exponent and strength: the same spectrum well above the outer scale."""
    gravel = Sediment.named("gravel")
    law = PowerLaw.of_sediment(gravel, outer_scale=50.0)
    expected = gravel.spectral_strength * 30.0**-gravel.spectral_exponent
    assert law.spectrum(30.0) == pytest.approx(expected, rel=1e-4)
    assert law.outer_wavenumber == pytest.approx(2 * np.pi / 50)


def _lookup(*pieces, base="clay", place=None, **kwargs):
    return (
        SedimentMap(base=base, on_top=pieces)
        .build_cover(seed=1, **kwargs)
        .lookup(*(_places() if place is None else place))
    )


def test_a_polygon_may_be_walked_in_either_sense_from_any_corner():
    """Corners reversed or begun elsewhere enclose the same ground, also where it is not convex."""
    star = ((150.0, 0.0), (30.0, 40.0), (10.0, 170.0), (-40.0, 30.0), (-160.0, -20.0), (0.0, -60.0))
    here = _lookup(SedimentRegion(sediment="rock", corners=star))
    assert 0 < here.sum() < here.size
    for corners in (star[::-1], star[2:] + star[:2]):
        np.testing.assert_array_equal(_lookup(SedimentRegion(sediment="rock", corners=corners)), here)


def test_a_strip_is_the_rectangle_around_its_middle_line():
    """Two descriptions of one band, and a strip drawn from its other end."""
    strip = SedimentStrip(sediment="rock", start=(-30.0, -40.0), end=(60.0, 80.0), width=50.0)
    across = np.array([-0.8, 0.6]) * 25.0  # to the side of (3, 4) / 5, half a width
    ends = [
        np.array(p) + side * across for p, side in (((-30, -40), 1), ((60, 80), 1), ((60, 80), -1), ((-30, -40), -1))
    ]
    rectangle = SedimentRegion(sediment="rock", corners=tuple((float(n), float(e)) for n, e in ends))
    back = SedimentStrip(sediment="rock", start=strip.end, end=strip.start, width=50.0)
    here = _lookup(strip)
    assert here.sum() > 5
    np.testing.assert_array_equal(_lookup(rectangle), here)
    np.testing.assert_array_equal(_lookup(back), here)


def test_the_last_piece_is_visible_and_sediments_are_listed_once():
    """Order decides where pieces overlap; a name that returns keeps its row."""
    one = SedimentRegion(sediment="rock", corners=((-99.0, -99.0), (99.0, -99.0), (99.0, 99.0), (-99.0, 99.0)))
    two = one.model_copy(update={"sediment": "gravel"})
    bed = SedimentMap(base="clay", on_top=(one, two, one))
    assert bed.sediments == ("clay", "rock", "gravel")
    assert bed.build_cover(seed=0).lookup(0.0, 0.0) == 1
    assert _lookup(one, two, place=(0.0, 0.0)) == 2
    assert _lookup(one, two, place=(150.0, 0.0)) == 0


def test_shares_of_patches_are_relative():
    """2 to 5 to 3 and 20 to 50 to 30 per cent are the same bed, place by place."""
    names = ("rock", "medium sand", "clay")
    beds = [
        _lookup(base=SedimentPatches(sediments=names, fractions=f, size=8.0))
        for f in ((2, 5, 3), (0.2, 0.5, 0.3), (20, 50, 30))
    ]
    np.testing.assert_array_equal(beds[0], beds[1])
    np.testing.assert_array_equal(beds[0], beds[2])


def test_patches_are_as_large_as_requested():
    """A bed of twice the size is the same bed seen from half the distance, lattice and all, in how often it changes."""
    line = np.arange(0.0, 4000.0, 0.25)
    changes = [
        np.count_nonzero(
            np.diff(
                _lookup(base=SedimentPatches(sediments=("rock", "clay"), fractions=(1, 1), size=s), place=(line, 3.0))
            )
        )
        for s in (10.0, 20.0, 40.0)
    ]
    assert 1.5 < changes[0] / changes[1] < 2.7
    assert 1.5 < changes[1] / changes[2] < 2.7
