"""Eigenrays read from tables: the same record as from the exact solver, for many points at once."""

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import COLUMNS, MOST
from insonify.propagation.eigenray import Eigenrays, gathered
from insonify.propagation.layers import Column
from insonify.propagation.tables import leg_table

Floats = NDArray[np.float64]


def table_eigenrays(
    water: Column, source_depth: float, point_depth: Floats, ranges: Floats, families: tuple[str, ...]
) -> Eigenrays:
    """Rays of the families to points, from a table of each family that spans them.

    Args:
        water: Sound speed from surface to seabed.
        source_depth: Depth of the source [m].
        point_depth: Depths of the points [m], (n,).
        ranges: Their horizontal distances [m], (n,).
        families: Names of the families.

    Returns:
        As `insonify.propagation.eigenrays`.

    Raises:
        insonify.propagation.tables.TableError: A table failed its comparison with exact rays.
    """
    found = {}
    span = (float(point_depth.min(initial=water.water_depth)), float(point_depth.max(initial=0.0)))
    for family in families:
        rays = np.zeros((ranges.size, MOST, COLUMNS))
        count, status = np.zeros(ranges.size, np.int64), np.zeros(ranges.size, np.uint8)
        if ranges.size:
            table = leg_table(
                water, family, source_depths=(source_depth, source_depth), point_depths=span,
                farthest=max(float(ranges.max()), 1.0),
            )  # fmt: skip
            held, count, status = table.rays(source_depth, point_depth, ranges)
            rays[:, : held.shape[1]] = held
        found[family] = (rays, count, status)
    return gathered(found)
