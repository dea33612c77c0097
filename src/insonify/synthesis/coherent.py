"""The coherent reading: every arrival adds its pulse, in phase.

Pairs are laid on the time grid block by block and never written out. Where both legs of a pair share
their delays (out and back from one place), the two orders of a pair are one echo of their summed weight.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.records.arrivals import Arrivals
from insonify.records.pairs import Pairs
from insonify.sonar.stance import Stance
from insonify.synthesis._spread import spread
from insonify.synthesis.arrival_weights import arrival_weights
from insonify.synthesis.grid import TimeGrid, finish
from insonify.synthesis.perturbation import Perturbation
from insonify.synthesis.weights import leg_weights
from insonify.units import amplitude_ratio

Cells = NDArray[np.complex64]


@dataclass(frozen=True, slots=True)
class Coherent:
    """Hears complex pressure [uPa]."""

    stance: Stance
    grid: TimeGrid
    perturbation: Perturbation

    @property
    def even(self) -> bool:
        """Whether it wants drawn scatterers, which belong to their places."""
        return False

    def silence(self) -> Cells:
        """Cells with nothing in them, one row a channel."""
        return self.grid.cells(self.stance.channel_count)

    def take_in(self, cells: Cells, pairs: Pairs) -> None:
        """Add the echoes of one block of scatterers to the cells."""
        level = float(amplitude_ratio(self.stance.source_level_db))
        sent = leg_weights(pairs.out, self.stance.transmit_beams, self.stance.frequency, level)
        heard = leg_weights(pairs.back, self.stance.receive_beams, self.stance.frequency)
        # one delay both ways round: two pairs are heard as one, also where a moving sea turned their phases apart
        merge = pairs.out.delay is pairs.back.delay and self.perturbation.still
        rows = {(int(i), int(j)): row for row, (i, j) in enumerate(pairs.pair)}
        names = pairs.rays()
        for (i, j), row in rows.items():
            twin = merge and i != j and (j, i) in rows
            if twin and i > j:
                continue
            strength = pairs.strength[row] * pairs.scatterers.phase
            if not self.perturbation.still:
                strength = strength * self.perturbation.factor(pairs.scatterers.place, *names[row])
            delay = pairs.out.delay[i] + pairs.back.delay[j]
            for channel, row_of_cells in enumerate(cells):
                s, h = sent[channel % len(sent)], heard[channel % len(heard)]
                weight = s[i] * h[j] + s[j] * h[i] if twin else s[i] * h[j]
                spread(
                    row_of_cells, self.grid.first_time, self.grid.cell_rate, delay,
                    (weight * strength).astype(np.complex64),
                )  # fmt: skip

    def series(self, cells: Cells) -> NDArray[np.complex64]:
        """Complex envelope at the grid's times [uPa], shape (channels, samples)."""
        return finish(cells, self.grid, self.stance.pulse.spectrum(self.grid.frequencies))


def hear_arrivals(arrivals: Arrivals, stance: Stance, grid: TimeGrid) -> NDArray[np.complex64]:
    """What the sonar hears of a list of arrivals: the coherent reading, row by row.

    Args:
        arrivals: Paths of one ping.
        stance: The sonar at that ping.
        grid: Times wanted.

    Returns:
        Complex envelope [uPa], shape (channels, samples).
    """
    cells = grid.cells(stance.channel_count)
    for channel, row in enumerate(cells):
        weight = arrival_weights(arrivals, stance, channel).astype(np.complex64)
        spread(row, grid.first_time, grid.cell_rate, arrivals.delay, weight)
    return finish(cells, grid, stance.pulse.spectrum(grid.frequencies))
