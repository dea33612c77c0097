"""Lambert's law: an interface whose brightness does not depend on the direction of observation."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field

from insonify.model import Decibels
from insonify.scattering.law import Floats, checked_angles
from insonify.units import intensity_ratio
from insonify.validity import require_number

STRONGEST_DB = 10 * math.log10(1 / math.pi)
"""Strength of an interface that scatters all the incident energy [dB]."""
WEAKEST_DB = -400.0
"""Smallest strength [dB]; for an interface without an echo a scenario leaves the law out."""


def _passive(strength_db: float) -> float:
    if strength_db > STRONGEST_DB + 1e-9:
        raise ValueError(
            f"Lambert.strength_db is {strength_db:g} dB; above {STRONGEST_DB:.2f} dB (10 log10 1/pi) "
            f"the interface would scatter more energy than it receives. Give a lower strength, such as -27"
        )
    return min(strength_db, STRONGEST_DB)


LambertStrength = Annotated[Decibels, AfterValidator(_passive), Field(ge=WEAKEST_DB, le=STRONGEST_DB)]


@dataclass(frozen=True, slots=True)
class Lambert:
    """Cross section proportional to the sines of both grazing angles, the same at every frequency.

    Source: Lambert's cosine law as used for the seabed by Mackenzie (1961), J. Acoust. Soc.
    Am. 33, 1498: -27 dB at 0.5 to 1 kHz; at higher frequencies fit the strength.

    Example:
        >>> grazing = np.radians([10, 30, 90])
        >>> (10 * np.log10(Lambert(strength_db=-27.0).cross_section(grazing, grazing, np.pi))).round().tolist()
        [-42.0, -33.0, -27.0]
    """

    citation: ClassVar[str] = "Mackenzie (1961), J. Acoust. Soc. Am. 33, 1498: Lambert's law for the seabed"
    """Source of the law."""

    # A scenario may write the strength as "-27 dB"; unknown keys are refused.
    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", allow_inf_nan=False)

    strength_db: LambertStrength = -27.0
    """Scattering strength at normal incidence, 10 log10(mu) [dB]."""
    law: Literal["lambert"] = "lambert"
    """Name of the law in a scenario file."""

    def __post_init__(self) -> None:
        """Refuse an interface that scatters more energy than it receives."""
        strength = require_number("Lambert.strength_db", self.strength_db, "dB", WEAKEST_DB, example="-27")
        object.__setattr__(self, "strength_db", _passive(strength))

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle, mu sin(in) sin(out) [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the plane of the interface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, without effect [rad], broadcast.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction lies behind the interface.
        """
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        mu = intensity_ratio(self.strength_db)
        # The azimuth matters for the shape only.
        sines = np.maximum(np.sin(grazing_in), 0) * np.maximum(np.sin(grazing_out), 0) * np.ones_like(azimuth)
        return np.asarray(mu * sines)
