"""Images of single pings with labels: slant range over the bearing of the beams of a fan."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from insonify.annotations.class_names import CLASSES
from insonify.annotations.labelled_image import ImageAxis, LabelledImage
from insonify.annotations.labelled_pings import LabelledPings
from insonify.annotations.main_lobes import beams_at_targets
from insonify.simulator import Simulator, build_simulator
from insonify.surveys.ground_lines import slant_ranges
from insonify.units import level_db


def labelled_sectors(source: LabelledPings) -> Iterator[LabelledImage]:
    """Images of each ping, the farthest range above and the beams by their steering angle.

    Highlights and ghosts of a target are those of the beams that have it in their main lobe.
    """
    steer = np.asarray(source.survey.recording["steer"].values, float)
    order = np.argsort(steer, kind="stable")
    rows = ImageAxis("slant range", "m", slant_ranges(source.survey)[::-1])
    simulator = build_simulator(source.survey.scenario)
    for number, row in enumerate(source.survey.rows):
        ping = source.ping(number)
        image, expected = (level_db(power[order].T[::-1]).astype(np.float32) for power in (ping.power, ping.expected))
        layers = _without_sidelobes(simulator, source.instance_names, ping.layers, int(row))[:, order]
        layers = np.ascontiguousarray(layers.transpose(0, 2, 1)[:, ::-1])
        yield LabelledImage(
            0, f"_ping{row:05d}", "slant", image, expected, layers, source.instance_names, rows,
            ImageAxis("bearing", "rad", steer[order]), pings=np.array([row]),
        )  # fmt: skip


def _without_sidelobes(
    simulator: Simulator, instance_names: tuple[str, ...], layers: NDArray[np.int32], ping: int
) -> NDArray[np.int32]:
    """Layers of one ping, (3, channels, samples), without highlights and ghosts that sidelobes receive."""
    families, channels = simulator.scenario.paths.followed_families, np.arange(layers.shape[1])[:, None]
    by_class = {"highlight": [family for family in families if "S" not in family], "ghost": families}
    kept = layers.copy()
    for name, some in by_class.items():
        in_main_lobe, row = beams_at_targets(simulator, ping, some), CLASSES.index(name)
        is_received = np.ones((len(instance_names) + 1, len(channels)), bool)
        for instance, label in enumerate(instance_names, 1):
            is_received[instance] = in_main_lobe.get(label, True)
        kept[row] = np.where(is_received[layers[row], channels], layers[row], 0)
    return kept
