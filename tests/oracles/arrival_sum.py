"""Coherent pressure of a list of arrivals, row by row: the sum that the accumulator makes block by block."""

import numpy as np
from numpy.typing import NDArray

from insonify.records.arrivals import Arrivals
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._gridding import deposit_pressure
from insonify.synthesis.arrival_weights import arrival_weights
from insonify.synthesis.time_grid import TimeGrid, convolve_waveforms
from insonify.synthesis.waveform_basis import WaveformBasis, start_delay, waveform_basis


def coherent_from_arrivals(
    arrivals: Arrivals,
    ping_geometry: PingGeometry,
    grid: TimeGrid,
    basis: WaveformBasis | None = None,
    *,
    channel: int | None = None,
) -> NDArray[np.complex64]:
    """Complex envelope of a list of arrivals, computed row by row.

    Args:
        arrivals: Paths of one ping.
        ping_geometry: The sonar at that ping.
        grid: Output times.
        basis: Waveforms of which received echoes are weighted sums; None: derived from the ping geometry.
        channel: Receive channel; None: all beams of the side, which share the arrivals.

    Returns:
        Complex envelope [uPa], shape (channels, samples).

    Raises:
        ValueError: No channel is given and the channels are elements, each with arrivals of its own.
    """
    if channel is None and ping_geometry.elements is not None:
        raise ValueError("channel is None, and each element has arrivals of its own. Give the channel of the arrivals.")
    waveforms = waveform_basis(ping_geometry) if basis is None else basis
    basis_weights = waveforms.weights(arrivals.doppler)
    channels = range(ping_geometry.channel_count) if channel is None else [channel]
    start_shift = start_delay(ping_geometry.pulse, arrivals.doppler)  # shapes are stretched about their middle
    delay, phase = arrivals.delay - start_shift, np.exp(2j * np.pi * ping_geometry.frequency * start_shift)
    cells = grid.cells(len(waveforms.band) * len(channels) * len(basis_weights)).reshape(
        len(waveforms.band), len(channels), len(basis_weights), -1
    )
    for band, row in np.ndindex(cells.shape[:2]):
        weight = arrival_weights(arrivals, ping_geometry, channels[row], band) * phase
        for cell, basis_weight in zip(cells[band, row], basis_weights, strict=True):
            deposit_pressure(cell, grid.first_time, grid.cell_rate, delay, (weight * basis_weight).astype(np.complex64))
    return convolve_waveforms(cells[..., None], grid, waveforms.grid_factors(ping_geometry.pulse, grid))
