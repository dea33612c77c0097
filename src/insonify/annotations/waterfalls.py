"""Waterfalls with labels: pings over slant range, or over ground range on the terrain."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from insonify.annotations.class_names import CLASSES
from insonify.annotations.labelled_image import ImageAxis, LabelledImage, Projection
from insonify.annotations.labelled_pings import LabelledPings, PingSamples
from insonify.surveys.ground_lines import ground_line, slant_ranges
from insonify.surveys.survey import Survey
from insonify.units import level_db

Floats = NDArray[np.float64]
Parts = tuple[Floats, Floats, NDArray[np.int32]]


def labelled_waterfalls(
    source: LabelledPings, projection: Projection, line_count: int | None
) -> Iterator[LabelledImage]:
    """Waterfalls of so many lines each, port to the left, the last ping above.

    The first beam of each side is taken. A cell of ground range has the mean power of its span and the labels of the
    sample in its middle.

    Args:
        source: Pings and their labels.
        projection: "slant" or "ground".
        line_count: Lines of an image, the last one moved back over the one before; None: all.

    Yields:
        The images from the top, the last pings first.
    """
    survey = source.survey
    sides = channels_of_sides(survey)
    across = _across(survey, projection)
    columns = np.concatenate([side * across[:: -1 if side < 0 else 1] if side else across for side, _ in sides])
    run = survey.distance_run
    count = survey.rows.size
    for block in line_spans(count, line_count or count):
        numbers = np.arange(count)[::-1][block]
        image, expected = (np.full((numbers.size, columns.size), np.nan, np.float32) for _ in range(2))
        layers = np.zeros((len(CLASSES), numbers.size, columns.size), np.int32)
        for row, number in enumerate(numbers.tolist()):
            ping, filled = source.ping(number), 0
            for side, channel in sides:
                parts = _line(source, ping, (number, channel), (projection, across))
                order = slice(None, None, -1) if side < 0 else slice(None)
                at = slice(filled, filled + across.size)
                filled += across.size
                image[row, at], expected[row, at] = (level_db(power)[order] for power in parts[:2])
                layers[:, row, at] = parts[2][:, order]
        yield LabelledImage(
            0, "", projection, image, expected, layers, source.instance_names,
            ImageAxis("distance along the track", "m", run[numbers]),
            ImageAxis(f"{projection} range", "m", columns), (block.start, 0),
            survey.rows[numbers],
        )  # fmt: skip


def channels_of_sides(survey: Survey) -> list[tuple[int, int]]:
    """Side and first channel of each side, port first."""
    sides = np.asarray(survey.recording["side"].values).astype(int)
    return [(int(side), int(np.flatnonzero(sides == side)[0])) for side in np.unique(sides)]


def line_spans(count: int, size: int) -> list[slice]:
    """Parts of so many lines: each of one size, the last one moved inwards.

    Args:
        count: Number of lines.
        size: Lines of a part.
    """
    starts = [min(start, max(count - size, 0)) for start in range(0, count, size)]
    return [slice(start, min(start + size, count)) for start in starts]


def _across(survey: Survey, projection: Projection) -> Floats:
    """Middles of the columns of one side [m]."""
    slant = slant_ranges(survey)
    if projection == "slant":
        return slant
    cell = float(slant[1] - slant[0])
    height = max(survey.shallowest_bed - float(survey.position[:, 2].max()), 0.0)
    reach = np.sqrt(max(slant[-1] ** 2 - height**2, (2 * cell) ** 2))
    return np.asarray((np.arange(int(reach / cell)) + 0.5) * cell, float)


def _line(source: LabelledPings, ping: PingSamples, index: tuple[int, int], grid: tuple[Projection, Floats]) -> Parts:
    """Recorded and expected power, and layers, of one side of one ping, on the columns of that side."""
    (number, channel), (projection, across) = index, grid
    if projection == "slant":
        return ping.power[channel], ping.expected[channel], ping.layers[:, channel]
    line = ground_line(source.survey, number, channel, float(across[1] - across[0]))
    sample = line.samples(ping.power.shape[1])[: across.size]
    layers = np.where(sample >= 0, ping.layers[:, channel, np.maximum(sample, 0)], 0)
    power, expected = (line.means(values[channel])[: across.size] for values in (ping.power, ping.expected))
    return power, expected, layers
