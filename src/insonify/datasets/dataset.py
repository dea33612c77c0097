"""Data sets of labelled images about one scenario: made in a folder, or one image after the other."""

from __future__ import annotations

import gc
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from insonify.caller_warning import warn_caller
from insonify.cluster import ClusterError, JobRequest, require_cluster, run_parts
from insonify.datasets.dataset_checks import dataset_faults, faults_together
from insonify.datasets.dataset_file import DatasetFile
from insonify.datasets.dataset_folder import DatasetFolder
from insonify.datasets.rendered_scene import SceneImage, scene_images
from insonify.datasets.swath import PlacementError
from insonify.datasets.typed_values import read_typed
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.formats.recording_state import decreasing_shares
from insonify.kernel_compilation import compile_ahead
from insonify.part import Part
from insonify.scenario.features import scenario_features
from insonify.scenario.load import load, load_scenario
from insonify.scenario.scenario import Scenario
from insonify.thread_count import thread_count
from insonify.validity import PhysicsWarning

WHOLE = Part(1, 1)
YOUNG = 500_000
"""New objects between two searches for cyclic garbage, of which scenes make none [1]."""


@dataclass(frozen=True)
class Description:
    """Data set as its file describes it, checked."""

    file: DatasetFile
    base: Scenario


def load_dataset(path: str | Path) -> Description:
    """Load the file of a data set and its scenario, and check all ranges.

    Args:
        path: The file.

    Raises:
        ScenarioError: Every fault that was found, one line each.
    """
    file = load(DatasetFile, path)
    base = load_scenario(file.scene)
    if faults := dataset_faults(file, base, path):
        raise ScenarioError(faults)
    return Description(file, base)


def make_dataset(
    path: str | Path, out: str | Path, *, part: Part | str = WHOLE, processes: int | None = None,
    cluster: str | None = None, on_scene: Callable[[int, int], None] | None = None,
) -> bool:  # fmt: skip
    """Make the images of a data set, or of one part of the job; those that are there are kept.

    Args:
        path: File of the data set.
        out: Folder of the images.
        part: Part of the scenes, such as "3/64".
        processes: Number of processes; None: one for each core. The result does not depend on it, bit for bit.
        cluster: Address of a cluster whose workers make the scenes, such as "local:2", "tcp://host:8786" or
            "slurm://partition:64"; the folder has to be on a disk that all of them see. Not with `part` or `processes`.
        on_scene: Called with the numbers of scenes done and of all of the part, before the first and after each; on a
            cluster after some.

    Returns:
        True if all scenes of all parts are there, and so the card and the lists of annotations.

    Raises:
        ScenarioError: Values that were drawn for a scene contradict each other.
        ClusterError: Some scenes could not be made on the cluster; the others are there.
    """
    chosen, described = Part.parse(part), load_dataset(path)
    if cluster is not None:
        require_cluster(cluster)
        if chosen != WHOLE or processes is not None:
            raise ValueError(
                f"part and processes are for one process, and {cluster} has many. Leave cluster or them out"
            )
    folder = DatasetFolder(Path(out).absolute() if cluster else Path(out), described.file, described.base)
    mine = chosen.share(described.file.dataset.images)
    if described.file.compare is not None and 0 in mine and not folder.note(0).exists():
        from insonify.comparison.sources import samples_of

        samples_of(described.file.compare)  # the card needs it, after all scenes
    folder.open([read_typed(path), read_typed(described.file.scene)])
    report = on_scene or (lambda *_: None)
    try:
        if cluster is None:
            _make_scenes(folder, mine, processes, report)
        else:
            _make_on_cluster(folder, cluster, report)
    except (ScenarioError, PlacementError) as error:  # of values that fit alone, and not together
        raise ScenarioError(faults_together(error, described.file, path)) from None
    return folder.finish()


def _make_scenes(
    folder: DatasetFolder, mine: range, processes: int | None, report: Callable[[int, int], None]
) -> None:  # fmt: skip
    """Make the scenes of one part that are missing, in one process or several."""
    missing = folder.missing(mine)
    report(len(mine) - len(missing), len(mine))
    count = min(thread_count(processes), max(len(missing), 1))
    if missing:
        compile_ahead(scenario_features(folder.base, labels=True), count)
    with ExitStack() as stack:
        run: Callable[..., Iterator[list[str]]] = map
        if count == 1:
            _start(folder)
        else:
            run = stack.enter_context(ProcessPoolExecutor(count, get_context("spawn"), _start, (folder,))).map
        made = zip(missing, run(_make_scene, missing), strict=True)
        for done, (scene, doubts) in enumerate(made, len(mine) - len(missing) + 1):
            _warn_about(scene, doubts)
            report(done, len(mine))


def _warn_about(scene: int, doubts: list[str]) -> None:
    """Issue the warnings about a scene, with its number."""
    for doubt in doubts:
        warn_caller(f"scene {scene}: {doubt}", PhysicsWarning)


def _make_on_cluster(folder: DatasetFolder, cluster: str, report: Callable[[int, int], None]) -> None:
    """Make the scenes that are missing on the workers of a cluster."""
    images = folder.file.dataset.images
    missing = set(folder.missing(range(images)))
    report(images - len(missing), images)
    if not missing:
        return

    def take(part: range, doubts: dict[int, list[str]]) -> None:
        missing.difference_update(part)
        for scene in doubts:
            _warn_about(scene, doubts[scene])
        report(images - len(missing), images)

    weights = np.array([scene in missing for scene in range(images)])
    try:
        run_parts(
            _make_part, folder, cluster, partial(decreasing_shares, weights), on_result=take, items="scenes",
            request=partial(_job_request, folder),
        )  # fmt: skip
    except ClusterError as error:
        if isinstance(error.__cause__, ScenarioError | PlacementError):
            raise error.__cause__ from None
        raise


def _job_request(folder: DatasetFolder, jobs: int) -> JobRequest:
    """Time and memory of each of some jobs that share the scenes, by the scenario of the data set."""
    from insonify.estimates.run_cost import estimate_cost

    images = folder.file.dataset.images * (1 + len(folder.file.pairs))
    return estimate_cost(folder.base, labels=True, threads=1).repeated(images).of_task(jobs).job_request()


def _make_part(folder: DatasetFolder, scenes: range) -> dict[int, list[str]]:
    """Make the scenes of a part of the data set that are missing; return the warnings about each."""
    _FOLDER[:] = [folder]
    return {scene: _make_scene(scene) for scene in folder.missing(scenes)}


_FOLDER: list[DatasetFolder] = []  # of this process


def _start(folder: DatasetFolder) -> None:
    """Prepare a process for scenes of a data set."""
    _FOLDER[:] = [folder]
    gc.set_threshold(YOUNG)
    gc.freeze()


def _make_scene(scene: int) -> list[str]:
    """Make the images of a scene, unless another job has made it; return the warnings about it."""
    folder = _FOLDER[0]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        if folder.missing([scene]):
            folder.write(scene, scene_images(folder.file, folder.base, scene))
    return list(dict.fromkeys(str(one.message) for one in caught if issubclass(one.category, PhysicsWarning)))


def dataset(path: str | Path, *, part: Part | str = WHOLE, threads: int | None = None) -> Iterator[dict[str, Any]]:
    """Images of a data set, simulated one after the other: for loops that train without files.

    Args:
        path: File of the data set.
        part: Part of the scenes, such as "2/4" for the second of four workers.
        threads: Number of threads; all cores by default.

    Yields:
        For each image `image` and `expected`, its level and expected level with gain [dB], float32, shape (r, c);
        `classes` uint8 (number of the class in `class_names`, from 1; 0 background), `instances` int32 (number of the
        target, from 1) of that shape; `class_names`; `targets`, their labels; `name`, `twin`, `drawn`, `scenario`.

    Example:
        >>> item = next(insonify.dataset("dataset.yaml"))
        >>> item["image"].shape, item["targets"], item["class_names"]
        ((12, 140), ('pipe',), ('highlight', 'shadow', 'ghost'))
    """
    mine, described = Part.parse(part), load_dataset(path)
    for scene in mine.share(described.file.dataset.images):
        images = scene_images(described.file, described.base, scene, threads)
        try:
            first = next(images)
        except (ScenarioError, PlacementError) as error:
            raise ScenarioError(faults_together(error, described.file, path)) from None
        yield as_item(first)
        for one in images:
            yield as_item(one)


def as_item(one: SceneImage) -> dict[str, Any]:
    """An image as a dictionary of arrays."""
    image = one.labelled
    return {
        "image": image.image, "expected": image.expected, "classes": image.classes, "instances": image.instances,
        "class_names": image.class_names.names,
        "targets": image.instance_names, "name": image.name, "twin": one.twin, "drawn": one.drawn,
        "scenario": one.scenario,
    }  # fmt: skip
