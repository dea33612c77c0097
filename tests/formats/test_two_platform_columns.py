"""Positions of a receiver's own platform: columns that exist exactly when there is one, and round trips."""

import numpy as np
import pytest

from insonify.formats.zarr_store import create_recording, open_recording, write_ping
from insonify.records.recording import BISTATIC_COLUMNS, COLUMNS, RecordingLayout, columns_of, recording_dataset

SAME = {"scenario": "title: here", "seed": 1, "version": "0"}
PINGS, CHANNELS, SAMPLES = 3, 2, 20


def layout(**changes):
    """Three pings; of two platforms if their receiver's poses are among the changes."""
    place = np.arange(3.0 * PINGS).reshape(PINGS, 3)
    settings = {
        "time": np.arange(SAMPLES) / 25e3, "ping_time": 0.3 * np.arange(PINGS), "steer": np.zeros(CHANNELS),
        "position": place, "attitude": place / 100,
    }  # fmt: skip
    return RecordingLayout(field="pressure", **{**settings, **changes})


def apart():
    """Poses of the receiver's platform, each column with numbers of its own."""
    place = np.arange(3.0 * PINGS).reshape(PINGS, 3)
    return {name: place * 7 + row for row, name in enumerate(BISTATIC_COLUMNS)}


@pytest.mark.parametrize("name", BISTATIC_COLUMNS)
def test_a_receivers_own_poses_come_back_as_they_went_in(tmp_path, name):
    """From disk and from memory, with dimensions, unit and meaning; the column states that it is the receiver's."""
    two = layout(**apart())
    create_recording(tmp_path / "two.zarr", two, SAME)
    stored = open_recording(tmp_path / "two.zarr")
    held = recording_dataset(two, SAME, np.zeros((PINGS, CHANNELS, SAMPLES), np.complex64), np.arange(PINGS))
    dims, unit, meaning = BISTATIC_COLUMNS[name]
    for found in (stored[name], held[name]):
        np.testing.assert_array_equal(found.values, apart()[name])
        assert found.dims == dims and found.attrs["units"] == unit
        assert found.attrs["long_name"] == meaning and "receiver" in meaning


def test_one_platform_has_no_columns_of_a_second(tmp_path):
    """Neither in memory nor on disk: `receiver_position` is there for two platforms alone."""
    one = layout()
    assert columns_of(one) == COLUMNS and set(columns_of(layout(**apart()))) == {*COLUMNS, *BISTATIC_COLUMNS}
    create_recording(tmp_path / "one.zarr", one, SAME)
    held = recording_dataset(one, SAME, np.zeros((1, CHANNELS, SAMPLES), np.complex64), np.array([1]))
    for found in (held, open_recording(tmp_path / "one.zarr")):
        assert not set(BISTATIC_COLUMNS) & set(found.variables)


@pytest.mark.parametrize("expected", [[0], [2, 0], [1, 2]])
def test_a_part_of_a_survey_has_the_poses_of_its_own_pings(expected):
    """Rows of both platforms follow the pings that were requested, in their order."""
    held = recording_dataset(
        layout(**apart()), SAME, np.zeros((len(expected), CHANNELS, SAMPLES), np.complex64), np.array(expected)
    )
    for name, values in apart().items():
        np.testing.assert_array_equal(held[name].values, values[expected])
    np.testing.assert_array_equal(held["position"].values, layout().position[expected])


@pytest.mark.parametrize("name", BISTATIC_COLUMNS)
def test_a_column_that_is_too_short_is_refused(name):
    """Named, with its shape and the one that it should have."""
    with pytest.raises(ValueError, match=rf"Layout.{name} has shape \(2, 3\); it should be \(3, 3\)"):
        layout(**{**apart(), name: apart()[name][:2]})


def test_a_log_left_out_is_the_truth():
    """A receiver whose log is not given has logged where it was."""
    some = {name: values for name, values in apart().items() if not name.startswith("logged")}
    two = layout(**some)
    for name in ("position", "attitude"):
        np.testing.assert_array_equal(getattr(two, f"logged_receiver_{name}"), getattr(two, f"receiver_{name}"))


def test_a_survey_goes_on_with_the_poses_it_began_with(tmp_path):
    """Pings written one by one, the store opened in between: both platforms stay where they were."""
    path = tmp_path / "two.zarr"
    create_recording(path, layout(**apart()), SAME)
    for ping in (1, 0):
        write_ping(path, ping, np.full((CHANNELS, SAMPLES), ping + 1, np.complex64))
        np.testing.assert_array_equal(open_recording(path)["receiver_position"].values, apart()["receiver_position"])
