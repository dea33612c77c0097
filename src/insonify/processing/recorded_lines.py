"""Lines of a recorder while pings arrive one by one: pings are held until those of their line are complete."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from insonify.processing.recorder import record_series
from insonify.sonar.recorder import Recorder

Series = NDArray[np.generic]


@dataclass(slots=True)
class RecordedLines:
    """Assembly of the pings of a run into recorded lines."""

    recorder: Recorder
    time: NDArray[np.float64]
    """Time of each sample [s], shape (samples,)."""
    sound_speed: float
    """That the recorder's gain takes ranges with [m/s]."""
    absorption_db_per_m: float
    """One-way absorption of the water [dB/m]."""
    due: set[int] = field(default_factory=set)
    """Lines of which all pings will arrive."""
    held: dict[int, Series] = field(default_factory=dict)
    """Series of pings whose line is not complete."""

    def plan(self, requested: list[int], recorded: NDArray[np.bool_], written: NDArray[np.bool_]) -> list[int]:
        """Pings to simulate: those requested, and all of each line that becomes complete with them.

        Args:
            requested: Numbers of the requested pings.
            recorded: Mask of the recorded pings, shape (pings,); cleared where a ping has to arrive once more.
            written: Mask of the recorded lines, shape (lines,).
        """
        pings, length = set(requested), self.recorder.pings_per_line
        for line in map(int, np.flatnonzero(~written)):
            own = range(line * length, (line + 1) * length)
            if all(recorded[ping] or ping in pings for ping in own) and not pings.isdisjoint(own):
                self.due.add(line)
        for line in self.due:
            own = range(line * length, (line + 1) * length)
            recorded[own.start : own.stop] = False
            pings.update(own)
        return sorted(pings)

    def add(self, ping: int, series: Series, write_line: Callable[[int, Series], None]) -> dict[int, Series]:
        """Take one ping, and write the line that it completes.

        Args:
            ping: Number of the ping.
            series: Its pressure [uPa] or intensity [uPa^2], shape (channels, samples).
            write_line: Called with number and numbers of the line, shape (channels, bins).

        Returns:
            Series of the pings that need be held no longer.
        """
        line = ping // self.recorder.pings_per_line
        if line not in self.due:
            return {ping: series}
        self.held[ping] = series
        first = line * self.recorder.pings_per_line
        own = range(first, first + self.recorder.pings_per_line)
        if not all(number in self.held for number in own):
            return {}
        block = {number: self.held.pop(number) for number in own}
        pressure = np.stack(list(block.values()))
        pressure = pressure if np.iscomplexobj(pressure) else np.sqrt(pressure)
        numbers, _ = record_series(
            pressure, self.time, self.recorder, sound_speed=self.sound_speed,
            absorption_db_per_m=self.absorption_db_per_m,
        )  # fmt: skip
        write_line(line, numbers[0])
        return block
