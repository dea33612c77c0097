"""Pulses of a test: a hyperbolic sweep, and one of a form that no format has a code for."""

import numpy as np

from insonify.sonar.modulation import Floats, Modulation, PulseNumbers


class HyperbolicSweep(Modulation):
    """Sweep whose period is linear in time."""

    form = "hyperbolic sweep"

    def phase(self, numbers: PulseNumbers, time: Floats) -> Floats:
        """Phase about the centre frequency [rad]: integral of 1 / (period at the start + rate of the period * t)."""
        low, high = numbers.frequency - numbers.bandwidth / 2, numbers.frequency + numbers.bandwidth / 2
        rate = (1 / high - 1 / low) / numbers.duration
        elapsed = time + numbers.duration / 2
        return 2 * np.pi * (np.log1p(rate * low * elapsed) / rate - numbers.frequency * elapsed)


class Coded(HyperbolicSweep):
    """The same, of another form."""

    form = "other"
