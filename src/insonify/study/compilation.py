"""Compilation that the first run of an installation has before it: which kernels are not in numba's cache yet.

One kernel stands for all those that a feature needs; whether its machine code is kept is looked up, nothing is loaded.
"""

from pathlib import Path
from typing import NamedTuple

import insonify
from insonify.propagation.images import StraightRays
from insonify.simulation import Listening
from insonify.stale_kernels import cache_folder

PACKAGE = Path(insonify.__file__).parent


class Feature(NamedTuple):
    """Kernels that a feature needs."""

    module: str
    """Module of the kernel that stands for them, below `insonify`."""
    kernel: str
    """Name of that kernel."""
    seconds: float
    """Processor time that all of them take to compile [s]."""


COHERENT = Feature("engines._kept_kernel", "keep", 35.0)
BEAMS = Feature("synthesis._block_kernel", "spread_block", 34.0)
FAST = Feature("engines._swath_kernel", "walk", 30.0)
EXPECTED = Feature("synthesis._spread", "spread_energy", 12.0)
LABELS = Feature("synthesis._label_kernel", "add_places", 8.0)
ELEMENTS = Feature("synthesis._aperture_kernel", "spread_to_elements", 12.0)
RELIEF = Feature("engines._skyline_kernel", "skyline_at", 25.0)
REFRACTION = Feature("propagation._table_kernel", "read_cells", 25.0)
GLINTS = Feature("propagation._glint_kernel", "draw_glint", 8.0)
WAVES = Feature("propagation._stationary_kernel", "search", 20.0)
SOLIDS = Feature("propagation._solid_kernel", "shade_legs", 12.0)
TRACER = Feature("engines.tracer._trace_kernel", "first_hits", 20.0)


def compile_seconds(listening: Listening, *, labels: bool = False) -> float:
    """Processor time to compile what a run needs and no earlier one has left in the cache [s].

    Args:
        listening: A prepared scenario.
        labels: Whether samples are labelled.
    """
    return float(sum(one.seconds for one in _needed(listening, labels) if not _kept(one)))


def _needed(listening: Listening, labels: bool) -> list[Feature]:
    """Features of a scenario that have kernels of their own."""
    scenario, rays = listening.scenario, listening.engine.rays
    if listening.tracer is not None:
        return [TRACER]
    expected, side = scenario.field == "incoherent", listening.stances(0)[0]
    ground = "seabed" in scenario.paths.causes and scenario.seabed.scattering is not None
    drawn = not expected and ground and scenario.paths.geometry == "3d"
    wanted = {
        COHERENT: drawn,
        BEAMS: drawn and side.elements is None and not listening.coherent(side).plain,
        FAST: expected and listening.incoherent(side).brief and listening.ground(side) is not None,
        EXPECTED: expected or labels,
        LABELS: labels,
        ELEMENTS: scenario.sonar.receiver.record == "elements",
        RELIEF: bool(scenario.seabed.relief),
        REFRACTION: not isinstance(rays, StraightRays),
        GLINTS: not expected and scenario.surface.bounce == "statistical",
        WAVES: scenario.surface.bounce == "waves",
        SOLIDS: bool(listening.engine.scene.occluders),
    }
    return [feature for feature, used in wanted.items() if used]


def _kept(feature: Feature) -> bool:
    """Return True if machine code of a feature is in the cache."""
    source = PACKAGE.joinpath(*feature.module.split(".")).with_suffix(".py")
    return any(cache_folder(PACKAGE)(source.parent).glob(f"{source.stem}.{feature.kernel}-*.nbi"))
