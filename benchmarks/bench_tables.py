"""Speed of making and reading tables: a summer thermocline in 20 m of water, a sonar at 11 m, ranges to 200 m."""

import numpy as np

from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation._eigenray_kernel import COLUMNS
from insonify.propagation._eigenray_table_kernel import EXACT, NodeTable, TablePoints, find_cells, interpolate_cells
from insonify.propagation.eigenray_table import EigenrayTable, eigenray_table
from insonify.propagation.sound_speed_layers import sound_speed_layers
from measure import Result, best_seconds

WATER = sound_speed_layers(SoundSpeedProfile(np.array([0.0, 8, 14, 20]), np.array([1510.0, 1510, 1490, 1490])), 20.0)
AT_ONCE = 8192  # points of one call: what is read of them fits the cache
CALLS = 16
SPANS = {"on the seabed": (20.0, 20.0), "anywhere": (0.0, 20.0)}


def _table(family: str, points: tuple[float, float], heave: float = 0.0) -> EigenrayTable:
    return eigenray_table(WATER, family, source_depths=(11.0, 11.0 + heave), point_depths=points, max_range=200.0)


def look_ups() -> list[Result]:
    """Delay, both angles, slowness, amplitude and length of points in random order, all of them in the table."""
    runs, found = {}, {}
    for where, span in SPANS.items():
        for family in ("D", "S"):
            table = _table(family, span)
            name = f"table look-ups {where}, {family}"
            runs[name], found[name] = _reading(table, span)
    seconds = best_seconds(runs, repeats=20)
    return [
        Result(name, CALLS * found[name] / best / 1e6, "M rays/s, 1 core", "goal 50") for name, best in seconds.items()
    ]


def _reading(table: EigenrayTable, span: tuple[float, float]) -> tuple[object, int]:
    """A run that reads a table at many points, and how many."""
    plane, where = table.plane_at(11.0), table.specification.grid
    random = np.random.default_rng(1)
    depth, ranges = random.uniform(*span, 4 * AT_ONCE), random.uniform(1, 200, 4 * AT_ONCE)
    held = np.flatnonzero(~np.isin(where.find(plane.path_count, depth, ranges).paths, (0, EXACT)))[:AT_ONCE]
    depth, ranges = depth[held], ranges[held]
    points = TablePoints(depth, ranges, np.empty((2, held.size), np.int32), np.empty(held.size, np.uint8))
    rays, nodes, mean_speed = np.empty((held.size, 1, COLUMNS)), plane.nodes.reshape(-1), plane.mean_speed.reshape(-1)
    numbers = NodeTable(nodes, mean_speed, plane.history, where.node_depths.size, where.node_ranges.size)
    bounces = table.specification.bounces.number
    speed = float(np.interp(11.0, WATER.depth, WATER.speed))

    def run() -> None:
        for _ in range(CALLS):
            find_cells(plane.path_count, where.rows, points)
            interpolate_cells(numbers, where.rows, speed, bounces, 0, points, rays)

    return run, held.size


def making() -> list[Result]:
    """One family: for one depth of the source, and what a ping of a heaving sonar costs on top."""
    runs = {f"table made {where}, {name}": lambda name=name, span=span: _table(name, span)
            for where, span in SPANS.items() for name in ("D", "S")}  # fmt: skip
    heaving = _table("D", SPANS["anywhere"], 0.3)

    def blend() -> None:
        heaving._recent.clear()
        heaving.plane_at(11.1)

    runs["table of one ping, by blending"] = blend
    seconds = best_seconds(runs)
    return [Result(name, 1e3 * best, "ms", "" if "blending" in name else "goal 20") for name, best in seconds.items()]


SMALL = {"AT_ONCE": 256, "CALLS": 1}
BENCHES = [look_ups, making]
