"""Piles and walls that stand through the water surface: what is out of the water neither scatters nor shades."""

import numpy as np
import pytest

from insonify.engines.targets import target_points
from insonify.propagation.knife_edge import close_gap_above
from insonify.scenario.scenario import Scenario
from insonify.scene.panels import panels
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles
from insonify.scene.triangle_surfaces import block, merged_surfaces
from insonify.simulator import build_simulator, labels, simulate
from oracles.scenes import PULSE, nominal, point
from oracles.smooth import ROUGH

QUARTER = np.pi / 2
WATER = {"seabed": {"depth": 10.0}}
SHORT = {"track": {"position": (0, 0, 5), "window": (0.0264, 0.0276)}, "line": {"length": 0.3}, **WATER}
PILE = {"shape": "cylinder", "label": "pile", "position": (0, 20.5), "diameter": 0.5, "pitch": QUARTER}
WALL = {"shape": "box", "label": "wall", "position": (0, 20.5), "heading": 0.1}


def standing(shape: str, high: float, smooth: float | None, **lie: object) -> dict[str, object]:
    """A pile or a wall of a height [m]."""
    body = {**PILE, "length": high} if shape == "cylinder" else {**WALL, "size": (4.0, 1.0, high)}
    return {**body, "face_reflection_coefficient": smooth, **lie}


def scenario_of(
    target: dict[str, object], field: str, *contributions: str, duration: float = 0.2e-3, **paths: object
) -> Scenario:
    """A target about whose echo one ping of one bounce each way is received."""
    sonar = {"pulse": {**PULSE, "duration": duration}}
    settings = {"contributions": ["target", *contributions], "max_reflections": 1, **paths}
    return nominal(targets=[target], field=field, paths=settings, surface={"scattering": None}, sonar=sonar, **SHORT)


@pytest.mark.parametrize(
    ("shape", "smooth", "lie"),
    [("cylinder", 0.5, {"burial_depth": 1.0}), ("box", None, {})],
)
def test_a_pile_through_the_surface_is_recorded_as_the_pile_cut_there(shape, smooth, lie):
    """12 m and 10 m in 10 m of water, with the bed in their shadow: pressure, expectation and labels to 1e-6."""
    settings = {"edge_diffraction": "knife-edge", "duration": 0.5e-3}
    under = 10.0 + lie.get("burial_depth", 0.0)
    tall, cut = (standing(shape, high, smooth, **lie) for high in (12.0, under))
    for field, values in (("coherent", "pressure"), ("incoherent", "intensity")):
        found, expected = (
            simulate(scenario_of(body, field, "seabed", **settings))[values].values for body in (tall, cut)
        )
        assert np.abs(expected).max() > 0
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    found, expected = (labels(scenario_of(body, "incoherent", **settings)) for body in (tall, cut))
    np.testing.assert_allclose(
        found.object_intensity.values,
        expected.object_intensity.values,
        atol=1e-6 * expected.object_intensity.values.max(),
    )
    np.testing.assert_allclose(found.position.values, expected.position.values, atol=1e-6)


@pytest.mark.parametrize("smooth", [None, 0.5])
def test_a_leaning_pile_goes_on_unreceived_above_the_surface(smooth):
    """Pitched by 75 degrees, 12 m and 14 m with the same foot: energy within 0.05 dB where it is smooth or even."""
    energies = []
    for high in (12.0, 14.0):
        foot = (high - 12.0) / 2 * np.cos(np.radians(75))
        pile = {
            **PILE,
            "length": high,
            "pitch": np.radians(75),
            "face_reflection_coefficient": smooth,
            "position": (foot, 20.5),
        }
        energies.append(simulate(scenario_of(pile, "incoherent", duration=0.5e-3)).intensity.values.sum())
    assert 10 * np.log10(energies[1] / energies[0]) == pytest.approx(0, abs=0.05)


@pytest.mark.parametrize("target", [
    {**PILE, "length": 14.0, "pitch": 1.2}, {**WALL, "size": (4, 1, 14)}, {**WALL, "size": (4, 1, 14), "roll": 0.2},
    {"shape": "sphere", "diameter": 2, "position": (0, 20.5), "base_depth": 1.5, "face_reflection_coefficient": 0.5},
    {"shape": "cone", "height": 14, "diameter": 0.5, "position": (0, 20.5), "face_reflection_coefficient": 0.5},
])  # fmt: skip
def test_no_point_and_no_face_is_above_the_surface(target):
    """Drawn points, even points, patches, and triangles that cast shadows: all in the water, up to the surface."""
    ready = build_simulator(scenario_of(target, "coherent"))
    scene, here = ready.scenario.scene, ready.ping_geometry(0)
    for even in (True, False):
        for points in target_points(scene, ready.scenario.paths, 1, here, 0.15, quadrature=even):
            assert len(points)
            assert 0 <= points.position[:, 2].min() < 0.5
    assert world_triangles(scene.occluders[0], scene.seabed).low[2] == pytest.approx(0, abs=1e-9)
    assert scene.body_depths[0] == pytest.approx(0, abs=1e-9)


def test_a_deck_above_the_water_casts_no_shadow(tmp_path):
    """A mesh of a pile that carries a wide deck out of the water: what is left of it is as wide as the pile."""
    pile = block(1.0, 1.0, 12.0).transformed(np.eye(3), np.array([0.0, 0.0, -6.0]))
    deck = block(30.0, 30.0, 0.5).transformed(np.eye(3), np.array([0.0, 0.0, -12.5]))
    both = merged_surfaces([pile, deck])
    file = tmp_path / "pier.obj"
    corners = [f"v {x} {y} {-z}" for x, y, z in both.vertices]
    file.write_text("\n".join(corners + ["f " + " ".join(str(n + 1) for n in face) for face in both.faces]) + "\n")
    mesh = {"shape": "mesh", "label": "pier", "file": str(file), "position": (0, 40.5)}
    scene = Scene(seabed={"depth": 10.0}, targets=[mesh])
    left = world_triangles(scene.solids[0], scene.seabed)
    np.testing.assert_allclose((left.low, left.high), [(-0.5, 40, 0), (0.5, 41, 10)], atol=1e-6)
    assert panels(scene.solids[0], scene.seabed, np.zeros(3)) == []


@pytest.mark.parametrize("edges", ["none", "knife-edge"])
@pytest.mark.parametrize("roll", [0.0, 1e-4])
def test_nothing_is_received_over_a_quay_wall(edges, roll):
    """A point 1 m under the surface behind a wall 400 m long and 12 m high: silent by every path, however edges bend.

    Over a wall that ends 0.1 m under the surface some of it bends.
    """
    energies = []
    for high in (12.0, 9.9):
        wall = {"shape": "box", "label": "wall", "position": (0, 10), "size": (400, 1, high), "roll": roll,
                "scattering": ROUGH}  # fmt: skip
        behind = nominal(
            targets=[wall, point(0, 20.0, 1.0)],
            surface={"scattering": None},
            **SHORT,
            paths={"contributions": ["target"], "max_reflections": 1, "edge_diffraction": edges},
        )
        energies.append(float(np.sum(np.abs(simulate(behind).pressure.values) ** 2)))
    open_water = nominal(targets=[point(0, 20.0, 1.0)], surface={"scattering": None}, **SHORT,
                         paths={"contributions": ["target"], "max_reflections": 1})  # fmt: skip
    alone = float(np.sum(np.abs(simulate(open_water).pressure.values) ** 2))
    assert energies[0] <= 1e-9 * alone
    if edges == "knife-edge":
        assert energies[0] < 0.1 * energies[1]


def test_only_screens_that_reach_the_surface_go_on_above_it():
    """Tops at the surface are moved out of reach, others and all other columns stay."""
    screens = np.array([[3.0, 0.0, 5.0], [4.0, 0.5, 6.0]])
    found = close_gap_above(screens, 1)
    assert found[0, 1] < -1e9
    np.testing.assert_array_equal(found[1], screens[1])
    np.testing.assert_array_equal(found[0, [0, 2]], screens[0, [0, 2]])


@pytest.mark.parametrize("shape", ["cylinder", "box"])
def test_a_sonar_or_a_point_inside_an_emerging_body_is_refused(shape):
    """Right under the surface too, where the cut body is open."""
    body = {**standing(shape, 12.0, None), "position": (0, 0.2)}
    with pytest.raises(ValueError, match=r"inside (pile|wall)"):
        nominal(targets=[body], **SHORT)
    with pytest.raises(ValueError, match=r"the point is inside (pile|wall)"):
        Scene(seabed={"depth": 10.0}, targets=[body, point(0, 0.2, 0.05)])
