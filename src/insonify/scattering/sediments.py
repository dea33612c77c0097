"""Acoustic properties of seabed sediments.

One number, the mean grain size, predicts density, sound speed, loss, roughness and volume scattering of a
sediment well enough for most work. Its unit is phi = -log2(diameter in mm): gravel -1, clay 9. Rock and
stones have no grain size; the handbook lists their properties separately.
"""

import math
from dataclasses import dataclass
from difflib import get_close_matches
from typing import ClassVar

from pydantic import ConfigDict

from insonify.validity import require_number, warn_outside

LAW = "APL-UW TR 9407 (1994) grain-size regression"
REFERENCE_SPEED = 1528.0
"""Sound speed of the water for which TR 9407 converts attenuation into loss [m/s]."""

LARGEST_GRAIN, SMALLEST_GRAIN = -8.0, 14.0
"""Grain size of boulder and colloid, beyond which a value is a mistake [phi]."""

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

STONES: dict[str, tuple[float, float, float]] = {
    "rough rock": (2.5, 2.5, 0.20693),
    "rock": (2.5, 2.5, 0.01862),
    "cobble": (2.5, 1.8, 0.0160),
    "gravel": (2.5, 1.8, 0.0160),
    "pebble": (2.5, 1.8, 0.0160),
}
"""Density ratio [1], speed ratio [1] and spectral strength w2 [cm^4] of rock and stones; TR 9407, Table 2."""
STONE_LOSS = 0.01374
"""Loss parameter of rock and stones [1]; TR 9407, Table 2."""
SPECTRAL_EXPONENT = 3.25
"""Exponent of the handbook's roughness spectrum, for every sediment [1]."""


def si_spectral_strength(strength_cm4: float, exponent: float = SPECTRAL_EXPONENT) -> float:
    """Convert a spectral strength of TR 9407 into SI units.

    Args:
        strength_cm4: The handbook's w2, for wavenumbers in units of 1/cm [cm^4].
        exponent: Exponent of the spectrum [1].

    Returns:
        Factor of K^-exponent in the spectrum of heights, for K in rad/m [m^(4 - exponent)].
    """
    return strength_cm4 * 1e-8 * 0.01**-exponent


@dataclass(frozen=True, slots=True)
class Sediment:
    """Uniform sediment, a fluid with loss under a rough surface.

    Example:
        >>> sand = Sediment.named("medium sand")
        >>> f"density ratio {sand.density_ratio:.2f}, speed ratio {sand.speed_ratio:.2f}, loss {sand.loss:.3f}"
        'density ratio 1.84, speed ratio 1.18, loss 0.016'
        >>> f"speed ratio {Sediment.from_grain_size(8.0).speed_ratio:.2f}"  # silty clay
        'speed ratio 0.98'
    """

    # A scenario may describe a sediment; unknown keys are refused.
    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", allow_inf_nan=False)

    density_ratio: float
    """Density over that of the water above [1]."""
    speed_ratio: float
    """Sound speed over that of the water above [1]."""
    loss: float
    """Loss parameter, |Im k / Re k| of the wavenumber in the sediment [1]."""
    volume_parameter: float = 0.002
    """Volume scattering cross section of the sediment over its attenuation, (1/m) per (dB/m) [1/dB]."""
    spectral_exponent: float = SPECTRAL_EXPONENT
    """Exponent gamma of the roughness spectrum W(K) = strength K^-gamma, 2 to 4 exclusive [1]."""
    spectral_strength: float = 1.406e-4
    """Factor of the two-sided, two-dimensional roughness spectrum [m^(4 - gamma)]; by default that of sand."""
    name: str = ""
    """Name of the sediment class."""

    def __post_init__(self) -> None:
        """Refuse impossible ratios, a negative loss, and an exponent without finite roughness."""
        for field in ("density_ratio", "speed_ratio", "loss", "volume_parameter", "spectral_strength"):
            exclude_0 = field not in ("loss", "volume_parameter")
            object.__setattr__(
                self, field, require_number(f"Sediment.{field}", getattr(self, field), "", 0.0, exclude_low=exclude_0)
            )
        exponent = require_number("Sediment.spectral_exponent", self.spectral_exponent, "", example="3.25")
        object.__setattr__(self, "spectral_exponent", exponent)
        if not 2 < self.spectral_exponent < 4:
            raise ValueError(
                f"Sediment.spectral_exponent is {self.spectral_exponent}; a power-law relief needs an exponent "
                f"between 2 (no finite roughness) and 4 (no roughness at short scales), such as 3.25"
            )

    def __str__(self) -> str:
        return (
            f"{self.name or 'sediment'}: {self.density_ratio:.4g} x the density of the water, "
            f"{self.speed_ratio:.4g} x its sound speed, loss {self.loss:.4g}; volume parameter "
            f"{self.volume_parameter:g} 1/dB; relief {self.spectral_strength:.3g} K^-{self.spectral_exponent:g} [m^4]"
        )

    @classmethod
    def named(cls, name: str) -> "Sediment":
        """Typical sediment of a name, such as "medium sand".

        Args:
            name: One of `GRAIN_SIZE` or `STONES`, in any case.

        Returns:
            Sediment with the properties of that name.

        Raises:
            ValueError: The name is unknown; the nearest names are listed.

        Source: APL-UW TR 9407 (1994), Table 2.
        """
        if not isinstance(name, str):
            raise ValueError(f"{name!r} is not the name of a sediment; give one such as 'medium sand'")
        plain = " ".join(name.lower().replace("_", " ").split())
        if plain in GRAIN_SIZE:
            return cls._of_grain_size(GRAIN_SIZE[plain], plain)
        if plain in STONES:
            density, speed, strength = STONES[plain]
            return cls(density, speed, STONE_LOSS, spectral_strength=si_spectral_strength(strength), name=plain)
        known = [*STONES, *GRAIN_SIZE]
        kinds = [other for other in known if plain in other.split()]  # "sand" may be of many sizes
        nearest = kinds or get_close_matches(plain, known, n=3, cutoff=0.5)
        *others, last = nearest or known
        either = f"{', '.join(others)} or {last}" if others else last
        hint = f"did you mean {either}?" if nearest else f"the known ones are {either}"
        raise ValueError(f"{name!r} is not a known sediment; {hint}")

    @classmethod
    def from_grain_size(cls, phi: float) -> "Sediment":
        """Typical sediment of a mean grain size.

        Args:
            phi: Mean grain size, -log2 of the diameter in mm [phi].

        Returns:
            Sediment with the density, sound speed, loss, roughness and volume parameter of that grain size.

        Raises:
            ValueError: The grain size is outside -8 to 14 phi.

        Source: APL-UW TR 9407 (1994), section IV.A, eqs. 2-10; attenuation from Hamilton (1972),
        Geophysics 37, 620. Valid: -1 to 9 phi; sound speed and density are for 10 to 100 kHz.
        Roughness and volume parameter are the least certain: they vary by a factor of 10 in either direction.
        """
        size = require_number("grain size", phi, "phi", example="1.5 for medium sand")
        return cls._of_grain_size(size, f"grain size {size:g} phi")

    @classmethod
    def _of_grain_size(cls, phi: float, name: str) -> "Sediment":
        if not LARGEST_GRAIN <= phi <= SMALLEST_GRAIN:
            raise ValueError(f"grain size is {phi}; give a finite number of phi, -1 (gravel) to 9 (clay)")
        warn_outside(LAW, "grain size", phi, -1.0, 9.0, "phi")
        speed_ratio = _speed_ratio(phi)
        volume_parameter = 0.002 if phi < 5.5 else 0.001
        strength = si_spectral_strength(0.00207 * _relief_cm(phi) ** 2)
        loss = _loss(phi, speed_ratio)
        return cls(_density_ratio(phi), speed_ratio, loss, volume_parameter, SPECTRAL_EXPONENT, strength, name)


def checked_sediment(sediment: Sediment, field: str = "sediment") -> Sediment:
    """Refuse a value that is not a sediment.

    Args:
        sediment: Value to check, returned unchanged.
        field: Name of the field or argument, for the error message.

    Raises:
        ValueError: The value is of another type, such as the name of a sediment.
    """
    if isinstance(sediment, Sediment):
        return sediment
    name = sediment if isinstance(sediment, str) else "medium sand"
    raise ValueError(f"{field} is {sediment!r}; give a Sediment, such as Sediment.named({name!r})")


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


def _relief_cm(phi: float) -> float:
    """Rms height of the relief over about 1 m for a grain size [cm]."""
    return (2.03846 - 0.26923 * phi) / (1 + 0.076923 * phi) if phi < 5 else 0.5


def _attenuation(phi: float) -> float:
    """Attenuation in proportion to frequency, Hamilton (1972) [dB/m/kHz]."""
    polynomials_below = (  # upper limit of phi; coefficients, of phi^0 first
        (0.0, (0.4556,)),
        (2.6, (0.4556, 0.0245)),
        (4.5, (0.1978, 0.1245)),
        (6.0, (8.0399, -2.5228, 0.20098)),
        (9.5, (0.9431, -0.2041, 0.0117)),
    )
    for upper, polynomial in polynomials_below:
        if phi < upper:
            return sum(c * phi**n for n, c in enumerate(polynomial))
    return 0.0601
