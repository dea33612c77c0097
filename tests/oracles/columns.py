"""Columns of water: those of a published comparison of ray codes, and random ones."""

import numpy as np

DEPTH = 20.0
SOURCE = 11.0
NAMED = {
    "iso20": ([0, 20], [1500, 1500]),
    "down20": ([0, 20], [1510, 1500]),
    "thermo20": ([0, 8, 14, 20], [1510, 1510, 1490, 1490]),
    "winter20": ([0, 20], [1480, 1486]),
    "fresh20": ([0, 3, 9, 20], [1470, 1470, 1490, 1490]),
    "duct20": ([0, 11, 20], [1505, 1495, 1501]),
    "caustic20": ([0, 4, 8, 20], [1510, 1510, 1490, 1490]),
}
"""Knots [m] and speeds [m/s] of flat water 20 m deep; the source is at 11 m."""


def random_column(rng):
    """Depths and speeds of 2 to 12 knots, a source depth and a point depth; now and then something awkward.

    Args:
        rng: Random numbers.
    """
    count = int(rng.integers(2, 13))
    water = float(rng.choice([8.0, 20.0, 30.0, 57.3]))
    depth = np.sort(rng.uniform(0, water, count))
    depth[0], depth[-1] = 0.0, water
    depth = depth[np.concatenate([[True], np.diff(depth) > 0.02])]
    depth[-1] = water
    speed = 1490 + np.cumsum(rng.normal(0, rng.choice([0.3, 3.0, 10.0]), depth.size))
    speed = np.clip(speed, 1400, 1600)
    for i in np.flatnonzero(rng.random(depth.size - 1) < 0.2):
        speed[i + 1] = speed[i]  # still water
    source, point = rng.uniform(0.05, water - 0.05, 2)
    if rng.random() < 0.2 and depth.size > 2:
        source = depth[rng.integers(1, depth.size - 1)]
    if rng.random() < 0.2 and depth.size > 2:
        point = depth[rng.integers(1, depth.size - 1)]
    if rng.random() < 0.1:
        point = source
    return depth, speed, float(source), float(point)


def random_distance(rng):
    """A horizontal distance, from half a metre to half a kilometre."""
    return float(np.exp(rng.uniform(np.log(0.5), np.log(500.0))))


def nasty_column(rng):
    """As `random_column`, but a channel that turns rays often, layers of a hair's breadth, or hardly a gradient."""
    kind = rng.integers(4)
    water = 20.0
    if kind == 0:  # a channel
        axis = rng.uniform(5, 15)
        depth = [0.0, axis, water]
        speed = [1495 + rng.uniform(2, 40), 1495.0, 1495 + rng.uniform(2, 40)]
        source, point = axis + rng.normal(0, 1, 2)
    elif kind == 1:  # two knots a nanometre to a millimetre apart
        z = rng.uniform(3, 17)
        depth = [0.0, z, z + 10 ** rng.uniform(-9, -3), water]
        speed = 1500 + rng.normal(0, 3, 4)
        speed[2] = speed[1] + rng.normal(0, 0.01)
        source, point = rng.uniform(1, 19, 2)
    elif kind == 2:  # gradients that hardly bend a ray
        depth = [0.0, 5.0, 12.0, water]
        speed = 1500 + rng.normal(0, 1, 4) * 10 ** rng.uniform(-12, -3)
        source, point = rng.uniform(1, 19, 2)
    else:  # source and point a hair from a knot
        depth = [0.0, 6.0, 13.0, water]
        speed = 1500 + rng.normal(0, 5, 4)
        source = rng.choice([6.0, 13.0]) + rng.normal(0, 1) * 10 ** rng.uniform(-9, -2)
        point = rng.choice([6.0, 13.0]) + rng.normal(0, 1) * 10 ** rng.uniform(-9, -2)
    return np.array(depth), np.array(speed), float(source), float(point)
