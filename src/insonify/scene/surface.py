"""The sea surface: what paths bounce off, still or moving, and a scatterer of its own."""

import math
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from insonify.noun import Metres, MetresPerSecond, Noun, Radians, located
from insonify.scattering.apl_surface import AplSurface
from insonify.scattering.lambert import Lambert
from insonify.scene.bottom_law import law_by_its_numbers


class WindLaw(Noun):
    """What the surface echoes under a wind: facets, ripples and bubbles of APL-UW TR 9407."""

    law: Literal["apl-surface"] = "apl-surface"
    """Name of the law."""
    wind_speed: Annotated[MetresPerSecond, Field(ge=0, le=30)]
    """Wind at a height of 10 m [m/s]."""

    def at(self, frequency: float) -> AplSurface:
        """The law at one frequency [Hz]."""
        return AplSurface(self.wind_speed, frequency)


class Swell(Noun):
    """One long-crested wave that runs on for ever."""

    height: Annotated[Metres, Field(gt=0, le=30)]
    """From trough to crest [m]."""
    length: Annotated[Metres, Field(gt=0, le=1000)]
    """From crest to crest [m]."""

    @property
    def curvature(self) -> float:
        """Greatest curvature [1/m]."""
        return 2 * math.pi**2 * self.height / self.length**2


class Surface(Noun):
    """A sea surface at a mean depth of zero."""

    bounce: Literal["mirror", "statistical", "tilted"] = "mirror"
    """How a path bounces: off a flat mirror, which turns the sound's sign and keeps all of it; off a wind sea, by a
    coherent part and glints; or off one plane, tilted as a swell is where the mirror's bounce point lies."""
    wind_speed: Annotated[MetresPerSecond, Field(gt=0, le=30)] | None = None
    """Wind 10 m above the sea, for a statistical bounce [m/s]."""
    swell: Swell | None = None
    """The wave that tilts the plane of a tilted bounce."""
    waves_to: Radians = 0.0
    """Direction that the waves go to, from north clockwise [rad]."""
    scattering: Annotated[
        Annotated[Lambert | WindLaw, Field(discriminator="law")] | None, BeforeValidator(law_by_its_numbers)
    ] = None
    """Law of the surface's own reverberation; None for a surface that only mirrors."""

    @model_validator(mode="after")
    def _waves_for_the_bounce(self) -> Self:
        needs = {"statistical": ("wind_speed", "3 m/s"), "tilted": ("swell", "{height: 4 cm, length: 30 m}")}
        for bounce, (name, such_as) in needs.items():
            there = getattr(self, name) is not None
            if bounce == self.bounce and not there:
                raise located(name, "null", f"does not say what moves a {bounce} surface. Write {name}: {such_as}.")
            if bounce != self.bounce and there:
                raise located(
                    name, None, f"moves a {bounce} surface only. Write bounce: {bounce}, or leave {name} out.",
                )  # fmt: skip
        return self

    def law(self, frequency: float) -> Lambert | AplSurface | None:
        """The law of the surface's own reverberation at one frequency [Hz]."""
        return self.scattering.at(frequency) if isinstance(self.scattering, WindLaw) else self.scattering

    def mirror(self, grazing: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Pressure reflection coefficient of one surface bounce: -1 at any grazing angle [rad]."""
        return np.full(np.shape(grazing), -1.0 + 0j)
