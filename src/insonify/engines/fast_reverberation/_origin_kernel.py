"""Positions, grazing angles and direct legs of the samples of radials. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._radial_legs_kernel import root_direction_factor
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

_ARCSINE_COEFFICIENTS = (
    1.5707963050, -0.2145988016, 0.0889789874, -0.0501743046, 0.0308918810, -0.0170881256, 0.0066700901, -0.0012624911,
)  # fmt: skip


@njit(inline="always")
def arcsine(x: float) -> float:
    """Arcsine of a number from 0 to 1, to 3e-8 rad [rad]; without a function call, so that loops are vectorised.

    Source: Abramowitz & Stegun (1964), 4.4.46; not verified, and compared with the library's.
    """
    a0, a1, a2, a3, a4, a5, a6, a7 = _ARCSINE_COEFFICIENTS
    series = a0 + x * (a1 + x * (a2 + x * (a3 + x * (a4 + x * (a5 + x * (a6 + x * a7))))))
    return math.pi / 2 - math.sqrt(max(1.0 - x, 0.0)) * series


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def grazing_angles(arrival: Singles, normal: Singles, grazing: Singles) -> None:
    """Fill the grazing angles of legs, from the facets of their samples.

    Args:
        arrival: Direction of travel at the samples [1], (f, 3, n).
        normal: Unit normals into the water, (3, n).
        grazing: Result [rad], (f, n).
    """
    for f in range(arrival.shape[0]):
        north, east, down, result = arrival[f, 0], arrival[f, 1], arrival[f, 2], grazing[f]
        for i in range(result.size):
            sine = north[i] * normal[0, i] + east[i] * normal[1, i] + down[i] * normal[2, i]
            result[i] = arcsine(min(np.float64(abs(sine)), 1.0))


@njit(cache=True, nogil=True, error_model="numpy")
def fill_positions(
    north: float, east: float, radial_offsets: Integers, list_starts: Integers, beam_bearing: Singles,
    range_depth: Floats, position: Floats,
) -> None:  # fmt: skip
    """Fill the positions of the samples of some radials.

    Args:
        north: North of the sonar [m].
        east: East of the sonar [m].
        radial_offsets: First sample of each radial, (s + 1,).
        list_starts: First sample of each radial in `beam_bearing`, (s,).
        beam_bearing: North and east component of the bearing of each listed point [1], (2, any).
        range_depth: Horizontal distance and depth of each sample [m], (2, n).
        position: Result, north, east, depth [m], (3, n).
    """
    for s in range(list_starts.size):
        span = slice(radial_offsets[s], radial_offsets[s + 1])
        columns, distance, depth = position[:, span], range_depth[0, span], range_depth[1, span]
        bearing = beam_bearing[:, list_starts[s] : list_starts[s] + distance.size]
        for i in range(distance.size):
            columns[0, i] = north + distance[i] * bearing[0, i]
            columns[1, i] = east + distance[i] * bearing[1, i]
            columns[2, i] = depth[i]


@njit(cache=True, nogil=True, error_model="numpy")
def unlit_points(amplitude: NDArray[np.complex64], points: Integers, unlit: Integers) -> int:
    """Find samples that no direct leg reaches; return their number.

    Args:
        amplitude: Pressure of the direct legs, see `RadialLegs`, 0 without a leg [1], (n,).
        points: Indices of some samples, (m,).
        unlit: Result: indices in `points` of the samples without a direct leg, (m,).
    """
    count = 0
    for k in range(points.size):
        leg = amplitude[points[k]]
        if leg.real == 0 and leg.imag == 0:
            unlit[count] = k
            count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def unoccluded_amplitudes(
    points: Integers, range_depth: Floats, depth: float, arrival: Singles, normal: Singles, absorption: float,
    direction_factor: Floats, unoccluded: NDArray[np.complex64],
) -> None:  # fmt: skip
    """Fill pressures of straight direct legs to some samples without occlusion, 0 where the seabed faces away.

    Args:
        points: Indices of the samples, (m,).
        range_depth: Horizontal distance and depth of each sample [m], (2, n).
        depth: Depth of the sonar [m].
        arrival: Direction of travel of the direct legs at the samples [1], (3, n).
        normal: Unit normals into the water, (3, n).
        absorption: Absorption as the base-2 exponent of pressure [1/m].
        direction_factor: Factor of one leg in the cross section, over the root of 1 less the sine of the grazing
            angle, 0 to 1 [1], (k,); empty: none.
        unoccluded: Result, see `RadialLegs.amplitude` [1], (m,).
    """
    for k in range(points.size):
        n = points[k]
        facing = -(arrival[0, n] * normal[0, n] + arrival[1, n] * normal[1, n] + arrival[2, n] * normal[2, n])
        unoccluded[k] = 0
        if facing > 0 and range_depth[1, n] > 0:
            slant_range = math.hypot(range_depth[0, n], range_depth[1, n] - depth)
            pressure = 2.0 ** (-absorption * slant_range) / slant_range
            if direction_factor.size > 0:
                pressure *= root_direction_factor(direction_factor, math.sqrt(max(1.0 - facing, 0.0)))
            unoccluded[k] = pressure
