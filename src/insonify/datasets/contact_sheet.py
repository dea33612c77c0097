"""Contact sheet: some images of a data set with their masks, on one page."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from matplotlib.patches import Patch

from insonify.annotations import CLASSES, LabelledImage
from insonify.datasets.dataset import load_dataset
from insonify.datasets.rendered_scene import SceneImage, scene_images
from insonify.plotting import style
from insonify.plotting.labels import KINDS

ACROSS = 4
"""Images side by side, at most [1]."""
TITLE_WIDTH = 36
"""Letters of a line of an image's title [1]."""


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
    images = images[:count]
    across = min(ACROSS, len(images))
    down = -(-len(images) // across)
    with style.plot_style():
        figure = style.new_figure(3.4 * across, 3.3 * down + 0.7)
        panels = np.atleast_1d(figure.subplots(down, across, squeeze=False)).ravel()
        for one, axes in zip(images, panels, strict=False):
            shown = _draw(axes, one.labelled)
        for axes in panels[len(images) :]:
            axes.set_axis_off()
        bar = figure.colorbar(shown, ax=panels.tolist(), shrink=0.8 if down == 1 else 0.5)
        bar.set_label("level re the median of the image [dB]", fontsize=7)
        bar.ax.tick_params(labelsize=6)
        handles = [Patch(color=KINDS[name], label=name) for name in CLASSES]
        figure.legend(handles=handles, loc="outside upper right", ncols=len(handles))
        figure.suptitle(described.base.title or Path(file).stem, x=0.01, ha="left")
        return style.save_figure(figure, path)


def _draw(axes: Axes, image: LabelledImage) -> AxesImage:
    """Draw one image with the outlines of its masks, and the labels of its targets."""
    rows, columns = image.rows.in_degrees.values, image.columns.in_degrees.values
    extent = (columns[0], columns[-1], rows[-1], rows[0])
    axes.grid(False)
    level = image.image - np.nanmedian(image.image)
    aspect: Literal["equal", "auto"] = "equal" if image.projection == "mosaic" else "auto"
    shown = axes.imshow(
        level, cmap="gray", vmin=-15, vmax=20, extent=extent, aspect=aspect, interpolation="antialiased"
    )
    for name, layer in zip(CLASSES, image.layers, strict=True):
        if (layer > 0).any():
            axes.contour(columns, rows, layer > 0, [0.5], colors=KINDS[name], linewidths=0.9)
    for number, label in enumerate(image.instance_names, 1):
        at = np.argwhere((image.layers == number).any(axis=0))
        if len(at):
            row, column = at[0]
            axes.annotate(label, (columns[column], rows[row]), xytext=(3, 4), textcoords="offset points",
                           color="white", fontsize=6)  # fmt: skip
    axes.set_title(fill(image.name.replace("_", " "), TITLE_WIDTH), fontsize=8, loc="left", pad=2)
    axes.set_xlabel(image.columns.in_degrees.label, fontsize=7)
    axes.set_ylabel(image.rows.in_degrees.label, fontsize=7)
    axes.tick_params(labelsize=6)
    return shown
