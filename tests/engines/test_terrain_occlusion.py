"""Shadows of the seabed: where they end, what they hide, and that they are those of a ray walked step by step."""

import numpy as np
import pytest

from insonify.engines.terrain_occlusion import SEABED, fresnel_half_length, occlude_by_terrain
from insonify.propagation.families import bounce_sequence, families_up_to
from insonify.propagation.image_sources import image_legs
from insonify.records.legs import LegStatus
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.target import PointTarget
from insonify.scene.terrain import PowerLaw, RoughnessCutoff, build_terrain
from oracles.ridges import DEPTH, SONAR, Ridge, bed_of, seen_from


def lit_ground(terrain_occlusion, family, distance, azimuth=0.0):
    """Return True if the seabed of a line is seen by one family, its launch towards the mean plane."""
    tangent = terrain_occlusion.launches.launch_slope(family, distance, np.full(distance.shape, DEPTH))
    first = -1 if bounce_sequence(family).startswith("S") else 1
    sine = first * tangent / np.hypot(1, tangent)
    groups = terrain_occlusion.profile_groups(np.full(distance.shape, azimuth), distance)
    return terrain_occlusion.visible(
        (family,), distance, sine[None], np.full(distance.shape, DEPTH), groups, on_terrain=True
    )[0]


@pytest.mark.parametrize(("family", "climb"), [("D", 9.0), ("S", 31.0)])
@pytest.mark.parametrize("height", [0.5, 1.0, 2.0])
def test_the_shadow_of_a_ridge_ends_where_geometry_predicts(family, climb, height):
    """A ridge h high at 50 m under a source c above the seabed throws its shadow to 50 c / (c - h), by D and by S.

    The image of S stands 31 m above the seabed. Sampling at 6 cm cuts up to 6 cm off a crest of slope 1.
    """
    distance = np.arange(40.0, 80.0, 0.02)
    lit = lit_ground(seen_from(bed_of(Ridge(50.0, height, half_width=height))), family, distance)
    hidden = distance[~lit]
    assert hidden.min() == pytest.approx(50.0, abs=0.07)
    cut = 0.06
    ends = [50 * climb / (climb - h) for h in (height - cut, height)]
    assert ends[0] - 0.07 <= hidden.max() <= ends[1] + 0.07
    assert not lit[(distance > 50.1) & (distance < ends[0] - 0.1)].any()


def test_a_flat_bed_hides_nothing_of_itself_whatever_the_family():
    """On a flat seabed no family is cut, neither to the seabed nor to points above it."""
    terrain_occlusion = seen_from(bed_of())
    distance = np.linspace(1.0, 199.0, 800)
    for family in families_up_to(4):
        if not family.endswith("B"):
            assert lit_ground(terrain_occlusion, family, distance).all(), family
    scene = Scene(seabed={"depth": DEPTH})
    for place in ((100.0, 0.0, 15.0), (30.0, 40.0, 19.5), (1.0, 2.0, 3.0)):
        point = point_scatterer(PointTarget(position=place))
        legs = image_legs(scene, np.array([0.0, 0.0, SONAR]), point, families_up_to(4), 1e5)
        assert (
            occlude_by_terrain(legs, point, np.array([0.0, 0.0, SONAR]), terrain_occlusion).status == LegStatus.CLEAR
        ).all()


@pytest.mark.parametrize(("depth", "clear"), [(19.0, False), (18.7, False), (18.2, True), (10.0, True)])
def test_a_ridge_hides_what_is_low_behind_it_and_is_reported(depth, clear):
    """The line of sight over a 2 m crest at 50 m is 18.21 m deep at 51.5 m: what is below has occluder -2."""
    terrain_occlusion = seen_from(bed_of(Ridge(50.0, 2.0)))
    point = point_scatterer(PointTarget(position=(51.5, 0.0, depth)))
    sight = SONAR + (DEPTH - 2.0 - SONAR) * 51.5 / 50
    assert (depth < sight) == clear
    here = np.array([0.0, 0.0, SONAR])
    legs = occlude_by_terrain(
        image_legs(Scene(seabed={"depth": DEPTH}), here, point, ("D",), 1e5), point, here, terrain_occlusion
    )
    assert legs.status[0, 0] == (LegStatus.CLEAR if clear else LegStatus.OCCLUDED)
    assert legs.occluder[0, 0] == (-1 if clear else SEABED)
    assert legs.visibility[0, 0] == clear and (abs(legs.amplitude[0, 0]) > 0) == clear


@pytest.mark.parametrize(
    ("crest", "height", "cut"),
    [(40.0, 4.0, True), (40.0, 0.5, False), (90.0, 8.0, True), (120.0, 8.0, False), (120.0, 15.0, False)],
)
def test_a_bounce_is_hidden_on_either_segment(crest, height, cut):
    """B to a point at 100 m and 11 m bounces at 50 m: 1.8 m above the seabed at 40 m, 7.2 m at 90 m, ended at 120 m."""
    terrain_occlusion = seen_from(bed_of(Ridge(crest, height)))
    point = point_scatterer(PointTarget(position=(100.0, 0.0, SONAR)))
    here = np.array([0.0, 0.0, SONAR])
    legs = occlude_by_terrain(
        image_legs(Scene(seabed={"depth": DEPTH}), here, point, ("B",), 1e5), point, here, terrain_occlusion
    )
    assert (legs.status[0, 0] == LegStatus.OCCLUDED) == cut


def test_a_ridge_above_the_sonar_hides_the_surface_bounce_too():
    """S to the seabed at 60 m leaves at 27 degrees upwards: 7.9 m deep at 6 m, where a crest up to 5 m occludes it."""
    distance = np.array([60.0])
    assert lit_ground(seen_from(bed_of(Ridge(20.0, 8.0))), "S", distance).all()
    assert lit_ground(seen_from(bed_of(Ridge(10.0, 12.0))), "S", distance).all()  # above the sonar, below the ray
    assert not lit_ground(seen_from(bed_of(Ridge(6.0, 15.0))), "S", distance).any()


def test_a_bounce_off_the_bed_before_the_surface_is_cut_behind_it():
    """BS to the seabed at 150 m rises from its bounce at 27.6 m: a crest as high as the rising ray cuts it."""
    # unfolded climb 9 + 20 + 20 over 150 m: the ray leaves the seabed at 27.6 m and is 6.5 m up at 47.4 m
    distance = np.array([150.0])
    assert lit_ground(seen_from(bed_of(Ridge(47.4, 6.0))), "BS", distance).all()
    assert not lit_ground(seen_from(bed_of(Ridge(47.4, 7.0))), "BS", distance).any()


@pytest.mark.parametrize("family", ["D", "S"])
def test_the_walk_agrees_with_rays_walked_step_by_step(family):
    """On a slice's own line, 96 % of 3000 positions of a fractal bed are lit where a ray walked alone gets there.

    The walk has samples every 6 cm, the lone ray every 2 cm; what differs lies at edges.
    """
    bed = SeabedTerrain(
        DEPTH, build_terrain([PowerLaw(hurst=0.7, rms=0.2)], seed=3, cutoff=RoughnessCutoff(wavelength=0.5))
    )
    terrain_occlusion = seen_from(bed, farthest=120.0)
    zone = len(terrain_occlusion.profiles.edges) - 1
    azimuth = 2 * np.pi * (100.5 / terrain_occlusion.profiles.counts[zone])
    distance = np.linspace(terrain_occlusion.profiles.edges[-2] + 1, 119.0, 3000)
    lit = lit_ground(terrain_occlusion, family, distance, azimuth)
    image = SONAR if family == "D" else -SONAR

    def depth(r):
        return bed.depth_at(r * np.cos(azimuth), r * np.sin(azimuth))

    fine = np.arange(0.02, 120.0, 0.02)
    launch = (depth(fine) - image) / fine
    sky = np.minimum.accumulate(launch)
    alone = (depth(distance) - image) / distance <= sky[np.searchsorted(fine, distance - 0.03)] + 1e-9
    assert 0.3 < alone.mean() < 0.99
    assert np.mean(lit == alone) > 0.96


def test_a_scene_moved_as_a_whole_keeps_its_shadows():
    """Bed, sonar and points 500 m away and turned by 1 rad: every flag is the same."""
    lattice = ScattererGrid(origin=(500.0, -300.0), heading=1.0)
    distance, azimuth = np.random.default_rng(1).uniform((5, -3), (150, 3), (2000, 2)).T.copy()
    flags = []
    for frame, turn in ((ScattererGrid(), 0.0), (lattice, 1.0)):
        ground = build_terrain(
            [PowerLaw(hurst=0.7, rms=0.2)], seed=3, cutoff=RoughnessCutoff(wavelength=1.0), scatterer_grid=frame
        )
        north, east = frame.to_world(np.array([3.0]), np.array([4.0]))[0]
        terrain_occlusion = seen_from(
            SeabedTerrain(DEPTH, ground), (north, east, SONAR), farthest=150.0, min_profile_width=0.01
        )
        tangent = 9 / distance
        sine = (tangent / np.hypot(1, tangent))[None]
        flags.append(
            terrain_occlusion.visible(
                ("D",),
                distance,
                sine,
                np.full(distance.shape, DEPTH),
                terrain_occlusion.profile_groups(azimuth + turn, distance),
                on_terrain=True,
            )[0]
        )
    assert 0.2 < flags[0].mean() < 0.98
    assert np.mean(flags[0] == flags[1]) > 0.999


def test_the_mirror_of_a_bounce_is_its_first_fresnel_zone():
    """Half way on a 100 m leg at 9/50: sqrt(wavelength L / 4) / sin; half a wavelength longer by its end."""
    tangent = np.array([9 / 50])
    half = fresnel_half_length(np.array([50.0]), np.array([100.0]), tangent, 0.015)[0]
    way = [np.hypot(50 + x, 9) + np.hypot(50 - x, 9) for x in (0.0, half)]
    assert way[1] - way[0] == pytest.approx(0.015 / 2, rel=0.05)
