"""Labels: ground truth of each sample of a recording, known from the simulation.

Each arrival carries its object and its path, and each occluded leg its occluder. So every sample has an expected
intensity by object and by pair of families, and masks that follow from them: highlight, shadow, ghost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from insonify.scene.scatterers import BOUNDARY_ECHO

if TYPE_CHECKING:
    import xarray as xr

NO_ROW = 255
"""Row of the object, or of the pair, where nothing is received or nothing is occluded."""
SURROUNDINGS = ("seabed", "surface", "water", BOUNDARY_ECHO)
"""Objects that are no target."""

PER_SAMPLE = ("ping", "channel", "time")
COLUMNS: dict[str, tuple[tuple[str, ...], type, str, str]] = {
    "expected_intensity": (PER_SAMPLE, np.float32, "uPa^2", "expected mean-square pressure, free of noise and speckle"),
    "object_intensity": (("ping", "channel", "object", "time"), np.float32, "uPa^2", "contribution of each object"),
    "pair_intensity": (
        ("ping", "channel", "pair", "time"), np.float32, "uPa^2",
        "by each pair of families alone, of all objects; interference between pairs is not included",
    ),
    "strongest_object": (PER_SAMPLE, np.uint8, "1", "row of the strongest object, 255 where nothing is received"),
    "strongest_pair": (PER_SAMPLE, np.uint8, "1", "row of the strongest pair of families, 255 for none"),
    "highlight": (
        PER_SAMPLE, np.bool_, "1",
        "most of the intensity is from targets by paths without the surface, no less than is occluded",
    ),
    "shadow": (PER_SAMPLE, np.bool_, "1", "most of the seabed's direct echo is occluded, and no highlight replaces it"),
    "ghost": (PER_SAMPLE, np.bool_, "1", "most of the intensity is from targets by paths that reflect off the surface"),
    "shadowing_object": (PER_SAMPLE, np.uint8, "1", "row of the object that occludes most of a shadow's echo"),
    "position": (
        ("ping", "channel", "time", "axis"), np.float64, "m",
        "north, east, depth of the strongest object's echo by its strongest pair; in a shadow, of the occluded echo",
    ),
    "distance": (PER_SAMPLE, np.float32, "m", "straight distance from the receiver to that position"),
    "grazing": (PER_SAMPLE, np.float32, "rad", "grazing angle at that position, mean of both legs; 0 on a point"),
}  # fmt: skip
"""Dimensions, type, units and long name of the variables of a label dataset."""


@dataclass(frozen=True, slots=True)
class LabelNames:
    """Object and pair axes of a label dataset."""

    objects: tuple[str, ...]
    """Seabed, surface, the water and its patches where they scatter, and every target's label."""
    pairs: tuple[str, ...]
    """Pairs of families, in either order, such as D-S."""


@dataclass(frozen=True, slots=True)
class MaskLabels:
    """Masks and intensities of objects of one ping: variables of `COLUMNS` without the ping axis."""

    expected_intensity: NDArray[np.floating[Any]]
    object_intensity: NDArray[np.floating[Any]]
    strongest_object: NDArray[np.uint8]
    highlight: NDArray[np.bool_]
    shadow: NDArray[np.bool_]
    ghost: NDArray[np.bool_]
    shadowing_object: NDArray[np.uint8]

    def __post_init__(self) -> None:
        """Refuse columns of inconsistent shape."""
        channels, count = self.expected_intensity.shape
        for column in fields(self):
            name, dims, shape = column.name, COLUMNS[column.name][0], getattr(self, column.name).shape
            sizes = {"channel": shape[0], "time": shape[dims.index("time") - 1]}
            if len(shape) != len(dims) - 1 or sizes != {"channel": channels, "time": count}:
                raise ValueError(f"Labels.{name} has shape {shape}; there are {channels} channels, {count} samples")


@dataclass(frozen=True, slots=True)
class Labels(MaskLabels):
    """Labels of one ping: all variables of `COLUMNS` without the ping axis."""

    pair_intensity: NDArray[np.floating[Any]]
    strongest_pair: NDArray[np.uint8]
    position: NDArray[np.float64]
    distance: NDArray[np.floating[Any]]
    grazing: NDArray[np.floating[Any]]


AnyLabels = TypeVar("AnyLabels", bound=MaskLabels)


def concatenate_channels(parts: Sequence[AnyLabels]) -> AnyLabels:
    """Labels of several sides of a sonar, joined along the channel axis."""
    if len(parts) == 1:
        return parts[0]
    kind = type(parts[0])
    return kind(*(np.concatenate([getattr(part, column.name) for part in parts]) for column in fields(kind)))


def label_dataset(
    parts: Sequence[MaskLabels], names: LabelNames, time: NDArray[np.float64], pings: NDArray[np.int64]
) -> xr.Dataset:
    """Labels of some pings, with the names of their objects and pairs.

    Args:
        parts: Labels of each ping.
        names: Objects and pairs.
        time: Time of each sample after the start of transmission [s], shape (time,).
        pings: Numbers of the pings.

    Returns:
        The variables of `COLUMNS` that the labels have, each with units and a long name.
    """
    import xarray as xr

    coordinates = {
        "ping": ("ping", pings, {"units": "1", "long_name": "number of the ping"}),
        "time": ("time", time, {"units": "s", "long_name": "time after the start of transmission"}),
    }
    variables: dict[str, Any] = {}
    for name, (dims, dtype, units, meaning) in COLUMNS.items():
        if hasattr(parts[0], name):
            values: NDArray[Any] = np.stack([getattr(part, name) for part in parts]).astype(dtype)
            variables[name] = dims, values, {"units": units, "long_name": meaning}
    return with_names(xr.Dataset(variables, coordinates), names)


def over_pings(labels: xr.Dataset) -> xr.Dataset:
    """Labels over (ping, ...), with the pings that are labelled.

    Args:
        labels: Labels of a recording, as from `insonify.formats.label_store.open_labels`, or of a single ping, as from
            `insonify.labels`.

    Returns:
        The same variables; those of a single ping with a ping axis, and `done` (True: labelled), if they lack them.
    """
    labels = labels if "ping" in labels.dims else labels.expand_dims("ping")
    return labels if "done" in labels else labels.assign(done=("ping", np.ones(labels.sizes["ping"], bool)))


def with_names(dataset: xr.Dataset, names: LabelNames) -> xr.Dataset:
    """A dataset of labels with the names of its objects and pairs as coordinates."""
    return dataset.assign_coords(
        object=("object", list(names.objects), {"units": "1", "long_name": "object that returns the echo"}),
        pair=("pair", list(names.pairs), {"units": "1", "long_name": "families out and back, in either order"}),
        axis=("axis", ["north", "east", "depth"], {"units": "1", "long_name": "axes of the world"}),
    )
