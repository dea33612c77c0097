"""A survey: a ship on a line, ping after ping, and what stays where while it passes."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from insonify.formats.zarr_store import open_recording, recorded_pings, write_ping
from insonify.frames import pose_rotation
from insonify.recording_run import record
from insonify.scenario.scenario import Scenario
from insonify.simulator import arrivals, build_simulator, simulate
from oracles.scenes import nominal, point

SPEED, EVERY, PINGS = 2.0, 0.5, 8
START = (-3.5, 0.0, 11.0)
TARGET = (0.0, 40.0, 19.0)
WIDE = {"kind": "point", "length": None, "element": "baffled"}


def survey(*, target: tuple[float, float, float] = TARGET, track: dict[str, object] | None = None,
           contributions: tuple[str, ...] = ("target",), line: dict[str, object] | None = None,
           **settings: object) -> Scenario:  # fmt: skip
    """Eight pings along a line, by default past a point abeam, received through a wide transducer."""
    line_track = {"kind": "line", "position": None, "start": START, "speed": SPEED, "pings": PINGS, "interval": EVERY,
                  "window": (0.0535, 0.0575), "stop_and_hop": True, **(track or {})}  # fmt: skip
    kept = {key: value for key, value in line_track.items() if value is not None}
    ends = {"transmit": line or WIDE, "receive": line or WIDE}
    sonar = {end: {k: v for k, v in change.items() if v is not None} for end, change in ends.items()}
    return Scenario(
        **{
            **dict(nominal(targets=[point(*target)])),
            "track": kept,
            "sonar": {"source_level_db": 220, "receiver": {"bandwidth": 20e3}, **sonar, **settings.pop("sonar", {}),
                      "pulse": {"kind": "cw", "frequency": 100e3, "duration": 0.2e-3, "taper_fraction": 0.2}},
            "paths": {"max_reflections": 0, "contributions": contributions},
            **settings,
        }
    )  # fmt: skip


def places(track: dict[str, object] | None = None) -> np.ndarray:
    """Where the ship is at each ping, by speed and heading, shape (pings, 3)."""
    settings = track or {}
    heading = float(settings.get("heading", 0.0))
    step = SPEED * EVERY * np.array([np.cos(heading), np.sin(heading), 0])
    return np.array(settings.get("start", START)) + np.arange(PINGS)[:, None] * step


def test_a_point_draws_a_hyperbola_in_the_waterfall() -> None:
    """Delay of ping n: 2 / c sqrt(x_n^2 + y^2 + z^2), to 1e-12 s; nearest where the ship is abeam."""
    scenario = survey()
    delay = np.array([arrivals(scenario, ping=n).delay.item() for n in range(PINGS)])
    away = np.linalg.norm(places() - TARGET, axis=1)
    np.testing.assert_allclose(delay, 2 * away / 1500, rtol=0, atol=1e-12)
    np.testing.assert_allclose(delay**2 - (2 * places()[:, 0] / 1500) ** 2, (2 * np.hypot(40, 8) / 1500) ** 2)


def test_the_recorded_hyperbola_peaks_where_its_delays_are() -> None:
    """Centre of energy of each ping's echo: delay and half a pulse, to a twentieth of a sample."""
    scenario = survey()
    received = simulate(scenario)
    power = np.abs(received.pressure.values[:, 0]) ** 2
    middle = power @ received.time.values / power.sum(axis=1)
    away = np.linalg.norm(places() - TARGET, axis=1)
    np.testing.assert_allclose(middle - 2 * away / 1500, 0.1e-3, rtol=0, atol=2e-6)


def test_the_carriers_phase_turns_with_the_delay() -> None:
    """From ping to ping the echo turns by exp(-j 2 pi f dtau): the history that an aperture is synthesised from."""
    scenario = survey()
    received = simulate(scenario)
    away = np.linalg.norm(places() - TARGET, axis=1)
    delay = 2 * away / 1500
    pulse = build_simulator(scenario).pulse
    rows = np.abs(received.pressure.values[:, 0]).argmax(axis=1)
    seen = received.pressure.values[np.arange(PINGS), 0, rows]
    turn = np.angle(seen / pulse.samples(received.time.values[rows] - delay) * np.exp(2j * np.pi * (100e3 * delay % 1)))
    np.testing.assert_allclose(turn, 0, atol=1e-3)


SIDES = [
    ("north, starboard", 0.0, np.pi / 2, (0.0, 40.0)),
    ("north, port", 0.0, -np.pi / 2, (0.0, -40.0)),
    ("east, starboard", np.pi / 2, np.pi / 2, (-40.0, 0.0)),
    ("east, port", np.pi / 2, -np.pi / 2, (40.0, 0.0)),
    ("south, starboard", np.pi, np.pi / 2, (0.0, -40.0)),
]


@pytest.mark.parametrize(("side", "heading", "bearing", "place"), SIDES, ids=[side[0] for side in SIDES])
def test_a_side_of_the_ship_is_a_side_of_the_scene(
    side: str, heading: float, bearing: float, place: tuple[float, float]
) -> None:
    """Heading north, starboard is east, port is west; heading east, starboard is south.

    The other side is insensitive.
    """
    start = (-3.5 * np.cos(heading), -3.5 * np.sin(heading), 11.0)
    settings = {"track": {"start": start, "heading": heading}, "sonar": {"mounting": {"bearing": bearing}}}
    seen, unseen = (
        np.abs(simulate(survey(target=(*where, 19.0), **settings), pings=[3]).pressure.values).max()
        for where in (place, tuple(-np.array(place)))
    )
    assert 20 * np.log10(seen) > 140
    assert unseen < 1e-6 * seen


def test_a_recording_states_where_the_ship_was() -> None:
    """Times, places and attitudes of each ping, as the track has them."""
    scenario = survey(track={"heading": 0.3, "pitch": 0.02, "roll": -0.05}, sonar={"receiver": {"bandwidth": 2e3}})
    received = simulate(scenario, pings=[2, 5])
    np.testing.assert_allclose(received.ping_time, [1.0, 2.5])
    np.testing.assert_allclose(received.position, places({"heading": 0.3})[[2, 5]])
    np.testing.assert_allclose(received.attitude, [[0.3, 0.02, -0.05]] * 2)
    assert list(received.ping.values) == [2, 5]


def test_an_offset_array_moves_with_its_ship() -> None:
    """A metre forward, two to starboard, half a metre down on a rolling, heading ship: both ends stand apart."""
    forward, aside = (1.0, 2.0, 0.5), (-1.0, 0.0, 0.0)
    scenario = survey(
        track={"heading": 0.4, "roll": 0.2},
        sonar={"transmit": {"kind": "point", "offset": forward}, "receive": {"kind": "point", "offset": aside}},
    )
    for n, (found, ship) in enumerate(
        zip((arrivals(scenario, n, window=(0, 1)) for n in range(PINGS)), places({"heading": 0.4}), strict=True)
    ):
        body = pose_rotation(0.4, 0.0, 0.2)
        way = sum(np.linalg.norm(ship + body @ end - TARGET) for end in (np.array(forward), np.array(aside)))
        assert found.delay.item() == pytest.approx(way / 1500, abs=1e-12), n


def test_a_place_on_the_bed_keeps_its_scatterer_all_along_the_line() -> None:
    """Whatever two pings both see has one position and one phase; and much of it is seen twice."""
    scenario = survey(contributions=("seabed",), line={"kind": "line", "length": 0.3}, track={"window": (0.05, 0.0505)})
    simulator = build_simulator(scenario)
    seen: list[dict[int, tuple[float, ...]]] = []
    for ping in (3, 4):
        blocks = [block() for block in simulator.engine.blocks(simulator.ping_geometry(ping))]
        keys = np.concatenate([b.scatterer_id for b in blocks])
        where = np.concatenate([b.position for b in blocks])
        phase = np.concatenate([b.phase for b in blocks])
        assert len(set(keys.tolist())) == len(keys)
        seen.append({int(k): (*p, z) for k, p, z in zip(keys, where, phase, strict=True)})
    shared = seen[0].keys() & seen[1].keys()
    assert len(shared) > 0.5 * len(seen[0])
    assert all(seen[0][key] == seen[1][key] for key in shared)


def broken_off(scenario: Scenario, path: Path, after: int) -> None:
    """A run that dies when so many pings are done."""

    def die(done: int, total: int) -> None:
        assert total == PINGS
        if done == after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        record(scenario, path, threads=2, on_ping=die)


def assert_same(stored: xr.Dataset, held: xr.Dataset) -> None:
    """Two recordings are the same, bit by bit, whatever else stands beside them."""
    np.testing.assert_array_equal(stored.pressure.values, held.pressure.values)
    for name in ("position", "attitude", "time", "ping_time", "steer"):
        np.testing.assert_array_equal(stored[name], held[name])
    assert held.attrs["scenario"] == stored.attrs["scenario"]


def test_a_run_that_was_interrupted_ends_with_the_same_bits(tmp_path: Path) -> None:
    """Stopped after three pings and gone on with: the bits of a run in one go, noise included, and no ping twice.

    Worker processes may have written a few more by then.
    """
    scenario = survey(water={"noise_level_db": 60.0})
    broken_off(scenario, tmp_path / "line.zarr", 3)
    there = int(recorded_pings(tmp_path / "line.zarr").sum())
    assert 3 <= there < PINGS
    progress: list[tuple[int, int]] = []
    record(scenario, tmp_path / "line.zarr", on_ping=lambda *n: progress.append(n))
    assert progress == [(n, PINGS) for n in range(there, PINGS + 1)]
    assert_same(open_recording(tmp_path / "line.zarr"), simulate(scenario))


def test_pings_may_be_run_in_any_order_and_in_parts(tmp_path: Path) -> None:
    """Two halves, the later first, by different numbers of threads: the same recording."""
    scenario = survey(water={"noise_level_db": 60.0})
    for part, threads in ((range(4, PINGS), 1), (range(4), 2)):
        record(scenario, tmp_path / "line.zarr", pings=part, threads=threads)
    assert_same(open_recording(tmp_path / "line.zarr"), simulate(scenario))


def test_a_finished_recording_is_not_simulated_again(tmp_path: Path) -> None:
    """What is there is kept: a mark put into a ping survives the same command; --overwrite wipes it."""
    scenario = survey(track={"pings": 2})
    path = record(scenario, tmp_path / "line.zarr")
    mark = np.full_like(open_recording(path).pressure.values[1], 7)
    write_ping(path, 1, mark)
    record(scenario, path)
    np.testing.assert_array_equal(open_recording(path).pressure.values[1], mark)
    record(scenario, path, overwrite=True)
    assert not (open_recording(path).pressure.values[1] == mark).any()


def correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Magnitude of the normalised product of two series [1]."""
    return float(abs(np.vdot(one, other)) / np.linalg.norm(one) / np.linalg.norm(other))


def test_the_noise_is_new_at_every_ping_and_in_every_beam() -> None:
    """Three pings and two beams of an empty sea, 500 samples each: no two series are related, all equally strong.

    Correlation of independent series is about 1 / sqrt(500) = 0.045; 0.2 is allowed. Mean power: 0.5 dB.
    """
    scenario = nominal(seabed={"depth": 20, "scattering": None}, water={"noise_level_db": 60.0},
                       receive={"steer": [0.0, 0.2]}, track={"pings": 3, "window": (0.1, 0.12)})  # fmt: skip
    series = simulate(scenario).pressure.values.reshape(6, -1)
    for n in range(6):
        assert all(correlation(series[n], other) < 0.2 for other in series[:n])
    power = 10 * np.log10(np.mean(np.abs(series) ** 2, axis=1))
    np.testing.assert_allclose(power, power.mean(), atol=0.5)


def test_a_ship_at_rest_receives_the_same_bed_at_every_ping() -> None:
    """No noise, no jitter: the same bits; with jitter each ping shakes its own replicas, and only a part is common."""
    settings = {"track": {"pings": 2, "window": (0.19, 0.2)}}
    still = simulate(nominal(**settings, paths={"geometry": "slice"})).pressure.values[:, 0]
    np.testing.assert_array_equal(still[0], still[1])
    shaken = simulate(nominal(**settings, paths={"geometry": "slice", "jitter": 1.0})).pressure.values[:, 0]
    assert correlation(*shaken) < 0.3
    assert correlation(still[0], shaken[0]) < 0.3


def test_speckle_decorrelates_as_the_ship_moves_on() -> None:
    """Received from half an aperture further much is common; a whole beam's footprint further nothing is.

    The field of a rough bed decorrelates over the length of the array that made it (van Cittert 1934, Zernike 1938).
    """

    def after(step: float) -> float:
        settings = dict(nominal(paths={"max_reflections": 0, "beam_cutoff_db": -40}, line={"length": 0.5}))
        track = {"kind": "line", "start": (0.0, 0.0, 11.0), "speed": step, "interval": 1.0, "pings": 2}
        return correlation(
            *simulate(Scenario(**{**settings, "track": {**track, "window": (0.12, 0.14)}})).pressure.values[:, 0]
        )

    near, half, far = after(0.02), after(0.25), after(3.0)
    assert near > 0.95 > half > far
    assert far < 0.2
