"""Light buffers: the same shadows as the triangle tree, leg by leg."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.propagation import solid_shadows
from insonify.propagation._light_buffer_kernel import light_buffer
from insonify.propagation.families import families_up_to
from insonify.propagation.image_sources import image_legs, leg_occlusion
from insonify.recent_results import RecentResults
from insonify.records.legs import LegStatus
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

DRUM = {"shape": "drum", "label": "drum", "position": (0, 45), "size": (6, 4, 4), "heading": 0.3}
CONE = {"shape": "cone", "label": "cone", "position": (2, 50), "height": 6, "diameter": 5}
ROCK = {"shape": "rock", "label": "rock", "position": (1, 48), "size": (3, 3, 5), "heading": 0.5}
SCENE = Scene(seabed={"depth": 20.0}, targets=[DRUM, CONE, ROCK])


def scatterers(places, normals):
    """Scatterers of a target at some places."""
    n = len(places)
    return Scatterers("target", "target", PointTargetLaw(), places, normals, np.ones(n), np.ones(n, complex),
                      np.arange(n, dtype=np.uint64))  # fmt: skip


def direct_legs(position, places, normals):
    """Status and occluder of direct legs to some places."""
    legs = image_legs(SCENE, np.asarray(position, float), scatterers(places, normals), ("D",), 100e3)
    return legs.status, legs.occluder


def places_about(seed, count):
    """Points in the water about the targets, and others exactly on corners of their triangles."""
    rng = np.random.default_rng(seed)
    corners = np.concatenate([solid_shadows.world_triangles(s, SCENE.seabed).vertices for s in SCENE.solids])
    loose = rng.uniform([-8, 35, 8], [8, 70, 19.9], (count, 3))
    normals = rng.normal(size=(count + len(corners), 3))
    return np.concatenate([loose, corners]), normals / np.linalg.norm(normals, axis=1, keepdims=True)


@given(st.integers(0, 2**31), st.floats(-60, 60), st.floats(0.5, 19))
@settings(max_examples=25, deadline=None)
def test_light_buffers_find_the_shadows_of_the_triangle_tree(seed, north, depth):
    """Every leg past three solids that overlap ends at the same solid as by the tree, those to their corners too."""
    places, normals = places_about(seed, 4000)
    status, occluder = direct_legs((north, 0, depth), places, normals)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solid_shadows, "MIN_LEGS_PER_TRIANGLE", np.inf)
        expected, solid = direct_legs((north, 0, depth), places, normals)
    assert (expected == LegStatus.OCCLUDED).sum() > 50
    np.testing.assert_array_equal(status, expected)
    np.testing.assert_array_equal(occluder, solid)


@pytest.mark.parametrize(("position", "uses"), [((0, 0, 8), 3), ((0, 43, 14), 0)])
def test_a_sonar_beside_a_solid_has_no_light_buffer(monkeypatch, position, uses):
    """A central projection needs all of a solid ahead of the sonar; one beside a drum, or in it, takes the tree."""
    made = []
    monkeypatch.setattr(solid_shadows, "_BUFFERS", RecentResults(8))
    monkeypatch.setattr(solid_shadows, "light_buffer", lambda *a: made.append(light_buffer(*a)) or made[-1])
    direct_legs(position, *places_about(1, 4000))
    assert len(made) == uses
    direct_legs(position, *places_about(2, 4000))  # other points: the same light buffers
    assert len(made) == uses


def test_triangles_beyond_a_point_are_not_tested():
    """Of legs to the near side of a rock, none hits a triangle farther than its end; the least distances are exact."""
    source = np.array([0.0, 0.0, 8.0])
    built = solid_shadows._scene_triangles(SCENE.solids, SCENE.seabed, 0)
    buffer = light_buffer(source, built.extent[2, :3], built.of_solid[2])
    sides = built.of_solid[2].reshape(-1, 3, 3)
    corners = sides[:, :1] + np.concatenate([np.zeros_like(sides[:, :1]), sides[:, 1:]], axis=1)
    distance = ((corners - source) @ buffer.axes[0]).min(axis=1)
    assert (buffer.triangle_nearest <= distance).all()
    np.testing.assert_allclose(buffer.triangle_nearest, distance, rtol=1e-4)


def test_cells_of_a_light_buffer_hold_few_triangles():
    """Most cells of a drum's light buffer list no more than 8 of its several hundred triangles."""
    built = solid_shadows._scene_triangles(SCENE.solids, SCENE.seabed, 0)
    buffer = light_buffer(np.array([0.0, 0.0, 8.0]), built.extent[0, :3], built.of_solid[0])
    count = np.diff(buffer.cell_offsets)
    assert len(built.of_solid[0]) > 300
    assert np.median(count[count > 0]) <= 8
    assert (count == 0).mean() > 0.05


def test_occlusion_alone_is_that_of_whole_legs():
    """Status and occluder without other columns: those of the legs, in every family, past solids and upright boxes."""
    box = {"shape": "box", "label": "box", "position": (-3, 40), "size": (3, 3, 5), "heading": 0.5}
    scene = Scene(seabed={"depth": 20.0}, targets=[DRUM, box, CONE])
    ends = scatterers(*places_about(3, 3000))
    position = np.array([0.0, 0.0, 8.0])
    for families in (("D",), families_up_to(2)):
        legs = image_legs(scene, position, ends, families, 100e3)
        status, occluder = leg_occlusion(scene, position, ends, families)
        np.testing.assert_array_equal(status, legs.status)
        np.testing.assert_array_equal(occluder, legs.occluder)
        assert set(np.unique(occluder)) == {-1, 0, 1, 2} and set(np.unique(status)) >= {0, 1, 2}


@pytest.mark.parametrize("position", [(1, 45, 0.5), (0, 46, 1), (-40, 46, 0.2), (2, 30, 19.5)])
def test_light_buffers_hold_from_above_and_from_the_ground(monkeypatch, position):
    """From above three solids, and from beside them at the seabed, legs end as by the triangle tree."""
    places, normals = places_about(5, 6000)
    status, occluder = direct_legs(position, places, normals)
    monkeypatch.setattr(solid_shadows, "MIN_LEGS_PER_TRIANGLE", np.inf)
    expected, solid = direct_legs(position, places, normals)
    assert (expected == LegStatus.OCCLUDED).sum() > 20
    np.testing.assert_array_equal(status, expected)
    np.testing.assert_array_equal(occluder, solid)
