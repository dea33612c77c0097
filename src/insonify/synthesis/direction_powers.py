"""Power patterns of many beams from rows of directions: an energy is deposited about its direction once for all beams.

A power pattern is smooth over a fraction of a beam: between rows an eighth of wavelength / aperture apart it is linear
to 1.3 % of its axis. So each energy is shared among the two rows adjacent to its direction, and the energy of a beam
is a sum over all rows, weighted with the beam's power pattern. Unlike the amplitudes of `direction_grid`, no energy is
negative.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.recent_results import RecentResults
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._direction_grid_kernel import combine_rows
from insonify.synthesis.direction_grid import (
    ROWS_PER_BEAM,
    common_pattern,
    differ_in_steering,
    horizontal_extent,
    horizontal_patterns,
)

Floats = NDArray[np.float64]
ROWS_PER_LOBE = 8
"""Rows per wavelength / aperture."""


class DirectionPowers(NamedTuple):
    """Rows of direction cosines to an array's right, and the power patterns of its beams on them."""

    step: float
    """Spacing of the rows [1]."""
    extent: float
    """Horizontal length of the aperture [wavelengths]."""
    beam_powers: NDArray[np.float32]
    """Power of each beam at each row, without the pattern that all beams have in common, shape (beams, rows)."""
    common: Beams
    """Receive pattern that all beams have in common: directivity of elements, vertical pattern."""

    def rows(self, direction: Floats) -> Floats:
        """Row of each direction, with fraction.

        Args:
            direction: Unit vectors from the sonar outwards [1], shape (..., 3).
        """
        return np.asarray((direction @ self.common.axes[1] + 1) / self.step)

    def to_beams(self, sums: Floats) -> Floats:
        """Sums of all beams from those of the rows, in single precision, shape (rows, ...) to (beams, ...)."""
        beams = np.empty((len(self.beam_powers), *sums.shape[1:]), np.float32)
        combine_rows(sums.reshape(len(sums), -1).astype(np.float32), self.beam_powers, beams.reshape(len(beams), -1))
        return beams.astype(float)


def direction_powers(ping_geometry: PingGeometry, rows_per_beam: float = ROWS_PER_BEAM) -> DirectionPowers | None:
    """Rows of a ping's receive beams; None where beams are few, steered on both ends, or differ otherwise.

    Args:
        ping_geometry: The sonar at the ping.
        rows_per_beam: Largest number of rows per beam, beyond which there are none [1].
    """
    transmit, receive = ping_geometry.transmit_beams, ping_geometry.receive_beams
    if ping_geometry.elements is not None or transmit.channel_count > 1 or not differ_in_steering(transmit, receive):
        return None
    extent = horizontal_extent(receive)
    count = int(np.ceil(2 * ROWS_PER_LOBE * extent)) + 1
    if count > rows_per_beam * receive.channel_count:
        return None
    return DirectionPowers(2 / (count - 1), extent, _beam_powers(receive, count), common_pattern(receive))


_POWERS: RecentResults[NDArray[np.float32]] = RecentResults(4)


def _beam_powers(receive: Beams, count: int) -> NDArray[np.float32]:
    """Power of each beam at so many rows, shape (beams, rows); kept for the next ping."""

    def evaluated() -> NDArray[np.float32]:
        powers = (horizontal_patterns(receive)(np.linspace(-1.0, 1.0, count)) * receive.scale[:, None]) ** 2
        # a direction at the very end has a row beyond it, and the kernel takes four at a time
        return np.pad(powers, ((0, 0), (0, 4 - count % 4))).astype(np.float32)

    return _POWERS.get((receive.pattern_key, count), evaluated)
