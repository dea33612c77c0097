"""Sums of which labels are made: curves of energy, and bins of energy and position, by object and pair of families."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from operator import add, iadd
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from insonify.scene.scatterers import BOUNDARY_ECHO
from insonify.synthesis.incoherent import IntensityBuffer
from insonify.synthesis.level_curves import ALL as ALL
from insonify.synthesis.level_curves import LevelBuffers
from insonify.synthesis.specular_labels import SpecularLabelSums

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Key = tuple[str, str]
Name = TypeVar("Name")
Sums = TypeVar("Sums")
PAIR_ONLY = "pair:"
"""Prefix of a pair's name: energies that count for the pair alone, and for the object only with other pairs."""
HIDDEN = "hidden"
"""In place of a pair's name: direct echo of the seabed that the object occludes."""


def is_curve_of(object_name: str, key: Key) -> bool:
    """Return True if the energies of a curve count for an object."""
    return key[0] == object_name and not key[1].startswith(PAIR_ONLY)


@dataclass(frozen=True, slots=True)
class LabelCells:
    """Cells and bins of all pairs of one object, by channels or by rows of directions."""

    cells: Floats
    """Energies that `deposit_labels` adds [uPa^2], (rows, q, cells)."""
    bins: Singles
    """Energies [uPa^2] and energy-weighted positions, (rows, pairs, bins, MOMENTS)."""
    pair_row: NDArray[np.intp]
    """Index of each pair along the second axis of the cells; -1 for none, (pairs,)."""
    uses_energy_grid: bool
    """True: the cells are those of the energy grid and hold the energies of pairs; False: they have the rate of the
    bins and hold interference only."""

    def __iadd__(self, other: "LabelCells") -> "LabelCells":
        """Add the cells and bins of another part."""
        self.cells[...] += other.cells
        self.bins[...] += other.bins
        return self


@dataclass(frozen=True, slots=True)
class LabelBuffer:
    """Sums of the arrivals of a ping, by object and pair of families."""

    curves: LevelBuffers
    """Energies by (object, pair), which count for both.

    Those by (object, `ALL`) count for the object alone, those by (object, `PAIR_ONLY` + pair) for the pair alone.
    """
    bins: dict[Key, Singles] = field(default_factory=dict)
    """Energy and position by (object, pair) and by (occluding object, `HIDDEN`), each (channels, bins, MOMENTS)."""
    sampled: dict[Key, Singles] = field(default_factory=dict)
    """Bins as in `bins`, whose energies are in no curve: they count for the object and the pair."""
    excess: dict[Key, Floats] = field(default_factory=dict)
    """Interference of a pair with its reverse by (object, pair), and between pairs by (object, `ALL`), in no curve.

    Shape (channels, bins).
    """
    cells: dict[tuple[str, tuple[str, ...]], LabelCells] = field(default_factory=dict)
    """Cells and bins by (object, names of its pairs), of channels or of rows of directions, in no other field yet."""
    common: dict[str, IntensityBuffer] = field(default_factory=dict)
    """Interference between pairs within one pulse duration by object, as far as it is in its curve `ALL`."""
    flashes: dict[Key, SpecularLabelSums] = field(default_factory=dict)
    """Pressures of smooth targets by (object, pair), to which further blocks may be added."""
    nbytes: int = 0
    """Estimated size of the sums of one object [bytes]."""

    def object_curves(self, object_name: str) -> list[IntensityBuffer]:
        """Curves of energy that count for one object."""
        return [curve for key, curve in self.curves.items() if is_curve_of(object_name, key)]

    def __iadd__(self, other: "LabelBuffer") -> "LabelBuffer":
        """Add the sums of another buffer."""
        curves = self.curves
        curves += other.curves
        for mine, others in ((self.bins, other.bins), (self.sampled, other.sampled)):
            _merge(mine, others, add)
        _merge(self.excess, other.excess, add)
        _merge(self.cells, other.cells, iadd)
        _merge(self.common, other.common, iadd)
        _merge(self.flashes, other.flashes, iadd)
        return self

    def add_cells(self, object_name: str, pair_names: tuple[str, ...], added: LabelCells, samples: int) -> None:
        """Add the pairs of one object by channels, without copying where there are no others of them.

        Args:
            object_name: The object.
            pair_names: Names of the pairs.
            added: Cells and bins of the channels.
            samples: Samples of the recording.
        """
        added_sums = LabelBuffer(LevelBuffers())
        for row, name in enumerate(pair_names):
            (added_sums.bins if added.uses_energy_grid else added_sums.sampled)[object_name, name] = added.bins[:, row]
        names = {name: row for name, row in zip(pair_names, added.pair_row.tolist(), strict=True) if row >= 0}
        if len(pair_names) > 1:
            names[ALL] = added.cells.shape[1] - 1
        for name, row in names.items():
            cells = added.cells[:, row]
            if added.uses_energy_grid:
                added_sums.curves[object_name, name] = IntensityBuffer(cells, np.zeros((len(cells), samples)))
            else:
                added_sums.excess[object_name, name] = cells
        self.__iadd__(added_sums)


class RecordedSums(NamedTuple):
    """Sums of the labels that an expected intensity of the same points has as well."""

    energies: IntensityBuffer
    """Energies of the seabed, and of boundary echoes where nothing else is received [uPa^2]."""
    intensity: NDArray[np.floating[Any]] | None
    """Time series of the whole recording [uPa^2], shape (channels, samples); None: not evaluated."""
    is_all: bool
    """True: nothing else is received."""


def recorded_sums(buffer: LabelBuffer, seabed: NDArray[np.floating[Any]], remaining: Iterable[str]) -> RecordedSums:
    """Sums that a recording without labels has, to the bit: the seabed, and boundary echoes where nothing else is.

    Args:
        buffer: Sums of the labels, whose time series have been made; those of boundary echoes are changed.
        seabed: Time series of the seabed [uPa^2], shape (channels, samples).
        remaining: Contributions besides the seabed.
    """
    energies, others = buffer.curves["seabed", ALL], set(remaining)
    echoes = buffer.object_curves(BOUNDARY_ECHO)
    if not others or (others == {BOUNDARY_ECHO} and not echoes):
        return RecordedSums(energies, seabed, is_all=True)
    from_bins = any(name == BOUNDARY_ECHO for name, _ in buffer.cells)
    if others != {BOUNDARY_ECHO} or len(echoes) != 1 or from_bins:
        return RecordedSums(energies, None, is_all=False)
    whole = echoes[0]
    whole += energies  # in the order in which a recording without labels adds them
    return RecordedSums(whole, None, is_all=True)


def _merge(mine: dict[Name, Sums], others: dict[Name, Sums], plus: Callable[[Sums, Sums], Sums]) -> None:
    """Add sums by name to others, in place."""
    for name, sums in others.items():
        mine[name] = plus(mine[name], sums) if name in mine else sums
