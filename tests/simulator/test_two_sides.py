"""Port and starboard over one bed: mirrored worlds, rolling ships, pings in any order, ground that stays."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator, simulate
from oracles.few_of import few_of

PANEL = {"kind": "planar", "width": 0.3, "height": 0.02}
SHIP: dict[str, Any] = {
    "seed": 8,
    "field": "incoherent",
    "water": {"noise_level_db": None},
    "surface": {"scattering": None},
    "seabed": {
        "depth": 10.0, "scattering": {"law": "lambert", "strength_db": -27}, "reflection": 0.35,
        "relief": {"kind": "ripples", "height": 0.04, "wavelength": 1.5},
    },
    "sonar": {
        "source_level_db": 220, "pulse": {"kind": "cw", "frequency": "100 kHz", "duration": "0.2 ms"},
        "transmit": PANEL, "receive": PANEL, "mounting": {"bearing": "90 deg", "tilt": "20 deg"},
        "sides": ["port", "starboard"],
    },
    "track": {"kind": "static", "position": [0.0, 0.0, 4.0], "window": [0.0, "45 ms"]},
    "paths": {"max_reflections": 2, "edge_diffraction": "none"},
}  # fmt: skip
GROUND = slice(350, 1050)


def ship(**changes: Any) -> Scenario:
    """The scene with other parts."""
    return Scenario.model_validate({**SHIP, **{k: {**SHIP[k], **v} if isinstance(v, dict) else v
                                              for k, v in changes.items()}})  # fmt: skip


def sides(**changes: Any) -> np.ndarray:
    """Intensity by port and by starboard, shape (2, samples)."""
    return np.asarray(simulate(ship(**changes)).intensity.values[0])


def level(one: np.ndarray, other: np.ndarray, part: slice = GROUND) -> float:
    """Mean level of one over that of another [dB]."""
    return float(10 * np.log10(one[part].mean() / other[part].mean()))


FRACTAL = {"kind": "power-law", "hurst": 0.8, "rms": "3 cm"}
CRATE = {"shape": "box", "label": "crate", "size": [4.0, 2.0, 1.5]}


@pytest.mark.parametrize("order", [0, 2])
def test_a_crate_to_port_is_received_as_the_same_crate_to_starboard(order):
    """Ripples that run to the east are their own mirror image: echo and shadow to 0.3 dB, bare ground to 0.05 dB.

    Points on the crate are placed along its own axes, not mirrored ones.
    """
    where = {"paths": {"max_reflections": order}}
    left = sides(targets=[{**CRATE, "position": [0.3, -20.0], "heading": -0.2}], **where)
    right = sides(targets=[{**CRATE, "position": [0.3, 20.0], "heading": 0.2}], **where)
    assert level(left[1], right[0]) == pytest.approx(0, abs=0.05)
    for part in (GROUND, slice(640, 680), slice(700, 780)):
        assert level(left[0], right[1], part) == pytest.approx(0, abs=0.3)


@pytest.mark.parametrize("roll", [5.0, 12.0])
def test_a_roll_gives_to_one_side_what_it_takes_from_the_other(roll):
    """Rolled to starboard, starboard receives what port does rolled to port; and unlike without."""
    there, back = (sides(track={"roll": f"{sign * roll} deg"}) for sign in (1, -1))
    assert level(there[1], back[0]) == pytest.approx(0, abs=0.05)
    assert level(there[0], back[1]) == pytest.approx(0, abs=0.05)
    assert abs(level(there[0], there[1])) > 0.5


def test_a_ship_that_goes_the_other_way_receives_the_other_side():
    """Turned by half a circle, port receives what starboard received: the same ground, to 0.1 dB in any 2 ms."""
    fractal = {"relief": FRACTAL}
    ahead = sides(seabed=fractal)
    astern = sides(seabed=fractal, track={"heading": "180 deg"})
    for k in (0, 1):
        runs = [x[GROUND].reshape(-1, 50).mean(axis=1) for x in (ahead[k], astern[1 - k])]
        np.testing.assert_allclose(10 * np.log10(runs[0] / runs[1]), 0, atol=0.15)
    assert np.abs(10 * np.log10(ahead[0] / ahead[1])[GROUND]).max() > 1


def test_each_side_alone_is_that_side_of_both():
    """A sonar of one side receives no less and no more than it does beside the other: bit for bit."""
    both = sides()
    for k, name in enumerate(("port", "starboard")):
        np.testing.assert_array_equal(sides(sonar={"sides": [name]})[0], both[k])


@cache
def sides_of_a_crate() -> np.ndarray:
    """Intensity on both sides of a crate to starboard on a fractal bed."""
    return sides(seabed={"relief": FRACTAL}, targets=[{**CRATE, "position": [0.3, 20.0]}])


@few_of((1,), "turn_deg", [35.0, 200.0])
def test_a_moved_world_sounds_the_same_on_both_sides(turn_deg):
    """Ship, crate and lattice turned and moved by hundreds of metres: within 0.05 dB in the mean, 0.2 dB rms."""
    turn, away = np.radians(turn_deg), np.array([420.0, -130.0])
    c, s = np.cos(turn), np.sin(turn)
    place = np.array([[c, -s], [s, c]]) @ [0.3, 20.0] + away
    here = sides_of_a_crate()
    there = sides(
        seabed={"relief": FRACTAL, "scatterer_grid": {"origin": tuple(away), "heading": turn}},
        track={"position": [*away, 4.0], "heading": turn},
        targets=[{**CRATE, "position": tuple(place), "heading": turn}],
    )
    for k in (0, 1):
        ratio = 10 * np.log10(there[k, GROUND] / here[k, GROUND])
        assert abs(level(there[k], here[k])) < 0.05 and ratio.std() < 0.2


SURVEY = {
    "kind": "line", "start": [0.0, 0.0, 4.0], "heading": 0.3, "speed": "3 m/s", "pings": 8, "interval": 0.2,
    "window": [0.0, "20 ms"],
    "motion": {"roll": {"rms": "3 deg", "period": 4.0}, "heave": {"rms": 0.2, "period": 5.0},
               "yaw": {"rms": "2 deg", "period": 7.0}},
}  # fmt: skip


def surveyed() -> Scenario:
    """Eight pings of a ship that rolls, heaves and yaws over a fractal bed with a crate."""
    fractal = {**SHIP["seabed"], "relief": FRACTAL}
    values = {
        **SHIP,
        "seabed": fractal,
        "track": SURVEY,
        "targets": [{**CRATE, "position": [2.0, 9.0], "size": [0.5, 0.3, 0.3]}],
    }
    return Scenario.model_validate({**values, "paths": {"max_reflections": 1}})


@pytest.fixture(scope="module")
def whole() -> np.ndarray:
    """All pings, received side by side."""
    return np.asarray(simulate(surveyed(), threads=2).intensity.values)


@settings(max_examples=5, deadline=None)
@given(pings=st.lists(st.integers(0, 7), min_size=1, max_size=6), threads=st.integers(1, 5))
def test_any_pings_in_any_order_are_those_of_the_survey(whole, pings, threads):
    """Some of them, some twice, by any number of threads: not one bit differs."""
    np.testing.assert_array_equal(simulate(surveyed(), pings=pings, threads=threads).intensity.values, whole[pings])


def test_a_ping_of_a_survey_is_that_of_a_ship_that_lies_still_there():
    """Of a ship that stops and hops, place and attitude of a ping are all that matters, to a millionth."""
    described = surveyed()
    scenario = described.model_copy(update={"track": described.track.model_copy(update={"stop_and_hop": True})})
    whole = simulate(scenario).intensity.values
    poses = build_simulator(scenario).platforms.transmitter_poses
    for ping in (1, 6):
        yaw, pitch, roll = (float(angle) for angle in poses.attitude[ping])
        still = {"kind": "static", "position": tuple(float(x) for x in poses.position[ping]), "roll": roll,
                 "pitch": pitch, "heading": yaw % (2 * np.pi), "window": SURVEY["window"]}  # fmt: skip
        alone = simulate(
            Scenario.model_validate({**scenario.model_dump(mode="json", exclude={"track"}), "track": still})
        )
        np.testing.assert_allclose(alone.intensity.values[0], whole[ping], rtol=1e-4)
