"""Caches of an eigenray engine: results of the last pings.

Sides of one ping, and its pressure, intensity and labels, use the same occlusion, echoes and points.
"""

from dataclasses import dataclass, field

from insonify.engines._specular_legs_kernel import SpecularPoints
from insonify.engines.quadrature_points import MAX_CACHED_LAYOUTS, QuadratureLayout
from insonify.engines.terrain_occlusion import TerrainOcclusion
from insonify.recent_results import RecentResults
from insonify.records.pairs import Pairs
from insonify.scene.drawn_tiles import DrawnTiles
from insonify.scene.terrain.array_cache import ArrayCache

PINGS = 8
"""Largest number of terrain occlusions, boundary echoes and sets of received targets: those of a few pings, for both
ends and sides [1]."""
PATHS = 64
"""Largest number of paths whose specular points are kept: those of one ping on each thread [1]."""
BOUNDARIES = 4
"""Largest number of boundaries whose scatterers are kept: seabed and surface, each with random scatterers and with
quadrature points [1]."""
ENERGY_FRACTION_BYTES = 1 << 20
"""Largest memory of the energy fractions [bytes]."""


@dataclass(frozen=True)
class EngineCaches:
    """Results of the last pings, by the parameters on which they depend."""

    terrain_occlusion: RecentResults[TerrainOcclusion] = field(default_factory=lambda: RecentResults(PINGS))
    """Terrain occlusion of legs from one end, by ping, position of that end, and bearing of its first beam."""
    energy_fractions: ArrayCache = field(default_factory=lambda: ArrayCache(ENERGY_FRACTION_BYTES))
    """Energy fractions of pairs of families, by the families, depths of the ends, recording window and beam axes."""
    layouts: RecentResults[QuadratureLayout] = field(default_factory=lambda: RecentResults(MAX_CACHED_LAYOUTS))
    """Quadrature points about the sonar, by ends and beams re its midpoint, the boundary's depth, and the sampling."""
    specular_points: RecentResults[SpecularPoints | None] = field(default_factory=lambda: RecentResults(PATHS))
    """Specular points of relief, by the positions of both ends of a path, or their images, and the wavelength."""
    boundary_echoes: RecentResults[Pairs] = field(default_factory=lambda: RecentResults(PINGS))
    """Boundary echoes, by ping and the positions of both ends."""
    drawn_tiles: RecentResults[DrawnTiles] = field(default_factory=lambda: RecentResults(BOUNDARIES))
    """Random scatterers, or quadrature points, of tiles, by the boundary and the kind."""
    received_targets: RecentResults[tuple[bool, ...]] = field(default_factory=lambda: RecentResults(PINGS))
    """True for each target of which an echo is received, by the ping geometry."""
