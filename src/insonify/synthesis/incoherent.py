"""The incoherent reading: the expected intensity, free of speckle.

Scatterers have random phases, so their echoes add as energies. The paths of one scatterer interfere:
reciprocal pairs arrive together and give 4 |A|^2, pairs closer than the pulse make fringes. Only what is
further apart than the pulse adds as energy from the start.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.fft
from numba import njit
from numpy.typing import NDArray

from insonify.records.pairs import Pairs
from insonify.records.swath import Swath
from insonify.sonar.beam import Beams
from insonify.sonar.heard import HeardPulse
from insonify.sonar.stance import Stance
from insonify.synthesis._groups import PulseTable, add_groups
from insonify.synthesis._spread import spread_energy
from insonify.synthesis._swath_energies import lay_fringes, lay_pairs, leg_sizes
from insonify.synthesis.grid import TimeGrid, energy_shape, heard_energy
from insonify.synthesis.moments import interfering
from insonify.synthesis.perturbation import Perturbation
from insonify.synthesis.weights import leg_weights
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
SAME_DELAY = 1e-10
"""Delays this close share one pulse: their carriers are in the weights, and no envelope changes so fast [s]."""

LAGS_PER_CELL = 2
"""Entries of the pulse table to a lag of its autocorrelation."""


@dataclass(frozen=True, slots=True)
class Energies:
    """What has been heard so far."""

    cells: Floats
    """Energies that do not interfere, on the energy grid, shape (channels, cells)."""
    intensity: Floats
    """Intensity of groups that do, at the output samples, shape (channels, samples)."""

    def __iadd__(self, other: "Energies") -> "Energies":
        """Add what another has heard."""
        self.cells[...] += other.cells
        self.intensity[...] += other.intensity
        return self


@dataclass(frozen=True, slots=True)
class Incoherent:
    """Hears expected intensity [uPa^2]."""

    stance: Stance
    grid: TimeGrid
    perturbation: Perturbation
    table: PulseTable

    @property
    def even(self) -> bool:
        """Whether it wants evenly laid points, for an expectation."""
        return True

    def silence(self) -> Energies:
        """Nothing heard yet."""
        channels = self.stance.channel_count
        return Energies(self.grid.energy_cells(channels), np.zeros((channels, self.grid.count)))

    def take_in(self, energies: Energies, pairs: Pairs) -> None:
        """Add the mean intensity of one block of scatterers."""
        level = float(amplitude_ratio(self.stance.source_level_db))
        sent = leg_weights(pairs.out, self.stance.transmit_beams, self.stance.frequency, level)
        heard = leg_weights(pairs.back, self.stance.receive_beams, self.stance.frequency)
        for part in interfering(pairs):
            self._add(energies, part, sent, heard)

    def _add(self, energies: Energies, pairs: Pairs, sent: Complexes, heard: Complexes) -> None:
        """Add pairs of which nothing is random but the phase of the place."""
        kept, mean = self.perturbation.kept_interference, self.perturbation.mean_energy
        support = len(self.table.samples) / self.table.rate
        if pairs.together:
            self._add_together(energies, pairs, sent, heard)
            return
        for channel in range(self.stance.channel_count):
            delay, energy, first, late, weight = _sort(
                pairs.out.delay, pairs.back.delay, sent[channel % len(sent)], heard[channel % len(heard)],
                pairs.pair, pairs.strength, support, kept, mean - kept,
            )  # fmt: skip
            spread_energy(energies.cells[channel], self.grid.first_time, self.grid.energy_rate, delay, energy)
            add_groups(
                energies.intensity[channel], self.grid.start, self.grid.sample_rate, self.table.samples,
                self.table.start, self.table.rate, first, late, weight, kept, mean - kept,
            )  # fmt: skip

    def _add_together(self, energies: Energies, pairs: Pairs, sent: Complexes, heard: Complexes) -> None:
        """Add facets of one target, whose arrivals all interfere; a pair of rays is one replica of all of them."""
        kept, mean = self.perturbation.kept_interference, self.perturbation.mean_energy
        i, j = pairs.pair.T
        delay = pairs.out.delay[i] + pairs.back.delay[j]
        replica = np.broadcast_to(np.arange(len(i))[:, None], delay.shape)
        for channel, intensity in enumerate(energies.intensity):
            weight = sent[channel % len(sent)][i] * heard[channel % len(heard)][j] * pairs.strength
            there = weight != 0
            late, weighs = delay[there], weight[there]
            whole = np.array([0, len(late)])
            apart = np.searchsorted(replica[there], np.arange(len(i) + 1))
            for first, share in ((whole, kept), (apart, mean - kept)):
                if share:
                    add_groups(
                        intensity, self.grid.start, self.grid.sample_rate, self.table.samples, self.table.start,
                        self.table.rate, first, late, weighs, share, 0.0,
                    )  # fmt: skip

    @property
    def brief(self) -> bool:
        """Whether overlaps of the pulse with itself are well told by their energy: it is no long chirp."""
        likeness, energy = _likeness(self.table)
        rate = self.table.rate / LAGS_PER_CELL
        alike = np.abs(likeness[1:]).sum() * 2 / rate
        return bool(alike > 0.25 * energy)

    def take_in_swath(self, energies: Energies, swath: Swath) -> None:
        """Add the mean intensity of all the ground of a part of a ping."""
        stance, level = self.stance, float(amplitude_ratio(self.stance.source_level_db))
        sent = _sizes(stance.transmit_beams, swath)
        heard = sent if stance.alike else _sizes(stance.receive_beams, swath)
        kept, mean = self.perturbation.kept_interference, self.perturbation.mean_energy
        pairs = swath.delay, sent, heard, swath.pair, swath.count, swath.rows, swath.section
        cells = energies.cells[0], self.grid.first_time, self.grid.energy_rate
        lay_pairs(*pairs, level, kept, mean - kept, *cells)
        if len(swath.meeting) and kept > 0:
            likeness, _ = _likeness(self.table)
            lags = likeness, self.table.rate / LAGS_PER_CELL
            lay_fringes(*pairs, swath.amplitude, swath.meeting, level, kept, stance.frequency, *lags, *cells)

    def series(self, energies: Energies) -> Floats:
        """Expected intensity at the grid's times [uPa^2], shape (channels, samples)."""
        return heard_energy(energies.cells, self.grid, _shape(self.stance.pulse, self.grid)) + energies.intensity


@lru_cache(maxsize=4)
def _shape(pulse: HeardPulse, grid: TimeGrid) -> Complexes:
    """What a pulse makes of energies on a grid: every ping wants the same."""
    shape = energy_shape(grid, pulse.spectrum(grid.frequencies))
    shape.flags.writeable = False  # shared by all pings
    return shape


def _sizes(beams: Beams, swath: Swath) -> NDArray[np.float32]:
    """Size of every leg times the gain of one beam towards it [1], shape (f, n)."""
    out = np.empty(swath.delay.shape, np.float32)
    leg_sizes(
        swath.departure, swath.amplitude, beams.axes, beams.steer, beams.scale, beams.tables, beams.per_unit,
        beams.element, out,
    )  # fmt: skip
    return out


def _likeness(table: PulseTable) -> tuple[NDArray[np.complex64], float]:
    """Autocorrelation of the pulse at lags from 0 on, 1 at 0, and how long the pulse's energy takes in time [s]."""
    return _likeness_of(table.samples.tobytes(), table.rate)


@lru_cache(maxsize=4)
def _likeness_of(samples: bytes, rate: float) -> tuple[NDArray[np.complex64], float]:
    pulse = np.frombuffer(samples, np.complex128)
    size = scipy.fft.next_fast_len(2 * len(pulse))
    power = np.abs(scipy.fft.fft(pulse, size)) ** 2
    alike = scipy.fft.ifft(power)[: len(pulse) : LAGS_PER_CELL]
    envelope = np.abs(pulse) ** 2
    duration = float(envelope.sum() ** 2 / (envelope**2).sum() / rate)
    return (alike / alike[0].real).astype(np.complex64), duration


@njit(cache=True, nogil=True, error_model="numpy")
def _sort(
    delay_out: Floats, delay_back: Floats, sent: Complexes, heard: Complexes, pair: NDArray[np.int64],
    strength: Floats, support: float, kept: float, apart: float,
) -> tuple[Floats, Floats, NDArray[np.int64], Floats, Complexes]:  # fmt: skip
    """Sort the replicas of every scatterer into those that stand alone in time and those that interfere.

    Returns:
        Delay and energy of those alone; then, of the others, the first row of each group (and the end),
        delay and weight.
    """
    count, points = pair.shape[0], delay_out.shape[1]
    alone_delay, alone_energy = np.empty(count * points), np.empty(count * points)
    first, late = np.empty(count * points + 1, np.int64), np.empty(count * points)
    weight = np.empty(count * points, np.complex128)
    tau, w, order = np.empty(count), np.empty(count, np.complex128), np.empty(count, np.int64)
    alone, groups, rows = 0, 0, 0
    for n in range(points):
        m = 0
        for p in range(count):
            i, j = pair[p, 0], pair[p, 1]
            value = sent[i, n] * heard[j, n] * strength[p, n]
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
                alone_energy[alone] = kept * abs(total) ** 2 + apart * energy
                alone += 1
            else:
                first[groups] = rows
                groups += 1
                for k in range(a, b):
                    late[rows] = tau[order[k]]
                    weight[rows] = w[order[k]]
                    rows += 1
            a = b
    first[groups] = rows
    return alone_delay[:alone], alone_energy[:alone], first[: groups + 1], late[:rows], weight[:rows]
