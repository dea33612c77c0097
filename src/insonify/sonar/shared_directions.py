"""Beams of one array that differ in horizontal steering alone: their common pattern, and their horizontal patterns.

The pattern of an aperture of L wavelengths, as a function of the direction cosine, is a sum of waves of at most L / 2
cycles per unit. The field at rows of direction cosines 1 / (2 L) apart therefore determines the output of all such
beams.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.beam import NO_SIDE, Beams
from insonify.sonar.beam_kernels import OMNI

Floats = NDArray[np.float64]
MIN_BEAMS = 24
"""Smallest number of beams for which rows of directions are faster than separate beams [1]."""
ROW_OVERSAMPLING = 2.0
"""Number of rows per interval wavelength / aperture of the direction cosine [1]."""
ROWS_PER_BEAM = 3.0
"""Largest number of rows per beam, which limits the memory [1]."""
MAX_TILT_DIFFERENCE = 1e-12
"""Largest difference of downward steering among beams that share rows [1]."""
LEG_DIFFERENCE = 0.25
"""Difference between the direction cosines of transmit and receive leg for which transmit beams are checked [1]."""
TOLERANCE = 1e-2
"""Largest error of the two-way pattern on the rows where the legs differ, re the beam's axis [1]."""


def share_directions(transmit_beams: Beams, receive_beams: Beams) -> bool:
    """Return True for many beams that differ in horizontal steering alone and need few rows of directions."""
    if not differ_in_steering(transmit_beams, receive_beams):
        return False
    return 2 / row_step(transmit_beams, receive_beams) <= ROWS_PER_BEAM * receive_beams.channel_count


def row_step(transmit_beams: Beams, receive_beams: Beams) -> float:
    """Spacing of the rows of direction cosines that determine the output of beams that share directions [1]."""
    extent = horizontal_extent(receive_beams)
    if transmit_beams.channel_count > 1:
        extent += horizontal_extent(transmit_beams)
    return 1 / (ROW_OVERSAMPLING * extent)


def horizontal_extent(beams: Beams) -> float:
    """Horizontal length of the aperture of some beams [wavelengths], at least 1; 0 for a point."""
    return max(beams.across.extent, 1.0) if beams.across.extent else 0.0


def differ_in_steering(transmit_beams: Beams, receive_beams: Beams) -> bool:
    """Return True if a sonar has many beams that differ in horizontal steering alone."""
    if (
        receive_beams.channel_count < MIN_BEAMS
        or receive_beams.across.extent == 0
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
    if transmit_beams.across.extent == 0:
        return True
    axis, direction_sine = np.zeros((1, 2)), np.linspace(-1.0, 1.0, 2001)

    def pattern(beams: Beams, sine: Floats) -> Floats:
        return horizontal_patterns(replace(beams, steer=axis))(sine)[0]

    error = pattern(transmit_beams, np.clip(direction_sine + LEG_DIFFERENCE, -1, 1)) - pattern(
        transmit_beams, direction_sine
    ) * pattern(transmit_beams, np.array([LEG_DIFFERENCE]))
    return bool(np.abs(error * pattern(receive_beams, direction_sine)).max() <= TOLERANCE)


def common_pattern(beams: Beams) -> Beams:
    """Pattern common to all beams of an array, as one beam: directivity of elements, vertical pattern."""
    majorant, table = _unit_pattern_tables()
    steer = np.array([[0.0, beams.steer[0, 1]]])
    return replace(
        beams, steer=steer, scale=np.ones(1), tables=(table, *beams.tables[1:]),
        majorants=(majorant, *beams.majorants[1:]), across=NO_SIDE,
    )  # fmt: skip


def horizontal_patterns(beams: Beams) -> Callable[[Floats], Floats]:
    """Horizontal patterns of beams [1], shape (beams, n), as a function of direction cosines [1], shape (n,)."""
    steer = np.ascontiguousarray(beams.steer * [1.0, 0.0])
    horizontal = replace(beams, axes=np.eye(3), element=OMNI, steer=steer, scale=np.ones(len(steer)),
                  tables=(beams.tables[0], *(_unit_pattern_tables()[1],) * 3))  # fmt: skip

    def gain(sine: Floats) -> Floats:
        return horizontal.gain(np.stack([np.sqrt(1 - sine**2), sine, np.zeros_like(sine)], axis=-1))

    return gain


def _unit_pattern_tables() -> tuple[Floats, Floats]:
    """Empty majorants and table, for a pattern of one everywhere; read-only, which kernels compile as one type."""
    majorant, table = np.empty(0), np.empty((0, 4))
    for array in (majorant, table):
        array.setflags(write=False)
    return majorant, table
