"""Checks of a data set before any image is simulated: keys, ranges and positions."""

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from insonify.datasets.dataset_classes import dataset_class_names
from insonify.datasets.dataset_file import DatasetFile
from insonify.datasets.distributions import Draw
from insonify.datasets.drawn_scene import SceneDraws, value_at
from insonify.datasets.swath import PlacementError
from insonify.datasets.typed_values import read_typed
from insonify.datasets.varied_keys import UnknownItemError, VariedKey, varied_keys
from insonify.diagnostics.diagnostic import Diagnostic, ScenarioError
from insonify.scenario.changes import with_changes
from insonify.scenario.scenario import Scenario
from insonify.validity import PhysicsWarning

CHECKED_DRAWS = 10_000
"""Images whose draws are searched for the extremes of a distribution without limits."""
SCENES_CHECKED = 20
"""Images whose scenes are drawn as a whole, in search of values that contradict each other."""


def dataset_faults(file: DatasetFile, base: Scenario, path: str | Path) -> list[Diagnostic]:
    """Every fault of a data set that shows without an image: unknown keys, ranges that a key refuses, no room.

    Args:
        file: The data set.
        base: Its scenario.
        path: The file, for messages.
    """
    source, draws = read_typed(path), SceneDraws(file, base)
    faults = list[Diagnostic]()
    for key, draw in file.vary.items():
        line, field = source.line(("vary", key)), f"vary.{key}"
        try:
            varied = varied_keys(base, key)
        except UnknownItemError as error:
            faults.append(Diagnostic(str(path), line, field, str(error)))
            continue
        with warnings.catch_warnings():
            # about scenarios that no image has: one key at a limit, all others as in the base
            warnings.simplefilter("ignore", PhysicsWarning)
            fault = next(filter(None, (_range_fault(draws, one, draw) for one in varied)), None)
        if fault:
            faults.append(Diagnostic(str(path), line, field, fault.problem, fault.allowed, fault.fix))
    pair_faults = {
        "other_speckle": (base.field == "coherent", "speckle is drawn from the expected intensity alone",
                          "Write field: incoherent in the scenario, or leave other_speckle out"),
        "no_multipath": (not base.paths.max_reflections, "without reflections, no_multipath twins are copies",
                         "Write paths: {max_reflections: 1} in the scenario, or leave no_multipath out"),
    }  # fmt: skip
    for pair in file.pairs:
        is_wrong, problem, fix = pair_faults.get(pair, (False, "", ""))
        if is_wrong:
            faults.append(Diagnostic(str(path), source.line(("pairs",)), "pairs", problem, fix=fix))
    if faults:
        return faults
    try:
        dataset_class_names(file, base)
    except ValueError as error:
        return [Diagnostic(str(path), source.line(("dataset", "classes")), "dataset.classes", str(error))]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # which come when the scene is simulated
            for image in range(min(file.dataset.images, SCENES_CHECKED)):
                draws.scene(image)
    except (ScenarioError, PlacementError) as error:
        return faults_together(error, file, path)
    return []


def faults_together(error: ScenarioError | PlacementError, file: DatasetFile, path: str | Path) -> list[Diagnostic]:
    """Faults of values of an image that are allowed alone, and not together.

    Args:
        error: Error of the image's scene.
        file: The data set.
        path: Its file, for messages.
    """
    source = read_typed(path)
    if isinstance(error, ScenarioError):
        line = source.line(("clutter" if file.clutter else "vary",))
        return [replace(fault, file=str(path), line=line) for fault in error.faults]
    line = next((source.line(("vary", key)) for key in file.vary if key in str(error)), source.line(("clutter",)))
    return [Diagnostic(str(path), line, "", str(error))]


def _range_fault(draws: SceneDraws, key: VariedKey, draw: Draw) -> Diagnostic | None:
    """The fault of the values that a key can have, each alone; None where it allows them all."""
    if draw.uniform_in is not None:
        known = value_at(draws.base, key.path)
        is_position = key.path.endswith(".position") and isinstance(known, tuple)
        return None if is_position else Diagnostic("", 0, "", "uniform_in draws a position, and this key is none")
    for value in _extremes(draws, key, draw):
        try:
            with_changes(draws.base, {key.path: value})
        except ScenarioError as error:
            for fault in error.faults:
                if fault.field.startswith(key.path) or key.path.startswith(fault.field):
                    return fault
    return None


def _extremes(draws: SceneDraws, key: VariedKey, draw: Draw) -> list[Any]:
    """Values at the limits of a distribution, and the least, middle and largest of those drawn."""
    if draw.choice is not None:
        return list(draw.extremes)
    images = np.arange(min(draws.file.dataset.images, CHECKED_DRAWS))
    drawn = sorted(draws.values(key.key, draw, images))
    return list(dict.fromkeys([*draw.extremes, drawn[0], drawn[len(drawn) // 2], drawn[-1]]))
