"""Point echoes received by hydrophones of a moving platform, summed in float64 from the definition of a moving source.

The sound that an element receives at time t left the scatterer at t - |rx(t) - image| / c, and the transmitter at the
time te that solves te + |tx(te) - image| / c = that. What was sent at te is what is received. Shares no code with the
synthesis but the pulse's envelope and the receiver's band.
"""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from insonify.scenario.scenario import Scenario
from insonify.sonar.pulse import envelope
from insonify.sonar.receiver import response

SPEED, CARRIER, FEW = 1500.0, 100e3, 100
Path = Callable[[np.ndarray], np.ndarray]
"""Place [m], shape (n, 3), at times after the start of the ping [s], shape (n,)."""


def mirrored(place: np.ndarray, family: str) -> np.ndarray:
    """The image of a place in the surface at depth 0, or itself."""
    return np.asarray(place) * ([1, 1, -1] if family == "S" else [1, 1, 1])


def echo(sonar, transmit: Path, receive: Path, place, time, *, out="D", back="D") -> np.ndarray:
    """Envelope of one echo of a target of 0 dB about the carrier [uPa], with a source of 200 dB, before any filter."""
    sign = (-1) ** ((out == "S") + (back == "S"))
    sent = np.linspace(-2e-3, sonar.pulse.duration + 5e-3, 161)
    arrives = sent + np.linalg.norm(transmit(sent) - mirrored(place, out), axis=1) / SPEED
    found, hydrophone = np.zeros(len(time), complex), np.broadcast_to(receive(time), (len(time), 3))

    def leaves(rows: slice) -> np.ndarray:
        return time[rows] - np.linalg.norm(hydrophone[rows] - mirrored(place, back), axis=1) / SPEED

    # it grows with time, so that all that is received lies between two of a few samples
    first, last = np.searchsorted(leaves(slice(None, None, FEW)), arrives[[0, -1]])
    rows = slice(FEW * max(first - 1, 0), FEW * last)
    left, time = leaves(rows), time[rows]
    inside = (left > arrives[0]) & (left < arrives[-1])
    if not inside.any():
        return found
    emitted = np.where(inside, CubicSpline(arrives, sent)(np.clip(left, arrives[0], arrives[-1])), -1.0)
    middle = int(np.argmax(emitted > sonar.pulse.duration / 2))
    spreading = SPEED * (left[middle] - emitted[middle]) * SPEED * (time[middle] - left[middle])
    phase = np.exp(2j * np.pi * CARRIER * np.where(inside, emitted - time, 0.0))
    found[rows] = np.where(inside, 1e10 * sign / spreading * envelope(sonar.pulse, emitted) * phase, 0)
    return found


def recorded(raw: np.ndarray, scenario: Scenario, rate: float) -> np.ndarray:
    """What the receiver's band leaves, at the recording's own times, shape (channels, samples)."""
    receiver = scenario.sonar.receiver
    offset = np.fft.fftfreq(raw.shape[1], 1 / rate)
    kept = np.fft.ifft(np.fft.fft(raw, axis=1) * response(receiver, offset), axis=1)
    step = round(rate / receiver.sample_rate)
    start, stop = (round(edge * receiver.sample_rate) for edge in scenario.track.window)
    return kept[:, ::step][:, start:stop]
