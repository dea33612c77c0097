"""Levels of a recording with its axes and its scenario, as the figures need them."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.caller_warning import warn_caller
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.processing.recording_level import recorded_level
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.units import level_db

Floats = NDArray[np.float64]

BELOW, ABOVE = 20.0, 24.0
"""Range of colours below the median of an image, and least range above it [dB]."""
DEEPEST = 60.0
"""Largest range from the median to the brightest colour [dB]."""
BRIGHT = 0.9985
"""Quantile of an image that has the brightest colour [1]."""


@dataclass(frozen=True, slots=True)
class RecordingLevels:
    """Levels of a recording with time, steering and scenario."""

    level: Floats
    """Level [dB re 1 uPa], shape (ping, channel, time); NaN where a ping is not recorded."""
    time: Floats
    """Time after the start of transmission [s], shape (time,)."""
    steer: Floats
    """Steering of each channel [rad], shape (channel,)."""
    scenario: Scenario | None
    """Scenario of the recording, where it is stored."""
    title: str
    expected: bool = False
    """True for expected intensities, without speckle."""
    beam: int | None = None
    """Number of the single selected beam; None: all beams."""

    @property
    def sound_speed(self) -> float:
        """Sound speed [m/s]; 1500 without a scenario."""
        return 1500.0 if self.scenario is None else self.scenario.water.sound_speed

    @property
    def sound_speed_note(self) -> str:
        """Addition to the label of a range axis in layered water; empty in any other."""
        layered = self.scenario is not None and self.scenario.water.layered
        return f", at the mean of {self.sound_speed:.1f} m/s" if layered else ""

    def only(self, beam: int) -> "RecordingLevels":
        """Select one beam, which keeps its number."""
        row = slice(beam, beam + 1)
        return replace(self, level=self.level[:, row], steer=self.steer[row], beam=beam)

    @property
    def part(self) -> str:
        """Progress of an incomplete recording, such as "19 of 40 pings"; empty for a complete one."""
        return progress_note(int((~np.isnan(self.level)).any(axis=(1, 2)).sum()), len(self.level))

    def named(self, *, ping: int | None = None, channel: int | None = None) -> str:
        """Title of a figure of one ping, or of one channel.

        Args:
            ping: Number of the ping; left out where there is only one.
            channel: Row of the beam; left out where the recording has only one.
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
        """Side of a channel with a comma, as a part of a title; empty where the sonar has no sides."""
        side = 0 if self.scenario is None else self.scenario.sonar.channel_sides[channel]
        return {-1: "port, ", 0: "", 1: "starboard, "}[side]

    def strength(self) -> Floats:
        """Apparent target strength, the level corrected for two-way loss [dB re 1 m^2], shape of `level`.

        Source: sonar equation, EL - SL + 2 TL with spherical spreading; Urick (1983), Principles of
        Underwater Sound, ch. 2. Every echo is assumed direct.
        """
        if self.scenario is None:
            return self.level
        slant = np.maximum(self.time * self.sound_speed / 2, 1.0)
        absorption = float(self.scenario.water.absorption(self.scenario.sonar.pulse.frequency))
        loss = level_db(slant**4) + 2 * absorption * slant
        return np.asarray(self.level - self.scenario.sonar.source_level_db + loss)


def progress_note(done: int, pings: int) -> str:
    """Progress of a recording, such as "19 of 40 pings"; empty where it is complete.

    Args:
        done: Number of recorded pings.
        pings: Number of pings of the track.
    """
    return f"{done} of {pings} pings" if done < pings else ""


def recording_levels(dataset: xr.Dataset) -> RecordingLevels:
    """Compute the levels of a recording.

    Args:
        dataset: As from `simulate` or `open_recording`: `pressure` or `intensity` over (ping, channel, time).
    """
    text = dataset.attrs.get("scenario")
    return RecordingLevels(
        level=np.asarray(recorded_level(dataset).values), time=np.asarray(dataset["time"].values, float),
        steer=np.asarray(dataset["steer"].values, float), scenario=_scenario(text) if text else None,
        title=str(dataset.attrs.get("title", "")), expected="intensity" in dataset,
    )  # fmt: skip


@lru_cache(maxsize=2)
def _scenario(text: str) -> Scenario | None:
    """Scenario of a recording; None, with a warning, where only a file that it names is missing or changed."""
    try:
        return parse_model(Scenario, text, recorded=True)
    except ScenarioError as error:
        if not all(fault.field.endswith("file") for fault in error.faults):
            raise
        warn_caller(f"drawn without its scenario: a file has changed or is missing: {error}")
        return None


def colour_span(level: Floats) -> tuple[float, float]:
    """Levels of the darkest and brightest colour of an image [dB], multiples of 5 dB."""
    finite = level[np.isfinite(level)]
    if finite.size == 0:
        return -1.0, 0.0
    middle, high = np.quantile(finite, [0.5, BRIGHT])
    middle = max(middle, high - DEEPEST)  # a very low median must not extend the colours
    return float(5 * np.floor((middle - BELOW) / 5)), float(5 * np.ceil(max(high, middle + ABOVE) / 5))
