"""Measure: a statistic that follows from sums over units, so that units can be exchanged and resampled."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from insonify.comparison.frame import Frame, Side
from insonify.comparison.samples import Floats


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number of a measure."""

    name: str
    unit: str = "1"
    tested: bool = True
    """False of a number that is stated only."""


@dataclass(frozen=True, slots=True)
class Curve:
    """Curves of both recordings over one abscissa, for a picture."""

    x: Floats
    real: Floats
    simulated: Floats
    x_label: str
    y_label: str


class Measure(ABC):
    """Statistic of two recordings in one frame.

    A subclass sums what it needs over the units of one recording, and estimates its quantities from those sums, for
    any number of exchanged or resampled sums at once.
    """

    name: ClassVar[str]
    """Name in reports, in lower case."""
    least_samples: ClassVar[int] = 0
    """Fewest samples of range that it needs."""

    def __init__(self, frame: Frame) -> None:
        self.frame = frame

    @classmethod
    def unsuited(cls, frame: Frame) -> str:
        """Reason for which two recordings cannot be compared so, empty where they can."""
        return "" if frame.slant_range.size >= cls.least_samples else "too few samples of range"

    @property
    @abstractmethod
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities of one recording."""

    @property
    def distances(self) -> tuple[Quantity, ...]:
        """Quantities of two recordings together."""
        return ()

    @abstractmethod
    def sums(self, side: Side) -> Floats:
        """Sums over each unit of a recording, shape (unit, feature).

        Args:
            side: The recording.
        """

    @abstractmethod
    def estimate(self, sums: Floats) -> Floats:
        """Quantities of one recording, shape (..., quantity); NaN where they are not known.

        Args:
            sums: Sums over units, shape (..., feature).
        """

    def distance(self, first: Floats, second: Floats) -> Floats:
        """Distances between two recordings, shape (..., distance).

        Args:
            first: Sums of the real one, shape (..., feature).
            second: Sums of the simulated one, of the same shape.
        """
        return np.empty((*first.shape[:-1], 0))

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Curves for a picture.

        Args:
            first: Sums of the real recording, shape (feature,).
            second: Sums of the simulated one.
        """
        return ()

    def remark(self, first: Floats, second: Floats) -> str:
        """Addition to the verdict in words, or nothing.

        Args:
            first: Sums of the real recording, shape (feature,).
            second: Sums of the simulated one.
        """
        return ""


def ratio(numerator: Floats, denominator: Floats) -> Floats:
    """Quotient, NaN where the denominator is not positive.

    Args:
        numerator: Numerator, any shape.
        denominator: Denominator, broadcast with it.
    """
    positive = denominator > 0
    return np.asarray(np.where(positive, numerator / np.where(positive, denominator, 1.0), np.nan))


def decibels(power: Floats) -> Floats:
    """Level of a power [dB], NaN where it is not positive.

    Args:
        power: Power, any shape.
    """
    positive = power > 0
    return np.where(positive, 10 * np.log10(np.where(positive, power, 1.0)), np.nan)


def counted(values: Floats) -> Floats:
    """1 for each value that is known, NaN for the others.

    Args:
        values: Values, any shape.
    """
    return np.where(np.isfinite(values), 1.0, np.nan)


def total_level(frame: Frame, power: Floats, count: Floats) -> Floats:
    """Level to which others refer [dB], shape (..., 1): that of the mean intensity where units differ, else 0.

    The constant by which the simulated levels are raised is a number of both recordings, which varies with their
    exchange; so levels refer to the sums that are exchanged.

    Args:
        frame: The two recordings.
        power: Sums of intensities, shape (..., bin).
        count: Numbers of samples, of the same shape.
    """
    if frame.scaled_db == 0:
        return np.zeros((*power.shape[:-1], 1))
    return decibels(ratio(power.sum(axis=-1, keepdims=True), count.sum(axis=-1, keepdims=True)))
