"""Ridges and waves of terrain in closed form, and the terrain occlusion of straight rays over them."""

from dataclasses import dataclass

import numpy as np

from insonify.engines.terrain_occlusion import StraightLaunchAngles, TerrainOcclusion
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.terrain import CompositeRelief, Relief, ReliefSum, RoughnessCutoff, TerrainSample

DEPTH, SONAR = 20.0, 11.0


@dataclass(frozen=True)
class Ridge(Relief):
    """A ridge of triangular section that runs to the east, its crest at some distance to the north."""

    crest: float
    height: float
    half_width: float = 1.0

    def sample(self, north, east):
        """Height and slope."""
        north, _ = np.broadcast_arrays(np.asarray(north, float), east)
        away = (north - self.crest) / self.half_width
        inside = np.abs(away) < 1
        slope = np.where(inside, -np.sign(away) * self.height / self.half_width, 0.0)
        height = np.where(inside, self.height * (1 - np.abs(away)), 0.0)
        return TerrainSample(height, np.stack([slope, np.zeros_like(slope)], axis=-1))

    @property
    def span(self):
        """Foot and crest."""
        return 0.0, self.height


@dataclass(frozen=True)
class Corduroy(Relief):
    """Level crests that run to the east, one behind the other to the north: a sine."""

    wavelength: float
    height: float

    def sample(self, north, east):
        """Height and slope."""
        north, _ = np.broadcast_arrays(np.asarray(north, float), east)
        phase = 2 * np.pi * north / self.wavelength
        slope = -np.pi * self.height / self.wavelength * np.sin(phase)
        return TerrainSample(self.height / 2 * np.cos(phase), np.stack([slope, np.zeros_like(slope)], axis=-1))

    @property
    def span(self):
        """Trough and crest."""
        return -self.height / 2, self.height / 2


def bed_of(*parts, split=0.5, lattice=None):
    """A bed at 20 m of given reliefs."""
    return SeabedTerrain(
        DEPTH, CompositeRelief(ReliefSum(parts, lattice or ScattererGrid()), (), RoughnessCutoff(wavelength=split))
    )


def seen_from(bed, place=(0.0, 0.0, SONAR), farthest=200.0, min_profile_width=1e-3):
    """Terrain occlusion of straight rays at 100 kHz."""
    launches = StraightLaunchAngles(place[2], DEPTH)
    return TerrainOcclusion(
        bed, np.array(place), launches, farthest=farthest, wavelength=0.015, min_profile_width=min_profile_width
    )
