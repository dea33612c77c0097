"""Ends of shadows and times of ghosts, in water of one speed and of one gradient: closed forms against the engine."""

from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from insonify.simulator import arrivals
from oracles.arcs import Arcs
from oracles.few_of import few_of
from oracles.scenes import nominal, point

SEEDS = st.integers(0, 10**6)
FAMILIES = ("D", "S", "B", "SB", "BS")


def water_of(arcs):
    """The water of a scenario."""
    if arcs.gradient == 0:
        return {"noise_level_db": None, "sound_speed": arcs.surface_speed}
    return {"noise_level_db": None, "profile": [[0.0, arcs.surface_speed], [arcs.depth, arcs.speed(arcs.depth)]]}


def scene(arcs, source, targets, farthest, **values):
    """Targets over a flat bed of the arcs' depth, received from a depth on all sides."""
    omni = {"kind": "point", "length": None}
    long = {"kind": "cw", "frequency": 20e3, "duration": 5e-3}  # few cells on faces, which are not needed here
    return nominal(
        water=water_of(arcs), seabed={"depth": arcs.depth}, targets=targets, transmit=omni, receive=omni,
        sonar={"pulse": long},
        track={"position": (0.0, 0.0, source), "window": (1e-3, 2 * (farthest + 3 * arcs.depth) / 1400)},
        paths={"contributions": ["target"], "max_reflections": 2, **values},
    )  # fmt: skip


def rows_of(found, label, pair):
    """Rows of one target over one pair of families."""
    return np.flatnonzero(
        (found.object == label) & (found.transmit_family == pair[0]) & (found.receive_family == pair[1])
    )


def drawn(seed, gradient):
    """Water, a sonar in it, and a box on its bed with the distance of its back."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(12, 30)
    arcs = Arcs(rng.uniform(1450, 1530), gradient, depth)
    source = rng.uniform(2, depth - 5)
    return arcs, source, rng.uniform(0.2, 0.5) * (depth - source), rng.uniform(25, 60)


@settings(max_examples=4)
@given(SEEDS)
@few_of((0, 1), "gradient", [0.0, -0.4, 0.15])
def test_shadows_end_where_the_ray_over_the_far_edge_comes_down(gradient, seed):
    """Heights of 20 to 50 % of the sonar's: probes 3 cm before and after the end of each family's shadow.

    D comes straight, S off the surface, BS off bed and surface: the steeper, the shorter. A pair of families is
    received where neither is cut.
    """
    arcs, source, height, back = drawn(seed, gradient)
    bed, ends = arcs.depth - 0.01, {}
    for family in ("D", "S", "BS"):
        over = arcs.turns(family, source, arcs.depth - height)
        p = arcs.steepness(over, back)
        assume(p is not None and p * arcs.speed(arcs.depth) < 0.9999)
        ends[family] = arcs.run(p, [*over, bed])
    assume(max(ends.values()) < 150)
    box = {"shape": "box", "position": (0.0, back - 0.5), "size": (3.0, 1.0, height)}
    places = {f"{family}{off:+.2f}": ends[family] + off for family in ends for off in (-0.03, 0.03)}
    probes = [point(0.0, x, bed, label=name) for name, x in places.items()]
    found = arrivals(scene(arcs, source, [box, *probes], max(ends.values()), families=tuple(ends)))
    for (name, x), pair in product(places.items(), product(ends, ends)):
        lit = all(x > ends[family] for family in pair)
        assert len(rows_of(found, name, pair)) == lit, (name, pair, ends)


@settings(max_examples=5)
@given(SEEDS)
@pytest.mark.parametrize("gradient", [0.0, -0.25, 0.15])
def test_ghosts_come_by_25_paths_at_the_times_of_arcs(gradient, seed):
    """A point above the bed: delays to 2 ns, signs of the surface and losses of the bed exactly, angles to 1e-5 rad."""
    arcs, source, _, distance = drawn(seed, gradient)
    depth = np.random.default_rng(seed + 1).uniform(1, arcs.depth - 0.2)
    ways = {family: arcs.turns(family, source, depth) for family in FAMILIES}
    steep = {family: arcs.steepness(way, distance) for family, way in ways.items()}
    assume(all(steep.values()) and abs(depth - source) > 0.3)
    found = arrivals(scene(arcs, source, [point(0.0, distance, depth)], 2 * distance))
    assert len(found) == 25
    for pair in product(FAMILIES, FAMILIES):
        (row,) = rows_of(found, "point", pair)
        late = sum(arcs.time(steep[family], ways[family]) for family in pair)
        assert found.delay[row] == pytest.approx(late, abs=2e-9), pair
        pair_name = "".join(pair)
        assert found.reflection_coefficient[row] == pytest.approx(
            (-1.0) ** pair_name.count("S") * 0.35 ** pair_name.count("B"), abs=1e-9
        )
        for vector, family in ((found.departure[row], pair[0]), (found.arrival[row], pair[1])):
            down = np.sign(ways[family][1] - source) * arcs.sine(steep[family], source)
            assert vector[2] == pytest.approx(down, abs=1e-5), pair


@settings(max_examples=20)
@given(SEEDS)
def test_squares_of_lengths_differ_by_products_of_depths(seed):
    """Still water: L_S^2 - L_D^2 = 4 z_s z_t, L_B^2 - L_D^2 = 4 (H - z_s)(H - z_t), and so on, to a part in 10^9.

    The other two: L_SB^2 - L_S^2 = 4 (H + z_s)(H - z_t) and L_BS^2 - L_D^2 = 4 H (H - z_s + z_t).
    """
    arcs, source, _, distance = drawn(seed, 0.0)
    depth, h = np.random.default_rng(seed + 1).uniform(1, arcs.depth - 0.2), arcs.depth
    found = arrivals(scene(arcs, source, [point(0.0, distance, depth)], 2 * distance))
    square = {f: (found.delay[rows_of(found, "point", (f, f))[0]] * arcs.surface_speed / 2) ** 2 for f in FAMILIES}
    for longer, shorter, pair_name in (
        ("S", "D", source * depth), ("B", "D", (h - source) * (h - depth)), ("SB", "S", (h + source) * (h - depth)),
        ("BS", "D", h * (h - source + depth)),
    ):  # fmt: skip
        assert square[longer] - square[shorter] == pytest.approx(4 * pair_name, abs=1e-9 * square[longer])
