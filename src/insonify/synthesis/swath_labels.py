"""Labels of the seabed in the fast path: energies, places and missing echoes of the very points that are recorded."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.records.reverberation_samples import Origins, ReverberationSamples
from insonify.synthesis._label_kernel import MOMENTS
from insonify.synthesis._place_kernel import lay_energies, lay_places
from insonify.synthesis.incoherent import IncoherentAccumulator, IntensityBuffer
from insonify.synthesis.label_series import ringing
from insonify.synthesis.label_sums import ALL, HIDDEN, LabelBuffer
from insonify.synthesis.level_curves import pair_name
from insonify.units import amplitude_ratio

Singles = NDArray[np.float32]
OWNER = "seabed"


def add_swath(
    buffer: LabelBuffer, whole: IncoherentAccumulator, swath: ReverberationSamples, occluder_names: Mapping[int, str]
) -> None:
    """Add the ground of a part of a ping to what labels are made of.

    Args:
        buffer: Added to in place.
        whole: The expectation that is taken apart.
        swath: The ground, with the origins of its points.
        occluder_names: Owner of each occluder.

    Raises:
        ValueError: The swath has no origins.
    """
    if swath.origins is None:
        raise ValueError("ReverberationSamples.origins is None; gather the swath with labelled=True")
    sent, heard = whole.swath_sizes(swath)
    energies = buffer.curves.setdefault((OWNER, ALL), whole.empty())
    whole.add_swath(energies, swath, sent, heard)
    if len(swath.interference_ranges):
        before = energies.cells.copy()
        whole.add_fringes(energies, swath, sent, heard)
        common = buffer.common.setdefault(
            OWNER, IntensityBuffer(np.zeros_like(before), np.zeros_like(energies.intensity))
        )
        common.cells[...] += energies.cells - before
    _add_places(buffer, whole, swath, swath.origins, sent, heard)
    if len(swath.origins.cut):
        _add_hidden(buffer, whole, swath, swath.origins, occluder_names)


def _add_places(
    buffer: LabelBuffer, whole: IncoherentAccumulator, swath: ReverberationSamples, origins: Origins, sent: Singles,
    heard: Singles
) -> None:  # fmt: skip
    """Add energy and places of every pair to its bins."""
    grid, (lead, tail) = whole.grid, ringing(whole)
    share, mean = whole.replica_jitter.interference_factor, whole.replica_jitter.mean_energy
    bins = np.zeros((len(swath.pair), grid.sample_count + lead + tail, MOMENTS))
    lay_places(
        swath.delay, sent, heard, swath.pair, swath.count, swath.rows, swath.cross_section,
        float(amplitude_ratio(whole.ping_geometry.source_level_db)), share, mean - share, bins,
        grid.start - lead / grid.sample_rate, grid.sample_rate, origins.position, origins.grazing,
        whole.ping_geometry.receive_position,
    )  # fmt: skip
    for (i, j), own in zip(swath.pair.tolist(), bins, strict=True):
        key = OWNER, pair_name(origins.families[i], origins.families[j])
        buffer.bins[key] = buffer.bins[key] + own[None] if key in buffer.bins else own[None]


def _add_hidden(
    buffer: LabelBuffer, whole: IncoherentAccumulator, swath: ReverberationSamples, origins: Origins,
    occluder_names: Mapping[int, str]
) -> None:  # fmt: skip
    """Add what the direct legs that something cuts would have brought, to the bins of what cuts them."""
    grid, (lead, tail), row = whole.grid, ringing(whole), slice(origins.direct, origins.direct + 1)
    points = swath.rows[origins.straight, origins.cut]
    legs = replace(
        swath, delay=np.ascontiguousarray(swath.delay[row, points]), amplitude=origins.free[None],
        departure=np.ascontiguousarray(swath.departure[row][:, :, points]),
    )  # fmt: skip
    sent, heard = whole.swath_sizes(legs)
    level = float(amplitude_ratio(whole.ping_geometry.source_level_db))
    both = level * sent[0].astype(float) * heard[0]
    energy = both**2 * swath.cross_section[origins.straight, origins.cut] * origins.lost
    grazing = origins.grazing[origins.direct]
    for occluder_row in sorted(set(origins.occluder_row.tolist())):
        mine = origins.occluder_row == occluder_row
        key = occluder_names[occluder_row], HIDDEN
        shape = 1, grid.sample_count + lead + tail, MOMENTS
        lay_energies(
            buffer.bins.setdefault(key, np.zeros(shape))[0], grid.start - lead / grid.sample_rate, grid.sample_rate,
            2 * legs.delay[0, mine], energy[mine], points[mine], origins.position, grazing, grazing,
            whole.ping_geometry.receive_position,
        )  # fmt: skip
