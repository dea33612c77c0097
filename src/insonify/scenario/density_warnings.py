"""Warnings on random scatterers denser than their finest grid holds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from insonify.propagation.families import families_reaching
from insonify.scenario.platform_poses import platforms
from insonify.scenario.swell_errors import two_digits
from insonify.scene.scatterer_grid import BASE_PITCH, FINEST_SCALE
from insonify.sonar.ping_geometry import array_depths, ping_geometry
from insonify.sonar.received_pulse import received_pulse

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts
    from insonify.scene.scatterers import Boundary

MIN_CELL_SIZE = (BASE_PITCH * 2.0**FINEST_SCALE) ** 2
"""Area of the smallest cells of the scatterers' grid [m^2]."""
NARROWEST = 1e-4
"""Width that no beam falls short of [rad]: arrays of 5000 wavelengths."""
SHORTEST = 0.02
"""Length that no cell of slant range falls short of, over the height above the boundary, unless the pulse does [1]."""
ENOUGH = 0.99
"""Fraction of the requested density that gets no warning [1]: beam widths are computed to fewer digits."""


def density_warnings(scenario: ScenarioParts) -> list[str]:
    """Warnings about resolution cells that the finest grid of scatterers leaves emptier than requested."""
    paths, two = scenario.paths, scenario.receiver_track is not None
    if paths.geometry == "slice" or paths.engine == "tracer" or (scenario.field == "incoherent" and not two):
        return []
    sparse: list[tuple[float, Boundary]] = []
    depths = array_depths(scenario.sonar, platforms(scenario))
    for boundary, boundary_depth, _, _ in scattering_boundaries(scenario):
        height = float(np.abs(boundary_depth - depths).min())
        if _least_bound(scenario, height) < MIN_CELL_SIZE:
            sparse.append((_smallest_cell(scenario, height) / MIN_CELL_SIZE, boundary))
    if not sparse or min(sparse)[0] >= ENOUGH:
        return []
    part, boundary = min(sparse)
    most = two_digits(part * paths.scatterers_per_cell, down=True)
    return [
        f"paths.scatterers_per_cell: {paths.scatterers_per_cell:g} are requested, but scatterers lie "
        f"{1e3 * np.sqrt(MIN_CELL_SIZE):.3g} mm apart at the closest: the smallest resolution cells of the {boundary} "
        f"hold {most:g}. Give {most:g} or fewer; 5 make speckle."
    ]


def scattering_boundaries(scenario: ScenarioParts) -> Iterator[tuple[Boundary, float, tuple[str, ...], object]]:
    """Boundaries that scatter and are reached: name, depth [m], families of the legs to them, and scattering law."""
    boundaries: tuple[tuple[Boundary, float, object], ...] = (
        ("seabed", scenario.seabed.depth, scenario.seabed.scattering),
        ("surface", 0.0, scenario.surface.scattering),
    )
    for boundary, depth, law in boundaries:
        families = families_reaching(boundary, scenario.paths.followed_families)
        if law is not None and boundary in scenario.paths.contributions and families:
            yield boundary, depth, families, law


def _least_bound(scenario: ScenarioParts, height: float) -> float:
    """Area that no scatterer of a boundary at some height falls short of [m^2], without a look at the beams."""
    water, sonar, width = scenario.water, scenario.sonar, NARROWEST
    slant = min(received_pulse(sonar).finest_resolution(water.min_sound_speed), SHORTEST * height)
    if (track := sonar.receiver.synthetic_aperture) is not None:
        width = min(width, water.min_sound_speed / sonar.pulse.frequency / 2 / track)
    return min(slant * height * width / scenario.paths.scatterers_per_cell, slant**2)


def _smallest_cell(scenario: ScenarioParts, height: float) -> float:
    """Smallest area of one scatterer on a boundary at some height, within the first ping's window [m^2]."""
    from insonify.engines.ping_scatterers import resolution_of  # kernels, which few scenarios need here

    poses, window = platforms(scenario), scenario.track.window
    geometry = ping_geometry(scenario.sonar.side_sonars[0], poses, 0, window=window, water=scenario.water,
                             pulse=received_pulse(scenario.sonar), seed=scenario.seed)  # fmt: skip
    cells = resolution_of(scenario.scene, scenario.paths, geometry)
    speeds = scenario.water.min_sound_speed, scenario.water.max_sound_speed
    ranges = np.multiply(speeds, geometry.recorded_delays) / 2
    near, far = (np.sqrt(np.maximum(np.array([one]) ** 2 - height**2, 0.0)) for one in ranges)
    return float(cells.finest(near, far, height)[0])
