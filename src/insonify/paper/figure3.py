"""Figure 3: the sidescan image of the target on the fractal bed, direct paths only.

The scenario is that of `sidescan_model`, on a track north past the box. The numbers are of a flat bed, where they
follow from geometry: the highlight is at the distance of the face, the shadow ends where the ray over the far edge
reaches the bed, and along the track it is as wide as the box and the beam together.
"""

from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.image import AxesImage
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from insonify.paper import sidescan_model
from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.sidescan_model import WATERS, Water
from insonify.paper.thermocline_model import SOUND_SPEED
from insonify.plotting import style
from insonify.plotting.waterfall import thinned
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.units import level_db

TITLE = "Sidescan image of the target, direct paths"
WINDOW = (0.190, 0.234)
HALF, PINGS = 5.5, 37
"""Distance run before and after the target [m], and pings of the image."""
FINE = 41
"""Pings over a flat bed for the width of the shadow [1]."""
HEIGHTS: dict[Water, tuple[float, ...]] = {"one speed": (0.25, 0.5, 1.0, 2.0), "thermocline": (0.25, 0.5, 1.0)}
"""Heights of the boxes whose shadows are measured [m]; under the thermocline the limit of direct sound is lower."""
DIMMED = 0.05
"""Part of the bed's energy that is missing at the edge of the shadow [1]."""
PICTURE = (145.0, 174.0)
"""Slant ranges of the pictures [m]."""
SPAN = (-30.0, 30.0)
"""Levels of the pictures [dB re the flat bed]."""
LOWEST = 0.0
"""Lower limit of levels [dB re 1 uPa]."""
ENDS = 30.0
"""Fall of the level that marks the end of the bed [dB]."""
COLUMNS = 900

Floats = NDArray[np.float64]


def scene(water: Water, *, relief: float = sidescan_model.RELIEF, pings: int = PINGS, half: float = HALF,
          window: tuple[float, float] = WINDOW, changes: dict[str, Any] | None = None) -> Scenario:  # fmt: skip
    """The figure's scenario.

    Args:
        water: Water with or without the profile.
        relief: Rms height of the bed's relief [m].
        pings: Number of pings.
        half: Distance run before and after the target [m].
        window: Time recorded [s].
        changes: Other values by dotted name.
    """
    values = {"paths.max_reflections": 0, **(changes or {})}
    return sidescan_model.along(water, values, half=half, pings=pings, window=window, relief=relief)


def shadow_end(water: Water, height: float) -> tuple[float, float]:
    """Distance of the end of a box's shadow abeam, measured and by geometry [m].

    Args:
        water: Water with or without the profile.
        height: Height of the box [m].
    """
    expected = sidescan_model.shadow_end(water, height=height)
    when = sidescan_model.two_way(water, "D", "D", expected, sidescan_model.BED)
    window = (when - 1.5e-3, when + 1.5e-3)
    values = {"paths.max_reflections": 0, "track.window": window, **sidescan_model.with_box(height)}
    measured = sidescan_model.shadow_end_time(
        *sidescan_model.expected_ping(sidescan_model.scene(water, values)), when, reach=0.4e-3
    )
    return sidescan_model.distance_of(water, measured), expected


def face(water: Water) -> float:
    """Distance of the face abeam from the centre of its echo, assumed at half its height [m]."""
    values = {"paths.max_reflections": 0, "track.window": (0.199, 0.204)}
    time, intensity = sidescan_model.expected_ping(sidescan_model.scene(water, sidescan_model.target_only(values)))
    near = (
        time
        < sidescan_model.two_way(water, "D", "D", sidescan_model.FACE, sidescan_model.BED) + 1.5 * sidescan_model.PULSE
    )
    centre = float(np.sum((time * intensity)[near]) / intensity[near].sum()) - sidescan_model.PULSE / 2
    return sidescan_model.distance_of(water, centre, depth=sidescan_model.BED - 0.5)


@lru_cache(maxsize=2)
def shadow_width(water: Water) -> float:
    """Width along the track over which the shadow reduces the bed's energy by a twentieth or more [m]."""
    start, end = (sidescan_model.two_way(water, "D", "D", at, sidescan_model.BED) for at in (
        sidescan_model.BACK, sidescan_model.shadow_end(water)
    ))  # fmt: skip
    window = (start + sidescan_model.PULSE, end)
    sound = simulate(scene(water, relief=0.0, pings=FINE, half=3.0, window=window))
    run, _, level = sidescan_model.images(sound)
    energy = (10 ** (level / 10)).mean(axis=1)
    missing = 1 - energy / energy[[0, -1]].mean()
    middle = int(np.argmax(missing))
    left = np.interp(DIMMED, missing[: middle + 1], run[: middle + 1])
    right = np.interp(-DIMMED, -missing[middle:], run[middle:])
    return float(right - left)


def numbers() -> list[CheckedNumber]:
    """Position of the highlight, and length and width of the shadow, in both waters."""
    rows = []
    put, over = "true position of the box", "exact ray over the far edge"
    for water in WATERS:
        rows.append(
            CheckedNumber(f"{water}: highlight", face(water), "m", sidescan_model.FACE, sidescan_model.CELL, put)
        )
        for height in HEIGHTS[water]:
            measured, expected = (distance - sidescan_model.BACK for distance in shadow_end(water, height))
            name = f"{water}: length of the shadow, box {height:g} m high"
            cell = sidescan_model.ground_cell(water, sidescan_model.shadow_end(water, height=height))
            rows.append(CheckedNumber(name, measured, "m", expected, cell, over))
        wide = sidescan_model.OWN + sidescan_model.footprint(1 - 2 * DIMMED)
        source = "box, and the width that holds 90 % of the two-way beam, sinc^4"
        rows.append(
            CheckedNumber(f"{water}: width of the shadow along the track", shadow_width(water), "m", wide, 0.15, source)
        )
    return rows


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    figure = style.new_figure(10.5, 6.8)
    picture(figure, [(sidescan_model.TITLES[water], water, simulate(scene(water))) for water in WATERS])
    return figure, {water: scene(water) for water in WATERS}, numbers()


def picture(figure: Figure | SubFigure, sounds: list[tuple[str, Water, xr.Dataset]]) -> list[Axes]:
    """Draw images one above the other.

    Args:
        figure: Figure to draw on.
        sounds: Title, water and recording of each image.

    Returns:
        Axes of the images.
    """
    rows = list(figure.subplots(len(sounds), 1, sharex=True, sharey=True))
    for axes, letter, (title, water, sound) in zip(rows, "abc", sounds, strict=False):
        drawn = image(axes, water, sound)
        axes.set(title=f"{letter}  {title}", ylabel="distance run [m]")
    rows[-1].set_xlabel(f"slant range at {SOUND_SPEED:g} m/s [m]")
    figure.colorbar(drawn, ax=rows, label="level re a bare flat bed [dB]", pad=0.01)
    return rows


def image(axes: Axes, water: Water, sound: xr.Dataset) -> AxesImage:
    """Draw one image over slant range, with the outline of the shadow by exact rays.

    Args:
        axes: Axes to draw on.
        water: Water with or without the profile.
        sound: Recording of the image.
    """
    run, time, level = sidescan_model.images(sound)
    shown = np.nan_to_num(np.maximum(level, LOWEST) - flat_bed_level(water, sound), neginf=SPAN[0])
    slant = (time - sidescan_model.PULSE / 2) * SOUND_SPEED / 2
    step = (run[1] - run[0]) / 2
    drawn = axes.imshow(
        thinned(shown, COLUMNS), aspect="auto", origin="lower", cmap=style.COPPER, vmin=SPAN[0], vmax=SPAN[1],
        interpolation="nearest", extent=(slant[0], slant[-1], run[0] - step, run[-1] + step),
    )  # fmt: skip
    axes.grid(False)
    axes.set_xlim(*PICTURE)
    first, last = (
        two_way_slant(water, "D", "D", at) for at in (sidescan_model.BACK, sidescan_model.shadow_end(water))
    )  # fmt: skip
    length, blue = sidescan_model.OWN, style.FAMILIES["S"]
    axes.add_patch(
        Rectangle((first, -length / 2), last - first, length, fill=False, color=blue, linewidth=1.0, linestyle="--")
    )
    return drawn


def two_way_slant(water: Water, out: str, back: str, distance: float, depth: float = sidescan_model.BED) -> float:
    """Slant range in an image of an echo by two families [m].

    Args:
        water: Water with or without the profile.
        out: Family of the transmit leg.
        back: Family of the receive leg.
        distance: Horizontal distance of the scatterer [m].
        depth: Depth of the scatterer [m].
    """
    return sidescan_model.two_way(water, out, back, distance, depth) * SOUND_SPEED / 2


def flat_bed_level(water: Water, sound: xr.Dataset) -> Floats:
    """Level of a bare flat bed over the same paths, constant beyond its end [dB re 1 uPa], shape (time,).

    Args:
        water: Water with or without the profile.
        sound: Recording of `scene`.
    """
    scenario = parse_model(Scenario, sound.attrs["scenario"])
    values = {
        "paths.max_reflections": scenario.paths.max_reflections, "track.window": scenario.track.window,
        "sonar": scenario.sonar.model_dump(mode="json"),
    }  # fmt: skip
    level = level_db(sidescan_model.expected_ping(sidescan_model.scene(water, sidescan_model.without_box(values)))[1])
    bright = level > level.max() - ENDS
    return level[np.maximum.accumulate(np.where(bright, np.arange(level.size), int(np.argmax(bright))))]
