"""Sea surface: model of its specular reflection, flat or moving, and its scattering law."""

import math
import warnings
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from insonify.model import Heading, Metres, MetresPerSecond, Model, field_error
from insonify.ocean.elfouhaily import Elfouhaily
from insonify.scattering.apl_surface import AplSurface
from insonify.scattering.compiled_law import CompiledLaw
from insonify.scattering.law import ScatteringLaw
from insonify.scene.boundary_law import BoundaryLaw, infer_law_kind, law_at
from insonify.validity import PhysicsWarning


class AplSurfaceLaw(Model):
    """Backscattering law of the surface at a wind speed: facets, ripples and bubbles of APL-UW TR 9407."""

    law: Literal["apl-surface"] = "apl-surface"
    """Name of the law."""
    wind_speed: Annotated[MetresPerSecond, Field(ge=0, le=30)]
    """Wind at a height of 10 m [m/s]."""

    def at(self, frequency: float, sound_speed: float) -> AplSurface:
        """The law at one frequency [Hz], the same at every sound speed [m/s]."""
        return AplSurface(self.wind_speed, frequency)


SurfaceLaw = BoundaryLaw | AplSurfaceLaw


class Swell(Model):
    """One long-crested sinusoidal wave of unlimited duration and extent."""

    height: Annotated[Metres, Field(gt=0, le=30)]
    """Height from trough to crest [m]."""
    length: Annotated[Metres, Field(gt=0, le=1000)]
    """Wavelength, from crest to crest [m]."""

    @property
    def curvature(self) -> float:
        """Greatest curvature [1/m]."""
        return 2 * math.pi**2 * self.height / self.length**2


class Surface(Model):
    """A sea surface at a mean depth of zero.

    Example:
        >>> sea = Surface(reflection="statistical", wind_speed="5 m/s")
        >>> f"dominant waves {sea.dominant_wavelength:.0f} m long"
        'dominant waves 23 m long'
    """

    reflection: Literal["flat", "statistical", "tilted", "explicit"] = "flat"
    """Model of surface reflection. flat: specular reflection with coefficient -1. statistical: a wind sea, by a
    coherent part and glints. tilted: specular reflection off the tangent plane of the swell at the bounce point of the
    flat surface. explicit: reflection at all specular points of a realised sum of waves; shorter waves are treated as
    for a statistical bounce."""
    wind_speed: Annotated[MetresPerSecond, Field(gt=0, le=30)] | None = None
    """Wind 10 m above the sea, for a statistical bounce or for waves [m/s]."""
    swell: Swell | None = None
    """Swell: the wave that tilts a tilted surface, or one of the waves of an explicit one."""
    cutoff_wavelength: Annotated[Metres, Field(ge=0.1, le=1000)] | None = None
    """Shortest wavelength of the wind sea that is realised [m]; None: half the dominant wavelength."""
    wave_direction: Heading = 0.0
    """Direction of propagation of the waves, clockwise from north [rad]."""
    scattering: Annotated[
        Annotated[SurfaceLaw, Field(discriminator="law")] | None,
        BeforeValidator(infer_law_kind, json_schema_input_type=SurfaceLaw | None),
    ] = None
    """Scattering law of the surface; None for a surface that reflects specularly only."""

    @model_validator(mode="after")
    def _check_wave_parameters(self) -> Self:
        required = {"wind_speed": ("statistical", "3 m/s"), "swell": ("tilted", "{height: 4 cm, length: 30 m}")}
        for name, (bounce, example) in required.items():
            is_given = getattr(self, name) is not None
            if bounce == self.reflection and not is_given:
                raise field_error(
                    name, "null", f"does not state what moves a {bounce} surface. Write {name}: {example}."
                )
            if is_given and self.reflection not in (bounce, "explicit"):
                raise field_error(
                    name, None, f"moves a {bounce} surface only, or waves. Write reflection: {bounce} or reflection: "
                    f"explicit, or leave {name} out.",
                )  # fmt: skip
        if self.reflection == "explicit" and self.wind_speed is None and self.swell is None:
            raise field_error(
                "wind_speed", "null", "and no swell: there are no waves. Write wind_speed: 5 m/s, or a swell."
            )
        self._require_valid_cutoff()
        return self

    def _require_valid_cutoff(self) -> None:
        """Refuse a cutoff without waves, or one that is longer than they are."""
        if self.cutoff_wavelength is None:
            return
        if self.reflection != "explicit" or self.wind_speed is None:
            raise field_error(
                "cutoff_wavelength",
                None,
                "divides the waves of a wind. Write reflection: explicit and a wind_speed, or leave it out.",
            )
        longest = self.dominant_wavelength
        if self.cutoff_wavelength >= longest:
            raise field_error(
                "cutoff_wavelength", f"{self.cutoff_wavelength:g} m", "is longer than the dominant waves of this wind "
                f"({longest:.3g} m), so that none would be drawn. Write less, such as {longest / 2:.2g} m, or "
                "reflection: statistical.",
            )  # fmt: skip

    @property
    def dominant_wavelength(self) -> float:
        """Wavelength of the dominant waves of the wind sea [m]."""
        assert self.wind_speed is not None
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # given where the sea is realised
            return 2 * math.pi / Elfouhaily(self.wind_speed).peak

    @property
    def shortest_explicit_wavelength(self) -> float:
        """Wavelength of the shortest waves of the wind sea that are realised [m]."""
        return self.dominant_wavelength / 2 if self.cutoff_wavelength is None else self.cutoff_wavelength

    def law(self, frequency: float, sound_speed: float) -> ScatteringLaw | CompiledLaw | None:
        """Law of the surface at one frequency [Hz], under water of one sound speed [m/s]; None: no scattering."""
        return law_at(self.scattering, frequency, sound_speed)

    def reflection_coefficient(self, grazing: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Pressure reflection coefficient of one surface bounce [1]: -1 at any grazing angle [rad], shape of these."""
        return np.full(np.shape(grazing), -1.0 + 0j)
