"""Energy and positions of echoes of smooth targets: facets within one bin of delay add in phase and are then squared.

A large target comes in several blocks that interfere: pressures are kept until all blocks are complete.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.records.pairs import Pairs
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._label_kernel import MOMENTS
from insonify.synthesis.leg_weights import leg_weights
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class SpecularLabelSums:
    """Sums of pressures of one smooth target by one pair of families, in bins of delay."""

    pressure: NDArray[np.complex128]
    """Sum of the pressures [uPa], shape (channels, bins)."""
    incoherent: Floats
    """Sum of the squared magnitudes of the facets [uPa^2], and of them times north, east, down re the receiver [m] and
    times grazing angle [rad], shape (channels, bins, MOMENTS)."""

    @classmethod
    def empty(cls, channels: int, bins: int) -> "SpecularLabelSums":
        """Empty sums."""
        return cls(np.zeros((channels, bins), complex), np.zeros((channels, bins, MOMENTS)))

    def __iadd__(self, other: "SpecularLabelSums") -> "SpecularLabelSums":
        """Add other blocks of the same target, in phase."""
        self.pressure[...] += other.pressure
        self.incoherent[...] += other.incoherent
        return self

    @property
    def bins(self) -> Singles:
        """Energy, and energy times position, of all blocks, shape (channels, bins, MOMENTS).

        Facets cancel except at the specular flash: the energy of a bin is that of the sum of pressures, its position
        the energy-weighted mean over the facets. Bins do not interfere with one another.
        """
        energy, weight = np.abs(self.pressure) ** 2, self.incoherent[..., :1]
        means = np.divide(self.incoherent, weight, out=np.zeros_like(self.incoherent), where=weight > 0)
        return np.asarray(energy[..., None] * means, np.float32)


def deposit_specular_labels(
    sums: SpecularLabelSums, start: float, rate: float, pairs: Pairs, ping_geometry: PingGeometry
) -> None:
    """Add interfering facets to the bins of their delays.

    Args:
        sums: Sums, added to in place.
        start: Delay of the centre of the first bin [s]; each facet is added to the nearest bin.
        rate: Bins per second [Hz].
        pairs: Facets of one target or of a part of it, and their pairs of legs.
        ping_geometry: The sonar at that ping.
    """
    i, j = pairs.pair.T
    count = sums.pressure.shape[1]
    bin_number = np.rint((pairs.transmit_legs.delay[i] + pairs.receive_legs.delay[j] - start) * rate)
    source_pressure = float(amplitude_ratio(ping_geometry.source_level_db))
    transmit_legs, frequency = pairs.transmit_legs, ping_geometry.frequency
    transmit_weights = leg_weights(transmit_legs, ping_geometry.transmit_beams, frequency, source_pressure)
    receive_weights = leg_weights(pairs.receive_legs, ping_geometry.receive_beams, ping_geometry.frequency)
    position = pairs.scatterers.position - ping_geometry.receive_position
    transmit_sine, receive_sine = (np.abs(legs.grazing_sine) for legs in (pairs.transmit_legs, pairs.receive_legs))
    grazing = (np.arcsin(transmit_sine)[i] + np.arcsin(receive_sine)[j]) / 2
    columns = [*np.broadcast_to(position.T[:, None], (3, *bin_number.shape)), grazing]
    for channel, (pressure, incoherent) in enumerate(zip(sums.pressure, sums.incoherent, strict=True)):
        weight = (
            transmit_weights[channel % len(transmit_weights)][i]
            * receive_weights[channel % len(receive_weights)][j]
            * pairs.strength
        )
        rows = (weight != 0) & (bin_number >= 0) & (bin_number < count)
        bins, selected = bin_number[rows].astype(np.int64), weight[rows]
        pressure.real += np.bincount(bins, selected.real, count)
        pressure.imag += np.bincount(bins, selected.imag, count)
        energy = np.abs(selected) ** 2
        incoherent[:, 0] += np.bincount(bins, energy, count)
        for moment, column in zip(incoherent[:, 1:].T, columns, strict=True):
            moment += np.bincount(bins, energy * column[rows], count)
