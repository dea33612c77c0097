"""Specular faces of targets: echoes between targets and the seabed, which only the tracer has."""

import numpy as np
import pytest

from insonify.engines.tracer.tracing_scene import has_flat_faces
from insonify.ocean.water import Water
from insonify.scene.target import Box, Cylinder, Sphere
from insonify.simulator import build_simulator
from oracles.few_of import few_of
from oracles.traced import apart_db, curves, scene

WALL = {"shape": "box", "size": (12.0, 1.0, 19.5), "position": (0.0, 60.5),
        "scattering": {"law": "lambert", "strength_db": -60}}  # fmt: skip
GRADIENT = {"noise_level_db": None, "profile": [[0.0, 1530.0], [12.0, 1500.0], [20.0, 1496.0]]}
FAR = {"window": (0.1, 0.115), "paths": {"families": None, "max_reflections": 1, "target_specular_fraction": 1.0}}


def test_a_wall_mirrors_the_scene_in_front_of_it():
    """Echoes by a wall out and back, after its own: those of the open bed at that time, as if there were no wall.

    A face that scatters 3e-6 of the incident energy reflects the rest; a beam 11 m deep reaches it from 60 m on.
    """
    free = curves(scene("tracer", window=FAR["window"], paths={"families": ["D"]}))["seabed", "D-D"]
    mirrored = curves(scene("tracer", targets=[WALL], rays=100_000, **FAR))["seabed", "T-T"]
    assert apart_db(mirrored, free) == pytest.approx(0, abs=0.1)


@few_of((0,), ("water", "apart"), [
    pytest.param({"noise_level_db": None}, (0.0, 0.0, -0.1), id="one speed, apart"),
    pytest.param(GRADIENT, (0.0, 0.0, 0.0), id="layered, together"),
])  # fmt: skip
def test_a_wall_mirrors_pairs_of_different_families(apart, water):
    """Out by the wall and back by wall and surface, in either order: pair D-S of the open bed within 0.1 dB."""
    paths, changes = {"max_reflections": 2, "contributions": ["seabed"]}, {"receive": {"offset": apart}, "water": water}
    free = curves(scene("tracer", window=FAR["window"], paths={"families": ["D", "S"]}, **changes))["seabed", "D-S"]
    paths = {**FAR["paths"], **paths}
    found = curves(scene("tracer", targets=[WALL], rays=60_000, window=FAR["window"], paths=paths, **changes))
    mirrored = sum(found.get(("seabed", pair), 0.0) for pair in ("T-ST", "T-TS"))
    assert apart_db(mirrored, free) == pytest.approx(0, abs=0.1)


def test_half_a_mirror_returns_a_quarter_of_what_passes_it_twice():
    """Echoes by the wall out and back fall by 6.02 dB, those that pass it once by 3.01 dB."""
    once, twice = {}, {}
    for share in (1.0, 0.5):
        changes = {**FAR, "window": (0.075, 0.115), "paths": {**FAR["paths"], "target_specular_fraction": share}}
        found = curves(scene("tracer", targets=[WALL], **changes))
        once[share], twice[share] = found["seabed", "D-T"], found["seabed", "T-T"]
    assert apart_db(once[1.0], once[0.5]) == pytest.approx(3.0103, abs=0.01)
    assert apart_db(twice[1.0], twice[0.5]) == pytest.approx(6.0206, abs=0.01)


@few_of((1, 2), "smooth", [0.7, -0.7, 0.0])
def test_smooth_faces_mirror_the_square_of_their_coefficient(smooth):
    """A wall of coefficient 0.7 is the wall of which the tracer is given to mirror 0.49; of 0, it mirrors nothing."""
    short = {**FAR, "window": (0.075, 0.1)}
    changes = {**short, "paths": {**FAR["paths"], "target_specular_fraction": smooth**2}}
    requested = curves(scene("tracer", targets=[WALL], rays=20_000, **changes))
    known = curves(scene("tracer", targets=[{**WALL, "face_reflection_coefficient": smooth}], rays=20_000, **short))
    assert (("seabed", "D-T") in known) is (smooth != 0)
    for key, energy in requested.items():
        np.testing.assert_allclose(known[key], energy, rtol=1e-12)


def test_the_bed_lit_by_a_wall_scatters_as_a_plain_sum_over_it():
    """Out by the wall and straight back, and the other way round: 4 |A|^2 of every patch of a grid on the seabed.

    The oracle shares the beams and the absorption only: an image of the sonar behind the wall lights each patch. Only
    the outer 35 m of the seabed: the few rays that come back right under the sonar are strong, and scatter more.
    """
    scenario = scene("tracer", window=(0.06, 0.115), targets=[WALL], rays=100_000,
                     paths={**FAR["paths"]})  # fmt: skip
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    computed = sum(
        np.sum((echoes.energy * (1 + echoes.reciprocal))[0, echoes.delay < 0.0815])
        for block in simulator.tracer.blocks(here) for echoes in block()
        if (echoes.contribution, echoes.transmit_chain, echoes.receive_chain) == ("seabed", "T", "D")
    )  # fmt: skip
    sonar, image = np.array([0.0, 0.0, 11.0]), np.array([0.0, 120.0, 11.0])
    north, east = np.meshgrid(np.arange(-6, 6, 0.01), np.arange(0.05, 60, 0.1), indexing="ij")
    place = np.stack([north, east, np.full(north.shape, 20.0)], axis=-1)
    one, other = place - image, place - sonar
    long, short = np.linalg.norm(one, axis=-1), np.linalg.norm(other, axis=-1)
    launch = one / long[..., None] * np.array([1, -1, 1])
    gain = here.transmit_beams.gain(launch)[0] ** 2 * here.receive_beams.gain(other / short[..., None])[0] ** 2
    loss = 10 ** (-float(Water().absorption(1e5)) * (long + short) / 10)
    area = 0.01 * 0.1 * 10**22.0
    gain *= long + short < 1500 * 0.0815
    expected = 4 * np.sum(10**-2.7 * 9 / long * 9 / short * gain * loss / (long * short) ** 2) * area
    assert 10 * np.log10(computed / expected) == pytest.approx(0, abs=0.1)


def test_bottom_bounces_and_faces_alone_brighten_the_front_of_a_box():
    """The paper's figure 4, without the surface: echoes between box and bed come with its face, and after it.

    Those that go by the face once arrive within 1 ms of its own direct echo; those that go by it twice, later than it,
    into its shadow. 10 m before it nothing changes.
    """
    box = {"shape": "box", "size": (2.0, 1.0, 1.0), "position": (0.0, 75.5)}
    changes = {"window": (0.085, 0.12), "targets": [box]}
    alone, found = (
        curves(
            scene(
                "tracer",
                paths={"families": ["D", "B"], "max_reflections": 2, "target_specular_fraction": mirror},
                **changes,
            )
        )
        for mirror in (0.0, 0.6)
    )
    assert {key for key in found if "S" in key[1]} == set()
    assert {("seabed", "D-T"), ("seabed", "T-T")} <= set(found) - set(alone)
    time = 0.085 + np.arange(len(found["seabed", "all"])) * (0.035 / len(found["seabed", "all"]))
    face = 2 * np.hypot(75, 8.5) / 1500
    once, twice = found["seabed", "D-T"], found["seabed", "T-T"]
    near = np.abs(time - face) < 1e-3
    assert once[near].sum() > 0.99 * once.sum()
    assert twice[time > face].sum() > 0.99 * twice.sum()
    before = time < face - 2 * 10 / 1500
    assert apart_db(found["seabed", "all"][before], alone["seabed", "all"][before]) == pytest.approx(0, abs=0.02)


def test_bodies_are_flat_or_round():
    """A box has faces with common edges; spheres and cylinders bend, and nothing is retraced over them."""
    assert has_flat_faces(Box(position=(0, 0), size=(2, 1, 1)))
    assert not has_flat_faces(Sphere(position=(0, 0), diameter=1.0))
    assert not has_flat_faces(Cylinder(position=(0, 0), length=2.0, diameter=1.0))
