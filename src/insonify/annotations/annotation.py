"""Annotations of an image: masks of each target, of its shadow and of its ghosts, in parts that lie together."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from insonify.annotations.class_names import CLASSES
from insonify.annotations.labelled_image import STRENGTH, LabelledImage
from insonify.units import intensity_ratio

Mask = NDArray[np.bool_]
GAP = 8
"""Distance to which parts of a mask are one annotation; further away it is another sighting or ghost [cells]."""
AROUND = 16
"""Width of the surroundings that the contrast of a mask refers to [cells]."""
NUMBERS = 1 << 16
"""Distance of the numbers of the annotations of one image and of the next [1]."""


class Annotation(NamedTuple):
    """Mask of one class of one target in an image, or a part of it far from the others."""

    number: int
    """Number in the data set, from 1."""
    kind: int
    """Number of the class, from 1."""
    instance: int
    """Number of the target, from 1."""
    corner: tuple[int, int]
    """Upper row and left column of its box."""
    inside: Mask
    """Cells of the mask in its box, shape (height, width)."""

    @property
    def box(self) -> tuple[int, int, int, int]:
        """Left column, upper row, width and height in cells."""
        return self.corner[1], self.corner[0], self.inside.shape[1], self.inside.shape[0]

    @property
    def area(self) -> int:
        """Cells of the mask."""
        return int(np.count_nonzero(self.inside))

    def mask(self, shape: tuple[int, ...]) -> Mask:
        """Mask over an image.

        Args:
            shape: Rows and columns of the image.
        """
        whole = np.zeros(shape, bool)
        whole[self.corner[0] :, self.corner[1] :][: self.inside.shape[0], : self.inside.shape[1]] = self.inside
        return whole


def annotations(image: LabelledImage, least_area: int = 1) -> Iterator[Annotation]:
    """Annotations of an image, by target, class and position.

    Their numbers follow from the number of the image and their order in it alone, so that data sets made in parts have
    the numbers of one made at once. Shadows of the seabed's own relief have no target and no annotation.

    Args:
        image: The image.
        least_area: Least area of a mask [cells].
    """
    number = image.index * NUMBERS
    for instance in np.unique(image.layers[image.layers > 0]).tolist():
        for row in range(len(CLASSES)):
            for corner, inside in _parts(image.layers[row] == instance):
                if np.count_nonzero(inside) >= least_area:
                    number += 1
                    yield Annotation(number, row + 1, instance, corner, inside)


def _parts(mask: Mask) -> Iterator[tuple[tuple[int, int], Mask]]:
    """Upper row and left column, and cells, of each part of a mask, parts no more than `GAP` cells apart joined."""
    box = _box(mask)
    if box is None:
        return
    inside = mask[box]
    padded = np.pad(inside, GAP // 2)
    joined, count = ndimage.label(ndimage.maximum_filter(padded, GAP + 1), np.ones((3, 3)))
    joined = joined[GAP // 2 :, GAP // 2 :][: inside.shape[0], : inside.shape[1]]
    for part in range(1, count + 1):
        cells = inside & (joined == part)
        bounds = _box(cells)
        assert bounds is not None
        yield (box[0].start + bounds[0].start, box[1].start + bounds[1].start), cells[bounds]


def _box(mask: Mask) -> tuple[slice, slice] | None:
    """Rows and columns of the cells of a mask; None without any."""
    spans = [np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0)]
    if not spans[0].size:
        return None
    rows, columns = (slice(int(span[0]), int(span[-1]) + 1) for span in spans)
    return rows, columns


def about(image: LabelledImage, annotation: Annotation) -> dict[str, Any]:
    """Name of the target of an annotation, its contrast, and the view that the sonar has of it.

    Args:
        image: The image.
        annotation: One of its annotations.

    Returns:
        Fields by name; `contrast_db` is the mean expected intensity of the mask, where no stronger class lies over it,
        re that of the cells around it without any mask, None without either.
    """
    name = image.instance_names[annotation.instance - 1]
    contrast = _contrast_db(image, annotation)
    return {"target": name, "contrast_db": contrast, **image.views.get(annotation.instance, {})}


def _contrast_db(image: LabelledImage, annotation: Annotation) -> float | None:
    left, upper, width, height = annotation.box
    rows = slice(max(upper - AROUND, 0), upper + height + AROUND)
    columns = slice(max(left - AROUND, 0), left + width + AROUND)
    power = intensity_ratio(image.expected[rows, columns])
    bare = (image.layers[:, rows, columns] == 0).all(axis=0) & np.isfinite(power)
    box = slice(upper, upper + height), slice(left, left + width)
    stronger = [image.layers[row][box] != 0 for row in STRENGTH[: STRENGTH.index(annotation.kind - 1)]]
    shown = annotation.inside & ~np.any([np.zeros_like(annotation.inside), *stronger], axis=0)
    own = intensity_ratio(image.expected[box][shown])
    means = [float(np.mean(cells)) if cells.size else 0.0 for cells in (own[np.isfinite(own)], power[bare])]
    return round(10 * float(np.log10(means[0] / means[1])), 2) if min(means) > 0 else None
