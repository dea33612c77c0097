"""Targets on relief lie on the terrain under their middle, and only the part above it scatters."""

import numpy as np
import pytest

from insonify.scene.scene import Scene
from insonify.scene.solid import seabed_depth_at, solid_scatterers, world_triangles

HILLS = {"depth": 20.0, "relief": [{"kind": "power-law", "rms": 0.3, "hurst": 0.8}], "seed": 4}
PLACE = (3.0, 60.0)


def test_a_target_lies_on_the_ground_under_its_middle():
    """Box, solid and sunken solid: lowest point at the depth of the ground there, or below it by what has sunk."""
    scene = Scene(
        seabed=HILLS,
        targets=[
            {"shape": "box", "position": PLACE, "size": (1, 1, 1)},
            {"shape": "sphere", "position": PLACE, "diameter": 1},
            {"shape": "drum", "position": PLACE, "burial_depth": 0.1},
        ],
    )
    ground = float(seabed_depth_at(scene.seabed, np.array(PLACE)))
    assert abs(ground - 20) > 0.01
    assert scene.bodies[0, 7] == pytest.approx(ground)
    ball, drum = (world_triangles(solid, scene.seabed) for solid in scene.solids)
    assert ball.high[2] == pytest.approx(ground)
    assert drum.high[2] == pytest.approx(ground + 0.1)


def test_only_the_part_above_the_seabed_scatters():
    """A long low slab across the hills: its points all lie above the ground under them, and some have gone."""
    scene = Scene(
        seabed=HILLS, targets=[{"shape": "plate", "position": PLACE, "length": 20, "width": 1, "thickness": 0.5}]
    )
    points = solid_scatterers(scene.solids[0], scene.seabed, 1, 0.1, 0)
    assert np.all(points.position[:, 2] < seabed_depth_at(scene.seabed, points.position[:, :2]))
    assert 0.05 < points.area.sum() / 61 < 0.95


def test_a_point_may_not_lie_below_a_hill():
    """The limit is the ground under the point, not the mean depth."""
    ground = float(seabed_depth_at(Scene(seabed=HILLS).seabed, np.array(PLACE)))
    Scene(seabed=HILLS, targets=[{"shape": "point", "position": (*PLACE, ground - 0.01)}])
    with pytest.raises(ValueError, match="is below the seabed"):
        Scene(seabed=HILLS, targets=[{"shape": "point", "position": (*PLACE, ground + 0.01)}])
