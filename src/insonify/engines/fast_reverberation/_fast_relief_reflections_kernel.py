"""Legs of fast reverberation off local planes, as columns of its samples. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines.radial_tables import FamilyTable, RadialLegs
from insonify.jit import njit
from insonify.propagation.image_path_kernel import ImagePaths

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def reached_samples(
    position: Floats, amplitude: NDArray[np.complex64], legs: RadialLegs, list_starts: Integers, beam_bearing: Singles,
    rows: Integers, points: Floats,
) -> int:  # fmt: skip
    """Fill numbers and positions of the samples that legs of one family reach; return their number.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        amplitude: Amplitude of the legs, 0 for no path [1], (at least n,).
        legs: Legs to the n samples of s radials.
        list_starts: First sample of each radial in `beam_bearing`, (s,).
        beam_bearing: See `SampleLists`.
        rows: Result, (n,).
        points: Result, north, east, depth [m], (n, 3).
    """
    radial_offsets, range_depth, count = legs.radial_offsets, legs.range_depth, 0
    for s in range(list_starts.size):
        for n in range(radial_offsets[s], radial_offsets[s + 1]):
            leg, listed = amplitude[n], list_starts[s] + n - radial_offsets[s]
            if leg.real != 0 or leg.imag != 0:
                rows[count], points[count, 2] = n, range_depth[1, n]
                for i in range(2):
                    points[count, i] = position[i] + range_depth[0, n] * beam_bearing[i, listed]
                count += 1
    return count


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
