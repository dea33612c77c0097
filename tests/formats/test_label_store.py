"""Labels on disk stand beside the sound, come back as they went in, and can be added later."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from insonify.formats import label_store
from insonify.formats.label_store import MANTISSA_BITS, labelled_pings, open_labels
from insonify.formats.zarr_store import StoreError, identity, open_recording
from insonify.plotting import labels as draw
from insonify.recording_run import record
from insonify.records.labels import COLUMNS
from insonify.simulator import build_simulator, label_ping, labels
from oracles.few_of import few_of
from oracles.scenes import nominal

PINGS = 3


def survey(**settings: object):
    """Three short pings past the nominal box."""
    line = {"kind": "line", "start": (-1.0, 0.0, 11.0), "speed": 2.0, "pings": PINGS, "interval": 0.5,
            "window": (0.1995, 0.2035), "position": None}  # fmt: skip
    track = {key: value for key, value in line.items() if value is not None}
    sonar = {"mounting": {"bearing": np.pi / 2}}
    made = dict(nominal(box={"label": "box"}, paths={"max_reflections": 0}, surface={"scattering": None}, sonar=sonar))
    return type(nominal())(**{**made, "track": track, "field": "incoherent", **settings})


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recorded first without labels, but for the last ping; then labelled."""
    path = tmp_path_factory.mktemp("labels") / "a.zarr"
    record(survey(), path, pings=[0, 1])
    with pytest.raises(StoreError, match="--labels"):
        open_labels(path)
    record(survey(), path, with_labels=True)
    return path


def test_labels_come_back_as_they_went_in(stored: Path) -> None:
    """Every column of every ping: intensities and angles to 2^-13, places and distances to half a millimetre."""
    held = open_labels(stored)
    assert labelled_pings(stored).all() and list(held.object.values) == ["seabed", "surface", "box"]
    for ping in range(PINGS):
        fresh = labels(survey(), ping)
        for name, (_, _, units, _) in COLUMNS.items():
            there, expected = held[name].values[ping], fresh[name].values
            if units in ("uPa^2", "rad"):
                np.testing.assert_allclose(there, expected, rtol=2.0 ** -(MANTISSA_BITS + 1) * 1.001)
            else:
                np.testing.assert_allclose(there, expected, rtol=0, atol=0.51e-3 if units == "m" else 0)


def test_the_sound_does_not_depend_on_its_labels(stored: Path, tmp_path: Path) -> None:
    """Recordings with labels and without hold the same bits."""
    record(survey(), tmp_path / "b.zarr", with_labels=False)
    np.testing.assert_array_equal(open_recording(stored).intensity, open_recording(tmp_path / "b.zarr").intensity)


def test_a_ping_cut_short_is_written_over(tmp_path: Path) -> None:
    """Torn and overlong chunks of a ping that is not yet in the mask: labelled anew, all columns are as they were."""
    path = tmp_path / "h.zarr"
    record(survey(), path, with_labels=True, pings=[1])
    before = open_labels(path).load()
    for name, change in (("position", lambda whole: whole[:100]), ("float32", lambda whole: 2 * whole)):
        (chunk,) = (path / "labels" / name).glob("c.1.*")
        chunk.write_bytes(change(chunk.read_bytes()))
    (path / "labels" / "done" / "c" / "1").unlink()
    record(survey(), path, with_labels=True, pings=[1])
    assert open_labels(path).load().identical(before)


def test_a_scenario_can_request_labels(tmp_path: Path) -> None:
    """`output.labels: true` is enough; only the pings requested are there, the others have no object."""
    record(survey(output={"labels": True}), tmp_path / "c.zarr", pings=[1])
    held = open_labels(tmp_path / "c.zarr")
    assert held.done.values.tolist() == [False, True, False]
    assert (held.strongest_object.values[0] == 255).all() and not held.shadow.values[0].any()
    assert np.isnan(held.expected_intensity.values[2]).all()


def test_labels_can_be_drawn(stored: Path, tmp_path: Path) -> None:
    """All pings as one picture, and one ping as traces."""
    for name, ping in (("all.png", None), ("one.png", 1)):
        assert draw(open_recording(stored), open_labels(stored), tmp_path / name, ping=ping).stat().st_size > 5000


def test_labels_of_a_run_that_was_replaced_are_not_in_the_new_recording(tmp_path: Path) -> None:
    """Another scenario overwrites a recording while the first run labels it: the first stops, the second is its own."""
    path, other = tmp_path / "d.zarr", survey(seed=9, targets=())

    def replaced(done: int, _: int) -> None:
        if done == 1:
            record(other, path, overwrite=True, with_labels=True, pings=[0])

    with pytest.raises(StoreError, match="replaced by another run"):
        record(survey(), path, with_labels=True, threads=1, on_ping=replaced)
    assert labelled_pings(path).tolist() == [True, False, False]
    record(other, path, with_labels=True)
    held = open_labels(path)
    assert list(held.object.values) == ["seabed", "surface"]
    for ping in range(PINGS):
        np.testing.assert_array_equal(held.strongest_object.values[ping], labels(other, ping).strongest_object.values)


@pytest.mark.parametrize(("north", "precision"), [(5e3, np.float32), (17e3, np.float64), (5.4e6, np.float64)])
def test_positions_are_kept_to_a_millimetre_at_any_distance_from_the_origin(
    tmp_path: Path, north: float, precision: type
) -> None:
    """Single precision within 16 km, where its steps are a binary millimetre; double beyond, as at a UTM northing."""
    there = survey(targets=(), **{"track": {**survey().track.model_dump(), "start": (north + 0.0003, 0.0, 11.0)}})
    record(there, tmp_path / "far.zarr", pings=[0], with_labels=True)
    held, expected = open_labels(tmp_path / "far.zarr").position, label_ping(build_simulator(there), 0).position
    assert held.dtype == precision
    np.testing.assert_allclose(held.values[0], expected, rtol=0, atol=0.51e-3)


@pytest.mark.parametrize("moment", [1, 2, 3])
def test_a_run_replaced_while_it_writes_labels_leaves_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: int
) -> None:
    """Another recording with labels takes its place at one of the checks: none of its labels is of the first run."""
    path, own, calls = tmp_path / "h.zarr", label_store.require_own_recording, list[int]()
    record(survey(), path, pings=[0], with_labels=True)
    mine, other = identity(path), survey(seed=9, targets=())

    def replaced(where: Path, into: str | None) -> str:
        found = own(where, into)
        calls.append(1)
        if len(calls) == moment:
            monkeypatch.setattr(label_store, "require_own_recording", own)
            record(other, path, overwrite=True, with_labels=True, pings=[2])
        return found

    monkeypatch.setattr(label_store, "require_own_recording", replaced)
    with pytest.raises(StoreError, match="replaced by another run"):
        label_store.write_label_ping(path, 1, label_ping(build_simulator(survey()), 1), into=mine)
    assert labelled_pings(path).tolist() == [False, False, True]
    assert not open_labels(path).highlight.values[1].any()


def test_a_run_without_labels_replaces_those_that_were_there(tmp_path: Path) -> None:
    """Overwritten without labels, the recording has none, though the first run goes on to write some."""
    path = tmp_path / "e.zarr"

    def replaced(done: int, _: int) -> None:
        if done == 1:
            record(survey(seed=9), path, overwrite=True, with_labels=False)

    with pytest.raises(StoreError, match="replaced by another run"):
        record(survey(), path, with_labels=True, threads=1, on_ping=replaced)
    with pytest.raises(StoreError, match="has no labels"):
        open_labels(path)
    assert not list(path.glob("labels*"))


def test_labels_that_strayed_in_are_reported_and_made_again(tmp_path: Path) -> None:
    """A folder of labels of another recording is refused, and labelling again makes room for its own."""
    one, two = tmp_path / "f.zarr", tmp_path / "g.zarr"
    record(survey(), one, with_labels=True, pings=[0])
    record(survey(), two, pings=[0])
    shutil.copytree(one / "labels", two / "labels")
    with pytest.raises(StoreError, match="labels of another recording"):
        open_labels(two)
    record(survey(), two, with_labels=True, pings=[0])
    np.testing.assert_array_equal(open_labels(two).highlight, open_labels(one).highlight)


@few_of((1,), "field", ["incoherent", "coherent"])
def test_labels_are_the_same_for_any_threads_and_after_resuming(tmp_path: Path, field: str) -> None:
    """In one go by two threads, ping by ping by one, or added to a finished recording: the same bits, sound and labels.

    Enough pings that threads share them.
    """
    scenario = survey(field=field)
    scenario = scenario.model_copy(update={"track": scenario.track.model_copy(update={"pings": 6})})
    whole, parts, later = (tmp_path / name for name in ("whole.zarr", "parts.zarr", "later.zarr"))
    record(scenario, whole, with_labels=True, threads=2)
    for pings in ([3], [0, 1], [5, 2, 4]):
        record(scenario, parts, with_labels=True, threads=1, pings=pings)
    record(scenario, later, threads=2)
    record(scenario, later, with_labels=True, threads=2)
    for other in (parts, later):
        for opened in (open_labels, open_recording):
            first, second = opened(whole).load(), opened(other).load()
            for name in first.variables:
                np.testing.assert_array_equal(first[name], second[name], err_msg=name)
