"""Samples of a recording with their labels: levels with gain, masks and targets, ping by ping."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.annotations.labelled_image import NO_TARGET
from insonify.formats.label_store import open_labels
from insonify.formats.store_description import StoreError
from insonify.processing.gain import LAWS
from insonify.records.labels import SURROUNDINGS
from insonify.sonar.time_varied_gain import tvg_db
from insonify.surveys.ground_lines import slant_ranges
from insonify.surveys.survey import Survey
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]
USED = ["expected_intensity", "object_intensity", "highlight", "shadow", "ghost", "shadowing_object"]


MOST_VALUES = 1 << 22
"""Most values that are read at once: 16 MB [1]."""


class PingSamples(NamedTuple):
    """Samples of one ping with gain and labels."""

    power: Floats
    """Recorded intensity with gain [uPa^2], shape (channels, samples)."""
    expected: Floats
    """Expected intensity with gain [uPa^2], shape (channels, samples)."""
    layers: NDArray[np.int32]
    """Instance in the mask of each class, as in `LabelledImage.layers`, shape (3, channels, samples)."""


@dataclass(frozen=True)
class LabelledPings:
    """Recorded pings of a survey and their labels."""

    survey: Survey
    labels: xr.Dataset
    """Labels over (ping, channel, time), read on access."""
    gain_name: str
    """Gain of the levels: "none" or one of `LAWS`."""
    _blocks: dict[int, tuple[xr.Dataset, NDArray[np.float32]]] = field(default_factory=dict, repr=False)
    """The pings that were read last, by the number of the first."""

    @cached_property
    def instance_names(self) -> tuple[str, ...]:
        """Labels of the targets: all objects but the seabed, the surface and the water."""
        return tuple(name for name in map(str, self.labels["object"].values) if name not in SURROUNDINGS)

    @cached_property
    def _instance_of_row(self) -> NDArray[np.int32]:
        """Instance of each row of the labels' objects, `NO_TARGET` for surroundings and unknown rows, shape (256,)."""
        table = np.full(256, NO_TARGET, np.int32)
        rows = [row for row, name in enumerate(self.labels["object"].values) if str(name) not in SURROUNDINGS]
        table[rows] = np.arange(1, len(rows) + 1)
        return table

    @cached_property
    def gain(self) -> Floats:
        """Gain of each sample for spreading and absorption, as a ratio of intensities, shape (time,)."""
        if self.gain_name == "none":
            return np.ones(self.survey.recording.sizes["time"])
        return gain_ratio(self.survey, self.gain_name)

    @property
    def _block_size(self) -> int:
        """Number of pings that are read at once, because a read of one takes as long as that of many."""
        sizes = self.labels.sizes
        return max(MOST_VALUES // (sizes["channel"] * sizes["time"] * (sizes["object"] + 2)), 1)

    def ping(self, number: int) -> PingSamples:
        """Samples of one ping.

        Args:
            number: Number within the recorded pings.
        """
        first = number - number % self._block_size
        if first not in self._blocks:
            self._blocks.clear()
            block = slice(first, first + self._block_size)
            self._blocks[first] = (
                self.labels[USED].isel(ping=self.survey.rows[block]).load(),
                self.survey.amplitude(block),
            )
        labels, amplitude = self._blocks[first]
        columns = {name: labels.variables[name].values[number - first] for name in USED}
        targets = np.flatnonzero(self._instance_of_row[: labels.sizes["object"]] > 0)
        strongest = np.zeros(columns["highlight"].shape, np.int32)
        if targets.size:
            strongest = np.argmax(columns["object_intensity"][:, targets], axis=1).astype(np.int32) + 1
        caster = self._instance_of_row[columns["shadowing_object"]]
        layers = [
            np.where(columns[name], caster if name == "shadow" else strongest, 0)
            for name in ("highlight", "shadow", "ghost")
        ]
        power = np.asarray(amplitude[number - first], float) ** 2
        expected = np.asarray(columns["expected_intensity"], float)
        return PingSamples(power * self.gain, expected * self.gain, np.stack(layers))


def gain_ratio(survey: Survey, name: str) -> Floats:
    """Gain of each sample for spreading by a law and for absorption, as a ratio of intensities, shape (time,).

    Args:
        survey: The survey.
        name: One of `insonify.processing.gain.LAWS`.
    """
    absorption = float(survey.scenario.water.absorption(survey.scenario.sonar.pulse.frequency))
    return np.asarray(intensity_ratio(tvg_db(slant_ranges(survey), LAWS[name], absorption_db_per_m=absorption)), float)


def labelled_pings(survey: Survey, labels: xr.Dataset | None, gain: str) -> LabelledPings:
    """Recorded pings of a survey and their labels.

    Args:
        survey: The survey.
        labels: Labels over (ping, channel, time); None: those in the folder of the recording.
        gain: "none", or one of `insonify.processing.gain.LAWS`.

    Raises:
        StoreError: The recording has no labels, or those of some pings are missing.
    """
    if gain != "none" and gain not in LAWS:
        raise StoreError(f"{gain!r} is no gain. Choose one of none, {', '.join(LAWS)}")
    survey.require_beams("a labelled image")
    if labels is None:
        if isinstance(survey.name, Path) and not survey.name.is_dir():
            raise StoreError(f"{survey.name}: labels are in the folder of a recording. Give the folder of one made "
                             "with: insonify run FILE -o OUT --labels")  # fmt: skip
        labels = open_labels(survey.name)
    done = labels["done"].values if "done" in labels else np.ones(labels.sizes["ping"], bool)
    missing = survey.rows[~done[survey.rows]]
    if missing.size:
        raise StoreError(f"{survey.name}: ping {missing[0]} has no labels. Make them: insonify run FILE -o "
                         f"{survey.name} --labels")  # fmt: skip
    return LabelledPings(survey, labels, gain)
