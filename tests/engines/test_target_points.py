"""Density of target points, and refusal of impossible targets."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.engines import targets as target_engine
from insonify.engines.targets import FACE_CELLS, FRINGE_POINTS, target_points
from insonify.scene import solid
from insonify.scene.scene import Scene
from insonify.scene.solid import MIN_POINTS, body_triangles
from insonify.simulator import build_simulator, simulate
from oracles.few_of import few_of
from oracles.scenes import nominal

TRIO = (
    {"shape": "point", "label": "buoy", "position": (0.0, 70.0, 12.0)},
    {"shape": "drum", "label": "drum", "position": (3.0, 75.0)},
    {"shape": "box", "label": "box", "position": (-3.0, 72.0), "size": (2.0, 1.0, 1.0)},
)


def drawn(*targets, slant=0.06, even=False, seed=1, **changes):
    """Points of some targets, by their object."""
    scenario = nominal(targets=targets, **changes)
    here = build_simulator(scenario).ping_geometry(0)
    found = target_points(scenario.scene, scenario.paths, seed, here, slant, quadrature=even)
    return {points.object: points for points in found}


def test_targets_come_in_the_order_of_the_scene_and_have_their_occluder():
    """Point, solid and box: object in the scene's order; boxes come first among the occluders, points are none."""
    found = drawn(*TRIO)
    assert list(found) == ["buoy", "drum", "box"]
    assert [points.occluder for points in found.values()] == [-1, 1, 0]
    assert [points.has_random_phase for points in found.values()] == [False, True, True]


@few_of((0, 2), "slant", [0.02, 0.05, 0.2])
def test_a_face_has_three_cells_to_a_resolution_cell_at_least(slant):
    """No point of a box or a drum represents more than the square of a third of what the sonar resolves."""
    found = drawn(*TRIO, slant=slant)
    for label in ("drum", "box"):
        assert found[label].area.max() <= (slant / FACE_CELLS) ** 2 * (1 + 1e-9)


def test_a_shape_is_divided_once_for_all_scenes_in_which_it_lies(monkeypatch):
    """Even points of a manta in three poses: one division of its surface, one number of points, of its whole area."""
    monkeypatch.setattr(target_engine, "MAX_UNCULLED", 10**9)
    divided, counts = [], set()
    divide = solid.surface_cells
    monkeypatch.setattr(solid, "surface_cells", lambda body, side: divided.append(side) or divide(body, side))
    for heading, north in ((0.1, 2.0), (1.3, -4.0), (4.4, 7.0)):
        lying = {"shape": "manta", "label": "manta", "position": (north, 75.0), "base_depth": 10.0, "heading": heading}
        points = drawn(lying, slant=0.04, even=True)["manta"]
        counts.add(len(points))
        assert points.area.sum() == pytest.approx(body_triangles(nominal(targets=[lying]).targets[0]).area.sum())
    assert len(divided) == 1 and len(counts) == 1


def test_however_finely_drawn_a_target_keeps_its_surface(monkeypatch):
    """Area of the points is that of the body, for all resolutions, before those out of reach are dropped: to 0.5 %."""
    monkeypatch.setattr(target_engine, "MAX_UNCULLED", 10**9)
    for slant in (0.03, 0.1, 1.0):
        found = drawn(*TRIO, slant=slant)
        assert found["box"].area.sum() == pytest.approx(2 * 3 * 1 + 2)
        assert found["drum"].area.sum() == pytest.approx(np.pi * 0.572 * (0.851 + 0.286), rel=5e-3)


def test_a_finer_sonar_needs_as_many_more_points_as_its_cells_are_smaller():
    """With costly fringes, four times the points for half the resolution; never below the minimum."""
    wreck = {"shape": "wreck", "position": (0.0, 100.0), "size": (20.0, 6.0, 5.0)}
    counts = [len(drawn(wreck, slant=slant)["wreck"]) for slant in (0.3, 0.15)]
    assert min(counts) > FRINGE_POINTS
    assert counts[1] / counts[0] == pytest.approx(4, rel=0.01)
    ball = {"shape": "sphere", "position": (0.0, 75.0), "diameter": 0.05, "base_depth": 15.0}
    assert len(drawn(ball, slant=10.0)["sphere"]) >= MIN_POINTS


def test_fringes_are_resolved_only_while_that_is_cheap():
    """However coarse the sonar, a small solid has points for its fringes, but no more than the cheap ones."""
    count = len(drawn(TRIO[1], slant=5.0)["drum"])
    assert MIN_POINTS < count <= FRINGE_POINTS + 1
    area = body_triangles(nominal(targets=TRIO[1:2]).scene.solids[0]).area.sum()
    assert np.sqrt(area / count) < 5.0 / FACE_CELLS


def test_other_seeds_draw_other_points_and_even_points_follow_none():
    """Positions of a solid and of a box: drawn by the seed, or placed the same for all."""
    for even in (False, True):
        one, other = drawn(*TRIO, even=even, seed=1), drawn(*TRIO, even=even, seed=2)
        for label in ("drum", "box"):
            same = np.array_equal(one[label].position, other[label].position)
            assert same is even
        np.testing.assert_array_equal(one["buoy"].position, other["buoy"].position)


def test_a_target_is_drawn_alike_in_any_company():
    """A drum among others has the points that it has alone; only its row among the occluders is another."""
    alone, among = drawn(TRIO[1])["drum"], drawn(*TRIO)["drum"]
    np.testing.assert_array_equal(alone.position, among.position)
    np.testing.assert_array_equal(alone.phase, among.phase)
    assert alone.occluder == 0 and among.occluder == 1


def test_a_slice_keeps_of_a_box_what_its_plane_reaches():
    """Faces that the plane cuts, squeezed into it, with no more area than they have; points and solids stay whole."""
    box = {**TRIO[2], "position": (0.2, 72.0)}
    whole, cut = (drawn(box, TRIO[0], paths={"geometry": geometry}) for geometry in ("3d", "slice"))
    np.testing.assert_allclose(cut["box"].position[:, 0], 0, atol=1e-9)  # the plane of a sonar that looks east
    assert 0 < cut["box"].area.sum() < whole["box"].area.sum()
    np.testing.assert_array_equal(cut["buoy"].position, whole["buoy"].position)
    aside = drawn({**TRIO[2], "position": (1.01, 72.0)}, paths={"geometry": "slice"})
    assert len(aside["box"]) == 0


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ({"shape": "drum", "position": (0, 50), "base_depth": 25}, r"To sink it into the bed write burial_depth: 5 m"),
        ({"shape": "drum", "position": (0, 50), "base_depth": -1}, r"-1 m is at or above the sea surface"),
        ({"shape": "drum", "position": (0, 50), "burial_depth": 0.6}, r"buries all of it: it is 0.572 m high"),
        ({"shape": "drum", "position": (0, 50), "burial": 0.2, "burial_depth": 0.1}, r"repeats burial"),
        ({"shape": "drum", "position": (0, 50), "burial": 0.2, "base_depth": 9}, r"burial: 0.2 is for a target on the"),
        ({"shape": "point", "position": (0, 50, 21)}, r"position.2: 21 m is below the seabed .*up to 20 m"),
        ({"shape": "point", "position": (0, 50, 0)}, r"position.2: 0 m is at or above the sea surface"),
        ({"shape": "drum", "position": (0, 50), "label": "noise"}, r"label: 'noise' is taken"),
    ],
)
def test_a_target_that_cannot_be_there_is_refused_with_the_reason(target, message):
    """The message has the key, its value, the limit and the remedy."""
    with pytest.raises(ValidationError, match=message):
        Scene(seabed={"depth": 20.0}, targets=[target])


@pytest.mark.parametrize("body", [
    {"shape": "sphere", "label": "body", "position": (0, 50), "diameter": 2},
    {"shape": "box", "label": "body", "position": (0, 50), "size": (2, 2, 2), "roll": 0.1},
])  # fmt: skip
def test_a_point_in_a_solid_is_refused_and_one_beside_it_is_received(body):
    """Inside no sound reaches it; the message names the body around it, whichever comes first."""
    inside, beside = ({"shape": "point", "position": (0, east, 19.0)} for east in (50.3, 51.5))
    Scene(targets=[body, beside])
    for targets, row in (([body, inside], 1), ([inside, body], 0)):
        with pytest.raises(ValidationError, match=rf"targets\.{row}\.position: the point is inside body"):
            Scene(targets=targets)


def test_all_errors_of_a_scene_are_reported_at_once():
    """Three targets that cannot be there: one message names all three."""
    deep, high, twin = (0, 50, 30), (0, 50, -1), (0, 50, 5)
    with pytest.raises(ValidationError) as scenario:
        Scene(targets=[{"shape": "point", "label": "a", "position": place} for place in (deep, high, twin)])
    message = str(scenario.value)
    assert all(word in message for word in ("targets.0.position.2: 30 m", "targets.1.position.2: -1 m",
                                            "targets.1.label", "targets.2.label"))  # fmt: skip


DIRECT_ALONE = {"paths.max_reflections": 0, "paths.edge_diffraction": "none", "field": "incoherent"}


@pytest.mark.parametrize("edges", ["none", "knife-edge"])
def test_of_direct_paths_points_turned_away_are_left_out_and_nothing_is_lost(monkeypatch, edges):
    """Half of the points of a drum and a box face the sonar; the expected intensity is the same bit for bit.

    Edge diffraction changes the visibility of a leg, not its direction.
    """
    scenario = nominal(targets=TRIO).with_(DIRECT_ALONE | {"paths.edge_diffraction": edges})
    everything = []
    for is_direct in (True, False):
        if not is_direct:
            monkeypatch.setattr(target_engine, "_follows_direct_paths_alone", lambda *_: False)
        simulator = build_simulator(scenario)
        here, rays = simulator.ping_geometry(0), simulator.engine.rays
        found = target_points(scenario.scene, scenario.paths, 1, here, 0.15, quadrature=True, rays=rays)
        intensity = simulate(scenario, pings=[0])["intensity"].values
        everything.append(({points.object: points for points in found}, intensity))
    (facing, intensity), (all_points, expected) = everything
    assert len(facing["buoy"]) == 1
    for name in ("drum", "box"):
        assert 0.2 < len(facing[name]) / len(all_points[name]) < 0.6
        ray = here.transmit_position - facing[name].position
        assert (np.sum(ray * facing[name].normal, axis=1) > -1e-5).all()
    np.testing.assert_array_equal(intensity, expected)


def test_where_sound_bounces_points_turned_away_stay():
    """A bounce may reach a face turned away from the sonar."""
    scenario = nominal(targets=TRIO).with_(DIRECT_ALONE | {"paths.max_reflections": 1})
    simulator = build_simulator(scenario)
    here, rays = simulator.ping_geometry(0), simulator.engine.rays
    found = target_points(scenario.scene, scenario.paths, 1, here, 0.15, quadrature=True, rays=rays)
    away = [np.sum((here.transmit_position - points.position) * points.normal, axis=1) < -1e-3 for points in found[1:]]
    assert all(part.any() for part in away)
