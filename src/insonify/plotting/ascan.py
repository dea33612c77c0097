"""The A-scan: what one ping brings back, as level over time, with a closer look at what lies in the water."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from insonify.plotting import style
from insonify.plotting.recording_levels import RecordingLevels
from insonify.plotting.target_view import echo_window, loudest_target
from insonify.units import amplitude_ratio

BEFORE, AFTER = 0.2, 0.8
"""How far the closer look reaches before and after a target's echoes, as a part of their span [1]."""
LEAST = 3.0
"""How far it reaches at least [ms]."""
MAX_BEAMS = 2
"""Beams of one ping up to which levels are shown by contribution."""
DEEPEST = 120.0
"""Levels this far below the loudest part of what is seen are not drawn [dB]."""


@dataclass(frozen=True, slots=True)
class TargetWindow:
    """What is drawn larger."""

    label: str
    """Of the target."""
    channel: int
    """Row of the beam in which it is loudest."""
    window: tuple[float, float]
    """Start and stop [ms]."""


def ascan(sound: RecordingLevels, row: int) -> Figure:
    """One ping: the whole window in decibels, and beneath it the loudest target's neighbourhood in linear units.

    Args:
        sound: The recording.
        row: Which ping.
    """
    near, contributions = target_window(sound, row), levels_by_contribution(sound, row)
    panels = sound.level.shape[1] + (near is not None)
    figure = style.new_figure(10, 1.2 + 2.9 * panels)
    rows = figure.subplots(panels, 1, squeeze=False)[:, 0]
    for channel, axes in enumerate(rows[: sound.level.shape[1]]):
        trace(axes, sound, row, channel)
        if channel < len(contributions):
            _causes(axes, sound, contributions[channel])
        axes.set_title(sound.named(ping=row, channel=channel))
    if near is not None:
        envelope(rows[-1], sound, row, near)
    return figure


def levels_by_contribution(sound: RecordingLevels, row: int) -> list[xr.Dataset]:
    """Expected levels of one ping by contribution, for each beam shown; none where there are many, or no scenario.

    Args:
        sound: The recording.
        row: Which ping.
    """
    held = [sound.beam] if sound.beam is not None else list(range(len(sound.steer)))
    if sound.scenario is None or len(held) > MAX_BEAMS:
        return []
    from insonify.simulator import levels  # all engines, which a picture of many pings does without

    return [levels(sound.scenario, row, channel=channel) for channel in held]


def _causes(axes: Axes, sound: RecordingLevels, expected: xr.Dataset) -> None:
    """Expected level of each contribution that is heard, over the trace."""
    time, whole = expected["time"].values * 1e3, expected["level_db"].sel(pair="all")
    lowest, shown = axes.get_ylim()[0], 0
    for contribution in (name for name in whole["contribution"].values if name != "total"):
        level = whole.sel(contribution=contribution).values
        if np.isfinite(level).any() and level.max() > lowest:
            axes.plot(time, np.where(level > lowest, level, np.nan), color=style.CONTRIBUTION_COLOURS[str(contribution)], linewidth=1.2,
                      linestyle="--" if contribution == "noise" else "-", alpha=0.9,
                      label=str(contribution))  # fmt: skip
            shown += 1
    if shown:
        name = "expected by" if sound.expected else "this ping; expected by"
        axes.legend(loc="upper right", ncols=shown, title=name, title_fontsize=8, fontsize=8)


def trace(
    axes: Axes, sound: RecordingLevels, row: int, channel: int, window: tuple[float, float] | None = None
) -> None:
    """Level over time of one ping and channel.

    Args:
        axes: Where to draw.
        sound: The recording.
        row: Which ping.
        channel: Which beam.
        window: Start and stop [ms]; all by default.
    """
    time, level = sound.time * 1e3, sound.level[row, channel]
    axes.plot(time, level, color=style.INK, linewidth=0.6)
    axes.set_xlim(*(window or (time[0], time[-1])))
    seen = level[(time >= axes.get_xlim()[0]) & (time <= axes.get_xlim()[1])]
    finite = seen[np.isfinite(seen)]
    if finite.size:
        top, low = finite.max(), np.quantile(finite, 0.06)
        axes.set_ylim(max(low - 15, top - DEEPEST), top + 5)
    axes.set_xlabel("time after the start of transmission [ms]")
    axes.set_ylabel("level [dB re 1 uPa]")
    style.range_axis(axes, sound.sound_speed, _altitude(sound), sound.sound_speed_note)


def envelope(axes: Axes, sound: RecordingLevels, row: int, look: TargetWindow) -> None:
    """Rms pressure over time in linear units, in a window about a target.

    Args:
        axes: Where to draw.
        sound: The recording.
        row: Which ping.
        look: The target, its beam and the window.
    """
    time = sound.time * 1e3
    inside = (time >= look.window[0]) & (time <= look.window[1])
    pressure = amplitude_ratio(sound.level[row, look.channel, inside]) / 1e3
    axes.fill_between(time[inside], pressure, color=style.CONTRIBUTION_COLOURS["target"], alpha=0.25, linewidth=0)
    axes.plot(time[inside], pressure, color=style.CONTRIBUTION_COLOURS["target"], linewidth=0.9)
    axes.set_xlim(*look.window)
    axes.set_ylim(0)
    beam = f", beam {look.channel}, where it is loudest" if len(sound.steer) > 1 else ""
    axes.set_title(f"About the target {look.label!r}{beam}")
    axes.set_xlabel("time after the start of transmission [ms]")
    axes.set_ylabel("rms pressure [mPa]")
    style.range_axis(axes, sound.sound_speed, _altitude(sound), sound.sound_speed_note)


def target_window(sound: RecordingLevels, row: int) -> TargetWindow | None:
    """The target that is loudest in the beams shown, and the time of all its echoes; None where none is heard.

    Args:
        sound: The recording.
        row: Which ping.
    """
    scenario = sound.scenario
    if scenario is None or not scenario.targets:
        return None
    held = [sound.beam] if sound.beam is not None else list(range(len(sound.steer)))
    found = loudest_target(scenario, row, held) if len(scenario.targets) > 1 or len(held) > 1 else (0, held[0])
    if found is None:
        return None
    target = scenario.targets[found[0]]
    first, last = (1e3 * when for when in echo_window(scenario, row, target))
    span, start, stop = last - first, sound.time[0] * 1e3, sound.time[-1] * 1e3
    if not start < first < stop:
        return None
    window = max(start, first - max(LEAST, BEFORE * span)), min(stop, last + max(LEAST, AFTER * span))
    return TargetWindow(target.label, held.index(found[1]), window)


def _altitude(sound: RecordingLevels) -> float | None:
    scenario = sound.scenario
    if scenario is None:
        return None
    start = getattr(scenario.track, "position", None) or getattr(scenario.track, "start", None)
    return None if start is None else scenario.seabed.depth - start[2]
