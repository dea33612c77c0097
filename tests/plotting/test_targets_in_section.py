"""The side view of a long target: as thick as it is along the drawn plane, not as long as it is."""

import numpy as np
import pytest

from insonify.plotting.scene_view import _cut_along
from insonify.scene.triangle_surfaces import block


def test_a_quay_wall_across_the_beam_is_as_thick_as_it_is():
    """200 m long, 2 m thick, 50 m ahead, its middle 60 m aside: 49 to 51 m, top to base; beside it: none."""
    wall = block(200.0, 2.0, 10.0).transformed(np.eye(3), np.array([60.0, 50.0, 5.0]))
    low, high = _cut_along(wall.corners, np.zeros(2), np.pi / 2)
    np.testing.assert_allclose((low, high), [(49, 0), (51, 10)], atol=1e-9)
    assert _cut_along(wall.corners, np.array([-200.0, 0.0]), np.pi / 2) is None
    slanted = _cut_along(wall.corners, np.zeros(2), np.pi / 4)
    assert slanted[0][0] == pytest.approx(49 * np.sqrt(2))
