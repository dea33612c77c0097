"""The paper's first model: the expected intensity of a sidescan sonar that passes a box on a sandy, fractal seabed.

Changed in the nominal scene: expected intensity (`field: incoherent`); medium sand by Jackson's model; and relief of
Hurst exponent 0.8, 3 cm rms, for wavelengths up to 20 m. The paper gives neither the sand nor its relief. Reflections
are set by each figure. Every figure is drawn twice, in water of 1500 m/s and under the thermocline of
`thermocline_model`.

The expected numbers follow from straight lines and exact eigenrays over a flat bed, and from the pattern of
the arrays, without scatterers, tables or synthesis of the engine.
"""

from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.ocean.profile import SoundSpeedProfile
from insonify.paper.nominal_scenario import box, nominal
from insonify.paper.thermocline_model import PROFILE, SOUND_SPEED
from insonify.propagation.eigenray import eigenrays
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.units import intensity_ratio, level_db

Water = Literal["one speed", "thermocline"]
WATERS: tuple[Water, ...] = ("one speed", "thermocline")
"""Constant sound speed, and the summer profile of figure 1."""
SONAR, BED, FACE, BACK, TOP = 11.0, 20.0, 150.0, 151.0, 19.0
"""Depths of sonar and bed, distances of the box's near and far faces, and depth of its top [m]."""
TITLES: dict[Water, str] = {"one speed": "1500 m/s at all depths", "thermocline": "under the thermocline of figure 1"}
"""Titles of the waters."""
OWN = 2.0
"""Length of the paper's box along the track [m]."""
RELIEF = 0.03
"""Rms height of the fractal bed in the pictures [m]."""
PULSE = 0.2e-3
"""Length of the pulse [s]."""
CELL = PULSE * SOUND_SPEED / 2
"""Resolution cell of slant range [m]."""
APERTURE, WAVELENGTH = 1.5, SOUND_SPEED / 100e3
"""Length of the arrays and wavelength [m]."""
INTERVAL = 0.3
"""Ping interval [s]."""
GRAINS = 2.0
"""Scatterers in each cell of a bare bed, sufficient for an expected intensity without speckle and shadow [1]."""

Floats = NDArray[np.float64]


def fractal(rms: float) -> dict[str, Any] | None:
    """Relief of an rms height [m]; None for 0."""
    return {"kind": "power-law", "hurst": 0.8, "rms": rms, "outer_scale": 20.0} if rms else None


def scene(water: Water, changes: dict[str, Any] | None = None, *, relief: float = 0.0) -> Scenario:
    """Scenario of the first model.

    Args:
        water: Water with or without the profile.
        changes: Other values by dotted name.
        relief: Rms height of the bed's relief [m]; 0 for a flat bed.
    """
    speed: dict[str, Any] = {"water.sound_speed": SOUND_SPEED}
    if water == "thermocline":
        speed = {"water.profile": [list(knot) for knot in PROFILE], "water.sound_speed": None}
    fixed = {
        "field": "incoherent", "seabed.scattering": {"law": "jackson", "sediment": "medium sand"},
        "seabed.relief": fractal(relief),
    }  # fmt: skip
    return nominal({**speed, **fixed, **(changes or {})})


def passing(half: float, pings: int) -> dict[str, Any]:
    """Track to the north past the box.

    Args:
        half: Distance run on either side of the box [m].
        pings: Number of pings, uniformly spaced.
    """
    return {
        "kind": "line", "start": [-half, 0.0, SONAR], "heading": 0.0, "speed": 2 * half / (pings - 1) / INTERVAL,
        "pings": pings, "interval": INTERVAL,
    }  # fmt: skip


def along(water: Water, changes: dict[str, Any], *, half: float, pings: int, window: tuple[float, float],
          relief: float = 0.0) -> Scenario:  # fmt: skip
    """Scenario of an image, see `scene` and `passing`.

    Args:
        water: Water with or without the profile.
        changes: Other values by dotted name.
        half: Distance run on either side of the box [m].
        pings: Number of pings.
        window: Recorded window of each ping [s].
        relief: Rms height of the bed's relief [m].
    """
    track = {"track": {**passing(half, pings), "window": window}}
    return scene(water, {**track, **changes}, relief=relief)


@lru_cache(maxsize=2)
def _profile(water: Water) -> SoundSpeedProfile:
    knots = PROFILE if water == "thermocline" else ((0.0, SOUND_SPEED), (BED, SOUND_SPEED))
    return SoundSpeedProfile(*(np.array(column) for column in zip(*knots, strict=True)))


class Ray(NamedTuple):
    """Exact ray to a point."""

    delay: float
    """Travel time [s]."""
    angle: float
    """Angle of arrival, + down [rad]."""
    amplitude: float
    """Pressure by spreading re 1 m [1]."""
    length: float
    """Path length [m]."""


@lru_cache(maxsize=256)
def ray(water: Water, family: str, distance: float, depth: float) -> Ray:
    """First exact ray of a family; NaN where there is none.

    Args:
        water: Water with or without the profile.
        family: Family, such as D or S.
        distance: Horizontal distance of the point [m].
        depth: Depth of the point [m].
    """
    solutions = eigenrays(
        _profile(water), water_depth=BED, source_depth=SONAR, point_depth=depth, range=distance, families=(family,)
    )
    first = int(np.argmin(np.where(np.isnan(solutions.delay), np.inf, solutions.delay)))
    columns = (solutions.delay, solutions.arrival_angle, solutions.amplitude, solutions.path_length)
    return Ray(*(float(column[first]) for column in columns))


def two_way(water: Water, out: str, back: str, distance: float, depth: float) -> float:
    """Two-way delay by one family of the transmit leg and another of the receive leg [s]."""
    return ray(water, out, distance, depth).delay + ray(water, back, distance, depth).delay


def shadow_end(water: Water, family: str = "D", height: float = BED - TOP) -> float:
    """Distance of the end of the box's shadow on the flat bed, by the ray over its far edge [m].

    Args:
        water: Water with or without the profile; the lowest metres have one speed in both.
        family: Family of the shadowed legs.
        height: Height of the box [m].
    """
    return BACK + height / float(np.tan(ray(water, family, BACK, BED - height).angle))


@lru_cache(maxsize=8)
def _two_way_delays(water: Water, depth: float) -> tuple[Floats, Floats]:
    """Distances [m] and two-way delays by direct rays [s] around the target."""
    distance = np.linspace(140.0, 200.0 if water == "one speed" else 161.5, 601)
    solutions = eigenrays(
        _profile(water), water_depth=BED, source_depth=SONAR, point_depth=depth, range=distance, families=("D",)
    )
    first = np.searchsorted(solutions.point, np.arange(distance.size))
    return distance, 2 * solutions.delay[first]


def distance_of(water: Water, delay: float, depth: float = BED) -> float:
    """Horizontal distance of a direct echo with a delay [m].

    Args:
        water: Water with or without the profile.
        delay: Two-way delay [s].
        depth: Depth of the scatterer [m].
    """
    distance, delays = _two_way_delays(water, depth)
    return float(np.interp(delay, delays, distance))


def ground_cell(water: Water, distance: float) -> float:
    """Length of the flat bed covered by the pulse at a distance [m]."""
    delay = two_way(water, "D", "D", distance, BED)
    return distance_of(water, delay + PULSE) - distance_of(water, delay)


@lru_cache(maxsize=1)
def _pattern() -> tuple[Floats, Floats]:
    """Bearings [rad] and cumulative two-way energy of two uniform lines, sinc^4 [1]."""
    bearing = np.linspace(-np.pi / 2, np.pi / 2, 400_001)
    energy = np.cumsum(np.sinc(APERTURE / WAVELENGTH * np.sin(bearing)) ** 4)
    return bearing, energy / energy[-1]


def beam_leakage_db(length: float = OWN) -> float:
    """Contrast of the shadow of a box, limited by the two-way beam's energy beside the box [dB]."""
    cut = np.interp(np.arctan2(length / 2, FACE) * np.array([-1, 1]), *_pattern())
    return -float(level_db(1 - (cut[1] - cut[0])))


def footprint(part: float) -> float:
    """Width at the box's face that contains a part of the two-way beam's energy [m]."""
    bearing, energy = _pattern()
    left, right = np.interp([(1 - part) / 2, (1 + part) / 2], energy, bearing)
    return float(FACE * (np.tan(right) - np.tan(left)))


@lru_cache(maxsize=24)
def expected_ping(scenario: Scenario) -> tuple[Floats, Floats]:
    """Times [s] and expected intensity of the first ping [uPa^2], shape (time,) each."""
    sound = simulate(scenario)
    return sound["time"].values, sound["intensity"].values[0, 0]


def mean_level(time: Floats, intensity: Floats, window: tuple[float, float]) -> float:
    """Level of the mean intensity over a window [dB re 1 uPa]."""
    return float(level_db(intensity[(time >= window[0]) & (time < window[1])].mean()))


def ripple(time: Floats, intensity: Floats, window: tuple[float, float]) -> float:
    """Standard deviation of the level in a window without a cubic trend [dB]."""
    inside = (time >= window[0]) & (time < window[1])
    level, x = level_db(intensity[inside]), np.linspace(-1, 1, int(inside.sum()))
    return float(np.std(level - np.polyval(np.polyfit(x, level, 3), x)))


def shadow_end_time(time: Floats, intensity: Floats, around: float, *, reach: float = 0.5e-3) -> float:
    """End of a shadow [s]: half the rise of the intensity, less half of the pulse.

    Args:
        time: Times [s], shape (time,).
        intensity: Expected intensity [uPa^2], shape (time,).
        around: Centre of the search window [s].
        reach: Half length of the search window [s].
    """
    near = (time > around - reach) & (time < around + PULSE + reach)
    part = intensity[near]
    edge = int(PULSE / 2 / (time[1] - time[0]))
    half = (part[:edge].mean() + part[-edge:].mean()) / 2
    after = int(np.argmax(part > half))
    low, high = part[after - 1], part[after]
    step = (half - low) / (high - low)
    return float(time[near][after - 1] + step * (time[1] - time[0]) - PULSE / 2)


def echo(curves: xr.Dataset, pair: str) -> tuple[float, float]:
    """Centre of the face's echo [s] and energy of the target's echo [uPa^2 s] by one pair of legs.

    Args:
        curves: Levels of the target over (pair, time) [dB re 1 uPa].
        pair: Name of the pair, such as D-S.
    """
    time = curves["time"].values
    power = intensity_ratio(curves["level_db"].sel(pair=pair).values)
    face = np.where(power > power.max() / 10, power, 0.0)  # the top of the box is weaker, and later
    return float(np.sum(time * face) / face.sum()), float(power.sum() * (time[1] - time[0]))


def target_only(changes: dict[str, Any] | None = None) -> dict[str, Any]:
    """Changes for the contribution of the box only."""
    return {"paths.contributions": ["target"], **(changes or {})}


def without_box(changes: dict[str, Any] | None = None) -> dict[str, Any]:
    """Changes for a scene without the box."""
    return {"targets": [], **(changes or {})}


def with_box(height: float) -> dict[str, Any]:
    """Changes for a box of another height [m]."""
    return {"targets": [{**box(OWN), "size": [OWN, 1.0, height]}]}


def images(dataset: xr.Dataset) -> tuple[Floats, Floats, Floats]:
    """Distance run from the box [m] (ping,), time [s] (time,), and level [dB re 1 uPa] (ping, time)."""
    run = dataset["position"].values[:, 0]
    return run, dataset["time"].values, level_db(dataset["intensity"].values[:, 0])
