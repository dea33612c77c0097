"""Labels of one ping: the incoherent reading taken apart by owner and by pair of families, and what is missing.

Intensities are those of the incoherent reading. Places are mean values over the same paths, weighted by energy and
smeared by the pulse as the recording is, but without interference. A shadow is where most of the direct echo of the
seabed is missing: the cut legs carry their own echo, as it would be if nothing cut them.
"""

from dataclasses import dataclass, field
from functools import reduce
from operator import iadd
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import DIRECT, families_for
from insonify.records.labels import NOBODY, LabelNames, Labels
from insonify.records.legs import SEABED, Legs, Status
from insonify.records.pairs import Pairs
from insonify.scene.scatterers import Boundary
from insonify.sonar.beam import Beams
from insonify.synthesis._groups import add_groups
from insonify.synthesis._label_kernel import MOMENTS, Grid, Points, add_places, lay_labels
from insonify.synthesis.flashes import add_flashes
from insonify.synthesis.incoherent import Energies, Incoherent, symmetric
from insonify.synthesis.levels import ALL, CurveSet, pair_name
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Rows = NDArray[np.intp]
Key = tuple[str, str]
MET = "met:"
"""Before the name of a pair: what counts for the pair, but for its owner only together with other pairs."""
HIDDEN = "hidden"
"""Stands for the pair where a key means what an owner hides."""
POINTS = 1.5
"""Most points to a resolution cell: sparse, off by a few tenths of a decibel where expectations are not [1]."""
SURROUNDINGS = ("seabed", "surface", "water")
"""Owners that are no target."""
STRAIGHT = pair_name(DIRECT, DIRECT)


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


class Room(NamedTuple):
    """Cells and bins of all pairs of one owner, side by side."""

    own: Floats
    """Energies that count for pair and owner, (channels, pairs, cells)."""
    met: Floats
    """Energies that count for the pair alone, likewise."""
    bins: Floats
    """Energies and places, (channels, pairs, bins, MOMENTS)."""


@dataclass(frozen=True, slots=True)
class Kept:
    """What has been heard so far."""

    curves: CurveSet
    """Energies by (owner, pair), which count for both; by (owner, `ALL`) those that count for the owner, by (owner,
    `MET` and pair) those that count for the pair."""
    bins: dict[Key, Floats] = field(default_factory=dict)
    """Energy and places by (owner, pair) and by (who cuts, `HIDDEN`), each (channels, bins, MOMENTS)."""
    rooms: dict[tuple[str, tuple[str, ...]], Room] = field(default_factory=dict)
    """Curves and bins of all owners and pairs, of which `curves` and `bins` are parts."""
    nbytes: int = 0
    """Size of all that one owner is likely to fill [bytes]."""

    def __iadd__(self, other: "Kept") -> "Kept":
        """Add what another has heard."""
        curves = self.curves
        curves += other.curves
        for key, bins in other.bins.items():
            self.bins[key] = self.bins[key] + bins if key in self.bins else bins
        return self


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
        if key not in kept.bins:
            kept.bins[key] = np.zeros((here.channel_count, grid.count + lead + tail, MOMENTS))
        start = grid.start - lead / grid.sample_rate
        if pairs.together:
            add_flashes(kept.bins[key], start, grid.sample_rate, pairs, here)
            return
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
        """Samples for which the pulse is heard after, and before, an echo's delay."""
        pulse, rate = self.whole.stance.pulse, self.whole.grid.sample_rate
        return max(0, int(np.ceil(pulse.stop * rate))), max(0, int(np.ceil(-pulse.start * rate)))

    def _smeared(self, bins: Floats) -> Floats:
        """Bins as the pulse leaves them in the recording, along the last axis: (..., bins) to (..., samples)."""
        lead, tail = self._ringing
        pulse = np.abs(self.whole.stance.pulse.samples(np.arange(-tail, lead + 1) / self.whole.grid.sample_rate)) ** 2
        rows = bins.reshape(-1, bins.shape[-1])
        smeared = np.array([np.convolve(row, pulse, "valid") for row in rows])
        return smeared.reshape(*bins.shape[:-1], self.whole.grid.count)

    def series(self, kept: Kept) -> Labels:
        """The labels of the ping."""
        by_owner, by_pair = self._intensities(kept.curves)
        energy = {key: self._smeared(bins[..., 0]) for key, bins in kept.bins.items()}
        silent = np.zeros(by_owner.shape[::2])
        echo = {key: value for key, value in energy.items() if key[1] != HIDDEN}
        there = sum(echo.values(), silent) > 0
        missing = np.stack([energy.get((who, HIDDEN), silent) for who in self.names.owners])
        highlight, ghost = self._targets(by_owner, echo, missing.sum(axis=0))
        shadow = (missing.sum(axis=0) > energy.get(("seabed", STRAIGHT), silent)) & ~highlight
        shadow_of = np.where(shadow, np.argmax(missing, axis=0), NOBODY).astype(np.uint8)
        owner = np.where(there, np.argmax(by_owner, axis=1), NOBODY).astype(np.uint8)
        place = self._places(kept.bins, energy, owner, shadow_of)
        return Labels(
            expected_intensity=by_owner.sum(axis=1),
            owner_intensity=by_owner,
            pair_intensity=by_pair,
            strongest_owner=owner,
            strongest_pair=np.where(there, np.argmax(by_pair, axis=1), NOBODY).astype(np.uint8),
            highlight=highlight,
            shadow=shadow,
            ghost=ghost,
            shadow_of=shadow_of,
            place=np.moveaxis(place[:3], 0, -1),
            distance=place[3],
            grazing=place[4],
        )

    def _intensities(self, curves: CurveSet) -> tuple[Floats, Floats]:
        """Expected intensity by owner, (channels, owners, samples), and by pair alone, (channels, pairs, samples)."""
        shape = self.whole.stance.channel_count, self.whole.grid.count
        silent = np.zeros(shape)

        def heard(parts: list[Energies]) -> Floats:
            return self.whole.series(reduce(iadd, parts, self.whole.silence())) if parts else silent

        def both(name: str) -> list[Energies]:
            return [value for (_, key), value in curves.items() if key in (name, MET + name)]

        by_owner = [
            heard([value for (who, key), value in curves.items() if who == owner and not key.startswith(MET)])
            for owner in self.names.owners
        ]
        by_pair = [heard(both(name)) for name in self.names.pairs]
        return np.stack(by_owner, axis=1), np.stack(by_pair, axis=1)

    def _targets(
        self, by_owner: Floats, echo: dict[Key, Floats], missing: Floats
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Highlights and ghosts: samples of which targets make at least half, noise included; by which paths.

        A highlight is no fainter than the echo of the ground that is missing there: it would pass for a shadow.
        """
        silent = np.zeros(by_owner.shape[::2])
        target = np.array([name not in SURROUNDINGS for name in self.names.owners])
        mine = by_owner[:, target].sum(axis=1)
        most = (mine > 0) & (mine >= by_owner[:, ~target].sum(axis=1) + self.noise)
        parts = {True: silent, False: silent}
        for (who, pair), value in echo.items():
            if who not in SURROUNDINGS:
                parts["S" in pair] = parts["S" in pair] + value
        ghost = parts[True] > parts[False]
        return most & ~ghost & (mine >= missing), most & ghost

    def _places(
        self, bins: dict[Key, Floats], energy: dict[Key, Floats], owner: NDArray[np.uint8], shadow_of: NDArray[np.uint8]
    ) -> Floats:
        """North, east, depth, distance, grazing of each sample, (5, channels, samples); NaN where nobody is heard."""
        place, loudest = np.full((MOMENTS - 1, *owner.shape), np.nan), np.zeros(owner.shape)
        for key, value in energy.items():
            row = self.names.owners.index(key[0])
            mine = (shadow_of == row) if key[1] == HIDDEN else (owner == row) & (shadow_of == NOBODY)
            wins = mine & (value > loudest)
            if wins.any():
                loudest = np.where(wins, value, loudest)
                means = self._smeared(np.moveaxis(bins[key][..., 1:], -1, 0))
                place[:, wins] = means[:, wins] / value[wins]
        return place


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
