"""Modulation of a pulse: its phase about the centre frequency, from which envelope and spectrum follow.

A kind of pulse is a subclass of `Modulation`. Its taper, direction of sweep and energy are those of every pulse.
"""

from abc import ABC, abstractmethod
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Complexes = NDArray[np.complex128]
Floats = NDArray[np.float64]
Form = Literal["cw", "linear sweep", "hyperbolic sweep", "other"]
"""Form of a pulse, of which formats of other programs have codes."""


class PulseNumbers(NamedTuple):
    """Numbers of a pulse on which its modulation depends."""

    frequency: float
    """Centre frequency [Hz]."""
    duration: float
    """Duration [s]."""
    bandwidth: float
    """Width of the sweep [Hz]; 0 without one."""
    tapered_fraction: float
    """Fraction of the duration in which the pulse rises or falls, both ends together [1]."""


class Modulation(ABC):
    """Modulation of a pulse of constant amplitude but for its taper."""

    form: ClassVar[Form]
    """Form that files of other programs state."""
    is_sweep: ClassVar[bool] = True
    """True: the width of the band is the pulse's `bandwidth`; False: the band follows from the duration."""

    @abstractmethod
    def phase(self, numbers: PulseNumbers, time: Floats) -> Floats:
        """Phase of a rising pulse about its centre frequency [rad].

        The phase of a falling one is minus that at the opposite time.

        Args:
            numbers: Numbers of the pulse.
            time: Time since the middle of the pulse [s], any shape.
        """

    def spectrum(self, numbers: PulseNumbers, offset: Floats) -> Complexes:
        """Fourier transform of a rising pulse about its middle [s], by quadrature in panels of at most one cycle.

        Args:
            numbers: Numbers of the pulse.
            offset: Frequency relative to the centre [Hz], any shape.
        """
        half = numbers.duration / 2
        corner = half - numbers.tapered_fraction * half
        cycles = int((np.max(np.abs(offset), initial=0.0) + numbers.bandwidth) * numbers.duration) + 1
        knots = np.unique(np.concatenate([np.linspace(-half, half, cycles + 1), [-corner, corner]]))
        node, weight = np.polynomial.legendre.leggauss(16)
        time = (knots[:-1, None] + np.diff(knots)[:, None] * (node + 1) / 2).ravel()
        weighted_envelope = (np.diff(knots)[:, None] * weight / 2).ravel() * modulated_envelope(
            self, numbers, time + half
        )
        values = np.concatenate(
            [np.exp(-2j * np.pi * np.outer(chunk, time)) @ weighted_envelope for chunk in _chunks(offset.ravel())]
        )
        return np.asarray(values.reshape(offset.shape))


def modulated_envelope(
    modulation: Modulation, numbers: PulseNumbers, time: Floats, *, rising: bool = True
) -> Complexes:
    """Envelope of a pulse [1], zero outside 0..duration.

    Args:
        modulation: Modulation of the pulse.
        numbers: Numbers of the pulse.
        time: Time since the start of transmission [s], any shape.
        rising: False: a falling sweep.
    """
    duration = numbers.duration
    rise = numbers.tapered_fraction * duration / 2
    inside = (time >= 0) & (time <= duration)
    edge = np.clip(np.minimum(time, duration - time), 0, None)
    window = np.where(edge < rise, np.sin(np.pi * edge / (2 * rise)) ** 2 if rise > 0 else 1.0, 1.0)
    since_middle = np.where(inside, time - duration / 2, 0.0)
    phase = modulation.phase(numbers, since_middle) if rising else -modulation.phase(numbers, -since_middle)
    return np.asarray(np.where(inside, window, 0.0) * np.exp(1j * phase))


def _chunks(f: Floats) -> list[Floats]:
    """Frequencies in consecutive parts of about 512, which bound the memory of a quadrature."""
    return np.array_split(f, max(1, f.size // 512))
