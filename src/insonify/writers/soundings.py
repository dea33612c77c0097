"""Soundings of a survey, ping by ping: rows of a table (CSV), points (GeoJSON), or the mean of cells (GeoTIFF)."""

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.demos.products import product_kind
from insonify.demos.products.forward_looking import compressed
from insonify.demos.products.interferometric import COHERENT, FLAT, STEEP, pairs
from insonify.demos.products.multibeam import BEAMS, WIDEST
from insonify.formats.store_description import StoreError
from insonify.processing import interferometric_bathymetry, multibeam_soundings
from insonify.surveys.raster import Raster, round_pixel, write_raster
from insonify.surveys.survey import Survey

Floats = NDArray[np.float64]

COLUMNS = ("ping", "beam", "time", "latitude_deg", "longitude_deg", "north_m", "east_m", "depth_m", "travel_time_s",
           "method")  # fmt: skip
"""Columns of the table: time in seconds since 1970, beam or sample, depth positive down, phase or amplitude."""
SHARE = 0.03
"""Size of a raster's cells re the height of the sonar above the bed [1]."""


def soundings(survey: Survey) -> Iterator[xr.Dataset]:
    """Soundings of each recorded ping of a multibeam or an interferometric sonar.

    Args:
        survey: Recording of elements.

    Yields:
        `north`, `east`, `depth` [m], `travel_time` [s], `by_phase` over (beam,), NaN without a sounding.

    Raises:
        StoreError: The sonar gives no soundings.
    """
    kind = product_kind(survey.scenario)
    if kind not in ("multibeam", "interferometric"):
        raise StoreError(f"{survey.name}: soundings are those of a multibeam or interferometric sonar with record: "
                         "elements, and this is none. See insonify new --template multibeam")  # fmt: skip
    speed = survey.scenario.water.sound_speed
    for number, row in enumerate(survey.rows):
        ping = compressed(survey.recording.isel(ping=[int(row)]).load(), survey.scenario)
        if kind == "multibeam":
            yield multibeam_soundings(ping, np.linspace(-WIDEST, WIDEST, BEAMS), sound_speed=speed).isel(ping=0)
        else:
            yield _interferometric(survey, ping, number)


def _interferometric(survey: Survey, ping: xr.Dataset, number: int) -> xr.Dataset:
    """Soundings of one ping of an interferometer, with a row for each sample of each side."""
    heading, position, speed = survey.attitude[number, 0], survey.position[number], survey.scenario.water.sound_speed
    sides = []
    for _, *channels in pairs(ping):
        bathymetry = interferometric_bathymetry(
            ping, survey.altitude[number], channels=(channels[0], channels[1]), sound_speed=speed
        ).isel(ping=0)
        across, depth = bathymetry["across"].values, bathymetry["depth"].values
        down = np.arctan2(depth - position[2], np.abs(across))
        sound = (bathymetry["coherence"].values >= COHERENT) & (down > FLAT) & (down < STEEP)
        sides.append(np.where(sound, [across, depth, ping["time"].values], np.nan))
    across, depth, time = np.concatenate(sides, axis=1)
    columns = {
        "north": position[0] - np.sin(heading) * across, "east": position[1] + np.cos(heading) * across, "depth": depth,
        "travel_time": time, "by_phase": np.ones(depth.size, bool),
    }  # fmt: skip
    return xr.Dataset({name: ("beam", values) for name, values in columns.items()})


def rows(survey: Survey) -> Iterator[dict[str, Any]]:
    """Rows of the table of soundings, by `COLUMNS`."""
    for number, ping_soundings in enumerate(soundings(survey)):
        known = np.flatnonzero(np.isfinite(ping_soundings["depth"].values))
        north, east, depth, travel = (
            ping_soundings[name].values[known] for name in ("north", "east", "depth", "travel_time")
        )
        latitude, longitude = survey.frame.geodetic(north, east)
        ping, time = int(survey.recording["ping"].values[survey.rows[number]]), float(survey.time[number])
        methods = np.where(ping_soundings["by_phase"].values[known], "phase", "amplitude")
        for values in zip(known.tolist(), latitude, longitude, north, east, depth, travel, methods, strict=True):
            beam, lat, lon, *metres, seconds, method = values
            numbers = (round(float(lat), 9), round(float(lon), 9), *(round(float(metre), 4) for metre in metres))
            yield dict(zip(COLUMNS, (ping, beam, time, *numbers, round(float(seconds), 9), str(method)), strict=True))


def write_csv(survey: Survey, path: Path) -> None:
    """Write soundings as a table with a header.

    Args:
        survey: Recording of elements.
        path: File to write.
    """
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(rows(survey))


def write_geojson(survey: Survey, path: Path) -> None:
    """Write soundings as points with longitude, latitude and height above the sea (RFC 7946).

    Args:
        survey: Recording of elements.
        path: File to write.
    """
    with path.open("w", encoding="utf-8") as file:
        file.write('{"type": "FeatureCollection", "features": [')
        for number, row in enumerate(rows(survey)):
            position = [row.pop("longitude_deg"), row.pop("latitude_deg"), -row["depth_m"]]
            point = {"type": "Feature", "geometry": {"type": "Point", "coordinates": position}, "properties": row}
            file.write(("," if number else "") + "\n" + json.dumps(point))
        file.write("\n]}\n")


def write_bathymetry(survey: Survey, path: Path) -> None:
    """Write the mean elevation of soundings in cells, negative below the sea, with their number and the true elevation.

    Args:
        survey: Recording of elements.
        path: File to write.
    """
    tables = [one[["north", "east", "depth"]].load() for one in soundings(survey)]
    north, east, depth = (np.concatenate([one[name].values for one in tables]) for name in ("north", "east", "depth"))
    known = np.isfinite(depth)
    if not known.any():
        raise StoreError(f"{survey.name}: no ping has a sounding. Check its window, or its level above the noise")
    pixel = round_pixel(max(SHARE * float(np.nanmedian(survey.altitude)), 0.05))
    raster = Raster.around(survey, north[known], east[known], pixel)
    cell, _ = raster.cells(north[known], east[known])
    count = np.bincount(cell, minlength=raster.shape[0] * raster.shape[1])
    sums = np.bincount(cell, depth[known], count.size)
    mean = np.where(count > 0, -sums / np.maximum(count, 1), np.nan).reshape(raster.shape)
    rows_north, columns_east = raster.centres
    truth = -survey.bed_depth(*np.meshgrid(rows_north, columns_east, indexing="ij"))
    bands = {"elevation": mean, "soundings": count.reshape(raster.shape), "true elevation of the bed": truth}
    write_raster(survey, path, raster, {name: band.astype(np.float32) for name, band in bands.items()}, ("m", "1", "m"))
