"""Sound-speed profile over depth, and the sign of refraction in each layer."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from insonify.ocean.profile import SoundSpeedProfile
from insonify.plotting import style

WARM, SALT = style.CONTRIBUTION_COLOURS["target"], style.EXPECTED


def profile(column: SoundSpeedProfile, path: str | Path, *, temperature: ArrayLike | None = None,
            salinity: ArrayLike | None = None, title: str = "") -> Path:  # fmt: skip
    """Draw a sound-speed profile and its gradient, with temperature and salinity where they were measured.

    Args:
        column: Sound-speed profile.
        path: File of the figure.
        temperature: Temperature at the knots of the profile [degC], shape (n,).
        salinity: Salinity at the knots of the profile [g/kg], shape (n,).
        title: Title, such as position and time of the measurement.

    Returns:
        The path.

    Example:
        >>> thermocline = insonify.ocean.SoundSpeedProfile([0, 8, 14, 20], [1510, 1510, 1490, 1490])
        >>> picture = profile(thermocline, "profile.png", title="Harbour in July")
        >>> picture.name, picture.stat().st_size > 0
        ('profile.png', True)
    """
    probed = temperature is not None or salinity is not None
    with style.plot_style():
        figure = style.new_figure(11 if probed else 8, 5.5)
        panels = figure.subplots(1, 2 + probed, sharey=True)
        speeds(panels[0], column)
        gradients(panels[1], column)
        if probed:
            probe(panels[2], column, temperature, salinity)
        panels[0].set(ylim=(column.depth[-1], min(column.depth[0], 0.0)), ylabel="depth [m]")
        figure.suptitle(title, ha="left", x=0.01, fontsize=11)
        return style.save_figure(figure, path)


def speeds(axes: Axes, column: SoundSpeedProfile) -> None:
    """Draw sound speed over depth, with its knots."""
    axes.plot(column.speed, column.depth, color=style.INK)
    if column.depth.size <= 60:
        axes.plot(column.speed, column.depth, "o", color=style.INK, markersize=3.5)
    low, high = column.speed.min(), column.speed.max()
    axes.set_xlim(low - max(0.08 * (high - low), 0.5), high + max(0.08 * (high - low), 0.5))
    axes.set_title(f"From {low:.1f} to {high:.1f} m/s")
    axes.set_xlabel("sound speed [m/s]")


def gradients(axes: Axes, column: SoundSpeedProfile) -> None:
    """Draw the gradient of each layer: sound is refracted up where speed grows with depth, and down where it falls."""
    slope = column.gradient((column.depth[1:] + column.depth[:-1]) / 2)
    for bends, colour in (
        (slope > 0, style.CONTRIBUTION_COLOURS["surface"]),
        (slope < 0, style.CONTRIBUTION_COLOURS["seabed"]),
    ):
        axes.stairs(
            np.where(bends, slope, 0.0), column.depth, orientation="horizontal", fill=True, color=colour, alpha=0.35
        )
    axes.stairs(slope, column.depth, orientation="horizontal", color=style.INK, linewidth=1.0, baseline=None)
    axes.axvline(0, color=style.QUIET, linewidth=0.8)
    widest = max(float(np.abs(slope).max()) * 1.1, 0.02)
    axes.set_xlim(-widest, widest)
    words = (
        ("left", 0.03, "bends down", style.CONTRIBUTION_COLOURS["seabed"]),
        ("right", 0.97, "bends up", style.CONTRIBUTION_COLOURS["surface"]),
    )
    for side, share, word, colour in words:
        axes.annotate(word, (share, 0.02), xycoords="axes fraction", ha=side, color=colour, fontsize=9)
    axes.set(title="Change with depth", xlabel="gradient [1/s]")


def probe(axes: Axes, column: SoundSpeedProfile, temperature: ArrayLike | None, salinity: ArrayLike | None) -> None:
    """Draw temperature and salinity over depth, each on an axis of its own.

    Args:
        axes: Axes to draw on.
        column: Sound-speed profile, for its depths.
        temperature: Temperature at the knots [degC], shape (n,), or None.
        salinity: Salinity at the knots [g/kg], shape (n,), or None.
    """
    axes.set_title("Measured", pad=34 if temperature is not None and salinity is not None else 6)
    if temperature is not None:
        axes.plot(np.asarray(temperature, float), column.depth, color=WARM)
        axes.set_xlabel("temperature [degC]", color=WARM)
    if salinity is not None:
        top = axes if temperature is None else axes.twiny()
        top.plot(np.asarray(salinity, float), column.depth, color=SALT, linestyle="--")
        top.set_xlabel("salinity [g/kg]", color=SALT)
        if top is not axes:
            top.spines.top.set_visible(True)
            top.grid(False)
