"""Legs with bounces that are requested alone equal those of all together; others are zero."""

import numpy as np
import pytest

from insonify.engines.relief_reflections import reflect_off_relief
from insonify.engines.terrain_occlusion import StraightLaunchAngles, TerrainOcclusion
from insonify.propagation.families import bounce_sequence
from insonify.scene.scatterers import Scatterers
from insonify.simulator import build_simulator
from oracles.scenes import nominal

FAMILIES = ("D", "S", "BS", "SBS")
COLUMNS = (
    "delay", "length", "spreading", "absorption", "reflection_coefficient", "visibility", "status", "occluder",
    "grazing_sine",
           "departure", "arrival")  # fmt: skip


@pytest.fixture(scope="module", params=[0.02, 0.065, 0.3], ids=["gentle", "middling", "rough"])
def world(request):
    """300 positions of rough ground, the legs over the mean plane to them, and what the seabed hides."""
    relief = {"kind": "power-law", "hurst": 0.8, "rms": request.param, "outer_scale": 20.0}
    scenario = nominal(seabed={"relief": relief, "cutoff_wavelength": 0.5}, track={"window": (0.02, 0.08)},
                       paths={"families": list(FAMILIES), "max_reflections": 3})  # fmt: skip
    simulator = build_simulator(scenario)
    scene, here = simulator.engine.scene, simulator.ping_geometry(0)
    bed, rng = scene.seabed.terrain, np.random.default_rng(1)
    away, turn = rng.uniform(12, 55, 300), rng.uniform(-np.pi, np.pi, 300)
    place = np.stack([away * np.cos(turn), away * np.sin(turn)], axis=-1)
    ground = bed.relief.sample(*place.T)
    normal = np.column_stack([-ground.slope, -np.ones(300)])
    points = Scatterers(
        "seabed", "seabed", scenario.seabed.law(1e5, 1500.0), np.column_stack([place, 20 - ground.height]),
        normal / np.linalg.norm(normal, axis=1, keepdims=True), np.ones(300), np.ones(300, complex),
        np.arange(300).astype(np.uint64),
    )  # fmt: skip
    sonar = here.transmit_position

    def legs(which=slice(None)):
        return simulator.engine.rays.legs(sonar, points.take(which), FAMILIES, here.frequency)

    def evaluate_at(needed=None, which=slice(None), soft=False):
        terrain_occlusion = TerrainOcclusion(bed, sonar, StraightLaunchAngles(11.0, 20.0), farthest=80.0,
        wavelength=0.015,
                            min_profile_width=4e-3)  # fmt: skip
        return reflect_off_relief(
            legs(which), points.take(which), sonar, terrain_occlusion, scene, soft=soft, needed=needed
        )

    return evaluate_at, legs


def assert_same(one, other, name):
    """The same to rounding: the last digit may depend on the position in an array, where loops run in vectors."""
    np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-14, err_msg=name)


@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize("chance", [0.0, 0.02, 0.5, 1.0])
def test_legs_requested_are_those_of_all_and_others_are_zero(world, chance, soft):
    """None, a few, half and all of each family: the same to rounding; the rest silent; legs without bottom as ever."""
    requested, _ = world
    every, needed = requested(soft=soft), np.random.default_rng(2).random((len(FAMILIES), 300)) < chance
    some = requested(needed, soft=soft)
    for row, family in enumerate(FAMILIES):
        here = needed[row] if "B" in family else np.ones(300, bool)
        for name in COLUMNS:
            assert_same(getattr(some, name)[row, here], getattr(every, name)[row, here], name)
        assert not np.any(some.amplitude[row, ~here])


def test_points_have_the_same_bounces_alone_as_in_company(world):
    """Every seventh of them, and one by itself, over ground read anew: the same to rounding."""
    requested, _ = world
    every = requested()
    for which in (np.arange(0, 300, 7), np.array([123])):
        few = requested(which=which)
        for name in COLUMNS:
            assert_same(getattr(few, name), getattr(every, name)[:, which], name)


def test_a_leg_takes_as_long_as_its_path_and_fades_with_it(world):
    """Delay times speed is the length, spreading its inverse; absorption is that per metre of the level leg."""
    requested, level = world
    found, flat = requested(), level()
    received = np.abs(found.reflection_coefficient) > 0
    assert received[:2].all()
    np.testing.assert_allclose(found.delay * 1500.0, found.length, rtol=1e-9)
    np.testing.assert_allclose(found.spreading, 1 / found.length, rtol=1e-9)
    np.testing.assert_allclose(
        np.log(found.absorption) / found.length, np.log(flat.absorption) / flat.length, rtol=1e-6
    )
    np.testing.assert_allclose(np.linalg.norm(found.departure, axis=-1), 1, rtol=1e-6)


def test_a_mirror_takes_no_less_than_its_own_coefficient(world):
    """At most 0.35 for each bottom bounce is left, rough or not; surface bounces lose nothing."""
    found = world[0]()
    for row, family in enumerate(FAMILIES):
        times = [*bounce_sequence(family)].count("B")
        assert np.all(np.abs(found.reflection_coefficient[row]) <= 0.35**times * (1 + 1e-9))
        assert times > 0 or np.all(np.abs(found.reflection_coefficient[row]) > 0.99)


def test_no_points_have_no_bounces(world):
    """Columns without rows give empty results."""
    requested, _ = world
    none = requested(which=np.empty(0, np.int64))
    assert none.delay.shape == (len(FAMILIES), 0)
    assert none.families == FAMILIES
