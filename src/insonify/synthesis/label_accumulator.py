"""Labels of one ping: expected intensity by object and by pair of families, and occluded echoes.

Intensities are those of the incoherent accumulator. Positions are mean values over the same paths, weighted by energy
and smeared by the pulse as the recording is, but without interference. The echo that an object occludes is summed
under its name: a shadow is where more of the direct echo of the seabed is occluded than is received.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import families_reaching
from insonify.records.labels import LabelNames, MaskLabels
from insonify.records.legs import SEABED_OCCLUDER, Legs, LegStatus
from insonify.records.pairs import Pairs
from insonify.records.reverberation_samples import ReverberationSamples
from insonify.scene.scatterers import BOUNDARY_ECHO, Boundary
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._fast_reverberation_energies import DelayCells
from insonify.synthesis._label_kernel import (
    MOMENTS,
    LabelGrid,
    LabelledPoints,
    PoweredLegs,
    PulseOverlap,
    deposit_label_positions,
    deposit_labels,
)
from insonify.synthesis.accumulator import Mapper, Requirements
from insonify.synthesis.coherent_groups import add_groups
from insonify.synthesis.direction_powers import DirectionPowers, direction_powers
from insonify.synthesis.incoherent import IncoherentAccumulator, contains_reversed_pairs
from insonify.synthesis.label_bins import BinGrid, bin_grid, significant_duration
from insonify.synthesis.label_series import STRAIGHT, labels_of
from insonify.synthesis.label_sums import ALL, HIDDEN, PAIR_ONLY, Key, LabelBuffer, LabelCells
from insonify.synthesis.level_curves import LevelBuffers, pair_name
from insonify.synthesis.receive_beam_motion import receive_directions
from insonify.synthesis.reverberation_labels import add_reverberation_labels
from insonify.synthesis.specular_labels import SpecularLabelSums, deposit_specular_labels
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Complexes = NDArray[np.complex128]
Rows = NDArray[np.intp]
Masks = NDArray[np.bool_]
SEABED_POINTS = 2.0
"""Largest number of points per resolution cell along radials of the seabed that labels need, but no intensity [1]."""
BINS_OF_CHANNELS, BINS_OF_ROWS = (8.0, 4), (8.0, 2)
"""Least number of bins over the equivalent duration of a pulse, and largest number per sample [1]: of channels, and of
rows of directions."""
POINTS = 1.5
"""Largest number of points per resolution cell [1]; fewer than for the intensity, an error of a few tenths of a
decibel."""


def label_names(
    targets: tuple[str, ...], followed: tuple[str, ...], *, water: tuple[str, ...] = (),
    boundary_echoes: tuple[str, ...] = (),
) -> LabelNames:  # fmt: skip
    """Names along the axes of labels.

    Args:
        targets: Labels of the scene's targets.
        followed: Families of the legs.
        water: Objects in the water that scatter: "water" for its layers, and the labels of patches.
        boundary_echoes: Families of the boundary echoes.
    """
    targets = (*water, *targets)
    contributions: tuple[Boundary, ...] = ("seabed", "surface", "target")
    families = [
        families_reaching(contribution, followed)
        for contribution in contributions
        if contribution != "target" or targets
    ]
    pair_names = {pair_name(transmit, receive) for names in families for transmit in names for receive in names}
    pair_names |= set(boundary_echoes)
    pairs = sorted(pair_names, key=lambda name: (name.count("S") + name.count("B"), len(name), name))
    return LabelNames(("seabed", "surface", *((BOUNDARY_ECHO,) if boundary_echoes else ()), *targets), tuple(pairs))


@dataclass(frozen=True)
class LabelAccumulator:
    """Accumulator of expected intensity and positions by object and pair of families."""

    accumulator: IncoherentAccumulator
    """Incoherent accumulator of the same ping."""
    names: LabelNames
    occluder_names: tuple[str, ...]
    """Labels of the scene's occluders, in the order of their rows in `Legs.occluder`."""
    noise: float
    """Mean-square noise pressure that a target has to exceed [uPa^2]."""
    uses_energy_grid: bool = True
    """True: energies are deposited on the energy grid, for intensities as exact as those of the accumulator. False: in
    the coarser bins of positions, each shared between two of them.

    The latter is less work and blurs the edges of pulses: 0.02 to 0.25 dB rms down to 20 dB below the largest.
    """

    with_positions: bool = True
    """True: `Labels`; False: `MaskLabels` alone, without positions and pairs of families."""

    @property
    def geometry(self) -> PingGeometry:
        """The sonar at that ping."""
        return self.accumulator.ping_geometry

    @cached_property
    def directions(self) -> DirectionPowers | None:
        """Rows of directions, where beams are many; None: each channel has its own bins."""
        grid = self.accumulator.grid
        cells = grid.energy_cell_count if self.uses_energy_grid else BINS_OF_ROWS[1] * grid.sample_count
        return direction_powers(self.geometry, 8 * len(self.names.pairs) * cells)

    @property
    def _row_count(self) -> int:
        """Number of rows of directions; of channels, where there are no such rows."""
        return self.geometry.channel_count if self.directions is None else self.directions.beam_powers.shape[1]

    @property
    def requirements(self) -> Requirements:
        """Properties of the path pairs that `add` expects."""
        return Requirements(origins=True, max_scatterers_per_cell=POINTS, approximate_edges=True)

    def empty(self) -> LabelBuffer:
        """Empty buffer."""
        grid, bins = self.accumulator.grid, self._bins.size
        cells = (grid.energy_cell_count if self.uses_energy_grid else bins) + MOMENTS * bins // 2
        return LabelBuffer(LevelBuffers(), nbytes=8 * self._row_count * len(self.names.pairs) * cells)

    def add(self, buffer: LabelBuffer, pairs: Pairs) -> None:
        """Add the energies of one block of scatterers to the sums of its object."""
        object_name = pairs.scatterers.object
        names = tuple(pair_name(transmit_family, receive_family) for transmit_family, receive_family in pairs.names())
        workspace = self._workspace(buffer, object_name, pairs, names)
        directions = receive_directions(pairs, self.geometry)
        if workspace is not None:
            self._deposit_all_pairs(buffer, object_name, workspace, pairs, directions)
            if pairs.scatterers.boundary == "seabed" and STRAIGHT in names:
                self._add_occluded(buffer, pairs.select(np.array([names.index(STRAIGHT)])))
            return
        transmit_weights, receive_weights = self.accumulator.weights(pairs, directions)
        if pairs.scatterers.boundary == BOUNDARY_ECHO:  # few of the families have an echo at any one ping
            weights = transmit_weights[:, pairs.pair[:, 0]] * receive_weights[:, pairs.pair[:, 1]] * pairs.strength
            received = np.flatnonzero(np.any(weights != 0, axis=(0, 2)))
            pairs, names = pairs.select(received), tuple(names[row] for row in received)
        pairs_by_name = {name: pairs.select(np.flatnonzero(np.array(names) == name)) for name in dict.fromkeys(names)}
        transmit_power, receive_power = _power(transmit_weights), _power(receive_weights)
        if not self.uses_energy_grid and self._are_apart(pairs):
            for name, named_pairs in pairs_by_name.items():
                self._deposit_positions(
                    buffer, (object_name, name), named_pairs, transmit_power, receive_power, bins_by_key=buffer.sampled
                )
            return
        if len(pairs_by_name) > 1:
            self._add_intensity(buffer, (object_name, ALL), pairs, transmit_weights, receive_weights)
        for name, named_pairs in pairs_by_name.items():
            self._add_intensity(
                buffer, (object_name, PAIR_ONLY + name if len(pairs_by_name) > 1 else name), named_pairs,
                transmit_weights, receive_weights,
            )  # fmt: skip
            self._deposit_positions(buffer, (object_name, name), named_pairs, transmit_power, receive_power)
        if pairs.scatterers.boundary == "seabed" and STRAIGHT in pairs_by_name:
            self._add_occluded(buffer, pairs_by_name[STRAIGHT])

    def _are_apart(self, pairs: Pairs) -> bool:
        """Return True for boundary echoes without random phases, further apart in delay than the pulse lasts."""
        if pairs.scatterers.boundary != BOUNDARY_ECHO or self.accumulator.has_random_paths:
            return False
        delay = (pairs.transmit_legs.delay[pairs.pair[:, 0]] + pairs.receive_legs.delay[pairs.pair[:, 1]])[
            (pairs.strength != 0)
        ]
        apart = np.diff(np.sort(delay)) >= significant_duration(self.accumulator, self._bins)
        return bool(pairs.transmit_legs.glints is None and pairs.receive_legs.glints is None and apart.all())

    def add_fast_reverberation(self, buffer: LabelBuffer, samples: ReverberationSamples) -> None:
        """Add the seabed from a block of reverberation samples, and its occluded echoes."""
        occluder_names = {SEABED_OCCLUDER: "seabed", **dict(enumerate(self.occluder_names))}
        add_reverberation_labels(
            buffer, self.accumulator, samples, self._bins, occluder_names, uses_energy_grid=self.uses_energy_grid,
            with_positions=self.with_positions,
        )  # fmt: skip

    def _workspace(
        self, buffer: LabelBuffer, object_name: str, pairs: Pairs, names: tuple[str, ...]
    ) -> LabelCells | None:
        """Cells and bins for the pairs of a block, in the order of their names; None where names do not identify pairs.

        Names identify pairs where transmit and receive legs are the same, with one ray per family, and only the phases
        of the scatterers are random.
        """
        accumulator = self.accumulator
        if (
            pairs.transmit_legs is not pairs.receive_legs
            or pairs.interferes
            or pairs.transmit_legs.glints is not None
            or accumulator.has_random_paths
        ):
            return None
        families = pairs.transmit_legs.families
        if len(set(families)) < len(families) or not contains_reversed_pairs(pairs.pair):
            return None
        if np.iscomplexobj(pairs.strength):
            return None
        pair_names = tuple(dict.fromkeys(names))
        if (object_name, pair_names) not in buffer.cells:
            i, j = pairs.pair[_half(pairs)].T
            buffer.cells[object_name, pair_names] = self._empty_cells(i != j)
        return buffer.cells[object_name, pair_names]

    def _empty_cells(self, mixed: Masks) -> LabelCells:
        """Empty cells and bins of some pairs; mixed: mask of pairs of two different families, (p,)."""
        rows, bins, count = self._row_count, self._bins.size, len(mixed)
        has_cells = np.ones(count, bool) if self.uses_energy_grid else mixed
        pair_row = np.where(has_cells, np.cumsum(has_cells) - 1, -1)
        cells = self.accumulator.grid.energy_cell_count if self.uses_energy_grid else bins
        return LabelCells(
            np.zeros((rows, int(has_cells.sum()) + (count > 1), cells)),
            np.zeros((rows, count, bins, MOMENTS), np.float32), pair_row, self.uses_energy_grid,
        )  # fmt: skip

    def _deposit_all_pairs(
        self, buffer: LabelBuffer, object_name: str, label_cells: LabelCells, pairs: Pairs, directions: Floats
    ) -> None:
        """Add all pairs of a block to their cells, and the interference between pairs to their object."""
        accumulator, legs, powers = self.accumulator, pairs.transmit_legs, self.directions
        table, grid, bins = accumulator.table, accumulator.grid, self._bins
        half = _half(pairs)
        pair, strength = pairs.pair[half], np.abs(pairs.strength[half])
        lags, lag_rate = accumulator.pulse_lags
        is_short = powers is not None or accumulator.is_short_pulse
        overlap = PulseOverlap(len(table.samples) / table.rate, lags[: len(lags) if is_short else 0], lag_rate)
        transmit, receive = accumulator.weights(pairs, directions, None if powers is None else powers.common)
        row = np.zeros(legs.delay.shape) if powers is None else powers.rows(directions)
        times = LabelGrid(
            grid.first_time, grid.energy_rate, bins.start, bins.rate,
            0.0 if powers is None else np.pi * powers.extent * powers.step, self.uses_energy_grid,
        )  # fmt: skip
        for channel in range(1 if powers is not None else self.geometry.channel_count):
            points = LabelledPoints(
                legs.delay, transmit[channel % len(transmit)], receive[channel % len(receive)],
                np.arcsin(legs.grazing_sine),
                strength, pairs.scatterers.position, row,
            )  # fmt: skip
            rows = slice(None) if powers is not None else slice(channel, channel + 1)
            groups = deposit_labels(
                points, pair, overlap, times, self.geometry.receive_position, label_cells.cells[rows],
                label_cells.pair_row, label_cells.bins[rows],
            )  # fmt: skip
            if len(groups[1]):
                if (object_name, ALL) not in buffer.curves:
                    buffer.curves[object_name, ALL] = accumulator.empty()
                add_groups(
                    buffer.curves[object_name, ALL].intensity[channel], grid.start, grid.sample_rate, table.samples,
                    table.start, table.rate, *groups, 1.0, -1.0,
                )  # fmt: skip

    def _add_intensity(
        self, buffer: LabelBuffer, key: Key, pairs: Pairs, transmit_weights: Complexes, receive_weights: Complexes
    ) -> None:
        """Add the intensity of some pairs to the curve of a key, given the weights of all legs of their block."""
        if key not in buffer.curves:
            buffer.curves[key] = self.accumulator.empty()
        self.accumulator.add_weighted(buffer.curves[key], pairs, transmit_weights, receive_weights)

    def _deposit_positions(
        self, buffer: LabelBuffer, key: Key, pairs: Pairs, transmit_power: Floats, receive_power: Floats,
        point_rows: Rows | None = None, bins_by_key: dict[Key, Singles] | None = None,
    ) -> None:  # fmt: skip
        """Add the positions of some paths, given the powers of their legs, to the bins of a key.

        Args:
            buffer: Buffer, added to in place.
            key: Object and pair of families of the paths.
            pairs: The paths.
            transmit_power: Squared amplitude of the transmit legs in each beam [uPa^2], (beams, f, points).
            receive_power: Squared amplitude of the receive legs in each beam [1], (beams, f, points).
            point_rows: Points to which the powers belong; None: all of them.
            bins_by_key: Bins by key, added to in place; None: those of the buffer whose energies are in curves.
        """
        geometry, grid = self.accumulator.ping_geometry, self._bins
        shape = geometry.channel_count, grid.size
        if pairs.interferes:
            flashes = buffer.flashes.setdefault(key, SpecularLabelSums.empty(*shape))
            deposit_specular_labels(flashes, grid.start, grid.rate, pairs, geometry)
            return
        bins_by_key = buffer.bins if bins_by_key is None else bins_by_key
        if key not in bins_by_key:
            bins_by_key[key] = np.zeros((*shape, MOMENTS), np.float32)
        if pairs.scatterers.boundary == BOUNDARY_ECHO and len(pairs.pair) > 1:  # each from a position of its own
            for row in range(len(pairs.pair)):
                one = pairs.select(np.array([row]))
                self._deposit_positions(buffer, key, one, transmit_power, receive_power, bins_by_key=bins_by_key)
            return
        rows: Any = slice(None) if point_rows is None else point_rows
        position, strength = pairs.positions(0)[rows], np.abs(pairs.strength[:, rows])
        transmit, receive = (
            PoweredLegs(legs.delay[:, rows], power, np.arcsin(legs.grazing_sine[:, rows]))
            for legs, power in ((pairs.transmit_legs, transmit_power), (pairs.receive_legs, receive_power))
        )
        by_delay = DelayCells(bins_by_key[key], grid.start, grid.rate)
        deposit_label_positions(by_delay, transmit, receive, pairs.pair, strength, position, geometry.receive_position)

    def _add_occluded(self, buffer: LabelBuffer, pairs: Pairs) -> None:
        """Add the energies that occlusion removes from direct paths to the seabed, to the bins of the occluders."""
        occluded = np.zeros(len(pairs.scatterers), bool)
        ends = (pairs.transmit_legs, pairs.pair[:, 0]), (pairs.receive_legs, pairs.pair[:, 1])
        for legs, rows in ends:
            occluded |= (legs.status[rows] == LegStatus.OCCLUDED).any(axis=0)
        point_rows = np.flatnonzero(occluded)
        if not len(point_rows):
            return
        geometry = self.accumulator.ping_geometry
        transmit_power = _unoccluded_power(pairs.transmit_legs, geometry.transmit_beams, point_rows) * intensity_ratio(
            geometry.source_level_db
        )
        receive_power = _unoccluded_power(pairs.receive_legs, geometry.receive_beams, point_rows)
        occluders = [legs.occluder[rows][:, point_rows] for legs, rows in ends]
        for occluder_row in sorted(set(np.concatenate(occluders, axis=None).tolist()) - {-1}):
            object_name = "seabed" if occluder_row == SEABED_OCCLUDER else self.occluder_names[occluder_row]
            for row, (i, j) in enumerate(pairs.pair):
                leg_pair = pairs.transmit_legs, pairs.receive_legs
                removed_fraction = _removed_fraction(*leg_pair, int(i), int(j), occluder_row)[point_rows]
                self._deposit_positions(
                    buffer, (object_name, HIDDEN), pairs.select(np.array([row])), transmit_power * removed_fraction,
                    receive_power, point_rows,
                )  # fmt: skip

    @cached_property
    def _bins(self) -> BinGrid:
        """Bins of the ping: one per sample; several over the pulse where intensities are taken from them."""
        if self.uses_energy_grid:
            return bin_grid(self.accumulator)
        return bin_grid(self.accumulator, *(BINS_OF_CHANNELS if self.directions is None else BINS_OF_ROWS))

    def time_series(self, buffer: LabelBuffer, _run: Mapper = map) -> MaskLabels:
        """Labels of the ping."""
        for (object_name, pair_names), added in buffer.cells.items():
            if self.directions is not None:
                to_beams = self.directions.to_beams
                added = replace(added, cells=to_beams(added.cells), bins=to_beams(added.bins))
            buffer.add_cells(object_name, pair_names, added, self.accumulator.grid.sample_count)
        return labels_of(
            buffer, self.accumulator, self.names, self.noise, self._bins, with_positions=self.with_positions
        )


def _half(pairs: Pairs) -> Rows:
    """Rows of the pairs of which the reverse comes later, or is the same."""
    return np.flatnonzero(pairs.pair[:, 0] <= pairs.pair[:, 1])


def _power(weight: Complexes) -> Floats:
    """Square of the magnitude, shape of the weights."""
    return weight.real**2 + weight.imag**2


def _unoccluded_power(legs: Legs, beams: Beams, point_rows: Rows) -> Floats:
    """Squared amplitude of the legs to some points in each beam, without occlusion [1], (beams, f, points)."""
    amplitude = (
        legs.spreading[:, point_rows]
        * legs.absorption[:, point_rows]
        * np.abs(legs.reflection_coefficient[:, point_rows])
    )
    return np.asarray((beams.gain(legs.departure[:, point_rows]) * amplitude) ** 2)


def _removed_fraction(transmit: Legs, receive: Legs, i: int, j: int, occluder_row: int) -> Floats:
    """Fraction of the energy of each echo by transmit leg i and receive leg j that one occluder removes [1], (n,)."""
    ends = ((transmit, i), (receive, j))
    occluded = [legs.status[row] == LegStatus.OCCLUDED for legs, row in ends]
    exists = [mask | (legs.status[row] == LegStatus.CLEAR) for (legs, row), mask in zip(ends, occluded, strict=True)]
    occluder = np.where(occluded[0], transmit.occluder[i], receive.occluder[j])
    affected = exists[0] & exists[1] & (occluded[0] | occluded[1]) & (occluder == occluder_row)
    remaining_fraction = np.abs(transmit.visibility[i] * receive.visibility[j]) ** 2
    return np.where(affected, np.maximum(1 - remaining_fraction, 0.0), 0.0)
