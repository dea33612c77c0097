"""GeoTIFF: mosaic of sidescan lines on the terrain, their labels, and the waterfall over ground range."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from insonify.formats.label_store import open_labels
from insonify.formats.store_description import StoreError
from insonify.processing.gain import LAWS
from insonify.processing.slant_range_correction import slant_to_ground_range
from insonify.sonar.time_varied_gain import tvg_db
from insonify.units import intensity_ratio, level_db
from insonify.writers.earth_frame import NO_EARTH
from insonify.writers.ground_lines import ground_lines, require_sideways, slant_ranges
from insonify.writers.raster import Raster, round_pixel, write_bands, write_raster
from insonify.writers.survey import Survey

Floats = NDArray[np.float64]

GAIN = "tvg30"
CLASSES = ("no highlight, shadow or ghost", "shadow", "ghost", "highlight")
"""Classes of cells by their code; of several in a cell, the last."""
NOTHING = 255
LEVEL = f"level, gain {GAIN}"


def write_mosaic(survey: Survey, path: Path) -> None:
    """Write the mean level of all lines on the terrain [dB re 1 uPa, gain 30 log r].

    Args:
        survey: Recording of beams that look to a side.
        path: File to write.
    """
    raster, gain = _grid(survey), _gain(survey)
    sums, lines = np.zeros(raster.shape), np.zeros(raster.shape, np.int32)
    for number, amplitude in survey.amplitudes():
        power = np.asarray(amplitude, float) ** 2 * gain
        for channel, line in ground_lines(survey, number, raster.pixel):
            mean, (cell, inside) = line.means(power[channel]), raster.cells(line.north, line.east)
            inside &= np.isfinite(mean)
            np.add.at(sums.ravel(), cell[inside], mean[inside])
            np.add.at(lines.ravel(), cell[inside], 1)
    part, used = raster.used(lines > 0)
    level = np.where(lines[used] > 0, level_db(sums[used] / np.maximum(lines[used], 1)), np.nan)
    write_raster(survey, path, part, {LEVEL: level.astype(np.float32)}, ("dB re 1 uPa",))


def write_labels(survey: Survey, path: Path) -> None:
    """Write the class of each cell of the mosaic by `CLASSES`, and the object, of a recording with labels.

    Args:
        survey: Recording of beams that look to a side, in its folder.
        path: File to write.
    """
    if not survey.name.is_dir():
        raise StoreError(f"{survey.name}: labels are in the folder of a recording. Give the folder of one made with: "
                         "insonify run FILE -o OUT --labels")  # fmt: skip
    raster, labels = _grid(survey), open_labels(survey.name)
    missing = survey.rows[~labels["done"].values[survey.rows]]
    if missing.size:
        raise StoreError(f"{survey.name}: ping {missing[0]} has no labels. Make them: insonify run FILE -o "
                         f"{survey.name} --labels")  # fmt: skip
    code, objects = (np.full(raster.shape, value, np.int16) for value in (-1, NOTHING))
    for number, row in enumerate(survey.rows):
        ping = labels[["highlight", "shadow", "ghost", "strongest_object", "shadowing_object"]].isel(ping=row).load()
        mask = {name: ping[name].values for name in ("shadow", "ghost", "highlight")}
        kinds = np.select([mask["highlight"], mask["ghost"], mask["shadow"]], [3, 2, 1])
        named = np.where(mask["shadow"], ping["shadowing_object"].values, ping["strongest_object"].values)
        for channel, line in ground_lines(survey, number, raster.pixel):
            sample, (cell, inside) = line.samples(kinds.shape[1]), raster.cells(line.north, line.east)
            inside &= sample >= 0
            kind = kinds[channel][sample[inside]].astype(np.int16)
            higher = kind > code.ravel()[cell[inside]]
            place = cell[inside][higher]
            np.maximum.at(code.ravel(), place, kind[higher])
            objects.ravel()[place] = named[channel][sample[inside]][higher]
    part, used = raster.used(code >= 0)
    classes = np.where(code[used] < 0, NOTHING, code[used]).astype(np.uint8)
    names = "; ".join(f"{number} {name}" for number, name in enumerate(CLASSES))
    owners = "; ".join(f"{number} {name}" for number, name in enumerate(labels["object"].values))
    bands = {f"class: {names}": classes, f"object: {owners}": objects[used].astype(np.uint8)}
    write_raster(survey, path, part, bands)


def write_waterfall(survey: Survey, path: Path) -> None:
    """Write levels of pings over ground range on a flat bed, port to the left, the last ping above.

    Coordinates are metres across the track and along it. The height above the bed is the true one.

    Args:
        survey: Recording of beams that look to a side.
        path: File to write.
    """
    require_sideways(survey)
    slant, gain = slant_ranges(survey), _gain(survey)
    cell, altitude = float(slant[1] - slant[0]), survey.altitude
    reach = np.sqrt(max(slant[-1] ** 2 - float(np.nanmin(altitude)) ** 2, cell**2))
    across = np.asarray((np.arange(max(int(reach / cell), 2)) + 0.5) * cell, float)
    sides = np.asarray(survey.recording["side"].values).astype(int)
    shown = [int(np.flatnonzero(sides == side)[0]) for side in np.unique(sides)]
    level = np.empty((survey.rows.size, len(shown) * across.size), np.float32)
    for number, amplitude in survey.amplitudes():
        found = level_db(np.asarray(amplitude, float) ** 2 * gain)
        lines = slant_to_ground_range(found[shown], slant, np.repeat(altitude[number], len(shown)), across)
        ends = [line[::-1] if sides[channel] < 0 else line for channel, line in zip(shown, lines, strict=True)]
        level[-1 - number] = np.concatenate(ends)
    run = np.linalg.norm(np.diff(survey.position[:, :2], axis=0), axis=1).sum()
    step = float(run) / max(survey.rows.size - 1, 1) or cell
    left = -reach if sides[shown[0]] < 0 else 0.0
    place = NO_EARTH, (cell, 0.0, round(left / cell) * cell, 0.0, -step, run + step / 2)
    write_bands(survey, path, place, {LEVEL: level}, ("dB re 1 uPa",))


def _gain(survey: Survey) -> Floats:
    """Gain of each sample for spreading and absorption, as a ratio of intensities, shape (time,)."""
    absorption = float(survey.scenario.water.absorption(survey.scenario.sonar.pulse.frequency))
    return np.asarray(intensity_ratio(tvg_db(slant_ranges(survey), LAWS[GAIN], absorption_db_per_m=absorption)), float)


def _grid(survey: Survey) -> Raster:
    """Raster of a mosaic: cells of the range resolution or of a third of the distance between pings, and its extent."""
    require_sideways(survey)
    sonar, speed = survey.scenario.sonar, survey.scenario.water.sound_speed
    resolution = speed / 2 / (sonar.pulse.bandwidth or 1 / sonar.pulse.duration)
    steps = np.linalg.norm(np.diff(survey.position[:, :2], axis=0), axis=1)
    spacing = float(np.median(steps)) if steps.size else 0.0
    pixel = round_pixel(max(resolution, spacing / 3, speed / 2 * survey.sample_interval))
    reach = float(slant_ranges(survey)[-1]) + pixel
    north, east = survey.position[:, 0], survey.position[:, 1]
    corners = [np.concatenate([axis - reach, axis + reach]) for axis in (north, east)]
    return Raster.around(survey, corners[0], corners[1], pixel)
