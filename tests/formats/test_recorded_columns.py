"""Columns beside the sound on disk: sides, the truth and the log, for new stores and for old ones."""

import json
import shutil

import numpy as np
import pytest

from insonify.formats.zarr_store import create_recording, open_recording, write_ping
from insonify.recording_run import record
from insonify.records.recording import COLUMNS, OPTIONAL_COLUMNS, RecordingLayout
from insonify.simulator import simulate
from oracles.scenes import nominal, point

SAME = {"scenario": "title: here", "seed": 1, "version": "0"}
PINGS, CHANNELS, SAMPLES = 4, 2, 30


def layout(**changes):
    """A line of pings of a sonar with two sides, and a log that is not quite true."""
    place = np.arange(3.0 * PINGS).reshape(PINGS, 3)
    settings = {
        "time": np.arange(SAMPLES) / 25e3, "ping_time": 0.3 * np.arange(PINGS), "steer": np.zeros(CHANNELS),
        "position": place, "attitude": place / 100, "logged_position": place + 0.5, "logged_attitude": place / 90,
        "side": np.array([-1.0, 1.0]),
    }  # fmt: skip
    return RecordingLayout(field="pressure", **{**settings, **changes})


@pytest.mark.parametrize("name", COLUMNS)
def test_every_column_comes_back_as_it_went_in(tmp_path, name):
    """Bit by bit, with its dimensions, its unit and its meaning."""
    create_recording(tmp_path / "a.zarr", layout(), SAME)
    held = open_recording(tmp_path / "a.zarr")
    dims, unit, meaning = COLUMNS[name]
    np.testing.assert_array_equal(held[name].values, getattr(layout(), name))
    assert held[name].dims == dims
    assert held[name].attrs["units"] == unit and held[name].attrs["long_name"] == meaning


def test_a_store_of_an_earlier_version_still_opens(tmp_path):
    """Without sides and a log it reports nothing of them, and everything else is there."""
    path = tmp_path / "old.zarr"
    create_recording(path, layout(), SAME)
    for name in OPTIONAL_COLUMNS:
        shutil.rmtree(path / name)
    whole = path / "zarr.json"
    settings = json.loads(whole.read_text())
    kept = settings.get("consolidated_metadata")
    if kept:
        for name in OPTIONAL_COLUMNS:
            kept["metadata"].pop(name, None)
        whole.write_text(json.dumps(settings))
    held = open_recording(path)
    for name in COLUMNS:
        assert (name in held) == (name not in OPTIONAL_COLUMNS)
    np.testing.assert_array_equal(held["position"].values, layout().position)


def test_the_same_recording_from_memory_and_from_disk(tmp_path):
    """`simulate` and `record` write the same sound and the same columns."""
    scenario = _survey()
    path = record(scenario, tmp_path / "b.zarr")
    here, there = simulate(scenario), open_recording(path)
    np.testing.assert_array_equal(here["pressure"].values, there["pressure"].values)
    for name in COLUMNS:
        np.testing.assert_array_equal(here[name].values, there[name].values)


def _survey():
    """Three pings of a two-sided sonar along a line, logged a metre off."""
    plain = nominal(targets=[point(0, 30, 19.5)], paths={"contributions": ["target"]})
    settings = plain.model_dump()
    settings["sonar"]["sides"] = ["port", "starboard"]
    settings["track"] = {
        "kind": "line", "start": (0, 0, 11), "speed": 2.0, "pings": 3, "window": (0.03, 0.06),
        "navigation_errors": {"north": {"offset": 1.0}},
    }  # fmt: skip
    return type(plain)(**settings)


def test_truth_and_log_are_both_kept():
    """The platform is where it was planned; its log states a metre further north."""
    held = simulate(_survey())
    np.testing.assert_allclose(held["position"].values[:, 0], [0, 0.6, 1.2])
    np.testing.assert_allclose(held["logged_position"].values[:, 0], [1, 1.6, 2.2])
    np.testing.assert_array_equal(held["side"].values, [-1, 1])


def test_a_target_to_starboard_of_a_ship_heading_north_is_received_east():
    """North is ahead: a point to the east is strong on the starboard channel and weak to port."""
    held = simulate(_survey())
    energy = np.sum(np.abs(held["pressure"].values) ** 2, axis=(0, 2))
    port, starboard = (energy[int(np.flatnonzero(held["side"].values == side)[0])] for side in (-1, 1))
    assert starboard > 1e4 * port


def test_pings_may_be_written_in_any_order(tmp_path):
    """The columns stand beside whatever has been written."""
    create_recording(tmp_path / "c.zarr", layout(), SAME)
    for ping in (2, 0):
        write_ping(tmp_path / "c.zarr", ping, np.full((CHANNELS, SAMPLES), ping + 1, np.complex64))
    held = open_recording(tmp_path / "c.zarr")
    assert held["done"].values.tolist() == [True, False, True, False]
    np.testing.assert_array_equal(held["ping_time"].values, layout().ping_time)
