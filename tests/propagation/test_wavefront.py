"""Claims about the wavefronts of legs: one leg to a centre gives the delays to places about it."""

import numpy as np
import pytest

from insonify.propagation._wavefront_kernel import MIN_SINE, TubeColumns, vertical_curvatures
from insonify.propagation.wavefront import wavefronts
from insonify.simulator import build_simulator
from insonify.synthesis._arrival_time_kernel import ArrayWater, ArrivalColumns, ElementMotion, arrival_refracted
from oracles.arrays import elements_scenario, some_targets

PROFILES = {
    "even": {"sound_speed": 1500.0},
    "gradient": {"profile": [[0, 1500], [20, 1480]]},
    "thermocline": {"profile": [[0, 1520], [8, 1518], [12, 1495], [20, 1490]], "smoothing": 1.0},
}


def legs_of(water, targets):
    """Pairs and ping geometry of a sonar at rest over some targets."""
    scenario = elements_scenario(targets, track={"speed": 0.0}, water={**water, "noise_level_db": None})
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    return scenario, here, list(simulator.engine.all_pairs(here))


def test_in_one_speed_of_sound_wavefronts_are_spheres():
    """Curvature: one over the length of the way, bounces included; no gradient."""
    scenario, here, found = legs_of(PROFILES["even"], some_targets(3))
    for pairs in found:
        for row in range(len(pairs.receive_legs.families)):
            (front,) = wavefronts(
                pairs.receive_legs, [row], here.receive_position, pairs.scatterers.position, scenario.water
            )
            np.testing.assert_allclose(1 / front.vertical_curvature, pairs.receive_legs.length[row])
            assert front.sound_speed_gradient == 0


@pytest.mark.parametrize(("name", "bar"), [("even", 1e-12), ("gradient", 1e-10), ("thermocline", 3e-9)])
def test_a_leg_to_the_centre_gives_the_legs_beside_it(name, bar):
    """Against legs of their own from places 0.15 m to every side: nearly exact but in a thermocline.

    There the gradient itself changes with depth: 3e-9 s is 2 mrad of a carrier of 100 kHz.
    """
    targets = some_targets(5)
    scenario, here, found = legs_of(PROFILES[name], targets)
    for offset in 0.15 * np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1], [0.6, 0.5, -0.4]]):
        moved = scenario.track.model_copy(update={"start": tuple(np.array(scenario.track.start) + offset)})
        simulator = build_simulator(scenario.model_copy(update={"track": moved}))
        there = list(simulator.engine.all_pairs(simulator.ping_geometry(0)))
        for one, other in zip(found, there, strict=True):
            assert one.receive_legs.families == other.receive_legs.families
            for row in range(len(one.receive_legs.families)):
                clear = (one.receive_legs.visibility[row] != 0) & (other.receive_legs.visibility[row] != 0)
                (front,) = wavefronts(
                    one.receive_legs, [row], here.receive_position, one.scatterers.position, scenario.water
                )
                when, fade, doppler = np.empty(clear.size), np.empty(clear.size, np.float32), np.empty(clear.size)
                way = np.ascontiguousarray(one.receive_legs.departure[row].T)
                curvature, still = front.vertical_curvature, ElementMotion(offset, np.zeros(3), np.zeros(3))
                echoes = ArrivalColumns(one.receive_legs.delay[row], curvature, 1 / curvature,
                                        front.horizontal_distance, *way, np.ones(clear.size),
                                        front.expansion)  # fmt: skip
                water = ArrayWater(1 / here.sound_speed, front.sound_speed_gradient, 0.0, True, 0.0)
                arrival_refracted(echoes, clear.size, still, water, when, fade, doppler)
                np.testing.assert_allclose(when[clear], other.receive_legs.delay[row][clear], rtol=0, atol=bar)


@pytest.mark.parametrize("odd", [False, True])
def test_curvatures_are_the_tube_and_the_eikonal_term(odd):
    """Random legs, level ones, points overhead and touched caustics among them: array arithmetic, bit for bit."""
    rng, n, speed, gradient = np.random.default_rng(7), 2000, 1498.0, -0.8
    sine, arrival = rng.uniform(-1, 1, (2, n)) * rng.choice([1.0, 1e-3, 1e-7], (2, n))
    spreading, length = 1 / rng.uniform(1, 300, n), rng.uniform(1, 300, n)
    caustics, distance = rng.integers(0, 4, n).astype(np.uint8), rng.uniform(0, 300, n) * rng.choice([1.0, 0.0], n)
    point_speed = rng.uniform(1470, 1530, n)
    found = np.empty(n)
    legs = TubeColumns(sine, arrival, spreading, length, caustics, distance, point_speed)
    vertical_curvatures(legs, odd, speed, gradient, found)
    level = (np.abs(sine) < MIN_SINE) | (np.abs(arrival) < MIN_SINE) | (distance < 1e-9)
    cosine, turned = np.sqrt(np.clip(1 - sine**2, 0, 1)), ((sine * arrival < 0) != odd).astype(int)
    sign = np.where((caustics - turned) % 2 == 0, 1.0, -1.0)
    tube = sign * (spreading**2 * distance * np.abs(arrival)) / np.where(level, 1.0, point_speed * cosine)
    over_speed = tube + gradient * np.sign(sine) * cosine**2 / speed**2
    expected = np.where(level, 1 / np.maximum(length, 1e-9), speed * (over_speed / np.where(level, 1, np.abs(sine))))
    np.testing.assert_array_equal(found, expected)
    assert 0.3 < level.mean() < 0.9
