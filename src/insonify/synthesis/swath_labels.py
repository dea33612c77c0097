"""Labels of the seabed in the fast reverberation: energies, positions and occluded echoes of its own sample points."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.records.reverberation_samples import Origins, ReverberationSamples
from insonify.synthesis._fast_reverberation_energies import DelayCells, WeightedSamples
from insonify.synthesis._label_kernel import MOMENTS
from insonify.synthesis._position_kernel import deposit_pair_positions, deposit_positions
from insonify.synthesis.incoherent import IncoherentAccumulator, IntensityBuffer
from insonify.synthesis.label_series import ringing
from insonify.synthesis.label_sums import ALL, HIDDEN, LabelBuffer
from insonify.synthesis.level_curves import pair_name
from insonify.units import amplitude_ratio

Singles = NDArray[np.float32]
SEABED = "seabed"


def add_swath(
    buffer: LabelBuffer,
    accumulator: IncoherentAccumulator,
    swath: ReverberationSamples,
    occluder_names: Mapping[int, str],
) -> None:
    """Add the seabed from a block of reverberation samples to the sums of labels.

    Args:
        buffer: Sums, added to in place.
        accumulator: Incoherent accumulator of the same ping.
        swath: Reverberation samples, with the origins of their points.
        occluder_names: Name of each occluding object, by its row.

    Raises:
        ValueError: The samples have no origins.
    """
    if swath.origins is None:
        raise ValueError("ReverberationSamples.origins is None; gather the swath with labelled=True")
    samples = accumulator.weighted_samples(swath, *accumulator.swath_sizes(swath))
    energies = buffer.curves.setdefault((SEABED, ALL), accumulator.empty())
    accumulator.add_swath(energies, samples)
    if len(swath.interference_ranges):
        before = energies.cells.copy()
        accumulator.add_fringes(energies, swath, samples)
        interference = buffer.common.setdefault(
            SEABED, IntensityBuffer(np.zeros_like(before), np.zeros_like(energies.intensity))
        )
        interference.cells[...] += energies.cells - before
    _add_positions(buffer, accumulator, samples, swath.origins)
    if len(swath.origins.cut):
        _add_occluded(buffer, accumulator, swath, swath.origins, occluder_names)


def _add_positions(
    buffer: LabelBuffer, accumulator: IncoherentAccumulator, samples: WeightedSamples, origins: Origins
) -> None:
    """Add energy and position of every pair to its bins."""
    grid, (lead, tail) = accumulator.grid, ringing(accumulator)
    bins = np.zeros((len(samples.pair), grid.sample_count + lead + tail, MOMENTS), np.float32)
    by_delay = DelayCells(bins, grid.start - lead / grid.sample_rate, grid.sample_rate)
    deposit_pair_positions(
        samples, by_delay, origins.position, origins.grazing, accumulator.ping_geometry.receive_position
    )
    for (i, j), pair_bins in zip(samples.pair.tolist(), bins, strict=True):
        key = SEABED, pair_name(origins.families[i], origins.families[j])
        buffer.bins[key] = buffer.bins[key] + pair_bins[None] if key in buffer.bins else pair_bins[None]


def _add_occluded(
    buffer: LabelBuffer, accumulator: IncoherentAccumulator, swath: ReverberationSamples, origins: Origins,
    occluder_names: Mapping[int, str]
) -> None:  # fmt: skip
    """Add the energies that occluded direct legs would have without occlusion, to the bins of their occluders."""
    grid, (lead, tail), row = accumulator.grid, ringing(accumulator), slice(origins.direct, origins.direct + 1)
    points = swath.rows[origins.straight, origins.cut]
    legs = replace(
        swath, delay=np.ascontiguousarray(swath.delay[row, points]), amplitude=origins.free[None],
        departure=np.ascontiguousarray(swath.departure[row][:, :, points]),
    )  # fmt: skip
    transmit_amplitude, receive_amplitude = accumulator.swath_sizes(legs)
    level = float(amplitude_ratio(accumulator.ping_geometry.source_level_db))
    pressure = level * transmit_amplitude[0].astype(float) * receive_amplitude[0]
    energy = pressure**2 * swath.cross_section[origins.straight, origins.cut] * origins.lost
    grazing = origins.grazing[origins.direct]
    for occluder_row, name in occluder_names.items():
        occluded = np.flatnonzero(origins.occluder_row == occluder_row)
        if not len(occluded):
            continue
        key = name, HIDDEN
        shape = 1, grid.sample_count + lead + tail, MOMENTS
        bins = buffer.bins.setdefault(key, np.zeros(shape, np.float32))[0]
        deposit_positions(
            DelayCells(bins, grid.start - lead / grid.sample_rate, grid.sample_rate),
            2 * legs.delay[0, occluded], energy[occluded], points[occluded], origins.position, grazing, grazing,
            accumulator.ping_geometry.receive_position,
        )  # fmt: skip
