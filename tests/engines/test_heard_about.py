"""Where next to nothing is heard slices are merged: the bound that tells so, and what is lost by it."""

import numpy as np
import pytest

from insonify.engines.lines import WIDEST_PATCH, heard_about
from insonify.engines.skyline import Skylines, StraightLaunches, sighted
from insonify.engines.slices import ALIKE, MERGED, Slices
from insonify.simulation import prepare
from oracles.ridges import Corduroy, bed_of
from oracles.scenes import nominal

BEAMS = {
    "nominal": {},
    "steered": {"receive": {"steer": [-0.5, 0.3]}},
    "apart": {"transmit": {"offset": (0.0, -0.5, 0.7)}, "receive": {"offset": (0.5, 0.5, 0.0)}},
    "tilted": {"sonar": {"mounting": {"tilt": 0.5}}},
}


def stance_of(**told):
    """The nominal sonar's first ping."""
    return prepare(nominal(**told)).stance(0)


def gain(stance, families, bearing, distance):
    """Two-way gain towards places on the level bed, the loudest channel and pair of families, from both ends [1]."""
    both, at = 1.0, stance.middle + distance[:, None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
    for place, beams in ((stance.transmit_place, stance.transmit_beams), (stance.receive_place, stance.ears)):
        falls = [20.0 - place[2] if family == "D" else -(20.0 + place[2]) for family in families]
        ways = [np.column_stack([at - place[:2], np.full(len(at), fall)]) for fall in falls]
        each = [np.abs(beams.gain(way / np.linalg.norm(way, axis=1, keepdims=True))).max(axis=0) for way in ways]
        both = both * np.max(each, axis=0)
    return both


@pytest.mark.parametrize("beams", BEAMS)
@pytest.mark.parametrize("families", [("D",), ("D", "S")])
def test_no_place_of_a_patch_is_louder_than_is_told(beams, families):
    """200 patches of four widths and distances, 10 places in each: nowhere more than the bound; loud where axes are."""
    stance, rng, closest = stance_of(**BEAMS[beams]), np.random.default_rng(1), []
    heard = heard_about(stance, 20.0, families)
    for width in (0.005, 0.03, 0.1, 0.3):
        middle = np.append(stance.bearing, rng.uniform(-np.pi, np.pi, 49))
        near = float(rng.uniform(12, 60))
        zone = near, near * 2
        bound = heard(middle, width, zone)
        turn, away = rng.random((2, 50, 10))
        places = middle[:, None] + width * (turn - 0.5), near + away * near
        found = gain(stance, families, *(part.ravel() for part in places)).reshape(50, 10)
        assert np.all(found.max(axis=1) <= bound * (1 + 1e-6) + 1e-9)
        closest.append((found.max(axis=1) / np.maximum(bound, 1e-3)).max())
    assert max(closest) > 0.3  # it is no bound that is never met


def test_more_families_and_wider_patches_are_no_fainter():
    """What is added can only be louder."""
    stance, bearing = stance_of(), np.linspace(-3, 3, 40)
    one, two = (heard_about(stance, 20.0, families) for families in (("D",), ("D", "S", "BS")))
    for width in (0.01, 0.1):
        assert np.all(two(bearing, width, (20.0, 40.0)) >= one(bearing, width, (20.0, 40.0)))
        # bearings that both look at are the same five only where one width is four times the other
        assert np.all(one(bearing, 4 * width, (20.0, 40.0)) >= 0.99 * one(bearing, width, (20.0, 40.0)))


def test_it_is_not_told_what_is_heard_of_wide_patches_nor_by_two_platforms_nor_by_nobody():
    """Infinite where a patch, or what ends apart make of it, is too wide; nothing told without families."""
    stance = stance_of(**BEAMS["apart"])
    heard = heard_about(stance, 20.0, ("D",))
    assert np.all(np.isinf(heard(np.zeros(3), WIDEST_PATCH * 1.01, (20.0, 40.0))))
    assert np.all(np.isinf(heard(np.zeros(3), 0.01, (0.0, 40.0))))
    assert np.all(np.isfinite(heard(np.zeros(3), 0.01, (20.0, 40.0))))
    assert heard_about(stance, 20.0, ()) is None


def cut_of(heard, *, finest=4e-3, bed=None):
    """Slices about the sonar at 11 m."""
    return Slices(bed or bed_of(), np.array([0.0, 0.0, 11.0]), StraightLaunches(11.0, 20.0), farthest=120.0,
                  wavelength=0.015, finest_slice=finest, heard=heard)  # fmt: skip


def test_slices_are_merged_where_their_eight_are_faint_and_nowhere_else():
    """Zone by zone: those whose level, asked for all alike, is below a tenth of the loudest's; none without a bound."""
    heard = heard_about(stance_of(), 20.0, ("D",))
    cut, inner = cut_of(heard), 0.0
    for start, count, outer in zip(cut.starts, cut.counts, cut.edges, strict=False):
        first, width = np.arange(0, count, ALIKE), 2 * np.pi / count
        level = heard((first + ALIKE / 2) * width, ALIKE * width, (inner, float(outer)))
        found = cut.merged[start // ALIKE : (start + count) // ALIKE]
        if np.isinf(level).any():
            assert not found.any()
        else:
            np.testing.assert_array_equal(found[level >= 0.1 * level.max()], 0)
            assert np.all(found[level < 0.05 * level.max()] == MERGED)
        inner = float(outer)
    assert (cut.merged == MERGED).mean() > 0.5 and cut_of(None).merged.max() == 0


def test_ground_that_does_not_change_with_bearing_loses_nothing_by_merged_slices():
    """Level crests far off along a line: four slices as one move a crest by its sagitta alone, and light what they did.

    Within 0.1 rad of square to the crests a line 1.5 slices aside meets them at sec(0.1 + 1.5 slices) of the distance.
    """
    bed = bed_of(Corduroy(8.0, 0.8))
    rng = np.random.default_rng(3)
    azimuth, distance = rng.uniform(-0.1, 0.1, 3000), rng.uniform(20, 100, 3000)
    position = np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth)], axis=-1)
    lit, place = [], np.array([0.0, 0.0, 11.0])
    for heard in (None, lambda bearing, width, zone: np.where(np.cos(bearing - np.pi) > 0.9, 1.0, 0.01)):
        skylines = Skylines(bed, place, StraightLaunches(11.0, 20.0), farthest=120.0, wavelength=0.015,
                            finest_slice=4e-3, heard=heard)  # fmt: skip
        seen = sighted(skylines, place, position)
        merged = skylines.cut.merged
        lit.append(skylines.visible(("D",), seen.distance, np.zeros((1, 3000)), np.full(3000, 20.0), seen.groups,
                                    ground=True)[0])  # fmt: skip
        assert (merged.max() > 0) == (heard is not None)
    assert 0.2 < lit[0].mean() < 0.98
    assert np.mean(lit[0] != lit[1]) < 0.04
    assert lit[1].mean() == pytest.approx(lit[0].mean(), abs=0.01)
