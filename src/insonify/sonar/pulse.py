"""Transmitted pulse: a tone burst (CW) or a linear frequency sweep (LFM), with tapered ends.

A pulse is represented by its complex envelope about the centre frequency: one at the peak, zero
outside 0..duration. Everything that follows (gridding, matched filter, sonar equation) needs
only that envelope, its Fourier transform at any offset, and its energy.
"""

from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from insonify.model import Hertz, Model, Seconds, field_error
from insonify.validity import warn_outside

Complexes = NDArray[np.complex128]
Floats = NDArray[np.float64]


MIN_PLAUSIBLE_FREQUENCY = 2000.0
"""Frequency below which a frequency that does not fit its pulse was probably meant in kilohertz [Hz]."""


class Pulse(Model):
    """A burst of sound: a tone ("cw") or a linear sweep ("lfm"), with tapered ends."""

    kind: Literal["cw", "lfm"] = "cw"
    """Kind: a tone burst of one frequency (cw), or a linear frequency sweep (lfm)."""
    frequency: Hertz = Field(gt=0, le=10e6)
    """Centre frequency [Hz]."""
    duration: Seconds = Field(gt=0, le=10)
    """Duration of the transmission [s]."""
    bandwidth: Hertz = Field(default=0.0, ge=0)
    """Width of the sweep [Hz]; zero for a tone."""
    sweep: Literal["up", "down"] = "up"
    """Direction of the sweep."""
    taper: Literal["none", "tukey", "hann"] = "tukey"
    """Taper of both ends: none, over a fraction of the pulse (tukey), or over all of it (hann)."""
    taper_fraction: float = Field(default=0.1, ge=1e-3, le=1)
    """Fraction of the duration in which a Tukey pulse rises or falls, both ends together [1]."""

    @model_validator(mode="after")
    def _check_kind_and_bandwidth(self) -> Self:
        if self.kind == "cw" and self.bandwidth > 0:
            raise field_error(
                "bandwidth",
                _khz(self.bandwidth),
                "for a cw pulse, whose band follows from its duration. Leave bandwidth out, or set kind to lfm.",
            )
        if self.kind == "lfm" and self.bandwidth == 0:
            raise field_error("bandwidth", "0 Hz", "for an lfm pulse. Give the width of the sweep, such as 20 kHz.")
        return self

    @model_validator(mode="after")
    def _band_above_zero(self) -> Self:
        too_low = self.bandwidth >= 2 * self.frequency or (self.kind == "cw" and self.duration * self.frequency <= 1)
        if too_low and self.frequency <= MIN_PLAUSIBLE_FREQUENCY:
            raise field_error(
                "frequency",
                f"{self.frequency:g} Hz",
                "is too low for this pulse, whose band would reach below 0 Hz. "
                f"Did you mean {self.frequency:g} kHz? Write the unit.",
            )
        if self.kind == "lfm" and self.bandwidth >= 2 * self.frequency:
            raise field_error(
                "bandwidth",
                _khz(self.bandwidth),
                f"at a centre of {_khz(self.frequency)}; the band would reach below 0 Hz. "
                f"Give a bandwidth under {_khz(2 * self.frequency)}, or a higher centre frequency.",
            )
        if self.kind == "cw" and self.duration * self.frequency <= 1:
            raise field_error(
                "duration",
                f"{self.duration * 1e3:g} ms",
                f"at {_khz(self.frequency)}; the band, 2 / duration wide, would reach below 0 Hz. "
                f"Give a duration over {1e3 / self.frequency:g} ms, or a higher frequency.",
            )
        return self

    @model_validator(mode="after")
    def _high_frequency(self) -> Self:
        warn_outside("ray acoustics in shallow water", "the pulse's frequency", self.frequency / 1e3, 10, 1000, "kHz")
        return self


def envelope(pulse: Pulse, time: ArrayLike) -> Complexes:
    """Complex envelope of a pulse about its centre frequency [1].

    The Tukey window is flat in the middle and a half cosine at either end; Hann is its extreme.
    A sweep has zero phase at mid-pulse and frequency offsets from -B/2 to B/2 (or back).

    Args:
        pulse: The pulse.
        time: Time since the start of transmission [s], any shape.

    Returns:
        Envelope of unit peak [1], shape of time; zero outside 0..duration.

    Source: F. J. Harris (1978), Proc. IEEE 66(1), 51-83 (Tukey window); a linear sweep by definition.
    """
    t = np.asarray(time, dtype=float)
    rise = tapered_fraction(pulse) * pulse.duration / 2
    inside = (t >= 0) & (t <= pulse.duration)
    edge = np.clip(np.minimum(t, pulse.duration - t), 0, None)
    window = np.where(edge < rise, np.sin(np.pi * edge / (2 * rise)) ** 2 if rise > 0 else 1.0, 1.0)
    phase = np.pi * _sweep_rate(pulse) * np.where(inside, t - pulse.duration / 2, 0.0) ** 2
    return np.asarray(np.where(inside, window, 0.0) * np.exp(1j * phase))


def spectrum(pulse: Pulse, offset: ArrayLike) -> Complexes:
    """Fourier transform of the envelope, integral of envelope(t) exp(-j 2 pi f t) dt [s].

    Closed forms: a Tukey window is a rectangle convolved with a cosine lobe; a sweep under it is
    a few Fresnel integrals. Sweeps much shorter than one cycle of bandwidth times duration are
    integrated numerically, since the Fresnel form loses digits there.

    Args:
        pulse: The pulse.
        offset: Frequency relative to the centre [Hz], any shape.

    Returns:
        Spectrum [s], shape of offset, within 1e-9 of its peak.

    Source: completing the square in the Fourier integral; C and S as in Abramowitz & Stegun (1964), 7.3.
    """
    f = np.asarray(offset, dtype=float)
    if pulse.kind == "cw":
        return _window_spectrum(pulse, f)
    centred = _sweep_spectrum_closed(pulse, f) if _closed_form_holds(pulse, f) else _sweep_spectrum_numeric(pulse, f)
    # a falling sweep is the conjugate of a rising one, and both are even about mid-pulse
    centred = centred if pulse.sweep == "up" else np.conj(centred)
    return np.asarray(centred * np.exp(-1j * np.pi * f * pulse.duration))


def energy_duration(pulse: Pulse) -> float:
    """Duration of a rectangular tone burst of the same peak and energy, integral of |envelope|^2 dt [s].

    Source: mean square of a half-cosine taper is 3/8, so T (1 - 5 a / 8) for a tapered share a.
    """
    return pulse.duration * (1 - 0.625 * tapered_fraction(pulse))


def tapered_fraction(pulse: Pulse) -> float:
    """Fraction of the pulse's duration that rises or falls, both ends together [1]."""
    return {"none": 0.0, "tukey": pulse.taper_fraction, "hann": 1.0}[pulse.taper]


def _sweep_rate(pulse: Pulse) -> float:
    """Rate of the frequency, negative for a falling sweep [Hz/s]."""
    return (pulse.bandwidth if pulse.sweep == "up" else -pulse.bandwidth) / pulse.duration


def _closed_form_holds(pulse: Pulse, f: Floats) -> bool:
    """Return True if double precision resolves the phases of the closed form."""
    cycles = np.max(np.abs(f), initial=0.0) * pulse.duration + 1 / max(tapered_fraction(pulse), 1e-3)
    product = pulse.bandwidth * pulse.duration
    return bool(product >= 1 or (product >= 1e-2 and cycles**2 < 1e5 * product))


def _window_spectrum(pulse: Pulse, f: Floats) -> Complexes:
    """Fourier transform of a Tukey window over 0..duration at frequencies f [Hz], in closed form [s]."""
    rise = tapered_fraction(pulse) * pulse.duration / 2
    flat = pulse.duration - rise
    x = np.abs(2 * f * rise)
    # cos(pi x / 2) / (1 - x^2), in a form without the removable singularity at x = 1
    lobe = np.pi / 2 * np.sinc((x - 1) / 2) / (1 + x)
    return np.asarray(flat * np.sinc(f * flat) * lobe * np.exp(-1j * np.pi * f * pulse.duration))


def _sweep_spectrum_closed(pulse: Pulse, f: Floats) -> Complexes:
    """Spectrum [s] of a rising sweep about its middle at offsets f [Hz], in closed form: flat part and both tapers."""
    rate, half = pulse.bandwidth / pulse.duration, pulse.duration / 2
    rise = tapered_fraction(pulse) * half
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


def _sweep_spectrum_numeric(pulse: Pulse, f: Floats) -> Complexes:
    """Spectrum [s] of a rising sweep at offsets f [Hz] by Gauss-Legendre quadrature, in panels of at most one cycle."""
    half = pulse.duration / 2
    corner = half - tapered_fraction(pulse) * half
    cycles = int((np.max(np.abs(f), initial=0.0) + pulse.bandwidth) * pulse.duration) + 1
    knots = np.unique(np.concatenate([np.linspace(-half, half, cycles + 1), [-corner, corner]]))
    node, weight = np.polynomial.legendre.leggauss(16)
    time = (knots[:-1, None] + np.diff(knots)[:, None] * (node + 1) / 2).ravel()
    weighted_envelope = (np.diff(knots)[:, None] * weight / 2).ravel() * envelope(
        pulse.unchecked_copy(sweep="up"), time + half
    )
    flat = np.concatenate(
        [np.exp(-2j * np.pi * np.outer(chunk, time)) @ weighted_envelope for chunk in _chunks(f.ravel())]
    )
    return np.asarray(flat.reshape(f.shape))


def _chunks(f: Floats) -> list[Floats]:
    """Frequencies in consecutive parts of about 512, which bound the memory of a quadrature."""
    return np.array_split(f, max(1, f.size // 512))


def _khz(frequency: float) -> str:
    return f"{frequency / 1e3:g} kHz"
