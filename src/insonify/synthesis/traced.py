"""What traced rays sound like: their energies laid down over time, all together or by cause and pair of families."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.records.echoes import Echoes
from insonify.sonar.stance import Stance
from insonify.synthesis._spread import spread_energy
from insonify.synthesis.grid import TimeGrid, finish_energy
from insonify.synthesis.levels import ALL, pair_name
from insonify.synthesis.perturbation import Perturbation

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Traced:
    """Hears the echoes of rays: expected intensity [uPa^2]."""

    stance: Stance
    grid: TimeGrid
    perturbation: Perturbation

    @property
    def even(self) -> bool:
        """Whether it wants an expectation: rays know nothing else."""
        return True

    def silence(self) -> Floats:
        """Nothing heard yet: energies on the energy grid, shape (channels, cells)."""
        return self.grid.energy_cells(self.stance.channel_count)

    def take_in(self, cells: Floats, found: list[Echoes]) -> None:
        """Add what one block of rays brings back."""
        for echoes in found:
            self.lay_down(cells, echoes)

    def lay_down(self, cells: Floats, echoes: Echoes) -> None:
        """Add the energies of some echoes, with their share of interference."""
        share = self.perturbation.mean_energy + self.perturbation.kept_interference * echoes.reciprocal
        for channel, energy in enumerate(echoes.energy):
            weight = np.asarray(energy * share)
            spread_energy(cells[channel], self.grid.first_time, self.grid.energy_rate, echoes.delay, weight)

    def series(self, cells: Floats) -> Floats:
        """Expected intensity at the grid's times [uPa^2], shape (channels, samples)."""
        return finish_energy(cells, self.grid, self.stance.pulse.spectrum(self.grid.frequencies))


class Curves(dict[tuple[str, str], Floats]):
    """Energies by (cause, pair)."""

    def __iadd__(self, other: "Curves") -> "Curves":
        """Add what another has heard, curve by curve."""
        for key, cells in other.items():
            self[key] = self[key] + cells if key in self else cells
        return self


@dataclass(frozen=True, slots=True)
class TracedLevels:
    """Hears the echoes of rays apart, by cause and by pair [uPa^2]."""

    whole: Traced

    @property
    def even(self) -> bool:
        """Whether it wants an expectation: rays know nothing else."""
        return True

    def silence(self) -> Curves:
        """Nothing heard yet."""
        return Curves()

    def take_in(self, curves: Curves, found: list[Echoes]) -> None:
        """Add what one block of rays brings back to its curves."""
        for echoes in found:
            for key in ((echoes.cause, pair_name(echoes.out, echoes.back)), (echoes.cause, ALL)):
                if key not in curves:
                    curves[key] = self.whole.silence()
                self.whole.lay_down(curves[key], echoes)

    def series(self, curves: Curves) -> dict[tuple[str, str], Floats]:
        """Expected intensity of each curve [uPa^2], shape (channels, samples)."""
        return {key: self.whole.series(cells) for key, cells in curves.items()}
