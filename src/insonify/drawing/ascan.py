"""The A-scan: what one ping brings back, as level over time, with a closer look at what lies in the water."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from insonify.drawing import style
from insonify.drawing.heard import Heard
from insonify.scene.target import Box

NEAR = (5.0, 30.0)
"""Time before and after the first target's echo that is drawn larger [ms]."""
DEEPEST = 120.0
"""Levels this far below the loudest part of what is seen are not drawn [dB]."""


def ascan(sound: Heard, row: int) -> Figure:
    """One ping: the whole window in decibels, and beneath it the first target's neighbourhood in linear units.

    Args:
        sound: The recording.
        row: Which ping.
    """
    near = target_window(sound)
    panels = sound.level.shape[1] + (near is not None)
    figure = style.sheet(10, 1.2 + 2.9 * panels)
    rows = figure.subplots(panels, 1, squeeze=False)[:, 0]
    for channel, axes in enumerate(rows[: sound.level.shape[1]]):
        trace(axes, sound, row, channel)
        axes.set_title(_title(sound, channel))
    if near is not None:
        envelope(rows[-1], sound, row, near)
    return figure


def trace(axes: Axes, sound: Heard, row: int, channel: int, window: tuple[float, float] | None = None) -> None:
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
    style.range_axis(axes, sound.sound_speed, _altitude(sound))


def envelope(axes: Axes, sound: Heard, row: int, window: tuple[float, float]) -> None:
    """Rms pressure over time in linear units, in a window about the target.

    Args:
        axes: Where to draw.
        sound: The recording.
        row: Which ping.
        window: Start and stop [ms].
    """
    time = sound.time * 1e3
    inside = (time >= window[0]) & (time <= window[1])
    pressure = 10 ** (sound.level[row, 0, inside] / 20) / 1e3
    axes.fill_between(time[inside], pressure, color=style.CAUSES["target"], alpha=0.25, linewidth=0)
    axes.plot(time[inside], pressure, color=style.CAUSES["target"], linewidth=0.9)
    axes.set_xlim(*window)
    axes.set_ylim(0)
    axes.set_title("About the target")
    axes.set_xlabel("time after the start of transmission [ms]")
    axes.set_ylabel("rms pressure [mPa]")
    style.range_axis(axes, sound.sound_speed, _altitude(sound))


def target_window(sound: Heard) -> tuple[float, float] | None:
    """Time about the direct echo of the first target [ms]; None without one in the recording."""
    scenario = sound.scenario
    if scenario is None or not scenario.targets:
        return None
    target = scenario.targets[0]
    place = np.array([*target.position[:2], scenario.seabed.depth if isinstance(target, Box) else target.position[2]])
    start = getattr(scenario.track, "position", None) or getattr(scenario.track, "start", (0.0, 0.0, 0.0))
    echo = 2e3 * float(np.linalg.norm(place - np.array(start))) / sound.sound_speed
    first, last = sound.time[0] * 1e3, sound.time[-1] * 1e3
    window = max(first, echo - NEAR[0]), min(last, echo + NEAR[1])
    return window if window[0] < echo < window[1] else None


def _altitude(sound: Heard) -> float | None:
    scenario = sound.scenario
    if scenario is None:
        return None
    start = getattr(scenario.track, "position", None) or getattr(scenario.track, "start", None)
    return None if start is None else scenario.seabed.depth - start[2]


def _title(sound: Heard, channel: int) -> str:
    if len(sound.steer) == 1:
        return sound.title
    return f"{sound.title}: beam steered {np.degrees(sound.steer[channel]):+.2f} deg".lstrip(": ")
