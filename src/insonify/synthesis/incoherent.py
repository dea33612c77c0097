"""Incoherent accumulator: expected intensity, free of speckle.

Scatterers have random phases, so their echoes add as energies. The paths of one scatterer interfere: reciprocal pairs
arrive together and give 4 |A|^2, and pairs closer in time than the pulse make fringes. Arrivals further apart than the
pulse add as energies from the start. An energy is the mean-square pressure of an arrival of a pulse of unit rms
[uPa^2]: it adds energy times |pulse|^2 to the intensity over time.
"""

from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

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
from insonify.synthesis._fast_reverberation_energies import (
    DelayCells,
    MovingArray,
    WeightedSamples,
    deposit_interference,
    deposit_pair_energies,
    leg_amplitudes,
)
from insonify.synthesis._gridding import deposit_energy, deposit_energy_on_rows
from insonify.synthesis._row_energies_kernel import (
    SAME_DELAY,
    PairEnergies,
    RowGrid,
    RowGroups,
    RowLegs,
    deposit_pairs_on_rows,
)
from insonify.synthesis.accumulator import Mapper, Requirements
from insonify.synthesis.coherence_factors import split_by_coherence
from insonify.synthesis.coherent_groups import PulseTable, add_groups
from insonify.synthesis.coherent_subsets import coherent_subsets
from insonify.synthesis.direction_powers import DirectionPowers, Real
from insonify.synthesis.leg_weights import leg_weights, weights_from_gain, weights_from_two_gains
from insonify.synthesis.receive_beam_motion import moving_array, receive_directions
from insonify.synthesis.replica_jitter import ReplicaJitter
from insonify.synthesis.specular_sums import SpecularSums
from insonify.synthesis.time_grid import EnergyFilter, TimeGrid, convolve_energy_spectrum, energy_filter
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Complexes = NDArray[np.complex128]

CELLS_PER_TASK = 1024
"""Cells in which one thread adds up the rows of directions for all beams."""
CHANNELS_PER_TASK = 32
"""Channels whose series one thread computes together: a multiple of those of one transform."""
DENSE = 1000
"""Least number of points of a block of which interference between unlike directions is deposited by direction."""
LAGS_PER_CELL = 2
"""Entries of the pulse table per lag of its autocorrelation."""


@dataclass(frozen=True, slots=True)
class IntensityBuffer:
    """Sums of the arrivals of a ping."""

    cells: Floats
    """Energies of arrivals that do not interfere, on the energy grid [uPa^2], shape (channels, cells)."""
    intensity: Floats
    """Intensity of groups of interfering arrivals at the output samples [uPa^2], shape (channels, samples)."""
    specular_sums: list[SpecularSums] = field(default_factory=list)
    """Arrivals of the last smooth target, to which further blocks may be added; none or one."""
    rows: Singles | None = None
    """Energies for all beams, by direction, on the energy grid [uPa^2], shape (rows, cells); None: no rows."""
    row_intensity: Floats | None = None
    """Intensity of groups of interfering arrivals by direction [uPa^2], shape (rows, samples); None: no rows."""

    @property
    def nbytes(self) -> int:
        """Memory of a buffer with rows [bytes], which limits the parts of a ping computed at once; 0 without rows."""
        if self.rows is None or self.row_intensity is None:
            return 0
        return self.rows.nbytes + self.row_intensity.nbytes + self.cells.nbytes

    def flush_specular(self) -> None:
        """Add the power of a completed smooth target to the intensity."""
        while self.specular_sums:
            self.specular_sums.pop().flush_specular(self.intensity)

    def __iadd__(self, other: "IntensityBuffer") -> "IntensityBuffer":
        """Add the sums of another buffer."""
        self.flush_specular()
        other.flush_specular()
        self.cells[...] += other.cells
        self.intensity[...] += other.intensity
        if self.rows is not None and other.rows is not None:
            self.rows[...] += other.rows
        if self.row_intensity is not None and other.row_intensity is not None:
            self.row_intensity[...] += other.row_intensity
        return self


@dataclass(frozen=True)
class IncoherentAccumulator:
    """Accumulator of expected intensity [uPa^2]."""

    ping_geometry: PingGeometry
    grid: TimeGrid
    """Output samples and cells of the energy grid."""
    replica_jitter: ReplicaJitter
    table: PulseTable
    """Samples of the received pulse."""
    delay_field: DelayField | None = None
    """Random delays in inhomogeneous water; None: homogeneous."""
    directions: DirectionPowers | None = None
    """Rows of directions, where beams are many; None: each beam has its own energies."""

    @property
    def requirements(self) -> Requirements:
        """Quadrature points; of short pulses the seabed may come by the fast reverberation."""
        return Requirements(fast_reverberation=self.is_short_pulse, approximate_edges=True)

    def empty(self) -> IntensityBuffer:
        """Empty buffer."""
        channels = self.ping_geometry.channel_count
        cells, samples = self.grid.energy_cells(channels), np.zeros((channels, self.grid.sample_count))
        if self.directions is None:
            return IntensityBuffer(cells, samples)
        rows = self.directions.beam_powers.shape[1]
        return IntensityBuffer(
            cells, samples, rows=np.zeros((rows, cells.shape[1]), np.float32),
            row_intensity=np.zeros((rows, samples.shape[1])),
        )  # fmt: skip

    def add(self, energies: IntensityBuffer, pairs: Pairs) -> None:
        """Add the mean intensity of one block of scatterers."""
        if energies.rows is None or pairs.interferes:
            self.add_weighted(energies, pairs, *self.weights(pairs))
        elif len(pairs.pair) == 1:
            self._add_pair_to_rows(energies.rows, pairs)
        else:
            self._add_pairs_to_rows(energies, pairs)

    def _add_pairs_to_rows(self, energies: IntensityBuffer, pairs: Pairs) -> None:
        """Add the energies of all pairs to the rows of directions; beam by beam where unlike directions interfere."""
        assert self.directions is not None
        assert energies.rows is not None
        directions, geometry = self.directions, self.ping_geometry
        grid = RowGrid(self.grid.first_time, self.grid.energy_rate, np.pi * directions.extent * directions.step)
        support = len(self.table.samples) / self.table.rate
        receive_direction = receive_directions(pairs, geometry)
        weights = self.weights(pairs, receive_direction, directions.common)
        legs = RowLegs(
            pairs.transmit_legs.delay, pairs.receive_legs.delay, weights[0][0], weights[1][0],
            directions.rows(receive_direction),
        )  # fmt: skip
        for copy in split_by_coherence(coherent_subsets(pairs), self.delay_field, geometry):
            for one, interfering, independent in self.replica_jitter.expected_parts(copy):
                pair_energies = PairEnergies(one.pair, one.strength, support, interfering, interfering + independent)
                by_direction, added, subtracted, left_out = deposit_pairs_on_rows(
                    energies.rows, grid, legs, pair_energies, len(pairs.scatterers) >= DENSE
                )  # fmt: skip
                self._add_groups_to_rows(energies, by_direction, interfering, independent)
                self._add_groups_to_rows(energies, added, interfering, 0.0)
                self._add_groups_to_rows(energies, subtracted, -interfering, 0.0)
                if len(left_out):
                    part = one.at(left_out)
                    self._add_scatterers(energies, part, *self.weights(part), interfering, independent)

    def _add_groups_to_rows(
        self, energies: IntensityBuffer, groups: RowGroups, interference_factor: float, independent: float
    ) -> None:
        """Add the intensity of each group to the two rows adjacent to its direction."""
        assert energies.row_intensity is not None
        below = np.clip(np.floor(groups.row), 0, len(energies.row_intensity) - 2).astype(int)
        sizes = np.diff(groups.first)
        for number in np.unique(below):
            some = below == number
            part = np.repeat(np.clip(groups.row[some] - number, 0.0, 1.0), sizes[some])
            replicas, first = np.repeat(some, sizes), np.append(0, np.cumsum(sizes[some]))
            for row, share in ((number, 1 - part), (number + 1, part)):
                self._add_groups(
                    energies.row_intensity[row], first, groups.delay[replicas],
                    groups.weight[replicas] * np.sqrt(share), interference_factor, independent,
                )  # fmt: skip

    def _add_pair_to_rows(self, rows: Singles, pairs: Pairs) -> None:
        """Add the energies of scatterers with one pair of legs each to the rows adjacent to their directions."""
        assert self.directions is not None
        geometry, (i, j) = self.ping_geometry, pairs.pair[0]
        direction = receive_directions(pairs, geometry)[j]
        transmit_gain = geometry.transmit_beams.gain(pairs.transmit_legs.departure[i])[0]
        source_pressure = float(amplitude_ratio(geometry.source_level_db))
        power = np.square(source_pressure * transmit_gain * self.directions.common.gain(direction)[0])
        for leg in (pairs.transmit_legs.amplitude[i], pairs.receive_legs.amplitude[j]):
            power *= np.square(leg.real) + np.square(leg.imag)
        delay, row = pairs.transmit_legs.delay[i] + pairs.receive_legs.delay[j], self.directions.rows(direction)
        for one, *shares in self.replica_jitter.expected_parts(pairs):
            energy = sum(shares) * power * np.square(np.abs(one.strength[0]))
            deposit_energy_on_rows(rows, self.grid.first_time, self.grid.energy_rate, delay, energy, row)

    def weights(
        self, pairs: Pairs, receive_direction: Floats | None = None, receive_beams: Beams | None = None
    ) -> tuple[Complexes, Complexes]:
        """Complex weight of the transmit legs [uPa] and the receive legs [1] in each beam, (beams, f, n) each.

        Args:
            pairs: The legs.
            receive_direction: Directions of the receive legs, from `receive_directions`; None: evaluated here.
            receive_beams: Receive beams; None: those of the sonar.
        """
        geometry = self.ping_geometry
        source_pressure = float(amplitude_ratio(geometry.source_level_db))
        if receive_direction is None:
            receive_direction = receive_directions(pairs, geometry)
        receive_gain = (receive_beams or geometry.receive_beams).gain(receive_direction)
        if pairs.transmit_legs is not pairs.receive_legs:
            receive_weight = weights_from_gain(receive_gain, pairs.receive_legs, geometry.frequency)
            transmit_weight = leg_weights(
                pairs.transmit_legs, geometry.transmit_beams, geometry.frequency, source_pressure
            )
            return transmit_weight, receive_weight
        if receive_beams is None and geometry.same_beams and receive_direction is pairs.receive_legs.departure:
            receive_weight = weights_from_gain(receive_gain, pairs.receive_legs, geometry.frequency)
            return source_pressure * receive_weight, receive_weight
        transmit_gain = geometry.transmit_beams.gain(pairs.transmit_legs.departure)
        return weights_from_two_gains(
            transmit_gain, receive_gain, pairs.transmit_legs, geometry.frequency, source_pressure
        )

    def add_weighted(
        self, energies: IntensityBuffer, pairs: Pairs, transmit_weights: Complexes, receive_weights: Complexes
    ) -> None:
        """Add the mean intensity of some pairs of a block.

        Args:
            energies: Buffer, added to in place.
            pairs: All pairs of the block, or some of them.
            transmit_weights: Weights of the transmit legs, from `weights`.
            receive_weights: Weights of the receive legs, from `weights`.
        """
        for copy in split_by_coherence(coherent_subsets(pairs), self.delay_field, self.ping_geometry):
            for one, *shares in self.replica_jitter.expected_parts(copy):
                self._add_scatterers(energies, one, transmit_weights, receive_weights, *shares)

    def _add_scatterers(
        self, energies: IntensityBuffer, pairs: Pairs, transmit_weights: Complexes, receive_weights: Complexes,
        interference_factor: float, independent: float,
    ) -> None:  # fmt: skip
        """Add pairs in which only the scatterers' phases are random."""
        support = len(self.table.samples) / self.table.rate
        if pairs.interferes:
            shares = interference_factor, independent
            self._add_coherent_facets(energies, pairs, transmit_weights, receive_weights, shares)
            return
        # A pair and its reverse arrive together; without jitter they are one arrival.
        reciprocal = (
            pairs.transmit_legs is pairs.receive_legs and independent == 0 and contains_reversed_pairs(pairs.pair)
        )
        rows = np.flatnonzero(pairs.pair[:, 0] <= pairs.pair[:, 1]) if reciprocal else np.arange(len(pairs.pair))
        for channel in range(self.ping_geometry.channel_count):
            delay, energy, first, grouped_delay, weight = _sort(
                pairs.transmit_legs.delay, pairs.receive_legs.delay, transmit_weights[channel % len(transmit_weights)],
                receive_weights[channel % len(receive_weights)], pairs.pair, rows, reciprocal, pairs.strength, support,
                interference_factor, independent,
            )  # fmt: skip
            deposit_energy(energies.cells[channel], self.grid.first_time, self.grid.energy_rate, delay, energy)
            self._add_groups(
                energies.intensity[channel], first, grouped_delay, weight, interference_factor, independent
            )

    def _add_groups(
        self, intensity: Floats, first: NDArray[np.int64], delay: Floats, weight: Complexes,
        interference_factor: float, independent: float,
    ) -> None:  # fmt: skip
        """Add groups of arrivals that interfere to the intensity of one channel or row."""
        if len(delay):
            add_groups(
                intensity, self.grid.start, self.grid.sample_rate, self.table.samples, self.table.start,
                self.table.rate, first, delay, weight, interference_factor, independent,
            )  # fmt: skip

    def _add_coherent_facets(
        self, energies: IntensityBuffer, pairs: Pairs, transmit_weights: Complexes, receive_weights: Complexes,
        shares: tuple[float, float],
    ) -> None:  # fmt: skip
        """Add facets of one target or of a part of it: all arrivals interfere, and a pair of rays is one replica."""
        if energies.specular_sums and energies.specular_sums[0].object_name != pairs.scatterers.object:
            energies.flush_specular()
        if not energies.specular_sums:
            energies.specular_sums.append(SpecularSums(self.grid, self.ping_geometry.pulse, pairs.scatterers.object))
        sums, channels = energies.specular_sums[0], range(len(energies.intensity))
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
            delay = pairs.transmit_legs.delay[i] + pairs.receive_legs.delay[j]
            for key, power_fraction in zip((group, (group, names)), shares, strict=True):
                if power_fraction:
                    sums.add(key, power_fraction, delay, weight)

    @property
    def has_random_paths(self) -> bool:
        """Return True if jitter or uneven water make the paths of one scatterer interfere only in part."""
        inhomogeneous = self.delay_field is not None and self.delay_field.inhomogeneity.rms_index != 0
        jitter = self.replica_jitter
        return inhomogeneous or jitter.mean_energy != jitter.interference_factor or bool(jitter.perturbations)

    @property
    def is_short_pulse(self) -> bool:
        """Return True if self-interference of the pulse is described by its energy: the pulse is no long chirp."""
        return _is_short_pulse(self.table)

    @property
    def pulse_duration(self) -> float:
        """Equivalent duration of the received pulse's envelope, see `_autocorrelation` [s]."""
        return _autocorrelation(self.table)[1]

    @property
    def pulse_lags(self) -> tuple[NDArray[np.complex64], float]:
        """Autocorrelation of the pulse at lags from 0 on, 1 at 0 [1], (lags,); and its lags per second [Hz]."""
        return _autocorrelation(self.table)[0], self.table.rate / LAGS_PER_CELL

    def add_fast_reverberation(self, energies: IntensityBuffer, samples: ReverberationSamples) -> None:
        """Add the mean intensity of the seabed from a block of reverberation samples."""
        weighted_samples = self.weighted_samples(samples, *self.leg_and_beam_amplitudes(samples))
        self.add_pair_energies(energies, weighted_samples)
        if len(samples.interference_ranges):
            self.add_fringes(energies, samples, weighted_samples)

    def leg_and_beam_amplitudes(self, samples: ReverberationSamples) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Amplitudes of all legs times those of the transmit, and of the receive beam towards them [1], (f, n) each."""
        geometry, receiver = self.ping_geometry, self._moving_receiver
        transmit_amplitude = _leg_amplitudes(geometry.transmit_beams, samples)
        if receiver is None and geometry.same_beams:
            return transmit_amplitude, transmit_amplitude
        return transmit_amplitude, _leg_amplitudes(geometry.receive_beams, samples, receiver)

    @cached_property
    def _moving_receiver(self) -> MovingArray | None:
        """Motion of the receive array, the same for all samples of the ping."""
        return moving_array(self.ping_geometry)

    def weighted_samples(
        self, samples: ReverberationSamples, transmit_amplitude: NDArray[np.float32],
        receive_amplitude: NDArray[np.float32],
    ) -> WeightedSamples:  # fmt: skip
        """Samples with the amplitudes of their legs, from `leg_and_beam_amplitudes`, and the pressure of the source."""
        interfering, mean = self.replica_jitter.interference_factor, self.replica_jitter.mean_energy
        return WeightedSamples(
            samples.delay, transmit_amplitude, receive_amplitude, samples.pair, samples.count, samples.rows,
            samples.cross_section, float(amplitude_ratio(self.ping_geometry.source_level_db)), interfering,
            mean - interfering,
        )  # fmt: skip

    def add_pair_energies(self, energies: IntensityBuffer, samples: WeightedSamples) -> None:
        """Add the energies of all pairs of a block, without the interference of pairs within one pulse duration."""
        deposit_pair_energies(samples, DelayCells(energies.cells[0], self.grid.first_time, self.grid.energy_rate))

    def add_fringes(
        self, energies: IntensityBuffer, samples: ReverberationSamples, weighted_samples: WeightedSamples
    ) -> None:
        """Add the interference of pairs that arrive within one pulse duration, which may be negative."""
        cells = DelayCells(energies.cells[0], self.grid.first_time, self.grid.energy_rate)
        if weighted_samples.interference_factor > 0:
            deposit_interference(
                weighted_samples, samples.amplitude, samples.interference_ranges, self.ping_geometry.frequency,
                *self.pulse_lags, cells,
            )  # fmt: skip

    def time_series(self, energies: IntensityBuffer, run: Mapper = map) -> Floats:
        """Expected intensity at the grid's times [uPa^2], shape (channels, samples).

        Args:
            energies: Sums of the arrivals.
            run: Function that maps as `map` does, possibly by several threads.
        """
        energies.flush_specular()
        filtering, intensity = _energy_filter(self.ping_geometry.pulse, self.grid), np.empty_like(energies.intensity)
        cells, groups = (
            self._with_rows(energies.cells, energies.rows, run),
            self._with_rows(energies.intensity, energies.row_intensity, run),
        )

        def convolve(channels: slice) -> None:
            series = convolve_energy_spectrum(cells[channels], self.grid, filtering)
            intensity[channels] = series + groups[channels]

        deque(run(convolve, _slices(len(cells), CHANNELS_PER_TASK)), 0)
        if energies.row_intensity is not None and energies.row_intensity.any():
            # interference between directions, half way, may exceed the energies of a beam by a little
            np.maximum(intensity, 0.0, out=intensity)
        return intensity

    def _with_rows(self, channels: Floats, rows: NDArray[Real] | None, run: Mapper) -> Floats:
        """Sums of all channels, shape (channels, n), with those of the rows of directions, shape (rows, n)."""
        directions = self.directions
        if directions is None or rows is None or not rows.any():
            return channels
        total = np.empty_like(channels)

        def combine(some: slice) -> None:
            total[:, some] = channels[:, some] + directions.to_beams(rows[:, some])

        deque(run(combine, _slices(channels.shape[1], CELLS_PER_TASK)), 0)
        return total


def _slices(count: int, size: int) -> list[slice]:
    """Slices of channels or of cells, for several threads."""
    return [slice(first, first + size) for first in range(0, count, size)]


@lru_cache(maxsize=4)
def _energy_filter(pulse: ReceivedPulse, grid: TimeGrid) -> EnergyFilter:
    """Filter of a pulse on an energy grid, shared by all pings."""
    return energy_filter(grid, pulse.spectrum(grid.frequencies))


def _leg_amplitudes(
    beams: Beams, samples: ReverberationSamples, array: MovingArray | None = None
) -> NDArray[np.float32]:
    """Amplitude of every leg times that of one beam towards it [1], shape (f, n); array: None for one at rest."""
    amplitude = np.empty(samples.delay.shape, np.float32)
    array = array or MovingArray(np.array([beams.axes]), np.zeros((2, 3)), is_moving=False, is_rotating=False)
    leg_amplitudes(samples.departure, samples.amplitude, samples.delay, beams.kernel_tables, array, amplitude)
    return amplitude


@lru_cache(maxsize=4)
def _is_short_pulse(table: PulseTable) -> bool:
    """Return True if the integral of |autocorrelation| over all lags is above a quarter of the equivalent duration."""
    correlation, duration = _autocorrelation(table)
    correlation_time = np.abs(correlation[1:]).sum() * 2 * LAGS_PER_CELL / table.rate
    return bool(correlation_time > 0.25 * duration)


@lru_cache(maxsize=4)
def _autocorrelation(table: PulseTable) -> tuple[NDArray[np.complex64], float]:
    """Autocorrelation of the pulse at lags from 0 on, 1 at 0, and its equivalent duration [s].

    The latter is the squared integral of |pulse|^2 over that of |pulse|^4: of a rectangle, its duration.
    """
    pulse, rate = table.samples, table.rate
    size = scipy.fft.next_fast_len(2 * len(pulse))
    power = np.abs(scipy.fft.fft(pulse, size)) ** 2
    correlation = scipy.fft.ifft(power)[: len(pulse) : LAGS_PER_CELL]
    envelope = np.abs(pulse) ** 2
    duration = float(envelope.sum() ** 2 / (envelope**2).sum() / rate)
    return (correlation / correlation[0].real).astype(np.complex64), duration


def _random_bounces(pairs: Pairs) -> tuple[int, int] | None:
    """Identities of the two random bounces of pairs of one part; None where nothing is random."""
    transmit_glints, receive_glints = pairs.transmit_legs.glints, pairs.receive_legs.glints
    if transmit_glints is None or receive_glints is None:
        return None
    one, other = sorted((transmit_glints.bounce_id[pairs.pair[0, 0]], receive_glints.bounce_id[pairs.pair[0, 1]]))
    return one, other


def contains_reversed_pairs(pair: NDArray[np.int64]) -> bool:
    """Return True if the pairs include the reverse of every pair."""
    pairs = set(map(tuple, pair.tolist()))
    return pairs == {(j, i) for i, j in pairs}


@njit(cache=True, nogil=True, error_model="numpy")
def _sort(
    delay_out: Floats, delay_back: Floats, transmit_weights: Complexes, receive_weights: Complexes,
    pair: NDArray[np.int64], rows: NDArray[np.int64], reciprocal: bool, strength: Floats, support: float,
    interference_factor: float, independent_energy: float,
) -> tuple[Floats, Floats, NDArray[np.int64], Floats, Complexes]:  # fmt: skip
    """Separate the replicas of every scatterer into single arrivals and groups that interfere.

    Args:
        delay_out: One-way delays of the transmit legs [s], (f, n).
        delay_back: One-way delays of the receive legs [s], (g, n).
        transmit_weights: Weights of the transmit legs in one beam [uPa], (f, n).
        receive_weights: Weights of the receive legs in one beam [1], (g, n).
        pair: Rows of the transmit and the receive leg of each pair, (p, 2).
        rows: Rows of the pairs to be processed.
        reciprocal: True if each of them also stands for its reverse, which has the same delay.
        strength: Pressure scattered re incident [m], (p, n).
        support: Largest time between replicas that interfere [s].
        interference_factor: Mean product of two replicas re that without jitter [1].
        independent_energy: Energy of each replica that does not interfere [1].

    Returns:
        Delay of each single arrival [s].
        Energy of each single arrival [uPa^2].
        First replica of each group of interfering arrivals, and one past the last, (groups + 1,).
        Delay of each replica of the groups [s].
        Weight of each replica of the groups [uPa].
    """
    count, points = rows.size, delay_out.shape[1]
    single_delay, single_energy = np.empty(count * points), np.empty(count * points)
    first, grouped_delay = np.empty(count * points + 1, np.int64), np.empty(count * points)
    weight = np.empty(count * points, np.complex128)
    tau, w, order = np.empty(count), np.empty(count, np.complex128), np.empty(count, np.int64)
    # neighbouring scatterers have nearly the same order of arrival, which shortens the insertion sort
    typical_delay, k = np.zeros(count), points // 2
    for p in range(count if points > 0 else 0):
        typical_delay[p] = delay_out[pair[rows[p], 0], k] + delay_back[pair[rows[p], 1], k]
    sorted_rows = rows[np.argsort(typical_delay)]
    singles, groups, filled = 0, 0, 0
    for n in range(points):
        m = 0
        for p in sorted_rows:
            i, j = pair[p, 0], pair[p, 1]
            value = transmit_weights[i, n] * receive_weights[j, n]
            if reciprocal and i != j:
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
                single_delay[singles] = tau[order[a]]
                single_energy[singles] = interference_factor * abs(total) ** 2 + independent_energy * energy
                singles += 1
            else:
                first[groups] = filled
                groups += 1
                for k in range(a, b):
                    grouped_delay[filled] = tau[order[k]]
                    weight[filled] = w[order[k]]
                    filled += 1
            a = b
    first[groups] = filled
    return single_delay[:singles], single_energy[:singles], first[: groups + 1], grouped_delay[:filled], weight[:filled]
