"""Claims about pictures of annotations: boxes and names over the image, on axes with units."""

import numpy as np
import pytest

from insonify.annotations.annotation import annotations
from insonify.annotations.overlay import draw_annotations
from oracles.labelled import labelled_image


@pytest.mark.parametrize("targets", [0, 3])
def test_each_annotation_has_a_box_on_the_axes(tmp_path, monkeypatch, targets):
    """Boxes enclose their masks in the units of the axes; the image beside them has none; names are the targets'."""
    drawn = []
    monkeypatch.setattr("insonify.plotting.style.save_figure", lambda figure, path: drawn.append(figure) or path)
    image = labelled_image(4, targets=targets)
    draw_annotations(image, tmp_path / "a.png")
    left, right = drawn[0].axes
    found = list(annotations(image))
    assert len(left.patches) == 0 and len(right.patches) == len(found)
    assert left.get_xlabel() == "slant range [m]" and left.get_ylabel() == "distance along the track [m]"
    for part, patch in zip(found, right.patches, strict=True):
        rows, columns = np.nonzero(part.mask(image.image.shape))
        low, high = patch.get_bbox().min, patch.get_bbox().max
        assert low[0] < image.columns.values[columns].min() <= image.columns.values[columns].max() < high[0]
        assert low[1] < image.rows.values[rows].min() <= image.rows.values[rows].max() < high[1]
    assert {text.get_text() for text in right.texts} <= set(image.instance_names)
    words = {text.get_text() for text in drawn[0].legends[0].get_texts()}
    assert words == ({"highlight", "shadow", "ghost"} if targets else {"no targets"})


def test_a_picture_is_written(tmp_path):
    """The file named, with something in it."""
    assert draw_annotations(labelled_image(1), tmp_path / "a.png").stat().st_size > 10_000
