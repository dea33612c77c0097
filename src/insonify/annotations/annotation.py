"""Annotations of an image: the mask of each target, of its shadow and of its ghost."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.annotations.labelled_image import CLASSES, LabelledImage

Mask = NDArray[np.bool_]
INSTANCES = 1 << 10
"""Instances of an image between the numbers of its annotations and those of the next image [1]."""


class Annotation(NamedTuple):
    """Mask of one class of one target in an image."""

    number: int
    """Number in the data set, from 1."""
    kind: int
    """Number of the class, from 1."""
    instance: int
    """Number of the target, from 1."""
    mask: Mask
    """Cells of the mask, of the shape of the image."""

    @property
    def box(self) -> tuple[int, int, int, int]:
        """Left column, upper row, width and height in cells."""
        rows, columns = (np.flatnonzero(self.mask.any(axis=axis)) for axis in (1, 0))
        left, upper = int(columns[0]), int(rows[0])
        return left, upper, int(columns[-1]) + 1 - left, int(rows[-1]) + 1 - upper


def annotations(image: LabelledImage, least_area: int = 1) -> Iterator[Annotation]:
    """Annotations of an image, by target and class.

    Their numbers depend on the number of the image, the target and the class alone, so that data sets made in parts
    have the numbers of one made at once. Shadows of the seabed's own relief have no target and no annotation.

    Args:
        image: The image.
        least_area: Least area of a mask [cells].
    """
    for instance in np.unique(image.layers[image.layers > 0]).tolist():
        for row in range(len(CLASSES)):
            mask = image.layers[row] == instance
            if np.count_nonzero(mask) >= max(least_area, 1):
                number = (image.index * INSTANCES + instance) * len(CLASSES) + row + 1
                yield Annotation(number, row + 1, instance, mask)


def about(image: LabelledImage, annotation: Annotation) -> dict[str, Any]:
    """Name of the target of an annotation, and the view that the sonar has of it."""
    return {"target": image.instance_names[annotation.instance - 1], **image.views.get(annotation.instance, {})}
