"""Labels: what each sample of a recording really is, known only because it was simulated.

An arrival knows its owner and its path, and a leg that was cut knows by whom; so every sample has an expected
intensity by owner and by pair of families, and from these its masks: highlight, shadow, ghost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

NO_ROW = 255
"""Row of the owner, or of the pair, where nothing is heard, or nothing hides."""

PER_SAMPLE = ("ping", "channel", "time")
COLUMNS: dict[str, tuple[tuple[str, ...], type, str, str]] = {
    "expected_intensity": (PER_SAMPLE, np.float32, "uPa^2", "expected mean-square pressure, free of noise and speckle"),
    "object_intensity": (("ping", "channel", "object", "time"), np.float32, "uPa^2", "the part of it from each owner"),
    "pair_intensity": (
        ("ping", "channel", "pair", "time"), np.float32, "uPa^2",
        "by each pair of families alone, of all owners: what they make together may interfere",
    ),
    "strongest_object": (PER_SAMPLE, np.uint8, "1", "row of the owner that is loudest, 255 where nothing is heard"),
    "strongest_pair": (PER_SAMPLE, np.uint8, "1", "row of the pair of families that is loudest, 255 for none"),
    "highlight": (
        PER_SAMPLE, np.bool_, "1", "targets, by paths without the surface, make most of what is heard, no less than is cut"
    ),
    "shadow": (PER_SAMPLE, np.bool_, "1", "most of the seabed's direct echo is cut, and no highlight is there instead"),
    "ghost": (PER_SAMPLE, np.bool_, "1", "targets, by paths that met the surface, make most of what is heard"),
    "shadowing_object": (PER_SAMPLE, np.uint8, "1", "row of the owner that cuts most of a shadow's echo, 255 outside shadows"),
    "position": (
        ("ping", "channel", "time", "axis"), np.float64, "m",
        "north, east, depth of what is heard, the strongest owner by its strongest pair; in a shadow, of what is not",
    ),
    "distance": (PER_SAMPLE, np.float32, "m", "from the receiver straight to that place"),
    "grazing": (PER_SAMPLE, np.float32, "rad", "grazing angle there, mean of both legs; 0 on a point target"),
}  # fmt: skip
"""Dimensions, type, units and long name of what labels hold."""


@dataclass(frozen=True, slots=True)
class LabelNames:
    """The axes of labels that are not those of the recording."""

    objects: tuple[str, ...]
    """Seabed, surface, the water and its patches where they answer, and every target's label."""
    pairs: tuple[str, ...]
    """Pairs of families, in either order, such as D-S."""


@dataclass(frozen=True, slots=True)
class Labels:
    """Labels of one ping, as `COLUMNS` says, without the ping's axis."""

    expected_intensity: NDArray[np.floating[Any]]
    object_intensity: NDArray[np.floating[Any]]
    pair_intensity: NDArray[np.floating[Any]]
    strongest_object: NDArray[np.uint8]
    strongest_pair: NDArray[np.uint8]
    highlight: NDArray[np.bool_]
    shadow: NDArray[np.bool_]
    ghost: NDArray[np.bool_]
    shadowing_object: NDArray[np.uint8]
    position: NDArray[np.float64]
    distance: NDArray[np.floating[Any]]
    grazing: NDArray[np.floating[Any]]

    def __post_init__(self) -> None:
        """Refuse columns that do not go together."""
        channels, count = self.expected_intensity.shape
        for name, (dims, *_) in COLUMNS.items():
            shape = getattr(self, name).shape
            told = {"channel": shape[0], "time": shape[dims.index("time") - 1]}
            if len(shape) != len(dims) - 1 or told != {"channel": channels, "time": count}:
                raise ValueError(f"Labels.{name} has shape {shape}; there are {channels} channels, {count} samples")


def concatenate_channels(parts: Sequence[Labels]) -> Labels:
    """The labels of several sides of a sonar as those of all their channels."""
    return Labels(*(np.concatenate([getattr(part, column.name) for part in parts]) for column in fields(Labels)))


def label_dataset(
    parts: Sequence[Labels], names: LabelNames, time: NDArray[np.float64], pings: NDArray[np.int64]
) -> xr.Dataset:
    """Labels of some pings, with the names of their owners and pairs.

    Args:
        parts: Labels of each ping.
        names: Owners and pairs.
        time: Of the samples after the start of transmission [s], shape (time,).
        pings: Numbers of the pings.

    Returns:
        The variables of `COLUMNS`, each with units and a long name.
    """
    import xarray as xr

    held = xr.Dataset(
        {
            name: (
                dims,
                np.stack([getattr(part, name) for part in parts]).astype(dtype),
                {"units": units, "long_name": meaning},
            )
            for name, (dims, dtype, units, meaning) in COLUMNS.items()
        },
        coords={
            "ping": ("ping", pings, {"units": "1", "long_name": "number of the ping"}),
            "time": ("time", time, {"units": "s", "long_name": "time after the start of transmission"}),
        },
    )
    return with_names(held, names)


def with_names(held: xr.Dataset, names: LabelNames) -> xr.Dataset:
    """A dataset of labels with the names of its owners and pairs beside it."""
    return held.assign_coords(
        object=("object", list(names.objects), {"units": "1", "long_name": "whose echoes"}),
        pair=("pair", list(names.pairs), {"units": "1", "long_name": "families out and back, in either order"}),
        axis=("axis", ["north", "east", "depth"], {"units": "1", "long_name": "axes of the world"}),
    )
