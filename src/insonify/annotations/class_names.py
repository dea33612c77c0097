"""Classes of annotations: highlight, shadow and ghost, or for highlights the shapes or labels of their targets."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from insonify.scenario.scenario import Scenario
from insonify.scene.target import shape_name

ClassScheme = Literal["parts", "shapes", "labels"]
CLASSES: tuple[str, ...] = ("highlight", "shadow", "ghost")
"""Parts of a target in an image; without other names the classes, whose numbers in label maps and in COCO count from 1,
in YOLO from 0."""
MOST_CLASSES = 255
"""Most classes that a label map of 8 bits has without the background [1]."""


@dataclass(frozen=True, slots=True)
class ClassNames:
    """Names of the classes of a data set, and the class of the highlight of each target of an image."""

    names: tuple[str, ...] = CLASSES
    """Names in the order of their numbers, the same for all images of a data set."""
    of_label: Mapping[str, str] = field(default_factory=dict)
    """Class of a target's highlight by the label of the target; none where all highlights are one class."""

    def number(self, part: int, label: str) -> int:
        """Number of the class of a part of a target, from 1.

        Args:
            part: Row of the part in `CLASSES`.
            label: Label of the target.
        """
        name = self.of_label.get(label, CLASSES[part]) if part == 0 else CLASSES[part]
        return self.names.index(name) + 1


def names_with(classes: Iterable[str]) -> tuple[str, ...]:
    """Names of all classes where highlights have those of their targets: these, then shadow and ghost.

    Args:
        classes: Classes of targets, in their order; some may be there twice.

    Raises:
        ValueError: One of them has another meaning, or there are too many.
    """
    own = tuple(dict.fromkeys(classes))
    if taken := [name for name in ("background", *CLASSES) if name in own]:
        raise ValueError(f"{taken[0]!r} is a target's label, and a class of its own. Give the target another label")
    if len(own) > MOST_CLASSES - 2:
        raise ValueError(
            f"{len(own)} classes of targets are too many (up to {MOST_CLASSES - 2}). Write shapes, or parts"
        )
    return (*own, *CLASSES[1:])


def classes_by_label(scenario: Scenario, scheme: ClassScheme) -> dict[str, str]:
    """Class of the highlight of each target of a scenario, and of each patch in its water, by label.

    Args:
        scenario: The scenario.
        scheme: "shapes": names of shapes; "labels": labels, which patches have in any case; "parts": none.
    """
    if scheme == "parts":
        return {}
    of_patches = {patch.label: patch.label for patch in scenario.water.patches}
    is_shape = scheme == "shapes"
    of_targets = {target.label: shape_name(target) if is_shape else target.label for target in scenario.targets}
    return of_targets | of_patches
