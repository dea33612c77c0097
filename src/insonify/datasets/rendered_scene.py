"""Images of one scene of a data set and of its twins: recorded, expected, with labels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from insonify import random_keys
from insonify.annotations import LabelledImage, labelled_images
from insonify.datasets.dataset_classes import scene_class_names
from insonify.datasets.dataset_file import DatasetFile
from insonify.datasets.drawn_scene import SceneDraws, twin
from insonify.processing.speckle import speckle_intensity
from insonify.records.labels import label_dataset
from insonify.records.recording import recording_dataset
from insonify.scenario.attributes import attributes
from insonify.scenario.recording_layout import recording_layout
from insonify.scenario.scenario import Scenario
from insonify.simulator import Job, Simulator, build_simulator, simulate_jobs
from insonify.sonar.recorder import Looks
from insonify.surveys.survey import Survey

if TYPE_CHECKING:
    import xarray as xr

IMAGES_PER_SCENE = 10_000
"""Images of a scene and its twins between the numbers of one scene and the next [1]."""
THE_SCENE = "scene"
"""Name of a scene itself beside its twins."""


@dataclass(frozen=True, slots=True)
class SceneImage:
    """One image of a data set."""

    labelled: LabelledImage
    """Levels, expected levels and masks."""
    twin: str
    """`scene`, or the thing in which it differs from the scene."""
    scenario: Scenario
    """Scenario of the image."""
    drawn: dict[str, Any]
    """Values that were drawn for the scene, by key."""


def scene_images(file: DatasetFile, base: Scenario, number: int, threads: int | None = 1) -> Iterator[SceneImage]:
    """Images of one scene: of itself, then of its twins.

    Args:
        file: The data set.
        base: Its scenario.
        number: Number of the scene, from 0.
        threads: Number of threads.
    """
    scenario, drawn = SceneDraws(file, base).scene(number)
    settings, first = file.dataset, number * IMAGES_PER_SCENE
    class_names, expected = scene_class_names(file, base, scenario, drawn), None
    for one in (THE_SCENE, *file.pairs):
        twin_scene = twin(scenario, one, len(base.targets))
        if one == "other_speckle" and expected is not None:
            recording, labels = expected
        else:
            recording, labels = expected_recording(twin_scene, threads)
        expected = expected or (recording, labels)
        stream = random_keys.OTHER_SPECKLE if one == "other_speckle" else random_keys.SPECKLE
        name = f"{number:05d}" if one == THE_SCENE else f"{number:05d}_{one}"
        survey = Survey(Path(name), with_speckle(recording, twin_scene, stream), twin_scene)
        for image in labelled_images(
            survey, settings.projection, settings.tile, labels=labels, gain=settings.gain, first_index=first, name=name
        ):
            if image.index >= (number + 1) * IMAGES_PER_SCENE:
                raise ValueError(f"scene {number} has more than {IMAGES_PER_SCENE} images; give fewer pings or larger "
                                 "tiles")  # fmt: skip
            yield SceneImage(replace(image, class_names=class_names), one, twin_scene, drawn)
            first = image.index + 1


def expected_recording(scenario: Scenario, threads: int | None = 1) -> tuple[xr.Dataset, xr.Dataset]:
    """Recording of a scenario in memory, and its masks; an incoherent one from the labels' expected intensity.

    Args:
        scenario: The scenario.
        threads: Number of threads.
    """
    simulator = replace(build_simulator(scenario), with_positions=False)
    coherent = scenario.field == "coherent"
    pings = list(range(scenario.track.ping_count))
    data, parts = [], []
    for _, series, labelling in simulate_jobs(simulator, [Job(n, coherent, True) for n in pings], threads):
        assert labelling is not None
        parts.append(labelling)
        data.append(series if coherent else _recorded(simulator, labelling.expected_intensity))
    layout = recording_layout(scenario, simulator.platforms, simulator.grid.time)
    numbers = np.array(pings, np.int64)
    recording = recording_dataset(layout, attributes(scenario), np.array(data), numbers)
    return recording, label_dataset(parts, simulator.label_names, simulator.grid.time, numbers)


def _recorded(simulator: Simulator, expected: Any) -> Any:
    """Expected intensity with noise, behind the receiver's electronics, as a recording has it."""
    intensity = np.asarray(expected + simulator.noise.power[:, None])
    return intensity if simulator.electronics is None else simulator.electronics.intensities(intensity)


def with_speckle(recording: xr.Dataset, scenario: Scenario, stream: int) -> xr.Dataset:
    """A recording with speckle drawn from its expected intensity; a coherent one, which has its own, as it is.

    Args:
        recording: The recording.
        scenario: Its scenario; the looks of its recorder are averaged.
        stream: Stream of the draw.
    """
    if "intensity" not in recording:
        return recording
    from insonify.sonar.received_pulse import received_pulse

    sonar = scenario.sonar
    stages = sonar.recorder.stages if sonar.recorder is not None else ()
    looks = int(np.prod([stage.samples * stage.pings for stage in stages if isinstance(stage, Looks)], initial=1))
    intensity = recording["intensity"].transpose("ping", "channel", "time")
    pings, channels, samples = intensity.shape
    speckle = speckle_intensity(
        received_pulse(sonar), sonar.receiver.sample_rate, (pings, channels, samples),
        seed=scenario.seed, stream=stream, looks=looks,
    )  # fmt: skip
    return recording.assign(intensity=intensity.copy(data=intensity.values * speckle))
