"""Bathymetry grids of surveys: GeoTIFF and BAG through rasterio, netCDF, and numpy files.

Grids are converted on reading: elevations in metres, positive up, rows to the north, columns to the east, NaN in gaps.
Ambiguous files are refused with the name of the key that resolves the ambiguity.
"""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from insonify.data_file import install_advice, require_readable_hdf5
from insonify.scene.terrain.bathymetry_file_checks import GridError as GridError
from insonify.scene.terrain.bathymetry_file_checks import array_shape, library_errors_as_grid_errors, require_grid_size

Singles = NDArray[np.float32]
Floats = NDArray[np.float64]
Positive = Literal["up", "down"]
_GridContent = tuple[dict[str, Any], Positive | None, Floats]

RASTERS = (".tif", ".tiff", ".bag")
"""Suffixes of files that rasterio reads."""
NETCDF = (".nc", ".nc4", ".grd")
"""Suffixes of netCDF files."""
METRES = {"": 1.0, "m": 1.0, "metre": 1.0, "metres": 1.0, "meter": 1.0, "meters": 1.0, "cm": 0.01, "mm": 0.001,
          "km": 1000.0, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048}  # fmt: skip
"""Length of one unit of a file [m]."""
DEEPEST = 12_000.0
"""Largest depth that is accepted [m]."""
_UP = ("elevation", "topo", "topography", "height", "altitude", "bathymetry_elevation")
_DOWN = ("depth", "deptho", "water_depth", "bathymetric_depth")
_NORTH, _EAST = ("north", "northing", "y", "lat", "latitude"), ("east", "easting", "x", "lon", "longitude")
_MAJOR, _FLATTENING = 6378137.0, 1 / 298.257223563  # of the ellipsoid WGS 84


@dataclass(frozen=True, slots=True, eq=False)
class ElevationGrid:
    """Elevations on a regular grid, rows to the north and columns to the east."""

    elevation: Singles
    """Elevation, positive up [m], shape (rows to the north, columns to the east); NaN in gaps."""
    north: float
    """Coordinate of the first row, in the file's own system [m], or latitude [deg]."""
    east: float
    """Coordinate of the first column [m], or longitude [deg]."""
    north_step: float
    """Step from row to row [m], or [deg]."""
    east_step: float
    """Step from column to column [m], or [deg]."""
    geographic: bool
    """True: the coordinates are latitude and longitude."""
    crs: str
    """Coordinate system as well-known text; empty if the file has none."""
    description: str
    """Direction of the values, how it is known, and their range, in words."""


def read_grid(path: str, *, variable: str | None = None, positive: Positive | None = None) -> ElevationGrid:
    """The bathymetry in a file.

    Args:
        path: GeoTIFF (.tif), BAG (.bag), netCDF (.nc) or numpy (.npz) file.
        variable: Name of the variable that holds it, for netCDF and numpy; None: found by its name.
        positive: Direction in which its values grow; None: from the file, or from the sign of all values.

    Raises:
        GridError: The file does not exist, has no such grid, or is ambiguous.
    """
    location = Path(path)
    if not location.is_file():
        raise GridError(f"{path}: there is no such file. Give its path, relative to the scenario file.")
    return _read(path, location.stat().st_mtime_ns, variable, positive)


@lru_cache(maxsize=4)
def _read(path: str, stamp: int, variable: str | None, positive: Positive | None) -> ElevationGrid:
    """`read_grid` of a file whose time of last change is `stamp` [ns], so that a changed file is read again."""
    suffix = Path(path).suffix.lower()
    if suffix in (".bag", *NETCDF):
        try:
            require_readable_hdf5(path)
        except ValueError as fault:
            raise GridError(str(fault)) from None
    kinds = {**dict.fromkeys(RASTERS, _raster), **dict.fromkeys(NETCDF, _netcdf), ".npz": _numpy}
    if suffix not in kinds:
        raise GridError(f"{path}: {suffix or 'a file without a suffix'} is no grid that is read here. "
                        f"Give one of {', '.join(kinds)}.")  # fmt: skip
    with library_errors_as_grid_errors(path):
        position, stated_direction, values = kinds[suffix](path, variable)
    values = np.where(np.isfinite(values), values, np.nan)  # an infinite depth is a gap
    sense, source = _positive_direction(path, values, stated_direction, positive)
    elevation = values if sense == "up" else -values
    _refuse_wrong_units(path, elevation)
    return ElevationGrid(elevation.astype(np.float32), **position, description=source)


def _positive_direction(
    path: str, values: NDArray[np.floating], stated_direction: Positive | None, requested: Positive | None
) -> tuple[str, str]:
    """Direction in which values grow, "up" or "down", and its reason with the range of values, in words."""
    known = values[np.isfinite(values)]
    if not known.size:
        raise GridError(f"{path}: no cell holds a number. Is it the right band or variable?")
    low, high = float(known.min()), float(known.max())
    span = f"{low:.6g} to {high:.6g} m"
    sense = requested or stated_direction
    if sense is not None:
        if (high if sense == "down" else -low) <= 0:
            name, other = ("depths, positive down", "up") if sense == "down" else ("elevations, positive up", "down")
            raise GridError(
                f"{path}: read as {name}, its values of {span} are all above the sea. Write positive: {other}.",
                "positive",
            )
        return sense, f"{'elevations, positive up' if sense == 'up' else 'depths, positive down'}, {span}"
    if low < 0 < high:
        raise GridError(
            f"{path}: values of {span} may be elevations with land, or depths with land. Write positive: up for "
            "elevations, positive: down for depths.", "positive",
        )  # fmt: skip
    return ("up", f"elevations by their sign, {span}") if low < 0 else ("down", f"depths by their sign, {span}")


def _refuse_wrong_units(path: str, elevation: NDArray[np.floating]) -> None:
    """Refuse elevations below the deepest sea."""
    deepest = -float(np.nanmin(elevation))
    if deepest > DEEPEST:
        raise GridError(
            f"{path}: {deepest:.6g} m is deeper than any sea ({DEEPEST:g} m). Are its values millimetres or "
            "centimetres? Convert the file to metres."
        )


def _scale(path: str, units: str | None) -> float:
    """Length of one unit of the values [m]."""
    name = (units or "").strip().lower()
    if name not in METRES:
        raise GridError(f"{path}: its values are in {units!r}, which is no length known here. Convert them to metres.")
    return METRES[name]


def _raster(path: str, variable: str | None) -> _GridContent:
    """A GeoTIFF or BAG file: band 1."""
    try:
        import rasterio
    except ImportError:
        raise GridError(f"{path}: reading it takes rasterio. Install it: {install_advice('io')}") from None
    kind = "BAG" if path.lower().endswith(".bag") else "GTiff"  # no other format under this suffix
    with rasterio.open(path, driver=kind) as file:
        if not file.count:
            raise GridError(f"{path}: it holds no band.")
        require_grid_size(path, (file.height, file.width), file.block_shapes[0], file.dtypes[0])
        band, transform, crs, units = file.read(1, masked=True), file.transform, file.crs, file.units[0]
        is_bag = file.driver == "BAG"
    if transform.b or transform.d:
        raise GridError(f"{path}: its rows do not run from west to east. Turn it north up: gdalwarp IN OUT")
    geographic = bool(crs and crs.is_geographic)
    if crs and not geographic and crs.linear_units_factor[1] != 1.0:
        raise GridError(
            f"{path}: its coordinates are in {crs.linear_units}. Project it to metres, such as UTM: "
            "gdalwarp -t_srs EPSG:326xx IN OUT"
        )
    if not crs and abs(transform.a) < 0.005:
        raise GridError(
            f"{path}: cells of {abs(transform.a):g} and no coordinate system: probably degrees. State it in the file: "
            "gdal_edit.py -a_srs EPSG:4326 FILE"
        )
    values = band.astype(float).filled(np.nan) * _scale(path, units)
    rows, columns = np.arange(values.shape[0]) + 0.5, np.arange(values.shape[1]) + 0.5  # rasters give corners
    axes = {"north": transform.f + rows * transform.e, "east": transform.c + columns * transform.a}
    frame, values = _north_up(path, values, axes)
    return frame | {"geographic": geographic, "crs": crs.to_wkt() if crs else ""}, "up" if is_bag else None, values


def _north_up(path: str, values: Floats, axes: dict[str, Floats]) -> tuple[dict[str, Any], Floats]:
    """Values with rows to the north and columns to the east, and the position of the grid.

    Args:
        path: The file, for messages.
        values: Values of the grid, rows and columns in any direction.
        axes: Coordinates of the rows, then of the columns, by the names of the two dimensions [m or deg].

    Returns:
        Fields `north`, `east`, `north_step`, `east_step` of `ElevationGrid`, and the values.
    """
    names = [name.lower() for name in axes]
    if names[0] in _EAST and names[1] in _NORTH:
        values, axes = values.T, dict(reversed(axes.items()))
    elif not (names[0] in _NORTH and names[1] in _EAST):
        raise GridError(f"{path}: dimensions {', '.join(axes)} are no directions known here. Name them north and east.")
    position: dict[str, Any] = {}
    for axis, (direction, (name, points)) in enumerate(zip(("north", "east"), axes.items(), strict=True)):
        if points.ndim != 1 or len(points) != values.shape[axis] or len(points) < 2:
            raise GridError(
                f"{path}: {name} has {points.size} values for {values.shape[axis]} cells. Give one for each, two or "
                "more."
            )
        steps = np.diff(points)
        step = (points[-1] - points[0]) / (len(points) - 1)
        if step == 0 or np.max(np.abs(steps - step)) > 0.01 * abs(step):
            raise GridError(f"{path}: {name} is not evenly spaced. Resample it to a regular grid.")
        if step < 0:
            values, points = np.flip(values, axis), points[::-1]
        position |= {direction: float(points[0]), f"{direction}_step": abs(float(step))}
    return position, values


def _netcdf(path: str, variable: str | None) -> _GridContent:
    """A netCDF file: a variable of two dimensions, each with its coordinate."""
    try:
        import netCDF4
    except ImportError:
        raise GridError(f"{path}: reading it takes netCDF4. Install it: {install_advice('io')}") from None
    with netCDF4.Dataset(path) as file:
        grids = {name: stored for name, stored in file.variables.items() if stored.ndim == 2}
        name = _bathymetry_variable(path, list(grids), variable)
        grid = grids[name]
        chunks = grid.chunking()
        require_grid_size(path, grid.shape, chunks if isinstance(chunks, list) else (), grid.dtype)
        for axis in grid.dimensions:
            if axis not in file.variables:
                raise GridError(
                    f"{path}: {name} has no coordinate for dimension {axis}. Add a variable {axis}({axis})."
                )
        for axis in grid.dimensions:
            stored = file.variables[axis]
            chunks = stored.chunking()
            require_grid_size(path, stored.shape, chunks if isinstance(chunks, list) else (), stored.dtype)
        axes = {axis: np.asarray(file.variables[axis][:], float) for axis in grid.dimensions}
        geographic = any("degree" in str(getattr(file.variables[axis], "units", "")) for axis in axes)
        values = np.ma.filled(np.ma.masked_invalid(grid[:]).astype(float), np.nan)
        values = values * _scale(path, getattr(grid, "units", None))
        stated_direction = str(getattr(grid, "positive", "")).lower()
        mapping = file.variables.get(str(getattr(grid, "grid_mapping", "")))
        # CF conventions 5.6, and the older name that GDAL writes
        wkt = str(getattr(mapping, "crs_wkt", getattr(mapping, "spatial_ref", "")))
        for axis in () if geographic else axes:
            axes[axis] = axes[axis] * _scale(path, getattr(file.variables[axis], "units", None))
    position, values = _north_up(path, values, axes)
    stated: dict[str, Positive] = {"up": "up", "down": "down"}
    crs = "EPSG:4326" if geographic else wkt
    direction = stated.get(stated_direction, _positive_direction_by_name(name))
    return position | {"geographic": geographic, "crs": crs}, direction, values


def _bathymetry_variable(path: str, names: list[str], variable: str | None) -> str:
    """Name of the variable that holds the bathymetry: the given one, or the only likely one."""
    if variable is not None:
        if variable not in names:
            raise GridError(
                f"{path}: no grid is called {variable!r}; there is {', '.join(names) or 'none'}.", "variable"
            )
        return variable
    likely = [name for name in names if name.lower() in (*_UP, *_DOWN, "z")]
    if len(likely) == 1 or len(names) == 1:
        return (likely or names)[0]
    raise GridError(
        f"{path}: which of {', '.join(names) or 'no grid at all'} is the bathymetry? Write variable: NAME", "variable"
    )


def _positive_direction_by_name(name: str) -> Positive | None:
    """Direction in which values of a variable grow, by its name; None: unknown."""
    lower = name.lower()
    return "up" if lower in _UP else "down" if lower in _DOWN else None


def _numpy(path: str, variable: str | None) -> _GridContent:
    """A numpy file: a grid, and its two coordinates in metres."""
    with zipfile.ZipFile(path) as file:
        shapes = {
            name.removesuffix(".npy"): array_shape(file, name, path)
            for name in file.namelist()
            if name.endswith(".npy")
        }
        name = _bathymetry_variable(path, [name for name, shape in shapes.items() if len(shape) == 2], variable)
        keys = {"depth": name}
        for words, shown in ((_NORTH, "north"), (_EAST, "east")):
            key = next((word for word in words if word in shapes), None)
            if key is None:
                raise GridError(
                    f"{path}: no array {shown}. Save the coordinates of rows and columns as north and east [m]."
                )
            keys[shown] = key
    with np.load(path, allow_pickle=False) as arrays:
        grid = {shown: np.asarray(arrays[key], float) for shown, key in keys.items()}
    position, values = _north_up(path, grid.pop("depth"), grid)
    return position | {"geographic": False, "crs": ""}, _positive_direction_by_name(name), values


def projected_position(latitude: float, longitude: float, grid: ElevationGrid) -> tuple[float, float]:
    """Northing and easting in the coordinate system of a grid [m] of a geodetic position [deg, WGS 84].

    Raises:
        GridError: The grid has no coordinate system.
    """
    if not grid.crs:
        raise GridError("the file names no coordinate system, so it has no latitudes and longitudes. "
                        "Give origin: [north, east] in the file's coordinates.", "latitude")  # fmt: skip
    from rasterio.warp import transform

    with library_errors_as_grid_errors("its coordinate system"):
        east, north = transform("EPSG:4326", grid.crs, [longitude], [latitude])
    return float(north[0]), float(east[0])


def geodetic_position(north: float, east: float, crs: str) -> tuple[float, float]:
    """Latitude and longitude of a position in a coordinate system [deg, WGS 84].

    Args:
        north: Northing [m].
        east: Easting [m].
        crs: The coordinate system as well-known text or EPSG code.
    """
    from rasterio.warp import transform

    longitude, latitude = transform(crs, "EPSG:4326", [east], [north])
    return float(latitude[0]), float(longitude[0])


def metres_per_degree(latitude: float) -> tuple[float, float]:
    """Length of a degree of latitude and of longitude [m] at a latitude [deg] of the ellipsoid WGS 84.

    Source: radii of curvature of the meridian and of the prime vertical, e.g. Torge (2001), Geodesy, section 4.1.
    """
    sine = np.sin(np.radians(latitude))
    eccentricity_squared = _FLATTENING * (2 - _FLATTENING)
    curvature_factor = 1 - eccentricity_squared * sine**2
    meridian, vertical = _MAJOR * (1 - eccentricity_squared) / curvature_factor**1.5, _MAJOR / np.sqrt(curvature_factor)
    return float(np.radians(meridian)), float(np.radians(vertical * np.cos(np.radians(latitude))))
