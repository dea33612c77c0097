"""Labelled images of a recording: in slant range, in ground range, or on the mosaic; whole or cut in tiles."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import get_args

import xarray as xr

from insonify.annotations.class_names import ClassNames, ClassScheme, classes_by_label, names_with
from insonify.annotations.labelled_image import LabelledImage, Projection
from insonify.annotations.labelled_pings import LabelledPings, labelled_pings
from insonify.annotations.mosaic import labelled_mosaic
from insonify.annotations.sectors import labelled_sectors
from insonify.annotations.target_views import with_views
from insonify.annotations.waterfalls import labelled_waterfalls, line_spans
from insonify.formats.store_description import StoreError
from insonify.surveys.ground_lines import looks_sideways
from insonify.surveys.survey import Survey, open_survey

Tile = tuple[int, int]
LEAST_TILE = 16
"""Least rows or columns of a tile [1]."""


def labelled_images(
    recording: Survey | xr.Dataset | str | Path, projection: Projection = "slant", tile: Tile | None = None, *,
    labels: xr.Dataset | None = None, gain: str = "tvg30", first_index: int = 0, name: str = "",
    classes: ClassScheme = "parts",
) -> Iterator[LabelledImage]:  # fmt: skip
    """Labelled images of a recording, one at a time.

    A sonar of one beam on each side gives one waterfall, port to the left, the last ping above; a fan of beams gives
    one image per ping over slant range and bearing.

    Args:
        recording: Folder of a recording made with labels, or a recording in memory, or its survey.
        projection: "slant" range; "ground" range, the horizontal distance across the track on the terrain of the scene;
            or "mosaic", the lines of a sidescan on the terrain, north up.
        tile: Rows and columns of a tile; None: not cut. Along an edge that they do not divide, the last tile is moved
            inwards and overlaps the one before; a smaller image is left whole. Tiles without any sample are left out.
        labels: Labels of a recording in memory, as from `insonify.formats.label_store.open_labels`.
        gain: Gain of the levels: "none", or one of `insonify.processing.gain.LAWS`, with absorption.
        first_index: Number of the first image in its data set.
        name: Name of the files, without suffix; empty: that of the recording.
        classes: Class of a highlight: "parts", highlight; "shapes", the shape of its target, of one of the library its
            name; "labels", the label of its target.

    Yields:
        The images, by the number of the ping or tile.

    Raises:
        StoreError: The recording has no labels, the projection does not suit its sonar, or a class has two meanings.
    """
    if projection not in get_args(Projection):
        raise StoreError(f"{projection!r} is no projection. Choose one of {', '.join(get_args(Projection))}")
    if tile is not None and min(tile) < LEAST_TILE:
        raise StoreError(f"A tile of {tile[0]} x {tile[1]} is too small. Give at least {LEAST_TILE} x {LEAST_TILE}")
    if classes not in get_args(ClassScheme):
        raise StoreError(f"{classes!r} names no classes. Choose one of {', '.join(get_args(ClassScheme))}")
    source = labelled_pings(open_survey(recording), labels, gain)
    class_names = _class_names(source, classes)
    whole = (replace(image, class_names=class_names) for image in _whole_images(source, projection, tile))
    return _numbered(source, whole, tile, (first_index, name or Path(source.survey.name).stem))


def _class_names(source: LabelledPings, classes: ClassScheme) -> ClassNames:
    """Classes of the targets of a recording."""
    if classes == "parts":
        return ClassNames()
    by_label = classes_by_label(source.survey.scenario, classes)
    try:
        return ClassNames(names_with(by_label.values()), by_label)
    except ValueError as fault:
        raise StoreError(f"{source.survey.name}: {fault}, or choose the classes parts") from None


def _whole_images(source: LabelledPings, projection: Projection, tile: Tile | None) -> Iterator[LabelledImage]:
    """Images that are not cut yet along their columns, nor mosaics along their rows."""
    survey = source.survey
    is_fan = not looks_sideways(survey) and len(survey.recording["steer"]) > 1
    if projection == "mosaic":
        return iter([labelled_mosaic(source)])
    if is_fan and projection == "slant":
        return labelled_sectors(source)
    if is_fan or (projection == "ground" and not looks_sideways(survey)):
        raise StoreError(f"{survey.name}: ground range is that of a sonar that looks to a side, and this one does not. "
                         "Choose the projection slant")  # fmt: skip
    return labelled_waterfalls(source, projection, tile[0] if tile else None)


def _numbered(
    source: LabelledPings, images: Iterator[LabelledImage], tile: Tile | None, first: tuple[int, str]
) -> Iterator[LabelledImage]:
    """Images, or their tiles, with names, numbers and the views of their targets."""
    index, name = first
    for whole in images:
        named = replace(whole, name=name + whole.name, index=index)
        if tile is None:
            yield with_views(source.survey, named)
            index += 1
            continue
        for rows in line_spans(named.image.shape[0], tile[0]):
            for columns in line_spans(named.image.shape[1], tile[1]):
                part = named.part(rows, columns, index)
                index += 1
                if part.has_samples:
                    yield with_views(source.survey, part)
