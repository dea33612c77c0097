"""From slant range to distance on the ground: where a level bed is met that lies an altitude below."""

import numpy as np
from numpy.typing import NDArray

from insonify.processing.bin_overlap import sums_between_edges
from insonify.units import intensity_ratio, level_db

Floats = NDArray[np.float64]

RISE = 12.0
"""How far the first return stands above the water column [dB]."""
DEPTH = 50.0
"""How far below the loudest sample the first return may be, where the water column is silent [dB]."""
NEIGHBOURS = 9
"""Pings whose median altitude counts, so that no single fish or gap is taken for the bed."""


def first_bottom_return(level: Floats, slant_range: Floats, *, blanked_range: float = 0.5) -> Floats:
    """Altitude of the sonar: slant range of the first echo of the bed, as the recording shows it.

    Args:
        level: Levels of one or more channels [dB], shape (pings, samples), or (pings, channels, samples).
        slant_range: Slant range of each sample [m], shape (samples,).
        blanked_range: Slant range in which the sonar hears itself [m].

    Returns:
        Altitude [m], shape (pings,): the median of each ping and its neighbours; NaN where no ping shows a bed.

    Where the sea surface is nearer than the bed, and echoes, it is taken for the bed: give the altitude instead.
    """
    power = intensity_ratio(np.where(np.isfinite(level), level, -300.0))
    power = power.reshape(len(power), -1, power.shape[-1]).sum(axis=1)[:, slant_range >= blanked_range]
    far = slant_range[slant_range >= blanked_range]
    found = np.array([_rise(row, far) for row in power])
    if not np.isfinite(found).any():
        return found
    half = NEIGHBOURS // 2
    padded = np.pad(found, half, constant_values=np.nan)
    rows = np.lib.stride_tricks.sliding_window_view(padded, NEIGHBOURS)
    some = np.isfinite(rows).any(axis=1)
    altitude = np.full(len(found), np.nan)
    altitude[some] = np.nanmedian(rows[some], axis=1)
    return altitude


def _rise(power: Floats, slant_range: Floats) -> float:
    """Slant range at which one ping first rises out of its water column [m]; NaN where it does not."""
    if not power.size or power.max() <= 0:
        return float("nan")
    loudest = int(np.argmax(power))
    column = power[: max(loudest // 2, 1)]
    floor = max(float(np.median(column)) * 10 ** (RISE / 10), power.max() * 10 ** (-DEPTH / 10))
    if floor >= power.max():
        return float("nan")
    return float(slant_range[int(np.argmax(power >= floor))])


def slant_to_ground_range(level: Floats, slant_range: Floats, altitude: Floats, ground_range: Floats) -> Floats:
    """Levels by distance on the ground.

    Each cell of the ground holds the mean power of the slant ranges that it spans, so no echo is lost where cells
    are wider than samples, and none is made up where they are narrower.

    Args:
        level: Levels [dB], shape (pings, samples).
        slant_range: Slant range of each sample, evenly spaced [m], shape (samples,).
        altitude: Height above the bed [m], shape (pings,).
        ground_range: Distances on the ground, evenly spaced, middle of each cell [m], shape (cells,).

    Returns:
        Levels [dB], shape (pings, cells); NaN where the recording does not reach, or is not there.
    """
    out = np.full((len(level), len(ground_range)), np.nan)
    for row in range(len(level)):
        if np.isfinite(altitude[row]) and not np.isnan(level[row]).all():
            out[row] = _means(
                intensity_ratio(level[row]), ground_cell_edges(slant_range, float(altitude[row]), ground_range)
            )
    return level_db(out)


def ground_cell_edges(slant_range: Floats, altitude: float, ground_range: Floats) -> Floats:
    """Where cells of the ground begin and end in a recording, counted in samples.

    Args:
        slant_range: Slant range of each sample, evenly spaced [m], shape (samples,).
        altitude: Height above the bed [m]; 0 where the cells are of slant range themselves.
        ground_range: Distances on the ground, evenly spaced, middle of each cell [m], shape (cells,).

    Returns:
        Edges of the cells, shape (cells + 1,): sample k lies from k to k + 1; outside of 0 to samples is nothing.
    """
    step, cell = slant_range[1] - slant_range[0], ground_range[1] - ground_range[0]
    edges = np.maximum(np.concatenate([ground_range - cell / 2, [ground_range[-1] + cell / 2]]), 0)
    # rounding must not put an edge just outside of the recording
    return np.asarray(np.round((np.hypot(edges, altitude) - slant_range[0]) / step + 0.5, 9))


def _means(power: Floats, edges: Floats) -> Floats:
    """Mean of samples between edges counted in samples; NaN beyond the first or the last."""
    inside = (edges[:-1] >= 0) & (edges[1:] <= len(power))
    return np.where(inside, sums_between_edges(power, edges) / np.diff(edges), np.nan)
