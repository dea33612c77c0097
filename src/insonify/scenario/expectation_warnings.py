"""Expectations that are not converged: too few points or rays for the shadows that the scene has."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

FEWEST = {True: 4.0, False: 1.0}
"""Points in a resolution cell, over relief and on a flat bed, below which 2 ms of a shadow 20 dB deep may be off by
more than 0.3 dB [1]."""
MIN_RAYS = 50_000
"""Rays of the tracer below which they may [1]."""


def expectation_warnings(scenario: ScenarioParts) -> list[str]:
    """Warnings about expected intensities whose shadows are coarsely sampled."""
    paths, relief = scenario.paths, bool(scenario.seabed.relief)
    shaded = scenario.scene.occluders and "seabed" in paths.contributions and scenario.seabed.scattering is not None
    if scenario.field != "incoherent" or not shaded or paths.geometry == "slice":
        return []
    where = "over relief" if relief else "on a flat bed"
    if paths.engine == "tracer":
        if paths.rays >= MIN_RAYS:
            return []
        return [
            f"paths.rays: {paths.rays:,} rays are too few for the shadows of targets: an expected intensity 20 dB down "
            f"may be off by 1 dB and more in 2 ms. Give {MIN_RAYS:,} or more."
        ]
    if paths.scatterers_per_cell >= FEWEST[relief]:
        return []
    return [
        f"paths.scatterers_per_cell: {paths.scatterers_per_cell:g} points are too few for shadows of targets {where}: "
        "an expected intensity 20 dB down may be off by 0.3 to 2 dB in 2 ms. "
        f"Give {FEWEST[relief]:g} or more, or leave it out for 5."
    ]
