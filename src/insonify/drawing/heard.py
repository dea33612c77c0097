"""What a recording holds, as levels that can be drawn, and the scenario it came from."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.processing.level import recorded_level
from insonify.scenario.load import parse
from insonify.scenario.scenario import Scenario
from insonify.units import level_db

Floats = NDArray[np.float64]

BELOW, ABOVE = 20.0, 24.0
"""How far an image reaches below and at least above its median [dB]: background in middling brown, shadows dark."""
BRIGHT = 0.9985
"""Part of an image that may not be brighter than its brightest colour [1]."""


@dataclass(frozen=True, slots=True)
class Heard:
    """The levels of a recording, and what is needed to read them."""

    level: Floats
    """Level [dB re 1 uPa], shape (ping, channel, time); NaN where a ping is not done."""
    time: Floats
    """Time after the start of transmission [s], shape (time,)."""
    steer: Floats
    """Steering of each channel [rad], shape (channel,)."""
    scenario: Scenario | None
    """What was simulated, where the recording says so."""
    title: str

    @property
    def sound_speed(self) -> float:
        """Sound speed [m/s]; 1500 where the recording does not say."""
        return 1500.0 if self.scenario is None else self.scenario.water.sound_speed

    def strength(self) -> Floats:
        """Level with the way out and back undone: an apparent target strength [dB re 1 m^2], shape of `level`.

        Source: sonar equation, EL - SL + 2 TL with spherical spreading; Urick (1983), Principles of
        Underwater Sound, ch. 2. Every echo is taken as direct.
        """
        if self.scenario is None:
            return self.level
        slant = np.maximum(self.time * self.sound_speed / 2, 1.0)
        absorption = float(self.scenario.water.absorption(self.scenario.sonar.pulse.frequency))
        lost = level_db(slant**4) + 2 * absorption * slant
        return np.asarray(self.level - self.scenario.sonar.source_level_db + lost)


def heard(dataset: xr.Dataset) -> Heard:
    """A recording ready to be drawn.

    Args:
        dataset: As from `simulate` or `open_recording`: `pressure` or `intensity` over (ping, channel, time).
    """
    text = dataset.attrs.get("scenario")
    return Heard(
        level=np.asarray(recorded_level(dataset).values),
        time=np.asarray(dataset["time"].values, float),
        steer=np.asarray(dataset["steer"].values, float),
        scenario=parse(Scenario, text) if text else None,
        title=str(dataset.attrs.get("title", "")),
    )


def colour_span(level: Floats) -> tuple[float, float]:
    """Levels of the darkest and brightest colour of an image [dB], multiples of 5 dB."""
    there = level[np.isfinite(level)]
    if there.size == 0:
        return -1.0, 0.0
    middle, high = np.quantile(there, [0.5, BRIGHT])
    return float(5 * np.floor((middle - BELOW) / 5)), float(5 * np.ceil(max(high, middle + ABOVE) / 5))
