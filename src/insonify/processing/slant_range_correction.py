"""Slant range correction: from slant range to distance on a flat seabed at a given altitude."""

import numpy as np
from numpy.typing import NDArray

from insonify.processing.bin_overlap import sums_between_edges
from insonify.units import intensity_ratio, level_db

Floats = NDArray[np.float64]

MIN_RISE_DB = 12.0
"""Rise of the first bottom return above the water column [dB]."""
MAX_DROP_DB = 50.0
"""Level of the first bottom return re the strongest sample, where the water column is silent, at least [dB]."""
NEIGHBOURS = 9
"""Pings of the running median of altitude, which removes single fish and gaps."""


def first_bottom_return(level: Floats, slant_range: Floats, *, blanked_range: float = 0.5) -> Floats:
    """Altitude of the sonar: slant range of the first bottom return.

    Args:
        level: Levels of one or more channels [dB], shape (pings, samples), or (pings, channels, samples).
        slant_range: Slant range of each sample [m], shape (samples,).
        blanked_range: Slant range masked by the transmission [m].

    Returns:
        Altitude [m], shape (pings,): the median over neighbouring pings; NaN where no ping has a bottom return.

    Where the sea surface is nearer than the seabed, and echoes, it is detected instead: give the altitude then.

    Example:
        >>> slant_range = np.arange(0.5, 60.0, 0.5)
        >>> level = np.where(slant_range < 12, 40.0, 90.0)  # a quiet water column, then the seabed
        >>> first_bottom_return(np.tile(level, (3, 1)), slant_range).tolist()
        [12.0, 12.0, 12.0]
    """
    power = intensity_ratio(np.where(np.isfinite(level), level, -300.0))
    power = power.reshape(len(power), -1, power.shape[-1]).sum(axis=1)[:, slant_range >= blanked_range]
    unblanked_range = slant_range[slant_range >= blanked_range]
    rise_range = np.array([_rise(row, unblanked_range) for row in power])
    if not np.isfinite(rise_range).any():
        return rise_range
    half = NEIGHBOURS // 2
    padded = np.pad(rise_range, half, constant_values=np.nan)
    rows = np.lib.stride_tricks.sliding_window_view(padded, NEIGHBOURS)
    has_rise = np.isfinite(rows).any(axis=1)
    altitude = np.full(len(rise_range), np.nan)
    altitude[has_rise] = np.nanmedian(rows[has_rise], axis=1)
    return altitude


def _rise(power: Floats, slant_range: Floats) -> float:
    """Slant range at which one ping first rises out of its water column [m]; NaN if never."""
    if not power.size or power.max() <= 0:
        return float("nan")
    strongest = int(np.argmax(power))
    column = power[: max(strongest // 2, 1)]
    floor = max(float(np.median(column)) * 10 ** (MIN_RISE_DB / 10), power.max() * 10 ** (-MAX_DROP_DB / 10))
    if floor >= power.max():
        return float("nan")
    return float(slant_range[int(np.argmax(power >= floor))])


def slant_to_ground_range(level: Floats, slant_range: Floats, altitude: Floats, ground_range: Floats) -> Floats:
    """Levels by distance on the ground.

    Each ground cell holds the mean power of the slant ranges that it spans, so no echo is lost where cells
    are larger than samples, and none is invented where they are smaller.

    Args:
        level: Levels [dB], shape (pings, samples).
        slant_range: Slant range of each sample, evenly spaced [m], shape (samples,).
        altitude: Height above the seabed [m], shape (pings,).
        ground_range: Middles of the ground cells, evenly spaced [m], shape (cells,).

    Returns:
        Levels [dB], shape (pings, cells); NaN beyond the recording, or where it has NaN.

    Example:
        >>> slant_range = np.arange(0.5, 60.0)
        >>> level = np.where(abs(slant_range - 50) < 1, 80.0, 60.0)  # an echo at 50 m, under a sonar 30 m above the bed
        >>> cells = np.array([30.0, 35.0, 40.0, 45.0])
        >>> slant_to_ground_range(level[None], slant_range, np.array([30.0]), cells).round().tolist()  # it lies at 40 m
        [[60.0, 60.0, 77.0, 60.0]]
    """
    out = np.full((len(level), len(ground_range)), np.nan)
    for row in range(len(level)):
        if np.isfinite(altitude[row]) and not np.isnan(level[row]).all():
            out[row] = _means(
                intensity_ratio(level[row]), ground_cell_edges(slant_range, float(altitude[row]), ground_range)
            )
    return level_db(out)


def ground_cell_edges(slant_range: Floats, altitude: float, ground_range: Floats) -> Floats:
    """Edges of ground cells in a recording, in units of samples.

    Args:
        slant_range: Slant range of each sample, evenly spaced [m], shape (samples,).
        altitude: Height above the seabed [m]; 0 for cells of slant range.
        ground_range: Middles of the ground cells, evenly spaced [m], shape (cells,).

    Returns:
        Edges of the cells, shape (cells + 1,): sample k extends from k to k + 1; there is no data outside of 0 to
        samples.

    Example:
        >>> ground_cell_edges(np.arange(0.5, 60.0), 30.0, np.array([38.0, 42.0])).round(1).tolist()  # about 40 m: 50 m
        [46.9, 50.0, 53.3]
    """
    step, cell = slant_range[1] - slant_range[0], ground_range[1] - ground_range[0]
    edges = np.maximum(np.concatenate([ground_range - cell / 2, [ground_range[-1] + cell / 2]]), 0)
    # rounding must not move an edge just outside of the recording
    return np.asarray(np.round((np.hypot(edges, altitude) - slant_range[0]) / step + 0.5, 9))


def _means(power: Floats, edges: Floats) -> Floats:
    """Mean of samples between edges in units of samples; NaN beyond the first or the last."""
    inside = (edges[:-1] >= 0) & (edges[1:] <= len(power))
    return np.where(inside, sums_between_edges(power, edges) / np.diff(edges), np.nan)
