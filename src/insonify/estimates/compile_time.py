"""Compile time of the first run of an installation: kernels that are not in numba's cache yet.

One kernel represents all those that a feature needs; its cache file is looked up, nothing is loaded.
"""

from pathlib import Path
from typing import NamedTuple

import insonify
from insonify.kernel_cache import cache_folder
from insonify.propagation.image_sources import StraightRays
from insonify.simulator import Simulator

PACKAGE = Path(insonify.__file__).parent


class FeatureKernels(NamedTuple):
    """Kernels that a feature needs."""

    module: str
    """Module of the kernel that represents them, below `insonify`."""
    kernel: str
    """Name of that kernel."""
    seconds: float
    """Processor time that all of them take to compile [s]."""


COHERENT = FeatureKernels("engines._draw_kernel", "draw_and_keep", 35.0)
BEAMS = FeatureKernels("synthesis._beam_arrivals_kernel", "deposit_block", 34.0)
FAST = FeatureKernels("engines.fast_reverberation._walk_kernel", "walk_radials", 30.0)
EXPECTED = FeatureKernels("synthesis._gridding", "deposit_energy", 12.0)
LABELS = FeatureKernels("synthesis._label_kernel", "deposit_label_positions", 8.0)
ELEMENTS = FeatureKernels("synthesis._element_arrivals_kernel", "deposit_on_elements", 12.0)
RELIEF = FeatureKernels("engines._terrain_occlusion_kernel", "horizon_at", 25.0)
REFRACTION = FeatureKernels("propagation._eigenray_table_kernel", "interpolate_cells", 25.0)
GLINTS = FeatureKernels("propagation.glint_kernel", "sample_glint", 8.0)
WAVES = FeatureKernels("propagation._stationary_point_kernel", "search_bounce_points", 20.0)
SOLIDS = FeatureKernels("propagation._solid_shadow_kernel", "occlude_legs", 15.0)
TRACER = FeatureKernels("engines.tracer._trace_kernel", "first_hits", 20.0)
REFRACTED_TRACER = FeatureKernels("engines.tracer._refracted_ray_kernel", "refracted_hits", 20.0)
TRACER_FACETS = FeatureKernels("engines.tracer._facet_kernel", "sample_wavenumbers", 5.0)


def estimate_compile_seconds(simulator: Simulator, *, labels: bool = False) -> float:
    """Processor time to compile the kernels of a run that are not in the cache [s].

    Args:
        simulator: A prepared scenario.
        labels: True if samples are labelled.
    """
    return float(sum(kernel.seconds for kernel in _needed(simulator, labels) if not _kept(kernel)))


def _needed(simulator: Simulator, labels: bool) -> list[FeatureKernels]:
    """Features of a scenario that have kernels of their own."""
    scenario, rays = simulator.scenario, simulator.engine.rays
    if simulator.tracer is not None:
        refracted = [REFRACTED_TRACER, REFRACTION] if scenario.water.layered else []
        return [TRACER, *refracted, *[TRACER_FACETS] * (scenario.surface.reflection == "statistical")]
    expected, side = scenario.field == "incoherent", simulator.ping_geometries(0)[0]
    has_seabed = "seabed" in scenario.paths.contributions and scenario.seabed.scattering is not None
    drawn = not expected and has_seabed and scenario.paths.geometry == "3d"
    used_by = {
        COHERENT: drawn,
        BEAMS: drawn and side.elements is None and not simulator.coherent_accumulator(side).uses_far_field,
        FAST: expected
        and simulator.incoherent_accumulator(side).is_short_pulse
        and simulator.fast_reverberation(side) is not None,
        EXPECTED: expected or labels,
        LABELS: labels,
        ELEMENTS: scenario.sonar.receiver.record == "elements",
        RELIEF: bool(scenario.seabed.relief),
        REFRACTION: not isinstance(rays, StraightRays),
        GLINTS: not expected
        and (scenario.surface.reflection == "statistical" or scenario.seabed.reflecting_interface == "rough"),
        WAVES: scenario.surface.reflection == "explicit",
        SOLIDS: bool(simulator.engine.scene.occluders),
    }
    return [feature for feature, used in used_by.items() if used]


def _kept(feature: FeatureKernels) -> bool:
    """Return True if machine code of a feature is in the cache."""
    source = PACKAGE.joinpath(*feature.module.split(".")).with_suffix(".py")
    return any(cache_folder(PACKAGE)(source.parent).glob(f"{source.stem}.{feature.kernel}-*.nbi"))
