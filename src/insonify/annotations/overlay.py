"""Picture of a labelled image: its levels, and over them the masks and boxes of its annotations."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from insonify.annotations.annotation import Annotation, annotations
from insonify.annotations.class_names import CLASSES
from insonify.annotations.grey_picture import greys, level_span
from insonify.annotations.labelled_image import LabelledImage
from insonify.plotting import style
from insonify.plotting.labels import KINDS
from insonify.plotting.sector_image import beam_edges

Floats = NDArray[np.float64]

STRENGTH = 0.45
"""Weight of the colour of a mask over that of the level [1]."""
GROW = 2
"""Cells between a mask and the frame drawn around it [1]."""


def draw_annotations(image: LabelledImage, path: str | Path) -> Path:
    """Draw an image, and beside it the same with its masks, boxes and targets.

    Args:
        image: The image.
        path: File of the figure, .png, .pdf or .svg.

    Returns:
        The path.
    """
    with style.plot_style():
        figure = style.new_figure(12, 6.5)
        left, right = figure.subplots(1, 2, sharex=True, sharey=True)
        drawn = list(annotations(image))
        for axes, shown in ((left, []), (right, drawn)):
            _draw(axes, image, shown)
            axes.set_xlabel(image.columns.in_degrees.label)
        left.set(ylabel=image.rows.in_degrees.label, title="image")
        right.set_title("annotations")
        kinds = sorted({part.kind for part in drawn})
        handles = [Patch(color=KINDS[CLASSES[kind - 1]], label=CLASSES[kind - 1]) for kind in kinds]
        figure.legend(handles=handles or [Patch(color="none", label="no targets")], loc="outside lower center", ncols=3)
        return style.save_figure(figure, path)


def _draw(axes: Axes, image: LabelledImage, drawn: list[Annotation]) -> None:
    """Draw levels in grey, annotations over them in colour, and the names of the targets."""
    columns, rows = _edges(image.columns.in_degrees.values), _edges(image.rows.in_degrees.values)
    picture = np.repeat(greys(image.image, level_span(image.image))[..., None] / 255.0, 3, axis=-1)
    for row, name in enumerate(CLASSES):
        mask = np.isin(image.layers[row], [part.instance for part in drawn if part.kind == row + 1])
        picture[mask] = (1 - STRENGTH) * picture[mask] + STRENGTH * np.array(to_rgb(KINDS[name]))
    across, along = np.meshgrid(columns, rows)
    axes.pcolormesh(across, along, picture, rasterized=True)
    axes.grid(False)
    axes.set_facecolor("#303030")
    for part in drawn:
        left, upper, width, height = part.box
        span = np.clip([left - GROW, left + width + GROW], 0, columns.size - 1)
        lines = np.clip([upper - GROW, upper + height + GROW], 0, rows.size - 1)
        (west, east), (top, bottom) = columns[span], rows[lines]
        colour = KINDS[CLASSES[part.kind - 1]]
        axes.add_patch(Rectangle((west, bottom), east - west, top - bottom, fill=False, ec=colour, lw=1.1))
        if part.kind == 1:
            axes.annotate(image.instance_names[part.instance - 1], ((west + east) / 2, top), (0, 3), color=colour,
                          textcoords="offset points", ha="center", va="bottom", fontsize=9)  # fmt: skip


def _edges(middles: Floats) -> Floats:
    """Edges of cells, midway between their middles, shape (n + 1,)."""
    if middles.size < 2:
        return middles[0] + np.array([-0.5, 0.5])
    return beam_edges(middles)
