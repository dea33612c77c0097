"""GeoTIFF: mosaic of sidescan lines on the terrain, their labels, and the waterfall over ground range."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from insonify.annotations.class_names import CLASSES
from insonify.annotations.labelled_pings import gain_ratio, labelled_pings
from insonify.annotations.mosaic import labelled_mosaic
from insonify.annotations.waterfalls import channels_of_sides
from insonify.processing.slant_range_correction import slant_to_ground_range
from insonify.surveys.earth_frame import NO_EARTH
from insonify.surveys.ground_lines import require_sideways, slant_ranges
from insonify.surveys.mosaic import mosaic_lines, mosaic_raster
from insonify.surveys.raster import write_bands, write_raster
from insonify.surveys.survey import Survey
from insonify.units import level_db

Floats = NDArray[np.float64]

GAIN = "tvg30"
NOTHING = 255
LEVEL = f"level, gain {GAIN}"


def write_mosaic(survey: Survey, path: Path) -> None:
    """Write the mean level of all lines on the terrain [dB re 1 uPa, gain 30 log r].

    Args:
        survey: Recording of beams that look to a side.
        path: File to write.
    """
    raster, gain = mosaic_raster(survey), gain_ratio(survey, GAIN)
    sums, lines = np.zeros(raster.shape), np.zeros(raster.shape, np.int32)
    for number, amplitude in survey.amplitudes():
        power = np.asarray(amplitude, float) ** 2 * gain
        for under in mosaic_lines(survey, number, raster):
            under.add_means(power[under.channel], sums, lines)
    part, used = raster.used(lines > 0)
    level = np.where(lines[used] > 0, level_db(sums[used] / np.maximum(lines[used], 1)), np.nan)
    write_raster(survey, path, part, {LEVEL: level.astype(np.float32)}, ("dB re 1 uPa",))


def write_labels(survey: Survey, path: Path) -> None:
    """Write the class and the target of each cell of the mosaic, of a recording with labels.

    Args:
        survey: Recording of beams that look to a side, in its folder.
        path: File to write.
    """
    image = labelled_mosaic(labelled_pings(survey, None, GAIN))
    is_empty = np.isnan(image.image)
    classes = "; ".join(f"{number} {name}" for number, name in enumerate(("background", *CLASSES)))
    targets = "; ".join(f"{number} {name}" for number, name in enumerate(("none", *image.instance_names)))
    bands = {f"class: {classes}": image.classes, f"target: {targets}": image.instances.astype(np.uint8)}
    bands = {name: np.where(is_empty, np.uint8(NOTHING), codes) for name, codes in bands.items()}
    write_bands(path, (image.crs, image.transform), bands, tags=survey.tags)


def write_waterfall(survey: Survey, path: Path) -> None:
    """Write levels of pings over ground range on a flat bed, port to the left, the last ping above.

    Coordinates are metres across the track and along it. The height above the bed is the true one.

    Args:
        survey: Recording of beams that look to a side.
        path: File to write.
    """
    require_sideways(survey)
    slant, gain = slant_ranges(survey), gain_ratio(survey, GAIN)
    cell, altitude = float(slant[1] - slant[0]), survey.altitude
    reach = np.sqrt(max(slant[-1] ** 2 - float(np.nanmin(altitude)) ** 2, cell**2))
    across = np.asarray((np.arange(max(int(reach / cell), 2)) + 0.5) * cell, float)
    sides = channels_of_sides(survey)
    shown = [channel for _, channel in sides]
    level = np.empty((survey.rows.size, len(shown) * across.size), np.float32)
    for number, amplitude in survey.amplitudes():
        levels_db = level_db(np.asarray(amplitude, float) ** 2 * gain)
        lines = slant_to_ground_range(levels_db[shown], slant, np.repeat(altitude[number], len(shown)), across)
        ends = [line[::-1] if side < 0 else line for (side, _), line in zip(sides, lines, strict=True)]
        level[-1 - number] = np.concatenate(ends)
    run = float(survey.distance_run[-1])
    step = run / max(survey.rows.size - 1, 1) or cell
    left = -reach if sides[0][0] < 0 else 0.0
    georeference = NO_EARTH, (cell, 0.0, round(left / cell) * cell, 0.0, -step, run + step / 2)
    write_bands(path, georeference, {LEVEL: level}, ("dB re 1 uPa",), survey.tags)
