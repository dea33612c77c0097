"""Contact sheet: some images of a data set with their masks, on one page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from insonify.annotations import CLASSES, LabelledImage
from insonify.datasets.dataset import load_dataset
from insonify.datasets.rendered_scene import SceneImage, scene_images

COLOURS = {"highlight": "#ffd23f", "shadow": "#3ec7ff", "ghost": "#ff5fa2"}
"""Colour of the outline of each class."""
ACROSS = 4
"""Images side by side, at most [1]."""


def write_contact_sheet(file: str | Path, path: str | Path, count: int) -> Path:
    """Simulate the first scenes of a data set and draw their images.

    Args:
        file: File of the data set.
        path: Picture to write.
        count: Number of images.

    Returns:
        The path.
    """
    described = load_dataset(file)
    images = list[SceneImage]()
    for scene in range(described.file.dataset.images):
        images += scene_images(described.file, described.base, scene, None)
        if len(images) >= count:
            break
    from matplotlib.figure import Figure

    images = images[:count]
    across = min(ACROSS, len(images))
    down = -(-len(images) // across)
    figure = Figure(figsize=(3.4 * across, 3.3 * down + 0.7), layout="constrained")
    axes = np.atleast_1d(figure.subplots(down, across, squeeze=False)).ravel()
    for one, place in zip(images, axes, strict=False):
        shown = _draw(place, one.labelled)
    for place in axes[len(images) :]:
        place.set_axis_off()
    figure.colorbar(shown, ax=axes.tolist(), shrink=0.5, label="level re the median of the image [dB]")
    handles = [_handle(colour, name) for name, colour in COLOURS.items()]
    figure.legend(handles=handles, loc="outside upper right", ncols=len(handles), frameon=False)
    figure.suptitle(described.base.title or Path(file).stem, x=0.01, ha="left")
    figure.savefig(path, dpi=110)
    return Path(path)


def _handle(colour: str, name: str) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], color=colour, label=name)


def _draw(place: Any, image: LabelledImage) -> Any:
    """Draw one image with the outlines of its masks, and the labels of its targets."""
    rows, columns = image.rows.values, image.columns.values
    extent = (columns[0], columns[-1], rows[-1], rows[0])
    level = image.image - np.nanmedian(image.image)
    shown = place.imshow(
        level, cmap="gray", vmin=-15, vmax=20, extent=extent, aspect="auto", interpolation="antialiased"
    )
    for name, layer in zip(CLASSES, image.layers, strict=True):
        if (layer > 0).any():
            place.contour(columns, rows, layer > 0, [0.5], colors=COLOURS[name], linewidths=0.7)
    for number, label in enumerate(image.instance_names, 1):
        at = np.argwhere((image.layers == number).any(axis=0))
        if len(at):
            row, column = at[0]
            place.annotate(label, (columns[column], rows[row]), xytext=(3, 4), textcoords="offset points",
                           color="white", fontsize=6)  # fmt: skip
    place.set_title(image.name, fontsize=8, loc="left", pad=2)
    place.set_xlabel(f"{image.columns.name} [{image.columns.units}]", fontsize=7)
    place.set_ylabel(f"{image.rows.name} [{image.rows.units}]", fontsize=7)
    place.tick_params(labelsize=6)
    return shown
