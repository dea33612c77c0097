"""Laws of waves that smooth faces keep: scale, superposition, mirrors, turned worlds, one wall of many bricks."""

from functools import cache

import numpy as np
import pytest

from insonify.simulator import simulate
from oracles.few_of import few_of
from oracles.scenes import nominal
from oracles.smooth import ROUGH, brute, flashes

FREQUENCY = 1e5
LOSSLESS = {"noise_level_db": None, "absorption_db_per_m": 0.0}
BODIES = {
    "box": {"shape": "box", "position": (0.3, 30.0), "size": (0.5, 0.3, 0.4), "heading": 0.05},
    "cylinder": {"shape": "cylinder", "position": (-0.2, 25.0), "length": 0.45, "diameter": 0.25},
    "sphere": {"shape": "sphere", "position": (0.0, 28.0), "diameter": 0.3, "base_depth": 16.0},
}  # fmt: skip
PAIRS = [("D", "D"), ("D", "B"), ("B", "D"), ("S", "S"), ("B", "SB")]


def scaled(body, factor):
    """A body of another size, at another place."""
    lengths = ("position", "size", "length", "diameter", "height", "base_depth")
    grown = {
        name: tuple(x * factor for x in value) if isinstance(value, tuple) else value * factor
        for name, value in body.items() if name in lengths
    }  # fmt: skip
    return {**body, **grown}


@cache
def flashes_of(name):
    """Flashes of one of the bodies by up to two reflections."""
    return flashes(BODIES[name], 2)


@pytest.mark.parametrize(("name", "factor"), [("box", 0.5), ("box", 2.0), ("cylinder", 2.0), ("sphere", 2.0)])
def test_a_larger_world_at_a_lower_pitch_sounds_weaker_by_its_size(name, factor):
    """Every length and the wavelength by one factor: each pair's pressure by its inverse, phase and all, to 1 %."""
    body = BODIES[name]
    here = flashes_of(name)
    pulse = {"kind": "cw", "frequency": FREQUENCY / factor, "duration": 0.2e-3 * factor}
    there = flashes(
        scaled(body, factor), 2, sonar={"pulse": pulse, "receiver": {"bandwidth": 20e3 / factor}},
        seabed={"depth": 20.0 * factor}, track={"position": (0.0, 0.0, 11.0 * factor), "window": (0.0, 0.24 * factor)},
        line={"length": 0.1 * factor}, frequency=FREQUENCY / factor,
    )  # fmt: skip
    strongest = max(abs(here[pair]) for pair in PAIRS)
    for pair in PAIRS:
        assert abs(there[pair] * factor - here[pair]) < 0.01 * strongest, pair


def received(targets, **changes):
    """Pressure of smooth targets over the nominal bed."""
    solids = [
        {"face_reflection_coefficient": 1.0, "scattering": ROUGH, "label": f"body {k}", **body}
        for k, body in enumerate(targets)
    ]
    fixed = {"water": LOSSLESS, "track": {"window": (0.03, 0.045)}, "line": {"length": 0.2},
             "paths": {"contributions": ["target"], "max_reflections": 1}}  # fmt: skip
    return simulate(nominal(targets=solids, **{**fixed, **changes})).pressure.values[0, 0]


@cache
def received_of(name):
    """Pressure of one of the bodies alone."""
    return received([BODIES[name]])


def test_two_bodies_that_do_not_hide_each_other_add_as_pressures():
    """Side by side: the sound of both is the sum of each alone, to a millionth of the strongest."""
    bodies = [{**BODIES["box"], "position": (-1.5, 28.0)}, {**BODIES["cylinder"], "position": (1.5, 28.5)}]
    alone = [received([body]) for body in bodies]
    both = received(bodies)
    assert np.abs(both - sum(alone)).max() < 1e-5 * np.abs(both).max()
    assert min(np.abs(one).max() for one in alone) > 1e-3 * np.abs(both).max()


def test_a_wall_of_bricks_sounds_as_the_wall():
    """Four blocks end to end, their joints shut, against one of their length: flash and edges, to 2 %."""
    wall = {"shape": "box", "position": (0.0, 28.0), "size": (2.0, 0.4, 0.8)}
    bricks = [{**wall, "position": (north, 28.0), "size": (0.5, 0.4, 0.8)} for north in (-0.75, -0.25, 0.25, 0.75)]
    whole, parts = received([wall]), received(bricks)
    assert np.abs(parts - whole).max() < 0.02 * np.abs(whole).max()


@few_of((0, 2), "smooth", [-1.0, -0.4, 0.25])
def test_a_reflection_coefficient_is_a_factor_of_the_pressure(smooth):
    """Air turns the phase over; R scales what a rigid body returns, to single precision."""
    rigid, other = received_of("box"), received([{**BODIES["box"], "face_reflection_coefficient": smooth}])
    assert np.abs(other - smooth * rigid).max() < 1e-5 * np.abs(rigid).max()


@pytest.mark.parametrize(("name", "turn"), [("box", 0.9), ("cylinder", -2.2), ("sphere", 2.0)])
def test_a_turned_world_flashes_the_same(name, turn):
    """Ship and body turned together about the ship: pressure over time to 1 % of the strongest."""
    body = BODIES[name]
    c, s = np.cos(turn), np.sin(turn)
    north, east = body["position"]
    moved = {**body, "position": (c * north - s * east, s * north + c * east), "heading": body.get("heading", 0) + turn}
    here, there = received_of(name), received([moved], track={"window": (0.03, 0.045), "heading": turn})
    assert np.abs(there - here).max() < 0.01 * np.abs(here).max()


@pytest.mark.parametrize("name", BODIES)
def test_a_mirrored_body_is_received_the_same_by_a_symmetric_sonar(name):
    """North and south exchanged, heading and place: the same pressure, to 1 % of the strongest."""
    body = BODIES[name]
    north, east = body["position"]
    mirrored = {**body, "position": (-north, east), "heading": -body.get("heading", 0.0)}
    here, there = received_of(name), received([mirrored])
    assert np.abs(there - here).max() < 0.01 * np.abs(here).max()


def test_a_surface_target_and_its_image_are_one_scene():
    """A body under a mirror: D-S of it is minus D-D with the sonar's image for receiver, facet by facet.

    In mid-water, with hardly any bed: the receiver 22 m higher receives by D what the first receives by S.
    """
    body = {"shape": "box", "position": (0.0, 40.0), "size": (0.5, 0.4, 0.5), "base_depth": 9.0}
    by_mirror = flashes(body, 1)
    assert by_mirror["D", "S"] == pytest.approx(by_mirror["S", "D"], rel=1e-6)
    ahead = -0.25 + (np.arange(160) + 0.5) / 160 * 0.5
    n, z = (part.ravel() for part in np.meshgrid(ahead, 9.0 + ahead - 0.25))
    front = np.stack([n, np.full(n.size, 39.8), z], axis=1)
    expected = brute(front, (0.5 / 160) ** 2, np.array([0.0, -1.0, 0.0]), "D", "S", FREQUENCY)
    only = flashes(body, 1, facing=lambda place: np.abs(place[:, 1] - 39.8) < 1e-6)
    assert abs(only["D", "S"] - expected) < 0.02 * abs(only["D", "D"])
