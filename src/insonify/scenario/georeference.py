"""Position of a scene on Earth, from its surveyed grid and its navigation log, for recordings to keep."""

from __future__ import annotations

from typing import TYPE_CHECKING

from insonify.scene.terrain.bathymetry_grid import BathymetryGrid, grid_origin
from insonify.sonar.track.navigation import NavigationTrack

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

Known = dict[str, str | float]


def georeference(scenario: Scenario) -> Known:
    """Attributes that georeference a scene's north and east coordinates.

    Returns:
        `origin_latitude` and `origin_longitude` of north 0, east 0 [deg, WGS 84]; where the scene has a surveyed grid
        with coordinates in metres also `origin_northing` and `origin_easting` [m] and their `crs`. Empty where nothing
        is known. A bathymetry grid takes precedence over a navigation log.
    """
    grids = [relief for relief in scenario.seabed.relief if isinstance(relief, BathymetryGrid)]
    known: Known = dict(grid_origin(grids[0])) if grids else {}
    if "origin_latitude" not in known and isinstance(scenario.track, NavigationTrack):
        origin = scenario.track.log().origin
        if origin is not None:
            known |= {"origin_latitude": float(origin[0]), "origin_longitude": float(origin[1])}
    return known
