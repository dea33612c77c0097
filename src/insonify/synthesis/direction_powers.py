"""Power patterns of many beams from rows of directions: an energy is deposited about its direction once for all beams.

A power pattern is smooth over a fraction of a beam: between rows an eighth of wavelength / aperture apart it is linear
to 1.3 % of its axis. So each energy is shared among the two rows adjacent to its direction, and the energy of a beam
is a sum over all rows, weighted with the beam's power pattern. Unlike the amplitudes of `direction_grid`, no energy is
negative.

Labels take a quarter of the products: where a beam's pattern is low, the rows of one lobe are added up first, and
weighted with their mean power. A single direction there is off by the ripple of the side lobes about their mean.
"""

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from insonify.recent_results import RecentResults
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.shared_directions import (
    ROWS_PER_BEAM,
    common_pattern,
    differ_in_steering,
    horizontal_extent,
    horizontal_patterns,
)
from insonify.synthesis._direction_grid_kernel import combine_rows

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Real = TypeVar("Real", np.float32, np.float64)
ROWS_PER_LOBE = 8
"""Rows per wavelength / aperture, which is the width of a side lobe."""
LOW_POWER = 1e-3
"""Power re a beam's maximum below which, in a lobe and both adjacent ones, its mean over the lobe suffices [1]."""


class LobePowers(NamedTuple):
    """Power patterns of beams: row by row where they are high, as means over the rows of a lobe elsewhere."""

    high: Singles
    """Power of each beam at each row, 0 in lobes that have a mean, shape (beams, rows)."""
    low: Singles
    """Mean power of each beam over the rows of each lobe, 0 elsewhere, shape (beams, lobes)."""


class DirectionPowers(NamedTuple):
    """Rows of direction cosines to an array's right, and the power patterns of its beams on them."""

    step: float
    """Spacing of the rows [1]."""
    extent: float
    """Horizontal length of the aperture [wavelengths]."""
    beam_powers: Singles
    """Power of each beam at each row, without the pattern that all beams have in common, shape (beams, rows)."""
    lobe_powers: LobePowers
    """The same, with means over lobes."""
    common: Beams
    """Receive pattern that all beams have in common: directivity of elements, vertical pattern."""

    def rows(self, direction: Floats) -> Floats:
        """Row of each direction, with fraction.

        Args:
            direction: Unit vectors from the sonar outwards [1], shape (..., 3).
        """
        return np.asarray((direction @ self.common.axes[1] + 1) / self.step)

    def to_beams(self, sums: NDArray[Real]) -> NDArray[Real]:
        """Sums of all beams from those of the rows, added in single precision, shape (rows, ...) to (beams, ...)."""
        beams = _combined(sums.reshape(len(sums), -1), self.beam_powers)
        return beams.reshape(len(beams), *sums.shape[1:]).astype(sums.dtype, copy=False)

    def to_beams_by_lobes(self, sums: NDArray[Real]) -> NDArray[Real]:
        """Sums of all beams as from `to_beams`, with the mean powers of low lobes."""
        row_sums = sums.reshape(len(sums), -1).astype(np.float32, copy=False)
        lobe_sums = row_sums.reshape(len(sums) // ROWS_PER_LOBE, ROWS_PER_LOBE, row_sums.shape[1]).sum(axis=1)
        beams = _combined(row_sums, self.lobe_powers.high)
        beams += _combined(np.pad(lobe_sums, ((0, -len(lobe_sums) % 4), (0, 0))), self.lobe_powers.low)
        return beams.reshape(len(beams), *sums.shape[1:]).astype(sums.dtype, copy=False)


def _combined(rows: NDArray[Real], weights: Singles) -> Singles:
    """Weighted sums of rows, (rows, n) to (beams, n)."""
    beams = np.empty((len(weights), rows.shape[1]), np.float32)
    combine_rows(rows, weights, beams)
    return beams


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
    return DirectionPowers(2 / (count - 1), extent, *_beam_powers(receive, count), common_pattern(receive))


_POWERS: RecentResults[tuple[Singles, LobePowers]] = RecentResults(4)


def _beam_powers(receive: Beams, count: int) -> tuple[Singles, LobePowers]:
    """Power of each beam at so many rows, shape (beams, rows), and by lobes; cached for the next ping."""

    def evaluated() -> tuple[Singles, LobePowers]:
        powers = (horizontal_patterns(receive)(np.linspace(-1.0, 1.0, count)) * receive.scale[:, None]) ** 2
        # a direction at the very end has a row beyond it, and the kernel takes four at a time
        padded = np.pad(powers, ((0, 0), (0, ROWS_PER_LOBE - count % ROWS_PER_LOBE))).astype(np.float32)
        return padded, _lobe_powers(padded)

    return _POWERS.get((receive.pattern_key, count), evaluated)


def _lobe_powers(powers: Singles) -> LobePowers:
    """Power patterns with means over the lobes in which, and beside which, they are low."""
    by_lobe = powers.reshape(len(powers), -1, ROWS_PER_LOBE)
    high = by_lobe.max(axis=2) > LOW_POWER * powers.max(axis=1, keepdims=True)
    high[:, 1:] |= high[:, :-1].copy()
    high[:, :-1] |= high[:, 1:].copy()
    mean = np.where(high, np.float32(0), by_lobe.mean(axis=2))
    rows = np.where(high[..., None], by_lobe, np.float32(0)).reshape(powers.shape)
    return LobePowers(rows, np.pad(mean, ((0, 0), (0, -mean.shape[1] % 4))))
