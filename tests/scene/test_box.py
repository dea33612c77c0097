"""A box as drawn points on its faces."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.scene.box import box_body, box_scatterers
from insonify.scene.target import Box
from oracles.water import Block

sizes = st.floats(0.2, 5)


@given(sizes, sizes, sizes, st.floats(0, 6.28), st.floats(-500, 500))
def test_the_points_of_a_box_lie_on_its_faces_and_share_their_area(length, width, height, heading, north):
    """Five faces: 2 (length + width) height + length width; every point on one face, its normal outward."""
    box = Box(position=(north, 60.0), size=(length, width, height), heading=heading)
    points = box_scatterers(box, 20.0, 1, 0.3, 0)
    block = Block((north, 60.0), heading, (length / 2, width / 2), 20.0 - height, 20.0)
    assert points.area.sum() == pytest.approx(2 * (length + width) * height + length * width)
    inside = np.abs(block.within(points.position))
    np.testing.assert_allclose(inside.max(axis=1), 1, atol=1e-9)
    assert np.all(np.sort(inside, axis=1)[:, 1] < 1)
    outward = np.abs(block.within(points.position + 1e-3 * points.normal)).max(axis=1)
    assert np.all(outward > 1)
    assert len(np.unique(points.scatterer_id)) == len(points)
    np.testing.assert_allclose(np.abs(points.phase), 1)


def test_a_cell_of_a_face_is_no_larger_than_requested():
    """Each point stands for at most the square of the pitch."""
    points = box_scatterers(Box(position=(0, 60), size=(2, 1, 1)), 20.0, 1, 0.05, 0)
    assert points.area.max() <= 0.05**2 * (1 + 1e-9)


def test_a_boxs_scatterers_belong_to_its_label():
    """The same label and seed draw the same points wherever the box stands; another label draws others."""
    here, there = (box_scatterers(Box(position=(0, east), size=(2, 1, 1)), 20.0, 1, 0.1, 0) for east in (50, 90))
    np.testing.assert_allclose(there.position - here.position, [[0, 40, 0]] * len(here), atol=1e-9)
    np.testing.assert_array_equal(there.phase, here.phase)
    other = box_scatterers(Box(position=(0, 50), size=(2, 1, 1), label="other"), 20.0, 1, 0.1, 0)
    assert not np.any(other.phase == here.phase)
    assert not np.intersect1d(other.scatterer_id, here.scatterer_id).size


def test_a_box_may_float():
    """Its body reaches from its base to its top, wherever the bed is."""
    floating = Box(position=(1, 2), size=(4, 2, 3), base_depth=9.0)
    np.testing.assert_allclose(box_body(floating, 20.0), [1, 2, 1, 0, 2, 1, 6, 9])
