"""Sums of which labels are made: curves of energy, and bins of energy and places, by owner and by pair of families."""

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
PAIR_ONLY = "met:"
"""Before the name of a pair: what counts for the pair, but for its owner only together with other pairs."""
HIDDEN = "hidden"
"""Stands for the pair where a key means what an owner hides."""


class LabelCells(NamedTuple):
    """Cells and bins of all pairs of one owner, side by side."""

    pair_and_object: Floats
    """Energies that count for pair and owner, (channels, pairs, cells)."""
    pair_only: Floats
    """Energies that count for the pair alone, likewise."""
    bins: Floats
    """Energies and places, (channels, pairs, bins, MOMENTS)."""


@dataclass(frozen=True, slots=True)
class LabelBuffer:
    """What has been heard so far."""

    curves: LevelBuffers
    """Energies by (owner, pair), which count for both; by (owner, `ALL`) those that count for the owner, by (owner,
    `PAIR_ONLY` and pair) those that count for the pair."""
    bins: dict[Key, Floats] = field(default_factory=dict)
    """Energy and places by (owner, pair) and by (who cuts, `HIDDEN`), each (channels, bins, MOMENTS)."""
    cells: dict[tuple[str, tuple[str, ...]], LabelCells] = field(default_factory=dict)
    """Curves and bins of all owners and pairs, of which `curves` and `bins` are parts."""
    common: dict[str, IntensityBuffer] = field(default_factory=dict)
    """By owner what pairs that arrive within one pulse have in common, as far as it is in its curve `ALL`."""
    flashes: dict[Key, Flashes] = field(default_factory=dict)
    """Pressures of smooth targets by (owner, pair): more of them may come."""
    nbytes: int = 0
    """Size of all that one owner is likely to fill [bytes]."""

    def __iadd__(self, other: "LabelBuffer") -> "LabelBuffer":
        """Add what another has heard."""
        curves = self.curves
        curves += other.curves
        for key, bins in other.bins.items():
            self.bins[key] = self.bins[key] + bins if key in self.bins else bins
        for owner, energies in other.common.items():
            self.common[owner] = self.common[owner].__iadd__(energies) if owner in self.common else energies
        for key, flashes in other.flashes.items():
            self.flashes[key] = self.flashes[key].__iadd__(flashes) if key in self.flashes else flashes
        return self
