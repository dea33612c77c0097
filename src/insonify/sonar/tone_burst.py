"""Tone burst (CW): a pulse of one frequency."""

import numpy as np

from insonify.sonar.modulation import Complexes, Floats, Modulation, PulseNumbers


class ToneBurst(Modulation):
    """Pulse of one frequency, whose band follows from its duration."""

    form = "cw"
    is_sweep = False

    def phase(self, numbers: PulseNumbers, time: Floats) -> Floats:
        """Phase about the centre frequency, 0 [rad]."""
        return np.zeros_like(time)

    def spectrum(self, numbers: PulseNumbers, offset: Floats) -> Complexes:
        """Fourier transform of a Tukey window about its middle, a rectangle convolved with a cosine lobe [s]."""
        rise = numbers.tapered_fraction * numbers.duration / 2
        flat = numbers.duration - rise
        x = np.abs(2 * offset * rise)
        # cos(pi x / 2) / (1 - x^2), in a form without the removable singularity at x = 1
        lobe = np.pi / 2 * np.sinc((x - 1) / 2) / (1 + x)
        return np.asarray(flat * np.sinc(offset * flat) * lobe)
