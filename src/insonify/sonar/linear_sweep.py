"""Linear frequency sweep (LFM), with its spectrum in closed form."""

import numpy as np

from insonify.sonar.modulation import Complexes, Floats, Modulation, PulseNumbers


class LinearSweep(Modulation):
    """Sweep of constant rate, with zero phase at mid-pulse and frequency offsets from -B/2 to B/2.

    Source: completing the square in the Fourier integral; C and S as in Abramowitz & Stegun (1964), 7.3.
    """

    form = "linear sweep"

    def phase(self, numbers: PulseNumbers, time: Floats) -> Floats:
        """Phase about the centre frequency, even about mid-pulse [rad]."""
        return np.asarray(np.pi * (numbers.bandwidth / numbers.duration) * time**2)

    def spectrum(self, numbers: PulseNumbers, offset: Floats) -> Complexes:
        """Fourier transform about the middle [s]: a few Fresnel integrals; by quadrature where these lose digits."""
        if _closed_form_holds(numbers, offset):
            return _closed_spectrum(numbers, offset)
        return super().spectrum(numbers, offset)


def _closed_form_holds(numbers: PulseNumbers, f: Floats) -> bool:
    """Return True if double precision resolves the phases of the closed form."""
    cycles = np.max(np.abs(f), initial=0.0) * numbers.duration + 1 / max(numbers.tapered_fraction, 1e-3)
    product = numbers.bandwidth * numbers.duration
    return bool(product >= 1 or (product >= 1e-2 and cycles**2 < 1e5 * product))


def _closed_spectrum(numbers: PulseNumbers, f: Floats) -> Complexes:
    """Spectrum [s] of a rising sweep about its middle at offsets f [Hz], in closed form: flat part and both tapers."""
    rate, half = numbers.bandwidth / numbers.duration, numbers.duration / 2
    rise = numbers.tapered_fraction * half
    total = _chirp_integral(rate, f, rise - half, half - rise)
    if rise == 0:
        return total
    phasor, shift = np.exp(1j * np.pi * half / rise), 1 / (2 * rise)
    # the chirp is even in time, so the falling end at f is the rising end at -f
    for g in (f, -f):
        ends = [_chirp_integral(rate, g + s, -half, rise - half) for s in (0.0, -shift, shift)]
        total = total + 0.5 * ends[0] - 0.25 * (phasor * ends[1] + np.conj(phasor) * ends[2])
    return total


def _chirp_integral(rate: float, f: Floats, start: float, stop: float) -> Complexes:
    """Integral of exp(j pi rate s^2 - j 2 pi f s) ds from start to stop [s], with rate in Hz/s and f in Hz."""
    from scipy.special import fresnel

    scale = np.sqrt(2 * rate)
    sine_stop, cosine_stop = fresnel(scale * (stop - f / rate))
    sine_start, cosine_start = fresnel(scale * (start - f / rate))
    span = (cosine_stop - cosine_start) + 1j * (sine_stop - sine_start)
    return np.asarray(np.exp(-1j * np.pi * f**2 / rate) * span / scale)
