"""Images of single pings with labels: slant range over the bearing of the beams of a fan."""

from collections.abc import Iterator

import numpy as np

from insonify.annotations.labelled_image import ImageAxis, LabelledImage
from insonify.annotations.labelled_pings import LabelledPings
from insonify.surveys.ground_lines import slant_ranges
from insonify.units import level_db


def labelled_sectors(source: LabelledPings) -> Iterator[LabelledImage]:
    """Images of each ping, the farthest range above and the beams by their steering angle.

    Args:
        source: Pings and their labels.
    """
    steer = np.asarray(source.survey.recording["steer"].values, float)
    order = np.argsort(steer, kind="stable")
    rows = ImageAxis("slant range", "m", slant_ranges(source.survey)[::-1])
    for number, row in enumerate(source.survey.rows):
        ping = source.ping(number)
        image, expected = (level_db(power[order].T[::-1]).astype(np.float32) for power in (ping.power, ping.expected))
        layers = np.ascontiguousarray(ping.layers[:, order].transpose(0, 2, 1)[:, ::-1])
        yield LabelledImage(
            0, f"_ping{row:05d}", "slant", image, expected, layers, source.instance_names, rows,
            ImageAxis("bearing", "rad", steer[order]), pings=np.array([row]),
        )  # fmt: skip
