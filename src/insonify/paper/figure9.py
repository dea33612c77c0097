"""Figure 9: the scene without the profile, and the changes by the profile.

The scenario is that of `thermocline_model`, in water of 1500 m/s, the speed at the sonar with the profile. The paper
concludes that the profile "will only affect the sea surface returns and will not make a great deal of difference".
That holds for a warm layer that ends above the sonar (`WARM_LAYER`: surface returns 0.7 ms earlier, bed and target
unchanged). A thermocline that includes the sonar, our reading of figure 1, changes all of them: at 150 m the echoes of
target and bed arrive later, those of the surface earlier, bed and target are stronger, and beyond 162 m no direct sound
reaches the bed. The difference lies in the profile, which the paper prints as a picture only.

Shifts are those of the engine's arrivals for each scatterer, with the same positions in both waters,
compared with twice the difference of the exact eigenray and of the straight line.
"""

from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.ocean.profile import SoundSpeedProfile
from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.figure8 import SPAN, paths_of, scene_panel, series_panel, spike_panel
from insonify.paper.thermocline_model import PROFILE, SOUND_SPEED, WARM_LAYER, WINDOW, Knots, scene
from insonify.plotting import style
from insonify.plotting.levels import curves
from insonify.propagation.eigenray import eigenrays
from insonify.records.arrivals import Arrivals
from insonify.simulator import arrivals, levels, simulate
from insonify.units import level_db

TITLE = "Without the profile, and the changes by the profile"
SOURCE, DISTANCE = 11.0, 150.0
POINTS = {"target top": (19.0, 0.649094), "target middle": (19.5, None), "seabed": (20.0, None), "surface": (0.0, None)}
"""Depth of a point at 150 m [m], and the shift of its return by the 150 m table of exact eigenrays [ms]."""
WIDE = (0.02, 0.245)
"""Time over which scatterers are compared [s]."""
EXACT = f"exact eigenrays, less the straight line at {SOUND_SPEED:g} m/s; out and back"

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ProfileEffect:
    """Differences of the arrivals of one object between both waters, over the scatterers present in both."""

    distance: Floats
    """Horizontal distance [m]."""
    shift: Floats
    """Increase of the delay, by the engine [s]."""
    exact: Floats
    """Increase of the delay, by exact eigenrays [s]."""
    gain_db: Floats
    """Increase of the level by spreading, absorption and scattering, without random amplitude [dB]."""
    spreading_db: Floats
    """Increase of the level by spreading only, by the engine [dB]."""
    exact_spreading_db: Floats
    """Increase of the level by spreading only, by exact eigenrays [dB]."""


def rays_to(distance: Floats, depth: Floats, knots: Knots = PROFILE) -> tuple[Floats, Floats]:
    """Travel time under the profile [s] and spreading re 1 m [1] of the direct rays, NaN where there is none.

    Args:
        distance: Horizontal distances [m], shape (n,).
        depth: Depths [m], shape (n,).
        knots: Depth [m] and sound speed [m/s] of the profile's knots.
    """
    profile = SoundSpeedProfile(*(np.array(column) for column in zip(*knots, strict=True)))
    direct = eigenrays(
        profile, water_depth=20.0, source_depth=SOURCE, point_depth=depth, range=distance, families=("D",)
    )
    first = np.searchsorted(direct.point, np.arange(distance.size))
    return direct.delay[first], direct.amplitude[first]


@lru_cache(maxsize=8)
def profile_effect(name: str, knots: Knots = PROFILE) -> ProfileEffect:
    """Compute the effect of a profile on the arrivals of one object.

    Args:
        name: "seabed", "surface" or "box".
        knots: Depth [m] and sound speed [m/s] of the profile's knots.
    """
    changes: dict[str, Any] = {"paths.amplitude_perturbation": 0.0, "track.window": WIDE}
    if name != "box":
        changes["targets"] = []  # their shadows differ
    refracted, plain = (paths_of(arrivals(scene(profile, changes)), name) for profile in (knots, False))
    _, refracted_rows, plain_rows = np.intersect1d(_key(refracted), _key(plain), return_indices=True)
    refracted, plain = refracted.take(refracted_rows), plain.take(plain_rows)
    distance, depth = np.hypot(*refracted.position[:, :2].T), refracted.position[:, 2]
    slant = np.hypot(distance, depth - SOURCE)
    time, spreading = rays_to(distance, np.clip(depth, 0.0, 20.0), knots)
    return ProfileEffect(
        distance=distance,
        shift=refracted.delay - plain.delay,
        exact=2 * (time - slant / SOUND_SPEED),
        gain_db=level_db(np.abs(refracted.amplitude / plain.amplitude) ** 2),
        spreading_db=level_db((refracted.spreading / plain.spreading) ** 2),
        exact_spreading_db=level_db((spreading * slant) ** 4),
    )


def _key(paths: Arrivals) -> NDArray[np.complex128]:
    """Position of a scatterer as one number: distance and depth."""
    return np.asarray(np.hypot(*paths.position[:, :2].T) + 1j * paths.position[:, 2])


def numbers() -> list[CheckedNumber]:
    """Shifts and level changes by the profile, and their agreement with exact eigenrays."""
    rows = [CheckedNumber("reference speed", SOUND_SPEED, "m/s")]
    for point, (depth, table) in POINTS.items():
        time, spreading = rays_to(np.array([DISTANCE]), np.array([depth]))
        slant = float(np.hypot(DISTANCE, depth - SOURCE))
        shift = 2e3 * (float(time[0]) - slant / SOUND_SPEED)
        source = "150 m table of the 40-digit solution, thermo20 less iso20, out and back" if table else ""
        rows.append(CheckedNumber(f"{point} at 150 m: later by", shift, "ms", table, 2e-6 if table else None, source))
        gain = float(level_db((spreading[0] * slant) ** 4))
        rows.append(CheckedNumber(f"{point} at 150 m: level higher by spreading, two-way", gain, "dB"))
    for name in ("box", "seabed", "surface"):
        effect = profile_effect(name)
        off = float(np.abs(effect.shift - effect.exact).max())
        rows.append(CheckedNumber(f"shift of every spike of the {name}, worst", off, "s", 0.0, 2e-9, EXACT))
        off = float(np.abs(effect.spreading_db - effect.exact_spreading_db).max())
        rows.append(CheckedNumber(f"spreading of every spike of the {name}, worst", off, "dB", 0.0, 0.08, EXACT))
        near = _near(effect)
        for extreme, value in (("least", near.shift.min()), ("most", near.shift.max())):
            rows.append(CheckedNumber(f"{name} at 150 m: later by, {extreme}", 1e3 * float(value), "ms"))
        gain = float(level_db(np.mean(10 ** (near.gain_db / 10))))
        rows.append(CheckedNumber(f"{name} at 150 m: level higher by, mean of the spikes", gain, "dB"))
    rows.append(CheckedNumber("echo of the target: more energy", echo_gain(), "dB"))
    for name in ("box", "seabed", "surface"):
        later = 1e3 * float(np.mean(_near(profile_effect(name, WARM_LAYER)).shift))
        rows.append(CheckedNumber(f"{name} at 150 m under a warm layer: later by", later, "ms"))
    return [
        *rows,
        CheckedNumber("seabed over direct paths, farthest", float(profile_effect("seabed").distance.max()), "m"),
    ]


def echo_gain() -> float:
    """Increase of the energy of the target's direct echo by the profile [dB]."""
    energy = [
        simulate(scene(profile, {"paths.contributions": ["target"], "field": "incoherent"}))["intensity"].values.sum()
        for profile in (True, False)
    ]
    return float(level_db(energy[0] / energy[1]))


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    figure = style.new_figure(10.5, 13)
    _panels(figure)
    scenarios = {"one speed": scene(False), "thermocline": scene(True)}
    return figure, scenarios, numbers()


def _panels(figure: Figure) -> None:
    above, middle, below = figure.subfigures(3, 1, height_ratios=(1, 1.75, 0.8), squeeze=False)[:, 0]
    scene_panel(above, scene(False), f"a  direct rays at {SOUND_SPEED:g} m/s")
    spikes, energy, series = middle.subplots(3, 1, sharex=True)
    spike_panel(spikes, scene(False), "b  spike array at one speed, by contribution")
    curves(energy, levels(scene(False)), WINDOW)
    _with_profile(energy)
    energy.set(title="c  expected level of each contribution; dotted: under the profile", ylim=SPAN)
    series_panel(series, scene(False), "d  coherent series at one speed")
    for axes in (spikes, energy):
        axes.set_xlabel("")
    later, stronger = below.subplots(1, 2)
    _changes(later, stronger)


def _with_profile(axes: Axes) -> None:
    """Draw expected levels under the profile, dotted, over those without."""
    expected = levels(scene(True))["level_db"].sel(pair="all")
    for contribution in ("seabed", "surface", "target"):
        level = expected.sel(contribution=contribution).values
        axes.plot(
            expected["time"].values * 1e3, level, ":", color=style.CONTRIBUTION_COLOURS[contribution], linewidth=1.4
        )


def _near(effect: ProfileEffect) -> ProfileEffect:
    """The same of the scatterers about the box's distance only."""
    near = np.abs(effect.distance - 150.5) <= 0.75
    return ProfileEffect(*(getattr(effect, field.name)[near] for field in fields(effect)))


def _changes(later: Axes, stronger: Axes) -> None:
    """Draw shift and change of level of every arrival over its distance."""
    for name, contribution in (("surface", "surface"), ("seabed", "seabed"), ("box", "target")):
        effect, colour = profile_effect(name), style.CONTRIBUTION_COLOURS[contribution]
        order = np.argsort(effect.distance)
        mark, wide = (".", 3.0) if name == "box" else ("-", 1.6)
        for axes, column in ((later, 1e3 * effect.shift), (stronger, effect.gain_db)):
            axes.plot(effect.distance[order], column[order], mark, color=colour, markersize=wide, linewidth=wide,
                      label=contribution)  # fmt: skip
        layer = profile_effect(name, WARM_LAYER)
        order = np.argsort(layer.distance)
        for axes, column in ((later, 1e3 * layer.shift), (stronger, layer.gain_db)):
            axes.plot(layer.distance[order], column[order], ":", color=colour, linewidth=1.4)
    for axes, title, label in (
        (later, "e  delay re one speed: profile; dotted: warm layer", "increase of two-way delay [ms]"),
        (stronger, "f  level re one speed", "increase of two-way level [dB]"),
    ):
        axes.axhline(0, color=style.QUIET, linewidth=0.8)
        axes.set(title=title, xlabel="horizontal range [m]", ylabel=label, xlim=(0, 180))
    later.legend(loc="lower left")
