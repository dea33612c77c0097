"""Legs of fast reverberation off local planes, as columns of its samples. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines.radial_tables import FamilyTable, RadialLegs
from insonify.jit import njit
from insonify.propagation.image_path_kernel import ImagePaths


@njit(cache=True, nogil=True, error_model="numpy")
def write_image_paths(
    points: NDArray[np.int64], paths: ImagePaths, reflection: NDArray[np.complex64], slowness: float, f: int,
    table: FamilyTable, legs: RadialLegs,
) -> None:  # fmt: skip
    """Overwrite some legs of one family.

    Args:
        points: Numbers of the samples that the legs reach, (m,).
        paths: The paths off local planes, m of them.
        reflection: Product of the reflection coefficients of each path [1], (m,).
        slowness: One over the speed of sound [s/m].
        f: Row of the family.
        table: Tables of the families.
        legs: Result, in row f of its columns.
    """
    normal, direction_factor, absorption = legs.normal, table.direction_factor, table.absorption_octaves
    delay, amplitude = legs.delay[f], legs.amplitude[f]
    departure, arrival = legs.departure[f], legs.arrival[f]
    last: Any = direction_factor.size - 1
    for m in range(points.size):
        n, length = points[m], paths.length[m]
        facing = 0.0
        for i in range(3):
            departure[i, n], arrival[i, n] = paths.departure[m, i], paths.arrival[m, i]
            facing += paths.arrival[m, i] * normal[i, n]
        delay[n] = length * slowness
        if facing >= 0 or not paths.is_valid[m]:
            amplitude[n] = 0
            continue
        pressure = 2.0 ** (-absorption * length) / length
        if last > 0:
            index = math.sqrt(min(max(1 + facing, 0.0), 1.0)) * last
            cell = min(int(index), last - 1)
            pressure *= math.sqrt(
                direction_factor[cell] + (index - cell) * (direction_factor[cell + 1] - direction_factor[cell])
            )
        amplitude[n] = reflection[m] * pressure
