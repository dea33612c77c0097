"""Terrain: endless relief by key, ripples, and which sediment lies where."""

from insonify.scene.terrain.grid import Grid
from insonify.scene.terrain.ground import Ground, grow
from insonify.scene.terrain.power_law import PowerLaw
from insonify.scene.terrain.relief import Relief, Sum, Survey, upward_normal
from insonify.scene.terrain.ripples import Ripples
from insonify.scene.terrain.sediment_map import Patches, Region, SedimentCover, SedimentMap, Strip
from insonify.scene.terrain.split import Split

__all__ = [
    "Grid",
    "Ground",
    "Patches",
    "PowerLaw",
    "Region",
    "Relief",
    "Ripples",
    "SedimentCover",
    "SedimentMap",
    "Split",
    "Strip",
    "Sum",
    "Survey",
    "grow",
    "upward_normal",
]
