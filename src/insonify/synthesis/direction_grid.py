"""Beams of one array from a direction grid: an arrival is deposited about its own direction, once for all beams.

The pattern of an aperture of L wavelengths is, as a function of the direction cosine, a sum of waves of at most L / 2
cycles. So it is determined by rows 1 / (2 L) apart: each arrival is deposited on seven of them, and a beam is a
weighted sum of all rows. The weights reproduce the pattern with the least error, side lobes included.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.recent_results import RecentResults
from insonify.sonar.beam import POINTS_PER_LOBE, Beams
from insonify.sonar.beam_kernels import OMNI
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._direction_grid_kernel import DirectionRows, combine_rows
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE, tap_coefficients
from insonify.synthesis._gridding_kernel import WIDTH as WIDTH

Floats = NDArray[np.float64]
Cells = NDArray[np.complex64]
MIN_BEAMS = 24
"""Number of beams from which on a direction grid is faster than separate beams [1]."""
OVERSAMPLING = 2.0
"""Rows per wavelength over the aperture [1]."""
ROWS_PER_BEAM = 3.0
"""Largest number of rows per beam, which limits the memory [1]."""
MAX_TILT_DIFFERENCE = 1e-12
"""Largest difference of downward steering among beams that share a grid [1]."""


NO_DIRECTION_GRID = DirectionRows(0.0, 0.0, np.empty((0, 4)), 1.0)
"""No grid."""
LEG_DIFFERENCE = 0.25
"""Difference of the direction cosines of two different legs for which transmit beams are checked [1]."""
TOLERANCE = 1e-2
"""Largest error of the two-way pattern of different legs on the grid, re the beam's axis [1]."""


@dataclass(frozen=True, slots=True)
class DirectionGrid:
    """Direction grid of one array, and its beams as weighted sums of rows."""

    rows: tuple[DirectionRows, ...]
    """Rows of the grid, for each sub-band."""
    row_count: int
    """Number of rows."""
    beams: tuple[tuple[Beams, Beams], ...]
    """Transmit and receive beams, for each sub-band."""
    shared_patterns: tuple[tuple[Beams, Beams], ...]
    """Transmit and receive patterns common to all beams: directivity of elements, vertical pattern."""

    @property
    def beam_weights(self) -> tuple[NDArray[np.float32], ...]:
        """Weight of each row in each beam, for each sub-band, shape (beams, rows); fitted when first needed."""
        first, step = self.rows[0][:2]
        return tuple(_beam_weights(*pair, first, step, self.row_count) for pair in self.beams)

    def to_beams(self, cells: Cells) -> Cells:
        """Combine rows to beams.

        Args:
            cells: Cells of the rows, shape (bands, rows, groups, cells, waveforms of a group).

        Returns:
            Cells of the beams, shape (bands, beams, groups, cells, waveforms of a group).
        """
        beam_weights = self.beam_weights
        beams = np.empty((cells.shape[0], len(beam_weights[0]), *cells.shape[2:]), np.complex64)
        for row_cells, weights, beam_cells in zip(cells, beam_weights, beams, strict=True):
            combine_rows(
                row_cells.reshape(len(row_cells), -1).view(np.float32),
                weights,
                beam_cells.reshape(len(beam_cells), -1).view(np.float32),
            )
        return beams


def direction_grid(ping_geometry: PingGeometry) -> DirectionGrid | None:
    """Direction grid of a ping's beams; None where beams are few or differ in more than horizontal steering."""
    pairs = tuple((band.transmit_beams, band.receive_beams) for band in ping_geometry.sub_bands)
    pairs = pairs or ((ping_geometry.transmit_beams, ping_geometry.receive_beams),)
    if ping_geometry.elements is not None or not all(differ_in_steering(*pair) for pair in pairs):
        return None
    extent = max(
        horizontal_extent(receive_beams) + horizontal_extent(transmit_beams) * (transmit_beams.channel_count > 1)
        for transmit_beams, receive_beams in pairs
    )
    step = 1 / (OVERSAMPLING * extent)
    count = -(-(int(np.ceil(2 / step)) + 2 * CELLS_PER_SPIKE) // 4) * 4
    if count > ROWS_PER_BEAM * pairs[0][1].channel_count:
        return None
    first, no_rows = -step * (count - 1) / 2, np.empty((0, 4))
    rows = tuple(
        DirectionRows(
            first,
            step,
            *(
                (transmit_beams.tables[0].copy(), float(transmit_beams.per_unit[0]))
                if transmit_beams.channel_count > 1
                else (no_rows, 1.0)
            ),
        )
        for transmit_beams, _ in pairs
    )
    shared_patterns = tuple(
        (
            common_pattern(transmit_beams) if transmit_beams.channel_count > 1 else transmit_beams,
            common_pattern(receive_beams),
        )
        for transmit_beams, receive_beams in pairs
    )
    return DirectionGrid(rows, count, pairs, shared_patterns)


def horizontal_extent(beams: Beams) -> float:
    """Horizontal length of an aperture [wavelengths], at least 1; 0 for a point."""
    return float(beams.per_unit[0]) / POINTS_PER_LOBE if beams.tables[0].shape[0] else 0.0


def differ_in_steering(transmit_beams: Beams, receive_beams: Beams) -> bool:
    """Return True if a sonar has many beams that differ in horizontal steering alone."""
    if (
        receive_beams.channel_count < MIN_BEAMS
        or receive_beams.tables[0].shape[0] == 0
        or np.ptp(receive_beams.steer[:, 1]) > MAX_TILT_DIFFERENCE
    ):
        return False
    if transmit_beams.channel_count == 1:
        return True
    equal = np.array_equal(transmit_beams.axes, receive_beams.axes) and np.allclose(
        transmit_beams.steer[:, 0], receive_beams.steer[:, 0], atol=MAX_TILT_DIFFERENCE
    )
    return bool(
        equal and np.ptp(transmit_beams.steer[:, 1]) <= MAX_TILT_DIFFERENCE and _is_wide(transmit_beams, receive_beams)
    )


def _is_wide(transmit_beams: Beams, receive_beams: Beams) -> bool:
    """Return True if transmit beams are so wide that different transmit and receive legs may share one direction."""
    if transmit_beams.tables[0].shape[0] == 0:
        return True
    axis, direction_sine = np.zeros((1, 2)), np.linspace(-1.0, 1.0, 2001)

    def pattern(beams: Beams, sine: Floats) -> Floats:
        return horizontal_patterns(replace(beams, steer=axis))(sine)[0]

    error = pattern(transmit_beams, np.clip(direction_sine + LEG_DIFFERENCE, -1, 1)) - pattern(
        transmit_beams, direction_sine
    ) * pattern(transmit_beams, np.array([LEG_DIFFERENCE]))
    return bool(np.abs(error * pattern(receive_beams, direction_sine)).max() <= TOLERANCE)


def common_pattern(beams: Beams) -> Beams:
    """Pattern common to all beams of an array."""
    empty, rows = _no_tables()
    steer = np.array([[0.0, beams.steer[0, 1]]])
    return replace(
        beams, steer=steer, scale=np.ones(1), tables=(rows, *beams.tables[1:]), majorants=(empty, *beams.majorants[1:]),
    )  # fmt: skip


_WEIGHTS: RecentResults[NDArray[np.float32]] = RecentResults(16)


def _beam_weights(
    transmit_beams: Beams, receive_beams: Beams, first: float, step: float, count: int
) -> NDArray[np.float32]:
    """Weight of each row in each beam, shape (beams, rows); cached for the same beams."""
    key = (transmit_beams.pattern_key, receive_beams.pattern_key, first, step)
    return _WEIGHTS.get(key, lambda: _fitted_weights(transmit_beams, receive_beams, first, step, count))


def _fitted_weights(
    transmit_beams: Beams, receive_beams: Beams, first: float, step: float, count: int
) -> NDArray[np.float32]:
    """Fit the weights over all directions; beams steered on both ends have the product of their patterns."""
    sine = np.cos((np.arange(5 * count) + 0.5) * np.pi / (5 * count))
    pattern = horizontal_patterns(receive_beams)(sine) * receive_beams.scale[:, None]
    if transmit_beams.channel_count > 1:
        pattern = pattern * horizontal_patterns(transmit_beams)(sine) * transmit_beams.scale[:, None]
    return np.ascontiguousarray((_solver(first, step, count) @ pattern.T).T, np.float32)


def horizontal_patterns(beams: Beams) -> Callable[[Floats], Floats]:
    """Horizontal patterns of beams as a function of the direction cosine, shape (beams, n)."""
    steer = np.ascontiguousarray(beams.steer * [1.0, 0.0])
    horizontal = replace(beams, axes=np.eye(3), element=OMNI, steer=steer, scale=np.ones(len(steer)),
                  tables=(beams.tables[0], *(_no_tables()[1],) * 3))  # fmt: skip

    def gain(sine: Floats) -> Floats:
        return horizontal.gain(np.stack([np.sqrt(1 - sine**2), sine, np.zeros_like(sine)], axis=-1))

    return gain


def _no_tables() -> tuple[Floats, Floats]:
    """Majorants and table of a pattern of one everywhere; read-only, which kernels compile as one type."""
    empty, rows = np.empty(0), np.empty((0, 4))
    for table in (empty, rows):
        table.setflags(write=False)
    return empty, rows


@lru_cache(maxsize=8)
def _solver(first: float, step: float, count: int) -> Floats:
    """Least-squares matrix from values at evenly spaced directions to weights of rows, shape (rows, directions)."""
    sine = np.cos((np.arange(5 * count) + 0.5) * np.pi / (5 * count))
    distance = (sine[:, None] - first) / step - np.arange(count)
    return np.asarray(np.linalg.pinv(_kernel_at(distance), rcond=1e-9))


def _kernel_at(distance: Floats) -> Floats:
    """Gridding kernel at a distance from a row [rows], any shape."""
    taps, cell = tap_coefficients().astype(float), -np.floor(distance + 0.5).astype(np.int64)
    # coefficients are numbered by the position of the row in the kernel
    number, y = cell + (WIDTH - 1) // 2, distance + cell
    inside = (number >= 0) & (number < WIDTH)
    rows = taps[:, np.where(inside, number, 0)]
    return np.asarray(np.where(inside, np.polynomial.polynomial.polyval(y, rows, tensor=False), 0.0))
