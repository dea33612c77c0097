"""Figure 14: steered beams on and off the target, and the image of all beams.

Changed in the nominal scene: the whole scene in three dimensions, `sonar.receive.steer` from -6 to 6 deg in steps of
0.25 deg (the transmit beam follows), the box 2.1 deg to the right of boresight at the same range, and a window
around it. For the beam pattern the box is replaced by a point at that bearing, over direct paths only.
"""

from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.nominal_scenario import box, nominal
from insonify.plotting import style
from insonify.plotting.recording_levels import colour_span, recording_levels
from insonify.plotting.sector_image import name_targets, sector, write_title
from insonify.plotting.target_view import targets_in_view
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.units import level_db

TITLE = "Multi-beam image of the target, and some of the beams behind it"
WINDOW = (0.185, 0.235)
DIRECT = (0.1995, 0.2015)
"""Window of the direct echo of the target, and no other [s]."""
BEARING = np.radians(2.1)
"""Bearing of the target, to the right of boresight [rad]."""
STEERS = np.radians(np.arange(-6, 6.01, 0.25))
FINE = np.radians(np.arange(0.9, 3.3001, 0.01))
"""Steer angles at which the pattern is measured [rad]."""
APERTURE = 0.01
"""Wavelength over length of the arrays [1]."""
HALF_POWER = 0.886
"""Full width of a uniform line's beam at half power [wavelength / length]."""

Floats = NDArray[np.float64]


def scene(changes: dict[str, Any] | None = None) -> Scenario:
    """The figure's scenario.

    Args:
        changes: Other values by dotted name.
    """
    target = {**box(2.0), "position": _at(150.5), "heading": float(BEARING)}
    fixed = {"sonar.receive.steer": STEERS.tolist(), "track.window": WINDOW, "targets": [target]}
    return nominal({**fixed, **(changes or {})})


def _at(distance: float) -> list[float]:
    """North and east of a position at the target's bearing [m]; boresight points east and right is south."""
    return [float(-distance * np.sin(BEARING)), float(distance * np.cos(BEARING))]


def point_scene(alone: bool) -> Scenario:
    """Scenario of a point at the target's bearing and range.

    Args:
        alone: True for finely steered beams over direct paths of the point only; False for the point instead of the
            box.
    """
    point = {"shape": "point", "label": "point", "position": [*_at(150.0), 19.5], "target_strength_db": 0.0}
    if not alone:
        return scene({"targets": [point], "track.window": DIRECT})
    return scene(
        {
            "targets": [point], "sonar.receive.steer": FINE.tolist(), "track.window": DIRECT,
            "paths.max_reflections": 0, "paths.contributions": ["target"],
        }
    )  # fmt: skip


@lru_cache(maxsize=1)
def pattern() -> tuple[Floats, Floats]:
    """Echo energy of the point over steer angle, and the expected two-way pattern [dB re peak].

    Source: a uniform line steered by phase, sinc^4(L / wavelength (sin a - sin s)) for transmit and receive together.
    """
    scenario = point_scene(alone=True)
    echo = simulate(scenario)["pressure"].values[0]
    energy = level_db(np.sum(np.abs(echo.astype(complex)) ** 2, axis=1))
    slant = np.hypot(150.0, 8.5)
    across = 150.0 / slant * np.sin(BEARING)  # direction cosine: the point lies a little below boresight
    expected = level_db(np.sinc((across - np.sin(FINE)) / APERTURE) ** 4)
    return energy - energy.max(), expected


def numbers() -> list[CheckedNumber]:
    """Agreement of the echo with the beam pattern, and position of the target in the image."""
    energy, expected = pattern()
    offset = np.abs(np.sin(FINE) - np.sin(BEARING)) / APERTURE
    lobe, side = offset < 0.75, (offset > 1.2) & (offset < 1.8)
    bearing, reach = image_peak()
    beamwidth = float(np.degrees(HALF_POWER * APERTURE))
    source, put = "two-way pattern of uniform lines, sinc^4", "true position of the point"
    worst = float(np.abs(energy - expected)[lobe].max())
    return [
        CheckedNumber("echo re two-way pattern, worst in the main lobe", worst, "dB", 0.0, 0.2, source),
        CheckedNumber("first sidelobe of the echo re its peak", float(energy[side].max()), "dB", -26.52, 1.0, source),
        CheckedNumber(
            "bearing of the peak of the image", bearing, "deg", float(np.degrees(BEARING)), beamwidth / 10, put
        ),
        CheckedNumber("slant range of the peak of the image", reach, "m", float(np.hypot(150.0, 8.5)), 0.075, put),
        CheckedNumber("beamwidth at half power, one way", beamwidth, "deg"),
    ]


def image_peak() -> tuple[float, float]:
    """Bearing [deg] and slant range [m] of the peak of the image, with a point instead of the box.

    Bearing from a parabola through the strongest beam and its neighbours, range from the centre of its echo.
    """
    scenario = point_scene(alone=False)
    recording = simulate(scenario)
    power = np.abs(recording["pressure"].values[0].astype(complex)) ** 2
    level = level_db(power.sum(axis=1))
    row = int(np.argmax(level))
    left, middle, right = level[row - 1 : row + 2]
    bearing = STEERS[row] + (STEERS[1] - STEERS[0]) * (left - right) / (left - 2 * middle + right) / 2
    centre = float(np.sum(recording["time"].values * power[row]) / power[row].sum())
    reach = (centre - scenario.sonar.pulse.duration / 2) * scenario.water.sound_speed / 2
    return float(np.degrees(bearing)), float(reach)


@lru_cache(maxsize=1)
def _image() -> xr.Dataset:
    return simulate(scene())


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    figure = style.new_figure(11.5, 7)
    _panels(figure)
    scenarios = {"image": scene(), "point": point_scene(alone=True)}
    return figure, scenarios, numbers()


def _panels(figure: Figure) -> None:
    left, right = figure.subfigures(1, 2, width_ratios=(1, 1.05), squeeze=False)[0]
    rows = left.subplots(4, 1)
    image = _image()
    time = image["time"].values * 1e3
    for axes, letter, angle in zip(rows[:3], "abc", (2.0, 2.5, -3.0), strict=True):
        beam = int(np.argmin(np.abs(STEERS - np.radians(angle))))
        axes.plot(time, level_db(np.abs(image["pressure"].values[0, beam]) ** 2), color=style.INK, linewidth=0.6)
        axes.set_ylim(35, 124)
        axes.set_xlim(time[0], time[-1])
        axes.set_title(f"{letter}  beam at {angle:+g}°, target at +2.1°")
        axes.set_ylabel("dB re 1 uPa")
    rows[2].set_xlabel("time after the start of transmission [ms]")
    energy, expected = pattern()
    rows[3].plot(
        np.degrees(FINE), expected, color=style.CONTRIBUTION_COLOURS["surface"], linewidth=3, alpha=0.4,
        label="sinc$^4$",
    )  # fmt: skip
    rows[3].plot(np.degrees(FINE), energy, color=style.INK, linewidth=0.9, label="echo")
    rows[3].set_title("d  echo of a point at +2.1° over steer angle")
    rows[3].set_ylim(-60, 4)
    rows[3].set_xlabel("steer angle [deg]")
    rows[3].set_ylabel("echo [dB re peak]")
    rows[3].legend(loc="upper right")
    sound = recording_levels(image)
    axes = right.subplots()
    level = sound.strength()[0]
    mesh = sector(axes, sound.time * sound.sound_speed / 2, sound.steer, level, colour_span(level))
    name_targets(axes, targets_in_view(scene(), 0), sound.time * sound.sound_speed / 2, sound.steer)
    write_title(axes, "e  image of 49 beams")
    right.colorbar(mesh, ax=axes, label="apparent target strength [dB re 1 m$^2$]", shrink=0.7)
