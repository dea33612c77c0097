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
"""Positions of sample points [m], (3, n), and grazing angles of their legs [rad], (f, n): `Origins.positions`."""
SEABED = "seabed"


def add_reverberation_labels(
    buffer: LabelBuffer, accumulator: IncoherentAccumulator, samples: ReverberationSamples, bin_grid: BinGrid,
    occluder_names: Mapping[int, str], *, uses_energy_grid: bool, with_positions: bool,
) -> None:  # fmt: skip
    """Add the seabed from a block of reverberation samples to the sums of labels.

    Args:
        buffer: Sums, added to in place.
        accumulator: Incoherent accumulator of the same ping.
        samples: Reverberation samples, with the origins of their points.
        bin_grid: Start [s] and rate [Hz] of the label bins over two-way delay.
        occluder_names: Name of each occluding object, by its row; of the seabed by `SEABED_OCCLUDER`.
        uses_energy_grid: True: energies are also deposited in the cells of the energy grid. False: energies are taken
            from the coarser label bins (`LabelBuffer.sampled`), and the curve of the seabed holds interference only.
        with_positions: True: bins hold all `MOMENTS`; False: energies alone.

    Raises:
        ValueError: The samples have no origins.
    """
    origins = samples.origins
    if origins is None:
        raise ValueError("ReverberationSamples.origins is None; accumulate the fast reverberation with labelled=True")
    weighted_samples = accumulator.weighted_samples(samples, *accumulator.leg_and_beam_amplitudes(samples))
    positions = origins.positions() if with_positions else None
    interferes = len(samples.interference_ranges) > 0
    if uses_energy_grid or interferes:
        if (SEABED, ALL) not in buffer.curves:
            buffer.curves[SEABED, ALL] = accumulator.empty()
        energies = buffer.curves[SEABED, ALL]
    _add_pairs(
        buffer.bins if uses_energy_grid else buffer.sampled, bin_grid, accumulator, weighted_samples, origins.families,
        positions, energies.cells[0] if uses_energy_grid else np.empty(0),
    )  # fmt: skip
    if interferes:
        before = energies.cells.copy()
        accumulator.add_fringes(energies, samples, weighted_samples)
        interference = buffer.common.setdefault(
            SEABED, IntensityBuffer(np.zeros_like(before), np.zeros_like(energies.intensity))
        )
        interference.cells[...] += energies.cells - before
    if len(origins.occluded):
        _add_occluded(buffer, bin_grid, accumulator, samples, origins, occluder_names, positions)


def _add_pairs(
    bins_by_key: dict[Key, Singles], bin_grid: BinGrid, accumulator: IncoherentAccumulator, samples: WeightedSamples,
    families: tuple[str, ...], positions: Positions, cells: Floats,
) -> None:  # fmt: skip
    """Add energy [uPa^2] and energy-weighted position of every pair to its bins.

    Args:
        bins_by_key: Bins by (`SEABED`, pair), each (1, bins, moments), added to.
        bin_grid: Start [s] and rate [Hz] of the bins over two-way delay.
        accumulator: Incoherent accumulator of the same ping.
        samples: Samples with the amplitudes of their legs.
        families: Name of each row of legs.
        positions: Positions and grazing angles of the points; None: bins of energies alone.
        cells: Cells of the energy grid, to which the energies are added as well; empty: they are not.
    """
    bins = np.zeros((len(samples.pair), bin_grid.size, 1 if positions is None else MOMENTS), np.float32)
    by_delay = DelayCells(cells, accumulator.grid.first_time, accumulator.grid.energy_rate)
    if positions is None:
        deposit_pair_energies_in_bins(samples, by_delay, DelayCells(bins[..., 0], bin_grid.start, bin_grid.rate))
    else:
        deposit_pair_positions(
            samples, by_delay, DelayCells(bins, bin_grid.start, bin_grid.rate), *positions,
            accumulator.ping_geometry.receive_position,
        )  # fmt: skip
    for (i, j), pair_bins in zip(samples.pair.tolist(), bins, strict=True):
        key = SEABED, pair_name(families[i], families[j])
        bins_by_key[key] = bins_by_key[key] + pair_bins[None] if key in bins_by_key else pair_bins[None]


def _add_occluded(
    buffer: LabelBuffer, bin_grid: BinGrid, accumulator: IncoherentAccumulator, samples: ReverberationSamples,
    origins: Origins, occluder_names: Mapping[int, str], positions: Positions,
) -> None:  # fmt: skip
    """Add the energies by which occlusion weakens the direct echo (D-D), to the bins of the occluders.

    Args:
        buffer: Sums; its bins by (occluder, `HIDDEN`), (1, bins, moments), are added to: energy [uPa^2] over two-way
            delay.
        bin_grid: Start [s] and rate [Hz] of the bins.
        accumulator: Incoherent accumulator of the same ping.
        samples: Reverberation samples.
        origins: Their origins.
        occluder_names: Name of each occluding object, by its row.
        positions: Positions and grazing angles of the points; None: bins of energies alone.
    """
    row = slice(origins.direct, origins.direct + 1)
    points = samples.rows[origins.direct_pair].take(origins.occluded)
    legs = replace(
        samples, delay=samples.delay[row].take(points, axis=1), amplitude=origins.unoccluded_amplitude[None],
        departure=samples.departure[row].take(points, axis=2),
    )  # fmt: skip
    transmit_amplitude, receive_amplitude = accumulator.leg_and_beam_amplitudes(legs)
    source_amplitude = float(amplitude_ratio(accumulator.ping_geometry.source_level_db))
    pressure = source_amplitude * transmit_amplitude[0].astype(float) * receive_amplitude[0]
    cross_section = samples.cross_section[origins.direct_pair].take(origins.occluded)
    energy = pressure**2 * cross_section * origins.occluded_fraction
    moments = 1 if positions is None else MOMENTS
    for occluder_row, name in occluder_names.items():
        rows_of_occluder = np.flatnonzero(origins.occluder_row == occluder_row)
        if not len(rows_of_occluder):
            continue
        bins = buffer.bins.setdefault((name, HIDDEN), np.zeros((1, bin_grid.size, moments), np.float32))[0]
        delay, occluded_energy = 2 * legs.delay[0, rows_of_occluder], energy[rows_of_occluder]
        if positions is None:
            deposit_energies_in_bins(DelayCells(bins[:, 0], bin_grid.start, bin_grid.rate), delay, occluded_energy)
            continue
        position, grazing = positions[0], positions[1][origins.direct]
        deposit_positions(
            DelayCells(bins, bin_grid.start, bin_grid.rate), delay, occluded_energy, points[rows_of_occluder], position,
            grazing, grazing, accumulator.ping_geometry.receive_position,
        )  # fmt: skip
