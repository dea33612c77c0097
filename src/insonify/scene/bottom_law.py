"""The sediment's own law, as a scenario names it: which law, of which sediment."""

from functools import lru_cache
from typing import Annotated, Literal

from pydantic import Field, field_validator

from insonify.noun import Noun
from insonify.scattering.fast import FastLaw, compiled
from insonify.scattering.jackson import Jackson
from insonify.scattering.sediment_volume import SedimentVolume
from insonify.scattering.sediments import Sediment
from insonify.scattering.small_slope import SmallSlope

_LAWS = {"jackson": Jackson, "small-slope": SmallSlope, "sediment-volume": SedimentVolume}


def known_sediment(name: str | float) -> str | float:
    """The name of a sediment, or a grain size [phi], unchanged.

    Raises:
        ValueError: There is no such sediment; the nearest names are given.
    """
    sediment(name)
    return name


def sediment(name: str | float) -> Sediment:
    """The sediment of a name, or of a grain size [phi]."""
    return Sediment.named(name) if isinstance(name, str) else Sediment.from_grain_size(name)


def law_by_its_numbers(value: object) -> object:
    """A law told without its name, known by what it asks for: a strength, a sediment or a wind."""
    if isinstance(value, dict) and "law" not in value:
        known = {"sediment": "jackson", "wind_speed": "apl-surface"}
        return {**value, "law": next((law for key, law in known.items() if key in value), "lambert")}
    return value


class SedimentLaw(Noun):
    """A law that follows from what the seabed is made of."""

    law: Literal["jackson", "small-slope", "sediment-volume"] = "jackson"
    """Rough surface and volume together (Jackson's model), or one of the two alone."""
    sediment: Annotated[float, Field(ge=-1, le=9)] | str = "medium sand"
    """Name of the sediment, or its grain size [phi]."""

    @field_validator("sediment")
    @classmethod
    def _is_known(cls, value: str | float) -> str | float:
        return known_sediment(value)

    def at(self, frequency: float, sound_speed: float) -> FastLaw:
        """The law at one frequency [Hz], over water of one sound speed [m/s], ready for the engine."""
        return _made(self.law, self.sediment, frequency, sound_speed)


@lru_cache(maxsize=16)
def _made(law: str, name: str | float, frequency: float, sound_speed: float) -> FastLaw:
    """Making a law's tables takes a fraction of a second, and every ping wants the same."""
    return compiled(_LAWS[law](sediment(name), frequency, sound_speed=sound_speed))
