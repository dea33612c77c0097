"""Many beams of one array from a grid of directions: an echo is laid down about its own direction, once for all beams.

The pattern of an aperture of L wavelengths is, as a function of the direction cosine, a sum of waves of at most L / 2
cycles. So it is known everywhere from rows that lie 1 / (2 L) apart: each echo is spread over seven of them, and a beam
is a weighted sum of all rows. Weights are those that give the pattern back with the least error, side lobes included.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.beam import POINTS_PER_LOBE, Beams
from insonify.sonar.beam_kernels import OMNI
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._direction_grid_kernel import DirectionRows, combine_rows
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE, WIDTH, tap_coefficients

Floats = NDArray[np.float64]
Cells = NDArray[np.complex64]
FEWEST = 24
"""Beams from which on a grid of directions takes less time than beams one by one [1]."""
OVERSAMPLING = 2.0
"""Rows in the width of a wavelength over the aperture [1]."""
ROWS_PER_BEAM = 3.0
"""Rows for each beam at most: the grid takes as much more memory [1]."""
LEVEL = 1e-12
"""Largest difference of downward steering among beams that share a grid [1]."""


NO_DIRECTION_GRID = DirectionRows(0.0, 0.0, np.empty((0, 4)), 1.0)
"""No grid."""
MIXED = 0.25
"""Difference of direction cosines of two unlike legs by which transmit beams are judged [1]."""
TOLERANCE = 1e-2
"""Largest error of the two-way pattern of unlike legs on the grid, re the beam's axis [1]."""


@dataclass(frozen=True, slots=True)
class DirectionGrid:
    """Grid of directions of one array, and its beams as sums of rows."""

    rows: tuple[DirectionRows, ...]
    """The grid, for each sub-band."""
    row_count: int
    """Rows of the grid."""
    beam_weights: tuple[NDArray[np.float32], ...]
    """Weight of each row in each beam, for each sub-band, shape (beams, rows)."""
    shared_patterns: tuple[tuple[Beams, Beams], ...]
    """Pattern that all beams share on transmission and on reception: directivity of elements, vertical pattern."""

    def to_beams(self, cells: Cells) -> Cells:
        """Cells of the beams.

        Args:
            cells: Of the rows, shape (bands, rows, groups, cells, shapes of a group).

        Returns:
            Shape (bands, beams, groups, cells, shapes of a group).
        """
        told = np.empty((cells.shape[0], len(self.beam_weights[0]), *cells.shape[2:]), np.complex64)
        for held, mix, made in zip(cells, self.beam_weights, told, strict=True):
            combine_rows(
                held.reshape(len(held), -1).view(np.float32), mix, made.reshape(len(made), -1).view(np.float32)
            )
        return told


def direction_grid(ping_geometry: PingGeometry) -> DirectionGrid | None:
    """The grid of directions of a ping's beams; none where they are few, or have too little in common.

    Args:
        ping_geometry: The sonar at this ping.
    """
    pairs = tuple((band.transmit_beams, band.receive_beams) for band in ping_geometry.sub_bands)
    pairs = pairs or ((ping_geometry.transmit_beams, ping_geometry.receive_beams),)
    if ping_geometry.elements is not None or not all(_alike(*pair) for pair in pairs):
        return None
    extent = max(_extent(heard) + _extent(sent) * (sent.channel_count > 1) for sent, heard in pairs)
    step = 1 / (OVERSAMPLING * extent)
    count = -(-(int(np.ceil(2 / step)) + 2 * CELLS_PER_SPIKE) // 4) * 4
    if count > ROWS_PER_BEAM * pairs[0][1].channel_count:
        return None
    first, none = -step * (count - 1) / 2, np.empty((0, 4))
    rows = tuple(
        DirectionRows(
            first, step, *((sent.tables[0].copy(), float(sent.per_unit[0])) if sent.channel_count > 1 else (none, 1.0))
        )
        for sent, _ in pairs
    )
    ends = tuple(
        (_common_pattern(sent) if sent.channel_count > 1 else sent, _common_pattern(heard)) for sent, heard in pairs
    )
    return DirectionGrid(rows, count, tuple(_mix(*pair, first, step, count) for pair in pairs), ends)


def _extent(beams: Beams) -> float:
    """Length of an aperture across [wavelengths], 1 at least; 0 of a point."""
    return float(beams.per_unit[0]) / POINTS_PER_LOBE if beams.tables[0].shape[0] else 0.0


def _alike(transmit_beams: Beams, receive_beams: Beams) -> bool:
    """Return True if the beams of a sonar are many and differ in horizontal steering alone."""
    if (
        receive_beams.channel_count < FEWEST
        or receive_beams.tables[0].shape[0] == 0
        or np.ptp(receive_beams.steer[:, 1]) > LEVEL
    ):
        return False
    if transmit_beams.channel_count == 1:
        return True
    same = np.array_equal(transmit_beams.axes, receive_beams.axes) and np.allclose(
        transmit_beams.steer[:, 0], receive_beams.steer[:, 0], atol=LEVEL
    )
    return bool(same and np.ptp(transmit_beams.steer[:, 1]) <= LEVEL and _wide(transmit_beams, receive_beams))


def _wide(transmit_beams: Beams, receive_beams: Beams) -> bool:
    """Return True if transmit beams are so wide that unlike legs out and back may share one direction."""
    if transmit_beams.tables[0].shape[0] == 0:
        return True
    axis, away = np.zeros((1, 2)), np.linspace(-1.0, 1.0, 2001)

    def pattern(beams: Beams, sine: Floats) -> Floats:
        return _horizontal_patterns(replace(beams, steer=axis))(sine)[0]

    apart = pattern(transmit_beams, np.clip(away + MIXED, -1, 1)) - pattern(transmit_beams, away) * pattern(
        transmit_beams, np.array([MIXED])
    )
    return bool(np.abs(apart * pattern(receive_beams, away)).max() <= TOLERANCE)


def _common_pattern(beams: Beams) -> Beams:
    """Pattern that all beams of an array share."""
    none, rows = _no_tables()
    steer = np.array([[0.0, beams.steer[0, 1]]])
    return replace(
        beams, steer=steer, scale=np.ones(1), tables=(rows, *beams.tables[1:]), majorants=(none, *beams.majorants[1:])
    )


_KNOWN: dict[tuple[object, ...], tuple[NDArray[np.float32], Beams, Beams]] = {}
_MAX_CACHE_BYTES = 16


def _mix(transmit_beams: Beams, receive_beams: Beams, first: float, step: float, count: int) -> NDArray[np.float32]:
    """Weight of each row in each beam, shape (beams, rows); cached for the same beams."""
    key = (transmit_beams.pattern_key, receive_beams.pattern_key, first, step)
    known = _KNOWN.get(key)
    if known is None:
        for oldest in list(_KNOWN)[: 1 - _MAX_CACHE_BYTES]:
            _KNOWN.pop(oldest, None)
        # the beams are kept, so that no others can take their tables' numbers
        known = _KNOWN[key] = (
            _fitted_weights(transmit_beams, receive_beams, first, step, count),
            transmit_beams,
            receive_beams,
        )
    return known[0]


def _fitted_weights(
    transmit_beams: Beams, receive_beams: Beams, first: float, step: float, count: int
) -> NDArray[np.float32]:
    """The same, fitted over all directions: of beams steered on both ends, the product of their patterns."""
    sine = np.cos((np.arange(5 * count) + 0.5) * np.pi / (5 * count))
    wanted = _horizontal_patterns(receive_beams)(sine) * receive_beams.scale[:, None]
    if transmit_beams.channel_count > 1:
        wanted = wanted * _horizontal_patterns(transmit_beams)(sine) * transmit_beams.scale[:, None]
    return np.ascontiguousarray((_solver(first, step, count) @ wanted.T).T, np.float32)


def _horizontal_patterns(beams: Beams) -> Callable[[Floats], Floats]:
    """Patterns of beams across alone, as a function of the direction cosine, shape (beams, n)."""
    steer = np.ascontiguousarray(beams.steer * [1.0, 0.0])
    one = replace(beams, axes=np.eye(3), element=OMNI, steer=steer, scale=np.ones(len(steer)),
                  tables=(beams.tables[0], *(_no_tables()[1],) * 3))  # fmt: skip

    def gain(sine: Floats) -> Floats:
        return one.gain(np.stack([np.sqrt(1 - sine**2), sine, np.zeros_like(sine)], axis=-1))

    return gain


def _no_tables() -> tuple[Floats, Floats]:
    """Majorants and table of a pattern of one everywhere; nobody writes to them: kernels take all for one kind."""
    none, rows = np.empty(0), np.empty((0, 4))
    for table in (none, rows):
        table.setflags(write=False)
    return none, rows


@lru_cache(maxsize=8)
def _solver(first: float, step: float, count: int) -> Floats:
    """Least-squares matrix from values at evenly spaced directions to weights of rows, shape (rows, directions)."""
    sine = np.cos((np.arange(5 * count) + 0.5) * np.pi / (5 * count))
    away = (sine[:, None] - first) / step - np.arange(count)
    return np.asarray(np.linalg.pinv(_kernel_at(away), rcond=1e-9))


def _kernel_at(distance: Floats) -> Floats:
    """The spreading kernel at a distance from a row [rows], any shape."""
    taps, cell = tap_coefficients().astype(float), -np.floor(distance + 0.5).astype(np.int64)
    # a spike so far after a row counts for it as the polynomial says whose number is that of the row in the spike
    number, y = cell + (WIDTH - 1) // 2, distance + cell
    inside = (number >= 0) & (number < WIDTH)
    rows = taps[:, np.where(inside, number, 0)]
    return np.asarray(np.where(inside, np.polynomial.polynomial.polyval(y, rows, tensor=False), 0.0))
