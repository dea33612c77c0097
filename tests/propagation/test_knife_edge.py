"""Sound bends around edges: half of it on the edge of the hard shadow, and what the whole wave states elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import j0

from insonify.propagation.image_sources import image_legs
from insonify.propagation.knife_edge import (
    diffract_at_edges,
    edge_diffraction_table,
    knife_edge,
)
from insonify.propagation.knife_edge_kernel import FAR, edge_diffraction
from insonify.records.legs import LegStatus
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from oracles.fresnel import fresnel_number

FREQUENCY, SPEED = 100e3, 1500.0
WAVE = SPEED / FREQUENCY
SONAR = np.array([0.0, 0.0, 11.0])
SCREEN = 150.0
"""Distance of the box, a thin screen, from the sonar [m]."""
CELLS = 400
"""Of the screen in each direction."""


def scene(*, base: float | None = 19.5, width: float = 2.0, height: float = 1.0, heading: float = 0.0,
          thickness: float = 0.002) -> Scene:  # fmt: skip
    """A thin box east of the sonar, turned about the sonar by a heading."""
    where = SCREEN * np.array([-np.sin(heading), np.cos(heading)])
    box = {"shape": "box", "position": tuple(where), "size": (width, thickness, height), "base_depth": base,
           "heading": heading}  # fmt: skip
    return Scene(water={"sound_speed": SPEED}, seabed={"depth": 20.0}, targets=[box])


def ground(place: np.ndarray, heading: float = 0.0) -> Scatterers:
    """Points at north, east, depth (n, 3), turned about the sonar."""
    c, s = np.cos(heading), np.sin(heading)
    turned = np.stack([c * place[:, 0] - s * place[:, 1], s * place[:, 0] + c * place[:, 1], place[:, 2]], axis=-1)
    up, n = np.tile([0.0, 0.0, -1.0], (len(place), 1)), len(place)
    key = np.arange(n, dtype=np.uint64)
    return Scatterers("seabed", "seabed", Lambert(), turned, up, np.ones(n), np.ones(n, complex), key)


def visibility(world: Scene, points: Scatterers, families: tuple[str, ...] = ("D",), place: np.ndarray = SONAR, *,
               wide: bool = False) -> np.ndarray:  # fmt: skip
    """Complex visibility of the legs, (f, n)."""
    legs = image_legs(world, place, points, families, FREQUENCY)
    return diffract_at_edges(legs, points, place, world, WAVE, infinitely_wide=wide).visibility


def whole_wave(point: np.ndarray, base: float, width: float, height: float) -> complex:
    """Field behind a rectangular screen re that without it, by Kirchhoff's integral over the screen, term by term."""
    y = (np.arange(CELLS) + 0.5) / CELLS * width - width / 2
    z = base - (np.arange(CELLS) + 0.5) / CELLS * height
    y, z = np.meshgrid(y, z)
    here = np.stack([y, np.full_like(y, SCREEN), z], axis=-1)
    before, behind = np.linalg.norm(here - SONAR, axis=-1), np.linalg.norm(here - point, axis=-1)
    straight = float(np.linalg.norm(point - SONAR))
    facing = (SCREEN / before + (point[1] - SCREEN) / behind) / 2
    k = 2 * np.pi / WAVE
    spread = straight / (before * behind) * facing
    blocked = 1j / WAVE * np.sum(spread * np.exp(-1j * k * (before + behind - straight)))
    return complex(1 - blocked * (width / CELLS) * (height / CELLS))


POINTS = np.array(
    [[0, 154, 20], [0, 160, 20], [0.9, 160, 20], [1.06, 160, 20], [1.4, 160, 20], [0.3, 175, 20], [-0.7, 163, 20]],
    float,
)


def test_a_box_takes_what_the_whole_wave_loses_at_its_place() -> None:
    """Seven points behind and beside a 2 x 1 m screen, modulus and phase, against Kirchhoff's integral.

    To 0.05 four metres behind, where the angles at the screen are no longer small, and to 0.01 from ten on.
    """
    found = visibility(scene(), ground(POINTS))[0]
    expected = np.array([whole_wave(point, 19.5, 2.0, 1.0) for point in POINTS])
    assert np.abs(expected).min() < 0.4 and np.abs(expected).max() > 0.9  # shadow and light
    np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=0.05)
    np.testing.assert_allclose(found[1:], expected[1:], rtol=0, atol=0.01)


def test_half_of_the_pressure_is_left_on_the_edge_of_the_shadow() -> None:
    """On the ray that grazes the top of a wide box, 1/2; deep behind it nearly nothing; far beyond it nearly all."""
    world = scene(base=None, width=60.0)
    edge = (SCREEN + 0.001) * 9 / 8
    east = np.array([SCREEN + 3, edge - 1e-4, edge + 1e-4, edge + 200])
    points = ground(np.stack([0 * east, east, np.full(4, 20.0)], axis=-1))
    found = visibility(world, points)[0]
    assert abs(found[0]) < 0.06
    np.testing.assert_allclose(found[1:3], 0.5, atol=0.005)
    assert abs(found[3]) == pytest.approx(1, abs=0.1)
    hard = image_legs(world, SONAR, points, ("D",), FREQUENCY)
    assert hard.status[0].tolist() == [LegStatus.OCCLUDED, LegStatus.OCCLUDED, LegStatus.CLEAR, LegStatus.CLEAR]


def test_the_middle_of_the_shadow_is_19_db_down() -> None:
    """A number of 1.95 leaves -18.9 dB one way, and the asymptote 1 / (sqrt 2 pi nu) holds within 2 % from there on."""
    assert 20 * np.log10(abs(knife_edge(1.95))) == pytest.approx(-18.9, abs=0.05)
    number = np.array([2.0, 4.0, 20.0])
    np.testing.assert_allclose(np.abs(knife_edge(number)) * np.sqrt(2) * np.pi * number, 1, rtol=0.02)
    assert float(fresnel_number(1.0, 100.0, 25.0, 0.5)) == pytest.approx(np.sqrt(2 / 0.5 * 0.05))


def test_the_edge_loses_what_the_radio_engineers_found() -> None:
    """ITU-R P.526, eq. 31: 6.9 + 20 log(sqrt((nu - 0.1)^2 + 1) + nu - 0.1) dB above -0.78; its own error is 0.3 dB."""
    number = np.linspace(-0.7, 10, 200)
    engineers = 6.9 + 20 * np.log10(np.sqrt((number - 0.1) ** 2 + 1) + number - 0.1)
    np.testing.assert_allclose(-20 * np.log10(np.abs(knife_edge(number))), engineers, atol=0.35)


def test_what_two_half_planes_leave_adds_up_to_the_whole() -> None:
    """Babinet: a half plane and its complement together keep and let pass everything; the table reports it to 1e-6."""
    number = np.linspace(-1.3 * FAR, 1.3 * FAR, 999)
    np.testing.assert_allclose(knife_edge(number) + knife_edge(-number), 1, atol=1e-12)
    table = np.array([edge_diffraction(float(value), edge_diffraction_table()) for value in number])
    near = np.abs(number) < FAR
    np.testing.assert_allclose(table[near], knife_edge(number[near]), rtol=0, atol=5e-8)
    np.testing.assert_allclose(table, knife_edge(number), rtol=0, atol=5e-6)


def test_a_path_off_the_surface_bends_as_from_its_image() -> None:
    """S from 11 m below the surface reaches the box as D from 11 m above it would."""
    points, world = ground(POINTS), scene(base=None)
    image = SONAR * [1, 1, -1]
    np.testing.assert_allclose(visibility(world, points, ("S",)), visibility(world, points, place=image), atol=1e-9)


def test_a_leg_that_is_cut_before_its_last_bounce_gets_nothing() -> None:
    """A raised wall near the sonar cuts BS on its way down: no last segment passes it, and nothing is left."""
    wall = {"shape": "box", "position": (0.0, 10.0), "size": (40.0, 0.1, 9.0), "base_depth": 19.9}
    world = Scene(water={"sound_speed": SPEED}, seabed={"depth": 20.0}, targets=[wall])
    found = visibility(world, ground(POINTS), ("BS",))
    assert (found == 0).all()


@pytest.mark.parametrize("heading", [0.7, -2.0])
def test_turning_the_scene_changes_no_edge(heading: float) -> None:
    """Box and points turned about the sonar: the same visibility, to 1e-6."""
    there, here = (visibility(scene(heading=a, thickness=0.5), ground(POINTS, a)) for a in (heading, 0.0))
    np.testing.assert_allclose(there, here, atol=1e-6)


def test_a_slice_is_symmetric_in_its_sides() -> None:
    """In a slice the box is endlessly wide: its middle is as dark as behind a wide one, to the wide one's ripple."""
    points = ground(POINTS[:2])
    alone = visibility(scene(base=None), points, wide=True)
    np.testing.assert_allclose(alone, visibility(scene(base=None, width=60.0), points), atol=0.02)


@pytest.mark.parametrize("heading", [0.3, 0.7, -0.7])
@pytest.mark.parametrize("shape", ["box", "cylinder"])
def test_a_slanting_wall_casts_no_shadow_in_front_of_it(heading: float, shape: str) -> None:
    """A wall 8 m long, oblique to the sound: the bed 1.5 m in front of it, all along, receives what it does alone."""
    body = {"size": (8.0, 0.3, 1.0)} if shape == "box" else {"length": 8.0, "diameter": 0.6}
    world = Scene(water={"sound_speed": SPEED}, seabed={"depth": 20.0},
                 targets=[{"shape": shape, "position": (0.0, SCREEN), "heading": heading, **body}])  # fmt: skip
    along, c, s = np.linspace(-5, 5, 41), np.cos(heading), np.sin(heading)
    where = np.stack([c * along + 1.5 * s, SCREEN + s * along - 1.5 * c, np.full(41, 19.999)], axis=-1)
    assert np.abs(visibility(world, ground(where)))[0] == pytest.approx(1, abs=0.1)


def test_without_boxes_nothing_changes() -> None:
    """Legs of a scene without boxes come back as they are."""
    world = Scene(water={"sound_speed": SPEED}, seabed={"depth": 20.0})
    points = ground(POINTS)
    legs = image_legs(world, SONAR, points, ("D", "S"), FREQUENCY)
    assert diffract_at_edges(legs, points, SONAR, world, WAVE) is legs


def test_a_solid_block_bends_sound_as_the_box_does() -> None:
    """A mesh of the same block, whose screen is made of columns: the box's visibility, to 0.03."""
    box, points = scene(base=None, thickness=0.3), ground(POINTS)
    solid = block(turned=1e-6)
    assert len(solid.solids) == 1 and not solid.boxes
    np.testing.assert_allclose(visibility(solid, points), visibility(box, points), rtol=0, atol=0.03)
    np.testing.assert_allclose(visibility(solid, points, ("S",)), visibility(box, points, ("S",)), rtol=0, atol=0.03)


def block(turned: float = 0.0) -> Scene:
    """The nominal screen, 0.3 m thick, as a body of triangles: a box that is not quite upright."""
    box = {"shape": "box", "position": (0.0, SCREEN), "size": (2.0, 0.3, 1.0), "roll": turned}
    return Scene(water={"sound_speed": SPEED}, seabed={"depth": 20.0}, targets=[box])


def test_a_bright_spot_stands_in_the_middle_of_a_spheres_shadow() -> None:
    """Arago's spot: on the axis behind a ball all of the pressure, about it |J0(2 pi rho a / (lambda d))|; to 0.06.

    Fresnel (1818), Poisson; a disc of radius a at d: Born & Wolf, 8.8.4, for many zones (not verified).
    """
    centre = np.array([0.0, 20.0, 15.5])
    ball = {"shape": "sphere", "position": tuple(centre[:2]), "diameter": 2.0, "base_depth": 16.5}
    world = Scene(water={"sound_speed": SPEED}, seabed={"depth": 20.0}, targets=[ball])
    aside = np.array([0.0, 0.05, 0.1, 0.2, 0.3, 0.4])
    points = ground(np.stack([aside, np.full(6, 40.0), np.full(6, 20.0)], axis=-1))
    hard = image_legs(world, SONAR, points, ("D",), FREQUENCY)
    assert (hard.status == LegStatus.OCCLUDED).all()
    behind = float(np.linalg.norm(np.array([0, 40, 20.0]) - centre))
    expected = np.abs(j0(2 * np.pi * aside * 1.0 / (WAVE * behind)))
    np.testing.assert_allclose(np.abs(visibility(world, points)[0]), expected, rtol=0, atol=0.06)


def test_a_solid_diffracts_only_the_segment_after_the_last_bounce():
    """B past a ball 20 m away: changed, not lost, if it passes on its way up; exactly 1 if it bounces behind it."""
    ball = {"shape": "sphere", "position": (0.0, 20.0), "diameter": 2.0, "base_depth": 16.5}
    world = Scene(water={"sound_speed": SPEED}, seabed={"depth": 20.0}, targets=[ball])
    depth = np.linspace(1.0, 16.5, 63)
    bounce = 40.0 * 9 / (29 - depth)
    height = 20 - (20 - bounce) * (20 - depth) / (40 - bounce)
    points = ground(np.stack([0 * depth, 0 * depth + 40, depth], axis=-1))
    points = replace(points, boundary="target", normal=-points.normal)
    found = visibility(world, points, ("B",))[0]
    assert (found[bounce > 21.5] == 1).all()
    assert (bounce > 21.5).sum() > 10
    near = (np.abs(height - 15.5) < 1.2) & (bounce < 18.5)
    assert near.sum() > 3
    assert (np.abs(found[near] - 1) > 0.05).all()
    assert (found[near] != 0).all()


def test_an_approximate_box_leaves_out_weak_ripples() -> None:
    """Within six Fresnel numbers of an edge as before, 1 beyond: off by at most 0.04 for each of two edges."""
    world, east = scene(), np.linspace(151.0, 190.0, 60)
    place = [(north, e, 20.0) for e in east for north in np.linspace(-9.0, 9.0, 181)]
    points = ground(np.array(place))
    legs = image_legs(world, SONAR, points, ("D",), FREQUENCY)
    exact, rough = (
        diffract_at_edges(legs, points, SONAR, world, WAVE, approximate=approximate).visibility[0]
        for approximate in (False, True)
    )
    assert np.abs(rough - exact).max() < 0.08
    unchanged = rough == 1
    assert 0.3 < unchanged.mean() < 0.9 and (exact[unchanged] != 1).any()
    np.testing.assert_array_equal(rough[~unchanged], exact[~unchanged])
