"""Points and their path pairs: scattering strengths, image sources, and targets as points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.engines.targets import target_points
from insonify.engines.terrain_occlusion import fresnel_half_length
from insonify.engines.tracer.image_legs import image_legs, reflected_intensity
from insonify.propagation.families import families_up_to, image_depth
from insonify.recent_results import RecentResults
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.simulator import build_simulator
from oracles.scenes import nominal, point

DEPTH = 20.0
WALL = {"shape": "box", "label": "wall", "position": (0.0, 60.0), "size": (6.0, 1.0, 2.0)}
BALL = {"shape": "sphere", "label": "ball", "diameter": 0.6, "position": (3.0, 40.0)}
LAMBERT = Lambert(-27.0)


def bed_points(count=60, seed=1, area=0.01):
    """Points of a flat Lambert bed, before the sonar."""
    rng = np.random.default_rng(seed)
    position = np.column_stack([rng.uniform(-5, 5, count), rng.uniform(20, 120, count), np.full(count, DEPTH)])
    return Scatterers(
        "seabed", "seabed", LAMBERT, position, np.tile([0.0, 0.0, -1.0], (count, 1)), np.full(count, area),
        np.ones(count, complex), np.arange(count, dtype=np.uint64),
    )  # fmt: skip


def evaluate(scatterers, order=2, **changes):
    """Pairs of some points by name of the pair, and the pairs themselves."""
    simulator = build_simulator(nominal(paths={"max_reflections": order}, **changes))
    pairs = simulator.engine.path_pairs(simulator.ping_geometry(0), scatterers)
    return dict(zip(pairs.names(), pairs.strength, strict=True)), pairs


def points_of(*targets, slant=0.15, even=False, seed=1, **changes):
    """Points of the targets of a scene at its first ping."""
    simulator = build_simulator(nominal(targets=targets, **changes))
    engine = simulator.engine
    return target_points(engine.scene, engine.path_settings, seed, simulator.ping_geometry(0), slant, quadrature=even)


def test_a_pair_off_a_lambert_bed_has_its_closed_form():
    """Strength is the root of mu sin(in) sin(out) area; sines are those of images: height over length."""
    bed = bed_points()
    found, _ = evaluate(bed)
    across = np.linalg.norm(bed.position[:, :2], axis=1)
    climb = {"D": 9.0, "S": 31.0, "BS": 49.0}
    assert set(found) == {(i, j) for i in climb for j in climb}
    for (i, j), strength in found.items():
        sines = [climb[name] / np.hypot(across, climb[name]) for name in (i, j)]
        np.testing.assert_allclose(strength, np.sqrt(10**-2.7 * sines[0] * sines[1] * 0.01), rtol=1e-9)


def test_out_and_back_may_be_exchanged():
    """With both ends at one position pair (i, j) is as strong as (j, i), whatever the points lie on."""
    solid = points_of(BALL, slant=0.3)[0]
    for scatterers in (bed_points(), solid):
        found, _ = evaluate(scatterers)
        for (i, j), strength in found.items():
            np.testing.assert_allclose(strength, found[j, i], rtol=1e-9)


def test_points_scatter_alone_as_they_do_in_company():
    """Every third point of a block: its legs and strengths to the last bit those within the block."""
    bed = bed_points(90)
    (_, whole), (_, part) = evaluate(bed), evaluate(bed.take(slice(0, 90, 3)))
    np.testing.assert_array_equal(part.strength, whole.strength[:, ::3])
    np.testing.assert_array_equal(part.transmit_legs.delay, whole.transmit_legs.delay[:, ::3])
    np.testing.assert_array_equal(part.transmit_legs.amplitude, whole.transmit_legs.amplitude[:, ::3])


def test_more_families_leave_the_others_alone():
    """Pairs of order 1 are among those of order 3, unchanged."""
    few, many = evaluate(bed_points(), order=1)[0], evaluate(bed_points(), order=3)[0]
    assert set(few) < set(many)
    for names, strength in few.items():
        np.testing.assert_array_equal(strength, many[names])


def test_four_times_the_area_scatters_twice_the_pressure():
    """Strength is a root of the area; legs do not depend on it."""
    one, four = evaluate(bed_points(area=0.01))[1], evaluate(bed_points(area=0.04))[1]
    np.testing.assert_allclose(four.strength, 2 * one.strength, rtol=1e-12)
    np.testing.assert_array_equal(four.transmit_legs.delay, one.transmit_legs.delay)


families_requested = st.sampled_from(families_up_to(4))
depths = st.floats(0.5, 19.5)


@given(families_requested, depths, depths, st.floats(1, 100), st.floats(-np.pi, np.pi))
@settings(max_examples=60, deadline=None)
def test_a_path_is_reciprocal(family, one, other, distance, bearing):
    """By SB one way is by BS the other: as long, as strong, directions turned round."""
    scene = Scene(seabed={"depth": DEPTH, "reflection": 0.35})
    here = np.array([0.0, 0.0, one])
    there = np.array([distance * np.cos(bearing), distance * np.sin(bearing), other])
    out = image_legs(scene, here, there[None], family, 0.015)
    back = image_legs(scene, there, here[None], "D" if family == "D" else family[::-1], 0.015)
    assert out.length[0] == pytest.approx(back.length[0], rel=1e-12)
    np.testing.assert_allclose(out.departure, -back.arrival, atol=1e-12)
    np.testing.assert_allclose(out.arrival, -back.departure, atol=1e-12)
    assert out.intensity[0] == pytest.approx(back.intensity[0], rel=1e-12)


@given(families_requested, depths)
def test_mirrors_undo_themselves(family, depth):
    """An image mirrored by the same mirrors in reverse is the sonar; S and B together shift it by twice the depth."""
    back = "D" if family == "D" else family[::-1]
    assert image_depth(back, image_depth(family, depth, DEPTH), DEPTH) == pytest.approx(depth, abs=1e-9)
    assert image_depth("SB", depth, DEPTH) - depth == pytest.approx(2 * DEPTH)
    assert image_depth("BS", depth, DEPTH) - depth == pytest.approx(-2 * DEPTH)


def test_every_bounce_takes_the_same_share_again():
    """Pressure 0.35 at the seabed: intensity 0.35^2 for each B, nothing for S."""
    scene = Scene(seabed={"depth": DEPTH, "reflection": 0.35})
    for family in families_up_to(5):
        left = reflected_intensity(scene, family, np.array([0.1, 0.7]))
        np.testing.assert_allclose(left, 0.35 ** (2 * family.count("B")), rtol=1e-12)


@given(st.floats(0.01, 0.99), st.floats(1, 500), st.floats(0.02, 3), st.floats(0.002, 0.1))
def test_a_mirror_is_as_large_seen_from_either_end(share, distance, tangent, wavelength):
    """The Fresnel zone of a bounce: the same for both ends, none at an end, half a wave at its edge."""

    def half(part):
        return float(fresnel_half_length(np.array(part * distance), np.array(distance), np.array(tangent), wavelength))

    assert half(share) == pytest.approx(half(1 - share), rel=1e-9)
    assert half(0.0) == half(1.0) == 0.0
    assert half(share) <= half(0.5) * (1 + 1e-12)
    # the way over a point off the mirror is longer by this, to second order
    stretch = np.sqrt(1 + tangent**2)
    r1, r2, sine = share * distance * stretch, (1 - share) * distance * stretch, tangent / stretch
    longer = (half(share) * sine) ** 2 / 2 * (1 / r1 + 1 / r2)
    assert longer == pytest.approx(wavelength / 2, rel=1e-9)


def test_the_results_requested_longest_ago_are_forgotten():
    """Three are kept and made once each; a fourth takes the place of the one requested longest ago."""
    store, made = RecentResults(3), []
    for key in ("a", "b", "a", "c", "d", "b", "a"):
        store.get(key, lambda key=key: made.append(key) or key)
    assert made == ["a", "b", "c", "d", "b", "a"]


def test_targets_come_in_their_order_and_a_point_is_one():
    """Three kinds of target, each under its own label."""
    found = points_of(WALL, point(0.0, 30.0, 15.0, label="mark"), BALL)
    assert [part.object for part in found] == ["wall", "mark", "ball"]
    assert len(found[1]) == 1 and found[1].area[0] == 1.0
    np.testing.assert_array_equal(found[1].position, [[0.0, 30.0, 15.0]])


@pytest.mark.parametrize("even", [False, True])
def test_points_stand_for_the_whole_surface(even):
    """A box on the seabed: its area without the base. A ball: 4 pi a^2, less what its triangles cut off, under 3 %.

    Of a body with more than 20,000 points only those on faces towards the sonar are kept, so these have fewer.
    """
    wall, ball = points_of(WALL, BALL, even=even, slant=0.6)
    assert wall.area.sum() == pytest.approx(6 * 1 + 2 * 2 * (6 + 1), rel=1e-9)
    assert ball.area.sum() == pytest.approx(4 * np.pi * 0.3**2, rel=0.03)


def test_a_finer_pulse_draws_finer_faces():
    """A quarter of the range resolution, cells of a fourteenth: none is larger than a third of it each way.

    A sixteenth, but for rounding to whole cells of a face. The front and the top, towards the sonar, are whole in both.
    """
    here = build_simulator(nominal()).ping_geometry(0).transmit_position
    coarse, fine = points_of(WALL, slant=0.6)[0], points_of(WALL, slant=0.15)[0]
    assert coarse.area.max() > 14 * fine.area.max()
    for part, slant in ((coarse, 0.6), (fine, 0.15)):
        assert part.area.max() <= (slant / 3) ** 2 * (1 + 1e-9)
        towards = np.sum((here - part.position) * part.normal, axis=1) > 0
        assert part.area[towards].sum() == pytest.approx(6 * 2 + 6 * 1, rel=1e-9)


def test_targets_do_not_depend_on_one_another():
    """A ball alone and beside others has the same points and phases; another seed has others."""
    alone, beside = points_of(BALL)[0], points_of(BALL, WALL)[0]
    np.testing.assert_array_equal(alone.position, beside.position)
    np.testing.assert_array_equal(alone.phase, beside.phase)
    assert np.mean(points_of(BALL, seed=2)[0].phase == alone.phase) < 0.01


def test_a_solid_too_far_for_the_window_costs_nothing():
    """Its first echo after the window's end: no points; within it: all of them."""
    near, far = ({**BALL, "position": (0.0, east)} for east in (60.0, 200.0))
    window = {"window": (0.05, 0.12)}
    assert len(points_of(near, track=window)) == 1
    assert points_of(far, track=window) == []
