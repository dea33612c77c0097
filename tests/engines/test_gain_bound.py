"""Bound of the two-way gain by which azimuth slices are merged, and the error of merging."""

import numpy as np
import pytest

from insonify.engines.radials import MAX_PATCH_WIDTH, bearing_gain_bound
from insonify.engines.resolution import two_way_gain_bound
from insonify.engines.terrain_occlusion import StraightLaunchAngles, TerrainOcclusion, locate_points
from insonify.engines.terrain_profiles import MERGE_GROUP, MERGE_POWER, AzimuthProfiles
from insonify.propagation.propagation_model import departure_cones
from insonify.scene.scatterers import Scatterers
from insonify.simulator import build_simulator
from oracles.ridges import Corduroy, bed_of
from oracles.scenes import nominal

BEAMS = {
    "nominal": {},
    "steered": {"receive": {"steer": [-0.5, 0.3]}},
    "apart": {"transmit": {"offset": (0.0, -0.5, 0.7)}, "receive": {"offset": (0.5, 0.5, 0.0)}},
    "tilted": {"sonar": {"mounting": {"tilt": 0.5}}},
}
LAYERED = {"profile": {"depth": [0, 8, 20], "speed": [1505, 1500, 1490]}, "noise_level_db": None}


def geometry_of(**changes):
    """The nominal sonar's first ping."""
    return build_simulator(nominal(**changes)).ping_geometry(0)


def gain(ping_geometry, families, bearing, distance):
    """Two-way gain towards a flat seabed, the largest of all channels and pairs of families, from both ends [1]."""
    both, at = 1.0, ping_geometry.midpoint + distance[:, None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
    for place, beams in (
        (ping_geometry.transmit_position, ping_geometry.transmit_beams),
        (ping_geometry.receive_position, ping_geometry.bounding_receive_beams),
    ):
        falls = [20.0 - place[2] if family == "D" else -(20.0 + place[2]) for family in families]
        ways = [np.column_stack([at - place[:2], np.full(len(at), fall)]) for fall in falls]
        each = [np.abs(beams.gain(way / np.linalg.norm(way, axis=1, keepdims=True))).max(axis=0) for way in ways]
        both = both * np.max(each, axis=0)
    return both


@pytest.mark.parametrize("beams", BEAMS)
@pytest.mark.parametrize("families", [("D",), ("D", "S")])
def test_the_gain_in_a_patch_is_at_most_the_bound(beams, families):
    """200 patches of four widths and distances, 10 positions in each: never above the bound; high on the axes."""
    ping_geometry, rng, closest = geometry_of(**BEAMS[beams]), np.random.default_rng(1), []
    gain_bound = bearing_gain_bound(ping_geometry, 20.0, families)
    for width in (0.005, 0.03, 0.1, 0.3):
        middle = np.append(ping_geometry.first_beam_bearing, rng.uniform(-np.pi, np.pi, 49))
        near = float(rng.uniform(12, 60))
        zone = near, near * 2
        bound = gain_bound(middle, width, zone)
        turn, away = rng.random((2, 50, 10))
        places = middle[:, None] + width * (turn - 0.5), near + away * near
        found = gain(ping_geometry, families, *(part.ravel() for part in places)).reshape(50, 10)
        assert np.all(found.max(axis=1) <= bound * (1 + 1e-6) + 1e-9)
        closest.append((found.max(axis=1) / np.maximum(bound, 1e-3)).max())
    assert max(closest) > 0.3  # a bound that is nearly attained


@pytest.mark.parametrize("beams", BEAMS)
@pytest.mark.parametrize("sufficient", [np.inf, 1e-2])
@pytest.mark.parametrize("water", [{}, {"water": LAYERED}], ids=["uniform", "layered"])
def test_one_kernel_bounds_all_families_and_ends(beams, sufficient, water):
    """500 neighbourhoods: to the bit what each family's cones and each end's beams give one by one."""
    simulator, rng = build_simulator(nominal(**BEAMS[beams], **water)), np.random.default_rng(2)
    place, around = rng.uniform(-80, 80, (500, 2)), rng.exponential(2.0, 500)
    here, rays, families = simulator.ping_geometry(0), simulator.engine.rays, ("D", "S", "BS")
    found = two_way_gain_bound(place, around, here, 20.0, rays, families, rise=0.3, sufficient_gain=sufficient)
    ends = [(here.transmit_position, here.transmit_beams), (here.receive_position, here.bounding_receive_beams)]
    gains = np.zeros((2, 500))
    for family in families:
        missing = gains[0] * gains[1] < sufficient
        for gain, (position, of_end) in zip(gains, ends, strict=True):
            cones = departure_cones(rays, family, position, place, around, 20.0, relief_height=0.3)
            bound = np.where(cones.exists, of_end.bound(cones.axis, cones.half_angle), 0.0)
            gain[missing] = np.maximum(gain, bound)[missing]
    np.testing.assert_array_equal(found, gains[0] * gains[1])
    assert found.max() > 0.5 > found.min()


def test_bounds_grow_with_families_and_width():
    """Further families and width can only raise the bound."""
    ping_geometry, bearing = geometry_of(), np.linspace(-3, 3, 40)
    one, two = (bearing_gain_bound(ping_geometry, 20.0, families) for families in (("D",), ("D", "S", "BS")))
    for width in (0.01, 0.1):
        assert np.all(two(bearing, width, (20.0, 40.0)) >= one(bearing, width, (20.0, 40.0)))
        # bearings that both look at are the same five only where one width is four times the other
        assert np.all(one(bearing, 4 * width, (20.0, 40.0)) >= 0.99 * one(bearing, width, (20.0, 40.0)))


def test_wide_patches_two_platforms_and_no_families_have_no_bound():
    """Infinite where a patch, or its parallax between the ends, is too wide; no bound without families."""
    ping_geometry = geometry_of(**BEAMS["apart"])
    gain_bound = bearing_gain_bound(ping_geometry, 20.0, ("D",))
    assert np.all(np.isinf(gain_bound(np.zeros(3), MAX_PATCH_WIDTH * 1.01, (20.0, 40.0))))
    assert np.all(np.isinf(gain_bound(np.zeros(3), 0.01, (0.0, 40.0))))
    assert np.all(np.isfinite(gain_bound(np.zeros(3), 0.01, (20.0, 40.0))))
    assert bearing_gain_bound(ping_geometry, 20.0, ()) is None


def cut_of(received, *, finest=4e-3, bed=None):
    """Slices about the sonar at 11 m."""
    return AzimuthProfiles(bed or bed_of(), np.array([0.0, 0.0, 11.0]), StraightLaunchAngles(11.0, 20.0),
    farthest=120.0,
                  wavelength=0.015, min_profile_width=finest, gain_bound=received)  # fmt: skip


def test_slices_are_merged_where_their_eight_have_low_gain_and_nowhere_else():
    """Merged slices by zone: those with a gain below a tenth of the largest at that distance; none without a bound."""
    gain_bound = bearing_gain_bound(geometry_of(), 20.0, ("D",))
    cut, inner = cut_of(gain_bound), 0.0
    for start, count, outer in zip(cut.starts, cut.counts, cut.edges, strict=False):
        first, width = np.arange(0, count, MERGE_GROUP), 2 * np.pi / count
        level = gain_bound((first + MERGE_GROUP / 2) * width, MERGE_GROUP * width, (inner, float(outer)))
        found = cut.merged[start // MERGE_GROUP : (start + count) // MERGE_GROUP]
        if np.isinf(level).any():
            assert not found.any()
        else:
            np.testing.assert_array_equal(found[level >= 0.1 * level.max()], 0)
            assert np.all(found[level < 0.05 * level.max()] == MERGE_POWER)
        inner = float(outer)
    assert (cut.merged == MERGE_POWER).mean() > 0.5 and cut_of(None).merged.max() == 0


def test_ground_that_does_not_change_with_bearing_loses_nothing_by_merged_slices():
    """Level crests far off along a line: four slices as one move a crest by its sagitta alone, and light what they did.

    Within 0.1 rad of square to the crests a line 1.5 slices aside crosses them at sec(0.1 + 1.5 slices) of the
    distance.
    """
    bed = bed_of(Corduroy(8.0, 0.8))
    rng = np.random.default_rng(3)
    azimuth, distance = rng.uniform(-0.1, 0.1, 3000), rng.uniform(20, 100, 3000)
    position = np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth)], axis=-1)
    lit, place = [], np.array([0.0, 0.0, 11.0])
    for received in (None, lambda bearing, width, zone: np.where(np.cos(bearing - np.pi) > 0.9, 1.0, 0.01)):
        terrain_occlusion = TerrainOcclusion(bed, place, StraightLaunchAngles(11.0, 20.0), farthest=120.0,
        wavelength=0.015,
                            min_profile_width=4e-3, gain_bound=received)  # fmt: skip
        seen = locate_points(terrain_occlusion, place, position)
        merged = terrain_occlusion.profiles.merged
        lit.append(terrain_occlusion.visible(
            ("D",), seen.distance, np.zeros((1, 3000)), np.full(3000, 20.0), seen.groups,
                                    on_terrain=True)[0])  # fmt: skip
        assert (merged.max() > 0) == (received is not None)
    assert 0.2 < lit[0].mean() < 0.98
    assert np.mean(lit[0] != lit[1]) < 0.04
    assert lit[1].mean() == pytest.approx(lit[0].mean(), abs=0.01)


@pytest.mark.parametrize("profile", [[[0, 1505], [8, 1500], [20, 1490]], [[0, 1490], [20, 1500]]])
def test_the_gain_of_refracted_rays_in_a_patch_is_at_most_the_bound(profile):
    """120 patches of the seabed, 20 eigenrays of each of three families in each: 1 % above the bound at most."""
    panel = {"kind": "planar", "width": 0.3, "height": 0.06}
    scenario = nominal(
        water={"profile": profile, "smoothing": 1.0}, paths={"max_reflections": 2},
        sonar={"transmit": panel, "receive": panel, "mounting": {"tilt": 0.3}},
    )  # fmt: skip
    simulator, rng, closest = build_simulator(scenario), np.random.default_rng(4), []
    ping_geometry, rays = simulator.ping_geometry(0), simulator.engine.rays
    families, depth = ("D", "S", "BS"), float(simulator.engine.scene.seabed.depth)
    gain_bound = bearing_gain_bound(ping_geometry, depth, families, rays)
    position, law = ping_geometry.transmit_position, simulator.engine.scene.seabed.law(100e3, 1500.0)
    for width in (0.005, 0.05, 0.2):
        middle = np.append(ping_geometry.first_beam_bearing, rng.uniform(-np.pi, np.pi, 39))
        near = float(rng.uniform(12, 60))
        bound = gain_bound(middle, width, (near, near * 2))
        turn, away = rng.random((2, 40, 20))
        bearing, reach = (middle[:, None] + width * (turn - 0.5)).ravel(), (near + away * near).ravel()
        points = np.column_stack([position[0] + reach * np.cos(bearing), position[1] + reach * np.sin(bearing),
                                  np.full(800, depth)])  # fmt: skip
        up = np.tile([0.0, 0.0, -1.0], (800, 1))
        seabed = Scatterers("seabed", "seabed", law, points, up, np.ones(800), np.ones(800, complex),
                            np.zeros(800, np.uint64))  # fmt: skip
        legs = rays.legs(position, seabed, families, ping_geometry.frequency)
        exists, directions = legs.spreading > 0, legs.departure.reshape(-1, 3)
        gains = [
            np.max(np.abs(beams.gain(directions)[0]).reshape(exists.shape) * exists, axis=0)
            for beams in (ping_geometry.transmit_beams, ping_geometry.bounding_receive_beams)
        ]
        found = (gains[0] * gains[1]).reshape(40, 20).max(axis=1)
        assert np.all(found <= bound * 1.01 + 1e-9)
        closest.append((found / np.maximum(bound, 1e-3)).max())
    assert max(closest) > 0.3
