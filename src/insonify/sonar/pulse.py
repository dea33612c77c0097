"""Transmitted pulse: a tone burst (CW), a frequency sweep, or another modulation, with tapered ends.

A pulse is represented by its complex envelope about the centre frequency: one at the peak, zero
outside 0..duration. Everything that follows (gridding, matched filter, sonar equation) needs
only that envelope, its Fourier transform at any offset, and its energy.
"""

from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from insonify.model import Hertz, Model, Seconds, field_error
from insonify.sonar.linear_sweep import LinearSweep
from insonify.sonar.modulation import Complexes, Form, Modulation, PulseNumbers, modulated_envelope
from insonify.sonar.tone_burst import ToneBurst
from insonify.validity import warn_outside

MODULATIONS: dict[str, Modulation] = {"cw": ToneBurst(), "lfm": LinearSweep()}
"""Modulations by the kind of pulse; one entry registers a kind."""
KINDS = tuple(MODULATIONS)

MAX_FREQUENCY = 10e6
"""Highest centre frequency of a pulse [Hz]."""
MIN_PLAUSIBLE_FREQUENCY = 2000.0
"""Frequency below which a frequency that does not fit its pulse was probably meant in kilohertz [Hz]."""


class Pulse(Model):
    """A burst of sound: a tone ("cw") or a linear sweep ("lfm"), with tapered ends.

    Example:
        >>> chirp = Pulse(kind="lfm", frequency="100 kHz", bandwidth="20 kHz", duration="2 ms")
        >>> f"time-bandwidth product {chirp.duration * chirp.bandwidth:.0f}"
        'time-bandwidth product 40'
    """

    kind: Literal[KINDS] = "cw"  # type: ignore[valid-type]
    """Kind: a tone burst of one frequency (cw), or a linear frequency sweep (lfm)."""
    frequency: Hertz = Field(gt=0, le=MAX_FREQUENCY)
    """Centre frequency [Hz]."""
    duration: Seconds = Field(gt=0, le=10)
    """Duration of the transmission [s]."""
    bandwidth: Hertz = Field(default=0.0, ge=0, lt=2 * MAX_FREQUENCY)
    """Width of the sweep [Hz]; zero for a tone."""
    sweep: Literal["up", "down"] = "up"
    """Direction of the sweep."""
    taper: Literal["none", "tukey", "hann"] = "tukey"
    """Taper of both ends: none, over a fraction of the pulse (tukey), or over all of it (hann)."""
    taper_fraction: float = Field(default=0.1, ge=1e-3, le=1)
    """Fraction of the duration in which a Tukey pulse rises or falls, both ends together [1]."""

    @model_validator(mode="after")
    def _check_kind_and_bandwidth(self) -> Self:
        if not self.modulation.is_sweep and self.bandwidth > 0:
            raise field_error(
                "bandwidth",
                _khz(self.bandwidth),
                f"for a {self.kind} pulse, whose band follows from its duration. Leave bandwidth out, or set kind to "
                "lfm.",
            )
        if self.modulation.is_sweep and self.bandwidth == 0:
            raise field_error(
                "bandwidth", "0 Hz", f"for kind: {self.kind}. Give the width of the sweep, such as 20 kHz."
            )
        return self

    @model_validator(mode="after")
    def _band_above_zero(self) -> Self:
        is_sweep = self.modulation.is_sweep
        too_low = self.bandwidth >= 2 * self.frequency or (not is_sweep and self.duration * self.frequency <= 1)
        if too_low and self.frequency <= MIN_PLAUSIBLE_FREQUENCY:
            raise field_error(
                "frequency",
                f"{self.frequency:g} Hz",
                "is too low for this pulse, whose band would reach below 0 Hz. "
                f"Did you mean {self.frequency:g} kHz? Write the unit.",
            )
        if is_sweep and self.bandwidth >= 2 * self.frequency:
            raise field_error(
                "bandwidth",
                _khz(self.bandwidth),
                f"at a centre of {_khz(self.frequency)}; the band would reach below 0 Hz. "
                f"Give a bandwidth under {_khz(2 * self.frequency)}, or a higher centre frequency.",
            )
        if not is_sweep and self.duration * self.frequency <= 1:
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

    @property
    def modulation(self) -> Modulation:
        """Modulation of its kind."""
        return MODULATIONS[self.kind]

    @property
    def form(self) -> Form:
        """Form that files of other programs state: "cw", "linear sweep", "hyperbolic sweep" or "other"."""
        return self.modulation.form


def envelope(pulse: Pulse, time: ArrayLike) -> Complexes:
    """Complex envelope of a pulse about its centre frequency [1].

    The Tukey window is flat in the middle and a half cosine at either end; Hann is its extreme.
    A linear sweep has zero phase at mid-pulse and frequency offsets from -B/2 to B/2 (or back).

    Args:
        pulse: The pulse.
        time: Time since the start of transmission [s], any shape.

    Returns:
        Envelope of unit peak [1], shape of time; zero outside 0..duration.

    Source: F. J. Harris (1978), Proc. IEEE 66(1), 51-83 (Tukey window); a linear sweep by definition.

    Example:
        >>> tone = Pulse(frequency="100 kHz", duration="1 ms", taper="hann")
        >>> envelope(tone, [0.0, 0.25e-3, 0.5e-3, 1.5e-3]).real.round(3).tolist()
        [0.0, 0.5, 1.0, 0.0]
    """
    t = np.asarray(time, dtype=float)
    return modulated_envelope(pulse.modulation, _numbers(pulse), t, rising=pulse.sweep == "up")


def spectrum(pulse: Pulse, offset: ArrayLike) -> Complexes:
    """Fourier transform of the envelope, integral of envelope(t) exp(-j 2 pi f t) dt [s].

    Closed forms: a Tukey window is a rectangle convolved with a cosine lobe; a linear sweep under it is
    a few Fresnel integrals. Linear sweeps much shorter than one cycle of bandwidth times duration are
    integrated numerically, since the Fresnel form loses digits there.

    Args:
        pulse: The pulse.
        offset: Frequency relative to the centre [Hz], any shape.

    Returns:
        Spectrum [s], shape of offset, within 1e-9 of its peak.

    Example:
        >>> tone = Pulse(frequency="100 kHz", duration="1 ms", taper="none")
        >>> (np.abs(spectrum(tone, [0.0, 500.0, 1000.0])) * 1e3).round(3).tolist()  # ms
        [1.0, 0.637, 0.0]
    """
    f = np.asarray(offset, dtype=float)
    centred = pulse.modulation.spectrum(_numbers(pulse), f)
    # a falling pulse is the conjugate of a rising one that is reversed in time
    centred = centred if pulse.sweep == "up" else np.conj(centred)
    return np.asarray(centred * np.exp(-1j * np.pi * f * pulse.duration))


def energy_duration(pulse: Pulse) -> float:
    """Duration of a rectangular tone burst of the same peak and energy, integral of |envelope|^2 dt [s].

    Source: mean square of a half-cosine taper is 3/8, so T (1 - 5 a / 8) for a tapered share a.

    Example:
        >>> f"{energy_duration(Pulse(frequency='100 kHz', duration='1 ms', taper='hann')) * 1e3:.3f} ms"
        '0.375 ms'
    """
    return pulse.duration * (1 - 0.625 * tapered_fraction(pulse))


def tapered_fraction(pulse: Pulse) -> float:
    """Fraction of the pulse's duration that rises or falls, both ends together [1]."""
    return {"none": 0.0, "tukey": pulse.taper_fraction, "hann": 1.0}[pulse.taper]


def _numbers(pulse: Pulse) -> PulseNumbers:
    """Numbers of a pulse for its modulation."""
    return PulseNumbers(pulse.frequency, pulse.duration, pulse.bandwidth, tapered_fraction(pulse))


def _khz(frequency: float) -> str:
    return f"{frequency / 1e3:g} kHz"
