"""Echoes of points as any element would record them: the sum written down in float64, a pulse and a delay each."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Envelope = Callable[[Floats], NDArray[np.generic]]


def bell(width: float) -> Envelope:
    """A Gaussian pulse about zero whose spectrum is -3 dB down (power) `width` apart [Hz]."""
    return lambda t: np.exp(-((np.pi * width * t) ** 2) / (2 * np.log(2)))


def two_way(points: Floats, transmit: Floats, receive: Floats, speed: float = 1500.0) -> Floats:
    """Delay from one place by way of points (n, 3) to receivers (m, 3) [s], shape (n, m)."""
    out = np.linalg.norm(points - transmit, axis=-1)[:, None]
    return (out + np.linalg.norm(points[:, None] - receive, axis=-1)) / speed


def received(
    time: Floats, delay: Floats, frequency: float, pulse: Envelope, amplitude: Floats | complex = 1.0
) -> NDArray[np.complex64]:
    """Complex baseband (m, time) of echoes with delays (n, m) and amplitudes (n,)."""
    strength = np.broadcast_to(np.asarray(amplitude, complex), delay.shape[:1])
    total = np.zeros((delay.shape[1], time.size), complex)
    for weight, row in zip(strength, delay, strict=True):
        turn = np.exp(-2j * np.pi * ((frequency * row) % 1))
        total += weight * turn[:, None] * pulse(time - row[:, None])
    return total.astype(np.complex64)


def decibels(ratio: NDArray[np.generic] | float) -> Floats:
    """20 log10 of a modulus [dB]."""
    return np.asarray(20 * np.log10(np.abs(ratio)))


def speckle(
    time: Floats, delay: Floats, frequency: float, pulse: Envelope, amplitude: NDArray[np.generic], half: float
) -> NDArray[np.complex64]:
    """As `received`, for many echoes of a pulse that is over `half` seconds before and after its middle."""
    rate = 1 / (time[1] - time[0])
    reach = np.arange(-int(np.ceil(half * rate)), int(np.ceil(half * rate)) + 1)
    total = np.zeros((delay.shape[1], time.size), complex)
    for row, late in zip(total, delay.T, strict=True):
        at = np.round((late - time[0]) * rate).astype(int)[:, None] + reach
        inside = (at >= 0) & (at < time.size)
        safe = np.where(inside, at, 0)
        turn = amplitude * np.exp(-2j * np.pi * ((frequency * late) % 1))
        np.add.at(row, safe, np.where(inside, turn[:, None] * pulse(time[safe] - late[:, None]), 0))
    return total.astype(np.complex64)
