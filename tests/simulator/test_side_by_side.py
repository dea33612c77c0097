"""A survey of quick pings, several at a time: the same as one after the other, in order, and safe to break off."""

import os
import signal
import threading
from multiprocessing import active_children
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from insonify import recording_run
from insonify import simulator as simulator_module
from insonify.forked_workers import ITEMS_AHEAD, WorkerProcessError, can_fork
from insonify.formats.label_store import open_labels
from insonify.formats.zarr_store import open_recording, recorded_pings
from insonify.recording_run import record
from insonify.scenario.scenario import Scenario
from insonify.simulator import QUEUED_PINGS, Simulator, build_simulator, simulate, simulate_pings
from insonify.sonar.ping_geometry import PingGeometry
from oracles.few_of import few_of

PINGS = 12
SURVEY: dict[str, Any] = {
    "seed": 3,
    "field": "incoherent",
    "water": {"noise_level_db": 60.0},
    "seabed": {"depth": 10.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": "3 cm"}},
    "targets": [{"shape": "library", "name": "tyre", "position": [2.0, 15.0]}],
    "sonar": {
        "source_level_db": 220,
        "pulse": {"kind": "cw", "frequency": "100 kHz", "duration": "0.2 ms"},
        "transmit": {"kind": "planar", "width": 0.3, "height": 0.02},
        "receive": {"kind": "planar", "width": 0.3, "height": 0.02},
        "mounting": {"bearing": "90 deg", "tilt": "20 deg"},
        "sides": ["port", "starboard"],
    },
    "track": {
        "kind": "line", "start": [0.0, 0.0, 4.0], "heading": 0.0, "speed": "3 m/s", "pings": PINGS, "interval": 0.1,
        "window": [0.0, "24 ms"], "motion": {"roll": {"rms": "2 deg", "period": 4.0}},
    },
    "paths": {"max_reflections": 0},
}  # fmt: skip


def survey(**changes: Any) -> Scenario:
    """Twelve pings past a tyre on fractal ground, rolling."""
    return Scenario.model_validate({**SURVEY, **changes})


@few_of((1,), "field", ["incoherent", "coherent"])
def test_any_number_of_threads_gives_the_same_bits(field: str) -> None:
    """One, two, five and sixteen threads, together and ping by ping, forwards and backwards: not one bit differs."""
    simulator = build_simulator(survey(field=field))
    pings = list(range(8))
    assert simulator_module._pings_fit_concurrently(simulator)
    first = dict(simulate_pings(simulator, pings, 1))
    assert list(first) == pings
    for order, threads in ((pings, 2), (pings[::-1], 5), (pings, 16), ([7], 1), ([3, 3, 6, 0], 2)):
        again = list(simulate_pings(build_simulator(survey(field=field)), order, threads))
        assert [ping for ping, _ in again] == order
        for ping, series in again:
            np.testing.assert_array_equal(series, first[ping])


def test_only_a_few_pings_are_begun_before_they_are_requested(monkeypatch: pytest.MonkeyPatch) -> None:
    """Memory does not grow with the survey: pings begun less pings given never exceed threads and the few ahead."""
    begun, received, lock = [0], simulator_module.record_ping, threading.Lock()

    def counted(*arguments: Any) -> Any:
        with lock:
            begun[0] += 1
        return received(*arguments)

    monkeypatch.setattr(simulator_module, "record_ping", counted)
    for reported, _ in enumerate(simulate_pings(build_simulator(survey()), range(PINGS), 2), start=1):
        assert begun[0] - reported < 2 + QUEUED_PINGS
    assert begun[0] == PINGS


def test_a_ping_that_fails_stops_the_survey_at_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those before it are reported, the error is its own, and most of those after it are never begun."""
    begun, received = [], simulator_module.record_ping

    def failing(simulator: Simulator, sides: list[PingGeometry], pool: Any) -> Any:
        begun.append(sides[0].ping)
        if sides[0].ping == 4:
            raise ZeroDivisionError("the fifth")
        return received(simulator, sides, pool)

    monkeypatch.setattr(simulator_module, "record_ping", failing)
    found = []
    with pytest.raises(ZeroDivisionError, match="the fifth"):
        for ping, _ in simulate_pings(build_simulator(survey()), range(PINGS), 2):
            found.append(ping)
    assert found == [0, 1, 2, 3]
    assert max(begun) <= 4 + 2 + QUEUED_PINGS


@pytest.mark.parametrize("forked", [True, False])
def test_a_survey_broken_off_goes_on_with_the_same_bits(
    forked: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Stopped when five pings were given: five are there, or a few more of processes; the rest gives the same bits."""
    path, progress, threads = tmp_path / "line.zarr", [], set(threading.enumerate())
    if not forked:
        monkeypatch.setattr(recording_run, "can_fork", lambda: False)

    def stop(done: int, total: int) -> None:
        assert total == PINGS
        if done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record(survey(), path, threads=3, on_ping=stop)
    there = np.flatnonzero(recorded_pings(path))
    if forked:
        assert 5 <= len(there) <= 5 + 3 * ITEMS_AHEAD
    else:
        np.testing.assert_array_equal(there, range(5))
    record(survey(), path, threads=2, on_ping=lambda *n: progress.append(n))
    assert progress == [(n, PINGS) for n in range(len(there), PINGS + 1)]
    np.testing.assert_array_equal(open_recording(path).intensity.values, simulate(survey(), threads=1).intensity)
    started = set(threading.enumerate()) - threads
    assert not any(thread.name.startswith("ThreadPoolExecutor") for thread in started)
    assert not active_children()


@pytest.mark.skipif(not can_fork(), reason="worker processes are forked on Linux alone")
@few_of((1,), "field", ["incoherent", "coherent"])
def test_processes_record_what_threads_do(field: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pings and labels written by three processes are those of two threads and of one, bit for bit."""
    written, simulated = set[int](), simulator_module.simulate_job

    def noted(simulator: Simulator, job: simulator_module.Job, pool: Any) -> Any:
        written.add(job.ping)
        return simulated(simulator, job, pool)

    monkeypatch.setattr(recording_run, "simulate_job", noted)
    monkeypatch.setattr(simulator_module, "simulate_job", noted)
    found = []
    for threads, forks in ((3, True), (2, False), (1, True)):
        monkeypatch.setattr(recording_run, "can_fork", lambda forks=forks: forks)
        written.clear()
        path = tmp_path / f"{threads}.zarr"
        record(survey(field=field), path, threads=threads, with_labels=True)
        assert len(written) == (1 if threads == 3 else PINGS)  # the first ping alone is simulated in this process
        found.append((open_recording(path).load(), open_labels(path).load()))
    for recording, labels in found[1:]:
        xr.testing.assert_identical(recording.drop_attrs(), found[0][0].drop_attrs())
        xr.testing.assert_identical(labels.drop_attrs(), found[0][1].drop_attrs())


@pytest.mark.skipif(not can_fork(), reason="worker processes are forked on Linux alone")
def test_a_killed_worker_costs_its_pings_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker that the system kills, as for its memory, is an error with advice; a second run completes it all."""
    path, here, received = tmp_path / "line.zarr", os.getpid(), simulator_module.record_ping

    def killed(simulator: Simulator, sides: list[PingGeometry], pool: Any) -> Any:
        if os.getpid() != here and sides[0].ping == 8:
            os.kill(os.getpid(), signal.SIGKILL)
        return received(simulator, sides, pool)

    with monkeypatch.context() as patch:
        patch.setattr(simulator_module, "record_ping", killed)
        with pytest.raises(WorkerProcessError, match=r"memory.*exit code -9.*fewer --threads"):
            record(survey(), path, threads=2)
    assert 0 < recorded_pings(path).sum() < PINGS
    record(survey(), path, threads=2)
    np.testing.assert_array_equal(open_recording(path).intensity.values, simulate(survey(), threads=1).intensity)
