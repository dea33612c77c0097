"""The coherent reading: every arrival adds its pulse, in phase.

Pairs are laid on the time grid block by block and never written out. Where both legs of a pair share
their delays (out and back from one place), the two orders of a pair are one echo of their summed weight.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.records.arrivals import Arrivals
from insonify.records.pairs import Pairs
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._gridding import deposit_pressure
from insonify.synthesis._waveform_basis_kernel import group_layout
from insonify.synthesis.accumulator import Requirements
from insonify.synthesis.arrival_weights import arrival_weights
from insonify.synthesis.direction_grid import DirectionGrid, direction_grid
from insonify.synthesis.element_arrivals import ReceivePoints, absorption_np_per_m, deposit, receive_points
from insonify.synthesis.leg_weights import leg_weights
from insonify.synthesis.moving_beams import deposit_beams
from insonify.synthesis.replica_jitter import ReplicaJitter
from insonify.synthesis.sector_interpolation import SectorInterpolation, sector_interpolation
from insonify.synthesis.time_grid import TimeGrid, convolve_pulse, convolve_waveforms
from insonify.synthesis.waveform_basis import WaveformBasis, start_delay, waveform_basis
from insonify.units import amplitude_ratio

Cells = NDArray[np.complex64]


@dataclass(frozen=True)
class CoherentAccumulator:
    """Hears complex pressure [uPa]."""

    ping_geometry: PingGeometry
    grid: TimeGrid
    replica_jitter: ReplicaJitter
    basis: WaveformBasis = field(default_factory=lambda: WaveformBasis(np.zeros(1)))
    """Waveforms of which echoes are sums: `waveform_basis` the ping_geometry."""
    water: Water = field(default_factory=Water)
    """Between sonar and scatterers, for elements and for a sonar under way."""

    @cached_property
    def _ends(self) -> ReceivePoints:
        return receive_points(self.ping_geometry)

    @cached_property
    def _sector(self) -> SectorInterpolation | None:
        if self.ping_geometry.elements is None or np.any(self._ends.orientation_row):
            return None
        ends, speed = self._ends, self.ping_geometry.receive_sound_speed
        return sector_interpolation(
            ends.position, ends.velocity, ends.acceleration, self.grid, self.ping_geometry.frequency, speed
        )

    @cached_property
    def _fan(self) -> DirectionGrid | None:
        return direction_grid(self.ping_geometry)

    @cached_property
    def _loss(self) -> float:
        return absorption_np_per_m(self.water, self.ping_geometry.frequency)

    @property
    def uses_far_field(self) -> bool:
        """Return True if few beams of a stationary sonar are recorded: its far field suffices."""
        standing = (
            self.ping_geometry.is_static and self.ping_geometry.elements is None and not self.ping_geometry.sub_bands
        )
        return standing and self._fan is None

    @property
    def requirements(self) -> Requirements:
        """Properties of the path pairs that `add` expects."""
        return Requirements(quadrature=False, negligible_pairs=False)

    def empty(self) -> Cells:
        """Cells with nothing in them, one row a channel."""
        if self.uses_far_field:
            return self.grid.cells(self.ping_geometry.channel_count)
        groups, together = group_layout(len(self.basis.doppler))
        places = 0 if self._sector is None else len(self._sector.point_position)
        channels = self.ping_geometry.channel_count if self._fan is None else self._fan.row_count
        rows = len(self.basis.band), channels + places, groups
        return self.grid.cells(int(np.prod(rows)) * together).reshape(*rows, -1, together)

    def add(self, cells: Cells, pairs: Pairs) -> None:
        """Add the echoes of one block of scatterers to the cells."""
        if not self.uses_far_field and self.ping_geometry.elements is None:
            deposit_beams(
                cells, pairs, self.ping_geometry, self.grid, self.replica_jitter, self.basis, self._ends, self.water,
                self._loss, self._fan,
            )  # fmt: skip
            return
        if not self.uses_far_field:
            deposit(
                cells, pairs, self.ping_geometry, self.grid, self.replica_jitter, self.basis, self._ends, self.water,
                self._loss, self._sector,
            )  # fmt: skip
            return
        level = float(amplitude_ratio(self.ping_geometry.source_level_db))
        sent = leg_weights(pairs.out, self.ping_geometry.transmit_beams, self.ping_geometry.frequency, level)
        heard = leg_weights(pairs.back, self.ping_geometry.receive_beams, self.ping_geometry.frequency)
        # one delay both ways round: two pairs are heard as one, also where a moving sea turned their phases apart
        merge = pairs.out.delay is pairs.back.delay and self.replica_jitter.is_zero
        rows = {(int(i), int(j)): row for row, (i, j) in enumerate(pairs.pair)}
        names = pairs.rays()
        for (i, j), row in rows.items():
            twin = merge and i != j and (j, i) in rows
            if twin and i > j:
                continue
            strength = pairs.strength[row] * pairs.scatterers.phase
            if not self.replica_jitter.is_zero:
                strength = strength * self.replica_jitter.factor(pairs.scatterers.scatterer_id, *names[row])
            delay = pairs.out.delay[i] + pairs.back.delay[j]
            for channel, row_of_cells in enumerate(cells):
                s, h = sent[channel % len(sent)], heard[channel % len(heard)]
                weight = s[i] * h[j] + s[j] * h[i] if twin else s[i] * h[j]
                deposit_pressure(
                    row_of_cells, self.grid.first_time, self.grid.cell_rate, delay,
                    (weight * strength).astype(np.complex64),
                )  # fmt: skip

    def time_series(self, cells: Cells) -> NDArray[np.complex64]:
        """Complex envelope at the grid's times [uPa], shape (channels, samples)."""
        pulse = self.ping_geometry.pulse
        if self.uses_far_field:
            return convolve_pulse(cells, self.grid, pulse.spectrum(self.grid.frequencies))
        spectra = self.basis.spectra(pulse, self.grid.frequencies)
        if self._sector is not None:
            middle = 0.0 if self.ping_geometry.is_static else pulse.pulse.duration / 2
            cells = self._sector.to_elements(cells, self.grid, middle)
        if self._fan is not None:
            cells = self._fan.to_beams(cells)
        heard = convolve_waveforms(cells, self.grid, spectra)
        elements = self.ping_geometry.elements
        return heard if elements is None else (heard * elements.response[:, None]).astype(np.complex64)


def coherent_from_arrivals(
    arrivals: Arrivals,
    ping_geometry: PingGeometry,
    grid: TimeGrid,
    basis: WaveformBasis | None = None,
    *,
    channel: int | None = None,
) -> NDArray[np.complex64]:
    """What the sonar hears of a list of arrivals: the coherent reading, row by row.

    Args:
        arrivals: Paths of one ping.
        ping_geometry: The sonar at that ping.
        grid: Times wanted.
        basis: Waveforms of which echoes are sums; None: they are made here.
        channel: Which channel; None: all beams of the side, which hear the same arrivals.

    Returns:
        Complex envelope [uPa], shape (channels, samples).

    Raises:
        ValueError: No channel, and the channels are elements: each hears arrivals of its own.
    """
    if channel is None and ping_geometry.elements is not None:
        raise ValueError("channel is None, and each element has arrivals of its own. Give the channel that was asked.")
    made = waveform_basis(ping_geometry) if basis is None else basis
    parts = made.weights(arrivals.doppler)
    chosen = range(ping_geometry.channel_count) if channel is None else [channel]
    sooner = start_delay(ping_geometry.pulse, arrivals.doppler)  # shapes are stretched about their middle
    delay, turn = arrivals.delay - sooner, np.exp(2j * np.pi * ping_geometry.frequency * sooner)
    cells = grid.cells(len(made.band) * len(chosen) * len(parts)).reshape(len(made.band), len(chosen), len(parts), -1)
    for band, row in np.ndindex(cells.shape[:2]):
        weight = arrival_weights(arrivals, ping_geometry, chosen[row], band) * turn
        for cell, part in zip(cells[band, row], parts, strict=True):
            deposit_pressure(cell, grid.first_time, grid.cell_rate, delay, (weight * part).astype(np.complex64))
    return convolve_waveforms(cells[..., None], grid, made.spectra(ping_geometry.pulse, grid.frequencies))
