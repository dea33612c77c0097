"""Random scatterers asked for more densely than their finest grid holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from insonify.propagation.families import families_for
from insonify.scenario.carried import platforms
from insonify.scene.lattice import BASE_PITCH, FINEST_LEVEL
from insonify.sonar.heard import heard_pulse
from insonify.sonar.stance import end_depths, stance

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario
    from insonify.scene.scatterers import Boundary

FINEST_CELL = (BASE_PITCH * 2.0**FINEST_LEVEL) ** 2
"""Area of the smallest cells of the scatterers' grid [m^2]."""
NARROWEST = 1e-4
"""Width that no beam falls short of [rad]: arrays of 5000 wavelengths."""
SHORTEST = 0.02
"""Length that no cell of slant range falls short of, over the height above the boundary, unless the pulse does [1]."""
ENOUGH = 0.99
"""Part of the density asked for that is no fault [1]: beam widths are computed to fewer digits."""


def density_cautions(scenario: Scenario) -> list[str]:
    """Warnings about resolution cells that the finest grid of scatterers leaves emptier than asked for.

    Args:
        scenario: A scenario without faults.
    """
    paths, two = scenario.paths, scenario.receiver_track is not None
    if paths.geometry == "slice" or paths.engine == "tracer" or (scenario.field == "incoherent" and not two):
        return []
    found: list[tuple[float, Boundary]] = []
    depths = end_depths(scenario.sonar, platforms(scenario))
    boundaries: tuple[tuple[Boundary, float, object], ...] = (
        ("seabed", scenario.seabed.depth, scenario.seabed.scattering),
        ("surface", 0.0, scenario.surface.scattering),
    )
    for boundary, level, law in boundaries:
        if law is None or boundary not in paths.causes or not families_for(boundary, paths.followed):
            continue
        height = float(np.abs(level - depths).min())
        if _least_bound(scenario, height) < FINEST_CELL:
            found.append((_smallest_cell(scenario, height) / FINEST_CELL, boundary))
    if not found or min(found)[0] >= ENOUGH:
        return []
    part, boundary = min(found)
    most = part * paths.scatterers_per_cell
    return [
        f"paths.scatterers_per_cell: {paths.scatterers_per_cell:g} are asked for, but scatterers lie "
        f"{1e3 * np.sqrt(FINEST_CELL):.3g} mm apart at the closest: the smallest resolution cells of the {boundary} "
        f"hold {_rounded_down(most)}. Give {_rounded_down(most)} or fewer; 5 make speckle."
    ]


def _least_bound(scenario: Scenario, height: float) -> float:
    """Area that no scatterer of a boundary at some height falls short of [m^2], without a look at the beams."""
    water, sonar, width = scenario.water, scenario.sonar, NARROWEST
    slant = min(heard_pulse(sonar).finest_resolution(water.slowest), SHORTEST * height)
    if (track := sonar.receiver.synthetic_aperture) is not None:
        width = min(width, water.slowest / sonar.pulse.frequency / 2 / track)
    return min(slant * height * width / scenario.paths.scatterers_per_cell, slant**2)


def _smallest_cell(scenario: Scenario, height: float) -> float:
    """Smallest area of one scatterer on a boundary at some height, within the first ping's window [m^2]."""
    from insonify.engines.view import resolution_of  # kernels, which few scenarios ask for here

    carried, window = platforms(scenario), scenario.track.window
    here = stance(scenario.sonar.one_sided[0], carried, 0, window=window, pulse=heard_pulse(scenario.sonar),
                  water=scenario.water, seed=scenario.seed)  # fmt: skip
    cells = resolution_of(scenario.scene, scenario.paths, here)
    ranges = np.array([scenario.water.slowest, scenario.water.fastest]) * np.array(here.heard_delays) / 2
    near, far = (np.sqrt(np.maximum(np.array([one]) ** 2 - height**2, 0.0)) for one in ranges)
    return float(cells.finest(near, far, height)[0])


def _rounded_down(count: float) -> str:
    """A count to two digits, not above it."""
    digits = 10.0 ** (np.floor(np.log10(count)) - 1)
    return f"{np.floor(count / digits + 1e-9) * digits:g}"
