"""Position on Earth of a scene's north and east: geodetic coordinates, coordinate system, grid convergence."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.navigation_file import geodetic_position_of_plane, local_plane_position

Floats = NDArray[np.float64]

NO_EARTH = 'LOCAL_CS["north and east of a simulated scene",UNIT["metre",1],AXIS["Easting",EAST],AXIS["Northing",NORTH]]'
"""Coordinate system of a scene that is nowhere on Earth."""


@dataclass(frozen=True, slots=True)
class EarthFrame:
    """Position of north 0, east 0 on Earth, as far as a recording states it."""

    origin: tuple[float, float] | None
    """Latitude and longitude of north 0, east 0 [deg]; None: nowhere."""
    crs: str = ""
    """Projected coordinate system whose north and east are those of the scene; empty: none."""
    offset: tuple[float, float] = (0.0, 0.0)
    """Northing and easting of north 0, east 0 in `crs` [m]."""

    @classmethod
    def of(cls, attributes: Mapping[str, Any]) -> Self:
        """Frame of a recording.

        Args:
            attributes: Attributes of the recording, as from `insonify.scenario.georeference.georeference`.
        """
        origin = None
        if "origin_latitude" in attributes:
            origin = float(attributes["origin_latitude"]), float(attributes["origin_longitude"])
        if "origin_northing" not in attributes or "crs" not in attributes:
            return cls(origin)
        offset = float(attributes["origin_northing"]), float(attributes["origin_easting"])
        return cls(origin, str(attributes["crs"]), offset)

    @property
    def raster_crs(self) -> str:
        """Coordinate system of easting and northing: of the surveyed grid, a Mercator plane at the origin, or none."""
        if self.crs:
            return self.crs
        if self.origin is None:
            return NO_EARTH
        latitude, longitude = self.origin
        return f"+proj=tmerc +lat_0={latitude:.12f} +lon_0={longitude:.12f} +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m"

    def geodetic(self, north: Floats, east: Floats) -> tuple[Floats, Floats]:
        """Latitude and longitude of positions [deg, WGS 84]; from 0, 0 where the scene is nowhere on Earth.

        Args:
            north: North in the scene [m], shape (n,).
            east: East in the scene [m], shape (n,).
        """
        if not self.crs:
            return geodetic_position_of_plane(north, east, self.origin or (0.0, 0.0))
        from rasterio.warp import transform

        eastings, northings = np.asarray(east) + self.offset[1], np.asarray(north) + self.offset[0]
        longitude, latitude = transform(self.crs, "EPSG:4326", eastings.tolist(), northings.tolist())
        return np.asarray(latitude, float), np.asarray(longitude, float)

    def convergence(self, north: Floats, east: Floats) -> Floats:
        """True bearing of the scene's north, clockwise [rad], shape (n,): headings on Earth are larger by it."""
        if not self.crs:
            return np.zeros(np.shape(north))
        latitude, longitude = self.geodetic(north, east)
        ahead = np.stack(self.geodetic(np.asarray(north) + 100.0, east), axis=-1)
        steps = [
            local_plane_position(to[:1], to[1:], (float(lat), float(lon)))[0]
            for to, lat, lon in zip(ahead, latitude, longitude, strict=True)
        ]
        return np.arctan2(*np.asarray(steps).T[::-1])
