"""Labels of the seabed in the fast path: energies, places and missing echoes of the very points that are recorded."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.records.swath import Origins, Swath
from insonify.synthesis._label_kernel import MOMENTS
from insonify.synthesis._place_kernel import lay_energies, lay_places
from insonify.synthesis.incoherent import Energies, Incoherent
from insonify.synthesis.label_series import ringing
from insonify.synthesis.label_sums import ALL, HIDDEN, Kept
from insonify.synthesis.levels import pair_name
from insonify.units import amplitude_ratio

Singles = NDArray[np.float32]
OWNER = "seabed"


def add_swath(kept: Kept, whole: Incoherent, swath: Swath, cutters: Mapping[int, str]) -> None:
    """Add the ground of a part of a ping to what labels are made of.

    Args:
        kept: Added to in place.
        whole: The expectation that is taken apart.
        swath: The ground, with the origins of its points.
        cutters: Owner of each occluder.

    Raises:
        ValueError: The swath has no origins.
    """
    if swath.origins is None:
        raise ValueError("Swath.origins is None; gather the swath with labelled=True")
    sent, heard = whole.swath_sizes(swath)
    energies = kept.curves.setdefault((OWNER, ALL), whole.silence())
    whole.add_swath(energies, swath, sent, heard)
    if len(swath.meeting):
        before = energies.cells.copy()
        whole.add_fringes(energies, swath, sent, heard)
        common = kept.common.setdefault(OWNER, Energies(np.zeros_like(before), np.zeros_like(energies.intensity)))
        common.cells[...] += energies.cells - before
    _add_places(kept, whole, swath, swath.origins, sent, heard)
    if len(swath.origins.cut):
        _add_hidden(kept, whole, swath, swath.origins, cutters)


def _add_places(
    kept: Kept, whole: Incoherent, swath: Swath, origins: Origins, sent: Singles, heard: Singles
) -> None:  # fmt: skip
    """Add energy and places of every pair to its bins."""
    grid, (lead, tail) = whole.grid, ringing(whole)
    share, mean = whole.perturbation.kept_interference, whole.perturbation.mean_energy
    bins = np.zeros((len(swath.pair), grid.count + lead + tail, MOMENTS))
    lay_places(
        swath.delay, sent, heard, swath.pair, swath.count, swath.rows, swath.section,
        float(amplitude_ratio(whole.stance.source_level_db)), share, mean - share, bins,
        grid.start - lead / grid.sample_rate, grid.sample_rate, origins.position, origins.grazing,
        whole.stance.receive_place,
    )  # fmt: skip
    for (i, j), own in zip(swath.pair.tolist(), bins, strict=True):
        key = OWNER, pair_name(origins.families[i], origins.families[j])
        kept.bins[key] = kept.bins[key] + own[None] if key in kept.bins else own[None]


def _add_hidden(
    kept: Kept, whole: Incoherent, swath: Swath, origins: Origins, cutters: Mapping[int, str]
) -> None:  # fmt: skip
    """Add what the direct legs that something cuts would have brought, to the bins of what cuts them."""
    grid, (lead, tail), row = whole.grid, ringing(whole), slice(origins.direct, origins.direct + 1)
    points = swath.rows[origins.straight, origins.cut]
    legs = replace(
        swath, delay=np.ascontiguousarray(swath.delay[row, points]), amplitude=origins.free[None],
        departure=np.ascontiguousarray(swath.departure[row][:, :, points]),
    )  # fmt: skip
    sent, heard = whole.swath_sizes(legs)
    level = float(amplitude_ratio(whole.stance.source_level_db))
    both = level * sent[0].astype(float) * heard[0]
    energy = both**2 * swath.section[origins.straight, origins.cut] * origins.lost
    grazing = origins.grazing[origins.direct]
    for cutter in sorted(set(origins.cutter.tolist())):
        mine = origins.cutter == cutter
        key = cutters[cutter], HIDDEN
        shape = 1, grid.count + lead + tail, MOMENTS
        lay_energies(
            kept.bins.setdefault(key, np.zeros(shape))[0], grid.start - lead / grid.sample_rate, grid.sample_rate,
            2 * legs.delay[0, mine], energy[mine], points[mine], origins.position, grazing, grazing,
            whole.stance.receive_place,
        )  # fmt: skip
