"""Water of a scenario: sound speed, absorption, noise and volume scattering."""

from functools import lru_cache
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from insonify.model import Celsius, Decibels, Metres, MetresPerSecond, Model, field_error
from insonify.ocean.absorption import absorption_db_per_m
from insonify.ocean.inhomogeneity import Inhomogeneity
from insonify.ocean.profile import SoundSpeedProfile
from insonify.ocean.profile_smoothing import LONGEST_ROUNDING
from insonify.ocean.scattering_layers import ScatteringPatch, ScenarioLayers, layer_columns, require_increasing_depths
from insonify.ocean.scenario_profile import ScenarioProfile
from insonify.ocean.sea_noise import SeaNoise
from insonify.units import amplitude_ratio, decibels


def _loss_per_metre(value: object) -> object:
    """Loss per metre [dB/m] from 0.034, "0.034 dB/m" or "34 dB/km"."""
    if not isinstance(value, str):
        return value
    number, slash, length = value.rpartition("/")
    if not slash or length.strip() not in {"m", "km"}:
        raise ValueError(f"{value!r} is not a loss per length; write '0.034 dB/m' or '34 dB/km'")
    loss = decibels(number)
    return loss / 1e3 if isinstance(loss, float) and length.strip() == "km" else loss


LossPerMetre = Annotated[
    float, BeforeValidator(_loss_per_metre), Field(ge=0, le=1000, json_schema_extra={"units": "dB/m"})
]


class Water(Model):
    """Sea water of one sound speed, or of a sound speed that changes with depth.

    Example:
        >>> cast = {"depth": [0, 20], "temperature": [18, 12], "salinity": [35, 35]}
        >>> water = Water(profile=cast, temperature="15 degC")
        >>> water.sound_speed_at([0.0, 10.0, 20.0]).round().tolist()  # m/s
        [1516.0, 1506.0, 1497.0]
        >>> f"{1e3 * water.absorption(100e3):.0f} dB/km"
        '37 dB/km'
    """

    sound_speed: Annotated[MetresPerSecond, Field(ge=1300, le=1700)] = 1500.0
    """Speed of sound [m/s]; where a profile is given, the mean speed along a vertical ray through all of it."""
    profile: Annotated[ScenarioProfile | None, Field(json_schema_extra={"words": "a sound-speed profile"})] = None
    """Sound speed against depth, instead of `sound_speed`: a table's name, rows or columns."""
    inhomogeneity: Inhomogeneity | None = None
    """Patches of warmer and colder water, which make travel times random; None: homogeneous water."""
    smoothing: Annotated[Metres, Field(gt=0, le=LONGEST_ROUNDING)] | None = None
    """Depth within which each corner of the profile is rounded [m]; None leaves straight lines."""
    temperature: Annotated[Celsius, Field(ge=-5, le=45)] = 10.0
    """Temperature, for the absorption only [degC]."""
    salinity: Annotated[float, Field(ge=0, le=45, json_schema_extra={"units": "g/kg"})] = 35.0
    """Salinity, for the absorption only [g/kg]."""
    ph: Annotated[float, Field(ge=7, le=9)] = 8.0
    """Acidity, for the absorption; it matters below about 10 kHz only [1]."""
    noise_level_db: Annotated[Decibels, Field(ge=-100, le=250)] | None = None
    """Spectrum level of the noise in each recorded channel, whatever its directivity: at the output of a beam,
    independent between beams; at each element, from isotropic noise [dB re 1 uPa^2/Hz]. None: see `noise`."""
    noise: SeaNoise | None = None
    """Noise in the water, received through the directivity of each channel; None: no noise."""
    absorption_db_per_m: LossPerMetre | None = None
    """Measured absorption, the same at every frequency [dB/m]; None: the law of Francois & Garrison."""
    volume_strength_db: ScenarioLayers | None = None
    """Volume scattering strength S_v [dB re 1/m]: one number, or rows of a depth [m], and the strength from it down to
    the next row, null where it is clear; None: clear throughout."""
    patches: tuple[ScatteringPatch, ...] = ()
    """Volumes of stronger scattering, such as schools and wakes."""

    @model_validator(mode="before")
    @classmethod
    def _one_of_both(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        if value.get("profile") is not None and value.get("sound_speed") is not None:
            raise field_error(
                "profile", None, "sound_speed is given as well, and one of the two must go. "
                "Delete the line 'sound_speed: ...' for layered water, or 'profile: ...' for water of one speed.",
            )  # fmt: skip
        if value.get("noise") is not None and value.get("noise_level_db") is not None:
            raise field_error("noise_level_db", None, "is the noise in each channel, and noise that in the water. "
                          "Delete one of them.")  # fmt: skip
        if value.get("smoothing") is not None and value.get("profile") is None:
            raise field_error("smoothing", None, "rounds the corners of a profile, and there is none. Delete the line.")
        if value.get("profile") is not None:  # an empty sound_speed beside a profile is allowed
            return {key: entry for key, entry in value.items() if key != "sound_speed"}
        return value

    @model_validator(mode="after")
    def _set_mean_sound_speed(self) -> Self:
        if self.profile is not None:
            self.__dict__["sound_speed"] = _mean_speed(self.profile)  # frozen, but still under construction
        return self

    @model_validator(mode="after")
    def _check_layer_depths(self) -> Self:
        require_increasing_depths(self.volume_strength_db, "volume_strength_db")
        return self

    @model_serializer(mode="wrap")
    def _as_written(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Values as they were written: a speed or a profile, never both."""
        values: dict[str, Any] = dump(self)
        if self.profile is not None:
            values.pop("sound_speed", None)
        return values

    @property
    def layered(self) -> bool:
        """True where sound speed changes with depth, so that rays are refracted."""
        return self.profile is not None and min(self.profile.speed) < max(self.profile.speed)

    @property
    def scatters(self) -> bool:
        """True where the water has volume scattering."""
        return self.volume_strength_db is not None or bool(self.patches)

    def layers(self, deepest: float) -> NDArray[np.float64]:
        """Upper and lower side [m] and s_v [1/m] of the scattering layers above a depth [m], shape (layers, 3)."""
        return layer_columns(self.volume_strength_db, deepest)

    @property
    def min_sound_speed(self) -> float:
        """Smallest sound speed at any depth [m/s]."""
        return self.sound_speed if self.profile is None else min(self.profile.speed)

    @property
    def max_sound_speed(self) -> float:
        """Largest sound speed at any depth [m/s]."""
        return self.sound_speed if self.profile is None else max(self.profile.speed)

    def profile_to_depth(self, water_depth: float) -> SoundSpeedProfile:
        """Sound-speed profile from the surface to the seabed, or deeper, rounded as `smoothing` requires.

        Args:
            water_depth: Deepest water of the scene [m].

        Raises:
            ValueError: The profile begins below the surface or ends above the seabed; the message gives the remedy.
        """
        if self.profile is None:
            return SoundSpeedProfile(np.array([0.0, water_depth]), np.full(2, self.sound_speed))
        profile = _profile(self.profile, self.smoothing)
        profile.require_depth(water_depth)
        return profile

    def sound_speed_at(self, depth: ArrayLike) -> NDArray[np.float64]:
        """Sound speed [m/s], constant above the first and below the last knot.

        Args:
            depth: Depth [m], any shape.

        Returns:
            Sound speed [m/s], same shape.
        """
        if self.profile is None:
            return np.full(np.shape(depth), self.sound_speed)
        return _profile(self.profile, self.smoothing).at(depth)

    def absorption(self, frequency: ArrayLike, *, depth: ArrayLike = 0.0) -> NDArray[np.float64]:
        """Absorption coefficient of this water [dB/m].

        Args:
            frequency: Frequency [Hz], any shape.
            depth: Depth below the mean surface [m], broadcast against frequency. 0 by default:
                at 100 m and 100 kHz the loss is 1.4 % less.

        Returns:
            One-way loss per metre [dB/m], broadcast shape of the arguments.
        """
        if self.absorption_db_per_m is not None:
            return np.full(np.broadcast_shapes(np.shape(frequency), np.shape(depth)), self.absorption_db_per_m)
        return absorption_db_per_m(
            frequency, temperature=self.temperature, salinity=self.salinity, depth=depth, ph=self.ph
        )

    def relative_absorption(self, length: ArrayLike, offset: float, frequency: float) -> NDArray[np.float64]:
        """Pressure left by absorption at one frequency of a band re that left at its carrier [1], shape of length.

        Args:
            length: Path length [m], any shape.
            offset: Offset from the carrier [Hz].
            frequency: Carrier frequency [Hz].
        """
        if offset == 0:
            return np.ones(np.shape(length))
        excess_db_per_m = float(self.absorption(frequency + offset)) - float(self.absorption(frequency))
        return amplitude_ratio(-excess_db_per_m * np.asarray(length, dtype=float))


@lru_cache(maxsize=64)
def absorption_np_per_m(water: Water, frequency: float) -> float:
    """Absorption of pressure in the water at the surface, depth 0 [Np/m]; computed once.

    Args:
        water: Absorbing water.
        frequency: Frequency of the sound [Hz].
    """
    return float(np.log(10) / 20 * water.absorption(frequency))


@lru_cache(maxsize=64)
def _profile(written: ScenarioProfile, smoothing: float | None) -> SoundSpeedProfile:
    """Profile of a scenario, rounded where `smoothing` is given; computed once."""
    profile = written.profile()
    return profile if smoothing is None else profile.smoothed(smoothing)


def _mean_speed(written: ScenarioProfile) -> float:
    """Depth over travel time of a vertical ray through a profile [m/s]; exact for straight lines."""
    speed = np.array(written.speed)
    if speed.min() == speed.max():
        return float(speed[0])
    growth = np.diff(speed) / speed[:-1]
    # Travel time of each layer re that at the speed of its upper side.
    relative_time = np.where(growth == 0, 1.0, np.log1p(growth) / np.where(growth == 0, 1.0, growth))
    thickness = np.diff(written.depth)
    return float(thickness.sum() / np.sum(thickness / speed[:-1] * relative_time))
