"""Sums of which labels are made: curves of energy, and bins of energy and position, by object and pair of families."""

from dataclasses import dataclass, field
from operator import iadd
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.synthesis.incoherent import IntensityBuffer
from insonify.synthesis.level_curves import ALL as ALL
from insonify.synthesis.level_curves import LevelBuffers
from insonify.synthesis.specular_labels import Flashes

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Key = tuple[str, str]
PAIR_ONLY = "pair:"
"""Prefix of a pair's name: energies that count for the pair alone, and for the object only with other pairs."""
HIDDEN = "hidden"
"""In place of a pair's name: energies that the object occludes."""


class LabelCells(NamedTuple):
    """Cells and bins of all pairs of one object, as one array, by channels or by rows of directions."""

    energies: Floats
    """Energies, (rows, pairs, cells)."""
    bins: Singles
    """Energies and positions, (rows, pairs, bins, MOMENTS)."""
    interference: Floats
    """Interference between pairs, (rows, 1, cells); of a single pair without cells."""


@dataclass(frozen=True, slots=True)
class LabelBuffer:
    """Sums of the arrivals of a ping, by object and pair of families."""

    curves: LevelBuffers
    """Energies by (object, pair), which count for both.

    Those by (object, `ALL`) count for the object alone, those by (object, `PAIR_ONLY` + pair) for the pair alone.
    """
    bins: dict[Key, Singles] = field(default_factory=dict)
    """Energy and position by (object, pair) and by (occluding object, `HIDDEN`), each (channels, bins, MOMENTS)."""
    cells: dict[tuple[str, tuple[str, ...]], LabelCells] = field(default_factory=dict)
    """Cells and bins of channels by object and its pairs, of which `curves` and `bins` are views."""
    rows: dict[tuple[str, tuple[str, ...]], LabelCells] = field(default_factory=dict)
    """Cells and bins of rows of directions by object and its pairs, which are not yet in `curves` and `bins`."""
    common: dict[str, IntensityBuffer] = field(default_factory=dict)
    """Interference between pairs within one pulse duration by object, as far as it is in its curve `ALL`."""
    flashes: dict[Key, Flashes] = field(default_factory=dict)
    """Pressures of smooth targets by (object, pair), whose blocks may be incomplete."""
    nbytes: int = 0
    """Estimated size of the sums of one object [bytes]."""

    def __iadd__(self, other: "LabelBuffer") -> "LabelBuffer":
        """Add the sums of another buffer."""
        curves = self.curves
        curves += other.curves
        for key, bins in other.bins.items():
            self.bins[key] = self.bins[key] + bins if key in self.bins else bins
        for block, cells in other.rows.items():
            self.rows[block] = LabelCells(*map(iadd, self.rows[block], cells)) if block in self.rows else cells
        for object_name, energies in other.common.items():
            self.common[object_name] = (
                self.common[object_name].__iadd__(energies) if object_name in self.common else energies
            )
        for key, flashes in other.flashes.items():
            self.flashes[key] = self.flashes[key].__iadd__(flashes) if key in self.flashes else flashes
        return self

    def add_cells(self, object_name: str, pair_names: tuple[str, ...], cells: LabelCells, samples: int) -> None:
        """Add the pairs of one object by channels, without copying where there are no others of them.

        Args:
            object_name: The object.
            pair_names: Names of the pairs.
            cells: Cells and bins of the channels.
            samples: Samples of the recording.
        """

        def curve(energies: Floats) -> IntensityBuffer:
            return IntensityBuffer(energies, np.zeros((len(energies), samples)))

        more = LabelBuffer(LevelBuffers())
        for row, name in enumerate(pair_names):
            more.bins[object_name, name] = cells.bins[:, row]
            more.curves[object_name, name] = curve(cells.energies[:, row])
        if len(pair_names) > 1:
            more.curves[object_name, ALL] = curve(cells.interference[:, 0])
        self.__iadd__(more)
