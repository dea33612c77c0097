"""Error of a coherent ping: its difference from the float64 sum over the arrivals of a part of it."""

import numpy as np
from numpy.typing import NDArray

from insonify.scenario.scenario import Scenario
from insonify.simulator import Simulator, arrivals, build_simulator, simulate
from insonify.synthesis.arrival_weights import arrival_weights

LENGTH, MARGIN = 1e-3, 10e-3
"""Length of the part that is compared, and time before and after it of which arrivals are summed [s]. The response of
the receiver to an echo 60 dB stronger, as that from below the sonar, lasts longer: one before that time is an error of
1e-5."""
GROUP = 4096
"""Number of arrivals that are summed at once."""


def direct_sum_error(scenario: Scenario, ping: int, channels: tuple[int, ...], start: float) -> float:
    """Root mean square of the difference between a simulated ping and the sum over its arrivals, re that of the sum.

    The spectrum of the pulse is evaluated for the Doppler factor of each arrival, and its phase at each frequency in
    double precision: no grid of delays, no interpolation between Doppler factors, frequencies or elements. Delays,
    amplitudes and beams are those of the arrivals, which the ping shares.

    Args:
        scenario: The scenario, of coherent pressures.
        ping: Number of the ping.
        channels: Channels that are compared.
        start: Start of the part that is compared [s].

    Returns:
        Relative rms difference over all channels [1].
    """
    recorded = simulate(scenario, pings=ping)["pressure"].isel(ping=0)
    time = recorded["time"].values
    inside = (time >= start) & (time < start + LENGTH)
    simulator, errors, powers = build_simulator(scenario), 0.0, 0.0
    for channel in channels:
        series = _sum_of_arrivals(simulator, ping, channel, time[inside])
        pressure = recorded.isel(channel=channel).values[inside]
        errors += float(np.sum(np.abs(pressure - series) ** 2))
        powers += float(np.sum(np.abs(series) ** 2))
    return float(np.sqrt(errors / powers))


def _sum_of_arrivals(
    simulator: Simulator, ping: int, channel: int, time: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Complex envelope [uPa] of one channel at evenly spaced times [s], from its arrivals, shape (samples,)."""
    first, last = float(time[0]) - MARGIN, float(time[-1]) + MARGIN
    found = arrivals(simulator.scenario, ping, window=(max(first, 0.0), last), channel=channel)
    weight = arrival_weights(found, simulator.ping_geometry(ping, channel=channel), channel)
    rate = 1.0 / float(np.median(np.diff(time)))
    count = int(np.ceil((last - first) * rate)) * 2
    offset = np.fft.fftfreq(count, 1 / rate)
    series_spectrum = np.zeros(count, np.complex128)
    for begin in range(0, len(found), GROUP):
        part = slice(begin, begin + GROUP)
        phase = np.exp(-2j * np.pi * offset[:, None] * (found.delay[part] - time[0]))
        spectra = np.array([simulator.pulse.spectrum(offset, float(factor)) for factor in found.doppler[part]])
        series_spectrum += np.einsum("kn,nk,n->k", phase, spectra, weight[part])
    return np.asarray(np.fft.ifft(series_spectrum)[: time.size] * rate)
