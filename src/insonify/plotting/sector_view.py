"""Sector image of a forward-looking sonar, with cuts through a point target."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from insonify.plotting import style
from insonify.plotting.recording_levels import Floats, RecordingLevels, colour_span
from insonify.plotting.sector_image import looks_down, name_targets, sector, write_title
from insonify.plotting.target_view import TargetView

AROUND = 2.0
"""Half length of the cut over range about a point [m]."""


@dataclass(frozen=True, slots=True)
class BeamCut:
    """Levels around a point, over bearing and over range."""

    label: str
    bearings: Floats
    """Bearings to the right of boresight [rad], shape (n,)."""
    over_bearing: Floats
    """Level at the point's range re the peak [dB], shape (n,)."""
    expected: Floats
    """Expected level by the beam pattern of the array [dB], shape (n,)."""
    slant: Floats
    """Slant range [m], shape (m,)."""
    over_range: Floats
    """Level at the point's bearing re the peak [dB], shape (m,)."""
    row: int
    """Index of the peak in bearing."""
    sample: int
    """Index of the peak in range."""


def sector_view(fan: RecordingLevels, seen: list[TargetView], cuts: list[BeamCut], title: str) -> Figure:
    """Draw the sector image, and beside it the cuts through a point where there is one.

    Args:
        fan: Levels of one ping with beams as channels.
        seen: Targets that are labelled.
        cuts: At most one cut.
        title: Title of the sector image.
    """
    figure = style.new_figure(13.5 if cuts else 10, 7.2)
    ratios = (2.6, 1.0) if cuts else (1.0,)
    parts = figure.subfigures(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
    axes = parts[0].subplots()
    slant, level = fan.time * fan.sound_speed / 2, fan.strength()[0]
    mesh = sector(axes, slant, fan.steer, level, colour_span(level), labels=7, down=looks_down(fan.scenario))
    name_targets(axes, seen, slant, fan.steer)
    write_title(axes, title)
    parts[0].colorbar(mesh, ax=axes, label="apparent target strength [dB re 1 m$^2$]", shrink=0.6, pad=0.02)
    for cut in cuts:
        _cuts(parts[1], cut)
    return figure


def _cuts(figure: Figure, cut: BeamCut) -> None:
    over, along = figure.subplots(2, 1)
    degrees = np.degrees(cut.bearings)
    over.plot(
        degrees, cut.expected, color=style.CONTRIBUTION_COLOURS["surface"], linewidth=3, alpha=0.4,
        label="pattern of the array",
    )  # fmt: skip
    over.plot(degrees, cut.over_bearing, color=style.INK, linewidth=0.9, label="simulated")
    over.set(title=f"{cut.label}, over bearing", xlabel="bearing [deg]")
    over.legend(loc="upper center", ncols=2)
    near = np.abs(cut.slant - cut.slant[cut.sample]) < AROUND
    along.plot(cut.slant[near], cut.over_range[near], color=style.INK, linewidth=0.9)
    along.set(title=f"{cut.label}, over range", xlabel="slant range [m]")
    for axes in (over, along):
        _level_axis(axes)


def _level_axis(axes: Axes) -> None:
    axes.set(ylim=(-50, 8), ylabel="level [dB re peak]")
