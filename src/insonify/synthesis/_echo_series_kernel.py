"""Kernels that describe echoes along an array by series: their delay, spreading and Doppler factor.

Along a straight array these are smooth where the array is short re its distance. In water of one sound speed wavefronts
are spheres, and each power of the position along the array follows from those before it. In layered water echoes are
evaluated at a few Chebyshev nodes (`chebyshev_nodes`). Plain numbers and arrays.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._arrival_time_kernel import CLOSEST, ArrayWater, ArrivalColumns, ElementMotion, arrival_times
from insonify.synthesis._waveform_basis_kernel import BasisWeights

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
TILE = 1024
"""Echoes that are evaluated together."""
ROW = TILE + 16
"""Length of rows of work arrays, with room for a whole last vector."""
MOST_POWERS = 9
"""Number of terms of the power series of times of arrival."""
_FAST = {"contract", "nsz", "arcp"}  # no reassociation: the order of sums would follow from the cache


class ApertureNodes(NamedTuple):
    """Nodes along an array at which echoes are evaluated, k of them."""

    position: Floats
    """Position from the array's centre, in the world, at the start of the ping [m], (k, 3)."""
    velocity: Floats
    """Velocity at the start of the ping [m/s], (k, 3)."""
    acceleration: Floats
    """Acceleration [m/s^2], (k, 3)."""
    series: Floats
    """Matrix from values at the nodes to coefficients of a Chebyshev series [1], (k, k); (0, 0): the nodes are the
    elements."""
    polynomials: Floats
    """Chebyshev polynomials at each element, then at each interpolation point of the sector [1], (elements + p, k)."""


class EchoSeries(NamedTuple):
    """Series along an array of the echoes of a tile, in order of arrival, and their values at the nodes."""

    time: Floats
    """Coefficients of times of arrival [s], (terms, tile)."""
    single: Singles
    """Coefficients of spreading ratio and coordinate in the waveform basis [1], (2, terms, tile)."""
    half_curvature: float
    """Half the second derivative of the third polynomial: 1 of powers, 2 of Chebyshev polynomials."""
    motion: Floats
    """Position [m], velocity [m/s] and acceleration [m/s^2] of the array's middle, and of its end re that, (6, 3)."""
    node_time: Floats
    """Times of arrival at the nodes [s], (nodes, tile)."""
    node_spreading: Singles
    """Spreading ratios at the nodes [1], (nodes, tile)."""
    node_x: Singles
    """Coordinates in the waveform basis at the nodes [1], (nodes, tile)."""
    node_doppler: Floats
    """Doppler factors less one at the nodes [1], (nodes, tile)."""


@njit(inline="always")
def whole_vectors(count: int) -> int:
    """The count rounded up to whole vectors of 16: no loop ends with single echoes, and work arrays have room."""
    return (count + 15) & ~15


@njit(inline="always")
def few_terms(terms: int) -> int:
    """Number of terms of spreading and Doppler factor, of which fewer digits are needed than of delays."""
    return max(terms - 2, 3)


@njit(inline="always")
def inverse_half_range(basis: BasisWeights) -> float:
    """One over half the range of Doppler factors; 0 for one waveform."""
    return 1 / basis.half_range if basis.half_range > 0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def series_along(nodes: ApertureNodes, water: ArrayWater, basis: BasisWeights) -> tuple[EchoSeries, Floats]:
    """Work arrays for series along an array, and the values of the polynomials at elements and points.

    Polynomials are powers in water of one sound speed, shape (elements + p, terms).
    """
    count, coordinate = nodes.series.shape[0], nodes.polynomials
    motion, half_curvature, polynomials = np.zeros((6, 3)), 2.0, coordinate
    if 0 < count < MOST_POWERS and not water.is_layered:
        half_curvature = 1.0
        for row, part in enumerate((nodes.position, nodes.velocity, nodes.acceleration)):
            motion[row], motion[row + 3] = nodes.series[0] @ part, nodes.series[1] @ part
        polynomials = np.ones((len(coordinate), count + 1))  # one power more than nodes: powers converge more slowly
        for power in range(1, count + 1):
            polynomials[:, power] = coordinate[:, 1] ** power
    most, rows = max(count, MOST_POWERS), max(count, 1)
    doppler = np.empty((rows, TILE))
    doppler[:] = basis.centre_doppler
    series = EchoSeries(
        np.empty((most, TILE)), np.empty((2, most, TILE), np.float32), half_curvature, motion, np.empty((rows, TILE)),
        np.empty((rows, TILE), np.float32), np.empty((rows, TILE), np.float32), doppler,
    )  # fmt: skip
    return series, polynomials


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def values_at_node(
    k: int, row: int, echoes: ArrivalColumns, count: int, nodes: ApertureNodes, water: ArrayWater, basis: BasisWeights,
    series: EchoSeries,
) -> None:  # fmt: skip
    """Fill times of arrival, spreading and coordinates of some echoes at node k, in one row of the node values."""
    node, inverse_range = (
        ElementMotion(nodes.position[k], nodes.velocity[k], nodes.acceleration[k]),
        inverse_half_range(basis),
    )
    doppler, x = series.node_doppler[row], series.node_x[row]
    arrival_times(echoes, count, node, water, series.node_time[row], series.node_spreading[row], doppler)
    for m in range(count):
        x[m] = np.float32((doppler[m] - basis.centre_doppler) * inverse_range)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def fill_series(
    columns: Floats, echoes: ArrivalColumns, count: int, nodes: ApertureNodes, water: ArrayWater, basis: BasisWeights,
    series: EchoSeries,
) -> None:  # fmt: skip
    """Fill series of some echoes along a straight array.

    Args:
        columns: Columns of the echoes, see `_gather_echoes`, (8, tile).
        echoes: The same columns by name, and the expansion.
        count: Number of echoes.
        nodes: The nodes.
        water: The water.
        basis: Waveform basis.
        series: Result: the series.
    """
    if series.half_curvature == 1.0:
        _series_of_spheres(columns, count, series.motion, water, basis, series)
        return
    for k in range(nodes.series.shape[0]):
        values_at_node(k, k, echoes, count, nodes, water, basis, series)
    _series_of_nodes(count, nodes.series, series)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _series_of_nodes(count: int, node_series: Floats, series: EchoSeries) -> None:
    """Fill Chebyshev series of some echoes from their values at the nodes; node_series: `ApertureNodes.series`."""
    time, single = series.time, series.single
    for j in range(node_series.shape[0]):
        time[j, :count] = 0
        for k in range(node_series.shape[0]):
            share = node_series[j, k]
            for m in range(count):
                time[j, m] += share * series.node_time[k, m]
    for j in range(few_terms(node_series.shape[0])):
        single[:, j, :count] = 0
        for k in range(node_series.shape[0]):
            share_of_node = np.float32(node_series[j, k])
            for m in range(count):
                single[0, j, m] += share_of_node * series.node_spreading[k, m]
                single[1, j, m] += share_of_node * series.node_x[k, m]


@njit(inline="always")
def _dot(x: float, y: float, z: float, u: float, v: float, w: float) -> float:
    """Scalar product of two vectors."""
    return x * u + y * v + z * w


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _series_of_spheres(
    columns: Floats, count: int, motion: Floats, water: ArrayWater, basis: BasisWeights,
    series: EchoSeries,
) -> None:  # fmt: skip
    """Fill power series of echoes along an array in water of one sound speed, whose wavefronts are spheres.

    An echo comes to the array's middle over R, and to s times half the array, s H, a time d later:
    |R - s H - d V - s d W - d^2 A / 2| = |R| + c d, with V and A the middle's velocity and acceleration and W the
    velocity of the array's end re it. Squared, this gives the coefficients of d one after the other.

    Args:
        columns: Columns of the echoes, see `_gather_echoes`, (8, tile).
        count: Number of echoes.
        motion: Motion of the array, see `EchoSeries.motion`, (6, 3).
        water: The water.
        basis: Waveform basis.
        series: Result: the series: `MOST_POWERS` terms of times, `few_terms` of the others.
    """
    slowness, attenuation, pulse_middle = water.slowness, water.attenuation, water.pulse_middle
    c, middle, inverse_range = 1 / slowness, basis.centre_doppler, inverse_half_range(basis)
    echo, time, single = columns.reshape(-1), series.time.reshape(-1), series.single.reshape(-1)
    px, py, pz, vx, vy, vz = motion[0, 0], motion[0, 1], motion[0, 2], motion[1, 0], motion[1, 1], motion[1, 2]
    ax, ay, az, hx, hy, hz = motion[2, 0], motion[2, 1], motion[2, 2], motion[3, 0], motion[3, 1], motion[3, 2]
    wx, wy, wz, bx, by, bz = motion[4, 0], motion[4, 1], motion[4, 2], motion[5, 0], motion[5, 1], motion[5, 2]
    for m in range(count):
        delay, r, u, v, w = echo[m], echo[2 * TILE + m], echo[4 * TILE + m], echo[5 * TILE + m], echo[6 * TILE + m]
        rate = 1 - _dot(u, v, w, vx, vy, vz) * slowness
        half = 0.5 * delay
        x, y, z = px + delay * (vx + half * ax), py + delay * (vy + half * ay), pz + delay * (vz + half * az)
        change = _dot(x, y, z, x, y, z) - 2 * r * _dot(u, v, w, x, y, z)
        tau = delay + change / (math.sqrt(max(r * r + change, 0.0)) + r) * slowness * rate
        half = 0.5 * tau
        x, y, z = px + tau * (vx + half * ax), py + tau * (vy + half * ay), pz + tau * (vz + half * az)
        change = _dot(x, y, z, x, y, z) - 2 * r * _dot(u, v, w, x, y, z)
        distance = max(math.sqrt(max(r * r + change, 0.0)), CLOSEST)
        excess = change / (distance + r)
        tau += (delay + excess * slowness - tau) * rate
        half = 0.5 * tau
        x, y, z = r * u - x, r * v - y, r * w - z
        v_x, v_y, v_z = vx + tau * ax, vy + tau * ay, vz + tau * az
        h_x, h_y, h_z = hx + tau * (wx + half * bx), hy + tau * (wy + half * by), hz + tau * (wz + half * bz)
        w_x, w_y, w_z = wx + tau * bx, wy + tau * by, wz + tau * bz
        range_velocity, range_acceleration, speed_square = (
            _dot(x, y, z, v_x, v_y, v_z),
            _dot(x, y, z, ax, ay, az),
            _dot(v_x, v_y, v_z, v_x, v_y, v_z),
        )
        linear_rate = _dot(x, y, z, w_x, w_y, w_z) - _dot(h_x, h_y, h_z, v_x, v_y, v_z)
        end_velocity = _dot(h_x, h_y, h_z, w_x, w_y, w_z)
        cross = 2 * _dot(v_x, v_y, v_z, w_x, w_y, w_z) + _dot(h_x, h_y, h_z, ax, ay, az) - _dot(x, y, z, bx, by, bz)
        inverse = 1 / (distance * (distance * c + range_velocity))
        scale = distance * inverse
        f, b, q, g = (
            0.5 * _dot(h_x, h_y, h_z, h_x, h_y, h_z) * scale, -linear_rate * scale,
            0.5 * (speed_square - c * c - range_acceleration) * scale, end_velocity * scale,
        )  # fmt: skip
        d1 = -_dot(x, y, z, h_x, h_y, h_z) * scale
        d2 = f + b * d1 + q * d1 * d1
        d3 = b * d2 + (2 * q * d2 + 0.5 * cross * scale * d1 + g) * d1
        d4 = b * d3 + q * (2 * d1 * d3 + d2 * d2) + (g + cross * scale * d1) * d2
        d5 = b * d4 + 2 * q * (d1 * d4 + d2 * d3) + g * d3
        d6 = b * d5 + q * (2 * (d1 * d5 + d2 * d4) + d3 * d3) + g * d4
        d7 = b * d6 + 2 * q * (d1 * d6 + d2 * d5 + d3 * d4) + g * d5
        d8 = b * d7 + q * (2 * (d1 * d7 + d2 * d6 + d3 * d5) + d4 * d4) + g * d6
        time[m], time[TILE + m], time[2 * TILE + m] = tau - pulse_middle, d1, d2
        time[3 * TILE + m], time[4 * TILE + m], time[5 * TILE + m] = d3, d4, d5
        time[6 * TILE + m], time[7 * TILE + m], time[8 * TILE + m] = d6, d7, d8
        # one over the distance: its series re its first term
        closer, per = (distance * c + range_velocity) * inverse, -c * (distance * c + range_velocity) * inverse
        y1, y2, y3, y4, y5, y6 = per * d1, per * d2, per * d3, per * d4, per * d5, per * d6
        g1 = y1
        g2 = y2 + y1 * g1
        g3 = y3 + y2 * g1 + y1 * g2
        g4 = y4 + y3 * g1 + y2 * g2 + y1 * g3
        g5 = y5 + y4 * g1 + y3 * g2 + y2 * g3 + y1 * g4
        g6 = y6 + y5 * g1 + y4 * g2 + y3 * g3 + y2 * g4 + y1 * g5
        at_middle, loss = r * closer * (1 - attenuation * excess), r * attenuation
        single[m] = at_middle
        single[TILE + m] = at_middle * g1 + loss * y1
        single[2 * TILE + m] = at_middle * g2 + loss * (y2 + g1 * y1)
        single[3 * TILE + m] = at_middle * g3 + loss * (y3 + g1 * y2 + g2 * y1)
        single[4 * TILE + m] = at_middle * g4 + loss * (y4 + g1 * y3 + g2 * y2 + g3 * y1)
        single[5 * TILE + m] = at_middle * g5 + loss * (y5 + g1 * y4 + g2 * y3 + g3 * y2 + g4 * y1)
        single[6 * TILE + m] = at_middle * g6 + loss * (y6 + g1 * y5 + g2 * y4 + g3 * y3 + g4 * y2 + g5 * y1)
        range_rate_change = range_acceleration - speed_square
        n0, n1, n2, n3 = (
            range_velocity,
            linear_rate + d1 * range_rate_change,
            d2 * range_rate_change - end_velocity - d1 * cross,
            d3 * range_rate_change,
        )
        transmit_doppler = echo[7 * TILE + m]
        size = slowness * closer * transmit_doppler * inverse_range
        single[MOST_POWERS * TILE + m] = size * n0 + (transmit_doppler - 1 - middle) * inverse_range
        single[(MOST_POWERS + 1) * TILE + m] = size * (n1 + g1 * n0)
        single[(MOST_POWERS + 2) * TILE + m] = size * (n2 + g1 * n1 + g2 * n0)
        single[(MOST_POWERS + 3) * TILE + m] = size * (n3 + g1 * n2 + g2 * n1 + g3 * n0)
        single[(MOST_POWERS + 4) * TILE + m] = size * (g1 * n3 + g2 * n2 + g3 * n1 + g4 * n0)
        single[(MOST_POWERS + 5) * TILE + m] = size * (g2 * n3 + g3 * n2 + g4 * n1 + g5 * n0)
        single[(MOST_POWERS + 6) * TILE + m] = size * (g3 * n3 + g4 * n2 + g5 * n1 + g6 * n0)
