"""Labelled image as a dataset with named axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

    from insonify.annotations import LabelledImage


def labelled_dataset(image: LabelledImage) -> xr.Dataset:
    """Levels, expected levels, classes and instances of an image over its rows and columns."""
    import xarray as xr

    level = {"units": "dB re 1 uPa"}
    names = dict(enumerate(("background", *image.class_names.names)))
    return xr.Dataset(
        {
            "image": (("row", "column"), image.image, level | {"long_name": "recorded level with gain"}),
            "expected": (("row", "column"), image.expected, level | {"long_name": "expected level with gain"}),
            "classes": (("row", "column"), image.classes, {"long_name": str(names)}),
            "instances": (("row", "column"), image.instances, {"long_name": "number of the target, 0 for none"}),
        },
        {
            name: (name, axis.values, {"units": axis.units, "long_name": axis.name})
            for name, axis in (("row", image.rows), ("column", image.columns))
        },
        {"name": image.name, "targets": list(image.instance_names), "projection": image.projection},
    )  # fmt: skip
