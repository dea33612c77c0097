"""Samples of a recording or an image, whatever instrument or simulation they come from: the input of all measures."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Values = NDArray[Any]


def _none() -> Floats:
    return np.empty(0)


@dataclass(frozen=True, slots=True)
class Samples:
    """Complex or real amplitudes over (ping, beam, sample), on one axis of range.

    Example:
        >>> slant_range = 7.5 + 0.75 * np.arange(100)
        >>> samples = Samples("line.xtf", np.ones((20, 3, 100)), slant_range, "counts", parts=True)
        >>> samples.step, samples.is_complex, samples.beams().shape  # three sectors of one beam
        (0.75, False, (20, 1, 100))
    """

    name: str
    """File or title, with the group of data."""
    values: Values
    """Complex pressure or voltage, or amplitude; NaN where nothing was recorded; shape (ping, beam, sample)."""
    slant_range: Floats
    """Range of each sample, evenly spaced, rising [m], shape (sample,)."""
    unit: str
    """Unit of the values, such as uPa, V or counts; levels of equal units are compared as they are."""
    sound_speed: float = 1500.0
    """Sound speed by which time became range [m/s]."""
    frequency: float = np.nan
    """Centre frequency [Hz], NaN where it is not known."""
    pulse_length: float = np.nan
    """Duration of the pulse [s], NaN where it is not known."""
    angle: Floats = field(default_factory=_none)
    """Beam angle from the vertical, positive to starboard [rad], shape (beam,); empty where it is not known."""
    altitude: Floats = field(default_factory=_none)
    """Height above the seabed [m], shape (ping,); empty where it is not known."""
    depth: float = np.nan
    """Depth of the sonar below the water line [m], NaN where it is not known."""
    parts: bool = False
    """True where beams are parts of one aperture (sectors, elements), which are summed to one beam."""
    detected_range: Floats = field(default_factory=_none)
    """Slant range of the seabed as detected [m], shape (ping, beam); empty of sources that have no detections."""
    notes: tuple[str, ...] = ()
    """Treatment of the source: gains that were undone, what was missing or left out."""

    def __post_init__(self) -> None:
        """Refuse axes of unequal length."""
        if self.values.ndim != 3 or self.values.shape[2] != self.slant_range.size:
            raise ValueError(
                f"Samples.values has shape {self.values.shape}; slant_range has {self.slant_range.size} rows"
            )
        for name, rows in (("angle", self.values.shape[1]), ("altitude", self.values.shape[0])):
            if getattr(self, name).size not in (0, rows):
                raise ValueError(f"Samples.{name} has {getattr(self, name).size} rows; values have {rows}")

    @property
    def step(self) -> float:
        """Step of range [m]."""
        return float(self.slant_range[1] - self.slant_range[0]) if self.slant_range.size > 1 else np.nan

    @property
    def is_complex(self) -> bool:
        """True of samples with a phase."""
        return bool(np.iscomplexobj(self.values))

    def beams(self) -> Values:
        """Beams, parts of one aperture summed to their mean, shape (ping, beam, sample)."""
        if not self.parts or self.values.shape[1] == 1:
            return self.values
        return np.asarray(self.values.mean(axis=1, keepdims=True))


def amplitude_of_level(level: Floats) -> Floats:
    """Amplitude of a level [dB]: 0 at -inf, NaN at NaN.

    Args:
        level: Level [dB], any shape.
    """
    return np.where(np.isneginf(level), 0.0, 10 ** (np.maximum(level, -1000.0) / 20))
