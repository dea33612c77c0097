"""Claims about ripples and about which sediment lies where."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.terrain import (
    Ripples,
    RoughnessCutoff,
    SedimentMap,
    SedimentPatches,
    SedimentRegion,
    SedimentStrip,
    build_terrain,
)
from insonify.validity import PhysicsWarning
from oracles.roughness import residual_rms, roughness_rms


def _profile(ripples, *, length=4096.0, count=32768, bearing=None):
    along = np.arange(count) * length / count
    bearing = ripples.direction if bearing is None else bearing
    return along, build_terrain([ripples], seed=6).height(along * np.cos(bearing), along * np.sin(bearing))


def test_ripples_have_their_wavelength_across_the_crests():
    """The strongest line of a section along the direction stands at one cycle per wavelength, the next at two."""
    ripples = Ripples(wavelength=2.0, height=0.2, direction=0.8, sharpness=0.2, irregularity=0.1)
    _, height = _profile(ripples)
    power = np.abs(np.fft.rfft(height)) ** 2
    cycles = np.arange(power.size) / 4096.0
    first, second = (power[np.abs(cycles - n / 2.0) < 0.2].sum() for n in (1, 2))
    assert cycles[np.argmax(power)] == pytest.approx(0.5, abs=0.02)
    assert second / first == pytest.approx(0.2**2, rel=0.02)
    assert first + second > 0.97 * power[1:].sum()


def test_ripples_are_as_high_as_requested():
    """Mean square over a large field is the closed form, wander of the height included."""
    ripples = Ripples(wavelength=1.0, height=0.1, irregularity=0.3)
    place = np.random.default_rng(1).uniform(-1e5, 1e5, (2, 100_000))
    assert np.mean(build_terrain([ripples], seed=2).height(*place) ** 2) == pytest.approx(ripples.variance, rel=0.03)


def test_regular_ripples_go_from_trough_to_crest_by_their_height():
    """Without wander: crest minus trough is the height at any sharpness, and along the crests nothing changes."""
    for sharpness in (0.0, 0.1, 0.25):
        ripples = Ripples(wavelength=1.0, height=0.1, direction=0.3, sharpness=sharpness, irregularity=0.0)
        _, across = _profile(ripples, length=50.0)
        _, along = _profile(ripples, length=50.0, bearing=0.3 + np.pi / 2)
        assert np.ptp(across) == pytest.approx(0.1, rel=1e-3)
        assert np.ptp(along) < 1e-12


def test_crests_are_sharper_than_troughs():
    """More of the bed lies below the mean level than above, and the skewness grows with the harmonic."""
    skewness = []
    for sharpness in (0.0, 0.1, 0.2):
        _, height = _profile(Ripples(wavelength=1.0, height=0.1, sharpness=sharpness, irregularity=0.1))
        skewness.append(np.mean(height**3) / np.mean(height**2) ** 1.5)
    assert abs(skewness[0]) < 0.02
    # cos psi + s cos 2 psi: third moment 3 s / 4
    assert skewness[1] == pytest.approx(0.75 * 0.1 / (0.5 * 1.01) ** 1.5, rel=0.15)
    assert skewness[2] > 1.8 * skewness[1]


def test_ripples_finer_than_the_split_are_roughness():
    """Nothing in the ground, everything in the residual; coarser ones the other way round."""
    ripples = Ripples(wavelength=0.4, height=0.04, irregularity=0.0)
    left = build_terrain([ripples], seed=1, cutoff=RoughnessCutoff(wavelength=0.5))
    drawn = build_terrain([ripples], seed=1, cutoff=RoughnessCutoff(wavelength=0.3))
    assert np.all(left.height(np.arange(9.0), 0.0) == 0)
    assert residual_rms(left) == pytest.approx(np.sqrt(ripples.variance))
    assert residual_rms(drawn) == 0
    assert roughness_rms(left, 10.0, 20.0) == roughness_rms(drawn, 10.0, 20.0) == pytest.approx(residual_rms(left))


def test_ripples_too_steep_to_stand_are_reported():
    """Height over wavelength 0.5: sand does not hold it."""
    with pytest.warns(PhysicsWarning, match="Sand ripples"):
        Ripples(wavelength=0.1, height=0.05)


def test_patches_cover_the_shares_that_were_requested():
    """Three sediments at 20, 50 and 30 % of the area, to 2 %; neighbours in the list are neighbours on the bed."""
    bed = SedimentMap(base=SedimentPatches(sediments=("rock", "medium sand", "clay"), fractions=(2, 5, 3), size=10.0))
    cover = bed.build_cover(seed=3)
    rows = cover.lookup(*np.random.default_rng(2).uniform(-5e4, 5e4, (2, 100_000)))
    np.testing.assert_allclose(np.bincount(rows) / rows.size, [0.2, 0.5, 0.3], atol=0.02)
    line = cover.lookup(np.arange(0, 500, 0.01), 7.0)
    assert set(np.abs(np.diff(line))) == {0, 1}
    assert [sediment.name for sediment in cover.sediments] == ["rock", "medium sand", "clay"]


def test_patches_are_the_same_in_any_order_and_move_with_the_scene():
    """Alone or together, and on a lattice that moved with the points."""
    bed = SedimentMap(base=SedimentPatches(sediments=("rock", "clay"), fractions=(1, 1), size=5.0))
    place = np.random.default_rng(3).uniform(-40, 40, (2, 500))
    together = bed.build_cover(seed=1).lookup(*place)
    assert all(bed.build_cover(seed=1).lookup(*place[:, n]) == together[n] for n in range(0, 500, 50))
    moved = bed.build_cover(seed=1, scatterer_grid=ScattererGrid(origin=(100.0, 5.0))).lookup(
        place[0] + 100.0, place[1] + 5.0
    )
    assert np.array_equal(moved, together)


def test_a_polygon_holds_what_lies_inside_it():
    """An L of area 3, by counting points; its notch and its outside are left alone."""
    ell = ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2))
    cover = SedimentMap(base="clay", on_top=(SedimentRegion(sediment="rock", corners=ell),)).build_cover(seed=0)
    place = np.random.default_rng(4).uniform(-1, 3, (2, 200_000))
    assert np.mean(cover.lookup(*place)) * 16 == pytest.approx(3, rel=0.02)
    assert cover.lookup([0.5, 1.5, 0.5, 1.5, -0.5], [0.5, 0.5, 1.5, 1.5, 0.5]).tolist() == [1, 1, 1, 0, 0]


def test_a_strip_lies_across_what_was_there():
    """A band of 2 m from north to east over 10 m: area 20 m^2; the last piece placed is seen."""
    strip = SedimentStrip(sediment="clay", start=(0, 0), end=(6, 8), width=2)
    box = SedimentRegion(sediment="rock", corners=((-5, -5), (-5, 15), (15, 15), (15, -5)))
    cover = SedimentMap(base="medium sand", on_top=(box, strip)).build_cover(seed=0)
    place = np.random.default_rng(5).uniform(-5, 15, (2, 200_000))
    assert np.mean(cover.lookup(*place) == 2) * 400 == pytest.approx(20, rel=0.05)
    assert cover.lookup([3.0, 3.0], [4.0, -4.0]).tolist() == [2, 1]


def test_a_misspelt_sediment_is_reported_with_the_nearest():
    """Names are checked where the map is written."""
    with pytest.raises(ValidationError, match="medium sand"):
        SedimentMap(base="medium snad")


def test_patches_need_a_share_for_each_sediment():
    """Three names and two fractions, or one name twice, are refused."""
    with pytest.raises(ValidationError, match="Give one for each"):
        SedimentPatches(sediments=("rock", "clay", "medium sand"), fractions=(1, 1))
    with pytest.raises(ValidationError, match="twice"):
        SedimentPatches(sediments=("rock", "rock"), fractions=(1, 1))
    with pytest.raises(ValidationError, match="another position"):
        SedimentStrip(sediment="rock", start=(1, 1), end=(1, 1), width=1)
