"""Sound bends around crests of the seabed: a half plane's field behind a ridge, nothing lost over smooth ripples."""

import numpy as np
import pytest

from insonify.engines.terrain_occlusion import occlude_by_terrain
from insonify.propagation.families import bounce_sequence, families_up_to
from insonify.propagation.image_sources import image_legs
from insonify.propagation.knife_edge import diffract_at_edges, knife_edge
from insonify.records.legs import LegStatus
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.target import PointTarget
from insonify.simulator import simulate
from oracles.fresnel import fresnel_number
from oracles.ridges import DEPTH, SONAR, Corduroy, Ridge, bed_of, seen_from
from oracles.scenes import nominal

HERE, WAVE = np.array([0.0, 0.0, SONAR]), 0.015
CREST = 50.0


def lay_on_terrain(terrain_occlusion, family, distance):
    """Return True if the seabed due north is lit by one family, and what of the pressure is left there."""
    tangent = terrain_occlusion.launches.launch_slope(family, distance, np.full(distance.shape, DEPTH))
    sine = (-1 if bounce_sequence(family).startswith("S") else 1) * tangent / np.hypot(1, tangent)
    left = np.empty((1, len(distance)), complex)
    depth, groups = np.full(distance.shape, DEPTH), terrain_occlusion.profile_groups(np.zeros(len(distance)), distance)
    lit = terrain_occlusion.visible(
        (family,), distance, sine[None], depth, groups, on_terrain=True, diffraction_factor=left
    )
    return lit[0], left[0]


def half_plane(distance, image, height, crest=CREST):
    """Fresnel number and field on a level bed behind a half plane whose edge is the crest of a ridge."""
    slope = (DEPTH - image) / distance
    stretch = np.hypot(1, slope)
    above = (image + slope * crest - (DEPTH - height)) / stretch
    number = fresnel_number(above, crest * stretch, (distance - crest) * stretch, WAVE)
    return number, knife_edge(number)


@pytest.mark.parametrize(("family", "image", "height"), [("D", SONAR, 1.0), ("D", SONAR, 2.0), ("S", -SONAR, 2.0)])
def test_behind_a_ridge_the_field_is_a_half_plane_s(family, image, height):
    """Modulus and phase by Fresnel's integral, from 3 m behind the crest to 10 m beyond the shadow, to 0.01."""
    lit, left = lay_on_terrain(seen_from(bed_of(Ridge(CREST, height))), family, distance := np.arange(53.0, 75.0, 0.1))
    number, expected = half_plane(distance, image, height)
    near = np.abs(number) < 5  # beyond it the parabola of the number errs, not the field
    assert np.all(lit == (number <= 0)) or np.abs(number[lit != (number <= 0)]).max() < 0.1
    np.testing.assert_allclose(left[near], expected[near], rtol=0, atol=0.015)
    assert near.sum() > 20


def test_half_is_left_on_the_line_nearly_all_above_it_and_a_ninth_in_the_middle():
    """-6 dB on the edge of the hard shadow, no step there, -19 dB where the number is 1.95, 1 far beyond: to 0.1 dB."""
    distance = np.arange(52.0, 180.0, 0.01)
    lit, left = lay_on_terrain(seen_from(bed_of(Ridge(CREST, 1.0))), "D", distance)
    edge = np.flatnonzero(~lit)[-1]
    level = 20 * np.log10(np.abs(left))
    assert level[edge] == pytest.approx(-6.02, abs=0.1)
    beyond = distance > 53
    assert np.abs(np.diff(left[beyond])).max() < 0.03
    number, _ = half_plane(distance, SONAR, 1.0)
    assert level[np.argmin(np.abs(number - 1.95))] == pytest.approx(-18.9, abs=0.1)
    np.testing.assert_allclose(np.abs(left[distance > 170]), 1, atol=0.05)


def test_a_level_bed_takes_nothing_from_any_family():
    """No crest, no edge: exactly 1 on the seabed and above it, for all families up to four bounces."""
    terrain_occlusion = seen_from(bed_of())
    for family in families_up_to(4):
        if not family.endswith("B"):
            assert (lay_on_terrain(terrain_occlusion, family, np.linspace(1.0, 199.0, 300))[1] == 1).all(), family
    point = point_scatterer(PointTarget(position=(100.0, 0.0, 15.0)))
    legs = image_legs(Scene(seabed={"depth": DEPTH}), HERE, point, families_up_to(4), 1e5)
    assert (occlude_by_terrain(legs, point, HERE, terrain_occlusion, soft=True).visibility == 1).all()


@pytest.mark.parametrize(("crest", "height"), [(25.0, 4.3), (25.0, 4.6), (90.0, 7.0), (90.0, 7.35)])
def test_a_bounce_is_diffracted_on_both_segments(crest, height):
    """B to 100 m and 11 m deep, past a crest on its way down or up: the half plane of the unfolded way, to 0.06."""
    point = point_scatterer(PointTarget(position=(100.0, 0.0, SONAR)))
    flat = image_legs(Scene(seabed={"depth": DEPTH}), HERE, point, ("B",), 1e5)
    terrain_occlusion = seen_from(bed_of(Ridge(crest, height, half_width=0.5 * height)))
    found = occlude_by_terrain(flat, point, HERE, terrain_occlusion, soft=True)
    stretch = np.hypot(1, 18 / 100)
    ray = 0.18 * crest if crest < 50 else 18 - 0.18 * crest  # below the sonar
    above = (ray - (DEPTH - SONAR - height)) / stretch
    number = fresnel_number(above, crest * stretch, (100 - crest) * stretch, WAVE)
    assert 0.2 < abs(float(number)) < 3
    assert found.visibility[0, 0] == pytest.approx(complex(knife_edge(number)), abs=0.06)
    assert (found.status[0, 0] == LegStatus.CLEAR) == (number < 0)


def test_smooth_ripples_cast_no_shadow_and_dim_nothing():
    """A quarter of a metre long, 13 mm high at 4 degrees: k h sin = 0.4, smooth to sound, though hard half lies dark.

    Waves of the same slope but 8 m long hide as much, and by k h sin = 12 they do cast shadows.
    """
    far = np.arange(120.0, 140.0, 0.02)
    kept = []
    for length in (0.25, 8.0):
        lit, left = lay_on_terrain(seen_from(bed_of(Corduroy(length, 0.05 * length), split=0.2)), "D", far)
        assert 0.2 < np.mean(~lit) < 0.8
        kept.append(np.mean(np.abs(left[~lit]) ** 2))
        assert np.mean(np.abs(left[lit]) ** 2) > 0.75
    assert kept[0] > 0.6 and kept[1] < 0.2


@pytest.mark.parametrize("rms", [0.05, 0.2])
def test_soft_edges_move_light_about_but_keep_the_level_of_a_rough_bed(rms):
    """Expected level of a fractal bed at 4 to 8 degrees, soft re hard: within 0.2 dB; single echoes change by more."""
    relief = {"kind": "power-law", "hurst": 0.8, "rms": rms, "outer_scale": 20.0}
    scenes = [
        nominal(
            seabed={"relief": [relief]}, field="coherent", surface={"scattering": None},
            paths={"edge_diffraction": edges, "max_reflections": 0, "scatterers_per_cell": 1.0},
            track={"window": (0.09, 0.16)},
        )
        for edges in ("none", "knife-edge")
    ]  # fmt: skip
    hard, soft = (np.abs(simulate(scene).pressure.values[0, 0]) ** 2 for scene in scenes)
    assert 10 * np.log10(soft.mean() / hard.mean()) == pytest.approx(0, abs=0.2)
    assert not np.array_equal(soft, hard) or rms < 0.1


def test_what_targets_leave_is_taken_from_what_the_ground_leaves():
    """Behind a box that stands behind a ridge: the product of both, for legs that either of them cuts."""
    up = {"kind": "power-law", "hurst": 0.8, "rms": 0.05}
    box = {"shape": "box", "position": (53.0, 0.0), "size": (0.2, 40.0, 1.0), "base_depth": 19.0}
    scene = Scene(seabed={"depth": DEPTH, "relief": [up]}, targets=[box])
    bare = Scene(seabed={"depth": DEPTH}, targets=[box])
    place = np.stack([np.arange(55.0, 70.0, 0.5), np.zeros(30), np.full(30, 19.9)], axis=-1)
    points = Scatterers(
        "target", "target", Lambert(), place, np.zeros((30, 3)), np.ones(30), np.ones(30, complex),
        np.arange(30, dtype=np.uint64),
    )  # fmt: skip
    terrain_occlusion = seen_from(bed_of(Ridge(CREST, 1.0)))
    legs = image_legs(bare, HERE, points, ("D",), 1e5)
    ground = occlude_by_terrain(image_legs(Scene(seabed={"depth": DEPTH}), HERE, points, ("D",), 1e5), points, HERE,
                         terrain_occlusion, soft=True)  # fmt: skip
    target = diffract_at_edges(legs, points, HERE, bare, WAVE)
    both = diffract_at_edges(
        occlude_by_terrain(legs, points, HERE, terrain_occlusion, soft=True), points, HERE, scene, WAVE
    )
    by_ground = both.occluder[0] == -2
    assert (both.status == LegStatus.OCCLUDED).any() and (both.status == LegStatus.CLEAR).any()
    expected = np.where(by_ground, ground.visibility[0], ground.visibility[0] * target.visibility[0])
    np.testing.assert_allclose(both.visibility[0], expected, rtol=0, atol=1e-12)
