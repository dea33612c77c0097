"""Power patterns of many beams from rows of directions: energies are deposited by direction, once for all beams.

A power pattern is smooth over a fraction of a beam: between rows an eighth of wavelength / aperture apart it is linear
to 1.3 % of its value on the axis. So each energy is shared between the two rows adjacent to its direction, and the
energy of a beam is a sum over all rows, weighted with the beam's power pattern. Unlike the amplitudes of
`direction_grid`, no energy is negative.
"""

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from insonify.recent_results import RecentResults
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.shared_directions import (
    common_pattern,
    differ_in_steering,
    horizontal_extent,
    horizontal_patterns,
)
from insonify.synthesis._direction_grid_kernel import combine_rows

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Real = TypeVar("Real", np.float32, np.float64)
ROWS_PER_BEAM, MAX_BYTES = 4.0, 512 << 20
"""Number of rows per beam up to which rows are used whatever their memory [1], and largest memory of sums with more
rows [bytes]."""
ROWS_PER_LOBE = 8
"""Rows per wavelength / aperture, which is the width of a side lobe."""


class DirectionPowers(NamedTuple):
    """Rows of direction cosines to an array's right, and the power patterns of its beams on them."""

    step: float
    """Spacing of the rows in direction cosine [1]."""
    extent: float
    """Horizontal length of the aperture [wavelengths]."""
    beam_powers: Singles
    """Squared amplitude of each beam at each row, without the pattern that all beams have in common [1], shape (beams,
    rows)."""
    common: Beams
    """Receive pattern that all beams have in common: directivity of elements, vertical pattern."""

    def rows(self, direction: Floats) -> Floats:
        """Row of each direction, with fraction.

        Args:
            direction: Unit vectors from the sonar outwards in the world [1], shape (..., 3).
        """
        return np.asarray((direction @ self.common.axes[1] + 1) / self.step)

    def to_beams(self, sums: NDArray[Real]) -> NDArray[Real]:
        """Sums of all beams from those of the rows, added in single precision, shape (rows, ...) to (beams, ...)."""
        beams = np.empty((len(self.beam_powers), sums[0].size), np.float32)
        combine_rows(sums.reshape(len(sums), -1), self.beam_powers, beams)
        return beams.reshape(len(beams), *sums.shape[1:]).astype(sums.dtype, copy=False)


def direction_powers(ping_geometry: PingGeometry, bytes_per_row: int) -> DirectionPowers | None:
    """Rows of a ping's receive beams; None where beams are few, steered on both ends, or differ otherwise.

    Also None where the rows are more than `ROWS_PER_BEAM` per beam and their sums need more than `MAX_BYTES`.

    Args:
        ping_geometry: The sonar at the ping.
        bytes_per_row: Memory of the sums of one row [bytes].
    """
    transmit, receive = ping_geometry.transmit_beams, ping_geometry.receive_beams
    if ping_geometry.elements is not None or transmit.channel_count > 1 or not differ_in_steering(transmit, receive):
        return None
    extent = horizontal_extent(receive)
    count = int(np.ceil(2 * ROWS_PER_LOBE * extent)) + 1
    if count > ROWS_PER_BEAM * receive.channel_count and count * bytes_per_row > MAX_BYTES:
        return None
    return DirectionPowers(2 / (count - 1), extent, _beam_powers(receive, count), common_pattern(receive))


_POWERS: RecentResults[Singles] = RecentResults(4)


def _beam_powers(receive: Beams, count: int) -> Singles:
    """Squared amplitude of each beam at `count` rows, shape (beams, rows); cached for the next ping."""

    def evaluated() -> Singles:
        powers = (horizontal_patterns(receive)(np.linspace(-1.0, 1.0, count)) * receive.scale[:, None]) ** 2
        return np.pad(powers, ((0, 0), (0, 1))).astype(np.float32)  # a direction at the very end has a row beyond it

    return _POWERS.get((receive.pattern_key, count), evaluated)
