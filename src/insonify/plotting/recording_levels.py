"""What a recording holds, as levels that can be drawn, and the scenario it came from."""

import warnings
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.processing.recording_level import recorded_level
from insonify.scenario.diagnostic import ScenarioError
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.units import level_db

Floats = NDArray[np.float64]

BELOW, ABOVE = 20.0, 24.0
"""How far an image reaches below and at least above its median [dB]: background in middling brown, shadows dark."""
DEEPEST = 60.0
"""How far the middling brown may be below the brightest colour [dB]."""
BRIGHT = 0.9985
"""Part of an image that may not be brighter than its brightest colour [1]."""


@dataclass(frozen=True, slots=True)
class RecordingLevels:
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
    expected: bool = False
    """Whether these are expected levels, free of speckle."""
    beam: int | None = None
    """Number of the only beam that is held; None: all of them."""

    @property
    def sound_speed(self) -> float:
        """Sound speed [m/s]; 1500 where the recording does not say."""
        return 1500.0 if self.scenario is None else self.scenario.water.sound_speed

    @property
    def sound_speed_note(self) -> str:
        """What an axis of range adds in water of several sound speeds; empty in any other."""
        layered = self.scenario is not None and self.scenario.water.layered
        return f", at the mean of {self.sound_speed:.1f} m/s" if layered else ""

    def only(self, beam: int) -> "RecordingLevels":
        """One beam alone, which keeps its number."""
        row = slice(beam, beam + 1)
        return replace(self, level=self.level[:, row], steer=self.steer[row], beam=beam)

    @property
    def part(self) -> str:
        """How much of a survey that is not whole is there; empty of one that is."""
        return progress_note(int((~np.isnan(self.level)).any(axis=(1, 2)).sum()), len(self.level))

    def named(self, *, ping: int | None = None, channel: int | None = None) -> str:
        """What a picture of one ping, or of one channel, is called.

        Args:
            ping: Number of the ping; left out where there is but one.
            channel: Row of the beam; left out where the recording has but one.
        """
        parts = [self.title, "expected level" if self.expected else ""]
        if ping is not None and len(self.level) > 1:
            parts.append(f"ping {ping}")
        elif ping is None:
            parts.append(self.part)
        if channel is not None and (len(self.steer) > 1 or self.beam is not None):
            number = channel if self.beam is None else self.beam
            parts.append(f"{self._side(number)}beam {number} steered {np.degrees(self.steer[channel]):+.2f} deg")
        return ", ".join(part for part in parts if part)

    def _side(self, channel: int) -> str:
        """The side of a channel, to be followed by a comma; empty where the sonar has none."""
        side = 0 if self.scenario is None else self.scenario.sonar.channel_sides[channel]
        return {-1: "port, ", 0: "", 1: "starboard, "}[side]

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


def progress_note(done: int, pings: int) -> str:
    """How much of a survey is drawn, such as "19 of 40 pings"; empty where it is all there.

    Args:
        done: Pings that are there.
        pings: Pings of the track.
    """
    return f"{done} of {pings} pings" if done < pings else ""


def recording_levels(dataset: xr.Dataset) -> RecordingLevels:
    """A recording ready to be drawn.

    Args:
        dataset: As from `simulate` or `open_recording`: `pressure` or `intensity` over (ping, channel, time).
    """
    text = dataset.attrs.get("scenario")
    return RecordingLevels(
        level=np.asarray(recorded_level(dataset).values),
        time=np.asarray(dataset["time"].values, float),
        steer=np.asarray(dataset["steer"].values, float),
        scenario=_scenario(text) if text else None,
        title=str(dataset.attrs.get("title", "")),
        expected="intensity" in dataset,
    )


@lru_cache(maxsize=2)
def _scenario(text: str) -> Scenario | None:
    """The scenario of a recording; None, with a warning, where only a file that it names is no longer there."""
    try:
        return parse_model(Scenario, text, recorded=True)
    except ScenarioError as error:
        if not all(fault.field.endswith("file") for fault in error.faults):
            raise
        warnings.warn(f"drawn without its scenario, for a file is not what it was: {error}", stacklevel=3)
        return None


def colour_span(level: Floats) -> tuple[float, float]:
    """Levels of the darkest and brightest colour of an image [dB], multiples of 5 dB."""
    there = level[np.isfinite(level)]
    if there.size == 0:
        return -1.0, 0.0
    middle, high = np.quantile(there, [0.5, BRIGHT])
    middle = max(middle, high - DEEPEST)  # where the median is silence, echoes alone make the image
    return float(5 * np.floor((middle - BELOW) / 5)), float(5 * np.ceil(max(high, middle + ABOVE) / 5))
