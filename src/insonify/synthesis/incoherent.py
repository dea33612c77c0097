"""The incoherent reading: the expected intensity, free of speckle.

Scatterers have random phases, so their echoes add as energies. The paths of one scatterer interfere:
reciprocal pairs arrive together and give 4 |A|^2, pairs closer than the pulse make fringes. Only what is
further apart than the pulse adds as energy from the start.
"""

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.delay_field import DelayField
from insonify.records.pairs import Pairs
from insonify.records.reverberation_samples import ReverberationSamples
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.synthesis._fast_reverberation_energies import deposit_interference, deposit_pair_energies, leg_amplitudes
from insonify.synthesis._gridding import deposit_energy
from insonify.synthesis.accumulator import Requirements
from insonify.synthesis.coherence_factors import split_by_coherence
from insonify.synthesis.coherent_groups import PulseTable, add_groups
from insonify.synthesis.coherent_subsets import coherent_subsets
from insonify.synthesis.leg_weights import leg_weights, weights_from_gain
from insonify.synthesis.receive_beam_motion import moving_array_axes, receive_directions
from insonify.synthesis.replica_jitter import ReplicaJitter
from insonify.synthesis.specular_sums import SpecularSums
from insonify.synthesis.time_grid import TimeGrid, convolve_energy_spectrum, energy_spectrum_factors
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
SAME_DELAY = 1e-10
"""Delays this close share one pulse: their carriers are in the weights, and no envelope changes so fast [s]."""

LAGS_PER_CELL = 2
"""Entries of the pulse table to a lag of its autocorrelation."""


@dataclass(frozen=True, slots=True)
class IntensityBuffer:
    """What has been heard so far."""

    cells: Floats
    """Energies that do not interfere, on the energy grid, shape (channels, cells)."""
    intensity: Floats
    """Intensity of groups that do, at the output samples, shape (channels, samples)."""
    specular_sums: list[SpecularSums] = field(default_factory=list)
    """Arrivals of the last smooth target, of which more may come; none or one."""

    def flush_specular(self) -> None:
        """Add the power of a smooth target, of which all parts have come, to the intensity."""
        while self.specular_sums:
            self.specular_sums.pop().flush_specular(self.intensity)

    def __iadd__(self, other: "IntensityBuffer") -> "IntensityBuffer":
        """Add what another has heard."""
        self.flush_specular()
        other.flush_specular()
        self.cells[...] += other.cells
        self.intensity[...] += other.intensity
        return self


@dataclass(frozen=True, slots=True)
class IncoherentAccumulator:
    """Hears expected intensity [uPa^2]."""

    ping_geometry: PingGeometry
    grid: TimeGrid
    replica_jitter: ReplicaJitter
    table: PulseTable
    delay_field: DelayField | None = None
    """What uneven water adds to travel times; None: nothing."""

    @property
    def requirements(self) -> Requirements:
        """Quadrature points; of short pulses the seabed may come by the fast reverberation."""
        return Requirements(fast_reverberation=self.is_short_pulse)

    def empty(self) -> IntensityBuffer:
        """Nothing heard yet."""
        channels = self.ping_geometry.channel_count
        return IntensityBuffer(self.grid.energy_cells(channels), np.zeros((channels, self.grid.sample_count)))

    def add(self, energies: IntensityBuffer, pairs: Pairs) -> None:
        """Add the mean intensity of one block of scatterers."""
        self.add_weighted(energies, pairs, *self.weights(pairs))

    def weights(self, pairs: Pairs) -> tuple[Complexes, Complexes]:
        """Complex weight of the legs out [uPa] and back [1] of a block in each beam, (beams, f, n) each."""
        here, level = self.ping_geometry, float(amplitude_ratio(self.ping_geometry.source_level_db))
        towards = receive_directions(pairs, here)
        heard = weights_from_gain(here.receive_beams.gain(towards), pairs.back, here.frequency)
        if pairs.out is pairs.back and here.same_beams and towards is pairs.back.departure:
            return level * heard, heard
        return leg_weights(pairs.out, here.transmit_beams, here.frequency, level), heard

    def add_weighted(
        self, energies: IntensityBuffer, pairs: Pairs, transmit_weights: Complexes, receive_weights: Complexes
    ) -> None:
        """Add the mean intensity of some pairs of a block.

        Args:
            energies: Added to in place.
            pairs: All pairs of the block, or some of them.
            transmit_weights: Weights of its legs out, as from `weights`.
            receive_weights: Of its legs back.
        """
        for part in coherent_subsets(pairs):
            for copy in split_by_coherence(part, self.delay_field, self.ping_geometry):
                self._add(energies, copy, transmit_weights, receive_weights)

    def _add(
        self, energies: IntensityBuffer, pairs: Pairs, transmit_weights: Complexes, receive_weights: Complexes
    ) -> None:
        """Add pairs of which nothing is random but the phase of the place."""
        kept, mean = self.replica_jitter.interference_factor, self.replica_jitter.mean_energy
        support = len(self.table.samples) / self.table.rate
        if pairs.interferes:
            self._add_coherent_facets(energies, pairs, transmit_weights, receive_weights)
            return
        # A pair and its reverse arrive together, and unless jitter parts them they are one.
        mirrored = pairs.out is pairs.back and mean == kept and contains_reversed_pairs(pairs.pair)
        rows = np.flatnonzero(pairs.pair[:, 0] <= pairs.pair[:, 1]) if mirrored else np.arange(len(pairs.pair))
        for channel in range(self.ping_geometry.channel_count):
            delay, energy, first, late, weight = _sort(
                pairs.out.delay, pairs.back.delay, transmit_weights[channel % len(transmit_weights)],
                receive_weights[channel % len(receive_weights)],
                pairs.pair, rows, mirrored, pairs.strength, support, kept, mean - kept,
            )  # fmt: skip
            deposit_energy(energies.cells[channel], self.grid.first_time, self.grid.energy_rate, delay, energy)
            if len(late):
                add_groups(
                    energies.intensity[channel], self.grid.start, self.grid.sample_rate, self.table.samples,
                    self.table.start, self.table.rate, first, late, weight, kept, mean - kept,
                )  # fmt: skip

    def _add_coherent_facets(
        self, energies: IntensityBuffer, pairs: Pairs, transmit_weights: Complexes, receive_weights: Complexes
    ) -> None:
        """Add facets of one target, or of a part of it: arrivals all interfere, a pair of rays is one replica."""
        if energies.specular_sums and energies.specular_sums[0].object_name != pairs.scatterers.object:
            energies.flush_specular()
        if not energies.specular_sums:
            energies.specular_sums.append(SpecularSums(self.grid, self.ping_geometry.pulse, pairs.scatterers.object))
        sums, channels = energies.specular_sums[0], range(len(energies.intensity))
        kept, mean = self.replica_jitter.interference_factor, self.replica_jitter.mean_energy
        group: Hashable = _random_bounces(pairs), len(pairs.pair)
        for (i, j), strength, names in zip(pairs.pair, pairs.strength, pairs.rays(), strict=True):
            weight = np.stack(
                [
                    transmit_weights[c % len(transmit_weights)][i]
                    * receive_weights[c % len(receive_weights)][j]
                    * strength
                    for c in channels
                ]
            )
            delay = pairs.out.delay[i] + pairs.back.delay[j]
            for key, share in ((group, kept), ((group, names), mean - kept)):
                if share:
                    sums.add(key, share, delay, weight)

    @property
    def has_random_paths(self) -> bool:
        """Return True if jitter or uneven water make the paths of one scatterer interfere only in part."""
        uneven = self.delay_field is not None and self.delay_field.inhomogeneity.rms_index != 0
        return uneven or self.replica_jitter.mean_energy != self.replica_jitter.interference_factor

    @property
    def is_short_pulse(self) -> bool:
        """Whether overlaps of the pulse with itself are well told by their energy: it is no long chirp."""
        return _is_short_pulse(self.table)

    def add_fast_reverberation(self, energies: IntensityBuffer, swath: ReverberationSamples) -> None:
        """Add the mean intensity of all the ground of a part of a ping."""
        sizes = self.swath_sizes(swath)
        self.add_swath(energies, swath, *sizes)
        if len(swath.interference_ranges):
            self.add_fringes(energies, swath, *sizes)

    def swath_sizes(self, swath: ReverberationSamples) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Sizes of all legs of a swath times the gains of the transmit and of the receive beam [1], (f, n) each."""
        sent, swept = _sizes(self.ping_geometry.transmit_beams, swath), moving_array_axes(self.ping_geometry)
        alike = self.ping_geometry.same_beams and swept is None
        return sent, sent if alike else _sizes(self.ping_geometry.receive_beams, swath, swept)

    def add_swath(
        self,
        energies: IntensityBuffer,
        swath: ReverberationSamples,
        sent: NDArray[np.float32],
        heard: NDArray[np.float32],
    ) -> None:
        """Add the energies of all pairs of a swath, without what pairs that arrive within one pulse have in common."""
        level = float(amplitude_ratio(self.ping_geometry.source_level_db))
        kept, mean = self.replica_jitter.interference_factor, self.replica_jitter.mean_energy
        pairs = swath.delay, sent, heard, swath.pair, swath.count, swath.rows, swath.cross_section
        deposit_pair_energies(
            *pairs, level, kept, mean - kept, energies.cells[0], self.grid.first_time, self.grid.energy_rate
        )  # fmt: skip

    def add_fringes(
        self,
        energies: IntensityBuffer,
        swath: ReverberationSamples,
        sent: NDArray[np.float32],
        heard: NDArray[np.float32],
    ) -> None:
        """Add what pairs of a swath that arrive within one pulse have in common, which may be less than nothing."""
        ping_geometry, level = self.ping_geometry, float(amplitude_ratio(self.ping_geometry.source_level_db))
        kept = self.replica_jitter.interference_factor
        pairs = swath.delay, sent, heard, swath.pair, swath.count, swath.rows, swath.cross_section
        cells = energies.cells[0], self.grid.first_time, self.grid.energy_rate
        if kept > 0:
            likeness, _ = _autocorrelation(self.table)
            lags = likeness, self.table.rate / LAGS_PER_CELL
            deposit_interference(
                *pairs, swath.amplitude, swath.interference_ranges, level, kept, ping_geometry.frequency, *lags, *cells
            )

    def time_series(self, energies: IntensityBuffer) -> Floats:
        """Expected intensity at the grid's times [uPa^2], shape (channels, samples)."""
        energies.flush_specular()
        return (
            convolve_energy_spectrum(energies.cells, self.grid, _shape(self.ping_geometry.pulse, self.grid))
            + energies.intensity
        )


@lru_cache(maxsize=4)
def _shape(pulse: ReceivedPulse, grid: TimeGrid) -> Complexes:
    """What a pulse makes of energies on a grid: every ping wants the same."""
    shape = energy_spectrum_factors(grid, pulse.spectrum(grid.frequencies))
    shape.flags.writeable = False  # shared by all pings
    return shape


def _sizes(
    beams: Beams, swath: ReverberationSamples, swept: tuple[Floats, Floats] | None = None
) -> NDArray[np.float32]:
    """Size of every leg times the gain of one beam towards it [1], shape (f, n); swept: as of `moving_array_axes`."""
    out = np.empty(swath.delay.shape, np.float32)
    axes, drift = swept or (np.array([beams.axes] * 3), np.zeros((2, 3)))
    leg_amplitudes(
        swath.departure, swath.amplitude, swath.delay, axes, drift, swept is not None, beams.steer, beams.scale,
        beams.tables, beams.per_unit, beams.element, out,
    )  # fmt: skip
    return out


@lru_cache(maxsize=4)
def _is_short_pulse(table: PulseTable) -> bool:
    likeness, energy = _autocorrelation(table)
    alike = np.abs(likeness[1:]).sum() * 2 * LAGS_PER_CELL / table.rate
    return bool(alike > 0.25 * energy)


@lru_cache(maxsize=4)
def _autocorrelation(table: PulseTable) -> tuple[NDArray[np.complex64], float]:
    """Autocorrelation of the pulse at lags from 0 on, 1 at 0, and how long the pulse's energy takes in time [s]."""
    pulse, rate = table.samples, table.rate
    size = scipy.fft.next_fast_len(2 * len(pulse))
    power = np.abs(scipy.fft.fft(pulse, size)) ** 2
    alike = scipy.fft.ifft(power)[: len(pulse) : LAGS_PER_CELL]
    envelope = np.abs(pulse) ** 2
    duration = float(envelope.sum() ** 2 / (envelope**2).sum() / rate)
    return (alike / alike[0].real).astype(np.complex64), duration


def _random_bounces(pairs: Pairs) -> tuple[int, int] | None:
    """Labels of the random bounces that pairs of one part have met; None where nothing is random."""
    out, back = pairs.out.glints, pairs.back.glints
    if out is None or back is None:
        return None
    one, other = sorted((out.bounce_id[pairs.pair[0, 0]], back.bounce_id[pairs.pair[0, 1]]))
    return one, other


def contains_reversed_pairs(pair: NDArray[np.int64]) -> bool:
    """Whether the reverse of every pair is there too."""
    there = set(map(tuple, pair.tolist()))
    return there == {(j, i) for i, j in there}


@njit(cache=True, nogil=True, error_model="numpy")
def _sort(
    delay_out: Floats, delay_back: Floats, transmit_weights: Complexes, receive_weights: Complexes,
    pair: NDArray[np.int64],
    rows: NDArray[np.int64], mirrored: bool, strength: Floats, support: float, interference_factor: float,
    independent_energy: float,
) -> tuple[Floats, Floats, NDArray[np.int64], Floats, Complexes]:  # fmt: skip
    """Sort the replicas of every scatterer into those that stand alone in time and those that interfere.

    Args:
        delay_out: One-way delays of the legs out [s], (f, n).
        delay_back: Of the legs back [s], (g, n).
        transmit_weights: Weights of the legs out in one beam, (f, n).
        receive_weights: Of the legs back, (g, n).
        pair: Rows of the legs out and back, (p, 2).
        rows: Which of the pairs are asked.
        mirrored: Whether each of them stands for its reverse too, which is as late and not asked.
        strength: Pressure scattered re incident [m], (p, n).
        support: How far apart replicas still interfere [s].
        interference_factor: Part of interference that jitter leaves [1].
        independent_energy: Energy of each replica that does not interfere [1].

    Returns:
        Delay and energy of those alone; then, of the others, the first row of each group (and the end),
        delay and weight.
    """
    count, points = rows.size, delay_out.shape[1]
    alone_delay, alone_energy = np.empty(count * points), np.empty(count * points)
    first, late = np.empty(count * points + 1, np.int64), np.empty(count * points)
    weight = np.empty(count * points, np.complex128)
    tau, w, order = np.empty(count), np.empty(count, np.complex128), np.empty(count, np.int64)
    # neighbours arrive in much the same order, so that there is little left to sort
    usual, k = np.zeros(count), points // 2
    for p in range(count if points > 0 else 0):
        usual[p] = delay_out[pair[rows[p], 0], k] + delay_back[pair[rows[p], 1], k]
    asked = rows[np.argsort(usual)]
    alone, groups, filled = 0, 0, 0
    for n in range(points):
        m = 0
        for p in asked:
            i, j = pair[p, 0], pair[p, 1]
            value = transmit_weights[i, n] * receive_weights[j, n]
            if mirrored and i != j:
                value += transmit_weights[j, n] * receive_weights[i, n]
            value *= strength[p, n]
            if value != 0:
                tau[m] = delay_out[i, n] + delay_back[j, n]
                w[m] = value
                k = m
                while k > 0 and tau[order[k - 1]] > tau[m]:
                    order[k] = order[k - 1]
                    k -= 1
                order[k] = m
                m += 1
        a = 0
        while a < m:
            b = a + 1
            while b < m and tau[order[b]] - tau[order[b - 1]] <= support:
                b += 1
            if tau[order[b - 1]] - tau[order[a]] <= SAME_DELAY:
                total, energy = 0j, 0.0
                for k in range(a, b):
                    total += w[order[k]]
                    energy += abs(w[order[k]]) ** 2
                alone_delay[alone] = tau[order[a]]
                alone_energy[alone] = interference_factor * abs(total) ** 2 + independent_energy * energy
                alone += 1
            else:
                first[groups] = filled
                groups += 1
                for k in range(a, b):
                    late[filled] = tau[order[k]]
                    weight[filled] = w[order[k]]
                    filled += 1
            a = b
    first[groups] = filled
    return alone_delay[:alone], alone_energy[:alone], first[: groups + 1], late[:filled], weight[:filled]
