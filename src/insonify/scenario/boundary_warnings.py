"""A sonar that all but touches the surface or the bed: what it is taken for there, and what that takes to run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from insonify.scenario.track_errors import PLATFORM, RECEIVER, array_positions, seabed_depth_span
from insonify.scene.solid import seabed_depth_at

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

SLOW = 0.1
"""Distance from a boundary below which cells of the ground get no smaller, though they should [m]."""


def boundary_warning(scenario: ScenarioParts) -> str:
    """Warning on arrays that come within a wavelength of a boundary; empty where none does."""
    wavelength = scenario.water.min_sound_speed / scenario.sonar.pulse.frequency
    near = min(wavelength, SLOW)
    for name, position in array_positions(scenario).items():
        if name in (PLATFORM, RECEIVER):
            continue
        if position[:, 2].min() >= near and seabed_depth_span(scenario)[0] - position[:, 2].max() >= near:
            continue
        above = seabed_depth_at(scenario.completed_seabed, position) - position[:, 2]
        for what, gap in (("the sea surface", position[:, 2]), ("the seabed", above)):
            if np.any(gap < near):
                ping = int(np.nanargmin(gap))
                return (
                    f"track: {name} comes within {1e3 * float(gap[ping]):.2g} mm of {what} at ping {ping}, less than a "
                    f"wavelength ({1e3 * wavelength:.2g} mm): its near field is not followed, and cells of "
                    f"5 mm, the smallest, are too large there. Keep it {SLOW:g} m away or more."
                )
    return ""
