"""Scour: a pit around an object in the seabed, of the given depth and width, in the terrain of every computation."""

import numpy as np
import pytest

from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.scene import Scene
from insonify.scene.solid import resting_pose, seabed_depth_at, solid_scatterers, world_triangles
from insonify.scene.terrain_map import TerrainMap
from insonify.simulator import build_simulator, simulate
from insonify.validity import PhysicsWarning
from oracles.scenes import nominal

MOAT = {"depth": 0.2, "width": 0.5}
DRUM = {"shape": "cylinder", "label": "drum", "position": (3.0, 60.0), "length": 2.0, "diameter": 1.0, "burial": 0.4}


def depth_at(scene, north, east):
    """Depth of the ground of a scene."""
    return seabed_depth_at(scene.seabed, np.stack(np.broadcast_arrays(north, east), axis=-1).astype(float))


def test_a_moat_is_as_deep_and_as_wide_as_requested():
    """0.2 m along the edge of a 2 m x 1 m footprint, half of it half a width away, nothing a width away or inside."""
    scene = Scene(seabed={"depth": 20.0}, targets=[{**DRUM, "scour": MOAT}])
    ends = depth_at(scene, 3.0 + np.array([1.0, 1.25, 1.5, 2.0, 0.5, 0.0]), 60.0) - 20
    np.testing.assert_allclose(ends, [0.2, 0.1, 0.0, 0.0, 0.0, 0.0], atol=1e-12)
    sides = depth_at(scene, 3.0, 60.0 + np.array([-0.5, -0.75, 0.75, 1.0, 0.25])) - 20
    np.testing.assert_allclose(sides, [0.2, 0.1, 0.1, 0.0, 0.1], atol=1e-12)


def test_what_currents_take_is_the_rings_own_volume():
    """Around a sphere: integral of depth over the ring outside of it, pi depth (R w + w^2 (1/2 - 2 / pi^2))."""
    ball = {"shape": "sphere", "position": (0.0, 0.0), "diameter": 2.0, "burial": 0.5, "scour": MOAT}
    scene = Scene(seabed={"depth": 20.0}, targets=[ball])
    axis = np.arange(-2.0, 2.0, 0.01) + 0.005
    dug = depth_at(scene, axis[:, None], axis[None, :]) - 20
    outside = np.hypot(axis[:, None], axis[None, :]) > 1
    expected = np.pi * 0.2 * (1.0 * 0.5 + 0.5**2 * (0.5 - 2 / np.pi**2))
    assert dug[outside].sum() * 1e-4 == pytest.approx(expected, rel=2e-3)


def test_the_gradient_of_a_moat_is_that_of_its_height():
    """Central differences over a turned, leaning body's moat in a turned lattice; also the same moat in the world."""
    leaning = {**DRUM, "heading": 0.6, "pitch": 0.3, "scour": MOAT}
    frames = [ScattererGrid(), ScattererGrid(origin=(10.0, -20.0), heading=0.9)]
    beds = [
        Scene(seabed={"depth": 20.0, "scatterer_grid": frame}, targets=[leaning]).seabed.terrain for frame in frames
    ]
    north, east = np.random.default_rng(1).uniform((1, 58), (5, 62), (500, 2)).T
    for bed in beds:
        step, found = 1e-5, bed.relief.sample(north, east)
        for axis, (a, b) in enumerate(((step, 0.0), (0.0, step))):
            rise = (bed.relief.height(north + a, east + b) - bed.relief.height(north - a, east - b)) / (2 * step)
            assert np.mean(np.abs(rise - found.slope[:, axis]) < 1e-3) > 0.99  # but for kinks under the body
    np.testing.assert_allclose(*(bed.relief.height(north, east) for bed in beds), atol=1e-9)


def test_a_scour_bares_more_of_the_body_and_leaves_it_where_it_is():
    """A half sunken cylinder lies as deep as without; more of its sides stands in the water."""
    plain, bared = (Scene(seabed={"depth": 20.0}, targets=[target]) for target in (DRUM, {**DRUM, "scour": MOAT}))
    one, other = (scene.solids[0] for scene in (plain, bared))
    np.testing.assert_array_equal(resting_pose(one, plain.seabed)[1], resting_pose(other, bared.seabed)[1])
    points = [solid_scatterers(s, c.seabed, 1, 0.03, 0) for s, c in ((one, plain), (other, bared))]
    assert points[1].area.sum() > 1.1 * points[0].area.sum()
    assert points[1].position[:, 2].max() > 20.05
    assert world_triangles(other, bared.seabed).high[2] == pytest.approx(20.4)


def test_the_map_of_shadows_has_the_moat():
    """Nodes of the map, by the fast method and by the general one, lie where the ground does, to a millimetre."""
    bed = Scene(seabed={"depth": 20.0}, targets=[{**DRUM, "scour": MOAT}]).seabed.terrain
    side = bed.heightmap_cell_size * 64
    tile = (int(4.0 // side), int(60.0 // side))
    node = np.arange(65)
    a, b = ((number * 64 + node) * bed.heightmap_cell_size for number in tile)
    truth = bed.relief.height(a[:, None], b[None, :])
    assert truth.min() < -0.15
    np.testing.assert_allclose(bed.heightmap_synthesizer.heights(*tile), truth, atol=1e-6)
    kept = TerrainMap(bed)
    (row,) = rows = kept.claim(np.array([tile]))
    kept.synthesize(rows)
    np.testing.assert_allclose(kept.nodes[row][..., 0], truth, atol=1e-3)


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_a_moat_is_received():
    """Its far wall faces the sonar and its near wall does not: brighter behind, darker before; as far as it reaches."""
    target = {**DRUM, "position": (0.0, 60.0), "length": 3.0, "heading": 0.0, "burial": 0.95}
    changes = {"field": "incoherent", "track": {"window": (0.0765, 0.083)}, "paths": {"families": ["D"]}}
    received = []
    for scour in (None, {"depth": 0.2, "width": 1.0}):
        scenario = nominal(targets=[{**target, "scour": scour}], **changes)
        found = simulate(scenario, threads=1)
        received.append(found.intensity.values[0, 0])
    assert build_simulator(scenario).scenario.scene.seabed.terrain is not None
    slant = found.time.values * 750.0
    ratio, ground = 10 * np.log10(received[1] / received[0]), np.sqrt(slant**2 - 81.0)
    assert ratio[(ground > 57.0) & (ground < 57.8)].mean() == pytest.approx(0.0, abs=0.3)
    assert ratio[(ground > 58.75) & (ground < 59.0)].mean() < -1
    assert ratio[(ground > 61.1) & (ground < 61.4)].mean() > 1


def test_a_scour_is_refused_in_mid_water_and_warned_of_where_sand_would_slide():
    """base_depth puts a target off the bed; 0.5 m on 0.5 m is a slope of 57 degrees."""
    with pytest.raises(ValueError, match="scour"):
        Scene(seabed={"depth": 20.0}, targets=[{"shape": "sphere", "position": (0, 0), "diameter": 1, "base_depth": 10,
                                                "scour": MOAT}])  # fmt: skip
    with pytest.warns(PhysicsWarning, match="steepest slope"):
        Scene(seabed={"depth": 20.0}, targets=[{**DRUM, "scour": {"depth": 0.5, "width": 0.5}}])
