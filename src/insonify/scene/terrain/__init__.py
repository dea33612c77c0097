"""Terrain: endless relief by key, ripples, and which sediment lies where."""

from insonify.scene.terrain.bathymetry_grid import BathymetryGrid
from insonify.scene.terrain.composite_relief import CompositeRelief, build_terrain
from insonify.scene.terrain.power_law import PowerLaw
from insonify.scene.terrain.relief import Relief, ReliefSum, TerrainSample, upward_normal
from insonify.scene.terrain.ripples import Ripples
from insonify.scene.terrain.roughness_cutoff import RoughnessCutoff
from insonify.scene.terrain.sediment_map import (
    SedimentCover,
    SedimentMap,
    SedimentPatches,
    SedimentRegion,
    SedimentStrip,
)

__all__ = [
    "BathymetryGrid",
    "CompositeRelief",
    "PowerLaw",
    "Relief",
    "ReliefSum",
    "Ripples",
    "RoughnessCutoff",
    "SedimentCover",
    "SedimentMap",
    "SedimentPatches",
    "SedimentRegion",
    "SedimentStrip",
    "TerrainSample",
    "build_terrain",
    "upward_normal",
]
