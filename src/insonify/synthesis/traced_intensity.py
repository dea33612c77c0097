"""Expected intensity of traced rays: energies deposited over time, in total or by contribution and pair of families."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insonify.records.echo_energies import EchoEnergies
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._gridding import deposit_energy
from insonify.synthesis.accumulator import Mapper, Requirements
from insonify.synthesis.level_curves import ALL, pair_name
from insonify.synthesis.replica_jitter import ReplicaJitter
from insonify.synthesis.time_grid import TimeGrid, convolve_energy

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TracedAccumulator:
    """Accumulator of the expected intensity of traced rays [uPa^2]."""

    ping_geometry: PingGeometry
    grid: TimeGrid
    replica_jitter: ReplicaJitter

    @property
    def requirements(self) -> Requirements:
        """Properties of the path pairs that `add` expects."""
        return Requirements(rays=True)

    def empty(self) -> Floats:
        """Empty grid of energies [uPa^2], shape (channels, cells)."""
        return self.grid.energy_cells(self.ping_geometry.channel_count)

    def add(self, cells: Floats, traced_echoes: list[EchoEnergies]) -> None:
        """Add the echo energies of one block of rays."""
        for echoes in traced_echoes:
            self.deposit(cells, echoes)

    def deposit(self, cells: Floats, echoes: EchoEnergies) -> None:
        """Add the energies of some echoes, including their interference."""
        factor = self.replica_jitter.mean_energy + self.replica_jitter.interference_factor * echoes.reciprocal
        for channel, energy in enumerate(echoes.energy):
            weight = np.asarray(energy * factor)
            deposit_energy(cells[channel], self.grid.first_time, self.grid.energy_rate, echoes.delay, weight)

    def time_series(self, cells: Floats, _run: Mapper = map) -> Floats:
        """Expected intensity at the grid's times [uPa^2], shape (channels, samples)."""
        return convolve_energy(cells, self.grid, self.ping_geometry.pulse.spectrum(self.grid.frequencies))


class TracedLevelBuffers(dict[tuple[str, str], Floats]):
    """Energies by (contribution, pair)."""

    def __iadd__(self, other: "TracedLevelBuffers") -> "TracedLevelBuffers":
        """Add the curves of another buffer."""
        for key, cells in other.items():
            self[key] = self[key] + cells if key in self else cells
        return self


@dataclass(frozen=True, slots=True)
class TracedLevelAccumulator:
    """Accumulator of the expected intensity of traced rays by contribution and by pair [uPa^2]."""

    accumulator: TracedAccumulator

    @property
    def requirements(self) -> Requirements:
        """Properties of the path pairs that `add` expects."""
        return Requirements(rays=True)

    def empty(self) -> TracedLevelBuffers:
        """Empty buffer."""
        return TracedLevelBuffers()

    def add(self, curves: TracedLevelBuffers, traced_echoes: list[EchoEnergies]) -> None:
        """Add the echo energies of one block of rays to their curves."""
        for echoes in traced_echoes:
            named = echoes
            if not echoes.receive_chain:  # a boundary echo and its reverse have curves of their own
                named = replace(echoes, reciprocal=0 * echoes.reciprocal)
            for name, part in ((pair_name(echoes.transmit_chain, echoes.receive_chain), named), (ALL, echoes)):
                key = echoes.contribution, name
                if key not in curves:
                    curves[key] = self.accumulator.empty()
                self.accumulator.deposit(curves[key], part)

    def time_series(self, curves: TracedLevelBuffers, run: Mapper = map) -> dict[tuple[str, str], Floats]:
        """Expected intensity of each curve [uPa^2], shape (channels, samples)."""
        return {key: self.accumulator.time_series(cells, run) for key, cells in curves.items()}
