"""Distributions of the values that a data set varies, as inverse distribution functions of uniform numbers.

A value is a function of one uniform number, so it belongs to its key and its image, whatever is drawn before it.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from insonify.model import Metres, Model, field_error
from insonify.units import UNITS, si

Floats = NDArray[np.float64]
Fraction = Annotated[float, Field(ge=0, le=1)]
Distance = Annotated[Metres, Field(ge=0)]
Integer = Annotated[int, Field(ge=-(2**53), le=2**53)]
MOST = 1e12
"""Largest quantity of a distribution, in SI: powers of it are numbers still."""
LEAST_KEPT = 1e-9
"""Least part of a distribution that its limits may keep [1]: draws of less are too coarse."""


def _quantity(value: object) -> object:
    """A number with its unit as typed, refused where it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError("is not a number with or without a unit, such as 20 or '20 deg'")
    if not abs(in_si(value)) <= MOST:
        raise ValueError(f"{value} is out of range (-{MOST:g} to {MOST:g} in SI)")
    return value


def _positive(value: float | str) -> float | str:
    if in_si(value) <= 0:
        raise ValueError(f"{value} is not above 0")
    return value


def _not_tiny(value: float | str) -> float | str:
    if in_si(value) < 1 / MOST:
        raise ValueError(f"{value} is out of range ({1 / MOST:g} to {MOST:g} in SI)")
    return value


Quantity = Annotated[float | str, BeforeValidator(_quantity)]
"""A number, in SI or with its unit, as typed."""
Positive = Annotated[Quantity, AfterValidator(_positive)]
NotTiny = Annotated[Positive, AfterValidator(_not_tiny)]


def in_si(value: float | str) -> float:
    """A quantity in SI, or in decibels.

    Args:
        value: Number, or text of a number and a unit of any dimension.

    Raises:
        ValueError: The text has no such form, or an unknown unit.
    """
    if not isinstance(value, str):
        return float(value)
    unit = value.strip().lstrip("+-0123456789.eE ").strip()
    if unit.split(" ")[0] == "dB":
        return float(value.split("dB")[0])
    dimension = next((name for name, units in UNITS.items() if not unit or unit in units), None)
    if dimension is None:
        known = ", ".join(name for units in UNITS.values() for name in units)
        raise ValueError(f"{value!r} is not a number with a unit; units are {known}, dB")
    return float(si(value, dimension))  # type: ignore[arg-type]


class Normal(Model):
    """Normal distribution, cut at its limits."""

    mean: Quantity
    """Mean before it is cut."""
    std: Positive
    """Standard deviation before it is cut."""
    within: tuple[Quantity, Quantity] | None = None
    """Limits; None: none."""


class Weibull(Model):
    """Weibull distribution, as of wind speeds and wave heights, cut at its limits."""

    scale: Positive
    """Value that 63 % of the draws stay below."""
    shape: Annotated[float, Field(gt=0, le=100)]
    """Exponent [1]: 1 for an exponential, 2 for a Rayleigh distribution."""
    within: tuple[Quantity, Quantity] | None = None
    """Limits; None: from 0 on."""


class BoundedPowerLaw(Model):
    """Power law, density proportional to x^-exponent, as of the sizes of fragments."""

    exponent: Annotated[float, Field(ge=-20, le=20)]
    """Exponent of the density [1]; one more than that of the number of larger ones."""
    within: tuple[NotTiny, NotTiny]
    """Limits."""


class Poisson(Model):
    """Poisson distribution: number of independent things."""

    mean: Annotated[float, Field(gt=0, le=1000)]
    """Mean [1]."""


class SwathArea(Model):
    """Part of the swath: uniform over its area."""

    area: Literal["swath"] = "swath"
    along: tuple[Fraction, Fraction] = (0.08, 0.92)
    """From and to, of the track's length [1]."""
    across: tuple[Distance, Distance] | None = None
    """Least and largest horizontal distance from the track [m]; None: that of the window, less its outer tenth."""
    side: Literal["port", "starboard", "both"] = "both"
    """Side of the track, of a sonar that looks to both."""
    apart: Annotated[Metres, Field(ge=0, le=1000)] = 0.0
    """Least distance to all positions drawn before it [m]."""

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        for name, pair in (("along", self.along), ("across", self.across)):
            if pair is not None and pair[0] > pair[1]:
                raise field_error(name, f"{pair[0]:g} to {pair[1]:g}", "is no range. Write the smaller value first.")
        return self


def swath_area(value: object) -> object:
    """An area given by its name alone."""
    return {"area": value} if isinstance(value, str) else value


class Draw(Model):
    """Distribution of one value: one of these keys."""

    uniform: tuple[Quantity, Quantity] | None = None
    """Least and largest value, all between them alike."""
    integers: tuple[Integer, Integer] | None = None
    """Least and largest whole number, all alike."""
    normal: Normal | None = None
    weibull: Weibull | None = None
    power_law: BoundedPowerLaw | None = None
    poisson: Poisson | None = None
    choice: Any = None
    """List of values, all alike; or values and their weights."""
    uniform_in: Annotated[SwathArea, BeforeValidator(swath_area)] | None = None
    """Position on the seabed, uniform over the swath."""

    @model_validator(mode="after")
    def _check_one_distribution(self) -> Self:
        names = [name for name in type(self).model_fields if getattr(self, name) is not None]
        if len(names) != 1:
            known = ", ".join(type(self).model_fields)
            raise field_error("", None, f"{' and '.join(names) or 'nothing'} given; one distribution is required. "
                              f"Write one of {known}.")  # fmt: skip
        limits = self.limits
        if limits is not None and limits[0] > limits[1]:
            shown = getattr(self, names[0])
            shown = getattr(shown, "within", shown)
            raise field_error(names[0], f"{shown[0]} to {shown[1]}", "is no range. Write the smaller value first.")
        if self.choice is not None:
            _check_choice(self.choice)
        if limits is not None and self._kept < LEAST_KEPT:
            about, within = getattr(self, names[0]), getattr(self, names[0]).within
            shape = f"scale {about.scale}" if self.weibull else f"mean {about.mean}, std {about.std}"
            raise field_error(f"{names[0]}.within", f"{within[0]} to {within[1]}", f"keeps less than {LEAST_KEPT:g} of "
                              f"the distribution of {shape}. Write limits around it.")  # fmt: skip
        return self

    @property
    def _kept(self) -> float:
        """Part of a normal or Weibull distribution that its limits keep [1]; 1 of others."""
        below = self._below_limits
        return 1.0 if below is None else float(below[1] - below[0])

    @property
    def _below_limits(self) -> Floats | None:
        """Probability below each limit of a normal or Weibull distribution, before it is cut, (2,); None of others."""
        limits = np.array(self.limits or (-np.inf, np.inf))
        if self.weibull is not None:
            with np.errstate(over="ignore"):
                power = (np.maximum(limits, 0) / in_si(self.weibull.scale)) ** self.weibull.shape
            return np.asarray(-np.expm1(-power))
        if self.normal is not None:
            from scipy.special import ndtr

            return np.asarray(ndtr((limits - in_si(self.normal.mean)) / in_si(self.normal.std)))
        return None

    @property
    def name(self) -> str:
        """Name of the distribution."""
        return next(name for name in type(self).model_fields if getattr(self, name) is not None)

    @property
    def limits(self) -> tuple[float, float] | None:
        """Least and largest value in SI; None: there are none, or no numbers."""
        given = getattr(self, self.name)
        pair = given if self.uniform or self.integers else getattr(given, "within", None)
        return None if pair is None else (in_si(pair[0]), in_si(pair[1]))

    @property
    def extremes(self) -> tuple[Any, ...]:
        """Values at the limits, or all choices, as they were typed."""
        if self.choice is not None:
            return choices(self.choice)[0]
        given = getattr(self, self.name)
        return tuple(given) if self.uniform or self.integers else tuple(getattr(given, "within", None) or ())

    def values(self, uniforms: Floats) -> list[Any]:
        """Values that belong to uniform numbers, numbers in SI.

        Args:
            uniforms: Numbers above 0 and below 1, shape (n,).
        """
        if self.choice is not None:
            among, weights = choices(self.choice)
            rows = np.searchsorted(np.cumsum(weights) / np.sum(weights), uniforms, side="right")
            return [among[row] for row in np.minimum(rows, len(among) - 1)]
        if self.integers is not None:
            low, high = self.integers
            return [int(value) for value in low + np.floor(uniforms * (high - low + 1))]
        if self.poisson is not None:
            return [int(count) for count in _poisson(self.poisson.mean, uniforms)]
        return [float(value) for value in self._continuous(uniforms)]

    def _continuous(self, u: Floats) -> Floats:
        low, high = self.limits or (-np.inf, np.inf)
        below = self._below_limits
        if self.uniform is not None:
            return low + u * (high - low)
        if self.power_law is not None:
            return _power_law(self.power_law.exponent, low, high, u)
        if self.weibull is not None and below is not None:
            scale, shape = in_si(self.weibull.scale), self.weibull.shape
            return np.clip(scale * (-np.log1p(-(below[0] + u * (below[1] - below[0])))) ** (1 / shape), low, high)
        if self.normal is not None and below is not None:
            from scipy.special import ndtri

            mean, std = in_si(self.normal.mean), in_si(self.normal.std)
            return np.clip(mean + std * ndtri(below[0] + u * (below[1] - below[0])), low, high)
        raise ValueError(f"{self.name} is a position; see insonify.datasets.swath")


def choices(choice: Any) -> tuple[tuple[Any, ...], Floats]:
    """Values of a choice and their weights, (n,)."""
    if isinstance(choice, Mapping):
        return tuple(choice), np.array([float(weight) for weight in choice.values()])
    return tuple(choice), np.ones(len(choice))


def _check_choice(choice: Any) -> None:
    if not isinstance(choice, list | tuple | dict) or not choice:
        raise field_error("choice", f"{choice}", "is no list of values. Write [sand, silt] or {sand: 3, silt: 1}.")
    if isinstance(choice, dict):
        bad = [
            key for key, weight in choice.items()
            if isinstance(weight, bool) or not isinstance(weight, int | float) or not 0 < weight <= MOST
        ]  # fmt: skip
        if bad:
            raise field_error(f"choice.{bad[0]}", f"{choice[bad[0]]}", "is no weight. Write a number above 0, "
                              f"{MOST:g} at most.")  # fmt: skip


def _power_law(exponent: float, low: float, high: float, u: Floats) -> Floats:
    """Draws of a density x^-exponent between two limits."""
    if abs(exponent - 1) < 1e-9:
        return np.asarray(low * (high / low) ** u)
    power = 1 - exponent
    return np.asarray((low**power + u * (high**power - low**power)) ** (1 / power))


def _poisson(mean: float, u: Floats) -> NDArray[np.intp]:
    """Draws of a Poisson distribution."""
    from scipy.special import pdtr

    return np.searchsorted(pdtr(np.arange(int(mean + 12 * np.sqrt(mean) + 20)), mean), u)
