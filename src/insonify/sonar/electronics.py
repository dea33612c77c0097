"""Electronics behind the hydrophones: noise of their own, leaks, gain that follows the range, a converter.

Each part is left out unless it is named. Sound passes them in the order in which they stand here.
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


class Tone(Model):
    """A line in the spectrum of the receiver's own noise: a switching supply, a clock."""

    frequency: Annotated[Hertz, Field(gt=0, le=10e6)]
    """Of the tone [Hz]."""
    level_db: Annotated[Decibels, Field(ge=-100, le=250)]
    """Rms level, as the sound that would make it [dB re 1 uPa]."""


class SelfNoise(Model):
    """Noise of the receiver itself, as the sound that would make it at an element."""

    level_db: Annotated[Decibels, Field(ge=-100, le=250)] | None = None
    """Spectrum level of each element's own hydrophone and amplifier [dB re 1 uPa^2/Hz]; None: no such noise."""
    tones: tuple[Tone, ...] = ()
    """Lines, picked up by all elements at once, in phase; they run on from ping to ping."""


class Crosstalk(Model):
    """Signals that couple into a channel from the transmitter and from other channels."""

    feedthrough_db: Annotated[Decibels, Field(ge=-300, le=20)] | None = None
    """Level of the transmission in every channel, at once, re the source level [dB]; None: none."""
    neighbours_db: Annotated[Decibels, Field(ge=-200, le=-6)] | None = None
    """Level in an element of each nearest neighbour's signal, re that neighbour [dB]; None: nothing."""


class ReceiverGain(Model):
    """Gain before the converter, fixed and varied in time; the recording is in uPa, so it is divided out again."""

    fixed_db: Annotated[Decibels, Field(ge=-400, le=400)] = 0.0
    """At all ranges [dB]."""
    tvg_db_per_decade: Annotated[float, Field(ge=0, le=60, json_schema_extra={"units": "dB"})] = 0.0
    """Decibels for each tenfold range: 20, 30 or 40 [dB]; 0: no gain follows the range."""
    absorption_db_per_m: LossPerMetre | None = None
    """Absorption that the gain makes up for, out and back [dB/m]; None: the water's own, where spreading is not 0."""
    start: Annotated[Seconds, Field(ge=0, le=1e3)] = 0.0
    """Time after the start of transmission before which the gain stays as it is then [s]."""
    stop: Annotated[Seconds, Field(gt=0, le=1e3)] | None = None
    """Time after which the gain is constant [s]; None: it never is."""
    max_db: Annotated[Decibels, Field(ge=-200, le=400)] | None = None
    """Gain that the amplifier does not exceed [dB]; None: any."""
    curve: tuple[tuple[Metres, Decibels], ...] = ()
    """Further gain by range: rows of a range [m] and a gain [dB], linear between rows, constant beyond them."""

    @model_validator(mode="after")
    def _check_curve(self) -> Self:
        ranges = [slant for slant, _ in self.curve]
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
            sound_speed: That the amplifier takes ranges with [m/s].
            absorption_db_per_m: One-way absorption of the water where the gain has none of its own [dB/m].
        """
        own = self.absorption_db_per_m
        loss = own if own is not None else absorption_db_per_m if self.tvg_db_per_decade > 0 else 0.0
        slant = np.clip(time, self.start, self.stop) * sound_speed / 2
        whole = self.fixed_db + tvg_db(slant, self.tvg_db_per_decade, absorption_db_per_m=loss)
        if self.curve:
            whole = whole + np.interp(slant, *np.transpose(self.curve))
        return whole if self.max_db is None else np.minimum(whole, self.max_db)


class AnalogToDigitalConverter(Model):
    """From pressure to numbers: full scale, and bits if it rounds."""

    full_scale_db: Annotated[Decibels, Field(ge=0, le=300)]
    """Rms level of a tone that just fills the converter at a gain of 0 dB [dB re 1 uPa]."""
    bits: Annotated[int, Field(ge=2, le=32)] | None = None
    """Of each of the two numbers, in phase and in quadrature, sign included; None: it clips and does not round."""
