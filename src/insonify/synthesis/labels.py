"""Labels of one ping: the incoherent reading taken apart by owner and by pair of families, and what is missing.

Intensities are those of the incoherent reading. Places are mean values over the same paths, weighted by energy and
smeared by the pulse as the recording is, but without interference. A shadow is where most of the direct echo of the
seabed is missing: the cut legs carry their own echo, as it would be if nothing cut them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import families_for
from insonify.records.labels import LabelNames, Labels
from insonify.records.legs import SEABED, Legs, Status
from insonify.records.pairs import Pairs
from insonify.records.swath import Swath
from insonify.scene.scatterers import Boundary
from insonify.sonar.beam import Beams
from insonify.synthesis._groups import add_groups
from insonify.synthesis._label_kernel import MOMENTS, Grid, Points, add_places, lay_labels
from insonify.synthesis.flashes import Flashes, add_flashes
from insonify.synthesis.incoherent import Energies, Incoherent, symmetric
from insonify.synthesis.label_series import STRAIGHT, labels_of, ringing
from insonify.synthesis.label_sums import ALL, HIDDEN, MET, Kept, Key, Room
from insonify.synthesis.levels import CurveSet, pair_name
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
    causes: tuple[Boundary, ...] = ("seabed", "surface", "target")
    kept = [families_for(cause, followed) for cause in causes if cause != "target" or targets]
    found = {pair_name(out, back) for names in kept for out in names for back in names}
    pairs = sorted(found, key=lambda name: (name.count("S") + name.count("B"), len(name), name))
    return LabelNames(("seabed", "surface", *targets), tuple(pairs))


@dataclass(frozen=True, slots=True)
class Labelling:
    """Hears who is heard, by which paths, and from where."""

    whole: Incoherent
    """The reading that is taken apart."""
    names: LabelNames
    cutters: tuple[str, ...]
    """Labels of the scene's occluders, in the order of their rows in `Legs.occluder`."""
    noise: float
    """Mean-square noise pressure, beside which a target has to be heard [uPa^2]."""

    @property
    def even(self) -> bool:
        """Whether it wants evenly laid points, for an expectation."""
        return True

    def silence(self) -> Kept:
        """Nothing heard yet."""
        grid, channels = self.whole.grid, self.whole.stance.channel_count
        cells = 2 * grid.energy_cells(0).shape[1] + MOMENTS * (grid.count + sum(self._ringing))
        return Kept(CurveSet(), nbytes=8 * channels * len(self.names.pairs) * cells)

    def take_in(self, kept: Kept, pairs: Pairs) -> None:
        """Add one block of scatterers to its owner."""
        owner = pairs.scatterers.owner
        names = tuple(pair_name(out, back) for out, back in pairs.names())
        sent, heard = self.whole.weights(pairs)
        room = self._room(kept, owner, pairs, names)
        if room is not None:
            self._lay_all(kept, owner, room, pairs, sent, heard)
            if pairs.scatterers.boundary == "seabed" and STRAIGHT in names:
                self._miss(kept, pairs.only(np.array([names.index(STRAIGHT)])))
            return
        parts = {name: pairs.only(np.flatnonzero(np.array(names) == name)) for name in dict.fromkeys(names)}
        out, back = _power(sent), _power(heard)
        if len(parts) > 1:
            self._hear(kept, (owner, ALL), pairs, sent, heard)
        for name, part in parts.items():
            self._hear(kept, (owner, MET + name if len(parts) > 1 else name), part, sent, heard)
            self._lay(kept, (owner, name), part, out, back)
        if pairs.scatterers.boundary == "seabed" and STRAIGHT in parts:
            self._miss(kept, parts[STRAIGHT])

    def take_in_swath(self, kept: Kept, swath: Swath) -> None:
        """Add the ground of a part of a ping, and what hides of it."""
        cutters = {SEABED: "seabed", **dict(enumerate(self.cutters))}
        add_swath(kept, self.whole, swath, cutters)

    def _room(self, kept: Kept, owner: str, pairs: Pairs, names: tuple[str, ...]) -> Room | None:
        """Cells and bins for the pairs of a block, in the order of their names; None where these do not tell all.

        Names tell all where legs out and back are the same, one of each family, and nothing is random but the phase of
        the place.
        """
        whole = self.whole
        if pairs.out is not pairs.back or pairs.together or pairs.out.glints is not None or whole.random_paths:
            return None
        if len(set(pairs.out.families)) < len(pairs.out.families) or not symmetric(pairs.pair):
            return None
        if np.iscomplexobj(pairs.strength):
            return None
        some = tuple(dict.fromkeys(names))
        if (owner, some) not in kept.rooms:
            if any((owner, name) in kept.bins for name in some):
                return None
            lead, tail = self._ringing
            channels, cells = whole.silence().cells.shape
            room = Room(
                np.zeros((channels, len(some), cells)), np.zeros((channels, len(some), cells)),
                np.zeros((channels, len(some), whole.grid.count + lead + tail, MOMENTS)),
            )  # fmt: skip
            kept.rooms[owner, some] = room
            for row, name in enumerate(some):
                kept.bins[owner, name] = room.bins[:, row]
                for key, part in ((name, room.own), (MET + name, room.met)):
                    kept.curves[owner, key] = Energies(part[:, row], np.zeros((channels, whole.grid.count)))
        return kept.rooms[owner, some]

    def _lay_all(self, kept: Kept, owner: str, room: Room, pairs: Pairs, sent: Complexes, heard: Complexes) -> None:
        """Add all pairs of a block to their room, and what those that interfere make together to their owner."""
        whole, table, legs = self.whole, self.whole.table, pairs.out
        here, grid, (lead, _) = whole.stance, whole.grid, self._ringing
        rows = np.flatnonzero(pairs.pair[:, 0] <= pairs.pair[:, 1])
        pair, strength = pairs.pair[rows], np.abs(pairs.strength[rows])
        times = Grid(grid.first_time, grid.energy_rate, grid.start - lead / grid.sample_rate, grid.sample_rate)
        for channel in range(here.channel_count):
            points = Points(
                legs.delay, sent[channel % len(sent)], heard[channel % len(heard)], legs.grazing, strength,
                pairs.scatterers.position,
            )  # fmt: skip
            told = lay_labels(
                points, pair, len(table.samples) / table.rate, times, here.receive_place, room.own[channel],
                room.met[channel], room.bins[channel],
            )  # fmt: skip
            if len(told[1]):
                if (owner, ALL) not in kept.curves:
                    kept.curves[owner, ALL] = whole.silence()
                add_groups(
                    kept.curves[owner, ALL].intensity[channel], grid.start, grid.sample_rate, table.samples,
                    table.start, table.rate, *told, 1.0, 0.0,
                )  # fmt: skip

    def _hear(self, kept: Kept, key: Key, pairs: Pairs, sent: Complexes, heard: Complexes) -> None:
        if key not in kept.curves:
            kept.curves[key] = self.whole.silence()
        self.whole.add(kept.curves[key], pairs, sent, heard)

    def _lay(self, kept: Kept, key: Key, pairs: Pairs, out: Floats, back: Floats, at: Rows | None = None) -> None:
        """Add the places of some paths, given the powers of their legs, to the bins of a key.

        Args:
            kept: What has been heard so far.
            key: Whose they are.
            pairs: The paths.
            out: Power of the legs out in each beam [uPa^2], (beams, f, points).
            back: Of the legs back [1].
            at: Which points the powers are of; None: all of them.
        """
        here, grid = self.whole.stance, self.whole.grid
        lead, tail = self._ringing
        shape, start = (here.channel_count, grid.count + lead + tail), grid.start - lead / grid.sample_rate
        if pairs.together:
            flashes = kept.flashes.setdefault(key, Flashes.empty(*shape))
            add_flashes(flashes, start, grid.sample_rate, pairs, here)
            return
        if key not in kept.bins:
            kept.bins[key] = np.zeros((*shape, MOMENTS))
        rows: Any = slice(None) if at is None else at
        place, strength = pairs.scatterers.position[rows], np.abs(pairs.strength[:, rows])
        for channel, bins in enumerate(kept.bins[key]):
            add_places(
                bins, start, grid.sample_rate, pairs.out.delay[:, rows], pairs.back.delay[:, rows],
                out[channel % len(out)], back[channel % len(back)], pairs.pair, strength, place,
                here.receive_place, pairs.out.grazing[:, rows], pairs.back.grazing[:, rows],
            )  # fmt: skip

    def _miss(self, kept: Kept, pairs: Pairs) -> None:
        """Add what the direct paths to some ground would have brought, had nothing cut them."""
        cut = np.zeros(len(pairs.scatterers), bool)
        for legs, rows in ((pairs.out, pairs.pair[:, 0]), (pairs.back, pairs.pair[:, 1])):
            cut |= (legs.status[rows] == Status.OCCLUDED).any(axis=0)
        at = np.flatnonzero(cut)
        if not len(at):
            return
        here = self.whole.stance
        out = _free(pairs.out, here.transmit_beams, at) * intensity_ratio(here.source_level_db)
        back = _free(pairs.back, here.receive_beams, at)
        cutters = {int(row) for legs in (pairs.out, pairs.back) for row in np.unique(legs.occluder[:, at])}
        for cutter in sorted(cutters - {-1}):
            owner = "seabed" if cutter == SEABED else self.cutters[cutter]
            for row, (i, j) in enumerate(pairs.pair):
                lost = _taken(pairs.out, pairs.back, int(i), int(j), cutter)[at]
                self._lay(kept, (owner, HIDDEN), pairs.only(np.array([row])), out * lost, back, at)

    @property
    def _ringing(self) -> tuple[int, int]:
        return ringing(self.whole)

    def series(self, kept: Kept) -> Labels:
        """The labels of the ping."""
        return labels_of(kept, self.whole, self.names, self.noise)


def _power(weight: Complexes) -> Floats:
    """Square of the magnitude, shape of the weights."""
    return weight.real**2 + weight.imag**2


def _free(legs: Legs, beams: Beams, at: Rows) -> Floats:
    """Power of the legs to some points in each beam, as if nothing cut them [1], (beams, f, points)."""
    bare = legs.spreading[:, at] * legs.absorption[:, at] * np.abs(legs.boundary[:, at])
    return np.asarray((beams.gain(legs.departure[:, at]) * bare) ** 2)


def _taken(out: Legs, back: Legs, i: int, j: int, cutter: int) -> Floats:
    """Part of each echo by the leg out of row i and the leg back of row j that one occluder takes away [1], (n,)."""
    ends = ((out, i), (back, j))
    hidden = [legs.status[row] == Status.OCCLUDED for legs, row in ends]
    there = [cut | (legs.status[row] == Status.CLEAR) for (legs, row), cut in zip(ends, hidden, strict=True)]
    by = np.where(hidden[0], out.occluder[i], back.occluder[j])
    mine = there[0] & there[1] & (hidden[0] | hidden[1]) & (by == cutter)
    left = np.abs(out.visibility[i] * back.visibility[j]) ** 2
    return np.where(mine, np.maximum(1 - left, 0.0), 0.0)
