"""Bottom bounces over relief: reflected by the plane fitted at the bounce, not by the mean plane."""

import numpy as np
import pytest
from scipy.optimize import minimize

from insonify.records.legs import SEABED_OCCLUDER, LegStatus
from insonify.scene.scatterers import Scatterers
from insonify.simulator import build_simulator
from oracles.roughness import roughness_rms
from oracles.scenes import nominal

SONAR = np.array([0.0, 0.0, 11.0])
NORTHWARD, EASTWARD = 0.03, -0.03  # slopes of the depth
FAMILIES = ("D", "S", "B", "SB", "BS", "SBS", "BSB")
WINDOW = {"window": (0.01, 0.25)}


def surveyed(tmp_path, depth_at, *, reach=200.0, cell=2.0, **bed):
    """A seabed whose depth is a function of north and east, as a grid in a file."""
    nodes = np.arange(-reach, reach + cell / 2, cell)
    np.savez(tmp_path / "survey.npz", depth=depth_at(nodes[:, None], nodes[None, :]), north=nodes, east=nodes)
    relief = {"kind": "grid", "file": str(tmp_path / "survey.npz"), "origin": (0.0, 0.0)}
    return {"depth": 20.0, "relief": relief, **bed}


def inclined(tmp_path, **bed):
    """A seabed that falls to the north and rises to the east by 3 %, 20 m deep under the sonar."""
    return surveyed(tmp_path, lambda n, e: 20 + NORTHWARD * n + EASTWARD * e, **bed)


def legs_to(points, seabed, *, normal=(0.0, 0.0, 0.0), boundary="target", families=FAMILIES, **top):
    """The legs of the engine to some points."""
    most = max(len(name) for name in families)
    scenario = nominal(seabed=seabed, track=WINDOW, paths={"families": list(families), "max_reflections": most}, **top)
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    points = np.array(points, float)
    count = len(points)
    ones, keys = np.ones(count), np.arange(count).astype(np.uint64)
    facing = np.tile(np.array(normal, float), (count, 1))
    law = scenario.seabed.law(1e5, 1500.0)
    scatterers = Scatterers("any", boundary, law, points, facing, ones, ones.astype(complex), keys)
    return simulator.engine.path_pairs(here, scatterers).transmit_legs, scenario


def unfolded(family, points):
    """Delay and directions by images in the surface and in the inclined plane: plain vectors, nothing of ours."""
    up = np.array([NORTHWARD, EASTWARD, -1.0]) / np.sqrt(1 + NORTHWARD**2 + EASTWARD**2)
    mirrors = {"S": (np.zeros(3), np.array([0.0, 0.0, 1.0])), "B": (np.array([0.0, 0.0, 20.0]), up)}
    string = "" if family == "D" else family
    image = SONAR
    for letter in string:
        on, facing = mirrors[letter]
        image = image - 2 * ((image - on) @ facing) * facing
    way = points - image
    length = np.linalg.norm(way, axis=1)
    arrival = departure = way / length[:, None]
    for letter in reversed(string):
        facing = mirrors[letter][1]
        departure = departure - 2 * (departure @ facing)[:, None] * facing
    return length, departure, arrival


def scattered(count, seed=1):
    """Points in the water over the inclined bed, 10 to 140 m away."""
    rng = np.random.default_rng(seed)
    distance, turn = rng.uniform(10, 140, count), rng.uniform(-np.pi, np.pi, count)
    north, east = distance * np.cos(turn), distance * np.sin(turn)
    return np.column_stack([north, east, rng.uniform(0.1, 0.95, count) * (20 + NORTHWARD * north + EASTWARD * east)])


def test_an_inclined_bed_mirrors_as_one_inclined_plane(tmp_path):
    """3 % along and across, 300 points, 7 families: 1e-8 s, 1e-5 in directions and 1e-5 in level of exact images.

    Off the mean plane the same legs would be up to 1 ms off.
    """
    points = scattered(300)
    legs, scenario = legs_to(points, inclined(tmp_path))
    loss = float(scenario.water.absorption(1e5))
    assert (legs.status == LegStatus.CLEAR).all()
    for row, family in enumerate(legs.families):
        length, departure, arrival = unfolded(family, points)
        np.testing.assert_allclose(legs.delay[row], length / 1500, rtol=0, atol=1e-8)
        np.testing.assert_allclose(legs.departure[row], departure, atol=1e-5)
        np.testing.assert_allclose(legs.arrival[row], arrival, atol=1e-5)
        level = (-1.0) ** family.count("S") * 0.35 ** family.count("B") / length * 10 ** (-loss * length / 20)
        np.testing.assert_allclose(legs.amplitude[row], level, rtol=1e-5)


def test_the_ground_of_an_inclined_bed_receives_its_multiples_as_that_plane_has_them(tmp_path):
    """D, S and BS to 300 positions of the seabed: delays to 1e-8 s, none hidden, grazing angles those of the plane."""
    points = scattered(300)
    points[:, 2] = 20 + NORTHWARD * points[:, 0] + EASTWARD * points[:, 1]
    up = np.array([NORTHWARD, EASTWARD, -1.0]) / np.sqrt(1 + NORTHWARD**2 + EASTWARD**2)
    legs, _ = legs_to(points, inclined(tmp_path), normal=up, boundary="seabed", families=("D", "S", "BS"))
    assert legs.families == ("D", "S", "BS")
    for row, family in enumerate(legs.families):
        length, _, arrival = unfolded(family, points)
        np.testing.assert_allclose(legs.delay[row], length / 1500, rtol=0, atol=1e-8)
        np.testing.assert_allclose(legs.grazing_sine[row], -arrival @ up, atol=1e-5)
        facing = -arrival @ up > 1e-3
        assert (legs.status[row][facing] == LegStatus.CLEAR).mean() > 0.99, family


def test_a_bounce_off_a_long_swell_of_the_bed_is_where_fermat_has_it(tmp_path):
    """Waves of 60 m and 0.5 m: the shortest way over the true ground, found by search, within 2 us; 40 us off the mean.

    Legs of 50 m or less, whose one bounce is sharp: further away the seabed focuses.
    """

    def depth_at(north, east):
        return 20 + 0.5 * np.sin(2 * np.pi * (north + 0.4 * east) / 60)

    rng = np.random.default_rng(2)
    distance, turn = rng.uniform(15, 40, 25), rng.uniform(-np.pi, np.pi, 25)
    points = np.column_stack([distance * np.cos(turn), distance * np.sin(turn), rng.uniform(5, 14, 25)])
    legs, _ = legs_to(points, surveyed(tmp_path, depth_at, reach=80.0, cell=1.0), families=("B",))

    def way(at, end):
        on = np.array([at[0], at[1], depth_at(*at)])
        return np.linalg.norm(on - SONAR) + np.linalg.norm(on - end)

    shortest = [minimize(way, end[:2] * 9 / (9 + 20 - end[2]), args=(end,), tol=1e-12).fun for end in points]
    level = np.hypot(distance, 40 - 11 - points[:, 2])
    off = legs.delay[0] - np.array(shortest) / 1500
    assert np.sqrt(np.mean((level - shortest) ** 2)) / 1500 > 2e-4
    assert np.sqrt(np.mean(off**2)) < 4e-6


def test_what_a_bounce_loses_is_the_roughness_between_its_zone_and_the_sound(tmp_path):
    """R exp(-2 k^2 h^2 sin^2), grazing at the inclined plane, h from the zone's mean axis to the sound's wavelength.

    Under a survey the resolved part of h is what is left of 32 samples of each zone. A zone is longer than its mean
    axis, and lets in waves that are longer along the ray: a quarter more of this relief, in the mean of some 130 legs.
    """
    seabed = inclined(tmp_path)
    seabed["relief"] = [seabed["relief"], {"kind": "power-law", "hurst": 0.8, "rms": 0.01, "outer_scale": 3.0}]
    points = scattered(170, seed=3)
    points = points[points[:, 2] < 15]
    legs, scenario = legs_to(points, seabed, families=("B",))
    length, _, arrival = unfolded("B", points)
    up = np.array([NORTHWARD, EASTWARD, -1.0]) / np.sqrt(1 + NORTHWARD**2 + EASTWARD**2)
    sine, k = arrival @ up, 2 * np.pi / 0.015
    below = 9 / np.sqrt(1 + NORTHWARD**2 + EASTWARD**2) / sine  # the way to the bounce
    half = np.sqrt(0.015 * below * (length - below) / length)
    ground = scenario.seabed.terrain.relief
    rms = np.array([roughness_rms(ground, 2 * np.pi / (2 * one), k) for one in half / np.sqrt(sine)])
    exponent = 2 * (k * rms * sine) ** 2
    clear = legs.status[0] == LegStatus.CLEAR
    lost = -np.log(np.abs(legs.reflection_coefficient[0]) / 0.35)
    assert np.mean(lost[clear] / exponent[clear]) == pytest.approx(1.25, abs=0.15)
    assert np.ptp(exponent[clear]) > 1 and clear.sum() > 100


def test_a_point_below_the_plane_of_its_bounce_has_none(tmp_path):
    """Behind the crest of a bank, deeper than its slope goes on: B finds no mirror, and the seabed is to blame."""
    seabed = surveyed(tmp_path, lambda n, e: 20 + 0.6 * np.maximum(e - 40, 0) + 0 * n, cell=1.0)
    points = np.array([[0.0, 60.0, 28.0], [0.0, 60.0, 12.0]])
    legs, _ = legs_to(points, seabed, families=("B",))
    assert legs.status[0].tolist() == [LegStatus.OCCLUDED, LegStatus.CLEAR]
    assert legs.occluder[0].tolist() == [SEABED_OCCLUDER, -1] and legs.visibility[0].tolist() == [0, 1]


def test_a_wall_of_ground_cuts_the_rising_leg(tmp_path):
    """B to 100 m bounces at 50 m and is 3.6 m above the seabed at 70 m: a dyke of 5 m cuts it, 2 m do not."""
    for height, cut in ((5.0, True), (2.0, False)):
        seabed = surveyed(tmp_path, lambda n, e, h=height: 20 - h * np.exp(-((e - 70) ** 2) / 4) + 0 * n, cell=0.5,
                          reach=110.0)  # fmt: skip
        legs, _ = legs_to([[0.0, 100.0, 11.0]], seabed, families=("B",))
        assert (legs.status[0, 0] == LegStatus.OCCLUDED) == cut


PROFILE = [[0.0, 1502.0], [8.0, 1500.0], [14.0, 1490.0], [20.0, 1488.0]]


def test_in_layered_water_bounces_move_with_the_ground(tmp_path):
    """A seabed that lies 0.3 m above its mean plane, under a thermocline: legs of the seabed at that depth within 2 us.

    Off the mean plane they are up to 200 us late.
    """
    points = np.column_stack([np.zeros(30), np.linspace(20, 90, 30), np.linspace(8, 13, 30)])
    water = {"noise_level_db": None, "profile": PROFILE}
    shallow = surveyed(tmp_path, lambda n, e: np.where(n < -100, 20.3, 19.7) + 0 * e)
    low = {"kind": "ripples", "height": 1e-6, "wavelength": 2.0}
    shallow["relief"] = [shallow["relief"], low]
    named = ("B", "SB", "BS")
    moved, _ = legs_to(points, shallow, families=named, water=water)
    exact, _ = legs_to(points, {"depth": 19.7}, families=named, water=water)
    mean, _ = legs_to(points, {"depth": 20.0}, families=named, water=water)
    there = (moved.status == LegStatus.CLEAR) & (exact.status == LegStatus.CLEAR) & (mean.status == LegStatus.CLEAR)
    assert there.mean() > 0.9
    assert np.abs(mean.delay - exact.delay)[there].max() > 1e-4
    assert np.abs(moved.delay - exact.delay)[there].max() < 4e-6
    assert np.abs(moved.arrival - exact.arrival)[there].max() < 2e-3


def test_waves_of_a_survey_that_are_shorter_than_the_zone_roughen_the_mirror(tmp_path):
    """A grid with waves of 2 m, 1 cm rms, across the ray, under a zone of 30 m at 3 degrees: exp(-2 k^2 h^2 sin^2).

    The 32 samples of each leg scatter about that h; the mean of their exponents over 40 legs is within 10 %.
    """
    height = 0.01 * np.sqrt(2)
    seabed = surveyed(tmp_path, lambda n, e: 20 + height * np.sin(np.pi * e) + 0 * n, reach=150.0, cell=0.25)
    place = {**WINDOW, "position": (0.0, -70.0, 18.0)}
    points = np.column_stack([np.linspace(-5, 5, 40), np.full(40, 0.0), np.full(40, 18.0)])
    scenario = nominal(seabed=seabed, track=place, paths={"families": ["B"], "max_reflections": 1})
    simulator = build_simulator(scenario)
    ones = np.ones(40)
    scatterers = Scatterers("any", "target", scenario.seabed.law(1e5, 1500.0), points, np.zeros((40, 3)), ones,
                     ones.astype(complex), np.arange(40).astype(np.uint64))  # fmt: skip
    legs = simulator.engine.path_pairs(simulator.ping_geometry(0), scatterers).transmit_legs
    sine = 4 / np.hypot(4, np.hypot(points[:, 0], 70))
    exponent = -np.log(np.abs(legs.reflection_coefficient[0]) / 0.35)
    assert np.mean(exponent / (2 * (2 * np.pi / 0.015 * 0.01 * sine) ** 2)) == pytest.approx(1.0, abs=0.12)


def test_late_multiples_off_a_deep_part_of_the_bed_are_in_reach(tmp_path):
    """A seabed 3 m deeper to the east than its mean plane: BS to it comes 6 m later, and its tiles are evaluated."""
    seabed = surveyed(tmp_path, lambda n, e: np.where(e < -150, 20.0, 23.0) + 0 * n, reach=160.0)
    place = np.array([0.0, 6.0, 23.0])
    legs, _ = legs_to([place], seabed, normal=(0.0, 0.0, -1.0), boundary="seabed", families=("BS",))
    assert legs.status[0, 0] == LegStatus.CLEAR
    assert legs.delay[0, 0] == pytest.approx(np.hypot(6.0, 2 * 23 - 11 + 23) / 1500, abs=1e-8)
    late = float(2 * legs.delay[0, 0])
    paths = {"families": ["BS"], "max_reflections": 2}
    simulator = build_simulator(nominal(seabed=seabed, track={"window": (late - 1e-3, late + 1e-3)}, paths=paths))
    found = [block().position for block in simulator.engine.blocks(simulator.ping_geometry(0))]
    assert min(np.linalg.norm(points[:, :2] - place[:2], axis=1).min() for points in found) < 1.0


@pytest.mark.parametrize("bounce", ["explicit", "tilted"])
def test_bottom_bounces_keep_their_planes_under_a_swell(tmp_path, bounce):
    """Over an inclined bed, under a swell of a nanometre: delays, directions and levels of a calm, to its size."""
    calm, seabed = {"reflection": bounce, "swell": {"height": 1e-9, "length": 30.0}}, inclined(tmp_path)
    families = ("S", "SB", "BS", "BSB")
    under, still = (
        legs_to([(30.0, 60.0, 17.0), (-20.0, 80.0, 16.0)], seabed, families=families, **surface)[0]
        for surface in ({"surface": calm}, {})
    )
    assert under.families == still.families == families
    np.testing.assert_allclose(under.delay, still.delay, atol=2e-12)
    np.testing.assert_allclose(under.departure, still.departure, atol=1e-8)
    np.testing.assert_allclose(under.arrival, still.arrival, atol=1e-8)
    np.testing.assert_allclose(under.amplitude, still.amplitude, rtol=1e-6)
