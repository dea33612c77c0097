"""Rasters over easting and northing, written as GeoTIFF."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from insonify.formats.store_description import StoreError
from insonify.surveys.survey import Survey

Floats = NDArray[np.float64]

MOST_CELLS = 1 << 25
"""Most cells of a raster in memory: 400 MB with its sums [1]."""


@dataclass(frozen=True, slots=True)
class Raster:
    """Square cells of a raster with north up; cells count from the north-western corner."""

    north: float
    """North of the upper edge, in the scene [m]."""
    east: float
    """East of the left edge, in the scene [m]."""
    pixel: float
    """Size of the cells [m]."""
    shape: tuple[int, int]
    """Number of rows and columns."""

    @classmethod
    def around(cls, survey: Survey, north: Floats, east: Floats, pixel: float) -> Self:
        """Raster that holds positions; its edges are multiples of the cell size in the scene.

        Args:
            survey: The survey, for the message.
            north: North of the positions [m].
            east: East of the positions [m].
            pixel: Size of the cells [m].

        Raises:
            StoreError: It would have too many cells.
        """
        low, high = (np.floor(np.array([f(north), f(east)]) / pixel) for f in (np.nanmin, np.nanmax))
        rows, columns = (high - low + 1).astype(int).tolist()
        if rows * columns > MOST_CELLS:
            raise StoreError(f"{survey.name}: a raster of {rows} x {columns} cells of {pixel:g} m is too large. Export "
                             "fewer pings")  # fmt: skip
        return cls(float((high[0] + 1) * pixel), float(low[1] * pixel), pixel, (rows, columns))

    def cells(self, north: Floats, east: Floats) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Index of the cells of positions in the flattened raster, and mask of those inside."""
        row, column = np.floor((self.north - north) / self.pixel), np.floor((east - self.east) / self.pixel)
        inside = (row >= 0) & (row < self.shape[0]) & (column >= 0) & (column < self.shape[1])
        flat = np.where(inside, row * self.shape[1] + column, 0).astype(np.int64)
        return flat, inside

    @property
    def centres(self) -> tuple[Floats, Floats]:
        """North of the rows, shape (rows,), and east of the columns [m], shape (columns,)."""
        rows, columns = (np.arange(count, dtype=float) + 0.5 for count in self.shape)
        return self.north - rows * self.pixel, self.east + columns * self.pixel

    def used(self, mask: NDArray[np.bool_]) -> tuple[Self, tuple[slice, slice]]:
        """The part of the raster with cells in a mask of its shape, and its rows and columns."""
        spans = []
        for axis in (1, 0):
            indices = np.flatnonzero(mask.any(axis=axis))
            spans.append(slice(int(indices[0]), int(indices[-1]) + 1) if indices.size else slice(0, 1))
        rows, columns = spans
        shape = rows.stop - rows.start, columns.stop - columns.start
        corner = self.north - rows.start * self.pixel, self.east + columns.start * self.pixel
        return type(self)(*corner, self.pixel, shape), (rows, columns)


def round_pixel(size: float) -> float:
    """Least of 1, 2 or 5 times a power of ten that is no less than a size [m]."""
    power = 10.0 ** np.floor(np.log10(size))
    return float(next(step for step in (power, 2 * power, 5 * power, 10 * power) if step >= size * (1 - 1e-9)))


def write_raster(
    survey: Survey, path: Path, raster: Raster, bands: Mapping[str, NDArray[Any]], units: Sequence[str] = ()
) -> None:
    """Write bands as GeoTIFF in the coordinate system of a survey; floats have NaN where there is nothing, codes 255.

    Args:
        survey: The survey.
        path: File to write.
        raster: Cells of the bands.
        bands: Bands by their description, of one type, shape (rows, columns).
        units: Unit of each band.
    """
    easting, northing = raster.east + survey.frame.offset[1], raster.north + survey.frame.offset[0]
    transform = (raster.pixel, 0.0, easting, 0.0, -raster.pixel, northing)
    write_bands(path, (survey.frame.raster_crs, transform), bands, units, survey.tags)


@contextmanager
def geotiff(path: Path, about: Mapping[str, Any]) -> Iterator[Any]:
    """GeoTIFF that is made in memory and written as a whole: GDAL itself reports no disk that is full.

    Args:
        path: File to write.
        about: Arguments of `rasterio.open`.

    Yields:
        Open dataset.
    """
    from rasterio.io import MemoryFile

    with MemoryFile() as memory:
        with memory.open(**about) as file:
            yield file
        path.write_bytes(memory.getbuffer())


def write_bands(
    path: Path, georeference: tuple[str, tuple[float, ...]] | None, bands: Mapping[str, NDArray[Any]],
    units: Sequence[str] = (), tags: Mapping[str, str] | None = None,
) -> None:  # fmt: skip
    """Write bands with a coordinate system and the six numbers of an affine transform, as `write_raster`.

    Args:
        path: File to write.
        georeference: Coordinate system and transform; None: cells that are nowhere on Earth.
        bands: Bands by their description, of one type, shape (rows, columns).
        units: Unit of each band.
        tags: Tags of the file.
    """
    import rasterio

    first = next(iter(bands.values()))
    about = {
        "driver": "GTiff", "count": len(bands), "height": first.shape[0], "width": first.shape[1], "dtype": first.dtype,
        "nodata": 255 if first.dtype == np.uint8 else np.nan if first.dtype.kind == "f" else None,
        "compress": "deflate", "tiled": first.size > 1 << 16,
    }  # fmt: skip
    if georeference is not None:
        about |= {"crs": rasterio.crs.CRS.from_string(georeference[0]), "transform": rasterio.Affine(*georeference[1])}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        with geotiff(path, about) as file:
            for number, (name, values) in enumerate(bands.items(), start=1):
                file.write(values, number)
                file.set_band_description(number, name)
                if number <= len(units):
                    file.set_band_unit(number, units[number - 1])
            file.update_tags(**tags or {})
