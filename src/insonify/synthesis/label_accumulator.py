"""Labels of one ping: the incoherent reading taken apart by owner and by pair of families, and what is missing.

Intensities are those of the incoherent reading. Places are mean values over the same paths, weighted by energy and
smeared by the pulse as the recording is, but without interference. A shadow is where most of the direct echo of the
seabed is missing: the cut legs carry their own echo, as it would be if nothing cut them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import families_reaching
from insonify.records.labels import LabelNames, Labels
from insonify.records.legs import SEABED_OCCLUDER, Legs, LegStatus
from insonify.records.pairs import Pairs
from insonify.records.reverberation_samples import ReverberationSamples
from insonify.scene.scatterers import Boundary
from insonify.sonar.beam import Beams
from insonify.synthesis._label_kernel import MOMENTS, LabelGrid, LabelledPoints, deposit_label_positions, deposit_labels
from insonify.synthesis.accumulator import Requirements
from insonify.synthesis.coherent_groups import add_groups
from insonify.synthesis.incoherent import IncoherentAccumulator, IntensityBuffer, contains_reversed_pairs
from insonify.synthesis.label_series import STRAIGHT, labels_of, ringing
from insonify.synthesis.label_sums import ALL, HIDDEN, PAIR_ONLY, Key, LabelBuffer, LabelCells
from insonify.synthesis.level_curves import LevelBuffers, pair_name
from insonify.synthesis.specular_labels import Flashes, deposit_specular_labels
from insonify.synthesis.swath_labels import add_swath
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Rows = NDArray[np.intp]
GROUND_POINTS = 2.0
"""Most points to a resolution cell along lines of the seabed, where the sound has other points [1]."""
POINTS = 1.5
"""Most points to a resolution cell: sparse, off by a few tenths of a decibel where expectations are not [1]."""


def label_names(targets: tuple[str, ...], followed: tuple[str, ...], *, water: tuple[str, ...] = ()) -> LabelNames:
    """The axes of labels.

    Args:
        targets: Labels of the scene's targets.
        followed: Families of the legs.
        water: Who answers in the water: "water" for its layers, and the labels of patches.
    """
    targets = (*water, *targets)
    contributions: tuple[Boundary, ...] = ("seabed", "surface", "target")
    buffer = [
        families_reaching(contribution, followed)
        for contribution in contributions
        if contribution != "target" or targets
    ]
    found = {pair_name(out, back) for names in buffer for out in names for back in names}
    pairs = sorted(found, key=lambda name: (name.count("S") + name.count("B"), len(name), name))
    return LabelNames(("seabed", "surface", *targets), tuple(pairs))


@dataclass(frozen=True, slots=True)
class LabelAccumulator:
    """Hears who is heard, by which paths, and from where."""

    accumulator: IncoherentAccumulator
    """The reading that is taken apart."""
    names: LabelNames
    occluder_names: tuple[str, ...]
    """Labels of the scene's occluders, in the order of their rows in `Legs.occluder`."""
    noise: float
    """Mean-square noise pressure, beside which a target has to be heard [uPa^2]."""

    @property
    def requirements(self) -> Requirements:
        """Properties of the path pairs that `add` expects."""
        return Requirements(origins=True, max_scatterers_per_cell=POINTS)

    def empty(self) -> LabelBuffer:
        """Nothing heard yet."""
        grid, channels = self.accumulator.grid, self.accumulator.ping_geometry.channel_count
        cells = 2 * grid.energy_cells(0).shape[1] + MOMENTS * (grid.sample_count + sum(self._ringing))
        return LabelBuffer(LevelBuffers(), nbytes=8 * channels * len(self.names.pairs) * cells)

    def add(self, buffer: LabelBuffer, pairs: Pairs) -> None:
        """Add one block of scatterers to its owner."""
        owner = pairs.scatterers.object
        names = tuple(pair_name(out, back) for out, back in pairs.names())
        sent, heard = self.accumulator.weights(pairs)
        room = self._workspace(buffer, owner, pairs, names)
        if room is not None:
            self._deposit_all_pairs(buffer, owner, room, pairs, sent, heard)
            if pairs.scatterers.boundary == "seabed" and STRAIGHT in names:
                self._add_occluded(buffer, pairs.select(np.array([names.index(STRAIGHT)])))
            return
        parts = {name: pairs.select(np.flatnonzero(np.array(names) == name)) for name in dict.fromkeys(names)}
        out, back = _power(sent), _power(heard)
        if len(parts) > 1:
            self._add_intensity(buffer, (owner, ALL), pairs, sent, heard)
        for name, part in parts.items():
            self._add_intensity(buffer, (owner, PAIR_ONLY + name if len(parts) > 1 else name), part, sent, heard)
            self._deposit_positions(buffer, (owner, name), part, out, back)
        if pairs.scatterers.boundary == "seabed" and STRAIGHT in parts:
            self._add_occluded(buffer, parts[STRAIGHT])

    def add_fast_reverberation(self, buffer: LabelBuffer, swath: ReverberationSamples) -> None:
        """Add the ground of a part of a ping, and what hides of it."""
        occluder_names = {SEABED_OCCLUDER: "seabed", **dict(enumerate(self.occluder_names))}
        add_swath(buffer, self.accumulator, swath, occluder_names)

    def _workspace(self, buffer: LabelBuffer, owner: str, pairs: Pairs, names: tuple[str, ...]) -> LabelCells | None:
        """Cells and bins for the pairs of a block, in the order of their names; None where these do not tell all.

        Names tell all where legs out and back are the same, one of each family, and nothing is random but the phase of
        the place.
        """
        whole = self.accumulator
        if pairs.out is not pairs.back or pairs.interferes or pairs.out.glints is not None or whole.has_random_paths:
            return None
        if len(set(pairs.out.families)) < len(pairs.out.families) or not contains_reversed_pairs(pairs.pair):
            return None
        if np.iscomplexobj(pairs.strength):
            return None
        some = tuple(dict.fromkeys(names))
        if (owner, some) not in buffer.cells:
            if any((owner, name) in buffer.bins for name in some):
                return None
            lead, tail = self._ringing
            channels, cells = whole.empty().cells.shape
            label_cells = LabelCells(
                np.zeros((channels, len(some), cells)), np.zeros((channels, len(some), cells)),
                np.zeros((channels, len(some), whole.grid.sample_count + lead + tail, MOMENTS)),
            )  # fmt: skip
            buffer.cells[owner, some] = label_cells
            for row, name in enumerate(some):
                buffer.bins[owner, name] = label_cells.bins[:, row]
                for key, part in ((name, label_cells.pair_and_object), (PAIR_ONLY + name, label_cells.pair_only)):
                    buffer.curves[owner, key] = IntensityBuffer(
                        part[:, row], np.zeros((channels, whole.grid.sample_count))
                    )
        return buffer.cells[owner, some]

    def _deposit_all_pairs(
        self,
        buffer: LabelBuffer,
        owner: str,
        label_cells: LabelCells,
        pairs: Pairs,
        transmit_weights: Complexes,
        receive_weights: Complexes,
    ) -> None:
        """Add all pairs of a block to their room, and what those that interfere make together to their owner."""
        whole, table, legs = self.accumulator, self.accumulator.table, pairs.out
        here, grid, (lead, _) = whole.ping_geometry, whole.grid, self._ringing
        rows = np.flatnonzero(pairs.pair[:, 0] <= pairs.pair[:, 1])
        pair, strength = pairs.pair[rows], np.abs(pairs.strength[rows])
        times = LabelGrid(grid.first_time, grid.energy_rate, grid.start - lead / grid.sample_rate, grid.sample_rate)
        for channel in range(here.channel_count):
            points = LabelledPoints(
                legs.delay, transmit_weights[channel % len(transmit_weights)],
                receive_weights[channel % len(receive_weights)], legs.grazing, strength,
                pairs.scatterers.position,
            )  # fmt: skip
            told = deposit_labels(
                points, pair, len(table.samples) / table.rate, times, here.receive_position,
                label_cells.pair_and_object[channel],
                label_cells.pair_only[channel], label_cells.bins[channel],
            )  # fmt: skip
            if len(told[1]):
                if (owner, ALL) not in buffer.curves:
                    buffer.curves[owner, ALL] = whole.empty()
                add_groups(
                    buffer.curves[owner, ALL].intensity[channel], grid.start, grid.sample_rate, table.samples,
                    table.start, table.rate, *told, 1.0, 0.0,
                )  # fmt: skip

    def _add_intensity(
        self, buffer: LabelBuffer, key: Key, pairs: Pairs, transmit_weights: Complexes, receive_weights: Complexes
    ) -> None:
        if key not in buffer.curves:
            buffer.curves[key] = self.accumulator.empty()
        self.accumulator.add_weighted(buffer.curves[key], pairs, transmit_weights, receive_weights)

    def _deposit_positions(
        self,
        buffer: LabelBuffer,
        key: Key,
        pairs: Pairs,
        power_out: Floats,
        power_back: Floats,
        point_rows: Rows | None = None,
    ) -> None:
        """Add the places of some paths, given the powers of their legs, to the bins of a key.

        Args:
            buffer: What has been heard so far.
            key: Whose they are.
            pairs: The paths.
            power_out: Power of the legs out in each beam [uPa^2], (beams, f, points).
            power_back: Of the legs back [1].
            point_rows: Which points the powers are of; None: all of them.
        """
        here, grid = self.accumulator.ping_geometry, self.accumulator.grid
        lead, tail = self._ringing
        shape, start = (here.channel_count, grid.sample_count + lead + tail), grid.start - lead / grid.sample_rate
        if pairs.interferes:
            flashes = buffer.flashes.setdefault(key, Flashes.empty(*shape))
            deposit_specular_labels(flashes, start, grid.sample_rate, pairs, here)
            return
        if key not in buffer.bins:
            buffer.bins[key] = np.zeros((*shape, MOMENTS))
        rows: Any = slice(None) if point_rows is None else point_rows
        place, strength = pairs.scatterers.position[rows], np.abs(pairs.strength[:, rows])
        for channel, bins in enumerate(buffer.bins[key]):
            deposit_label_positions(
                bins, start, grid.sample_rate, pairs.out.delay[:, rows], pairs.back.delay[:, rows],
                power_out[channel % len(power_out)], power_back[channel % len(power_back)], pairs.pair, strength, place,
                here.receive_position, pairs.out.grazing[:, rows], pairs.back.grazing[:, rows],
            )  # fmt: skip

    def _add_occluded(self, buffer: LabelBuffer, pairs: Pairs) -> None:
        """Add what the direct paths to some ground would have brought, had nothing cut them."""
        cut = np.zeros(len(pairs.scatterers), bool)
        for legs, rows in ((pairs.out, pairs.pair[:, 0]), (pairs.back, pairs.pair[:, 1])):
            cut |= (legs.status[rows] == LegStatus.OCCLUDED).any(axis=0)
        at = np.flatnonzero(cut)
        if not len(at):
            return
        here = self.accumulator.ping_geometry
        out = _unoccluded_power(pairs.out, here.transmit_beams, at) * intensity_ratio(here.source_level_db)
        back = _unoccluded_power(pairs.back, here.receive_beams, at)
        occluder_names = {int(row) for legs in (pairs.out, pairs.back) for row in np.unique(legs.occluder[:, at])}
        for occluder_row in sorted(occluder_names - {-1}):
            owner = "seabed" if occluder_row == SEABED_OCCLUDER else self.occluder_names[occluder_row]
            for row, (i, j) in enumerate(pairs.pair):
                lost = _taken(pairs.out, pairs.back, int(i), int(j), occluder_row)[at]
                self._deposit_positions(buffer, (owner, HIDDEN), pairs.select(np.array([row])), out * lost, back, at)

    @property
    def _ringing(self) -> tuple[int, int]:
        return ringing(self.accumulator)

    def time_series(self, buffer: LabelBuffer) -> Labels:
        """The labels of the ping."""
        return labels_of(buffer, self.accumulator, self.names, self.noise)


def _power(weight: Complexes) -> Floats:
    """Square of the magnitude, shape of the weights."""
    return weight.real**2 + weight.imag**2


def _unoccluded_power(legs: Legs, beams: Beams, point_rows: Rows) -> Floats:
    """Power of the legs to some points in each beam, as if nothing cut them [1], (beams, f, points)."""
    bare = (
        legs.spreading[:, point_rows]
        * legs.absorption[:, point_rows]
        * np.abs(legs.reflection_coefficient[:, point_rows])
    )
    return np.asarray((beams.gain(legs.departure[:, point_rows]) * bare) ** 2)


def _taken(out: Legs, back: Legs, i: int, j: int, occluder_row: int) -> Floats:
    """Part of each echo by the leg out of row i and the leg back of row j that one occluder takes away [1], (n,)."""
    ends = ((out, i), (back, j))
    hidden = [legs.status[row] == LegStatus.OCCLUDED for legs, row in ends]
    there = [cut | (legs.status[row] == LegStatus.CLEAR) for (legs, row), cut in zip(ends, hidden, strict=True)]
    by = np.where(hidden[0], out.occluder[i], back.occluder[j])
    mine = there[0] & there[1] & (hidden[0] | hidden[1]) & (by == occluder_row)
    left = np.abs(out.visibility[i] * back.visibility[j]) ** 2
    return np.where(mine, np.maximum(1 - left, 0.0), 0.0)
