"""The water itself: how fast it carries sound, how much it takes, how loud it is."""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, Field

from insonify.noun import Celsius, Decibels, MetresPerSecond, Noun
from insonify.ocean.absorption import absorption_db_per_m
from insonify.units import decibels


def _loss_per_metre(value: object) -> object:
    """Loss per metre [dB/m] behind 0.034, "0.034 dB/m" or "34 dB/km"."""
    if not isinstance(value, str):
        return value
    number, slash, length = value.rpartition("/")
    if not slash or length.strip() not in {"m", "km"}:
        raise ValueError(f"{value!r} is not a loss per length; write '0.034 dB/m' or '34 dB/km'")
    loss = decibels(number)
    return loss / 1e3 if isinstance(loss, float) and length.strip() == "km" else loss


class Water(Noun):
    """Sea water of one sound speed, the same at every depth."""

    sound_speed: Annotated[MetresPerSecond, Field(ge=1300, le=1700)] = 1500.0
    """Speed of sound [m/s]."""
    temperature: Annotated[Celsius, Field(ge=-5, le=45)] = 10.0
    """Temperature, for the absorption only [degC]."""
    salinity: Annotated[float, Field(ge=0, le=45, json_schema_extra={"units": "g/kg"})] = 35.0
    """Salinity, for the absorption only [g/kg]."""
    ph: Annotated[float, Field(ge=7, le=9)] = 8.0
    """Acidity; heard below about 10 kHz only [1]."""
    noise_level_db: Annotated[Decibels, Field(ge=-100, le=250)] | None = None
    """Spectrum level of the noise in the beam output [dB re 1 uPa^2/Hz]; None is silence."""
    absorption_db_per_m: (
        Annotated[float, BeforeValidator(_loss_per_metre), Field(ge=0, json_schema_extra={"units": "dB/m"})] | None
    ) = None
    """Measured absorption, the same at every frequency [dB/m]; None asks Francois & Garrison."""

    def absorption(self, frequency: ArrayLike, *, depth: ArrayLike = 0.0) -> NDArray[np.float64]:
        """Energy that this water takes from the wave along each metre of its way [dB/m].

        Args:
            frequency: Frequency [Hz], any shape.
            depth: Depth at which the loss is asked for [m], broadcast against frequency. At
                the surface by default: in 100 m of water the loss at the bottom is 1.4 % less at 100 kHz.

        Returns:
            One-way loss per metre [dB/m], broadcast shape of the arguments.
        """
        if self.absorption_db_per_m is not None:
            return np.full(np.broadcast_shapes(np.shape(frequency), np.shape(depth)), self.absorption_db_per_m)
        return absorption_db_per_m(
            frequency, temperature=self.temperature, salinity=self.salinity, depth=depth, ph=self.ph
        )
