"""Sums of which labels are made: curves of energy, and bins of energy and position, by object and pair of families."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.synthesis.incoherent import IntensityBuffer
from insonify.synthesis.level_curves import ALL as ALL
from insonify.synthesis.level_curves import LevelBuffers
from insonify.synthesis.specular_labels import Flashes

Floats = NDArray[np.float64]
Key = tuple[str, str]
PAIR_ONLY = "pair:"
"""Prefix of a pair's name: energies that count for the pair alone, and for the object only with other pairs."""
HIDDEN = "hidden"
"""In place of a pair's name: energies that the object occludes."""


class LabelCells(NamedTuple):
    """Cells and bins of all pairs of one object, as one array."""

    energies: Floats
    """Energies, (channels, pairs, cells)."""
    bins: Floats
    """Energies and positions, (channels, pairs, bins, MOMENTS)."""


@dataclass(frozen=True, slots=True)
class LabelBuffer:
    """Sums of the arrivals of a ping, by object and pair of families."""

    curves: LevelBuffers
    """Energies by (object, pair), which count for both.

    Those by (object, `ALL`) count for the object alone, those by (object, `PAIR_ONLY` + pair) for the pair alone.
    """
    bins: dict[Key, Floats] = field(default_factory=dict)
    """Energy and position by (object, pair) and by (occluding object, `HIDDEN`), each (channels, bins, MOMENTS)."""
    cells: dict[tuple[str, tuple[str, ...]], LabelCells] = field(default_factory=dict)
    """Cells and bins by object and its pairs, of which `curves` and `bins` are views."""
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
        for object_name, energies in other.common.items():
            self.common[object_name] = (
                self.common[object_name].__iadd__(energies) if object_name in self.common else energies
            )
        for key, flashes in other.flashes.items():
            self.flashes[key] = self.flashes[key].__iadd__(flashes) if key in self.flashes else flashes
        return self
