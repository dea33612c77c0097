"""Caches of an eigenray engine: results of the last pings, which sides, sound and labels have in common."""

from dataclasses import dataclass, field

from insonify.engines.quadrature_points import MAX_CACHED_LAYOUTS, QuadratureLayout
from insonify.engines.relief_specular_points import SpecularPoints
from insonify.engines.terrain_occlusion import TerrainOcclusion
from insonify.recent_results import RecentResults
from insonify.records.pairs import Pairs
from insonify.scene.drawn_tiles import DrawnTiles
from insonify.scene.terrain.array_cache import ArrayCache

PINGS = 8
"""Pings whose terrain occlusion, boundary echoes and received targets are kept."""
PATHS = 64
"""Paths whose specular points are kept: those of a ping on each thread."""
BOUNDARIES = 4
"""Boundaries whose scatterers are kept, random ones and those of expectations."""
FRACTION_BYTES = 1 << 20
"""Memory of the energy fractions [bytes]."""


@dataclass(frozen=True)
class EngineCaches:
    """Results of the last pings."""

    terrain_occlusion: RecentResults[TerrainOcclusion] = field(default_factory=lambda: RecentResults(PINGS))
    """Terrain occlusion, by the positions of the sonar's ends."""
    energy_fractions: ArrayCache = field(default_factory=lambda: ArrayCache(FRACTION_BYTES))
    """Energy fractions of pairs of families, by depth and attitude."""
    layouts: RecentResults[QuadratureLayout] = field(default_factory=lambda: RecentResults(MAX_CACHED_LAYOUTS))
    """Quadrature points about the sonar, by attitude."""
    specular_points: RecentResults[SpecularPoints | None] = field(default_factory=lambda: RecentResults(PATHS))
    """Specular points of relief, by the ends of the sonar."""
    boundary_echoes: RecentResults[Pairs] = field(default_factory=lambda: RecentResults(PINGS))
    """Boundary echoes, by ping."""
    drawn_tiles: RecentResults[DrawnTiles] = field(default_factory=lambda: RecentResults(BOUNDARIES))
    """Scatterers of tiles, by their boundary."""
    received_targets: RecentResults[tuple[bool, ...]] = field(default_factory=lambda: RecentResults(PINGS))
    """Targets of which an echo is received, by ping."""
