"""Straight legs between two flat boundaries, against formulas typed apart and paths found by other means."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from insonify.propagation.families import families_reaching, families_up_to, image_depth
from insonify.propagation.image_sources import image_legs
from insonify.scattering.point_target import PointTargetLaw
from insonify.scattering.reflection import reflection_coefficient
from insonify.scattering.sediments import Sediment
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.simulator import build_simulator
from oracles.few_of import few_of
from oracles.scenes import nominal
from oracles.water import fold, letters

SPEED, DEPTH, SOURCE, RANGE = 1500.0, 20.0, 11.0, 150.0
PAPER = {"a": "D", "b": "S", "c": "B", "d": "SB", "e": "BS"}
# One-way delay [ms] of legs a to e, to the printed digits, and angle at the point [deg].
PRINTED = {
    20.0: {"a": (100.1798, 3.434), "b": (102.1132, 11.677), "e": (105.2003, 18.090)},
    19.5: {"a": (100.1604, None), "b": (102.0463, None), "c": (100.2004, None), "d": (102.1812, None),
           "e": (105.0973, None)},
    19.0: {"a": (100.1421, None), "b": (101.9804, None), "c": (100.2220, None), "d": (102.2502, None),
           "e": (104.9952, None)},
}  # fmt: skip
# Two-way delay re aa [ms] of seabed point, middle and top of a face 1 m high.
TWO_WAY = {
    "aa": (200.360, 200.321, 200.284), "ac": (0, 0.040, 0.080), "cc": (0, 0.080, 0.160),
    "ab": (1.933, 1.886, 1.838), "bc": (1.933, 1.926, 1.918), "ad": (1.933, 2.021, 2.108),
    "cd": (1.933, 2.061, 2.188), "bb": (3.867, 3.772, 3.677), "bd": (3.867, 3.907, 3.946),
    "dd": (3.867, 4.042, 4.216), "ae": (5.020, 4.937, 4.853), "ce": (5.020, 4.977, 4.933),
    "be": (6.954, 6.823, 6.691), "de": (6.954, 6.958, 6.961), "ee": (10.041, 9.874, 9.706),
}  # fmt: skip


def points(position, boundary="target"):
    """Points that scatter in all directions."""
    n = len(position)
    return Scatterers(boundary, boundary, PointTargetLaw(), np.asarray(position, float), np.zeros((n, 3)), np.ones(n),
                      np.ones(n, complex), np.arange(n, dtype=np.uint64))  # fmt: skip


def legs(source, place, order=2, *, depth=DEPTH, boundary="target", **scene):
    """Legs from one place to one point, family by family."""
    world = Scene(**{"water": {"absorption_db_per_m": 0.03}, "seabed": {"depth": depth}, **scene})
    return image_legs(world, np.asarray(source, float), points([place], boundary), families_up_to(order), 100e3)


def images(z):
    """Lengths of the paper's legs, from the depths of the images of the source."""
    depth = {"a": SOURCE, "b": -SOURCE, "c": 2 * DEPTH - SOURCE, "d": 2 * DEPTH + SOURCE, "e": SOURCE - 2 * DEPTH}
    return {leg: np.hypot(RANGE, z - image) for leg, image in depth.items()}


@pytest.mark.parametrize("z", PRINTED)
def test_the_five_legs_take_the_papers_times(z):
    """Image sources: L = sqrt(r^2 + (z - z_image)^2), to 1e-9 s; and the worked table to its printed digits."""
    found = legs((0, 0, SOURCE), (0, RANGE, z))
    delay = dict(zip(found.families, found.delay[:, 0], strict=True))
    for name, length in images(z).items():
        assert delay[PAPER[name]] == pytest.approx(length / SPEED, abs=1e-9)
    for name, (milliseconds, angle) in PRINTED[z].items():
        assert delay[PAPER[name]] * 1e3 == pytest.approx(milliseconds, abs=6e-5)
        if angle is not None:
            climb = found.arrival[found.families.index(PAPER[name]), 0, 2]
            assert np.degrees(np.arcsin(abs(climb))) == pytest.approx(angle, abs=6e-4)


@pytest.mark.parametrize("pair", TWO_WAY)
def test_the_fifteen_pairs_take_the_papers_times(pair):
    """Two-way delays at the foot, middle and top of the target: 1e-9 s of the image formula, and the printed digits."""
    for printed, z in zip(TWO_WAY[pair], (20.0, 19.5, 19.0), strict=True):
        found = legs((0, 0, SOURCE), (0, RANGE, z))
        delay = dict(zip(found.families, found.delay[:, 0], strict=True))
        two_way = sum(delay[PAPER[leg]] for leg in pair)
        assert two_way == pytest.approx(sum(images(z)[leg] for leg in pair) / SPEED, abs=1e-9)
        reference = 0.0 if pair == "aa" else 2 * delay["D"]
        assert (two_way - reference) * 1e3 == pytest.approx(printed, abs=6e-4)


heights = st.floats(0.01, 0.99)


@given(heights, heights, st.floats(0.1, 500), st.floats(1, 200))
def test_the_squares_of_the_legs_differ_by_products_of_depths(source, point, away, depth):
    """Exact identities: b2-a2 = 4 zs z, c2-a2 = 4(H-zs)(H-z), d2-b2 = 4(H+zs)(H-z), e2-a2 = 4H(H-zs+z)."""
    zs, z = source * depth, point * depth
    found = legs((0, 0, zs), (away, 0, z), depth=depth)
    a, b, c, d, e = ((found.delay[found.families.index(PAPER[leg]), 0] * SPEED) ** 2 for leg in "abcde")
    close = {"rel": 1e-9, "abs": 1e-9 * e}
    assert b - a == pytest.approx(4 * zs * z, **close)
    assert c - a == pytest.approx(4 * (depth - zs) * (depth - z), **close)
    assert d - b == pytest.approx(4 * (depth + zs) * (depth - z), **close)
    assert e - a == pytest.approx(4 * depth * (depth - zs + z), **close)


def shortest(source, place, family, depth):
    """Fermat: the bounce points on their boundaries that make the path shortest, by descent."""
    levels = [0.0 if letter == "S" else depth for letter in letters(family)]

    def corners(flat):
        bounced = np.column_stack([flat.reshape(-1, 2), levels]) if levels else np.zeros((0, 3))
        return np.vstack([source, bounced, place])

    def length(flat):
        return np.linalg.norm(np.diff(corners(flat), axis=0), axis=1).sum()

    part = np.linspace(0, 1, len(levels) + 2)[1:-1, None]
    start = (source[:2] + part * (place[:2] - source[:2])).ravel()
    found = minimize(length, start, method="BFGS", options={"gtol": 1e-11}).x if levels else start
    steps = np.diff(corners(found), axis=0)
    return length(found), steps[0] / np.linalg.norm(steps[0]), steps[-1] / np.linalg.norm(steps[-1])


@few_of((0, 1), "seed", range(6))
def test_every_family_takes_the_shortest_path_by_its_boundaries(seed):
    """Fermat's principle by numerical descent over the bounce points, to order 4: length 1e-9, directions 1e-5."""
    random = np.random.default_rng(seed)
    depth = random.uniform(5, 60)
    source, place = (np.array([*random.uniform(-40, 40, 2), random.uniform(0.05, 0.95) * depth]) for _ in range(2))
    found = legs(source, place, 4, depth=depth)
    assert len(found.families) == 9
    for row, family in enumerate(found.families):
        length, departure, arrival = shortest(source, place, family, depth)
        assert found.delay[row, 0] * SPEED == pytest.approx(length, rel=1e-9)
        np.testing.assert_allclose(found.departure[row, 0], departure, atol=1e-5)
        np.testing.assert_allclose(found.arrival[row, 0], arrival, atol=1e-5)


@given(heights, heights, st.floats(-90, 90), st.floats(-90, 90), st.floats(1, 100))
def test_a_walked_path_ends_at_the_point(source, point, north, east, depth):
    """Mirrored at the scatterer and walked bounce by bounce, the path has the engine's directions and ends there."""
    begin, end = np.array([3.0, -2.0, source * depth]), np.array([north, east, point * depth])
    found = legs(begin, end, 4, depth=depth)
    for row, family in enumerate(found.families):
        path = fold(begin, end, family, depth)
        np.testing.assert_allclose(path.corners[-1], end, atol=1e-9 * path.length + 1e-9)
        assert found.delay[row, 0] * SPEED == pytest.approx(path.length, rel=1e-12)
        np.testing.assert_allclose(found.departure[row, 0], path.departure, atol=1e-12)
        np.testing.assert_allclose(found.arrival[row, 0], path.arrival, atol=1e-12)


def test_each_bounce_has_its_coefficient_and_each_metre_its_absorption():
    """-1 per surface bounce.

    R per bottom bounce (0.35, or Rayleigh's for medium sand at the bounce's own angle), 1 / L for spreading, 0.03
    dB/m for absorption.
    """
    for reflection in (0.35, "medium sand"):
        found = legs((0, 0, SOURCE), (0, RANGE, 19.0), 4, seabed={"depth": DEPTH, "reflection": reflection})
        for row, family in enumerate(found.families):
            path = fold((0, 0, SOURCE), (0, RANGE, 19.0), family, DEPTH)
            bottom = 0.35 if reflection == 0.35 else reflection_coefficient(Sediment.named("medium sand"),
                                                                             np.arcsin(path.sine))  # fmt: skip
            expected = (-1.0) ** family.count("S") * bottom ** family.count("B")
            expected = expected / path.length * 10 ** (-0.03 * path.length / 20)
            assert found.amplitude[row, 0] == pytest.approx(expected, rel=1e-12)


def test_families_alternate_and_count_two_for_each_order():
    """Between two flat boundaries the bounces must alternate: 2 n + 1 families up to order n."""
    assert families_up_to(2) == ("D", "S", "B", "SB", "BS")
    assert [len(families_up_to(order)) for order in range(5)] == [1, 3, 5, 7, 9]


def test_a_bounce_on_the_scatterers_own_ground_is_part_of_its_scattering():
    """On the bed B is D and SB is S over again; on the surface S is D: dropped. Image depths state the same."""
    assert families_reaching("seabed", families_up_to(2)) == ("D", "S", "BS")
    assert families_reaching("surface", families_up_to(2)) == ("D", "B", "SB")
    assert families_reaching("target", families_up_to(2)) == families_up_to(2)
    for twin, kept in (("B", "D"), ("SB", "S")):
        away = [abs(DEPTH - image_depth(name, SOURCE, DEPTH)) for name in (twin, kept)]
        assert away[0] == pytest.approx(away[1])


def test_the_legs_back_are_the_legs_out_of_the_receiver():
    """Reciprocity: with ends apart, legs out and back are each other's when the ends are exchanged."""
    ends = {"transmit": {"offset": (0, 0, -2)}, "receive": {"offset": (1, 0, 3)}}
    swapped = {"transmit": ends["receive"], "receive": ends["transmit"]}
    found = []
    for offsets in (ends, swapped):
        simulator = build_simulator(nominal(**offsets))
        here = simulator.ping_geometry(0)
        found.append(simulator.engine.path_pairs(here, points([(1, 150, 19.5), (3, 80, 4)])))
    np.testing.assert_array_equal(found[0].transmit_legs.delay, found[1].receive_legs.delay)
    np.testing.assert_array_equal(found[0].receive_legs.departure, found[1].transmit_legs.departure)
    assert not np.array_equal(found[0].transmit_legs.delay, found[0].receive_legs.delay)


def test_legs_that_are_not_needed_are_left_without_amplitude():
    """Only the legs that are needed keep their coefficient; every other number is that of all legs."""
    simulator = build_simulator(nominal())
    engine, sonar = simulator.engine, simulator.ping_geometry(0)
    ground = points([(1, 150, 20.0), (3, 80, 20.0), (2, 40, 20.0)], "seabed")
    families = families_up_to(2)
    needed = np.arange(3 * len(families)).reshape(-1, 3) % 2 == 0
    some, every = (
        engine.rays.legs(sonar.transmit_position, ground, families, 1e5, needed=mask) for mask in (needed, None)
    )
    for row, family in enumerate(every.families):
        kept = needed[families.index(family)]
        whole = every.reflection_coefficient[row]
        assert whole.all()
        np.testing.assert_array_equal(some.reflection_coefficient[row], np.where(kept, whole, 0))
    for name in ("delay", "length", "spreading", "absorption", "departure", "visibility"):
        np.testing.assert_array_equal(getattr(some, name), getattr(every, name))
