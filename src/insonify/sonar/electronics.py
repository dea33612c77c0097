"""Electronics behind the hydrophones: self-noise, crosstalk, time-varied gain, analog-to-digital converter.

A part that the scenario does not name is absent. The signal passes the parts in the order of this file.
"""

import itertools
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from insonify.model import Decibels, Hertz, Metres, Model, Seconds, field_error
from insonify.ocean.water import LossPerMetre
from insonify.sonar.time_varied_gain import tvg_db

Floats = NDArray[np.float64]
Gain = Annotated[Decibels, Field(ge=-400, le=400)]
Range = Annotated[Metres, Field(ge=0, le=1e6)]


class Tone(Model):
    """A line in the spectrum of the receiver's self-noise, such as that of a switching supply or a clock."""

    frequency: Annotated[Hertz, Field(gt=0, le=10e6)]
    """Frequency of the tone [Hz]."""
    level_db: Annotated[Decibels, Field(ge=-100, le=250)]
    """Rms level of the equivalent sound pressure [dB re 1 uPa]."""


class SelfNoise(Model):
    """Self-noise of the receiver, as the equivalent sound pressure at an element."""

    level_db: Annotated[Decibels, Field(ge=-100, le=250)] | None = None
    """Spectrum level of each element's own hydrophone and amplifier [dB re 1 uPa^2/Hz]; None: no such noise."""
    tones: tuple[Tone, ...] = ()
    """Tones, received by all elements in phase; their phase continues from ping to ping."""


class Crosstalk(Model):
    """Signals that couple into a channel from the transmitter and from other channels."""

    feedthrough_db: Annotated[Decibels, Field(ge=-300, le=20)] | None = None
    """Level of the transmission in every channel, without delay, re the source level [dB]; None: none."""
    neighbours_db: Annotated[Decibels, Field(ge=-200, le=-6)] | None = None
    """Level in an element of each nearest neighbour's signal, re that neighbour [dB]; None: nothing."""


class ReceiverGain(Model):
    """Gain before the converter, fixed and time-varied; the recording is in uPa, so the gain is divided out again."""

    fixed_db: Gain = 0.0
    """Gain at all ranges [dB]."""
    tvg_db_per_decade: Annotated[Decibels, Field(ge=0, le=60)] = 0.0
    """Growth of the gain for each tenfold range, such as 20, 30 or 40 [dB]; 0: it does not depend on range."""
    absorption_db_per_m: LossPerMetre | None = None
    """One-way absorption that the gain compensates, out and back [dB/m]; None: that of the water, if
    `tvg_db_per_decade` is not 0."""
    start: Annotated[Seconds, Field(ge=0, le=1e3)] = 0.0
    """Time after the start of transmission until which the gain is constant [s]."""
    stop: Annotated[Seconds, Field(gt=0, le=1e3)] | None = None
    """Time after which the gain is constant [s]; None: it varies until the window ends."""
    max_db: Annotated[Decibels, Field(ge=-200, le=400)] | None = None
    """Largest gain of the amplifier [dB]; None: no limit."""
    curve: tuple[tuple[Range, Gain], ...] = ()
    """Additional gain by range: rows of a range [m] and a gain [dB], linear between rows, constant beyond them."""

    @model_validator(mode="after")
    def _check_curve(self) -> Self:
        ranges = [slant_range for slant_range, _ in self.curve]
        if any(after <= before for before, after in itertools.pairwise(ranges)):
            raise field_error("curve", None, "has ranges that do not increase. Sort its rows by range.")
        return self

    @model_validator(mode="after")
    def _check_start_and_stop(self) -> Self:
        if self.stop is not None and self.stop <= self.start:
            raise field_error("stop", f"{self.stop * 1e3:g} ms", f"is not after start ({self.start * 1e3:g} ms). "
                          "Give a later stop.")  # fmt: skip
        return self

    def db(self, time: Floats, sound_speed: float, absorption_db_per_m: float) -> Floats:
        """Gain at times after the start of transmission [dB].

        Args:
            time: Time [s], any shape.
            sound_speed: Sound speed by which the amplifier converts time to range [m/s].
            absorption_db_per_m: One-way absorption of the water, for a gain without an absorption of its own [dB/m].

        Returns:
            Gain [dB], shape of `time`.
        """
        gain_absorption = self.absorption_db_per_m
        absorption = (
            gain_absorption
            if gain_absorption is not None
            else absorption_db_per_m
            if self.tvg_db_per_decade > 0
            else 0.0
        )
        slant_range = np.clip(time, self.start, self.stop) * sound_speed / 2
        gain = self.fixed_db + tvg_db(slant_range, self.tvg_db_per_decade, absorption_db_per_m=absorption)
        if self.curve:
            gain = gain + np.interp(slant_range, *np.transpose(self.curve))
        return gain if self.max_db is None else np.minimum(gain, self.max_db)


class AnalogToDigitalConverter(Model):
    """Analog-to-digital converter: clips at full scale, and rounds to a number of bits."""

    full_scale_db: Annotated[Decibels, Field(ge=0, le=300)]
    """Rms level of a tone that reaches full scale at a gain of 0 dB [dB re 1 uPa]."""
    bits: Annotated[int, Field(ge=2, le=32)] | None = None
    """Bits of each of the two numbers, in phase and in quadrature, sign included [1]; None: no rounding."""
