"""Warnings on explicit sea surfaces that may do more than was meant: each given once, with its numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from insonify.propagation.families import first_boundary, last_boundary, surface_bounces

if TYPE_CHECKING:
    from insonify.propagation.explicit_surface import ExplicitWaves
    from insonify.scenario.scenario_parts import ScenarioParts

CROWDED = 1.5
"""Curvature across a path, over that of a mirror, from which decibels are lost [1]."""
BEARINGS = np.linspace(0, np.pi, 37)
"""Bearings of paths that are tried [rad]."""


def wave_warnings(scenario: ScenarioParts, shallowest: float) -> Iterator[str]:
    """Words on waves that focus too much to be followed, or that reach the sonar.

    Args:
        scenario: A scenario whose surface is of waves.
        shallowest: Least depth of the sonar [m].
    """
    # kernels, which few scenarios need
    from insonify.propagation.explicit_surface import MAX_BOUNCE_POINTS, explicit_waves

    sea = explicit_waves(scenario.surface, scenario.seed, scenario.seabed.depth)
    high = 2 * math.sqrt(2) * float(np.linalg.norm(sea.waves[4]))  # four times the rms height
    if shallowest < high / 2:
        yield (
            f"surface: crest to trough the waves are {high:.2g} m high, and the sonar swims at {shallowest:.2g} m: "
            "troughs reach down to it, and bounces near it mean little. Give a deeper track, or lower waves."
        )
    across, count = wave_focusing(sea, scenario, shallowest)
    if across > CROWDED or count > MAX_BOUNCE_POINTS:
        advice = "Give a longer swell."
        if scenario.surface.wind_speed:
            advice = "Give a longer surface.cutoff_wavelength, or reflection: statistical."
        yield (
            f"surface: the waves drawn are so curved that the farthest paths meet about {count:.0f} bounce points each "
            f"({MAX_BOUNCE_POINTS} are followed), with a curvature across the path of {across:.2g} of what makes "
            f"several side by side (of which one is). Surface echoes are too weak by decibels. {advice}"
        )


def wave_focusing(sea: ExplicitWaves, scenario: ScenarioParts, shallowest: float) -> tuple[float, float]:
    """Margin of waves to one bounce a path: curvature across the path over that of its mirror; bounces along it.

    A surface of curvature c adds 2 c sin(g) to the curvature of a path's length, that of a mirror being 1/r1 + 1/r2
    across the path and sin^2(g) times as much along it. With h1, h2 the heights climbed before and after, both ratios
    are 2 c h1 h2 / (h1 + h2), but for sin^2(g). Of a Gaussian ratio of rms P much above 1 the mean number of zeros is P
    sqrt(2 / pi).

    Args:
        sea: The waves.
        scenario: Whose paths meet them.
        shallowest: Least depth of the sonar [m].
    """
    bed, farthest = scenario.seabed.depth, scenario.water.max_sound_speed * scenario.track.window[1] / 2
    north, east, _, _, amplitude = sea.waves
    along = 2 * math.pi * np.abs(np.outer(np.cos(BEARINGS), north) + np.outer(np.sin(BEARINGS), east))
    curvature = float(np.sqrt(np.max(along**4 @ amplitude**2) / 2))
    worst, most = 0.0, 0.0
    for name in scenario.paths.followed_families:
        if surface_bounces(name):
            one = 2 * bed - shallowest if first_boundary(name) == "bottom" else shallowest
            two = 2 * bed if last_boundary(name) == "bottom" else bed
            ratio = 2 * curvature * one * two / (one + two)
            sine = min((one + two) / max(farthest, 1e-3), 1.0)
            worst, most = max(worst, ratio), max(most, math.sqrt(2 / math.pi) * ratio / sine**2)
    return worst, most
