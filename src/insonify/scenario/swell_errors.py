"""Swells that focus: a path off a tilted plane has one bounce point, and a curved enough swell gives it several."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.model import field_error
from insonify.propagation.bounding_cylinders import bounding_cylinders
from insonify.propagation.displaced_bounce import vertical_travel_to_bounces
from insonify.propagation.families import families_reaching, image_depth, surface_bounces
from insonify.scene.scatterers import Boundary
from insonify.scene.target import PointTarget

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

Floats = NDArray[np.float64]
DEPTHS = 5
"""Depths of a target that are tried."""


def swell_errors(scenario: ScenarioParts, array_positions: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    """A tilted swell that gives some path of some ping more bounce points than one.

    Args:
        scenario: The scenario.
        array_positions: Places of the platform and of its arrays [m], by name, each of shape (pings, 3).
    """
    swell = scenario.surface.swell
    if scenario.surface.reflection != "tilted" or swell is None:
        return
    flatness, name = required_curvature_radius(scenario, array_positions)
    if swell.curvature * flatness <= 1:
        return
    height = two_digits(swell.height / (swell.curvature * flatness), down=True)
    length = two_digits(math.pi * math.sqrt(2 * swell.height * flatness), down=False)
    yield field_error(
        "surface.swell", f"{swell.height:g} m high and {swell.length:g} m long",
        f"is so curved that a path {name} in the window reflects at several points, and one tilted plane cannot stand "
        f"for it. Give a height of at most {height:g} m, a length of at least {length:g} m, a shorter window, or "
        "reflection: explicit.",
    )  # fmt: skip


def required_curvature_radius(scenario: ScenarioParts, ends: dict[str, Floats]) -> tuple[float, str]:
    """Inverse of the least curvature with which a swell gives a path a second bounce point [m], and its family.

    A path with heights h1 and h2 climbed before and after the bounce has 2 h1 h2 r^2 / (h1 + h2)^3: it grows with
    distance, so that the farthest point in the window decides, at any ping, by every family.

    Args:
        scenario: The scenario.
        ends: See `swell_errors`.
    """
    positions = np.concatenate(list(ends.values()))
    worst, which = 0.0, ""
    for boundary, depths, nearest, farthest in _ends(scenario, positions):
        for family in families_reaching(boundary, scenario.paths.followed_families):
            if not surface_bounces(family):
                continue
            for source in np.unique(np.round([positions[:, 2].min(), positions[:, 2].max()], 9)):
                flatness = _curvature_radius(scenario, family, float(source), depths, nearest, farthest)
                if flatness > worst:
                    worst, which = flatness, family
    return worst, which


def _ends(scenario: ScenarioParts, positions: Floats) -> Iterator[tuple[Boundary, Floats, float, float]]:
    """Boundary of what paths end at, its depths, and distances over ground from the track, nearest and farthest [m]."""
    scene, contributions = scenario.scene, scenario.paths.contributions
    bed, law = scene.seabed.terrain, scenario.seabed.law(scenario.sonar.pulse.frequency, 1500.0)
    if "seabed" in contributions and law is not None:
        yield "seabed", np.array([scene.seabed.depth] if bed is None else [bed.depth, *bed.span]), 0.0, np.inf
    if "surface" in contributions and scenario.surface.scattering is not None:
        yield "surface", np.zeros(1), 0.0, np.inf
    if "water" in contributions and scene.water.scatters:
        yield "water", np.linspace(0.0, scene.seabed.depth, 2 * DEPTHS), 0.0, np.inf
    if "target" not in contributions:
        return
    cylinders = [(*one[:3], one[3], one[4]) for one in bounding_cylinders(scene)]
    cylinders += [
        (*point[:2], 0.0, point[2], point[2])
        for point in (target.position for target in scene.targets if isinstance(target, PointTarget))
    ]
    for north, east, radius, top, base in cylinders:
        away = np.hypot(positions[:, 0] - north, positions[:, 1] - east)
        yield "target", np.linspace(top, base, DEPTHS), float(away.min() - radius), float(away.max() + radius)


def _curvature_radius(
    scenario: ScenarioParts, family: str, source: float, depths: Floats, nearest: float, farthest: float
) -> float:  # fmt: skip
    """Largest flatness of the paths of one family from one depth to some depths within the window [m]."""
    water, bed = scenario.water, scenario.seabed.depth
    longest = water.max_sound_speed * scenario.track.window[1] / 2
    climb = np.maximum(np.abs(depths - image_depth(family, source, bed)), 1e-6)
    # in the window by the family that is there first
    first = min(
        (np.abs(depths - image_depth(name, source, bed)).min() for name in scenario.paths.followed_families),
        default=0.0,
    )
    reach = min(math.sqrt(max(longest**2 - first**2, 0.0)), farthest)
    if reach < nearest:
        return 0.0
    slant = np.hypot(reach, climb)
    one = np.array(vertical_travel_to_bounces(family, source, bed))[:, None]
    part = np.clip(one / climb, 0.0, 1.0)
    return float(np.max(2 * part * (1 - part) * slant**2 / climb))


def two_digits(value: float, *, down: bool) -> float:
    """A number of two digits that is not above, or not below, another one.

    Args:
        value: The other number, above 0.
        down: True: not above it.
    """
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return round((math.floor if down else math.ceil)(value / unit * (1 + (1e-9 if down else -1e-9))) * unit, 12)
