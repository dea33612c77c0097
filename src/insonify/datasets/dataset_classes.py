"""Classes of the annotations of a data set: the same names in all images, whatever varies."""

import re
from collections.abc import Iterator
from typing import Any

from insonify.annotations import CLASSES, ClassNames, classes_by_label, names_with
from insonify.datasets.dataset_file import DatasetFile, typed_label, typed_shape
from insonify.datasets.varied_keys import varied_keys
from insonify.scenario.scenario import Scenario

_ITEMS = re.compile(r"water|(targets|water\.patches)(\.\d+)?")
"""Paths of whole targets and patches."""
_NAMES = re.compile(r"(targets|water\.patches)\.\d+\.(name|label)")
"""Paths of the keys that name them."""


def dataset_class_names(file: DatasetFile, base: Scenario) -> tuple[str, ...]:
    """Names of the classes of a data set, in the order of their numbers.

    Targets come first, in the order of the scenario, then those that a distribution may put in their place, clutter,
    and shadow and ghost.

    Args:
        file: The data set.
        base: Its scenario.

    Raises:
        ValueError: A class of targets has another meaning, or there are too many.
    """
    scheme = file.dataset.classes
    if scheme == "parts":
        return CLASSES
    names = [*classes_by_label(base, scheme).values(), *_drawn_classes(file, base)]
    for clutter in file.clutter:
        names += clutter.shapes if scheme == "shapes" else [clutter.label]
    return names_with(names)


def scene_class_names(file: DatasetFile, base: Scenario, scenario: Scenario, drawn: dict[str, Any]) -> ClassNames:
    """Classes of the images of one scene.

    Args:
        file: The data set.
        base: Its scenario.
        scenario: Scenario of the scene, with clutter after the other targets.
        drawn: Values that were drawn for it, by key.
    """
    by_label = classes_by_label(scenario, file.dataset.classes)
    if file.dataset.classes == "labels":
        labels = [one.label for kind, one in enumerate(file.clutter) for _ in drawn[f"clutter[{kind}]"]]
        clutter = scenario.targets[len(scenario.targets) - len(labels) :]
        by_label |= {target.label: label for target, label in zip(clutter, labels, strict=True)}
    return ClassNames(dataset_class_names(file, base), by_label)


def _drawn_classes(file: DatasetFile, base: Scenario) -> Iterator[str]:
    """Classes that distributions may give to targets and to patches in the water."""
    keys = [(one.path, draw) for key, draw in file.vary.items() if draw.choice for one in varied_keys(base, key)]
    of = typed_shape if file.dataset.classes == "shapes" else typed_label
    for path, draw in keys:
        last = path.rpartition(".")[2]
        for value in draw.extremes:
            if _ITEMS.fullmatch(path):
                inner = value.get("patches", ()) if path == "water" else value
                for item in inner if isinstance(inner, list | tuple) else (inner,):
                    yield of(item) or item.get("label", "patch")
            elif _NAMES.fullmatch(path) and (last == "label") == (file.dataset.classes == "labels"):
                yield str(value)
