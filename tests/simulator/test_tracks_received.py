"""Claims about what is received along a track that turns, sways and dives.

Places keep their scatterers, worlds move.
"""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.simulator import build_simulator, simulate
from oracles.scenes import nominal

LOW = (1 << 27) - 1  # the bits of one of a cell's two numbers
MOTION = {"roll": {"rms": "2 deg", "period": 5}, "heave": {"rms": 0.2, "period": 6}}
ROUND = {
    "kind": "waypoints", "waypoints": ((0, 0, 9), (20, 0, 11), (20, 20, 11)), "turn_radius": 8, "speed": 2,
    "interval": 0.5, "window": (0.03, 0.034), "motion": MOTION,
}  # fmt: skip
SIDES = {"sides": ["port", "starboard"]}


def scene(track, **changes):
    """A survey with both sides, direct paths, over a bed alone."""
    scenario = nominal(sonar=SIDES, paths={"max_reflections": 0, "contributions": ["seabed"]}, **changes)
    plain = scenario.model_dump(mode="json", exclude={"track"})
    return type(scenario)(**plain, track=track)


def test_a_place_keeps_its_scatterer_along_a_track_that_turns_and_heaves():
    """Wherever two pings meet the same ground, it has the same points: no coarser and no finer ones."""
    diving = {**ROUND, "waypoints": ((0, 0, 4), (20, 0, 17), (20, 20, 17)), "window": (0.012, 0.06)}
    simulator = build_simulator(scene(diving, line={"length": 0.12}))
    here = [side for ping in (0, 12, 25) for side in simulator.ping_geometries(ping)[1:]]
    seen = [np.concatenate([block().scatterer_id for block in simulator.engine.blocks(side)]) for side in here]
    cells = np.unique(np.concatenate(seen))
    level, row, column = (part.astype(np.int64) for part in (cells >> 54 & 31, cells >> 27 & LOW, cells & LOW))
    assert len(cells) < sum(map(len, seen))  # there is something to compare
    row, column = row - (1 << 26), column - (1 << 26)
    for coarse in np.unique(level)[1:]:
        wide = row[level == coarse] * LOW + column[level == coarse]
        for fine in range(coarse):
            small, up = level == fine, coarse - fine
            assert not np.isin(
                (row[small] >> up) * LOW + (column[small] >> up), wide
            ).any()  # no cell holds a finer one


def test_a_scene_moved_as_a_whole_sounds_the_same():
    """Track and lattice moved and turned together: the same echoes, but for rounding in the places."""
    received = simulate(scene(ROUND), pings=[14]).pressure.values
    c, s = np.cos(0.6), np.sin(0.6)
    moved = [(1000 + c * n - s * e, -500 + s * n + c * e, z) for n, e, z in ROUND["waypoints"]]
    bed = {"depth": 20.0, "scattering": {"law": "lambert"}, "reflection": 0.35,
           "scatterer_grid": {"origin": (1000, -500), "heading": 0.6}}  # fmt: skip
    again = simulate(scene({**ROUND, "waypoints": moved}, seabed=bed), pings=[14]).pressure.values
    error = np.sqrt(np.mean(np.abs(again - received) ** 2) / np.mean(np.abs(received) ** 2))
    assert error < 1e-4


def test_truth_and_log_stand_side_by_side_in_the_recording():
    """Position and attitude are true; the logged ones are wrong by what was requested.

    The sound depends only on the truth.
    """
    wrong = {"north": {"offset": "3 m"}, "roll": {"noise": "1 deg"}}
    track = {"kind": "line", "start": (0, 0, 11), "speed": 2, "pings": 3, "window": (0.05, 0.051)}
    plain, logged = (simulate(scene({**track, "navigation_errors": errors})) for errors in ({}, wrong))
    np.testing.assert_array_equal(plain.pressure, logged.pressure)
    np.testing.assert_array_equal(plain.logged_position, plain.position)
    np.testing.assert_allclose(logged.logged_position - logged.position, [[3, 0, 0]] * 3)
    assert np.ptp(logged.logged_attitude.values[:, 2]) > 0 and np.ptp(logged.attitude.values) == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"waypoints": ((0, 0, 9), (40, 0, 21))}, r"track.waypoints: ping 39, the first of 3 such pings, puts the port "
                                                  r"transmit array at or below the seabed \(20 m\), at 20.2"),
        ({"waypoints": ((0, 0, 1), (40, 0, 0.1)), "motion": {"heave": {"rms": 0.5, "period": 4}}},
         r"puts the port transmit array at or above the sea surface \(0 m\)"),
        ({"waypoints": ((0, 0, 25), (40, 0, 25)), "motion": {}},
         r"track.waypoints: 25 m puts the port transmit array at or below the seabed"),
    ],
)  # fmt: skip
def test_a_track_through_a_boundary_is_refused_with_its_ping(changes, message):
    """Ping and depth; with motion too."""
    with pytest.raises(ValidationError, match=message):
        scene({**ROUND, "turn_radius": 0, "motion": {}} | changes)
