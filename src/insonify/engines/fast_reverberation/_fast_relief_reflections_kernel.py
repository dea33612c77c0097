"""Legs of fast reverberation reflected at local planes, as columns of its samples. Plain numbers and arrays only."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._radial_legs_kernel import root_direction_factor
from insonify.engines.radial_tables import FamilyTable, RadialLegs
from insonify.fast_exponential import exp2_nonpositive
from insonify.jit import njit
from insonify.propagation.image_path_kernel import ImagePaths

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

CHUNK = 128
"""Legs that are evaluated together, in the first-level cache."""
_ROW, _DOWN, _DEPARTURE, _REAL, _LENGTH, _ROOT = (np.uint64(CHUNK * row) for row in (1, 2, 3, 6, 8, 9))
"""Length of a row of the workspace, and starts of later rows; the first three rows are the arrival.

Then three of departure, real and imaginary part of pressure, length, and root of one less the sine of grazing angle.
"""


class SamplesOnSegments(NamedTuple):
    """Samples that legs of one family reach, on segments of radials between two of them, the nodes."""

    row: Integers
    """Index of each sample in the columns of `RadialLegs`, (m,)."""
    segment: Integers
    """Index of the node at which the segment begins; the next one ends it, (m,)."""
    fraction: Floats
    """Distance of the sample from that node, re the length of the segment [1], (m,)."""
    listed: Integers
    """Index of each sample in the columns of points of `SampleLists`, (m,)."""
    point: Floats
    """North, east, depth of the nodes [m], (k, 3)."""


@njit(cache=True, nogil=True, error_model="numpy")
def reached_samples(
    position: Floats, amplitude: NDArray[np.complex64], legs: RadialLegs, list_starts: Integers, beam_bearing: Singles,
    node_spacing: tuple[float, float], samples: SamplesOnSegments,
) -> tuple[int, int]:  # fmt: skip
    """Fill the samples that legs of one family reach and the nodes among them; return the numbers of both.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        amplitude: Pressure of the family's legs, see `RadialLegs`, 0 for no path [1], (at least n,).
        legs: Legs to the n samples of s radials.
        list_starts: First sample of each radial in `beam_bearing`, (s,).
        beam_bearing: See `SampleLists`.
        node_spacing: Longest segment over the root of the leg's length [m^0.5], and height of the family's image of the
            sonar above or below the mean seabed [m].
        samples: Result, columns of shape (n,) and (n, 3) of which the first elements are filled.
    """
    row, segment, fraction, listed, point = samples
    radial_offsets, distance, depth = legs.radial_offsets, legs.range_depth[0], legs.range_depth[1]
    length_factor, image_height = node_spacing
    count, nodes = 0, 0
    for s in range(list_starts.size):
        first, list_shift = count, list_starts[s] - radial_offsets[s]
        for n in range(radial_offsets[s], radial_offsets[s + 1]):
            if amplitude[n].real != 0 or amplitude[n].imag != 0:
                row[count], listed[count] = n, n + list_shift
                count += 1
        begin = first
        while begin < count:
            node_distance, next_node = distance[row[begin]], begin + 1
            longest = length_factor * math.sqrt(math.hypot(node_distance, image_height))
            while next_node + 1 < count and distance[row[next_node + 1]] - node_distance <= longest:
                next_node += 1
            length = distance[row[min(next_node, count - 1)]] - node_distance
            for m in range(begin, min(next_node, count)):
                segment[m], fraction[m] = nodes, (distance[row[m]] - node_distance) / length if m > begin else 0.0
            n, listed_node = row[begin], listed[begin]
            for i in range(2):
                point[nodes, i] = position[i] + distance[n] * beam_bearing[i, listed_node]
            point[nodes, 2] = depth[n]
            nodes, begin = nodes + 1, next_node
    return count, nodes


@njit(cache=True, nogil=True, error_model="numpy")
def _node_columns(
    position: Floats, point: Floats, paths: ImagePaths, reflection: NDArray[np.complex64], sign: float
) -> Floats:
    """Columns of k nodes that are interpolated linearly along segments, (k, 8).

    Args:
        position: North, east, depth of the sonar [m], (3,).
        point: North, east, depth of the nodes [m], (k, 3).
        paths: Paths to the nodes.
        reflection: Product of the reflection coefficients of each path [1], (k,).
        sign: -1 for a family with an odd number of bounces, else 1.

    Returns:
        Position of the sonar's image re the sonar [m]; departure less arrival, of which the vertical part is multiplied
        by `sign` [1]; real and imaginary part of the reflection, 0 without a path [1].
    """
    columns = np.empty((point.shape[0], 8))
    for k in range(point.shape[0]):
        for i in range(3):
            direction = paths.arrival[k, i]
            columns[k, i] = point[k, i] - position[i] - paths.length[k] * direction
            columns[k, 3 + i] = paths.departure[k, i] - (sign * direction if i == 2 else direction)
        columns[k, 6], columns[k, 7] = (reflection[k].real, reflection[k].imag) if paths.is_valid[k] else (0.0, 0.0)
    return columns


@njit(cache=True, nogil=True, error_model="numpy")
def _interpolate_columns(
    begin: int, depth: float, samples: SamplesOnSegments, nodes: Floats, legs: RadialLegs, beam_bearing: Singles,
    workspace: Floats,
) -> None:  # fmt: skip
    """Interpolate the columns of the nodes at the next `CHUNK` samples.

    The first three become the vector from the image to the sample.

    Args:
        begin: Index of the first of these samples.
        depth: Depth of the sonar [m].
        samples: The samples.
        nodes: See `_node_columns`.
        legs: Legs of the radials.
        beam_bearing: See `SampleLists`.
        workspace: Result: 8 rows of `CHUNK` elements, and 3 rows with the normals of the samples.
    """
    distances, depths = legs.range_depth[0], legs.range_depth[1]
    values, normal_n, normal_e, normal_d = nodes.reshape(nodes.size), legs.normal[0], legs.normal[1], legs.normal[2]
    bearing_n, bearing_e = beam_bearing[0], beam_bearing[1]
    real, imaginary = np.uint64(6), np.uint64(7)
    for q in range(np.uint64(min(CHUNK, samples.row.size - begin))):
        m = np.uint64(begin) + q
        n, t, listed = np.uint64(samples.row[m]), samples.fraction[m], np.uint64(samples.listed[m])
        low = np.uint64(8) * np.uint64(samples.segment[m])
        high = low + np.uint64(8 if t > 0 else 0)
        if (values[low + real] == 0 and values[low + imaginary] == 0) or (
            values[high + real] == 0 and values[high + imaginary] == 0
        ):  # the nearer one, with or without a path
            low = high = low if t < 0.5 else high
        for i in range(np.uint64(8)):
            workspace[i * _ROW + q] = values[low + i] + t * (values[high + i] - values[low + i])
        workspace[q] = distances[n] * bearing_n[listed] - workspace[q]
        workspace[_ROW + q] = distances[n] * bearing_e[listed] - workspace[_ROW + q]
        workspace[_DOWN + q] = depths[n] - depth - workspace[_DOWN + q]
        workspace[_LENGTH + q], workspace[_ROOT + q], workspace[_ROOT + _ROW + q] = (
            normal_n[n],
            normal_e[n],
            normal_d[n],
        )


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _reflect(count: int, sign: float, absorption: np.float32, workspace: Floats) -> None:
    """Lengths, directions, pressures and roots of one less the sine of the grazing angle, in place.

    Args:
        count: Number of legs.
        sign: Vertical component of the direction at the sonar re that at the sample, without tilt of planes, 1 or -1.
        absorption: Absorption as the base-2 exponent of pressure [1/m].
        workspace: Columns of `_interpolate_columns`. Result: arrival; departure; pressure re 1 m; length [m], and
            root [1].
    """
    for q in range(np.uint64(count)):  # in one array: no loop over so many arrays is vectorised
        x, y, z = workspace[q], workspace[_ROW + q], workspace[_DOWN + q]
        length = math.sqrt(x * x + y * y + z * z)
        inverse = 1 / length
        x, y, z = x * inverse, y * inverse, z * inverse
        workspace[q], workspace[_ROW + q], workspace[_DOWN + q] = x, y, z
        workspace[_DEPARTURE + q] += x
        workspace[_DEPARTURE + _ROW + q] += y
        workspace[_DEPARTURE + _DOWN + q] += sign * z
        a, b, c = workspace[_LENGTH + q], workspace[_ROOT + q], workspace[_ROOT + _ROW + q]
        facing = x * a + y * b + z * c
        pressure: Any = np.float64(exp2_nonpositive(-absorption * np.float32(length))) * inverse
        pressure = pressure if facing < 0 else 0.0
        workspace[_REAL + q] *= pressure
        workspace[_REAL + _ROW + q] *= pressure
        workspace[_LENGTH + q], workspace[_ROOT + q] = length, math.sqrt(min(max(1 + facing, 0.0), 1.0))


@njit(cache=True, nogil=True, error_model="numpy")
def write_image_paths(
    position: Floats, samples: SamplesOnSegments, beam_bearing: Singles, paths: ImagePaths,
    reflection: NDArray[np.complex64], slowness: float, f: int, table: FamilyTable, legs: RadialLegs,
) -> None:  # fmt: skip
    """Overwrite the legs of one family to some samples: images of the sonar are interpolated along segments.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        samples: The samples.
        beam_bearing: See `SampleLists`.
        paths: The paths to the k nodes, reflected at local planes.
        reflection: Product of the reflection coefficients of each path [1], (k,).
        slowness: One over the speed of sound [s/m].
        f: Row of the family.
        table: Tables of the families.
        legs: Result, in row f of its columns.
    """
    direction_factor, absorption = table.direction_factor, np.float32(table.absorption_exponent)
    delay, amplitude, departure, arrival = legs.delay[f], legs.amplitude[f], legs.departure[f], legs.arrival[f]
    sign = 1.0
    for q in range(table.bounce_codes.shape[1]):
        sign = -sign if table.bounce_codes[f, q] > 0 else sign
    nodes = _node_columns(position, samples.point, paths, reflection, sign)
    workspace = np.empty(11 * CHUNK)
    for begin in range(0, samples.row.size, CHUNK):
        count = min(CHUNK, samples.row.size - begin)
        _interpolate_columns(begin, position[2], samples, nodes, legs, beam_bearing, workspace)
        _reflect(count, sign, absorption, workspace)
        rows = samples.row[begin : begin + count]
        for q in range(np.uint64(count)):
            n, factor = rows[q], 1.0
            if direction_factor.size > 0:
                factor = root_direction_factor(direction_factor, workspace[_ROOT + q])
            for i in range(np.uint64(3)):
                arrival[i, n], departure[i, n] = workspace[i * _ROW + q], workspace[_DEPARTURE + i * _ROW + q]
            delay[n] = workspace[_LENGTH + q] * slowness
            amplitude[n] = complex(factor * workspace[_REAL + q], factor * workspace[_REAL + _ROW + q])


@njit(cache=True, nogil=True, error_model="numpy")
def displace_refracted_legs(
    position: Floats, samples: SamplesOnSegments, beam_bearing: Singles, paths: ImagePaths, f: int, table: FamilyTable,
    legs: RadialLegs,
) -> None:  # fmt: skip
    """Change the refracted legs of one family to some samples as local planes change straight ones.

    To first order a plane that is h higher at a bounce shortens a leg by 2 h sin(grazing) in any water, so the change
    of the straight path is multiplied by the ratio of the vertical directions at the sample.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        samples: The samples.
        beam_bearing: See `SampleLists`.
        paths: Straight paths to the k nodes, reflected at local planes or, where there is none, at the mean seabed.
        f: Row of the family.
        table: Tables of the families.
        legs: Legs over the mean seabed, changed in row f of its columns.
    """
    direction_factor, absorption, image = table.direction_factor, table.absorption_exponent, table.image_depths[f]
    delay, amplitude, departure, arrival = legs.delay[f], legs.amplitude[f], legs.departure[f], legs.arrival[f]
    sign = 1.0
    for q in range(table.bounce_codes.shape[1]):
        sign = -sign if table.bounce_codes[f, q] > 0 else sign
    nodes = _node_columns(position, samples.point, paths, np.ones(paths.length.size, np.complex64), sign)
    workspace, change, turned = np.empty(11 * CHUNK), np.empty((2, 3)), np.empty((2, 3))
    for begin in range(0, samples.row.size, CHUNK):
        _interpolate_columns(begin, position[2], samples, nodes, legs, beam_bearing, workspace)
        for q in range(np.uint64(min(CHUNK, samples.row.size - begin))):
            n, listed = samples.row[begin + q], samples.listed[begin + q]
            x, y, z = workspace[q], workspace[_ROW + q], workspace[_DOWN + q]
            distance, height = legs.range_depth[0, n], legs.range_depth[1, n] - image
            length, flat_length = math.sqrt(x * x + y * y + z * z), math.sqrt(distance * distance + height * height)
            change[0, 0] = x / length - distance * beam_bearing[0, listed] / flat_length
            change[0, 1] = y / length - distance * beam_bearing[1, listed] / flat_length
            change[0, 2] = z / length - height / flat_length
            for i in range(3):
                turn = sign if i == 2 else 1.0
                change[1, i] = workspace[_DEPARTURE + np.uint64(i) * _ROW + q] + turn * change[0, i]
            excess = (length - flat_length) * abs(arrival[2, n]) * flat_length / height
            delay[n] += excess / table.refraction.bed_speed
            scale = 2.0 ** (-absorption * excess) * flat_length / (flat_length + excess)
            scale /= _root_direction_factor(arrival, legs.normal, n, direction_factor)
            for side in range(2):
                columns = arrival if side == 0 else departure
                square = 0.0
                for i in range(3):
                    turned[side, i] = columns[i, n] + change[side, i]
                    square += turned[side, i] * turned[side, i]
                for i in range(3):
                    columns[i, n] = turned[side, i] / math.sqrt(square)
            amplitude[n] *= scale * _root_direction_factor(arrival, legs.normal, n, direction_factor)


@njit(cache=True, nogil=True, error_model="numpy")
def _root_direction_factor(arrival: Singles, normal: Singles, n: int, factor: Singles) -> float:
    """Root of the direction factor of a law at a sample, 0 where its facet faces away, 1 for a law without one [1]."""
    facing = arrival[0, n] * normal[0, n] + arrival[1, n] * normal[1, n] + arrival[2, n] * normal[2, n]
    if facing >= 0:
        return 0.0
    return root_direction_factor(factor, math.sqrt(min(max(1 + facing, 0.0), 1.0))) if factor.size > 0 else 1.0
