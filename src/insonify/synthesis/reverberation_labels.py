"""Labels of the seabed in the fast reverberation: energies, positions and occluded echoes of its own sample points."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.records.reverberation_samples import Origins, ReverberationSamples
from insonify.synthesis._fast_reverberation_energies import DelayCells, WeightedSamples
from insonify.synthesis._label_kernel import MOMENTS
from insonify.synthesis._position_kernel import (
    deposit_energies_in_bins,
    deposit_pair_energies_in_bins,
    deposit_pair_positions,
    deposit_positions,
)
from insonify.synthesis.incoherent import IncoherentAccumulator, IntensityBuffer
from insonify.synthesis.label_bins import BinGrid
from insonify.synthesis.label_sums import ALL, HIDDEN, Key, LabelBuffer
from insonify.synthesis.level_curves import pair_name
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Positions = tuple[Floats, Singles] | None
"""Positions of sample points and grazing angles of their legs, see `Origins.positions`; None: not needed."""
SEABED = "seabed"


def add_reverberation_labels(
    buffer: LabelBuffer, accumulator: IncoherentAccumulator, swath: ReverberationSamples, bins: BinGrid,
    occluder_names: Mapping[int, str], *, is_fine: bool, with_positions: bool,
) -> None:  # fmt: skip
    """Add the seabed from a block of reverberation samples to the sums of labels.

    Args:
        buffer: Sums, added to in place.
        accumulator: Incoherent accumulator of the same ping.
        swath: Reverberation samples, with the origins of their points.
        bins: Bins of energy and position.
        occluder_names: Name of each occluding object, by its row.
        is_fine: False: energies count as those of the bins, see `LabelAccumulator`.
        with_positions: False: bins of energies alone.

    Raises:
        ValueError: The samples have no origins.
    """
    if swath.origins is None:
        raise ValueError("ReverberationSamples.origins is None; gather the swath with labelled=True")
    samples = accumulator.weighted_samples(swath, *accumulator.beam_amplitudes(swath))
    positions = swath.origins.positions() if with_positions else None
    interferes = len(swath.interference_ranges) > 0
    if is_fine or interferes:
        if (SEABED, ALL) not in buffer.curves:
            buffer.curves[SEABED, ALL] = accumulator.empty()
        energies = buffer.curves[SEABED, ALL]
    _add_pairs(buffer.bins if is_fine else buffer.sampled, bins, accumulator, samples, swath.origins.families,
               positions, energies.cells[0] if is_fine else np.empty(0))  # fmt: skip
    if interferes:
        before = energies.cells.copy()
        accumulator.add_fringes(energies, swath, samples)
        interference = buffer.common.setdefault(
            SEABED, IntensityBuffer(np.zeros_like(before), np.zeros_like(energies.intensity))
        )
        interference.cells[...] += energies.cells - before
    if len(swath.origins.cut):
        _add_occluded(buffer, bins, accumulator, swath, swath.origins, occluder_names, positions)


def _add_pairs(
    bins_by_key: dict[Key, Singles], grid: BinGrid, accumulator: IncoherentAccumulator, samples: WeightedSamples,
    families: tuple[str, ...], positions: Positions, cells: Floats,
) -> None:  # fmt: skip
    """Add energy and position of every pair to its bins, and the energy to cells of the energy grid unless empty."""
    bins = np.zeros((len(samples.pair), grid.size, 1 if positions is None else MOMENTS), np.float32)
    by_delay = DelayCells(cells, accumulator.grid.first_time, accumulator.grid.energy_rate)
    if positions is None:
        deposit_pair_energies_in_bins(samples, by_delay, DelayCells(bins[..., 0], grid.start, grid.rate))
    else:
        deposit_pair_positions(
            samples, by_delay, DelayCells(bins, grid.start, grid.rate), *positions,
            accumulator.ping_geometry.receive_position,
        )  # fmt: skip
    for (i, j), pair_bins in zip(samples.pair.tolist(), bins, strict=True):
        key = SEABED, pair_name(families[i], families[j])
        bins_by_key[key] = bins_by_key[key] + pair_bins[None] if key in bins_by_key else pair_bins[None]


def _add_occluded(
    buffer: LabelBuffer, grid: BinGrid, accumulator: IncoherentAccumulator, swath: ReverberationSamples,
    origins: Origins, occluder_names: Mapping[int, str], positions: Positions,
) -> None:  # fmt: skip
    """Add the energies that occluded direct legs would have without occlusion, to the bins of their occluders."""
    row = slice(origins.direct, origins.direct + 1)
    points = swath.rows[origins.straight].take(origins.cut)
    legs = replace(
        swath, delay=swath.delay[row].take(points, axis=1), amplitude=origins.free[None],
        departure=swath.departure[row].take(points, axis=2),
    )  # fmt: skip
    transmit_amplitude, receive_amplitude = accumulator.beam_amplitudes(legs)
    source_amplitude = float(amplitude_ratio(accumulator.ping_geometry.source_level_db))
    pressure = source_amplitude * transmit_amplitude[0].astype(float) * receive_amplitude[0]
    energy = pressure**2 * swath.cross_section[origins.straight].take(origins.cut) * origins.lost
    moments = 1 if positions is None else MOMENTS
    for occluder_row, name in occluder_names.items():
        some = np.flatnonzero(origins.occluder_row == occluder_row)
        if not len(some):
            continue
        bins = buffer.bins.setdefault((name, HIDDEN), np.zeros((1, grid.size, moments), np.float32))[0]
        delay, occluded_energy = 2 * legs.delay[0, some], energy[some]
        if positions is None:
            deposit_energies_in_bins(DelayCells(bins[:, 0], grid.start, grid.rate), delay, occluded_energy)
            continue
        position, grazing = positions[0], positions[1][origins.direct]
        deposit_positions(
            DelayCells(bins, grid.start, grid.rate), delay, occluded_energy, points[some], position, grazing, grazing,
            accumulator.ping_geometry.receive_position,
        )  # fmt: skip
