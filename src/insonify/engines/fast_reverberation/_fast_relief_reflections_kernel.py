"""Legs of fast reverberation off local planes, as columns of its samples. Plain numbers and arrays only."""

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
"""Size of a row of the workspace, and starts of rows: arrival (three), departure (three), pressure (two), others."""


class SamplesOnSegments(NamedTuple):
    """Samples that legs of one family reach, on segments of radials between two of them, the nodes."""

    row: Integers
    """Number of each sample, (m,)."""
    segment: Integers
    """Node at which the segment begins; the next one ends it, (m,)."""
    fraction: Floats
    """Part of the segment before the sample [1], (m,)."""
    listed: Integers
    """Number of each sample in `SampleLists`, (m,)."""
    point: Floats
    """North, east, depth of the nodes [m], (k, 3)."""


@njit(cache=True, nogil=True, error_model="numpy")
def reached_samples(
    position: Floats, amplitude: NDArray[np.complex64], legs: RadialLegs, list_starts: Integers, beam_bearing: Singles,
    spacing: tuple[float, float], samples: SamplesOnSegments,
) -> tuple[int, int]:  # fmt: skip
    """Fill the samples that legs of one family reach; return their number, and that of the nodes.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        amplitude: Amplitude of the legs, 0 for no path [1], (at least n,).
        legs: Legs to the n samples of s radials.
        list_starts: First sample of each radial in `beam_bearing`, (s,).
        beam_bearing: See `SampleLists`.
        spacing: Longest segment over the root of the leg's length [m^0.5], and height of the family's image of the
            sonar above the seabed [m].
        samples: Result, (n,) and (n, 3).
    """
    row, segment, fraction, listed, point = samples
    radial_offsets, distance, depth = legs.radial_offsets, legs.range_depth[0], legs.range_depth[1]
    per_root, height = spacing
    count, nodes = 0, 0
    for s in range(list_starts.size):
        first, shift = count, list_starts[s] - radial_offsets[s]
        for n in range(radial_offsets[s], radial_offsets[s + 1]):
            if amplitude[n].real != 0 or amplitude[n].imag != 0:
                row[count], listed[count] = n, n + shift
                count += 1
        begin = first
        while begin < count:
            at, end = distance[row[begin]], begin + 1
            longest = per_root * math.sqrt(math.hypot(at, height))
            while end + 1 < count and distance[row[end + 1]] - at <= longest:
                end += 1
            length = distance[row[min(end, count - 1)]] - at
            for m in range(begin, min(end, count)):
                segment[m], fraction[m] = nodes, (distance[row[m]] - at) / length if m > begin else 0.0
            n, at_sonar = row[begin], listed[begin]
            for i in range(2):
                point[nodes, i] = position[i] + distance[n] * beam_bearing[i, at_sonar]
            point[nodes, 2] = depth[n]
            nodes, begin = nodes + 1, end
    return count, nodes


@njit(cache=True, nogil=True, error_model="numpy")
def _node_columns(
    position: Floats, point: Floats, paths: ImagePaths, reflection: NDArray[np.complex64], sign: float
) -> Floats:
    """Columns of the nodes that are linear along segments, (k, 8).

    They are the image of the sonar re the sonar [m], departure less arrival, the latter's vertical part times `sign`,
    and the reflection, 0 without a path.
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
    """Interpolate the columns of the nodes at the next samples; the first three become vectors from image to sample.

    Args:
        begin: First of the samples.
        depth: Depth of the sonar [m].
        samples: The samples.
        nodes: See `_node_columns`.
        legs: Legs of the radials.
        beam_bearing: See `SampleLists`.
        workspace: Result, and the normals of the samples, 11 rows of `CHUNK`.
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
        sign: Factor of the vertical direction at the sonar.
        absorption: Absorption as the base-2 exponent of pressure [1/m].
        workspace: Columns of `_interpolate_columns`. Result: arrival; departure; pressure; length [m], and root [1].
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
    """Overwrite the legs of one family to some samples: images of the sonar are linear along segments.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        samples: The samples.
        beam_bearing: See `SampleLists`.
        paths: The paths to the nodes off local planes, k of them.
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
    """Move the refracted legs of one family to some samples by what local planes change in straight ones.

    To first order a plane that is h higher at a bounce shortens a leg by 2 h sin(grazing) in any water, so the change
    of the straight path is scaled by the ratio of the sines.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        samples: The samples.
        beam_bearing: See `SampleLists`.
        paths: Straight paths to the nodes, off local planes or, where there is none, off the mean seabed, k of them.
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
            for end in range(2):
                columns = arrival if end == 0 else departure
                square = 0.0
                for i in range(3):
                    turned[end, i] = columns[i, n] + change[end, i]
                    square += turned[end, i] * turned[end, i]
                for i in range(3):
                    columns[i, n] = turned[end, i] / math.sqrt(square)
            amplitude[n] *= scale * _root_direction_factor(arrival, legs.normal, n, direction_factor)


@njit(cache=True, nogil=True, error_model="numpy")
def _root_direction_factor(arrival: Singles, normal: Singles, n: int, factor: Singles) -> float:
    """Root of the direction factor of a law at a sample, 0 where its facet faces away, 1 for a law without one [1]."""
    facing = arrival[0, n] * normal[0, n] + arrival[1, n] * normal[1, n] + arrival[2, n] * normal[2, n]
    if facing >= 0:
        return 0.0
    return root_direction_factor(factor, math.sqrt(min(max(1 + facing, 0.0), 1.0))) if factor.size > 0 else 1.0
