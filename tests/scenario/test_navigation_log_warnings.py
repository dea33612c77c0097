"""Logs that jump or pause, profiles with tiny steps, angles without a unit: each gets a warning with its number."""

import warnings

import numpy as np
import pytest

from insonify.estimates.run_cost import estimate_cost
from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator
from insonify.validity import PhysicsWarning
from oracles.scenes import nominal


def warnings_of(**changes):
    """The cautions of a scenario with a receiver of one beam."""
    line = {"kind": "line", "length": 1.5}
    sonar = {
        "source_level_db": 220, "pulse": {"frequency": 100e3, "duration": 0.2e-3, "taper_fraction": 0.2},
        "transmit": line, "receive": line,
    }  # fmt: skip
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        Scenario(**{"sonar": sonar, "track": {"kind": "static", "position": (0, 0, 11)}, **changes})
    assert all(word.category is PhysicsWarning for word in caught)
    return [str(word.message) for word in caught]


def logged(tmp_path, north, time=None, **changes):
    """A track from a log that runs along north, one row a second, 5 m deep; line 2 of the file is its first row."""
    time = np.arange(len(north), dtype=float) if time is None else time
    rows = [f"{t:g},{n:g},0,5,0" for t, n in zip(time, north, strict=True)]
    file = tmp_path / "log.csv"
    file.write_text("\n".join(["time,north,east,depth,heading [deg]", *rows]) + "\n")
    return {"kind": "navigation", "file": str(file), "interval": 1.0, "window": (0.0, 0.1), **changes}


def test_a_steady_log_gives_no_cause(tmp_path):
    """2 m/s, then 14.9 m/s: a fast boat, but a boat."""
    assert warnings_of(track=logged(tmp_path, [0.0, 2.0, 4.0, 18.9, 33.8])) == []


def test_a_jump_is_reported_with_its_file_and_row(tmp_path):
    """40 m in a second, there and back: the first by its line, the other counted."""
    (word,) = warnings_of(track=logged(tmp_path, [0.0, 2.0, 44.0, 6.0, 8.0]))
    assert word.startswith(f"track.file: {tmp_path / 'log.csv'}, line 4: 42 m from the row before it in 1 s is 42 m/s")
    assert "1 more row;" in word and "15 m/s" in word


def test_a_jump_outside_of_the_pings_is_ignored(tmp_path):
    """Two pings before it request no row of it."""
    assert warnings_of(track=logged(tmp_path, [0.0, 2.0, 4.0, 6.0, 99.0], pings=2)) == []


def test_a_pause_that_is_allowed_is_still_reported(tmp_path):
    """60 s without a row, allowed by longest_gap: stated with the line after it."""
    time = np.array([*range(10), *range(69, 80)], float)
    track = logged(tmp_path, 0.1 * time, time, longest_gap=100.0)
    (word,) = warnings_of(track=track)
    assert "line 12: the log has a gap of 60 s before this line" in word


def test_knots_of_a_profile_a_hair_apart_are_reported():
    """0.2 mm between two knots: their gradient is noise; 1 mm is none of it."""
    profile = [[0.0, 1500.0], [5.0, 1500.0], [5.0002, 1500.1], [20.0, 1500.1]]
    gaps = [word for word in warnings_of(water={"profile": profile}) if "apart" in word]
    assert len(gaps) == 1 and "5 m and 5.0002 m are 0.0002 m apart" in gaps[0] and "500 1/s" in gaps[0]
    profile[2][0] = 5.001
    assert not [word for word in warnings_of(water={"profile": profile}) if "apart;" in word]


@pytest.mark.parametrize(("steer", "way_out"), [(45.0, "write 45 deg"), (-22.5, "write -22.5 deg"),
                                                (np.radians(100.0), "mounting.bearing")])  # fmt: skip
def test_an_angle_without_its_unit_is_guessed(steer, way_out):
    """45 is 45 rad, and surely 45 degrees were meant; 100 degrees are too much in any unit."""
    with pytest.raises(ValueError, match=way_out):
        nominal(receive={"steer": [steer]})


def test_the_cost_of_relief_depends_on_its_height(tmp_path):
    """A bank that rises to 3 m under the sonar is received in a window too short for its mean plane."""
    nodes = np.arange(-40.0, 41.0, 1.0)
    depth = 20 - 6 * np.exp(-(nodes[:, None] ** 2 + nodes[None, :] ** 2) / 200)
    np.savez(tmp_path / "bank.npz", depth=depth, north=nodes, east=nodes)
    bank = {"relief": {"kind": "grid", "file": str(tmp_path / "bank.npz"), "origin": (0.0, 0.0)}, "depth": 20.0}
    short = {"window": (0.002, 0.007)}
    counts = [
        estimate_cost(nominal(seabed=bed, track=short, paths={"max_reflections": 0})).scatterers for bed in ({}, bank)
    ]
    assert counts[0] == 0 and counts[1] > 100


@pytest.mark.parametrize(("depth", "what"), [(0.0004, "0.4 mm of the sea surface"), (19.9996, "0.4 mm of the seabed")])
def test_a_sonar_that_touches_a_boundary_is_reported(depth, what):
    """0.4 mm of water at 100 kHz: stated with the wavelength and a distance that does; 2 cm are enough for silence."""
    (word,) = warnings_of(track={"kind": "static", "position": (0, 0, depth)})
    assert what in word and "wavelength (15 mm)" in word and "0.1 m away" in word
    assert warnings_of(track={"kind": "static", "position": (0, 0, 0.02)}) == []


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_the_work_near_a_boundary_is_bounded(field):
    """A tenth of a millimetre from the bed requests hardly more blocks of ground than a centimetre does."""
    counts = []
    for depth in (19.99, 19.9999):
        simulator = build_simulator(nominal(field=field, track={"position": (0.0, 0.0, depth), "window": (0.0, 0.05)}))
        counts.append(len(simulator.engine.blocks(simulator.ping_geometry(0), quadrature=field == "incoherent")))
    assert counts[1] < 1.1 * counts[0]
