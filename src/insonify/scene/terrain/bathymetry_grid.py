"""Relief of the seabed from a grid of surveyed depths in a file.

Between its nodes the terrain is smooth; in gaps of the survey and beyond its edges it is unknown (NaN) and neither
scatters nor casts a shadow. A grid has no waves shorter than two of its cells: add a power law whose outer scale is
about that length for a realistic seabed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from insonify.caller_warning import warn_caller
from insonify.data_file import DataFile, Fingerprint, require_unchanged
from insonify.model import Metres, Model, Radians, field_error
from insonify.scene.terrain import _hermite_kernel as kernel
from insonify.scene.terrain.bathymetry_file import (
    ElevationGrid,
    geodetic_position,
    metres_per_degree,
    projected_position,
    read_grid,
)
from insonify.scene.terrain.bathymetry_file_checks import GridError
from insonify.scene.terrain.relief import Relief, TerrainSample, broadcast_positions
from insonify.scene.terrain.roughness_cutoff import RoughnessCutoff
from insonify.validity import PhysicsWarning

Singles = NDArray[np.float32]
Latitude = Annotated[Radians, Field(ge=-np.pi / 2, le=np.pi / 2)]
Longitude = Annotated[Radians, Field(ge=-np.pi, le=2 * np.pi)]
Coordinate = Annotated[Metres, Field(ge=-1e8, le=1e8)]


class BathymetryGrid(Model):
    """Bathymetry from a file: GeoTIFF, BAG, netCDF or numpy.

    Example:
        >>> north, east = np.arange(0.0, 50.0), np.arange(0.0, 100.0)
        >>> np.savez("survey.npz", depth=20.0 + 0.02 * north[:, None] + 0.0 * east, north=north, east=east)
        >>> np.round(BathymetryGrid(file="survey.npz").depths, 2).tolist()  # shallowest, mean, deepest [m]
        [20.0, 20.49, 20.98]
    """

    kind: Literal["grid"] = "grid"
    file: DataFile
    """Path of the file; beside the scenario file, unless it starts from the root."""
    variable: str | None = None
    """Name of the variable in a netCDF or numpy file; None: found by its name."""
    positive: Literal["up", "down"] | None = None
    """Direction in which its values grow; None: from the file, or from their sign."""
    origin: tuple[Coordinate, Coordinate] | None = None
    """Northing and easting, in the file's coordinates, of the scene's north 0 and east 0 [m]; or give a latitude."""
    latitude: Latitude | None = None
    """Latitude of the scene's north 0, east 0, given with a longitude [rad]; None: the middle of the surveyed area."""
    longitude: Longitude | None = None
    """Longitude of the scene's north 0, east 0, east positive, given with a latitude [rad]."""
    tide: Annotated[Metres, Field(ge=-20, le=20)] = 0.0
    """Height of the sea above the vertical datum of the file, added to all depths [m]."""
    sha256: Fingerprint = None
    """SHA-256 digest of the file, filled in when it is read; a file that has changed since is an error."""

    @model_validator(mode="after")
    def _check_file(self) -> Self:
        require_unchanged(self.file, self.sha256)
        if (self.latitude is None) != (self.longitude is None):
            missing = "latitude" if self.latitude is None else "longitude"
            raise field_error(missing, None, "Give latitude and longitude together, or neither.")
        if self.origin is not None and self.latitude is not None:
            raise field_error("origin", None, "The scene has one origin: give origin, or latitude and longitude.")
        try:
            placed_grid(self)
        except GridError as fault:
            raise field_error(fault.field, None, str(fault)) from None
        return self

    @property
    def cell(self) -> float:
        """Side of its cells [m], the longer one where they are not squares."""
        return max(placed_grid(self).step)

    @property
    def depths(self) -> tuple[float, float, float]:
        """Shallowest, mean and deepest sounding [m]."""
        heights = placed_grid(self).height
        return tuple(-float(f(heights)) for f in (np.nanmax, np.nanmean, np.nanmin))  # type: ignore[return-value]

    @property
    def measured_fraction(self) -> float:
        """Fraction of its cells that have a measured depth [1]."""
        return float(np.isfinite(placed_grid(self).height).mean())

    @property
    def description(self) -> str:
        """Size, cell, sign and coverage of the grid in one line."""
        grid = placed_grid(self)
        rows, columns = grid.height.shape
        return (
            f"{columns} x {rows} cells of {grid.step[1]:.4g} x {grid.step[0]:.4g} m, {grid.description}, "
            f"{100 * self.measured_fraction:.0f} % filled"
        )

    def build_relief(self, *, cutoff: RoughnessCutoff, mean_depth: float) -> GridRelief:
        """The grid as relief about a mean plane.

        Args:
            cutoff: Cutoff wavelength of the terrain; cells finer than half of it are averaged in blocks.
            mean_depth: Depth from which heights are counted [m].
        """
        grid = placed_grid(self)
        block = [max(1, int(cutoff.wavelength / 2 / step)) for step in grid.step]
        return GridRelief.of(grid.averaged(*block), mean_depth)


@dataclass(frozen=True, slots=True, eq=False)
class PlacedGrid:
    """Grid of elevations in the scene's frame: metres to the north and the east of its origin."""

    height: Singles
    """Elevation of the nodes above the sea, NaN in holes [m], shape (n, m)."""
    corner: tuple[float, float]
    """North and east of the first node [m]."""
    step: tuple[float, float]
    """Spacing of rows and of columns [m]."""
    description: str
    """Description of its sign and range."""

    def averaged(self, rows: int, columns: int) -> PlacedGrid:
        """Grid of the means of blocks of `rows` x `columns` nodes; NaN where fewer than half of a block are known."""
        if rows == columns == 1:
            return self
        n, m = self.height.shape[0] // rows, self.height.shape[1] // columns
        squares = self.height[: n * rows, : m * columns].reshape(n, rows, m, columns).astype(float)
        known = np.isfinite(squares).sum(axis=(1, 3))
        total = np.nansum(squares, axis=(1, 3))
        with np.errstate(invalid="ignore"):
            mean = np.where(2 * known >= rows * columns, total / known, np.nan)
        shift = [(count - 1) / 2 * step for count, step in zip((rows, columns), self.step, strict=True)]
        corner = (self.corner[0] + shift[0], self.corner[1] + shift[1])
        return PlacedGrid(
            mean.astype(np.float32), corner, (self.step[0] * rows, self.step[1] * columns), self.description
        )


@lru_cache(maxsize=4)
def placed_grid(grid: BathymetryGrid) -> PlacedGrid:
    """Elevations of a bathymetry file in the scene's frame.

    Raises:
        GridError: The file is no such grid, or has no position.
    """
    surveyed = read_grid(grid.file, variable=grid.variable, positive=grid.positive)
    corner, step = _placed(grid, surveyed)
    return PlacedGrid(surveyed.elevation - np.float32(grid.tide), corner, step, surveyed.description)


def _placed(grid: BathymetryGrid, surveyed: ElevationGrid) -> tuple[tuple[float, float], tuple[float, float]]:
    """North and east of the first node, and spacing of rows and columns, in the scene's frame [m]."""
    metres = (1.0, 1.0)
    if surveyed.geographic:
        if grid.origin is not None:
            raise GridError(f"{grid.file}: its coordinates are degrees. Give latitude and longitude instead.", "origin")
        middle = surveyed.north + surveyed.north_step * (surveyed.elevation.shape[0] - 1) / 2
        metres = metres_per_degree(middle if grid.latitude is None else float(np.degrees(grid.latitude)))
    origin = _origin(grid, surveyed)
    corner = ((surveyed.north - origin[0]) * metres[0], (surveyed.east - origin[1]) * metres[1])
    step = (surveyed.north_step * metres[0], surveyed.east_step * metres[1])
    size = [(count - 1) * side for count, side in zip(surveyed.elevation.shape, step, strict=True)]
    if any(-1000 - length > start or start > 1000 for start, length in zip(corner, size, strict=True)):
        north, east = (f"{-start:.0f} m" for start in corner)
        raise GridError(
            f"{grid.file}: the scene's origin lies {north} north and {east} east of the grid's first cell, more than "
            f"1 km outside of it. Its coordinates start at north {surveyed.north:.8g}, east {surveyed.east:.8g}.",
            "latitude" if grid.latitude is not None else "origin",
        )
    return corner, step


def _origin(grid: BathymetryGrid, surveyed: ElevationGrid) -> tuple[float, float]:
    """The scene's north 0, east 0 in the file's own coordinates [m], or latitude and longitude [deg]."""
    if grid.origin is not None:
        return grid.origin
    if grid.latitude is None or grid.longitude is None:
        return _middle(surveyed)
    latitude, longitude = (float(np.degrees(angle)) for angle in (grid.latitude, grid.longitude))
    return (latitude, longitude) if surveyed.geographic else projected_position(latitude, longitude, surveyed)


def grid_origin(grid: BathymetryGrid) -> dict[str, str | float]:
    """Position of a scene on Earth, as far as its grid states it.

    Args:
        grid: The grid.

    Returns:
        `crs` (coordinate system of the file), `origin_northing` and `origin_easting` (the scene's north 0, east 0 in
        it [m]), `origin_latitude` and `origin_longitude` [deg]; those that are known.
    """
    surveyed = read_grid(grid.file, variable=grid.variable, positive=grid.positive)
    north, east = _origin(grid, surveyed)
    known: dict[str, str | float] = {"crs": surveyed.crs} if surveyed.crs else {}
    if surveyed.geographic:
        return known | {"origin_latitude": float(north), "origin_longitude": float(east)}
    known |= {"origin_northing": float(north), "origin_easting": float(east)}
    if surveyed.crs:
        latitude, longitude = geodetic_position(float(north), float(east), surveyed.crs)
        known |= {"origin_latitude": latitude, "origin_longitude": longitude}
    return known


def _middle(surveyed: ElevationGrid) -> tuple[float, float]:
    """The known node nearest to the mean of all known nodes, in the file's coordinates."""
    rows, columns = np.nonzero(np.isfinite(surveyed.elevation))
    nearest = np.argmin((rows - rows.mean()) ** 2 + (columns - columns.mean()) ** 2)
    return surveyed.north + rows[nearest] * surveyed.north_step, surveyed.east + columns[nearest] * surveyed.east_step


@dataclass(frozen=True, slots=True, eq=False)
class GridRelief(Relief):
    """Relief interpolated from a grid by cubics between its nodes, with a continuous gradient."""

    nodes: Singles
    """Heights of the nodes above the mean plane [m], shape (n, m)."""
    slopes: tuple[Singles, Singles]
    """Change of height per row and per column at the nodes [m], shape (n, m)."""
    corner: tuple[float, float]
    """North and east of the first node [m]."""
    step: tuple[float, float]
    """Spacing of rows and of columns [m]."""

    @classmethod
    def of(cls, grid: PlacedGrid, mean_depth: float) -> Self:
        """Relief of a grid about the mean plane at a depth [m]."""
        height = grid.height + np.float32(mean_depth)
        slopes = np.empty_like(height), np.empty_like(height)
        kernel.node_slopes(height, *slopes)
        return cls(height, slopes, grid.corner, grid.step)

    def __repr__(self) -> str:
        rows, columns = self.nodes.shape
        return f"GridRelief: {columns} x {rows} cells of {self.step[1]:.4g} x {self.step[0]:.4g} m"

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest node with the largest overshoot of the cubics [m], see `Relief.span`."""
        steepest = max(float(np.nanmax(np.abs(slope))) for slope in self.slopes)
        return float(np.nanmin(self.nodes)) - 0.3 * steepest, float(np.nanmax(self.nodes)) + 0.3 * steepest

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient, NaN where the terrain is unknown, see `Relief.sample`."""
        n, e = broadcast_positions(north, east)
        row = np.ascontiguousarray((n.ravel() - self.corner[0]) / self.step[0])
        column = np.ascontiguousarray((e.ravel() - self.corner[1]) / self.step[1])
        out = np.empty((row.size, 3))
        kernel.hermite(self.nodes, *self.slopes, row, column, out)
        slope = out[:, 1:] / np.array(self.step)
        return TerrainSample(out[:, 0].reshape(n.shape), slope.reshape(*n.shape, 2))


def warn_of_overlap(cell: float, outer_scale: float) -> None:
    """Warn where a power law repeats waves that a grid already has.

    Args:
        cell: Side of a cell of the grid [m].
        outer_scale: Outer scale of the power law [m].
    """
    if outer_scale > 4 * cell:
        warn_caller(
            f"seabed.relief: a power law with an outer scale of {outer_scale:g} m has waves that the grid's cells of "
            f"{cell:.3g} m already resolve; they count twice. Give an outer scale of about {2 * cell:.3g} m.",
            PhysicsWarning,
        )  # fmt: skip
