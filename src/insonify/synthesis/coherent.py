"""Coherent accumulator: every arrival adds its pulse with its phase.

Pairs are deposited on the time grid block by block and never stored. Where both legs of a pair have the same delays
(transmitter and receiver at one position), the two orders of a pair are one arrival of their summed weight.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water, absorption_np_per_m
from insonify.records.pairs import Pairs
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._gridding import deposit_pressure
from insonify.synthesis._waveform_basis_kernel import group_layout
from insonify.synthesis.accumulator import Mapper, Requirements
from insonify.synthesis.direction_grid import DirectionGrid, direction_grid
from insonify.synthesis.element_arrivals import (
    ElementCells,
    PingReception,
    ReceivePoints,
    deposit,
    receive_points,
)
from insonify.synthesis.leg_weights import leg_weights
from insonify.synthesis.moving_beams import deposit_beams
from insonify.synthesis.replica_jitter import ReplicaJitter
from insonify.synthesis.sector_interpolation import SectorInterpolation, sector_interpolation
from insonify.synthesis.time_grid import TimeGrid, convolve_pulse, convolve_waveforms
from insonify.synthesis.waveform_basis import WaveformBasis, waveform_basis
from insonify.units import amplitude_ratio

Cells = NDArray[np.complex64]


@dataclass(frozen=True)
class CoherentAccumulator:
    """Accumulator of complex pressure [uPa]."""

    ping_geometry: PingGeometry
    grid: TimeGrid
    replica_jitter: ReplicaJitter
    basis: WaveformBasis = field(default_factory=lambda: WaveformBasis(np.zeros(1)))
    """Waveforms of which received echoes are weighted sums, as from `waveform_basis`."""
    water: Water = field(default_factory=Water)
    """Water between sonar and scatterers, for elements and for a moving sonar."""

    @cached_property
    def _receive_points(self) -> ReceivePoints:
        return receive_points(self.ping_geometry)

    @cached_property
    def _sector(self) -> tuple[SectorInterpolation, WaveformBasis] | None:
        """Sector interpolation of elements, and the waveform basis of its echoes."""
        if self.ping_geometry.elements is None or np.any(self._receive_points.orientation_row):
            return None
        points, geometry, pulse = self._receive_points, self.ping_geometry, self.ping_geometry.pulse
        delay = 0.0 if geometry.is_static else pulse.pulse.duration / 2
        sector = sector_interpolation(
            points.position, points.velocity, points.acceleration, self.grid, geometry.frequency,
            geometry.receive_sound_speed, (pulse.start - delay, pulse.stop - delay),
        )  # fmt: skip
        if sector is None:
            return None
        return sector, waveform_basis(geometry, across=(sector.axis, sector.max_cosine))

    @cached_property
    def _direction_grid(self) -> DirectionGrid | None:
        return direction_grid(self.ping_geometry)

    @cached_property
    def _reception(self) -> PingReception:
        attenuation = absorption_np_per_m(self.water, self.ping_geometry.frequency)
        return PingReception(
            self.ping_geometry, self.grid, self.replica_jitter, self.basis, self._receive_points, self.water,
            attenuation,
        )  # fmt: skip

    @property
    def uses_far_field(self) -> bool:
        """Return True if beams of a stationary sonar are recorded, without direction grid and sub-bands.

        Each leg then has one weight in each beam, by the beam's far-field pattern.
        """
        static_beams = (
            self.ping_geometry.is_static and self.ping_geometry.elements is None and not self.ping_geometry.sub_bands
        )
        return static_beams and self._direction_grid is None

    @property
    def requirements(self) -> Requirements:
        """Properties of the path pairs that `add` expects."""
        return Requirements(quadrature=False, negligible_pairs=False)

    def empty(self) -> Cells | ElementCells:
        """Empty cells: for elements `ElementCells`, otherwise one array."""
        if self.uses_far_field:
            return self.grid.cells(self.ping_geometry.channel_count)
        if self.ping_geometry.elements is None:
            geometry, rows = self.ping_geometry, self._direction_grid
            return self._cells(self.basis, geometry.channel_count if rows is None else rows.row_count)
        elements = self._cells(self.basis, self.ping_geometry.channel_count)
        if self._sector is None:
            return ElementCells(elements, self._cells(self.basis, 0))
        sector, basis = self._sector
        return ElementCells(elements, self._cells(basis, len(sector.point_position)))

    def _cells(self, basis: WaveformBasis, channels: int) -> Cells:
        """Empty grids of some channels, shape (bands, channels, groups, cells, waveforms of a group)."""
        groups, group_size = group_layout(len(basis.doppler))
        rows = len(basis.band), channels, groups
        cells = self.grid.cells(int(np.prod(rows)) * group_size)
        return cells.reshape(*rows, cells.shape[1], group_size)

    def add(self, cells: Any, pairs: Pairs) -> None:
        """Add the arrivals of one block of scatterers to the cells."""
        if not self.uses_far_field and self.ping_geometry.elements is None:
            deposit_beams(cells, pairs, self._reception, self._direction_grid)
            return
        if not self.uses_far_field:
            deposit(cells, pairs, self._reception, self._sector)
            return
        source_pressure = float(amplitude_ratio(self.ping_geometry.source_level_db))
        transmit_weights = leg_weights(
            pairs.transmit_legs, self.ping_geometry.transmit_beams, self.ping_geometry.frequency, source_pressure
        )
        receive_weights = leg_weights(
            pairs.receive_legs, self.ping_geometry.receive_beams, self.ping_geometry.frequency
        )
        # equal delays in both orders: two pairs are one arrival, also where a moving sea gives them different phases
        merges_reciprocal = pairs.transmit_legs.delay is pairs.receive_legs.delay and self.replica_jitter.is_zero
        rows = {(int(i), int(j)): row for row, (i, j) in enumerate(pairs.pair)}
        names = pairs.rays()
        for (i, j), row in rows.items():
            reciprocal = merges_reciprocal and i != j and (j, i) in rows
            if reciprocal and i > j:
                continue
            strength = pairs.strength[row] * pairs.scatterers.phase
            if not self.replica_jitter.is_zero:
                strength = strength * self.replica_jitter.factor(
                    pairs.scatterers.scatterer_id, *names[row], pairs.scatterers.object
                )
            delay = pairs.transmit_legs.delay[i] + pairs.receive_legs.delay[j]
            for channel, row_of_cells in enumerate(cells):
                t = transmit_weights[channel % len(transmit_weights)]
                r = receive_weights[channel % len(receive_weights)]
                weight = t[i] * r[j] + t[j] * r[i] if reciprocal else t[i] * r[j]
                deposit_pressure(
                    row_of_cells, self.grid.first_time, self.grid.cell_rate, delay,
                    (weight * strength).astype(np.complex64),
                )  # fmt: skip

    def time_series(self, cells: Any, _run: Mapper = map) -> NDArray[np.complex64]:
        """Complex envelope at the grid's times [uPa], shape (channels, samples)."""
        pulse = self.ping_geometry.pulse
        if self.uses_far_field:
            return convolve_pulse(cells, self.grid, pulse.spectrum(self.grid.frequencies))
        if self._direction_grid is not None:
            return self._direction_grid.beams(cells, self.grid, self.basis)
        if self.ping_geometry.elements is None:
            return convolve_waveforms(cells, self.grid, self.basis.grid_factors(pulse, self.grid))
        series = convolve_waveforms(cells.elements, self.grid, self.basis.grid_factors(pulse, self.grid))
        if self._sector is not None:
            sector, basis = self._sector
            at_points = convolve_waveforms(cells.points, self.grid, basis.grid_factors(pulse, self.grid))
            sector.add_to_elements(at_points, series)
        return (series * self.ping_geometry.elements.response[:, None]).astype(np.complex64)
