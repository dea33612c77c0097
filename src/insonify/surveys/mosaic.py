"""Mosaic: lines of a sidescan on the terrain, summed over the cells of a raster."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.surveys.ground_lines import GroundLine, ground_lines, require_sideways, slant_ranges
from insonify.surveys.raster import Raster, round_pixel
from insonify.surveys.survey import Survey

Floats = NDArray[np.float64]


class MosaicLine(NamedTuple):
    """Cells of a raster under one line of one channel."""

    channel: int
    line: GroundLine
    cells: NDArray[np.int64]
    """Index of the cell of the flattened raster under each cell of the line, shape (n,)."""
    inside: NDArray[np.bool_]
    """Mask of those inside the raster, shape (n,)."""

    def add_means(self, values: Floats, sums: Floats, counts: NDArray[np.int32]) -> None:
        """Add the means of samples over the line's cells to sums and counts of their shape in the raster."""
        mean = self.line.means(values)
        used = self.inside & np.isfinite(mean)
        np.add.at(sums.ravel(), self.cells[used], mean[used])
        np.add.at(counts.ravel(), self.cells[used], 1)


def mosaic_raster(survey: Survey) -> Raster:
    """Raster of a mosaic: cells of the range resolution or of a third of the distance between pings, and its extent.

    Args:
        survey: Recording of beams that look to a side.
    """
    require_sideways(survey)
    sonar, speed = survey.scenario.sonar, survey.scenario.water.sound_speed
    resolution = speed / 2 / (sonar.pulse.bandwidth or 1 / sonar.pulse.duration)
    steps = np.diff(survey.distance_run)
    spacing = float(np.median(steps)) if steps.size else 0.0
    pixel = round_pixel(max(resolution, spacing / 3, speed / 2 * survey.sample_interval))
    reach = float(slant_ranges(survey)[-1]) + pixel
    north, east = survey.position[:, 0], survey.position[:, 1]
    corners = [np.concatenate([axis - reach, axis + reach]) for axis in (north, east)]
    return Raster.around(survey, corners[0], corners[1], pixel)


def mosaic_lines(survey: Survey, number: int, raster: Raster) -> Iterator[MosaicLine]:
    """Lines of one ping on a raster."""
    for channel, line in ground_lines(survey, number, raster.pixel):
        yield MosaicLine(channel, line, *raster.cells(line.north, line.east))
