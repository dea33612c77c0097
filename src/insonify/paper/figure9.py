"""Figure 9: the same without the profile, and what the profile moved.

The scenario is that of `thermocline`, in water of 1500 m/s, the speed at the sonar under the profile. The paper
concludes that the profile "will only affect the sea surface returns and will not make a great deal of difference".
Measured with exact rays it moves all of them: at 150 m the target and the bed come later, the surface earlier, bed
and target are stronger, and beyond 162 m no direct sound reaches the bed.

Shifts are those of the engine's own arrivals, scatterer by scatterer, which stand in the same places in both waters;
beside them, twice the difference of the exact eigenray and of the straight line.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.ocean.profile import SoundSpeedProfile
from insonify.paper.checked_numbers import CheckedNumber, write_numbers
from insonify.paper.figure8 import SPAN, scene_panel, series_panel, spike_panel
from insonify.paper.thermocline_model import PROFILE, SOUND_SPEED, WINDOW, scene
from insonify.plotting import style
from insonify.plotting.levels import curves
from insonify.propagation.eigenray import eigenrays
from insonify.records.arrivals import Arrivals
from insonify.simulator import arrivals, levels, simulate
from insonify.units import level_db

TITLE = "Without the profile, and what the profile moves"
SOURCE, DISTANCE = 11.0, 150.0
POINTS = {"target top": (19.0, 0.649094), "target middle": (19.5, None), "seabed": (20.0, None), "surface": (0.0, None)}
"""Depth of a point at 150 m [m], and the shift of its return by the 150 m table of exact eigenrays [ms]."""
WIDE = (0.02, 0.245)
"""Time over which scatterers are compared [s]."""
EXACT = f"exact eigenrays, less the straight line at {SOUND_SPEED:g} m/s; out and back"

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ProfileEffect:
    """Difference of the returns of one source between both waters; columns over the points that return in both."""

    distance: Floats
    """Horizontal distance [m]."""
    shift: Floats
    """Later by, as the engine has it [s]."""
    exact: Floats
    """Later by, as exact eigenrays have it [s]."""
    gain_db: Floats
    """Louder by: spreading, absorption and scattering, no random amplitude [dB]."""
    spreading_db: Floats
    """Louder by spreading alone, as the engine has it [dB]."""
    exact_spreading_db: Floats
    """The same from exact eigenrays [dB]."""


def rays_to(distance: Floats, depth: Floats) -> tuple[Floats, Floats]:
    """Travel time under the profile [s] and spreading re 1 m [1] of the direct rays, NaN where there is none.

    Args:
        distance: Horizontal distances [m], shape (n,).
        depth: Depths [m], shape (n,).
    """
    profile = SoundSpeedProfile(*(np.array(column) for column in zip(*PROFILE, strict=True)))
    found = eigenrays(
        profile, water_depth=20.0, source_depth=SOURCE, point_depth=depth, range=distance, families=("D",)
    )
    first = np.searchsorted(found.point, np.arange(distance.size))
    return found.delay[first], found.amplitude[first]


@lru_cache(maxsize=4)
def profile_effect(source: str) -> ProfileEffect:
    """Effect of the profile on the returns of one source.

    Args:
        source: "seabed", "surface" or "box".
    """
    settings: dict[str, Any] = {"paths.amplitude_perturbation": 0.0, "track.window": WIDE}
    if source != "box":
        settings["targets"] = []  # whose shadows differ
    bent, plain = (_of(arrivals(scene(profile, settings)), source) for profile in (True, False))
    _, here, there = np.intersect1d(_key(bent), _key(plain), return_indices=True)
    bent, plain = bent.take(here), plain.take(there)
    distance, depth = np.hypot(*bent.position[:, :2].T), bent.position[:, 2]
    slant = np.hypot(distance, depth - SOURCE)
    time, spreading = rays_to(distance, np.clip(depth, 0.0, 20.0))
    return ProfileEffect(
        distance=distance,
        shift=bent.delay - plain.delay,
        exact=2 * (time - slant / SOUND_SPEED),
        gain_db=level_db(np.abs(bent.amplitude[:, 0] / plain.amplitude[:, 0]) ** 2),
        spreading_db=level_db((bent.spreading / plain.spreading) ** 2),
        exact_spreading_db=level_db((spreading * slant) ** 4),
    )


def _of(paths: Arrivals, source: str) -> Arrivals:
    return paths.take(paths.object == source)


def _key(paths: Arrivals) -> NDArray[np.complex128]:
    """A place of one boundary or box as one number: its distance, and its depth."""
    return np.asarray(np.hypot(*paths.position[:, :2].T) + 1j * paths.position[:, 2])


def numbers() -> list[CheckedNumber]:
    """Shifts and levels of returns under the profile, and the agreement of the engine and exact eigenrays on them."""
    rows = [CheckedNumber("reference speed", SOUND_SPEED, "m/s")]
    for point, (depth, table) in POINTS.items():
        time, spreading = rays_to(np.array([DISTANCE]), np.array([depth]))
        slant = float(np.hypot(DISTANCE, depth - SOURCE))
        shift = 2e3 * (float(time[0]) - slant / SOUND_SPEED)
        source = "150 m table of the 40-digit solution, thermo20 less iso20, out and back" if table else ""
        rows.append(CheckedNumber(f"{point} at 150 m: later by", shift, "ms", table, 2e-6 if table else None, source))
        gain = float(level_db((spreading[0] * slant) ** 4))
        rows.append(CheckedNumber(f"{point} at 150 m: level higher by spreading, out and back", gain, "dB"))
    for source in ("box", "seabed", "surface"):
        found = profile_effect(source)
        off = float(np.abs(found.shift - found.exact).max())
        rows.append(CheckedNumber(f"shift of every spike of the {source}, worst", off, "s", 0.0, 2e-9, EXACT))
        off = float(np.abs(found.spreading_db - found.exact_spreading_db).max())
        rows.append(CheckedNumber(f"spreading of every spike of the {source}, worst", off, "dB", 0.0, 0.08, EXACT))
        near = np.abs(found.distance - 150.5) <= 0.75
        for name, value in (("least", found.shift[near].min()), ("most", found.shift[near].max())):
            rows.append(CheckedNumber(f"{source} at 150 m: later by, {name}", 1e3 * float(value), "ms"))
        gain = float(level_db(np.mean(10 ** (found.gain_db[near] / 10))))
        rows.append(CheckedNumber(f"{source} at 150 m: level higher by, mean of the spikes", gain, "dB"))
    rows.append(CheckedNumber("echo of the target: more energy", echo_gain(), "dB"))
    return [
        *rows,
        CheckedNumber("seabed over direct paths, farthest", float(profile_effect("seabed").distance.max()), "m"),
    ]


def echo_gain() -> float:
    """Increase of the energy of the target's direct echo under the profile [dB]."""
    energy = [
        simulate(scene(profile, {"paths.contributions": ["target"], "field": "incoherent"}))["intensity"].values.sum()
        for profile in (True, False)
    ]
    return float(level_db(energy[0] / energy[1]))


def draw(folder: Path) -> list[Path]:
    """The picture and its numbers.

    Args:
        folder: Where they go.

    Returns:
        The files written.
    """
    with style.plot_style():
        figure = style.new_figure(10.5, 13)
        _panels(figure)
        picture = style.save_figure(figure, folder / "figure9.png")
    scenarios = {"one speed": scene(False), "thermocline": scene(True)}
    return [picture, write_numbers(folder / "figure9.json", 9, TITLE, scenarios, numbers())]


def _panels(figure: Figure) -> None:
    above, middle, below = figure.subfigures(3, 1, height_ratios=(1, 1.75, 0.8), squeeze=False)[:, 0]
    scene_panel(above, scene(False), f"a  direct rays at {SOUND_SPEED:g} m/s")
    spikes, energy, series = middle.subplots(3, 1, sharex=True)
    spike_panel(spikes, scene(False), "b  spike array at one speed, by source of the return")
    curves(energy, levels(scene(False)), WINDOW)
    _beside(energy)
    energy.set_title("c  expected level of each source; dotted: under the profile")
    energy.set_ylim(*SPAN)
    series_panel(series, scene(False), "d  coherent series at one speed")
    for axes in (spikes, energy):
        axes.set_xlabel("")
    later, higher = below.subplots(1, 2)
    _changes(later, higher)


def _beside(axes: Axes) -> None:
    """Expected levels under the profile, dotted, over those without."""
    bent = levels(scene(True))["level_db"].sel(pair="all")
    for contribution in ("seabed", "surface", "target"):
        level = bent.sel(contribution=contribution).values
        axes.plot(bent["time"].values * 1e3, level, ":", color=style.CONTRIBUTION_COLOURS[contribution], linewidth=1.4)


def _changes(later: Axes, higher: Axes) -> None:
    """Shift and change of level of every return over its distance."""
    for source, contribution in (("surface", "surface"), ("seabed", "seabed"), ("box", "target")):
        found = profile_effect(source)
        order = np.argsort(found.distance)
        mark, wide = (".", 3.0) if source == "box" else ("-", 1.6)
        for axes, column in ((later, 1e3 * found.shift), (higher, found.gain_db)):
            axes.plot(found.distance[order], column[order], mark, color=style.CONTRIBUTION_COLOURS[contribution],
                      markersize=wide, linewidth=wide, label=contribution)  # fmt: skip
    for axes, title, label in (
        (later, "e  returns under the profile re one speed: time", "later by, out and back [ms]"),
        (higher, "f  their level", "higher by, out and back [dB]"),
    ):
        axes.axhline(0, color=style.QUIET, linewidth=0.8)
        axes.set_title(title)
        axes.set_xlabel("horizontal range [m]")
        axes.set_ylabel(label)
        axes.set_xlim(0, 180)
    later.legend(loc="lower left")
