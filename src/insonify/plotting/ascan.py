"""A-scan: level of one ping over time, with a detail around the target of the highest level."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from insonify.plotting import style
from insonify.plotting.recording_levels import RecordingLevels
from insonify.plotting.target_view import echo_window, strongest_target
from insonify.units import amplitude_ratio

BEFORE, AFTER = 0.2, 0.8
"""Margins of the detail before and after a target's echoes, relative to their span [1]."""
LEAST = 3.0
"""Least margin of the detail [ms]."""
MAX_BEAMS = 2
"""Largest number of beams for levels by contribution [1]."""
POINTS = 1.5
"""Quadrature points in a resolution cell of levels by contribution, as in labels: ripples within a line's width [1]."""
DEEPEST = 150.0
"""Largest range of levels drawn below the maximum: from the first bottom return to the seabed far away [dB]."""


@dataclass(frozen=True, slots=True)
class TargetWindow:
    """Target, beam and window of the detail."""

    label: str
    """Label of the target."""
    channel: int
    """Row of the beam with its highest level."""
    window: tuple[float, float]
    """Start and stop [ms]."""


def ascan(sound: RecordingLevels, row: int) -> Figure:
    """Draw one ping: the whole window in decibels, and below it the strongest target in linear units."""
    near, contributions = target_window(sound, row), levels_by_contribution(sound, row)
    panels = sound.level.shape[1] + (near is not None)
    figure = style.new_figure(10, 1.2 + 2.9 * panels)
    rows = figure.subplots(panels, 1, squeeze=False)[:, 0]
    for channel, axes in enumerate(rows[: sound.level.shape[1]]):
        trace(axes, sound, row, channel)
        if channel < len(contributions):
            _contributions(axes, sound, contributions[channel])
        axes.set_title(sound.named(ping=row, channel=channel))
    if near is not None:
        envelope(rows[-1], sound, row, near)
    return figure


def levels_by_contribution(sound: RecordingLevels, row: int) -> list[xr.Dataset]:
    """Expected levels of one ping by contribution, for each beam; empty with more than `MAX_BEAMS` or no scenario."""
    channels = [sound.beam] if sound.beam is not None else list(range(len(sound.steer)))
    if sound.scenario is None or len(channels) > MAX_BEAMS:
        return []
    from insonify.simulator import levels  # loads all engines, which other figures do not need

    return [levels(sound.scenario, row, channel=channel, scatterers_per_cell=POINTS) for channel in channels]


def _contributions(axes: Axes, sound: RecordingLevels, expected: xr.Dataset) -> None:
    """Draw the expected level of each contribution above the lower limit of the trace."""
    time, all_pairs = expected["time"].values * 1e3, expected["level_db"].sel(pair="all")
    lowest, shown = axes.get_ylim()[0], 0
    for contribution in (str(name) for name in all_pairs["contribution"].values if name != "total"):
        level = all_pairs.sel(contribution=contribution).values
        if np.isfinite(level).any() and level.max() > lowest:
            axes.plot(
                time, np.where(level > lowest, level, np.nan), color=style.CONTRIBUTION_COLOURS[contribution],
                linewidth=1.2, linestyle="--" if contribution == "noise" else "-", alpha=0.9, label=contribution,
            )  # fmt: skip
            shown += 1
    if shown:
        name = "expected by" if sound.expected else "this ping; expected by"
        axes.legend(loc="upper right", ncols=shown, title=name, title_fontsize=8, fontsize=8)


def trace(
    axes: Axes, sound: RecordingLevels, row: int, channel: int, window: tuple[float, float] | None = None
) -> None:
    """Draw the level over time of one ping and channel.

    Args:
        axes: Axes to draw on.
        sound: Levels of the recording.
        row: Row of the ping.
        channel: Row of the beam.
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
    axes.set(xlabel="time after the start of transmission [ms]", ylabel="level [dB re 1 uPa]")
    style.range_axis(axes, sound.sound_speed, _altitude(sound), sound.sound_speed_note)


def envelope(axes: Axes, sound: RecordingLevels, row: int, look: TargetWindow) -> None:
    """Draw the rms pressure over time in linear units, in a window around a target.

    Args:
        axes: Axes to draw on.
        sound: Levels of the recording.
        row: Row of the ping.
        look: Target, beam and window of the detail.
    """
    time = sound.time * 1e3
    inside = (time >= look.window[0]) & (time <= look.window[1])
    pressure = amplitude_ratio(sound.level[row, look.channel, inside]) / 1e3
    axes.fill_between(time[inside], pressure, color=style.CONTRIBUTION_COLOURS["target"], alpha=0.25, linewidth=0)
    axes.plot(time[inside], pressure, color=style.CONTRIBUTION_COLOURS["target"], linewidth=0.9)
    axes.set(xlim=look.window, ylim=0)
    beam = f", beam {look.channel} with its highest level" if len(sound.steer) > 1 else ""
    axes.set_title(f"Around the target {look.label!r}{beam}")
    axes.set_xlabel("time after the start of transmission [ms]")
    axes.set_ylabel("rms pressure [mPa]")
    style.range_axis(axes, sound.sound_speed, _altitude(sound), sound.sound_speed_note)


def target_window(sound: RecordingLevels, row: int) -> TargetWindow | None:
    """Find the strongest target in the beams shown and the window of all its echoes; None where there is none."""
    scenario = sound.scenario
    if scenario is None or not scenario.targets:
        return None
    channels = [sound.beam] if sound.beam is not None else list(range(len(sound.steer)))
    is_single = len(scenario.targets) == 1 and len(channels) == 1
    strongest = (0, channels[0]) if is_single else strongest_target(scenario, row, channels)
    if strongest is None:
        return None
    target = scenario.targets[strongest[0]]
    first, last = (1e3 * when for when in echo_window(scenario, row, target))
    span, start, stop = last - first, sound.time[0] * 1e3, sound.time[-1] * 1e3
    if not start < first < stop:
        return None
    window = max(start, first - max(LEAST, BEFORE * span)), min(stop, last + max(LEAST, AFTER * span))
    return TargetWindow(target.label, channels.index(strongest[1]), window)


def _altitude(sound: RecordingLevels) -> float | None:
    scenario = sound.scenario
    if scenario is None:
        return None
    start = getattr(scenario.track, "position", None) or getattr(scenario.track, "start", None)
    return None if start is None else scenario.seabed.depth - start[2]
