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
from insonify.sonar.stance import Stance
from insonify.synthesis._shape_kernel import laid_out
from insonify.synthesis._spread import spread
from insonify.synthesis.arrival_weights import arrival_weights
from insonify.synthesis.beams_under_way import lay_down_beams
from insonify.synthesis.directions import Directions, directions
from insonify.synthesis.elements import Ends, ends_of, lay_down, taken_by
from insonify.synthesis.grid import TimeGrid, finish, finish_shapes
from insonify.synthesis.perturbation import Perturbation
from insonify.synthesis.sectors import Shared, shared
from insonify.synthesis.shapes import Shapes, shapes_of, start_after
from insonify.synthesis.weights import leg_weights
from insonify.units import amplitude_ratio

Cells = NDArray[np.complex64]


@dataclass(frozen=True)
class Coherent:
    """Hears complex pressure [uPa]."""

    stance: Stance
    grid: TimeGrid
    perturbation: Perturbation
    shapes: Shapes = field(default_factory=lambda: Shapes(np.zeros(1)))
    """Waveforms of which echoes are sums: `shapes_of` the stance."""
    water: Water = field(default_factory=Water)
    """Between sonar and scatterers, for elements and for a sonar under way."""

    @cached_property
    def _ends(self) -> Ends:
        return ends_of(self.stance)

    @cached_property
    def _few(self) -> Shared | None:
        if self.stance.elements is None or np.any(self._ends.facing):
            return None
        ends, speed = self._ends, self.stance.receive_speed
        return shared(ends.place, ends.velocity, ends.acceleration, self.grid, self.stance.frequency, speed)

    @cached_property
    def _fan(self) -> Directions | None:
        return directions(self.stance)

    @cached_property
    def _loss(self) -> float:
        return taken_by(self.water, self.stance.frequency)

    @property
    def plain(self) -> bool:
        """Return True if few beams of a stationary sonar are recorded: its far field suffices."""
        standing = self.stance.still and self.stance.elements is None and not self.stance.bands
        return standing and self._fan is None

    @property
    def even(self) -> bool:
        """Whether it wants drawn scatterers, which belong to their places."""
        return False

    def silence(self) -> Cells:
        """Cells with nothing in them, one row a channel."""
        if self.plain:
            return self.grid.cells(self.stance.channel_count)
        groups, together = laid_out(len(self.shapes.doppler))
        places = 0 if self._few is None else len(self._few.place)
        channels = self.stance.channel_count if self._fan is None else self._fan.count
        rows = len(self.shapes.band), channels + places, groups
        return self.grid.cells(int(np.prod(rows)) * together).reshape(*rows, -1, together)

    def take_in(self, cells: Cells, pairs: Pairs) -> None:
        """Add the echoes of one block of scatterers to the cells."""
        if not self.plain and self.stance.elements is None:
            lay_down_beams(
                cells, pairs, self.stance, self.grid, self.perturbation, self.shapes, self._ends, self.water,
                self._loss, self._fan,
            )  # fmt: skip
            return
        if not self.plain:
            lay_down(
                cells, pairs, self.stance, self.grid, self.perturbation, self.shapes, self._ends, self.water,
                self._loss, self._few,
            )  # fmt: skip
            return
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
        pulse = self.stance.pulse
        if self.plain:
            return finish(cells, self.grid, pulse.spectrum(self.grid.frequencies))
        spectra = self.shapes.spectra(pulse, self.grid.frequencies)
        if self._few is not None:
            middle = 0.0 if self.stance.still else pulse.pulse.duration / 2
            cells = self._few.tell(cells, self.grid, middle)
        if self._fan is not None:
            cells = self._fan.tell(cells)
        heard = finish_shapes(cells, self.grid, spectra)
        elements = self.stance.elements
        return heard if elements is None else (heard * elements.response[:, None]).astype(np.complex64)


def hear_arrivals(
    arrivals: Arrivals, stance: Stance, grid: TimeGrid, shapes: Shapes | None = None, *, channel: int | None = None
) -> NDArray[np.complex64]:
    """What the sonar hears of a list of arrivals: the coherent reading, row by row.

    Args:
        arrivals: Paths of one ping.
        stance: The sonar at that ping.
        grid: Times wanted.
        shapes: Waveforms of which echoes are sums; None: they are made here.
        channel: Which channel; None: all beams of the side, which hear the same arrivals.

    Returns:
        Complex envelope [uPa], shape (channels, samples).

    Raises:
        ValueError: No channel, and the channels are elements: each hears arrivals of its own.
    """
    if channel is None and stance.elements is not None:
        raise ValueError("channel is None, and each element has arrivals of its own. Give the channel that was asked.")
    made = shapes_of(stance) if shapes is None else shapes
    parts = made.parts(arrivals.doppler)
    chosen = range(stance.channel_count) if channel is None else [channel]
    sooner = start_after(stance.pulse, arrivals.doppler)  # shapes are stretched about their middle
    delay, turn = arrivals.delay - sooner, np.exp(2j * np.pi * stance.frequency * sooner)
    cells = grid.cells(len(made.band) * len(chosen) * len(parts)).reshape(len(made.band), len(chosen), len(parts), -1)
    for band, row in np.ndindex(cells.shape[:2]):
        weight = arrival_weights(arrivals, stance, chosen[row], band) * turn
        for cell, part in zip(cells[band, row], parts, strict=True):
            spread(cell, grid.first_time, grid.cell_rate, delay, (weight * part).astype(np.complex64))
    return finish_shapes(cells[..., None], grid, made.spectra(stance.pulse, grid.frequencies))
