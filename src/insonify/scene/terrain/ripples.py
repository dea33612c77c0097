"""Sand ripples: a train of narrow, slightly irregular crests across the seabed.

The terrain is (height / 2) a [cos(psi) + s cos(2 psi)]: the second harmonic is in phase with the first, so that crests
are narrow and troughs flat. The phase psi and the relative height a vary randomly and smoothly, which bends the crests
and makes groups of ripples.
"""

from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from insonify.model import Heading, Metres, Model
from insonify.scene.terrain.octaves import Octaves, unit_octave
from insonify.scene.terrain.relief import Relief, TerrainSample, broadcast_positions
from insonify.scene.terrain.roughness_cutoff import RoughnessCutoff
from insonify.validity import warn_outside

Floats = NDArray[np.float64]


class Ripples(Model):
    """A field of ripples of one direction and wavelength.

    The shape resembles wave-made ripples, except that crests bend but do not fork. Heights of 0.1 to 0.2 wavelengths
    are typical of sand.

    Example:
        >>> ripples = Ripples(wavelength="1 m", height="10 cm", direction="90 deg")
        >>> f"rms height {100 * ripples.variance ** 0.5:.1f} cm"
        'rms height 3.6 cm'
    """

    kind: Literal["ripples"] = "ripples"
    wavelength: Annotated[Metres, Field(gt=0, le=1000)] = 1.0
    """Wavelength, from crest to crest [m]."""
    height: Annotated[Metres, Field(ge=0, le=100)] = 0.05
    """Height from trough to crest, root mean square over the field [m]."""
    direction: Heading = 0.0
    """Compass direction across the crests; the opposite direction is equivalent [rad]."""
    sharpness: Annotated[float, Field(ge=0, le=0.25)] = 0.15
    """Ratio of the second harmonic to the first [1]: 0 a sine, 1/4 the flattest single trough."""
    irregularity: Annotated[float, Field(ge=0, le=0.5)] = 0.15
    """Rms displacement of the crests re the wavelength, and rms variation of the height re the height [1]."""
    group: Annotated[float, Field(ge=2, le=1000)] = 6.0
    """Size of a group of similar ripples [wavelengths]."""

    @model_validator(mode="after")
    def _check_steepness(self) -> Self:
        warn_outside("Sand ripples", "height over wavelength", self.height / self.wavelength, 0.0, 0.25, "")
        return self

    @property
    def wavenumber(self) -> float:
        """Wavenumber of the first harmonic [rad/m]; the second harmonic is cut off together with it."""
        return 2 * np.pi / self.wavelength

    @property
    def variance(self) -> float:
        """Mean square of the terrain [m^2]."""
        return (self.height / 2) ** 2 * (1 + self.sharpness**2) / 2

    def build_relief(
        self, *, seed: int, layer: int, cutoff: RoughnessCutoff, heading: float = 0.0
    ) -> "RippleRelief | None":
        """The ripples as resolved relief; None where they are shorter than the cutoff and left to the scattering law.

        Args:
            seed: Seed of the scene [1].
            layer: First of the two random streams that this relief uses [1].
            cutoff: Cutoff wavelength of the terrain.
            heading: Compass heading of the frame in which the field is evaluated [rad].
        """
        if self.wavenumber >= cutoff.wavenumber:
            return None
        pitch = self.group * self.wavelength / 2
        wander, growth = (unit_octave(pitch, seed=seed, layer=layer + n) for n in (0, 1))
        return RippleRelief(self, self.direction - heading, wander, growth)


@dataclass(frozen=True, slots=True)
class RippleRelief(Relief):
    """Realisation of a field of ripples as relief."""

    ripples: Ripples
    """Dimensions of the ripples."""
    bearing: float
    """Direction across the crests from the frame's first axis [rad]."""
    crest_wander: Octaves
    """Random displacement of the crests, unit variance."""
    height_variation: Octaves
    """Random variation of the height, unit variance."""

    @property
    def span(self) -> tuple[float, float]:
        """Trough and crest of the tallest ripple [m], see `Relief.span`."""
        tallest = self.ripples.height / 2 * (1 + 6 * self.ripples.irregularity)
        return -tallest, tallest * (1 + self.ripples.sharpness)

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient, see `Relief.sample`; the gradient includes that of both random variations."""
        r = self.ripples
        north, east = broadcast_positions(north, east)
        across = np.array([np.cos(self.bearing), np.sin(self.bearing)])
        wander, growth = self.crest_wander.sample(north, east), self.height_variation.sample(north, east)
        # reduced to one cycle before the factor 2 pi, for accuracy far from the origin
        cycles = (across[0] * north + across[1] * east) / r.wavelength + r.irregularity * wander.height
        gradient = across / r.wavelength + r.irregularity * wander.slope
        psi = 2 * np.pi * (cycles - np.floor(cycles))
        profile = np.cos(psi) + r.sharpness * np.cos(2 * psi)
        derivative = -2 * np.pi * (np.sin(psi) + 2 * r.sharpness * np.sin(2 * psi))
        scale = r.height / 2 / np.sqrt(1 + r.irregularity**2)
        factor = 1 + r.irregularity * growth.height
        slope = (factor * derivative)[..., None] * gradient + (r.irregularity * profile)[..., None] * growth.slope
        return TerrainSample(scale * factor * profile, scale * slope)
