"""Ambient noise in the water, as an omnidirectional hydrophone receives it.

Either its level has been measured, or its sources are given. Each receive channel records a part of it:
directive channels record less than a hydrophone does, and neighbouring channels are correlated.
"""

from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from insonify.model import Decibels, MetresPerSecond, Model, field_error
from insonify.ocean.ambient_noise import noise_components_db, noise_level_db, thermal_noise_db
from insonify.ocean.wind import MAX_WIND
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]
Directionality = Literal["isotropic", "surface"]
"""Angular distribution: the same in all directions, or from vertical dipoles at the sea surface."""


class SeaNoise(Model):
    """Ambient noise: a measured level, or the sum of wind, shipping, rain and thermal noise."""

    level_db: Annotated[Decibels, Field(ge=-100, le=250)] | None = None
    """Measured spectrum level, constant over the band [dB re 1 uPa^2/Hz]; None: computed from the sources below."""
    wind_speed: Annotated[MetresPerSecond, Field(ge=0, le=MAX_WIND)] | None = None
    """Wind at 10 m height [m/s]."""
    shipping: Annotated[float, Field(ge=0, le=1)] = 0.5
    """Shipping activity, from 0 (remote) to 1 (heavy traffic); contributes below some kilohertz only [1]."""
    rain_rate: Annotated[float, Field(ge=0, le=500, json_schema_extra={"units": "mm/h"})] = 0.0
    """Rainfall [mm/h]."""
    directionality: Directionality = "isotropic"
    """Angular distribution of the noise; thermal noise is isotropic in any case."""

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if self.level_db is None and self.wind_speed is None:
            raise field_error("", None, "has no level. Give level_db, or wind_speed (0 m/s in a calm).")
        if self.level_db is not None and (self.wind_speed is not None or self.rain_rate > 0):
            raise field_error(
                "level_db", f"{self.level_db:g} dB",
                "is the level of all sources together. Leave wind_speed and rain_rate out, or level_db.",
            )  # fmt: skip
        return self

    def density(self, frequency: ArrayLike) -> dict[Directionality, Floats]:
        """Spectral density of the noise by directionality [uPa^2/Hz]; warned where a fit is used outside its range.

        Args:
            frequency: Frequency [Hz], any shape.

        Returns:
            Spectral density at an omnidirectional hydrophone, shape of `frequency`, by directionality.
        """
        f = np.asarray(frequency, dtype=float)
        if self.level_db is not None:
            return {self.directionality: np.full(f.shape, float(intensity_ratio(self.level_db)))}
        sources: dict[str, Any] = {
            "wind_speed": self.wind_speed, "shipping": self.shipping, "rain_rate": self.rain_rate,
        }  # fmt: skip
        total = intensity_ratio(noise_level_db(f, **sources))
        if self.directionality == "isotropic":
            return {"isotropic": total}
        thermal = intensity_ratio(thermal_noise_db(f))
        other_db = [level_db for name, level_db in noise_components_db(f, **sources).items() if name != "thermal"]
        return {"isotropic": thermal, "surface": np.asarray(sum(intensity_ratio(level_db) for level_db in other_db))}
