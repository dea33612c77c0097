"""Envelope of the two-way pressure gain at positions on a flat boundary: the arithmetic of `engines.beam_importance`.

Positions are processed in batches that stay in the nearest cache. The columns of a batch lie in rows of one array, so
that the compiler can vectorise loops over them.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._glint_spread_kernel import cosine_spreads, pattern_with_spread
from insonify.jit import njit
from insonify.sonar.beam_kernels import (
    CHANNELS_PER_BLOCK,
    BeamMajorants,
    cosine_bounds,
    distance_to_interval,
    element_gain,
    interval_distance,
    nearest_block,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class RaySpreads(NamedTuple):
    """Amplitudes and spreads of the rows of one end's rays that a moving surface reflects; no nodes if it is still."""

    amplitude: Floats
    """Pressure of a row re that of a calm surface, at the nodes of distance [1], shape (rows, nodes); (rows, 0) where
    all are 1."""
    elevation_change: Floats
    """Change of elevation per slope, see `glint_spread.LegSpread` [rad], shape (rows, nodes); read for glints only."""
    bearing_change: Floats
    """Change of bearing per slope [rad], shape (rows, nodes); read for glints only."""
    glints: NDArray[np.bool_]
    """True for rows of glints, whose directions are spread, shape (rows,)."""
    slopes: Floats
    """See `glint_spread.GlintSpread`, shape (3,)."""
    patterns: tuple[Floats, Floats, Floats, Floats]
    """See `glint_spread.spread_gain_tables`."""


EnvelopeEnd = tuple[Floats, Floats, float, float, BeamMajorants, RaySpreads]
"""Position of one end [m], shape (3,); sines of the rays' departure angles at nodes of distance, positive down, NaN for
no ray, shape (rows, nodes): one row a family, and one more for its glints; distance of the last node [m]; height of the
end above the boundary, or depth below it [m]; its beams; and the spreads of its rows by a moving surface."""
EnvelopeArguments = tuple[EnvelopeEnd, EnvelopeEnd, bool, Floats, float, Floats, float]
"""The first argument of `gain_re_threshold`."""

BATCH = 128
"""Number of positions that are computed together."""
_ROWS = 23
"""Index of the last row of a batch, for results of the other end."""
_NORTH, _EAST, _RADIUS, _SUFFICIENT, _RESULT, _V_MAX = range(6)
_NODE, _FRACTION, _RAY_NORTH, _RAY_EAST, _SINE, _COSINE, _DOWN, _W, _U, _V, _U_MAX = range(6, 17)
_AMPLITUDE, _GAIN, _POSITION, _BEFORE, _AFTER = 18, 19, 20, 21, 22
"""Rows of a batch. Callers fill the first four, and read the fifth.

* _NODE, _FRACTION: index of the node of distance before the position, and fraction of the step beyond it.
* _RAY_NORTH, _RAY_EAST: horizontal unit vector from the end to the position.
* _SINE, _COSINE: of the angle that the radius subtends at the end; cosine -1 from a right angle on.
* _DOWN: sine of the departure angle, NaN for no ray.
* _W; _U, _U_MAX; _V, _V_MAX: greatest cosine to the beam's axis; least and greatest to its right and down axes.
"""


@njit(cache=True, nogil=True, error_model="numpy")
def _envelope(bound: Floats, per_unit: float, x: float) -> float:
    """Largest pressure pattern at distance x from its axis or beyond [1], linear between the rows of a table.

    Args:
        bound: Table of these values, re the axis [1], (rows,); empty: 1 everywhere.
        per_unit: Rows per unit of direction cosine [1].
        x: Difference of direction cosines [1].
    """
    if bound.shape[0] == 0:
        return 1.0
    position = x * per_unit
    row = min(int(position), bound.shape[0] - 1)
    after = bound[min(row + 1, bound.shape[0] - 1)]
    return bound[row] + min(position - row, 1.0) * (after - bound[row])


@njit(cache=True, nogil=True, error_model="numpy")
def _node(distance: float, last: float, count: int) -> float:
    """Fractional index of a distance [m] among nodes at last * (n / (count - 1))**2 [m], n from 0 to count - 1."""
    return math.sqrt(min(max(distance, 0.0) / last, 1.0)) * (count - 1)


@njit(inline="always")
def _row(workspace: Floats, number: int) -> Floats:
    """One row of the workspace of a batch, (BATCH,)."""
    return workspace[number * BATCH : (number + 1) * BATCH]


@njit(cache=True, nogil=True, error_model="numpy")
def _locate(end: EnvelopeEnd, workspace: Floats, has_radius: bool, size: int) -> None:
    """Directions of the positions of a batch, the nodes about them, and the angles that their radii subtend."""
    position, sines, last, height, _, _ = end
    north, east, radius = _row(workspace, _NORTH), _row(workspace, _EAST), _row(workspace, _RADIUS)
    node, fraction, ray_north, ray_east = (
        _row(workspace, _NODE),
        _row(workspace, _FRACTION),
        _row(workspace, _RAY_NORTH),
        _row(workspace, _RAY_EAST),
    )
    sine, cosine = _row(workspace, _SINE), _row(workspace, _COSINE)
    end_north, end_east, count = position[0], position[1], sines.shape[1]
    for n in range(size):
        x, y = north[n] - end_north, east[n] - end_east
        distance = math.sqrt(x * x + y * y)
        among = _node(distance, last, count)
        node[n] = min(np.floor(among), count - 2.0)
        fraction[n] = among - node[n]
        ray_north[n], ray_east[n] = x / max(distance, 1e-9), y / max(distance, 1e-9)
        if has_radius:
            margin = min(radius[n] / max(math.sqrt(distance * distance + height * height), 1e-9), 1.0)
            sine[n], cosine[n] = margin, math.sqrt(1.0 - margin * margin) if margin < 1.0 else -1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _direction_cosines(axes: Floats, workspace: Floats, has_radius: bool, size: int) -> None:
    """Cosines of the rays of one family to a beam's axes, for the positions of a batch, or spans of these cosines."""
    ray_north, ray_east, sine, cosine = (
        _row(workspace, _RAY_NORTH), _row(workspace, _RAY_EAST), _row(workspace, _SINE), _row(workspace, _COSINE),
    )  # fmt: skip
    down, w, u, v = _row(workspace, _DOWN), _row(workspace, _W), _row(workspace, _U), _row(workspace, _V)
    u_max, v_max = _row(workspace, _U_MAX), _row(workspace, _V_MAX)
    w0, w1, w2, u0, u1, u2 = axes[0, 0], axes[0, 1], axes[0, 2], axes[1, 0], axes[1, 1], axes[1, 2]
    v0, v1, v2 = axes[2, 0], axes[2, 1], axes[2, 2]
    for n in range(size):
        horizontal = math.sqrt(max(1.0 - down[n] * down[n], 0.0))
        w[n] = horizontal * (ray_north[n] * w0 + ray_east[n] * w1) + down[n] * w2
        u[n] = horizontal * (ray_north[n] * u0 + ray_east[n] * u1) + down[n] * u2
        v[n] = horizontal * (ray_north[n] * v0 + ray_east[n] * v1) + down[n] * v2
        u_max[n], v_max[n] = u[n], v[n]
    if has_radius:
        for n in range(size):
            w[n] = cosine_bounds(w[n], cosine[n], sine[n])[1]
            u[n], u_max[n] = cosine_bounds(u[n], cosine[n], sine[n])
            v[n], v_max[n] = cosine_bounds(v[n], cosine[n], sine[n])


@njit(cache=True, nogil=True, error_model="numpy")
def _add_beam_envelope(beam: BeamMajorants, workspace: Floats, size: int) -> None:
    """Raise the result of a batch to the envelope of the beams there, unless it is sufficient already."""
    _, steer, scale, (across, deep, long, tall), per_unit, element, blocks = beam
    count = blocks.shape[0]
    sufficient, result, amplitude = _row(workspace, _SUFFICIENT), _row(workspace, _RESULT), _row(workspace, _AMPLITUDE)
    down, w, u, v = _row(workspace, _DOWN), _row(workspace, _W), _row(workspace, _U), _row(workspace, _V)
    u_max, v_max = _row(workspace, _U_MAX), _row(workspace, _V_MAX)
    for n in range(size):
        largest = result[n]
        if largest >= sufficient[n] or math.isnan(down[n]):
            continue
        common_gain = element_gain(element, w[n] + 1e-12) * amplitude[n]
        if common_gain == 0.0:
            continue
        common_gain *= _envelope(long, per_unit[2], distance_to_interval(u[n], u_max[n], 0.0))
        common_gain *= _envelope(tall, per_unit[3], distance_to_interval(v[n], v_max[n], 0.0))
        right, below = (u[n], u_max[n]), (v[n], v_max[n])
        nearest = nearest_block(beam, right)
        for i in range(count):
            block = (nearest + i) % count
            if i > 0:  # the nearest block is evaluated anyway
                off = interval_distance(right, blocks[block, 0], blocks[block, 1])
                bound = common_gain * blocks[block, 4] * _envelope(across, per_unit[0], off)
                if bound > largest:
                    bound *= _envelope(deep, per_unit[1], interval_distance(below, blocks[block, 2], blocks[block, 3]))
                if bound <= largest:
                    continue
            first = block * CHANNELS_PER_BLOCK
            for channel in range(first, min(first + CHANNELS_PER_BLOCK, steer.shape[0])):
                off = distance_to_interval(u[n], u_max[n], steer[channel, 0])
                gain = common_gain * scale[channel] * _envelope(across, per_unit[0], off)
                if gain > largest:
                    gain *= _envelope(deep, per_unit[1], distance_to_interval(v[n], v_max[n], steer[channel, 1]))
                    largest = max(largest, gain)
        result[n] = largest


@njit(cache=True, nogil=True, error_model="numpy")
def _add_one_beam_envelope(beam: BeamMajorants, workspace: Floats, size: int) -> None:
    """`_add_beam_envelope` for one beam: without branches, so that the compiler vectorises the loops."""
    _, steer, scale, (across, deep, long, tall), per_unit, element, _ = beam
    sufficient, result, amplitude = _row(workspace, _SUFFICIENT), _row(workspace, _RESULT), _row(workspace, _AMPLITUDE)
    down, w, u, v = _row(workspace, _DOWN), _row(workspace, _W), _row(workspace, _U), _row(workspace, _V)
    u_max, v_max, gain = _row(workspace, _U_MAX), _row(workspace, _V_MAX), _row(workspace, _GAIN)
    right, below, channel_scale = steer[0, 0], steer[0, 1], scale[0]
    for n in range(size):
        gain[n] = element_gain(element, w[n] + 1e-12) * amplitude[n]
        gain[n] = gain[n] if down[n] == down[n] and result[n] < sufficient[n] else 0.0  # no ray, or enough
    _multiply_envelope(long, per_unit[2], (u, u_max, 0.0), gain, workspace, size)
    _multiply_envelope(tall, per_unit[3], (v, v_max, 0.0), gain, workspace, size)
    for n in range(size):
        gain[n] *= channel_scale
    _multiply_envelope(across, per_unit[0], (u, u_max, right), gain, workspace, size)
    for n in range(size):
        w[n] = gain[n]
    _multiply_envelope(deep, per_unit[1], (v, v_max, below), w, workspace, size)
    for n in range(size):
        result[n] = max(result[n], w[n] if gain[n] > result[n] else 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _multiply_envelope(
    bound: Floats, per_unit: float, interval: tuple[Floats, Floats, float], gain: Floats, workspace: Floats, size: int
) -> None:
    """Multiply the gains of a batch by `_envelope` at intervals of cosines about an axis; a gain without ray is 0.

    Rows of the table are read in a loop of their own: the others are vectorised.
    """
    if bound.shape[0] == 0:
        return
    (low, high, axis), last = interval, np.int32(bound.shape[0] - 1)
    position, before, after = _row(workspace, _POSITION), _row(workspace, _BEFORE), _row(workspace, _AFTER)
    for n in range(size):
        inside = distance_to_interval(low[n], high[n], axis) * per_unit
        position[n] = inside if inside >= 0.0 else 0.0  # no number where there is no ray
    for n in range(size):
        row = min(np.int32(position[n]), last)
        before[n], after[n] = bound[np.uint32(row)], bound[np.uint32(min(row + np.int32(1), last))]
    for n in range(size):  # beyond the last row both are the same
        gain[n] *= before[n] + (position[n] - np.floor(position[n])) * (after[n] - before[n])


@njit(cache=True, nogil=True, error_model="numpy")
def _add_glint_envelope(end: EnvelopeEnd, row: int, workspace: Floats, size: int) -> None:
    """Raise the result of a batch to the envelope over one row's glints, by the fourth-power mean of directions."""
    (axes, steer, scale, (across, deep, long, tall), per_unit, element, _), spreads = end[4], end[5]
    sufficient, result, amplitude = _row(workspace, _SUFFICIENT), _row(workspace, _RESULT), _row(workspace, _AMPLITUDE)
    down, w, u, v = _row(workspace, _DOWN), _row(workspace, _W), _row(workspace, _U), _row(workspace, _V)
    u_max, v_max = _row(workspace, _U_MAX), _row(workspace, _V_MAX)
    node, fraction, ray_north, ray_east = (
        _row(workspace, _NODE),
        _row(workspace, _FRACTION),
        _row(workspace, _RAY_NORTH),
        _row(workspace, _RAY_EAST),
    )
    for n in range(size):
        largest = result[n]
        if largest >= sufficient[n] or math.isnan(down[n]) or amplitude[n] <= largest:
            continue
        k = int(node[n])
        elevation, bearing = spreads.elevation_change[row], spreads.bearing_change[row]
        su, sv, sw = cosine_spreads(
            ray_north[n], ray_east[n], down[n], elevation[k] + fraction[n] * (elevation[k + 1] - elevation[k]),
            bearing[k] + fraction[n] * (bearing[k + 1] - bearing[k]), spreads.slopes, axes,
        )  # fmt: skip
        common_gain = element_gain(element, min(w[n] + 2 * sw, 1.0) + 1e-12) * amplitude[n]
        x, y = distance_to_interval(u[n], u_max[n], 0.0), distance_to_interval(v[n], v_max[n], 0.0)
        common_gain *= pattern_with_spread(spreads.patterns[2], _envelope(long, per_unit[2], x), per_unit[2], x, su)
        common_gain *= pattern_with_spread(spreads.patterns[3], _envelope(tall, per_unit[3], y), per_unit[3], y, sv)
        if common_gain <= largest:
            continue
        for channel in range(steer.shape[0]):
            x = distance_to_interval(u[n], u_max[n], steer[channel, 0])
            gain = pattern_with_spread(spreads.patterns[0], _envelope(across, per_unit[0], x), per_unit[0], x, su)
            gain *= common_gain * scale[channel]
            if gain > largest:
                y = distance_to_interval(v[n], v_max[n], steer[channel, 1])
                gain *= pattern_with_spread(spreads.patterns[1], _envelope(deep, per_unit[1], y), per_unit[1], y, sv)
                largest = max(largest, gain)
        result[n] = largest


@njit(cache=True, nogil=True, error_model="numpy")
def _between_nodes(value: Floats, node: Floats, fraction: Floats, result: Floats, size: int) -> None:
    """Interpolate values at nodes for a batch, by the index of the node before and the fraction of the step."""
    for n in range(size):
        row = np.uint32(np.int32(node[n]))
        result[n] = value[row] + fraction[n] * (value[row + np.uint32(1)] - value[row])


@njit(cache=True, nogil=True, error_model="numpy")
def _one_way_envelope(end: EnvelopeEnd, workspace: Floats, has_radius: bool, size: int) -> None:
    """Envelope of one end's beams near the positions of a batch, the largest of all rows of rays, into `_RESULT`.

    Args:
        end: That end.
        workspace: Rows of the batch: north and east of the positions, radius about each [m], and the envelope at which
            no further family is evaluated.
        has_radius: True if any radius is above 0.
        size: Number of positions in the batch.
    """
    _, sines, _, _, beam, spreads = end
    _locate(end, workspace, has_radius, size)
    node, fraction, down, result = (
        _row(workspace, _NODE),
        _row(workspace, _FRACTION),
        _row(workspace, _DOWN),
        _row(workspace, _RESULT),
    )
    amplitude, still = _row(workspace, _AMPLITUDE), spreads.amplitude.shape[1] == 0
    result[:size], amplitude[:size] = 0.0, 1.0
    for family in range(sines.shape[0]):
        _between_nodes(sines[family], node, fraction, down, size)
        if not still:
            _between_nodes(spreads.amplitude[family], node, fraction, amplitude, size)
        _direction_cosines(beam[0], workspace, has_radius, size)
        if spreads.glints[family]:
            _add_glint_envelope(end, family, workspace, size)
        elif beam.steer.shape[0] == 1:
            _add_one_beam_envelope(beam, workspace, size)
        else:
            _add_beam_envelope(beam, workspace, size)


@njit(cache=True, nogil=True, error_model="numpy")
def _two_way(
    transmit: EnvelopeEnd, receive: EnvelopeEnd, same_beams: bool, workspace: Floats, has_radius: bool, size: int
) -> None:
    """Envelope of the two-way pressure gain near the positions of a batch into `_RESULT`, see `_one_way_envelope`."""
    sufficient, result, once = _row(workspace, _SUFFICIENT), _row(workspace, _RESULT), _row(workspace, _ROWS)
    if same_beams:
        for n in range(size):
            sufficient[n] = math.sqrt(sufficient[n])
        _one_way_envelope(transmit, workspace, has_radius, size)
        for n in range(size):
            result[n] *= result[n]
        return
    sufficient[:size] = np.inf  # so that the result does not depend on the order of the ends
    _one_way_envelope(transmit, workspace, has_radius, size)
    for n in range(size):
        once[n] = result[n]
    _one_way_envelope(receive, workspace, has_radius, size)
    for n in range(size):
        result[n] *= once[n]


@njit(cache=True, nogil=True, error_model="numpy")
def _load_batch(position: Floats, radius: Floats, first: int, workspace: Floats) -> tuple[bool, int]:
    """Load the next positions into a batch; return True if any has a radius, and their number."""
    size, has_radius = min(BATCH, radius.size - first), False
    for n in range(size):
        workspace[_NORTH * BATCH + n], workspace[_EAST * BATCH + n] = position[first + n, 0], position[first + n, 1]
        workspace[_RADIUS * BATCH + n] = radius[first + n]
        has_radius |= radius[first + n] > 0.0
    return has_radius, size


@njit(cache=True, nogil=True, error_model="numpy")
def two_way_envelope(
    transmit: EnvelopeEnd, receive: EnvelopeEnd, same_beams: bool, position: Floats, radius: Floats, result: Floats
) -> None:
    """Fill the largest envelope of the two-way pressure gain within a radius of each position.

    Args:
        transmit: Transmitting end.
        receive: Receiving end.
        same_beams: True if these are the same.
        position: Positions (north, east) [m], shape (n, 2).
        radius: Radius around each position within which the largest value is given [m], shape (n,).
        result: Result [1], shape (n,).
    """
    workspace = np.empty((_ROWS + 1) * BATCH)
    for first in range(0, result.size, BATCH):
        has_radius, size = _load_batch(position, radius, first, workspace)
        _row(workspace, _SUFFICIENT)[:] = np.inf
        _two_way(transmit, receive, same_beams, workspace, has_radius, size)
        for n in range(size):
            result[first + n] = workspace[_RESULT * BATCH + n]


@njit(cache=True, nogil=True, error_model="numpy")
def gain_re_threshold(gains: EnvelopeArguments, position: Floats, radius: Floats, result: Floats) -> None:
    """Fill the envelope of the two-way pressure gain re that above which all scatterers are kept.

    Args:
        gains: Both ends; True if they are the same; gain above which all are kept, at nodes of distance [1]; distance
            of the last node [m]; north and east from where distances are counted [m]; least value of that gain [1].
            No further family is evaluated where the gain reaches that above which all are kept.
        position: See `two_way_envelope`.
        radius: See `two_way_envelope`.
        result: Result [1], shape (n,).
    """
    transmit, receive, same_beams, threshold_at_nodes, last, midpoint, weakest = gains
    workspace, threshold = np.empty((_ROWS + 1) * BATCH), np.empty(BATCH)
    north, east, around = _row(workspace, _NORTH), _row(workspace, _EAST), _row(workspace, _RADIUS)
    sufficient, near, far = _row(workspace, _SUFFICIENT), _row(workspace, _BEFORE), _row(workspace, _AFTER)
    for first in range(0, result.size, BATCH):
        has_radius, size = _load_batch(position, radius, first, workspace)
        for n in range(size):
            x, y = north[n] - midpoint[0], east[n] - midpoint[1]
            distance = math.sqrt(x * x + y * y)
            near[n] = _node(distance - around[n], last, threshold_at_nodes.size)
            far[n] = _node(distance + around[n], last, threshold_at_nodes.size)
        for n in range(size):
            sufficient[n] = _interpolate_nodes(threshold_at_nodes, near[n])
        for n in range(size if has_radius else 0):
            sufficient[n] = min(sufficient[n], _interpolate_nodes(threshold_at_nodes, far[n]))
        for n in range(size):
            threshold[n] = sufficient[n]
        _two_way(transmit, receive, same_beams, workspace, has_radius, size)
        for n in range(size):
            result[first + n] = workspace[_RESULT * BATCH + n] / max(threshold[n], weakest)


@njit(cache=True, nogil=True, error_model="numpy")
def _interpolate_nodes(value: Floats, among: float) -> float:
    """Value interpolated between nodes, at a fractional index from `_node`."""
    row = np.uint32(min(np.int32(among), np.int32(value.size - 2)))
    return value[row] + (among - row) * (value[row + np.uint32(1)] - value[row])


@njit(cache=True, nogil=True, error_model="numpy")
def max_two_way_gain(
    transmit: EnvelopeEnd, receive: EnvelopeEnd, same_beams: bool, distance: Floats, midpoint: Floats, axes: Floats,
    sectors: Floats, halvings: int, close: float, best: Floats,
) -> None:  # fmt: skip
    """Fill the largest envelope of the two-way pressure gain over all bearings at some distances.

    Sectors that may hold a stronger position than those evaluated are halved.

    Args:
        transmit: See `two_way_envelope`.
        receive: See `two_way_envelope`.
        same_beams: See `two_way_envelope`.
        distance: Distances [m], shape (n,).
        midpoint: North and east from where they are counted [m], shape (2,).
        axes: Bearings where the positions of largest gain are likely to lie [rad].
        sectors: Bearings of the middles of equal sectors all round [rad].
        halvings: Largest number of halvings of a sector.
        close: Ratio to which the largest gain is found [1].
        best: Result [1], shape (n,).
    """
    node, bearing = np.arange(distance.size).repeat(axes.size), np.empty(distance.size * axes.size)
    for n in range(bearing.size):
        bearing[n] = axes[n % axes.size]
    best[:] = 0.0
    _raise_best(transmit, receive, same_beams, distance, midpoint, node, bearing, best)
    half_sector = math.pi / sectors.size
    node, bearing = np.arange(distance.size).repeat(sectors.size), np.empty(distance.size * sectors.size)
    for n in range(bearing.size):
        bearing[n] = sectors[n % sectors.size]
    for _ in range(halvings):
        position = _raise_best(transmit, receive, same_beams, distance, midpoint, node, bearing, best)
        result = np.empty(node.size)
        two_way_envelope(transmit, receive, same_beams, position, half_sector * distance[node], result)
        half_sector /= 2
        hopeful = np.flatnonzero(result > best[node] * close)
        if hopeful.size == 0:
            return
        next_node, next_bearing = node[hopeful].repeat(2), np.empty(2 * hopeful.size)
        for n in range(hopeful.size):
            next_bearing[2 * n], next_bearing[2 * n + 1] = (
                bearing[hopeful[n]] - half_sector,
                bearing[hopeful[n]] + half_sector,
            )
        node, bearing = next_node, next_bearing


@njit(cache=True, nogil=True, error_model="numpy")
def _raise_best(
    transmit: EnvelopeEnd, receive: EnvelopeEnd, same_beams: bool, distance: Floats, midpoint: Floats, node: Integers,
    bearing: Floats, best: Floats,
) -> Floats:  # fmt: skip
    """Raise the best at some nodes of distance to the gain at some bearings there; return these positions."""
    position, result = np.empty((node.size, 2)), np.empty(node.size)
    for n in range(node.size):
        position[n, 0] = midpoint[0] + distance[node[n]] * math.cos(bearing[n])
        position[n, 1] = midpoint[1] + distance[node[n]] * math.sin(bearing[n])
    two_way_envelope(transmit, receive, same_beams, position, np.zeros(node.size), result)
    for n in range(node.size):
        best[node[n]] = max(best[node[n]], result[n])
    return position
