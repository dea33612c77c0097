"""Scattering law of the seabed in a scenario: kind of law, and its sediment or table."""

import math
from functools import lru_cache
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from insonify.data_file import DataFile, Fingerprint, require_unchanged
from insonify.model import Model, field_error
from insonify.scattering.albedo import albedo
from insonify.scattering.compiled_law import CompiledLaw, compile_law
from insonify.scattering.jackson import Jackson
from insonify.scattering.sediment_volume import SedimentVolume, VolumeSpectrum
from insonify.scattering.sediments import Sediment
from insonify.scattering.small_slope import SmallSlope
from insonify.scattering.table_law import TableScatteringLaw

SMALL_SLOPE = "small-slope"


def checked_sediment(name: str | float) -> str | float:
    """The name of a sediment, or a grain size [phi], unchanged once it is known.

    Raises:
        ValueError: There is no such sediment; the nearest names are given.
    """
    sediment(name)
    return name


@lru_cache(maxsize=64)
def sediment(name: str | float) -> Sediment:
    """The sediment of a name, or of a grain size [phi]."""
    return Sediment.named(name) if isinstance(name, str) else Sediment.from_grain_size(name)


class SedimentLaw(Model):
    """A law that follows from the sediment of the seabed."""

    law: Literal["jackson", "small-slope", "sediment-volume"] = "jackson"
    """Rough surface and volume together (Jackson's model), or one of the two alone."""
    sediment: Annotated[float, Field(ge=-1, le=9)] | str = "medium sand"
    """Name of the sediment, or its grain size [phi]."""

    volume: VolumeSpectrum = "power-law"
    """Spectrum of the inhomogeneities inside the sediment: a power law of density (Jackson), or an isotropic cross
    section (TR 9407)."""

    @field_validator("sediment")
    @classmethod
    def _check_sediment(cls, value: str | float) -> str | float:
        return checked_sediment(value)

    @model_validator(mode="after")
    def _check_volume_parameters(self) -> Self:
        if self.law == SMALL_SLOPE and "volume" in self.model_fields_set:
            raise field_error(
                "volume", self.volume, "is for a law with an inside; small-slope is the surface alone. Leave volume "
                "out, or write law: jackson.",
            )  # fmt: skip
        return self

    def at(self, frequency: float, sound_speed: float) -> CompiledLaw:
        """The law at one frequency [Hz], over water of one sound speed [m/s], ready for the engine."""
        return _sediment_law(self.law, self.volume, self.sediment, frequency, sound_speed)


class TableLaw(Model):
    """A measured law: backscattering strength against grazing angle, the same at every frequency."""

    law: Literal["table"] = "table"
    """Name of the law."""
    file: DataFile
    """Path of a CSV file with columns grazing_deg and strength_db; beside the scenario file, unless absolute."""
    sha256: Fingerprint = None
    """Fingerprint of the file, filled in when it is read; a file that has changed since is refused."""

    @model_validator(mode="after")
    def _check_table(self) -> Self:
        require_unchanged(self.file, self.sha256)
        try:
            table = _table(self.file, self.sha256)
        except OSError as fault:
            advice = "Give the path of a table (CSV) with the columns grazing_deg and strength_db."
            raise field_error("file", None, f"{self.file} cannot be read: {fault.strerror}. {advice}") from None
        except ValueError as fault:  # names file, line and column
            raise field_error("file", None, str(fault)) from None
        if (excess := _max_albedo(table)) > 1:
            raise field_error(
                "file", None, f"{self.file}: the bed would send out {excess:.3g} times the sound that it receives. "
                "Strengths are 10 log10 of the cross section per unit area and solid angle, such as -25.",
            )  # fmt: skip
        return self

    def at(self, frequency: float, sound_speed: float) -> CompiledLaw:
        """The law, which is the same at every frequency [Hz] and sound speed [m/s], ready for the engine."""
        return _table_law(self.file, self.sha256)


@lru_cache(maxsize=16)
def _sediment_law(
    law: str, volume: VolumeSpectrum, sediment_name: str | float, frequency: float, sound_speed: float
) -> CompiledLaw:
    """Compiled law of a sediment, cached: its tables take a fraction of a second, and all pings use the same."""
    interior = sediment(sediment_name)
    if law == SMALL_SLOPE:
        return compile_law(SmallSlope(interior, frequency, sound_speed=sound_speed))
    kind = Jackson if law == "jackson" else SedimentVolume
    return compile_law(kind(interior, frequency, sound_speed=sound_speed, volume_spectrum=volume))


@lru_cache(maxsize=16)
def _table(file: str, sha256: str | None) -> TableScatteringLaw:
    """The table in a file, cached by the digest of its content."""
    return TableScatteringLaw.from_csv(file)


@lru_cache(maxsize=16)
def _table_law(file: str, sha256: str | None) -> CompiledLaw:
    """A table's law, ready for the engine."""
    return compile_law(_table(file, sha256))


def _max_albedo(table: TableScatteringLaw) -> float:
    """Largest albedo of a table's law over all angles [1]."""
    grazing = np.linspace(math.radians(2), math.pi / 2, 9)
    return float(albedo(table, grazing, points=32).max())
