"""What the seabed is made of, as far as sound can tell.

One number, the mean grain size, predicts density, sound speed and loss of a sediment well
enough for most work. It is counted in phi = -log2(diameter in mm): gravel -1, clay 9.
"""

import math
from dataclasses import dataclass
from difflib import get_close_matches
from typing import ClassVar

from pydantic import ConfigDict

from insonify.validity import warn_outside

LAW = "APL-UW TR 9407 (1994) grain-size regression"
REFERENCE_SPEED = 1528.0
"""Sound speed of the water in which TR 9407 turned attenuation into loss [m/s]."""

GRAIN_SIZE: dict[str, float] = {
    "sandy gravel": -1.0,
    "very coarse sand": -0.5,
    "muddy sandy gravel": 0.0,
    "coarse sand": 0.5,
    "gravelly sand": 0.5,
    "gravelly muddy sand": 1.0,
    "medium sand": 1.5,
    "muddy gravel": 2.0,
    "fine sand": 2.5,
    "silty sand": 2.5,
    "muddy sand": 3.0,
    "very fine sand": 3.5,
    "clayey sand": 4.0,
    "coarse silt": 4.5,
    "sandy silt": 5.0,
    "gravelly mud": 5.0,
    "medium silt": 5.5,
    "sand-silt-clay": 5.5,
    "sandy mud": 6.0,
    "fine silt": 6.5,
    "clayey silt": 6.5,
    "sandy clay": 7.0,
    "very fine silt": 7.5,
    "silty clay": 8.0,
    "clay": 9.0,
}
"""Mean grain size of each named sediment [phi]; APL-UW TR 9407 (1994), Table 2."""


@dataclass(frozen=True, slots=True)
class Sediment:
    """A uniform sediment that carries sound as a fluid with loss."""

    # A scenario may describe a sediment of its own, and may not misspell it.
    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", allow_inf_nan=False)

    density_ratio: float
    """Density over that of the water above [1]."""
    speed_ratio: float
    """Sound speed over that of the water above [1]."""
    loss: float
    """Loss parameter, |Im k / Re k| of the wavenumber in the sediment [1]."""
    name: str = ""
    """What a geologist would call it."""

    def __post_init__(self) -> None:
        """Refuse a medium that no sound could enter, or that would make sound."""
        for field, lowest in (("density_ratio", "above 0"), ("speed_ratio", "above 0"), ("loss", "0 or more")):
            value = getattr(self, field)
            if not math.isfinite(value) or value < 0 or (value == 0 and field != "loss"):
                raise ValueError(f"Sediment.{field} is {value}; give a finite number, {lowest}")

    @classmethod
    def named(cls, name: str) -> "Sediment":
        """The sediment that goes by a name, such as "medium sand".

        Args:
            name: One of `GRAIN_SIZE`, in any case.

        Returns:
            A typical sediment of that name.

        Raises:
            ValueError: The name is not known; the nearest ones are given.
        """
        plain = " ".join(name.lower().split())
        if plain not in GRAIN_SIZE:
            nearest = get_close_matches(plain, GRAIN_SIZE, n=3, cutoff=0.5) or list(GRAIN_SIZE)
            raise ValueError(f"{name!r} is not a known sediment; did you mean {' or '.join(nearest)}?")
        return cls._of_grain_size(GRAIN_SIZE[plain], plain)

    @classmethod
    def from_grain_size(cls, phi: float) -> "Sediment":
        """The typical sediment of a mean grain size.

        Args:
            phi: Mean grain size, -log2 of the diameter in mm [phi].

        Returns:
            Its density, sound speed and loss.

        Source: APL-UW TR 9407 (1994), section IV.A, eqs. 2-10; attenuation from Hamilton (1972),
        Geophysics 37, 620. Valid: -1 to 9 phi; sound speed and density are for 10 to 100 kHz.
        """
        return cls._of_grain_size(phi, f"grain size {phi:g} phi")

    @classmethod
    def _of_grain_size(cls, phi: float, name: str) -> "Sediment":
        if not math.isfinite(phi):
            raise ValueError(f"grain size is {phi}; give a finite number of phi, -1 (gravel) to 9 (clay)")
        warn_outside(LAW, "grain size", phi, -1.0, 9.0, "phi")
        speed_ratio = _speed_ratio(phi)
        return cls(_density_ratio(phi), speed_ratio, _loss(phi, speed_ratio), name)


def _density_ratio(phi: float) -> float:
    if phi < 1:
        return 0.007797 * phi**2 - 0.17057 * phi + 2.3139
    if phi < 5.3:
        return -0.0165406 * phi**3 + 0.2290201 * phi**2 - 1.1069031 * phi + 3.0455
    return -0.0012973 * phi + 1.1565


def _speed_ratio(phi: float) -> float:
    if phi < 1:
        return 0.002709 * phi**2 - 0.056452 * phi + 1.2778
    if phi < 5.3:
        return -0.0014881 * phi**3 + 0.0213937 * phi**2 - 0.1382798 * phi + 1.3425
    return -0.0024324 * phi + 1.0019


def _loss(phi: float, speed_ratio: float) -> float:
    """Loss parameter from the attenuation per wavelength [1]."""
    return _attenuation(phi) * speed_ratio * REFERENCE_SPEED / 1e3 * math.log(10) / (40 * math.pi)


def _attenuation(phi: float) -> float:
    """Attenuation in proportion to frequency, Hamilton (1972) [dB/m/kHz]."""
    pieces = (
        (0.0, (0.4556,)),
        (2.6, (0.4556, 0.0245)),
        (4.5, (0.1978, 0.1245)),
        (6.0, (8.0399, -2.5228, 0.20098)),
        (9.5, (0.9431, -0.2041, 0.0117)),
    )
    for upper, polynomial in pieces:
        if phi < upper:
            return sum(c * phi**n for n, c in enumerate(polynomial))
    return 0.0601
