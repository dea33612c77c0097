"""Gain envelopes on a flat boundary in NumPy: stand-ins of the kernels while numba is not loaded."""

import numpy as np
from numpy.typing import NDArray

from insonify.engines._gain_envelope_kernel import EnvelopeArguments, EnvelopeEnd, gain_re_threshold, max_two_way_gain
from insonify.engines._glint_spread_kernel import MIN_SPREAD_ROWS, ROWS_PER_SPREAD_ROW
from insonify.sonar.beam_arrays import cosine_bounds, distance_to_interval, element_gains
from insonify.sonar.beam_kernels import BeamMajorants

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

BATCH = 1 << 15
"""Positions evaluated together [1]."""


def _envelope(bound: Floats, per_unit: float, x: Floats) -> Floats:
    """Largest magnitude of a pattern at some distances from its axis or beyond, linear between the table's rows [1]."""
    if not len(bound):
        return np.ones(x.shape)
    return np.asarray(np.interp(x * per_unit, np.arange(len(bound)), bound))


def _node_below(distance: Floats, last: float, count: int) -> tuple[Integers, Floats]:
    """Row of the node below each distance [m], and the fraction of the step to the next [1]."""
    position = np.sqrt(np.clip(distance / last, 0.0, 1.0)) * (count - 1)
    row = np.minimum(position.astype(np.int64), count - 2)
    return row, np.asarray(position - row)


def _between_nodes(value: Floats, row: Integers, fraction: Floats) -> Floats:
    """Linear interpolation between the values of nodes, of a row and a fraction of the step."""
    return np.asarray(value[row] + fraction * (value[row + 1] - value[row]))


class _Neighbourhoods:
    """Directions from one end of the sonar to positions, and to the discs around them."""

    def __init__(self, end: EnvelopeEnd, centre: Floats, radius: Floats) -> None:
        """Compute unit vectors, nodes of distance, and the angles that the radii subtend.

        Args:
            end: The end.
            centre: Positions (north, east) [m], shape (n, 2).
            radius: Distance from each position within which the largest gain is given [m], shape (n,).
        """
        position, sines, last, height = end[:4]
        away = centre - position[:2]
        distance = np.hypot(*away.T)
        self.end, self.wide = end, bool(np.any(radius > 0))
        self.node, self.fraction = _node_below(distance, last, sines.shape[1])
        self.ahead, self.aside = away.T / np.maximum(distance, 1e-9)
        self.sine = np.minimum(radius / np.maximum(np.hypot(distance, height), 1e-9), 1.0)
        self.cosine = np.where(self.sine < 1.0, np.sqrt(1.0 - self.sine**2), -1.0)

    def envelope(self) -> Floats:
        """Largest gain of the end's beams by any row of rays [1], shape (n,)."""
        sines, beam, spreads = self.end[1], self.end[4], self.end[5]
        largest = np.zeros(len(self.node))
        for row in range(len(sines)):
            down = _between_nodes(sines[row], self.node, self.fraction)
            amplitude = np.ones(len(down))
            if spreads.amplitude.shape[1]:
                amplitude = _between_nodes(spreads.amplitude[row], self.node, self.fraction)
            spread = self._spread(row, down) if spreads.glints[row] else None
            gain = _gain(beam, self._spans(beam[0], down), spread, spreads.patterns) * amplitude
            np.fmax(largest, gain, out=largest)  # no ray, no number
        return largest

    def _spans(self, axes: Floats, down: Floats) -> list[tuple[Floats, Floats]]:
        """Least and greatest cosines to an array's boresight, right and down [1]."""
        horizontal = np.sqrt(np.maximum(1.0 - down * down, 0.0))
        cosines = [horizontal * (self.ahead * row[0] + self.aside * row[1]) + down * row[2] for row in axes]
        return [cosine_bounds(cosine, self.cosine, self.sine) if self.wide else (cosine, cosine) for cosine in cosines]

    def _spread(self, row: int, down: Floats) -> tuple[Floats, Floats, Floats]:
        """Standard deviations of a glint's cosines to the right, down and to boresight of the array [1]."""
        spreads, axes = self.end[5], self.end[4][0]
        elevation, bearing = (
            _between_nodes(change[row], self.node, self.fraction)
            for change in (spreads.elevation_change, spreads.bearing_change)
        )
        north, east, slopes = self.ahead, self.aside, spreads.slopes
        along = north * north * slopes[0] + 2 * north * east * slopes[1] + east * east * slopes[2]
        up = elevation * np.sqrt(np.maximum(along, 0.0))
        right = bearing * np.sqrt(np.maximum(slopes[0] + slopes[2] - along, 0.0))
        horizontal = np.sqrt(np.maximum(1.0 - down * down, 0.0))
        w, u, v = (np.hypot(up * (horizontal * axis[2] - down * (north * axis[0] + east * axis[1])),
                            right * (north * axis[1] - east * axis[0])) for axis in axes)  # fmt: skip
        return u, v, w


def _gain(
    beam: BeamMajorants,
    cosines: list[tuple[Floats, Floats]],
    spread: tuple[Floats, Floats, Floats] | None,
    patterns: tuple[Floats, ...],
) -> Floats:
    """Largest pressure envelope of some beams over spans of cosines [1], of glints the fourth-power mean."""
    _, steer, scale, majorants, per_unit, element, _ = beam
    (_, w), right, down = cosines
    spread_margin = np.zeros(len(w)) if spread is None else 2 * spread[2]

    def pattern(which: int, span: tuple[Floats, Floats], axis: float) -> Floats:
        x = distance_to_interval(*span, axis)
        unspread = _envelope(majorants[which], per_unit[which], x)
        return (
            unspread
            if spread is None
            else _glint_pattern(patterns[which], unspread, per_unit[which], x, spread[which % 2])
        )

    gain = element_gains(element, (w if spread is None else np.minimum(w + spread_margin, 1.0)) + 1e-12)
    gain = gain * pattern(2, right, 0.0) * pattern(3, down, 0.0)
    largest = np.zeros(len(w))
    for (across, deep), size in zip(steer, scale, strict=True):
        np.fmax(largest, size * pattern(0, right, across) * pattern(1, down, deep), out=largest)
    return np.asarray(gain * largest)


def _glint_pattern(table: Floats, unspread: Floats, per_unit: float, x: Floats, spread: Floats) -> Floats:
    """Fourth-power mean of a pattern over glints about distances x from its axis, as `pattern_with_spread` [1]."""
    if not len(table):
        return unspread
    position = np.minimum(x * (per_unit / ROWS_PER_SPREAD_ROW), table.shape[1] - 1.0)
    row = np.minimum(position.astype(np.int64), table.shape[1] - 2)
    fraction, times = position - row, np.maximum(spread * (per_unit / MIN_SPREAD_ROWS), 0.0)
    octave = np.minimum(np.log2(np.maximum(times, 1.0)), table.shape[0] - 1.0)
    i = np.minimum(octave.astype(np.int64), table.shape[0] - 2)
    low, high = (table[k, row] + fraction * (table[k, row + 1] - table[k, row]) for k in (i, i + 1))
    return np.where(times <= 1.0, unspread + times * (low - unspread), low + (octave - i) * (high - low))


def _two_way_gain(
    transmit: EnvelopeEnd, receive: EnvelopeEnd, same_beams: bool, position: Floats, radius: Floats
) -> Floats:
    """Largest envelope of the two-way pressure gain within a radius [m] of each position [1], shape (n,)."""
    once = _Neighbourhoods(transmit, position, radius).envelope()
    return np.asarray(once * (once if same_beams else _Neighbourhoods(receive, position, radius).envelope()))


@gain_re_threshold.stand_in
def _gain_over_threshold(gains: EnvelopeArguments, position: Floats, radius: Floats, gain: Floats) -> None:
    """Fill the envelope of the two-way pressure gain re that above which all scatterers are kept [1], (n,)."""
    transmit, receive, same_beams, threshold_at_nodes, last, middle, weakest = gains
    for first in range(0, len(gain), BATCH):
        rows = slice(first, first + BATCH)
        distance = np.hypot(*(position[rows] - middle).T)
        nearest_and_farthest = (distance - radius[rows], distance + radius[rows])
        threshold = np.minimum(
            *(
                _between_nodes(threshold_at_nodes, *_node_below(limit, last, len(threshold_at_nodes)))
                for limit in nearest_and_farthest
            )
        )
        two_way = _two_way_gain(transmit, receive, same_beams, position[rows], radius[rows])
        gain[rows] = two_way / np.maximum(threshold, weakest)


@max_two_way_gain.stand_in
def _max_gain_at(
    transmit: EnvelopeEnd, receive: EnvelopeEnd, same_beams: bool, distance: Floats, middle: Floats, axes: Floats,
    sectors: Floats, halvings: int, close: float, best: Floats,
) -> None:  # fmt: skip
    """Fill the largest envelope of the two-way pressure gain over all bearings at some distances [1], (n,)."""

    def positions(node: Integers, bearing: Floats) -> Floats:
        return np.asarray(middle + distance[node, None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1))

    def raise_best(node: Integers, position: Floats) -> None:
        np.maximum.at(best, node, _two_way_gain(transmit, receive, same_beams, position, np.zeros(len(node))))

    best[:], bearing_step = 0.0, np.pi / len(sectors)
    node, bearing = np.arange(len(distance)).repeat(len(axes)), np.tile(axes, len(distance))
    raise_best(node, positions(node, bearing))
    node, bearing = np.arange(len(distance)).repeat(len(sectors)), np.tile(sectors, len(distance))
    for _ in range(halvings):
        position = positions(node, bearing)
        raise_best(node, position)
        gain = _two_way_gain(transmit, receive, same_beams, position, bearing_step * distance[node])
        bearing_step /= 2
        hopeful = gain > best[node] * close
        if not hopeful.any():
            return
        node = node[hopeful].repeat(2)
        bearing = (bearing[hopeful, None] + [-bearing_step, bearing_step]).ravel()
