"""Labelled image: levels on a grid, with the targets, shadows and ghosts in each cell."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray

from insonify.annotations.class_names import CLASSES, ClassNames

Floats = NDArray[np.float64]
Levels = NDArray[np.float32]
Projection = Literal["slant", "ground", "mosaic"]
STRENGTH = (0, 2, 1)
"""Rows of the classes from the one that a label map shows on top: a ghost over a shadow is what is received there."""
NO_TARGET = -1
"""Instance of a shadow that no target casts, but the seabed's own relief."""


@dataclass(frozen=True, slots=True)
class ImageAxis:
    """Rows or columns of an image."""

    name: str
    """Name, such as slant range."""
    units: str
    """Units of the values."""
    values: Floats
    """Values in the middle of the rows or columns, shape (n,); negative to port."""

    @property
    def in_degrees(self) -> Self:
        """The axis with angles in degrees, as figures show them; other axes as they are."""
        return replace(self, units="deg", values=np.degrees(self.values)) if self.units == "rad" else self

    @property
    def label(self) -> str:
        """Name and units, as on a figure."""
        return f"{self.name} [{self.units}]"


@dataclass(frozen=True, slots=True)
class LabelledImage:
    """Image of r rows and c columns, with masks of each class and the target that each cell of a mask belongs to."""

    index: int
    """Number of the image in its data set, from which the numbers of its annotations follow."""
    name: str
    """Name of its file, without suffix."""
    projection: Projection
    """Grid: "slant" range, "ground" range or "mosaic"."""
    image: Levels
    """Recorded level with gain [dB], shape (r, c); NaN where nothing was recorded."""
    expected: Levels
    """The same of the expected intensity, free of noise and speckle [dB], shape (r, c)."""
    layers: NDArray[np.int32]
    """Instance in the mask of each of `CLASSES`, shape (3, r, c): 0 outside of the mask, otherwise the number of the
    target in `instance_names`, from 1, or `NO_TARGET`."""
    instance_names: tuple[str, ...]
    """Labels of the targets, in the scenario's order: instance k is `instance_names[k - 1]`."""
    rows: ImageAxis
    """Axis of the rows, from the top."""
    columns: ImageAxis
    """Axis of the columns, from the left."""
    offset: tuple[int, int] = (0, 0)
    """First row and column in the whole image that the image is a tile of."""
    pings: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    """Number of the ping of each row, shape (r,); of the image, shape (1,); none of a mosaic."""
    views: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)
    """Range, aspect and so on of the targets in the image, by instance."""
    conditions: Mapping[str, Any] = field(default_factory=dict)
    """Sediment, frequency, altitude and so on of the image."""
    class_names: ClassNames = field(default_factory=ClassNames)
    """Names of the classes, and the class of the highlight of each target."""
    crs: str = ""
    """Coordinate system of a mosaic, whose rows are northings and columns eastings; empty for none."""

    def __post_init__(self) -> None:
        """Refuse arrays of inconsistent shape, unknown projections and unknown instances."""
        if self.projection not in get_args(Projection):
            raise ValueError(f"projection is {self.projection!r}; choose one of {', '.join(get_args(Projection))}")
        shape = self.rows.values.size, self.columns.values.size
        shapes = {"image": shape, "expected": shape, "layers": (len(CLASSES), *shape)}
        for name, needed in shapes.items():
            if getattr(self, name).shape != needed:
                raise ValueError(f"LabelledImage.{name} has shape {getattr(self, name).shape}; its axes have {needed}")
        low, high = (int(f(self.layers, initial=0)) for f in (np.min, np.max))
        if low < NO_TARGET or high > len(self.instance_names):
            raise ValueError(f"LabelledImage.layers has instances {low} to {high}; there are "
                             f"{len(self.instance_names)} targets")  # fmt: skip
        if self.index < 0:
            raise ValueError(f"LabelledImage.index is {self.index}; count images from 0")

    @property
    def classes(self) -> NDArray[np.uint8]:
        """Number of the strongest class of each cell in `class_names`, from 1, shape (r, c); 0 for the background."""
        masks = [self.layers[row] != 0 for row in STRENGTH]
        return np.select(masks, [self._class_layer(row) for row in STRENGTH]).astype(np.uint8)

    def class_number(self, row: int, instance: int) -> int:
        """Number of the class of one layer of a target, from 1.

        Args:
            row: Row of the layer.
            instance: Number of the target, from 1, or `NO_TARGET`.
        """
        return self.class_names.number(row, self.instance_names[instance - 1] if instance > 0 else "")

    def _class_layer(self, row: int) -> NDArray[np.int64]:
        """Number of the class of each cell of a layer, shape (r, c); 0 outside of the mask."""
        instances, cells = np.unique(self.layers[row], return_inverse=True)
        numbers = [self.class_number(row, instance) if instance else 0 for instance in instances.tolist()]
        return np.array(numbers, np.int64)[cells.reshape(self.layers[row].shape)]

    @property
    def instances(self) -> NDArray[np.int32]:
        """Instance of the strongest class of each cell, shape (r, c); 0 where it is no target's."""
        masks = [self.layers[row] != 0 for row in STRENGTH]
        return np.asarray(np.select(masks, [np.maximum(self.layers[row], 0) for row in STRENGTH]), np.int32)

    @property
    def transform(self) -> tuple[float, float, float, float, float, float]:
        """Affine transform from column and row to easting and northing of a mosaic."""
        pixel = float(self.columns.values[1] - self.columns.values[0])
        return pixel, 0.0, self.columns.values[0] - pixel / 2, 0.0, -pixel, self.rows.values[0] + pixel / 2

    @property
    def has_samples(self) -> bool:
        """True where any cell holds a sample."""
        return bool((~np.isnan(self.image)).any())

    def part(self, rows: slice, columns: slice, index: int) -> Self:
        """Tile of the image with the name of its position and a number of its own.

        Args:
            rows: Its rows, with start and stop.
            columns: Its columns, with start and stop.
            index: Its number in the data set.
        """
        pings = self.pings[rows] if self.pings.size == self.rows.values.size else self.pings
        offset = self.offset[0] + rows.start, self.offset[1] + columns.start
        return replace(
            self, index=index, name=f"{self.name}_row{offset[0]:05d}_column{offset[1]:05d}", offset=offset, pings=pings,
            image=self.image[rows, columns], expected=self.expected[rows, columns],
            layers=self.layers[:, rows, columns], rows=replace(self.rows, values=self.rows.values[rows]),
            columns=replace(self.columns, values=self.columns.values[columns]),
        )  # fmt: skip
