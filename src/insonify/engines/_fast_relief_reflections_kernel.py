"""Legs of fast reverberation off local planes, as columns of its points. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.image_path_kernel import ImagePaths

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def write_image_paths(
    some: NDArray[np.int64], way: ImagePaths, mirrors: NDArray[np.complex64], normal: Singles, factor: Singles,
    loss: float, slowness: float, delay: Floats, amplitude: NDArray[np.complex64], departure: Singles, arrival: Singles,
) -> None:  # fmt: skip
    """Write some legs of one family anew.

    Args:
        some: Which points they lead to, (m,).
        way: The paths off local planes, m of them.
        mirrors: What all mirrors of each way leave [1], (m,).
        normal: Unit normal into the water, (3, n).
        factor: Of a law that is a product of one for each direction, see `CompiledLaw.factor`; empty for any other.
        loss: Absorption [octaves of pressure/m].
        slowness: One over the speed of sound [s/m].
        delay: Result, one-way travel time [s], (n,).
        amplitude: Result, pressure re 1 m, times the root of the direction's factor if there is one [1]; 0 where there
            is no way, (n,).
        departure: Result, direction of travel at the sonar, (3, n).
        arrival: Result, direction of travel at the point, (3, n).
    """
    last: Any = factor.size - 1
    for m in range(some.size):
        n, length = some[m], way.length[m]
        off = 0.0
        for i in range(3):
            departure[i, n], arrival[i, n] = way.departure[m, i], way.arrival[m, i]
            off += way.arrival[m, i] * normal[i, n]
        delay[n] = length * slowness
        if off >= 0 or not way.is_valid[m]:
            amplitude[n] = 0
            continue
        size = 2.0 ** (-loss * length) / length
        if last > 0:
            at = math.sqrt(min(max(1 + off, 0.0), 1.0)) * last
            cell = min(int(at), last - 1)
            size *= math.sqrt(factor[cell] + (at - cell) * (factor[cell + 1] - factor[cell]))
        amplitude[n] = mirrors[m] * size
