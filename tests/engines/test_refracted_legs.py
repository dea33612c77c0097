"""Claims about legs in layered water: they are images where the water is nearly one, and they bend where it is not."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import insonify
from insonify.explanation.sample_report import explain_sample
from insonify.propagation.eigenray_table import TableError, TableWarning
from insonify.propagation.eigenray_tables import exact_rays
from insonify.propagation.families import families_up_to
from insonify.propagation.image_sources import image_legs
from insonify.propagation.propagation_model import RayDomain, departure_cones
from insonify.propagation.refracted_rays import refracted_rays
from insonify.records.legs import LegStatus
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.simulator import build_simulator
from oracles.scenes import nominal, point

DEPTH = 20.0
THERMO = [[0.0, 1510.0], [8.0, 1510.0], [14.0, 1490.0], [20.0, 1490.0]]
NEARLY = [[0.0, 1500.0], [20.0, 1500.0 + 20e-9]]
CAUSTIC = [[0.0, 1510.0], [4.0, 1510.0], [8.0, 1490.0], [20.0, 1490.0]]
BOXES = (
    {"shape": "box", "label": "near", "position": (2.0, 60.0), "size": (6.0, 4.0, 3.0), "heading": 0.4},
    {"shape": "box", "label": "floating", "position": (-1.0, 90.0), "size": (5.0, 8.0, 2.0), "base_depth": 7.0},
)


def scene(profile, targets=()):
    """Twenty metres of water over a sand bed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # corners of these profiles are meant
        return Scene(water={"profile": profile}, seabed={"depth": DEPTH, "reflection": "medium sand"}, targets=targets)


def rays(profile, targets=(), farthest=200.0):
    """The curved rays of such water."""
    return refracted_rays(scene(profile, targets), RayDomain((11.0,), False, (0.0, DEPTH), farthest))


def points(position, normal=(0.0, 0.0, 0.0), boundary="target", occluder=-1):
    """Points that scatter in all directions, unless they have a normal."""
    position = np.atleast_2d(np.asarray(position, float))
    n = len(position)
    return Scatterers(
        boundary, boundary, PointTargetLaw(0.0), position, np.tile(np.asarray(normal, float), (n, 1)), np.ones(n),
        np.ones(n, complex), np.arange(n, dtype=np.uint64), False, occluder,
    )  # fmt: skip


def places(n, seed):
    """Anywhere in the water up to 150 m away."""
    random = np.random.default_rng(seed)
    return np.column_stack([random.uniform(-30, 30, n), random.uniform(-20, 145, n), random.uniform(0.1, 19.9, n)])


def test_where_the_speed_hardly_changes_rays_are_straight():
    """A gradient of 1e-9 1/s gives the legs of images: delays to 1e-9, amplitudes to 2e-6; no box moves."""
    sonar, order = np.array([0.3, -1.0, 11.0]), families_up_to(4)
    refracted = rays(NEARLY, BOXES).legs(sonar, points(places(400, 3)), order, 100e3)
    world = Scene(seabed={"depth": DEPTH, "reflection": "medium sand"}, targets=BOXES)
    straight = image_legs(world, sonar, points(places(400, 3)), order, 100e3)
    assert refracted.families == straight.families and not any(refracted.branch)
    np.testing.assert_array_equal(refracted.status, straight.status)
    np.testing.assert_array_equal(refracted.occluder, straight.occluder)
    assert {LegStatus.CLEAR, LegStatus.OCCLUDED} == set(np.unique(refracted.status))
    np.testing.assert_allclose(refracted.delay, straight.delay, rtol=1e-9)
    np.testing.assert_allclose(refracted.amplitude, straight.amplitude, rtol=2e-6)
    for name in ("departure", "arrival", "grazing_sine", "length"):
        np.testing.assert_allclose(getattr(refracted, name), getattr(straight, name), rtol=1e-8, atol=1e-8)


def test_a_profile_of_one_speed_is_no_layered_water():
    """Its ping is, bit for bit, that of the plain speed."""
    few = {"track": {"window": (0.2, 0.202)}, "paths": {"max_reflections": 1}}
    flat = nominal(water={"noise_level_db": None, "profile": [[0, 1500], [20, 1500]]}, **few)
    plain = nominal(water={"noise_level_db": None, "sound_speed": 1500}, **few)
    np.testing.assert_array_equal(insonify.simulate(flat).pressure.values, insonify.simulate(plain).pressure.values)


def test_the_direct_path_ends_where_rays_have_turned_away():
    """Thermocline, sonar at 11 m, seabed at 20 m: direct legs up to 162 m and none beyond; S and BS go on."""
    away = np.arange(150.0, 180.0, 0.25)
    bed = points(np.column_stack([0 * away, away, np.full(away.size, DEPTH)]), (0, 0, -1), "seabed")
    legs = rays(THERMO).legs(np.array([0.0, 0.0, 11.0]), bed, families_up_to(2), 100e3)
    direct = legs.status[legs.families.index("D")]
    assert away[direct == LegStatus.CLEAR].max() == pytest.approx(162, abs=0.5)
    assert set(direct[away > 163]) <= {LegStatus.SHADOW, LegStatus.TURNED, LegStatus.BEYOND_CRITICAL}
    assert np.all(legs.amplitude[legs.families.index("D"), away > 163] == 0)
    for family in ("S", "BS"):
        assert np.all(legs.status[legs.families.index(family)] == LegStatus.CLEAR)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([THERMO, CAUSTIC, [[0.0, 1480.0], [20.0, 1486.0]]]))
def test_legs_are_reciprocal(seed, profile):
    """Sonar and point change positions: as many rays, equal delays and amplitudes, directions turned round."""
    random = np.random.default_rng(seed)
    one, other = (np.array([0.0, away, random.uniform(0.5, 19.5)]) for away in (0.0, random.uniform(5, 120)))
    water = rays(profile)
    for family in families_up_to(3):
        # the family from the other end
        backwards = family if family == "D" else family[::-1]
        forth = water.legs(one, points(other), (family,), 100e3)
        back = water.legs(other, points(one), (backwards,), 100e3)
        forth_rows, back_rows = (
            np.argsort(np.where(legs.status[:, 0] == 0, legs.delay[:, 0], np.inf)) for legs in (forth, back)
        )
        assert len(forth_rows) == len(back_rows)
        for a, b in zip(forth_rows, back_rows, strict=True):
            assert (forth.status[a, 0] == 0) == (back.status[b, 0] == 0)
            if forth.status[a, 0] == 0:
                assert forth.delay[a, 0] == pytest.approx(back.delay[b, 0], abs=1e-12)
                assert forth.amplitude[a, 0] == pytest.approx(back.amplitude[b, 0], rel=1e-5)
                np.testing.assert_allclose(forth.departure[a, 0], -back.arrival[b, 0], atol=1e-7)


def refracted_paths(profile, sonar, ways, bounce, farthest, step=0.1):
    """Rays followed in small steps of length by Runge and Kutta's rule: distances and depths, (steps, rays) each."""
    depth, speed = np.array(profile).T

    def slope(state):
        c = np.interp(state[1], depth, speed)
        g = (np.interp(state[1] + 1e-7, depth, speed) - np.interp(state[1] - 1e-7, depth, speed)) / 2e-7
        return np.array([np.cos(state[2]), np.sin(state[2]), -g / c * np.cos(state[2])])

    count = len(ways)
    state = np.array([np.zeros(count), np.full(count, sonar[2]), np.arcsin(ways[:, 2])])
    path = [state[:2].copy()]
    while state[0].min() < farthest:
        a = slope(state)
        b = slope(state + step / 2 * a)
        c = slope(state + step / 2 * b)
        d = slope(state + step * c)
        state = state + step / 6 * (a + 2 * b + 2 * c + d)
        out = (state[1] < 0) | (state[1] > DEPTH) & bounce
        state[1, out] = np.where(state[1, out] < 0, -state[1, out], 2 * DEPTH - state[1, out])
        state[2, out] *= -1
        path.append(state[:2].copy())
    return np.transpose(path, (1, 0, 2))


def test_a_box_cuts_the_rays_that_run_into_it():
    """A box cuts the legs whose ray, followed in steps of 10 cm, gets into it; within 6 cm of its faces both may be."""
    sonar = np.array([0.0, 0.0, 11.0])
    random = np.random.default_rng(12)
    n = 100
    behind = np.column_stack([random.uniform(-4, 4, n), random.uniform(95, 130, n), random.uniform(0.5, 19.5, n)])
    legs = rays(THERMO, BOXES).legs(sonar, points(behind), families_up_to(1), 100e3)
    bodies, seen = scene(THERMO, BOXES).bodies, []
    offset = behind[:, :2] - sonar[:2]
    away = np.hypot(*offset.T)
    for row, family in enumerate(legs.families):
        there = np.isin(legs.status[row], [LegStatus.CLEAR, LegStatus.OCCLUDED])
        along, deep = refracted_paths(THERMO, sonar, legs.departure[row, there], family != "D", away.max())
        ahead = (offset / away[:, None])[there]
        north, east = along * ahead[:, 0], along * ahead[:, 1]
        inside = np.max([_depth_inside(body, north, east, deep, along < away[there]) for body in bodies], axis=0)
        sure = np.abs(inside) > 0.06
        cut = legs.status[row, there] == LegStatus.OCCLUDED
        np.testing.assert_array_equal(inside[sure] > 0, cut[sure])
        seen += list(cut[sure])
    assert sum(seen) > 30 and len(seen) - sum(seen) > 30


def _depth_inside(body, north, east, depth, before_the_end):
    """Depth of penetration of each path into a box [m], negative outside it, (rays,)."""
    x, y = north - body[0], east - body[1]
    along, across = np.abs(body[2] * x + body[3] * y), np.abs(body[2] * y - body[3] * x)
    inside = np.min([body[4] - along, body[5] - across, depth - body[6], body[7] - depth], axis=0)
    return np.where(before_the_end, inside, -np.inf).max(axis=0)


def test_a_ray_that_only_dips_into_a_box_where_it_turns_is_cut():
    """A box that hangs 2 mm below the apex of an arc cuts it, though the ray comes and goes below; 2 mm higher, not."""
    sonar, bed = np.array([0.0, 0.0, 11.0]), points([[0.0, 150.0, DEPTH]])
    way = rays(THERMO).legs(sonar, bed, ("D",), 100e3).departure[0, 0]
    gradient, cosine = 20 / 6, way[1]
    apex = 8 + (1510 - 1500 / cosine) / gradient
    away = -way[2] * 1500 / (cosine * gradient)
    for lower, status in ((2e-3, LegStatus.OCCLUDED), (-2e-3, LegStatus.CLEAR)):
        box = {"shape": "box", "position": (0.0, away), "size": (2.0, 4.0, 3.0), "base_depth": apex + lower}
        legs = rays(THERMO, (box,)).legs(sonar, bed, ("D",), 100e3)
        assert legs.status[0, 0] == status


def test_beyond_a_caustic_a_ray_is_a_quarter_turn_ahead():
    """Turned rays to one position that have touched the caustic carry +90 degrees, and all amplitudes are finite."""
    away = np.linspace(140, 175, 400)
    low = points(np.column_stack([0 * away, away, np.full(away.size, 15.0)]))
    water = rays(CAUSTIC)
    legs = water.legs(np.array([0.0, 0.0, 11.0]), low, ("D",), 100e3)
    there = legs.status == LegStatus.CLEAR
    assert there.sum(axis=0).max() >= 2 and legs.caustics[there].max() == 1
    plain = there & (legs.spreading < 0.03)
    turned = np.angle(legs.amplitude[plain])
    assert np.all(np.abs(turned - np.pi / 2 * legs.caustics[plain]) < 0.3)
    assert np.isfinite(legs.spreading).all() and legs.spreading[there].max() < 0.2


@pytest.mark.parametrize("profile", [THERMO, CAUSTIC], ids=["thermocline", "caustic"])
@pytest.mark.parametrize("boundary", [0.0, DEPTH])
def test_no_ray_leaves_outside_the_cone_that_was_promised(profile, boundary):
    """Every leg to a position within a neighbourhood departs inside that neighbourhood's cone."""
    sonar, water = np.array([0.0, 0.0, 11.0]), rays(profile)
    random = np.random.default_rng(1)
    centre = np.column_stack([random.uniform(-20, 20, 300), random.uniform(-150, 150, 300)])
    radius = 10 ** random.uniform(-1, 1, 300)
    bearing = random.uniform(0, 2 * np.pi, 300)
    offset = radius * np.sqrt(random.random(300))
    # Under the sonar it is the launch angle that changes most: towards it and away from it, at the full radius.
    centre[:150] *= random.uniform(0.01, 0.05, 150)[:, None]
    bearing[:150] = np.arctan2(centre[:150, 1], centre[:150, 0]) + np.pi * random.integers(0, 2, 150)
    offset[:150] = radius[:150]
    place = centre + np.stack([np.cos(bearing), np.sin(bearing)], axis=1) * offset[:, None]
    found = points(np.column_stack([place, np.full(300, boundary)]))
    for family in families_up_to(2):
        cones = departure_cones(water, family, sonar, centre, radius, boundary)
        legs = water.legs(sonar, found, (family,), 100e3)
        for row in range(len(legs.families)):
            there = legs.status[row] == LegStatus.CLEAR
            assert np.all(cones.exists[there])
            cosine = np.sum(cones.axis * legs.departure[row], axis=1)
            off = np.arccos(np.clip(cosine, -1, 1))
            assert np.all(off[there] <= cones.half_angle[there] + 1e-6)


@pytest.mark.parametrize("profile", [THERMO, CAUSTIC], ids=["thermocline", "caustic"])
@pytest.mark.parametrize("boundary", ["seabed", "target"])
def test_tables_and_exact_rays_give_the_same_legs(profile, boundary):
    """Read from tables or solved one by one: as many rays, delays to 1e-9 s, amplitudes to 0.02 dB, the same boxes."""
    place = places(1000, 5)
    if boundary == "seabed":
        place[:, 2] = DEPTH
    found = points(place, (0, 0, -1) if boundary == "seabed" else (0, 0, 0), boundary)
    read, solved = rays(profile, BOXES), rays(profile, BOXES)
    object.__setattr__(solved, "tables", Solved(solved.layers))
    sonar = np.array([0.0, 0.0, 11.0])
    one, other = (water.legs(sonar, found, families_up_to(2), 100e3) for water in (read, solved))
    assert any(table is not None for table in read.tables.tables.values())
    assert one.ray_names == other.ray_names
    np.testing.assert_array_equal(one.status, other.status)
    np.testing.assert_array_equal(one.occluder, other.occluder)
    there = other.status == LegStatus.CLEAR
    assert np.abs(one.delay - other.delay)[there].max() < 1e-9
    ratio = one.amplitude[there] / other.amplitude[there]
    assert np.abs(ratio - 1).max() < 2.4e-3
    assert np.abs(one.departure - other.departure)[there].max() < 1e-4


class Solved:
    """In place of tables: the exact solver."""

    def __init__(self, column):
        """For one water column."""
        self.layers = column

    def rays(self, family, boundary, source_depth, depths, ranges):
        """Each ray solved for."""
        return exact_rays(self.layers, family, source_depth, depths, ranges)


def test_a_table_that_fails_its_test_gives_way_to_the_exact_solver(monkeypatch):
    """A warning reports it once for each family, and the legs are there all the same."""

    def fails(*_, **__):
        raise TableError("the table of D is wrong.")

    sonar = np.array([0.0, 0.0, 11.0])
    bed = places(50, 1)
    bed[:, 2] = DEPTH
    expected = rays(THERMO).legs(sonar, points(bed, boundary="seabed"), ("D",), 1e5)
    monkeypatch.setattr("insonify.propagation.eigenray_tables.eigenray_table", fails)
    water = rays(THERMO)
    with pytest.warns(TableWarning, match="The exact solver replaces it"):
        legs = water.legs(sonar, points(bed, boundary="seabed"), ("D",), 1e5)
    np.testing.assert_allclose(legs.delay, expected.delay, atol=1e-9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        water.legs(sonar, points(bed, boundary="seabed"), ("D",), 1e5)


def test_all_that_is_received_is_in_reach():
    """Seabed positions with an earliest or latest pair of legs in the window lie in the ring; it is tight."""
    scenario = nominal(
        water={"noise_level_db": None, "profile": THERMO}, track={"window": (0.12, 0.15)}, paths={"max_reflections": 2}
    )
    engine, here = build_simulator(scenario).engine, build_simulator(scenario).ping_geometry(0)
    depths = (11.0, 11.0)
    first, last = here.recorded_delays
    ring = engine.rays.reachable_range(depths, DEPTH, ("D", "S", "BS"), (first / 2, last / 2), 0.0)
    away = np.linspace(1, 180, 2000)
    bed = points(np.column_stack([0 * away, away, np.full(away.size, DEPTH)]), (0, 0, -1), "seabed")
    legs = engine.rays.legs(np.array([0.0, 0.0, 11.0]), bed, ("D", "S", "BS"), 100e3)
    there = legs.status == LegStatus.CLEAR
    earliest = 2 * np.where(there, legs.delay, np.inf).min(axis=0)
    latest = 2 * np.where(there, legs.delay, -np.inf).max(axis=0)
    received = away[(earliest <= last) & (latest >= first)]
    assert ring.nearest <= received.min() < ring.nearest + 1
    assert ring.farthest - 1 < received.max() <= ring.farthest


@pytest.mark.filterwarnings("ignore:water.profile")  # its corner is meant
def test_arrivals_and_explain_name_each_ray():
    """With two direct rays to a target, the second is D2, in the arrivals and in the explanation."""
    scenario = nominal(
        water={"noise_level_db": None, "profile": CAUSTIC}, track={"window": (0.2, 0.24)},
        paths={"max_reflections": 0, "contributions": ["target"]}, targets=[point(0, 165, 15)],
    )  # fmt: skip
    found = insonify.arrivals(scenario)
    names = {found.ray_names(row) for row in range(len(found))}
    assert ("D", "D2") in names and ("D2", "D") in names
    assert "D2" in repr(found)
    when = float(found.delay[np.argmax(np.abs(found.amplitude))])
    assert "D2" in explain_sample(insonify.simulate(scenario), 0, when + 1e-4)
