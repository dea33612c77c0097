"""Mosaic with labels: lines of a sidescan on the terrain, and the class and target of most of them in each cell."""

import numpy as np
from numpy.typing import NDArray

from insonify.annotations.class_names import CLASSES
from insonify.annotations.labelled_image import ImageAxis, LabelledImage
from insonify.annotations.labelled_pings import LabelledPings
from insonify.surveys.mosaic import mosaic_lines, mosaic_raster
from insonify.units import level_db


def labelled_mosaic(source: LabelledPings) -> LabelledImage:
    """Mosaic of a recording, north up.

    A cell has the mean power of the lines over it. It belongs to a mask where at least half of these lines do, and to
    the target of most of them.
    """
    survey = source.survey
    raster = mosaic_raster(survey)
    power, expected = np.zeros(raster.shape), np.zeros(raster.shape)
    lines, lines_expected = np.zeros(raster.shape, np.int32), np.zeros(raster.shape, np.int32)
    votes = [list[NDArray[np.int64]]() for _ in CLASSES]
    base = len(source.instance_names) + 2  # instances from NO_TARGET on
    for number in range(survey.rows.size):
        ping = source.ping(number)
        for under in mosaic_lines(survey, number, raster):
            under.add_means(ping.power[under.channel], power, lines)
            under.add_means(ping.expected[under.channel], expected, lines_expected)
            sample = under.line.samples(ping.power.shape[1])
            known = under.inside & (sample >= 0)
            for row, layer in enumerate(ping.layers[:, under.channel]):
                instance = layer[sample[known]].astype(np.int64)
                marked = instance != 0
                votes[row].append(under.cells[known][marked] * base + instance[marked] + 1)
    layers = np.stack([_elected(votes[row], base, lines) for row in range(len(CLASSES))])
    part, used = raster.used(lines > 0)
    north, east = part.centres
    northing, easting = survey.frame.offset
    levels = [
        np.where(count[used] > 0, level_db(total[used] / np.maximum(count[used], 1)), np.nan).astype(np.float32)
        for total, count in ((power, lines), (expected, lines_expected))
    ]
    return LabelledImage(
        0, "_mosaic", "mosaic", levels[0], levels[1], layers[:, used[0], used[1]], source.instance_names,
        ImageAxis("northing", "m", north + northing), ImageAxis("easting", "m", east + easting),
        crs=survey.frame.raster_crs,
    )  # fmt: skip


def _elected(votes: list[NDArray[np.int64]], base: int, lines: NDArray[np.int32]) -> NDArray[np.int32]:
    """Instance of each cell with most votes, where at least half of the lines have voted, shape of `lines`."""
    layer = np.zeros(lines.size, np.int32)
    keys, counts = np.unique(np.concatenate(votes) if votes else np.empty(0, np.int64), return_counts=True)
    cells, instances = keys // base, keys % base - 1
    marked = np.bincount(cells, counts, minlength=lines.size)
    order = np.argsort(counts, kind="stable")  # the last one written to a cell has most votes
    layer[cells[order]] = instances[order]
    return np.where(2 * marked >= np.maximum(lines.ravel(), 1), layer, 0).reshape(lines.shape).astype(np.int32)
