"""Terrain occlusion of refracted rays: hidden ground, ends of shadows, and ground below the mean plane."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pytest

from insonify.engines.terrain_occlusion import TerrainOcclusion
from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation._eigenray_kernel import CAUSTICS, DELAY, SIN_ARRIVAL, SIN_LAUNCH, TURNS
from insonify.propagation.eigenray_tables import exact_rays
from insonify.propagation.families import bounce_sequence
from insonify.propagation.ray_fan import bounce_ranges, trace_fan
from insonify.propagation.refracted_launch_angles import RefractedLaunchAngles
from insonify.propagation.sound_speed_layers import sound_speed_layers
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.terrain import (
    CompositeRelief,
    PowerLaw,
    Relief,
    ReliefSum,
    RoughnessCutoff,
    TerrainSample,
    build_terrain,
)
from oracles.few_of import few_of

DEPTH, SONAR = 20.0, 11.0
PROFILES = {
    "thermocline": SoundSpeedProfile([0, 8, 14, 30], [1510, 1510, 1490, 1490]).smoothed(1.0),
    "upward": SoundSpeedProfile([0, 30], [1480, 1500]),
    "downward": SoundSpeedProfile([0, 30], [1520, 1480]),
}
FRACTAL = PowerLaw(hurst=0.8, rms=0.4, outer_scale=20.0)


@dataclass(frozen=True)
class Ridge(Relief):
    """A ridge of triangular section that runs to the east, its crest at some distance to the north."""

    crest: float
    height: float

    def sample(self, north, east):
        """Height and slope; the slope is not requested."""
        north, _ = np.broadcast_arrays(np.asarray(north, float), east)
        height = self.height * np.maximum(0.0, 1 - np.abs(north - self.crest) / self.height)
        return TerrainSample(height, np.zeros((*height.shape, 2)))

    @property
    def span(self):
        """Foot and crest."""
        return 0.0, self.height


def ridge(crest, height):
    """A seabed with one ridge."""
    return SeabedTerrain(
        DEPTH, CompositeRelief(ReliefSum((Ridge(crest, height),), ScattererGrid()), (), RoughnessCutoff(wavelength=0.5))
    )


@lru_cache(maxsize=1)
def fractal():
    """A fractal bed, whose map is drawn once."""
    return SeabedTerrain(DEPTH, build_terrain([FRACTAL], seed=4, cutoff=RoughnessCutoff(wavelength=1.0)))


def seen_from(bed, profile, farthest=170.0):
    """Terrain occlusion of refracted rays at 100 kHz, and the water down to the deepest ground."""
    water = sound_speed_layers(profile, max(bed.span[1], DEPTH), plane=DEPTH)
    launches = RefractedLaunchAngles(water, SONAR, farthest, bed.span)
    here = np.array([0.0, 0.0, SONAR])
    return TerrainOcclusion(bed, here, launches, farthest=farthest, wavelength=0.015, min_profile_width=1e-3), water


def rays_to(water, family, distance, depth):
    """The first ray of a family to each position that has not turned, and where there is one."""
    found = exact_rays(water, family, SONAR, depth, distance)
    return found.rays[:, 0], (found.count == 1) & (found.rays[:, 0, TURNS] == 0) & (found.rays[:, 0, CAUSTICS] == 0)


@pytest.mark.parametrize(
    ("name", "family"), [("thermocline", "D"), ("upward", "D"), ("downward", "D"), ("upward", "S")]
)
def test_the_shadow_of_a_ridge_ends_where_the_ray_over_its_crest_comes_down(name, family):
    """A 1.2 m ridge at 50 m: the ray that grazes the crest is traced on, and reaches the seabed where the light begins.

    Sampling at 6 cm cuts up to 6 cm off the crest: the light begins between the rays over either height.
    """
    profile, height = PROFILES[name], 1.2
    terrain_occlusion, water = seen_from(ridge(50.0, height), profile)
    distance = np.arange(45.0, 90.0, 0.02)
    ray, there = rays_to(water, family, distance, np.full(distance.shape, DEPTH))
    groups = terrain_occlusion.profile_groups(np.zeros(distance.size), distance)
    lit = terrain_occlusion.visible((family,), distance, ray[None, :, SIN_LAUNCH], np.full(distance.shape, DEPTH),
    groups,
                           on_terrain=True)[0]  # fmt: skip
    ends = []
    for top in (height - 0.06, height):
        over, _ = rays_to(water, family, np.array([50.0]), np.array([DEPTH - top]))
        traced = trace_fan(water, SONAR, np.arcsin(over[:, SIN_LAUNCH]), max_range=120.0, max_bounces=2, step=0.05)
        down = (traced.depth >= DEPTH - 1e-9) & (traced.range > 50.0)
        ends.append(traced.range[down].min())
    behind = (distance > 50.2) & there
    assert ends[0] - 0.1 <= distance[behind & ~lit].max() <= ends[1] + 0.1
    assert not lit[behind & (distance < ends[0] - 0.1)].any()


@pytest.mark.parametrize("name", list(PROFILES))
@few_of((0, 3), "family", ["D", "S", "B", "BS", "SB"])
def test_skylines_are_right_about_rays_that_are_walked_step_by_step(name, family):
    """200 points close above fractal ground, 0.4 m rms, each ray traced by the fan: 98 of 100 are seen alike.

    The fan knows nothing of launches, terrain_occlusion or tables. What is left are rays that graze the seabed, for the
    skyline follows the middle of a slice; with bounces 95 of 100, for the mirror's zone ends at a sample.
    """
    bed = fractal()
    terrain_occlusion, water = seen_from(bed, PROFILES[name], farthest=140.0)
    draw = np.random.default_rng(1)
    distance, azimuth = draw.uniform(40.0, 140.0, 200), draw.uniform(0, 0.05, 200)
    on_bed = bed.depth_at(distance * np.cos(azimuth), distance * np.sin(azimuth))
    depth = on_bed - draw.uniform(0.05, 0.5, 200)
    ray, there = rays_to(water, family, distance, depth)
    there &= np.isfinite(ray[:, SIN_LAUNCH])
    distance, azimuth, depth, sine = distance[there], azimuth[there], depth[there], ray[there, SIN_LAUNCH]
    expected = terrain_occlusion.visible(
        (family,), distance, sine[None], depth, terrain_occlusion.profile_groups(azimuth, distance)
    )[0]
    seen = [_walked(bed, PROFILES[name], family, *row) for row in zip(distance, azimuth, sine, strict=True)]
    assert len(seen) > 80
    assert np.mean(expected == seen) > (0.98 if family in ("D", "S") else 0.95)
    if family in ("D", "B"):
        assert 0.05 < np.mean(seen) < 0.95


def _walked(bed, profile, family, distance, azimuth, sine):
    """Return True if one ray clears the seabed on its own bearing; near its bottom bounces the seabed is the mirror."""
    string = bounce_sequence(family)
    water = sound_speed_layers(profile, DEPTH if "B" in string else bed.span[1])
    traced = trace_fan(water, SONAR, [np.arcsin(sine)], max_range=distance, max_bounces=len(string), step=0.05)
    x = np.arange(0.05, distance - 0.05, 0.05)
    z = np.interp(x, traced.range, traced.depth)  # of straight pieces the fan has the ends only
    ground = bed.depth_at(x * np.cos(azimuth), x * np.sin(azimuth))
    requested = np.ones(x.shape, bool)
    if "B" in string:
        speed = np.interp([SONAR, DEPTH], water.depth, water.speed)
        slope = np.sqrt(max((speed[0] / speed[1]) ** 2 / (1 - sine**2) - 1, 1e-12))  # at the plane
        hops = bounce_ranges(water, SONAR, np.array([sine]), len(string), max_range=distance)[:, 0]
        for letter, hop in zip(string, hops, strict=True):
            if letter == "B":
                half = np.sqrt(0.015 * hop * (1 - hop / distance) * np.hypot(1, slope)) * np.hypot(1, slope) / slope
                requested &= np.abs(x - hop) > half
    return not np.any((z > ground)[requested])


def test_rays_go_on_below_the_mean_plane_as_smoothly_as_above_it():
    """Over the plane, D, S and BS have delays whose slope with depth is sin(arrival) / c on both sides: 1e-6 of it.

    Bounces stay on the plane; what rises from it gets nowhere below it.
    """
    water = sound_speed_layers(PROFILES["thermocline"], 21.0, plane=DEPTH)
    speed = np.interp(DEPTH, water.depth, water.speed)
    step, ranges = 0.01, np.full(3, 80.0)
    for family in ("D", "S", "BS"):
        rays = exact_rays(water, family, SONAR, DEPTH + step * np.array([-1.0, 0.0, 1.0]), ranges).rays[:, 0]
        for side in (0, 1):
            slope = (rays[side + 1, DELAY] - rays[side, DELAY]) / step
            middle = (rays[side + 1, SIN_ARRIVAL] + rays[side, SIN_ARRIVAL]) / 2
            assert slope == pytest.approx(middle / speed, rel=1e-5), family
    assert exact_rays(water, "B", SONAR, np.array([20.5]), np.array([80.0])).count[0] == 0
    flat = exact_rays(
        sound_speed_layers(PROFILES["thermocline"], DEPTH), "BS", SONAR, np.array([19.0]), np.array([80.0])
    )
    deep = exact_rays(water, "BS", SONAR, np.array([19.0]), np.array([80.0]))
    np.testing.assert_allclose(deep.rays[0, 0], flat.rays[0, 0], rtol=1e-12)
