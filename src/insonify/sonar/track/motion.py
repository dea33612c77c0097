"""Random motion that waves and steering add to a platform's track, in six degrees of freedom.

Each degree of freedom is a stationary random function with a spectrum: a sum of waves of equal energy and random phase,
one frequency from each of as many parts of equal energy of the spectrum. Its mean square over an ensemble of seeds is
exactly the given one; that over one run converges to it as the run gets long. The random numbers of a wave depend on
the seed, the degree of freedom and the wave's number alone, so a ping has the same pose in every run.

The spectrum is a bell about one period, or a given table. The bell is a convention of this file: half of its energy
lies on either side of the period, and far above it falls as the fifth power of frequency, as that of wind waves.
Source: sums of waves with random phases, Rice (1944), Bell Syst. Tech. J. 23(3), 282-332.
"""

import itertools
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from insonify import random_keys
from insonify.model import Hertz, Metres, Model, Radians, Seconds, field_error

Floats = NDArray[np.float64]


def _not_negative(density: float) -> float:
    if density < 0:
        raise field_error("", f"{density:g}", "is negative; no spectrum is. Write 0 or more.")
    return density


MotionFrequency = Annotated[Hertz, Field(ge=0, le=1000)]
RelativeDensity = Annotated[float, AfterValidator(_not_negative), Field(ge=0, le=1e12)]

WAVES = 96
"""Waves in each degree of freedom [1]: kurtosis 3 - 1.5 / 96, so heights are practically Gaussian."""
_DENSITY_POINTS = 8192  # points on which a spectrum is integrated
_FREQUENCY_RATIO = 30.0  # highest frequency of a bell over its middle one, and middle over lowest


class MotionSpectrum(Model):
    """Spectrum of a random motion: distribution of its energy over frequencies."""

    period: Seconds | None = Field(default=None, gt=0, le=1e5)
    """Median period: half of the energy is at shorter periods [s]; None: a `spectrum` is given."""
    bandwidth: Annotated[float, Field(gt=0, le=1)] = 0.15
    """Width of the bell relative to its frequency: about half of the energy lies within it [1]."""
    spectrum: tuple[tuple[MotionFrequency, RelativeDensity], ...] | None = None
    """Rows of frequency [Hz] and relative spectral density [1], linear between the rows, 0 outside."""

    @model_validator(mode="after")
    def _check_spectrum(self) -> Self:
        rows = self.spectrum
        if getattr(self, "rms", 0.0) > 0 and (self.period is None) == (rows is None):
            problem = "needs either a period or a spectrum" if rows is None else "has a period and a spectrum"
            raise field_error("period", None, f"the motion {problem}. Give one of them, such as period: 8 s.")
        if rows is None:
            return self
        if len(rows) < 2:
            raise field_error(
                "spectrum", None, f"{len(rows)} rows are no spectrum. Give at least two of [frequency, density]."
            )
        for row, ((before, _), (frequency, _)) in enumerate(itertools.pairwise(rows), start=1):
            if frequency <= before:
                raise field_error(f"spectrum.{row}.0", f"{frequency:g} Hz", "is not above the row before. Sort the "
                              "rows by frequency.")  # fmt: skip
        if not any(density for _, density in rows):
            raise field_error("spectrum", None, "every density is 0: there is no motion. Leave it out instead.")
        return self

    def frequencies(self, share: Floats) -> Floats:
        """Quantiles of the spectrum: frequencies below which given fractions of the energy lie [Hz], shape of `share`.

        Args:
            share: Fraction of the energy, 0 to 1, any shape.
        """
        frequency, density = self._density()
        step = np.diff(frequency)
        cumulative = np.concatenate([[0.0], np.cumsum(step * (density[1:] + density[:-1]) / 2)])
        return np.interp(share, cumulative / cumulative[-1], frequency)

    def _density(self) -> tuple[Floats, Floats]:
        """Frequencies [Hz] and relative densities [1], dense enough for the trapezoidal rule, shape (n,) each."""
        if self.spectrum is not None:
            row = np.array(self.spectrum, dtype=float)
            frequency = np.unique(np.concatenate([row[:, 0], np.linspace(row[0, 0], row[-1, 0], _DENSITY_POINTS)]))
            return frequency, np.interp(frequency, *row.T)
        ratio = np.geomspace(1 / _FREQUENCY_RATIO, _FREQUENCY_RATIO, _DENSITY_POINTS)
        resonance = ratio**2 / ((1 - ratio**2) ** 2 + (2 * self.bandwidth * ratio) ** 2)
        density = resonance**2 / ratio
        return ratio / (self.period or 1.0), density


class RandomTranslation(MotionSpectrum):
    """A random displacement of the platform.

    Example:
        >>> heave = RandomTranslation(rms="20 cm", period="6 s")
        >>> heave.rms, heave.period
        (0.2, 6.0)
    """

    rms: Annotated[Metres, Field(ge=0, le=100)] = 0.0
    """Root mean square [m]."""


class RandomRotation(MotionSpectrum):
    """A random motion of the platform's attitude.

    Example:
        >>> roll = RandomRotation(rms="2 deg", period="7 s")
        >>> track = StaticTrack(position=(0, 0, 5), interval="1 s", pings=2000, motion=Motion(roll=roll))
        >>> print(np.degrees(true_poses(track, seed=1).roll.std()).round())
        2.0
    """

    rms: Annotated[Radians, Field(ge=0, le=1)] = 0.0
    """Root mean square [rad]."""


class Motion(Model):
    """Random motion that is added to the planned poses; by default none.

    Example:
        >>> heaving = Motion(heave={"rms": "0.2 m", "period": "6 s"})
        >>> track = StaticTrack(position=(0, 0, 5), interval="1 s", pings=2000, motion=heaving)
        >>> f"{true_poses(track, seed=1).position[:, 2].std():.1f} m"
        '0.2 m'
    """

    surge: RandomTranslation = RandomTranslation()
    """Displacement forward along the heading [m]."""
    sway: RandomTranslation = RandomTranslation()
    """Horizontal displacement to starboard [m]."""
    heave: RandomTranslation = RandomTranslation()
    """Displacement down [m]."""
    yaw: RandomRotation = RandomRotation()
    """Rotation added to the heading [rad]."""
    pitch: RandomRotation = RandomRotation()
    """Rotation bow up [rad]."""
    roll: RandomRotation = RandomRotation()
    """Rotation starboard down [rad]."""

    @property
    def is_still(self) -> bool:
        """True if no degree of freedom moves."""
        return not any(getattr(self, name).rms for name in DEGREES_OF_FREEDOM)


DEGREES_OF_FREEDOM = tuple(Motion.model_fields)
"""Names of the six degrees of freedom; the random numbers of each are keyed by its position in this list."""


def displacement(motion: Motion, time: Floats, seed: int) -> dict[str, Floats]:
    """Displacement of a platform in all degrees of freedom.

    Args:
        motion: Motion of the platform.
        time: Times since the first ping [s], shape (n,).
        seed: Seed of the scenario.

    Returns:
        Displacement in each degree of freedom, translations [m] and rotations [rad], each of shape (n,), by name.
    """
    return {name: _sum_of_waves(getattr(motion, name), time, seed, row) for row, name in enumerate(DEGREES_OF_FREEDOM)}


def _sum_of_waves(motion: RandomTranslation | RandomRotation, time: Floats, seed: int, row: int) -> Floats:
    """Random function of one degree of freedom: a sum of waves, one from each of `WAVES` equal shares of the spectrum.

    Args:
        motion: Spectrum and root mean square.
        time: Times since the first ping [s], shape (n,).
        seed: Seed of the scenario.
        row: Position of the degree of freedom in `DEGREES_OF_FREEDOM`.

    Returns:
        Displacement [m] or rotation [rad], shape (n,).
    """
    total = np.zeros(len(time))
    if motion.rms == 0:
        return total
    number = np.arange(WAVES)
    uniforms = random_keys.uniforms(seed, random_keys.MOTION, number, row)
    frequency = motion.frequencies((number + uniforms[:, 0]) / WAVES)
    for f, phase in zip(frequency, uniforms[:, 1], strict=True):
        total += np.cos(2 * np.pi * (f * time + phase))
    return np.asarray(motion.rms * np.sqrt(2 / WAVES) * total)
