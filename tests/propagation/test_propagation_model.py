"""Claims about propagation models: legs, reach and departure cones, with straight or refracted rays.

The same claims hold for both kinds of rays; where sound speed hardly changes both give the same.
"""

import numpy as np
import pytest

from insonify.propagation.families import families_reaching, families_up_to
from insonify.propagation.propagation_model import RayDomain, departure_cones
from insonify.propagation.propagation_model_choice import propagation_model_for
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

DEPTH, SONAR = 20.0, np.array([3.0, -4.0, 11.0])
WATERS = {
    "still": {"sound_speed": 1500.0},
    "nearly still": {"profile": [[0, 1500.0], [20, 1500.000001]]},
    "falling": {"profile": [[0, 1510.0], [20, 1495.0]]},
    "thermocline": {"profile": [[0, 1510.0], [8, 1510.0], [14, 1490.0], [20, 1490.0]]},
    "channel": {"profile": [[0, 1505.0], [11, 1495.0], [20, 1501.0]]},
}
FARTHEST = 200.0


def rays(name, reflection=0.35):
    """The rays of a water over a flat bed."""
    scene = Scene(water=WATERS[name], seabed={"depth": DEPTH, "reflection": reflection})
    return propagation_model_for(scene, RayDomain((11.0,), False, (DEPTH, DEPTH), FARTHEST + 5))


def points(place, boundary="target"):
    """Points that scatter alike in all directions."""
    place = np.atleast_2d(np.asarray(place, float))
    n = len(place)
    normal = np.zeros((n, 3)) if boundary == "target" else np.tile([0.0, 0.0, -1.0], (n, 1))
    return Scatterers(
        boundary, boundary, PointTargetLaw(0.0), place, normal, np.ones(n), np.ones(n, complex),
        np.arange(n, dtype=np.uint64), has_random_phase=False,
    )  # fmt: skip


def around(count=200, seed=1, depth=(1.0, 19.0)):
    """Places about the sonar, some of them near."""
    rng = np.random.default_rng(seed)
    bearing, distance = rng.uniform(0, 2 * np.pi, count), rng.uniform(5, 150, count)
    return np.column_stack([
        SONAR[0] + distance * np.cos(bearing), SONAR[1] + distance * np.sin(bearing), rng.uniform(*depth, count),
    ])  # fmt: skip


@pytest.mark.parametrize("name", WATERS)
def test_directions_are_unit_vectors_and_point_along_the_bearing(name):
    """At both ends: of length one, and in the vertical plane of sonar and point."""
    place = around()
    legs = rays(name).legs(SONAR, points(place), families_up_to(2), 100e3)
    there = legs.visibility > 0
    ahead = place[:, :2] - SONAR[:2]
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    for way in (legs.departure, legs.arrival):
        np.testing.assert_allclose(np.linalg.norm(way[there], axis=-1), 1, atol=1e-9)
        level = np.broadcast_to(ahead, way[..., :2].shape)
        across = way[..., 0] * level[..., 1] - way[..., 1] * level[..., 0]
        assert np.abs(across[there]).max() < 1e-9


@pytest.mark.parametrize("name", WATERS)
def test_sound_leaves_towards_the_first_boundary_of_its_family(name):
    """S families leave upwards and B families downwards, unless they turn before; the last bounce decides the end."""
    legs = rays(name).legs(SONAR, points(around()), families_up_to(2), 100e3)
    for row, family in enumerate(legs.families):
        there = legs.visibility[row] > 0
        if family == "D" or name in ("thermocline", "channel"):
            continue
        first, last = (-1 if letter == "S" else 1 for letter in (family[0], family[-1]))
        assert np.all(legs.departure[row, there, 2] * first > 0)
        assert np.all(legs.arrival[row, there, 2] * last < 0)


@pytest.mark.parametrize("name", WATERS)
def test_the_direct_path_is_the_shortest_in_time(name):
    """Fermat: no bounced ray that there is comes before the earliest direct one."""
    legs = rays(name).legs(SONAR, points(around()), families_up_to(2), 100e3)
    delay = np.where(legs.visibility > 0, legs.delay, np.inf)
    direct = np.min([delay[row] for row, f in enumerate(legs.families) if f == "D"], axis=0)
    lit = np.isfinite(direct)
    for row, family in enumerate(legs.families):
        if family != "D":
            assert np.all(delay[row][lit] >= direct[lit] - 1e-12)


@pytest.mark.parametrize("name", WATERS)
def test_length_and_delay_go_by_the_speeds_of_the_water(name):
    """Length over delay lies between the slowest and the fastest speed, and no path is shorter than a straight one."""
    place = around()
    refracted = rays(name)
    legs = refracted.legs(SONAR, points(place), families_up_to(2), 100e3)
    there = legs.visibility > 0
    speed = legs.length[there] / legs.delay[there]
    water = refracted.scene.water
    assert water.min_sound_speed - 1e-6 <= speed.min() and speed.max() <= water.max_sound_speed + 1e-6
    straight = np.broadcast_to(np.linalg.norm(place - SONAR, axis=1), legs.length.shape)
    assert np.all(legs.length[there] >= straight[there] - 1e-9)


@pytest.mark.parametrize("name", ["falling", "thermocline", "channel"])
def test_the_scene_may_be_turned_and_moved(name):
    """Only distance and depth matter: sonar and points moved and turned together have the same legs."""
    place, turn = around(60), 1.1
    c, s = np.cos(turn), np.sin(turn)
    matrix, away = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([1000.0, -300.0, 0])
    refracted = rays(name)
    here = refracted.legs(SONAR, points(place), ("D", "S"), 100e3)
    there = refracted.legs(matrix @ SONAR + away, points(place @ matrix.T + away), ("D", "S"), 100e3)
    np.testing.assert_array_equal(here.status, there.status)
    lit = here.visibility > 0
    np.testing.assert_allclose(there.delay[lit], here.delay[lit], atol=2e-12)
    np.testing.assert_allclose(np.abs(there.amplitude[lit]), np.abs(here.amplitude[lit]), rtol=1e-6)
    np.testing.assert_allclose(there.departure[lit], here.departure[lit] @ matrix.T, atol=1e-8)


def test_nearly_isovelocity_water_has_the_paths_of_isovelocity_water():
    """A millionth of a metre per second over 20 m: legs, reach and cones of images."""
    still, nearly = rays("still"), rays("nearly still")
    place = around()
    one, other = (r.legs(SONAR, points(place), families_up_to(2), 100e3) for r in (still, nearly))
    assert one.families == other.families
    np.testing.assert_allclose(other.delay, one.delay, rtol=2e-9)
    np.testing.assert_allclose(other.amplitude, one.amplitude, rtol=1e-5, atol=1e-9)
    for which in ("departure", "arrival"):
        np.testing.assert_allclose(getattr(other, which), getattr(one, which), atol=1e-5)
    arguments = ((11.0, 11.0), DEPTH, ("D", "S"), (0.03, 0.1), 0.0)
    a, b = still.reachable_range(*arguments), nearly.reachable_range(*arguments)
    assert b.farthest == pytest.approx(a.farthest, abs=1.0) and b.nearest == pytest.approx(a.nearest, abs=2.0)
    assert b.nearest <= a.nearest and b.farthest >= a.farthest


@pytest.mark.parametrize("name", WATERS)
def test_no_ray_leaves_outside_the_cone_that_was_promised(name):
    """Rays to places within a radius of a middle leave within the margin of the cone's axis."""
    refracted, rng = rays(name), np.random.default_rng(7)
    middle = around(40, seed=3)[:, :2]
    radius = rng.uniform(0.2, 4, 40)
    for family in families_reaching("seabed", ("D", "S", "BS")):
        cones = departure_cones(refracted, family, SONAR, middle, radius, DEPTH)
        for _ in range(6):
            shift = rng.normal(size=(40, 2))
            shift *= (radius * rng.random(40) / np.linalg.norm(shift, axis=1))[:, None]
            bed = points(np.column_stack([middle + shift, np.full(40, DEPTH)]), "seabed")
            legs = refracted.legs(SONAR, bed, (family,), 100e3)
            for row in range(len(legs.families)):
                there = legs.visibility[row] > 0
                angle = np.arccos(np.clip(np.sum(legs.departure[row] * cones.axis, axis=-1), -1, 1))
                assert np.all(cones.exists[there])
                assert np.all(angle[there] <= cones.half_angle[there] + 1e-6)


@pytest.mark.parametrize("rise", [0.5, 3.0])
@pytest.mark.parametrize("name", ["still", "thermocline", "channel"])
def test_ground_that_may_rise_widens_every_promise(name, rise):
    """The reachable range grows at both ends, and cones still hold the rays to ground that stands higher."""
    refracted = rays(name)
    arguments = ((11.0, 11.0), DEPTH, ("D", "S"), (0.03, 0.09), 0.0)
    flat, raised = refracted.reachable_range(*arguments), refracted.reachable_range(*arguments, relief_height=rise)
    assert raised.nearest <= flat.nearest and raised.farthest >= flat.farthest - 1e-9
    middle, radius = around(30, seed=9)[:, :2], np.full(30, 1.0)
    cones = departure_cones(refracted, "D", SONAR, middle, radius, DEPTH, relief_height=rise)
    high = points(np.column_stack([middle, np.full(30, DEPTH - rise)]), "seabed")
    legs = refracted.legs(SONAR, high, ("D",), 100e3)
    for row in range(len(legs.families)):
        there = (legs.status[row] == 0) & cones.exists
        angle = np.arccos(np.clip(np.sum(legs.departure[row] * cones.axis, axis=-1), -1, 1))
        assert np.all(angle[there] <= cones.half_angle[there] + 1e-6)


@pytest.mark.parametrize("name", ["still", "falling", "thermocline"])
def test_all_that_is_received_in_a_window_lies_within_reach(name):
    """No leg to the bed whose delay falls into the window ends nearer or farther than reach states."""
    refracted = rays(name)
    first, last = 0.04, 0.08
    reach = refracted.reachable_range((11.0, 11.0), DEPTH, ("D", "S"), (first, last), 0.0)
    distance = np.linspace(1, 180, 2000)
    bed = points(np.column_stack([SONAR[0] + distance, np.full(2000, SONAR[1]), np.full(2000, DEPTH)]), "seabed")
    legs = refracted.legs(SONAR, bed, ("D", "S"), 100e3)
    received = ((legs.delay >= first) & (legs.delay <= last) & (legs.visibility > 0)).any(axis=0)
    assert distance[received].min() >= reach.nearest - 1e-9 and distance[received].max() <= reach.farthest + 1e-9


def test_a_window_before_the_first_echo_reaches_nothing():
    """Nothing of the bed can be received before the sound has been there."""
    for name in ("still", "thermocline"):
        assert rays(name).reachable_range((11.0, 11.0), DEPTH, ("D",), (0.0, 0.003), 0.0).farthest < 0
