"""Contact sheet of a data set: its texts are of one size."""

from types import SimpleNamespace

import numpy as np
import pytest

from insonify.datasets import contact_sheet


@pytest.mark.parametrize("count", [1, 2, 12])
def test_the_label_of_the_colour_bar_is_as_large_as_others_and_no_longer_than_the_bar(count, monkeypatch):
    """For one image, one row and three rows."""
    axis = SimpleNamespace(in_degrees=SimpleNamespace(values=np.arange(9.0), label="slant range [m]"))
    labelled = SimpleNamespace(
        rows=axis, columns=axis, image=np.zeros((9, 9)), projection="slant", name="scene", instance_names=(),
        layers=np.zeros((3, 9, 9), int),
    )  # fmt: skip
    described = SimpleNamespace(
        file=SimpleNamespace(dataset=SimpleNamespace(images=count)), base=SimpleNamespace(title="")
    )
    monkeypatch.setattr(contact_sheet, "load_dataset", lambda file: described)
    monkeypatch.setattr(contact_sheet, "scene_images", lambda *scene: [SimpleNamespace(labelled=labelled)])
    monkeypatch.setattr(contact_sheet.style, "save_figure", lambda figure, path: figure)
    figure = contact_sheet.write_contact_sheet("dataset.yaml", "sheet.png", count)
    figure.draw_without_rendering()
    bar = figure.axes[-1]
    assert bar.yaxis.label.get_size() == figure.axes[0].yaxis.label.get_size()
    assert bar.yaxis.label.get_window_extent().height < bar.get_window_extent().height
