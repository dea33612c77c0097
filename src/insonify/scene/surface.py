"""The sea surface: what paths bounce off, still or moving, and a scatterer of its own."""

import math
import warnings
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from insonify.noun import Metres, MetresPerSecond, Noun, Radians, located
from insonify.ocean.elfouhaily import Elfouhaily
from insonify.scattering.apl_surface import AplSurface
from insonify.scattering.lambert import Lambert
from insonify.scene.bottom_law import law_by_its_numbers
from insonify.validity import PhysicsWarning


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

    bounce: Literal["mirror", "statistical", "tilted", "waves"] = "mirror"
    """How a path bounces: off a flat mirror, which turns the sound's sign and keeps all of it; off a wind sea, by a
    coherent part and glints; off one plane, tilted as a swell is where the mirror's bounce point lies; or off waves
    that are drawn, at all points that reflect it, with what is too short to be drawn as of a statistical bounce."""
    wind_speed: Annotated[MetresPerSecond, Field(gt=0, le=30)] | None = None
    """Wind 10 m above the sea, for a statistical bounce or for waves [m/s]."""
    swell: Swell | None = None
    """The wave that tilts the plane of a tilted bounce, or one of the waves."""
    split: Annotated[Metres, Field(ge=0.1, le=1000)] | None = None
    """Length of the shortest waves of the wind that are drawn [m]; None for half that of the dominant ones."""
    waves_to: Radians = 0.0
    """Direction that the waves go to, from north clockwise [rad]."""
    scattering: Annotated[
        Annotated[Lambert | WindLaw, Field(discriminator="law")] | None, BeforeValidator(law_by_its_numbers)
    ] = None
    """Law of the surface's own reverberation; None for a surface that only mirrors."""

    @model_validator(mode="after")
    def _waves_for_the_bounce(self) -> Self:
        wants = {"wind_speed": ("statistical", "3 m/s"), "swell": ("tilted", "{height: 4 cm, length: 30 m}")}
        for name, (bounce, such_as) in wants.items():
            there = getattr(self, name) is not None
            if bounce == self.bounce and not there:
                raise located(name, "null", f"does not say what moves a {bounce} surface. Write {name}: {such_as}.")
            if there and self.bounce not in (bounce, "waves"):
                raise located(
                    name, None, f"moves a {bounce} surface only, or waves. Write bounce: {bounce} or bounce: waves, "
                    f"or leave {name} out.",
                )  # fmt: skip
        if self.bounce == "waves" and self.wind_speed is None and self.swell is None:
            raise located(
                "wind_speed", "null", "and no swell: there are no waves. Write wind_speed: 5 m/s, or a swell."
            )
        self._insist_on_a_split_sea()
        return self

    def _insist_on_a_split_sea(self) -> None:
        """Refuse a split that nothing asks for, or that is longer than the waves."""
        if self.split is None:
            return
        if self.bounce != "waves" or self.wind_speed is None:
            raise located(
                "split", None, "divides the waves of a wind. Write bounce: waves and a wind_speed, or leave it out."
            )
        longest = self.dominant_wave
        if self.split >= longest:
            raise located(
                "split", f"{self.split:g} m", f"is longer than the dominant waves of this wind ({longest:.3g} m), so "
                f"that none would be drawn. Write less, such as {longest / 2:.2g} m, or bounce: statistical.",
            )  # fmt: skip

    @property
    def dominant_wave(self) -> float:
        """Length of the wind's dominant waves [m]."""
        assert self.wind_speed is not None
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # the sea will say so itself
            return 2 * math.pi / Elfouhaily(self.wind_speed).peak

    @property
    def shortest_drawn(self) -> float:
        """Length of the shortest waves of the wind that are drawn [m]."""
        return self.dominant_wave / 2 if self.split is None else self.split

    def law(self, frequency: float) -> Lambert | AplSurface | None:
        """The law of the surface's own reverberation at one frequency [Hz]."""
        return self.scattering.at(frequency) if isinstance(self.scattering, WindLaw) else self.scattering

    def mirror(self, grazing: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Pressure reflection coefficient of one surface bounce: -1 at any grazing angle [rad]."""
        return np.full(np.shape(grazing), -1.0 + 0j)
