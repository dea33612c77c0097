"""Claims about the cost of a run.

Right to a factor of two before anything is drawn, and stated before it is too much.
"""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from insonify import kernel_signatures, recording_run
from insonify.cli import main
from insonify.engines import volume
from insonify.engines.face_images import face_images
from insonify.engines.memory_budget import (
    BYTES_AT_ONCE,
    BYTES_PER_LEG,
    BYTES_PER_PAIR,
    legs_per_point,
    points_at_once,
)
from insonify.engines.parts import parts_of
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.engines.targets import target_count
from insonify.estimates import boundary_points, compile_time, machine_pace, ping_work, unit_costs
from insonify.estimates.diffraction_work import diffraction_seconds_on_targets
from insonify.estimates.run_cost import RunCost, estimate_cost, size_refusal
from insonify.estimates.run_limits import run_refusal
from insonify.recent_results import RecentResults
from insonify.simulator import build_simulator
from insonify.sonar import two_way_beam
from insonify.sonar.beam import Beams
from insonify.synthesis import direction_powers, waveform_basis
from oracles.arrays import elements_scenario, line_of
from oracles.scenes import nominal

SIDES = {"sides": ["port", "starboard"]}
CHEAP = {"max_reflections": 0, "contributions": ["seabed"]}


@pytest.mark.parametrize(
    "changes",
    [
        {"track": {"window": (0.02, 0.1)}},
        {"track": {"window": (0.02, 0.1)}, "sonar": SIDES},
        {"track": {"window": (0.1, 0.12)}, "line": {"length": 0.5}},
        {"track": {"window": (0.1, 0.12)}, "paths": {**CHEAP, "scatterers_per_cell": 1}},
    ],
)
def test_scatterers_are_counted_to_a_factor_of_two(changes):
    """As many as one ping then draws."""
    scenario = nominal(**{"paths": CHEAP} | changes)
    simulator = build_simulator(scenario)
    drawn = sum(len(block()) for side in simulator.ping_geometries(0) for block in simulator.engine.blocks(side))
    assert 0.5 < estimate_cost(scenario).scatterers / drawn < 2


BODIES = [
    {"shape": "box", "size": (2, 1, 1)},
    {"shape": "plate", "length": 3, "width": 2},
    {"shape": "cylinder", "length": 60, "diameter": 30, "burial": 0.4},  # of no more points than a solid may have
    {"shape": "library", "name": "rock"},
]


@pytest.mark.parametrize("body", BODIES, ids=lambda body: body["shape"])
def test_points_on_targets_are_counted_before_they_are_drawn(body):
    """All of them, and those that face the sonar, to a fifth: of upright, flat, half-buried and uneven bodies."""
    changes = {"contributions": ["target"], "max_reflections": 0}
    scenario = nominal(targets=[{**body, "position": (0, 40)}], track={"window": (0.02, 0.1)}, paths=changes)
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    blocks = [block() for block in simulator.engine.blocks(here)]
    drawn = sum(len(block) for block in blocks)
    towards = [np.sum((here.transmit_position - block.position) * block.normal, axis=1) > 0 for block in blocks]
    facing = sum(int(one.sum()) for one in towards)
    slant = ping_scatterers(scenario.scene, scenario.paths, 1, here, simulator.engine.rays).resolution.slant_resolution
    resolution = ping_scatterers(scenario.scene, scenario.paths, 1, here, simulator.engine.rays).resolution
    found = target_count(scenario.scene, scenario.paths, here, slant, simulator.engine.rays, resolution)
    assert drawn > 500 and found == pytest.approx((drawn, facing), rel=0.2)
    assert estimate_cost(scenario).scatterers == pytest.approx(drawn, rel=0.2)


@pytest.mark.parametrize("paths", [
    {"max_reflections": 1}, {"max_reflections": 0, "edge_diffraction": "knife-edge"}, {"max_reflections": 0},
])  # fmt: skip
def test_points_that_face_away_are_counted_where_they_may_be_reached(paths):
    """A box: with reflections all of its points are followed, by direct paths those that face the sonar.

    The estimate has as many, to a tenth. Diffraction changes the visibility of direct paths, not their directions.
    """
    box = {"shape": "box", "size": (2, 1, 1), "position": (0, 40)}
    changes = {"contributions": ["target"], **paths}
    scenario = nominal(targets=[box], track={"window": (0.02, 0.1)}, paths=changes)
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    blocks = [block() for block in simulator.engine.blocks(here)]
    towards = [np.sum((here.transmit_position - block.position) * block.normal, axis=1) > 0 for block in blocks]
    facing = np.concatenate(towards)
    assert facing.all() == (paths["max_reflections"] == 0)
    resolution = ping_scatterers(scenario.scene, scenario.paths, 1, here, simulator.engine.rays).resolution
    found = target_count(
        scenario.scene, scenario.paths, here, resolution.slant_resolution, simulator.engine.rays, resolution
    )
    assert found == pytest.approx((len(facing), facing.sum()), rel=0.1)


@pytest.mark.parametrize(("east", "received"), [(-50.0, False), (50.0, True), (400.0, False)])
def test_targets_out_of_beams_and_window_cost_nothing(east, received):
    """A cylinder behind the baffle of a sonar that looks east, before it, and beyond the window."""
    body = {"shape": "cylinder", "length": 2, "diameter": 1, "position": (0, east)}
    scenario = nominal(
        targets=[body], track={"window": (0.02, 0.1)}, paths={"contributions": ["target"], "max_reflections": 0}
    )
    assert (estimate_cost(scenario).scatterers > 0) == received


def test_cost_grows_with_pings_and_sides():
    """Ten pings take ten times as long and as much disk; both sides twice as much."""
    one, ten = (estimate_cost(nominal(track={"window": (0.02, 0.1), "pings": pings})) for pings in (1, 10))
    both = estimate_cost(nominal(track={"window": (0.02, 0.1)}, sonar=SIDES))
    start, files = unit_costs.START_SECONDS, unit_costs.FILE_BYTES
    assert ten.seconds - start == pytest.approx(10 * (one.seconds - start))
    assert both.seconds - start == pytest.approx(2 * (one.seconds - start), rel=0.1)
    assert ten.disk - files == pytest.approx(10 * (one.disk - files), rel=0.5)
    assert both.disk - files == pytest.approx(2 * (one.disk - files), rel=0.5)


def test_fast_reverberation_is_counted_as_it_is_walked():
    """A relief's expected intensity takes milliseconds, its random scatterers several times as long."""
    rough = {"relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}
    changes = {"seabed": rough, "track": {"window": (0.02, 0.2)}, "paths": CHEAP, "sonar": SIDES}
    quick, drawn = (nominal(field=field, **changes) for field in ("incoherent", "coherent"))
    assert estimate_cost(quick).seconds - unit_costs.START_SECONDS < 0.15
    once, again = (ping_work.ping_work(build_simulator(scenario)).seconds for scenario in (quick, drawn))
    assert once < again / 2


def test_processor_times_follow_the_pace_of_the_machine(monkeypatch):
    """Transforms that take nine times as long: three times the estimated time, compilation too; no other change."""
    cost = estimate_cost(nominal(track={"window": (0.02, 0.03)}))
    now = iter(np.arange(1000) * 9 * 4 * machine_pace.TRANSFORM_SECONDS)
    monkeypatch.setattr(machine_pace.time, "thread_time", lambda: next(now))
    machine_pace.machine_pace.cache_clear()
    slow = cost.on_this_machine()
    machine_pace.machine_pace.cache_clear()
    assert (slow.seconds, slow.compiling) == pytest.approx((3 * cost.seconds, 3 * cost.compiling))
    assert replace(slow, seconds=cost.seconds, compiling=cost.compiling) == cost


def test_pairs_of_many_beams_on_rows_are_deposited_once():
    """A frame of 256 beams, expected: a pair costs as in one channel, with reflections too, and its labels."""
    fan = {"kind": "planar", "width": 0.05, "height": 0.005}
    sonar = {
        "transmit": fan | {"width": 0.0015, "steer": (0.0,)},
        "receive": fan | {"steer": tuple(np.radians(np.linspace(-60, 60, 256)))},
    }
    pulse = {"pulse": {"kind": "cw", "frequency": 750e3, "duration": 0.04e-3}, "receiver": {"bandwidth": 30e3}}
    seconds = {}
    for order in (0, 1):
        scenario = nominal(
            field="incoherent", sonar=sonar | pulse, track={"window": (0.0, 0.02)}, paths={"max_reflections": order}
        )
        simulator = build_simulator(scenario)
        here = simulator.ping_geometry(0)
        seconds[order] = ping_work._pair_seconds(simulator, here, boundary="seabed")
        once = unit_costs.SECONDS_PER_PAIR + unit_costs.SECONDS_PER_LABEL
        assert ping_work._pair_seconds(simulator, here, boundary="seabed", label=True) == pytest.approx(once)
    assert seconds[0] == seconds[1] == pytest.approx(sum(unit_costs.SECONDS_PER_EXPECTED_PAIR))


def test_a_clock_without_resolution_gives_the_least_pace(monkeypatch):
    """Processor times of zero: a quarter of those of the reference machine, not nothing."""
    machine_pace.machine_pace.cache_clear()
    monkeypatch.setattr(machine_pace.time, "thread_time", lambda: 0.0)
    assert machine_pace.machine_pace() == 0.25
    machine_pace.machine_pace.cache_clear()


def test_the_program_itself_takes_memory():
    """Even a run of nothing holds Python, its libraries and the compiled kernels: hundreds of megabytes."""
    assert 200e6 < estimate_cost(nominal(track={"window": (0.02, 0.03)})).memory < 1e9


def test_every_worker_process_takes_as_much_memory(monkeypatch: pytest.MonkeyPatch):
    """The first ping and each of 2, 4 and 16 workers need one share; one thread has the program and that share.

    The track is held once: workers are copies of the process that holds it.
    """
    monkeypatch.setattr(recording_run, "can_fork", lambda: True)  # whatever threads and system the tests have
    scenario = nominal(field="coherent").with_({"track.pings": 64})
    memory = {threads: estimate_cost(scenario, threads=threads).memory for threads in (1, 2, 4, 16)}
    common = unit_costs.BYTES_OF_PROGRAM + 64 * unit_costs.BYTES_PER_PING
    share = memory[1] - common
    for workers in (2, 4, 16):
        assert memory[workers] == pytest.approx(common + (workers + 1) * share)


def test_memory_of_a_long_track(tmp_path):
    """Bytes that a run takes for each further ping of its track, until it has simulated one: as estimated, within 25 %.

    Poses and attitudes at three moments, masks and jobs: the difference of 30 000 pings and 10 000.
    """
    track = {"window": (0.02, 0.021), "motion": {"heave": {"rms": "1 cm", "period": "6 s"}}}

    class BegunError(Exception):
        pass

    def stop(done, _):
        if done:
            raise BegunError

    peaks = []
    for pings in (10_000, 10_000, 30_000):  # the first time, modules are loaded
        tracemalloc.start()
        scenario = nominal(track={**track, "pings": pings})
        with pytest.raises(BegunError):
            recording_run.record(scenario, tmp_path / "a.zarr", on_ping=stop, threads=1, overwrite=True)
        peaks.append((tracemalloc.get_traced_memory()[1], scenario))
        tracemalloc.stop()
    _, (few, short), (many, long) = peaks
    estimate = estimate_cost(long, threads=1).memory - estimate_cost(short, threads=1).memory
    assert estimate == pytest.approx(many - few, rel=0.25)


def test_runs_that_tasks_share_cost_what_one_does():
    """Six runs in one process start the program once; each of six tasks that share them has the cost of one run."""
    one = RunCost(pings=12, scatterers=1e5, seconds=300, memory=1e9, disk=6e6)
    six = one.repeated(6)
    assert one.seconds * 5 < six.seconds < one.seconds * 6 and six.memory == one.memory
    shared = six.of_task(6)
    assert (shared.pings, shared.disk) == (12, 6e6) and shared.seconds == pytest.approx(one.seconds)


def test_what_a_machine_cannot_hold_is_refused_with_what_to_change():
    """Memory requested, memory there, and the keys that matter."""
    big = RunCost(pings=1, scatterers=2e11, seconds=1e5, memory=150e9, disk=1e9)
    message = size_refusal(big, memory=16e9)
    assert "about 150 GB of memory, and the machine has 16 GB" in message and "shorten track.window" in message
    assert size_refusal(big, memory=1e12) == ""
    assert "200 G scatterers: about 28 hours of processor time" in big.summary()


@pytest.mark.filterwarnings("ignore")
def test_check_and_run_refuse_a_run_that_is_too_big(tmp_path, capsys):
    """100 s of recording at 100 kHz: refused at once, by name, exit code 2; a long run is given its cost."""
    end = "{kind: line, length: 1 m}"
    text = (
        "sonar: {source_level_db: 200, pulse: {kind: cw, frequency: 100 kHz, duration: 0.1 ms}, "
        f"transmit: {end}, receive: {end}}}\n"
        "track: {kind: static, position: [0, 0, 9 m], interval: 100 s, window: [0 s, WINDOW]}\n"
    )
    file = tmp_path / "big.yaml"
    file.write_text(text.replace("WINDOW", "100 s"))
    assert main(["check", str(file)]) == 2
    assert "big.yaml: this needs about" in capsys.readouterr().err
    assert main(["run", str(file), "-o", str(tmp_path / "big.zarr")]) == 2
    assert not (tmp_path / "big.zarr").exists()
    file.write_text(text.replace("WINDOW", "50 ms"))
    assert main(["check", str(file)]) == 0
    assert capsys.readouterr().out.startswith(f"{file}: nothing wrong\n")
    file.write_text(text.replace("WINDOW]", "50 ms], pings: 100000"))
    assert main(["check", str(file)]) == 0
    assert "\n100000 pings, about " in capsys.readouterr().out


def test_a_large_array_is_held_in_fewer_parts():
    """Parts of a ping each hold the sound of all elements: 16 where 64 MiB hold them all, or fewer, down to two."""
    assert parts_of(1_000_000) == 16 and parts_of(8 << 20) == 8 and parts_of(1 << 32) == 2
    few, many = (
        estimate_cost(elements_scenario([(0, 20, 5)], receive=line_of(count, 1.0), track={"window": (0.0, 1.0)}))
        for count in (8, 400)
    )
    assert few.memory < 2e9 and 4e9 < many.memory < 40e9
    assert "number of beams or elements" in size_refusal(many, memory=1e9)


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_points_in_the_water_are_counted(field):
    """As many as one ping then draws, to a twentieth: those under the seabed are the difference."""
    murky = nominal(water={"noise_level_db": None, "volume_strength_db": -70}, field=field,
                    paths={"max_reflections": 0, "contributions": ["water"]},
                    track={"window": (0.03, 0.05)})  # fmt: skip
    simulator = build_simulator(murky)
    blocks = simulator.engine.blocks(simulator.ping_geometry(0), quadrature=field == "incoherent")
    drawn = sum(len(block()) for block in blocks)
    assert estimate_cost(murky).scatterers == pytest.approx(drawn, rel=0.05)


def test_water_is_counted_by_a_sample_of_its_blocks(monkeypatch):
    """At most 400 of 2000 blocks are divided further at a time: as many points to a tenth."""
    murky = nominal(water={"volume_strength_db": -70}, track={"window": (0.03, 0.06)}, paths={"max_reflections": 1})
    simulator = build_simulator(murky)
    side, paths = simulator.ping_geometry(0), murky.paths
    seen = ping_scatterers(murky.scene, paths, 1, side, simulator.engine.rays)
    suspended = volume.VolumeScatterers(murky.scene, paths, 1, side, seen.resolution)
    exact, refine, most = len(suspended.cubes().scale) * volume.CELLS**3, volume.VolumeScatterers._refine, []
    monkeypatch.setattr(
        volume.VolumeScatterers, "_refine", lambda own, blocks: most.append(len(blocks.scale)) or refine(own, blocks)
    )
    monkeypatch.setattr(volume, "COUNTED", 400)
    assert suspended.count(quadrature=False) == pytest.approx(exact, rel=0.1)
    assert max(most) <= 400 < exact / volume.CELLS**3 / 4


def test_even_points_far_out_are_counted_by_a_sample_of_their_rows():
    """Some 60 rows of tiles by 24 of them, and 300 tiles of each: as many points as are kept to 5 %."""
    murky = nominal(field="incoherent", water={"volume_strength_db": -70}, track={"window": (0.0, 0.5)},
                    paths={"max_reflections": 0})  # fmt: skip
    simulator = build_simulator(murky)
    side = simulator.ping_geometry(0)
    seen = ping_scatterers(murky.scene, murky.paths, 1, side, simulator.engine.rays, quadrature=True)
    suspended = volume.VolumeScatterers(murky.scene, murky.paths, 1, side, seen.resolution)
    assert suspended._row_count > 2 * volume.MAX_COUNTED_ROWS
    exact = sum(len(block()) for block in suspended.blocks(quadrature=True))
    assert suspended.count(quadrature=True) == pytest.approx(exact, rel=0.05)


def test_an_estimate_of_many_beams_measures_each_once(monkeypatch):
    """501 beams: no beam's width at every ping."""
    measured, width = [], two_way_beam._beam_width
    monkeypatch.setattr(two_way_beam, "_beam_width", lambda *ends: measured.append(1) or width(*ends))
    fan = {"from": "-50 deg", "to": "50 deg", "step": "0.2 deg"}
    body = {"shape": "box", "size": (2, 1, 1), "position": (0, 40)}
    receive = {"kind": "line", "length": 0.41, "steer": fan}
    scenario = nominal(sonar={"receive": receive}, targets=[body], track={"window": (0.02, 0.1), "pings": 9})
    assert estimate_cost(scenario).seconds > 1 and len(measured) == 501


def test_an_estimate_evaluates_the_doppler_of_a_fan_at_one_ping(monkeypatch):
    """Two sides that roll past a target: directions in the beams, all around, are found at one ping, not at nine."""
    found, gains = [], Beams.largest_gain
    monkeypatch.setattr(Beams, "largest_gain", lambda *arguments: found.append(1) or gains(*arguments))
    sonar = {"receive": {"kind": "line", "length": 0.41, "steer": {"from": "-50 deg", "to": "50 deg", "step": "5 deg"}}}
    roll = {"roll": {"rms": 0.05, "period": 2.0}}
    track = {"kind": "line", "start": (0, 0, 11.0), "speed": 2.0, "pings": 9, "interval": 0.3, "motion": roll}
    body = {"shape": "box", "size": (2, 1, 1), "position": (0, 40)}
    scenario = nominal(sonar=sonar | SIDES, targets=[body]).with_(track=track | {"window": (0.02, 0.1)})
    monkeypatch.setattr(waveform_basis, "_DIRECTIONS", RecentResults(8))
    found.clear()
    assert estimate_cost(scenario).seconds > 1 and len(found) == 4


def test_water_is_counted_once_by_a_check(monkeypatch):
    """Estimate and refusal share the count of one ping; labels have points of their own."""
    calls, count = [], volume.VolumeScatterers.count
    monkeypatch.setattr(
        volume.VolumeScatterers,
        "count",
        lambda own, *, quadrature: calls.append(1) or count(own, quadrature=quadrature),
    )
    murky = nominal(water={"volume_strength_db": -70}, paths={"max_reflections": 0}, track={"window": (0.03, 0.04)})
    whole = estimate_cost(murky)
    assert run_refusal(murky, whole) == "" and len(calls) == 1
    assert run_refusal(murky, whole, labels=True) == "" and len(calls) == 2


@pytest.mark.parametrize(("field", "limit"), [("coherent", "MAX_CUBES"), ("incoherent", "MAX_TILES")])
def test_water_that_would_take_forever_is_refused_with_what_to_change(monkeypatch, field, limit):
    """More blocks than the limit, here a hundred: refused before anything is drawn, and otherwise in the run."""
    monkeypatch.setattr(volume, limit, 100)
    endless = nominal(water={"noise_level_db": None, "volume_strength_db": -70}, field=field,
                      track={"window": (0.0, 0.2)},
                      paths={"max_reflections": 0, "contributions": ["water"]})  # fmt: skip
    message = size_refusal(estimate_cost(endless), memory=1e12)
    assert "water.volume_strength_db" in message and "Shorten track.window" in message
    simulator = build_simulator(endless)
    with pytest.raises(ValueError, match="leave clear water clear"):
        simulator.engine.blocks(simulator.ping_geometry(0), quadrature=field == "incoherent")


ROUGH = {"relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}
DRAWN = {"max_reflections": 2, "contributions": ["seabed"]}


def test_weak_pairs_are_counted_as_they_are_sampled():
    """Rough ground with up to four bounces takes less than twice its direct paths: most pairs have few scatterers."""
    few, many = (
        estimate_cost(
            nominal(seabed=ROUGH, track={"window": (0.02, 0.1)}, paths={**DRAWN, "max_reflections": order})
        ).seconds
        for order in (2, 4)
    )
    assert few < many and many - unit_costs.START_SECONDS < 1.5 * (few - unit_costs.START_SECONDS)
    flat, uneven = (
        estimate_cost(nominal(seabed=seabed, track={"window": (0.02, 0.1)}, paths={**DRAWN, "max_reflections": 4}))
        for seabed in ({}, ROUGH)
    )
    assert uneven.scatterers == pytest.approx(flat.scatterers, rel=0.3)
    assert uneven.seconds < 3 * flat.seconds


def test_targets_below_the_floor_of_the_beams_cost_nothing():
    """A cylinder 60 degrees aside of a beam 0.6 degrees wide: nothing is drawn, and nothing is given."""
    body = {"shape": "cylinder", "length": 2, "diameter": 1, "position": (45, 25)}
    expected = [
        nominal(targets=[body], track={"window": (0.02, 0.1)},
                paths={"contributions": ["target"], "max_reflections": 0, "beam_cutoff_db": floor})
        for floor in (-30, -120)
    ]  # fmt: skip
    assert [estimate_cost(scenario).scatterers > 0 for scenario in expected] == [False, True]
    for scenario in expected:
        simulator = build_simulator(scenario)
        drawn = sum(len(block()) for block in simulator.engine.blocks(simulator.ping_geometry(0)))
        assert (drawn > 0) == (estimate_cost(scenario).scatterers > 0)


@pytest.mark.parametrize(
    "moves", [{"reflection": "statistical", "wind_speed": 3.0}, {"reflection": "explicit", "wind_speed": 3.0}]
)
def test_a_surface_that_moves_costs_more_than_a_mirror(moves):
    """Glints are found for every leg off it; legs that keep away from it cost what they did."""
    for order, costlier in ((0, False), (1, True)):
        still, moving = (
            estimate_cost(
                nominal(surface=surface, track={"window": (0.02, 0.1)}, paths={**DRAWN, "max_reflections": order})
            )
            for surface in ({}, moves)
        )
        start = unit_costs.START_SECONDS
        assert (moving.seconds - start > 1.2 * (still.seconds - start)) == costlier


def test_beams_share_the_pairs_of_an_expectation_under_a_moving_surface(monkeypatch):
    """64 beams one by one take 5 times the time of 8: glints are paired once. On rows of directions they take less."""

    def seconds(beams: int) -> float:
        fan = {"from": "-60 deg", "to": "60 deg", "step": f"{120 / beams} deg"}
        ends = {"transmit": {"kind": "point"}, "receive": {"kind": "line", "length": 0.3, "steer": fan}}
        moving = {"reflection": "statistical", "wind_speed": 3}
        scenario = nominal(field="incoherent", sonar=ends, surface=moving, track={"window": (0.0, 0.03)})
        return estimate_cost(scenario).seconds - unit_costs.START_SECONDS

    eight = seconds(8)
    assert 0.3 < seconds(64) / eight < 1 and 0.3 < seconds(96) / eight < 1
    monkeypatch.setattr(direction_powers, "MAX_BYTES", 0)
    assert 2.3 < seconds(64) / eight < 6.3


def test_labels_on_rows_of_directions_take_the_memory_of_their_sums():
    """61 beams of 321 rows, three families: 874 MB were taken where 545 were estimated, for a frame of 808 rows."""
    fan = {"from": "-60 deg", "to": "60 deg", "step": "2 deg"}
    ends = {"transmit": {"kind": "point"}, "receive": {"kind": "line", "length": 0.3, "steer": fan}}
    scenario = nominal(field="incoherent", sonar=ends, track={"window": (0.0, 0.03)})
    simulator = build_simulator(scenario)
    sums = simulator.label_accumulator(simulator.ping_geometry(0))
    held = 8 * 322 * len(sums.names.pairs) * simulator.grid.energy_cell_count
    more = estimate_cost(scenario, labels=True).memory - estimate_cost(scenario).memory
    assert sums.directions is not None and held < more < 3 * held


def test_pairs_of_a_direction_grid_cost_the_same_for_any_number_of_beams():
    """Of the same rows 281 beams are formed as 141 are; their series alone take longer, not twice the time.

    140 degrees at 450 kHz in front of a wall: 7 s were taken where 47 s were estimated.
    """

    def seconds(step: float) -> float:
        fan = {"from": "-70 deg", "to": "70 deg", "step": f"{step} deg"}
        sonar = {
            "transmit": {"kind": "planar", "width": 1.5e-3, "height": 6e-3},
            "receive": {"kind": "line", "length": 0.12, "elements": 160, "steer": fan},
            "pulse": {"kind": "cw", "frequency": 450e3, "duration": 5e-5}, "receiver": {"bandwidth": 60e3},
        }  # fmt: skip
        scenario = nominal(sonar=sonar, paths={"max_reflections": 0}, track={"window": (0.0, 0.04)})
        return estimate_cost(scenario).seconds - unit_costs.START_SECONDS

    assert seconds(0.5) < 1.5 * seconds(1.0)


@pytest.mark.parametrize(("east", "longer"), [(30, (1.25, 6.0)), (-30, (1.0, 1.0))])
def test_the_ground_behind_a_long_solid_is_costly(east, longer):
    """Legs to the bed behind a pipe in the beams are diffracted; one out of the beams changes nothing."""
    ends = {"transmit": {"kind": "line", "length": 0.05}, "receive": {"kind": "line", "length": 0.05}}
    pipe = {"shape": "cylinder", "length": 30, "diameter": 0.8, "position": (0, east)}

    def seconds(way: str) -> float:
        paths = {"edge_diffraction": way, "contributions": ["seabed"], "max_reflections": 1}
        scenario = nominal(sonar=ends, targets=[pipe], paths=paths, track={"window": (0.0, 0.1)})
        return estimate_cost(scenario).seconds - unit_costs.START_SECONDS

    assert longer[0] <= seconds("knife-edge") / seconds("none") <= longer[1]


@pytest.mark.parametrize(("shape", "count"), [("rock", 20), ("pile", 20)])
def test_diffraction_around_targets_is_priced_for_points_of_other_targets(shape, count):
    """Behind one another, each of 20 targets diffracts the sound of those behind it: 20 times what two cost, at least.

    Pairs of targets in line: 1 of 2 targets, 190 of 20. On boxes alone each leg costs as much as there are boxes.
    """
    one = {"shape": "library", "name": "rock"} if shape == "rock" else {"shape": "box", "size": (0.5, 0.5, 3)}
    seconds = []
    for number in (2, count):
        bodies = [{**one, "label": f"{shape} {k}", "position": (0.0, 15.0 + 1.5 * k)} for k in range(number)]
        costs = [
            estimate_cost(
                nominal(targets=bodies, paths={"contributions": ["target"], "edge_diffraction": edges})
            ).seconds
            for edges in ("knife-edge", "none")
        ]
        seconds.append(costs[0] - costs[1])
    assert seconds[1] > 20 * seconds[0] > 0


def test_legs_off_explicit_waves_are_counted_with_their_bounces_and_glints():
    """Within a factor of 1.5 of those that a block then has: they bound its memory, and an expectation's time."""
    scenario = nominal(surface={"reflection": "explicit", "wind_speed": 3.0}, track={"window": (0.03, 0.031)},
                       paths={"families": ["D", "S"], "contributions": ["seabed"]})  # fmt: skip
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    drawn = len(simulator.engine.pairs(here, simulator.engine.blocks(here)[0]).transmit_legs.families)
    assert 2 / 3 < legs_per_point(scenario.scene, scenario.paths, "seabed", drawn=True) / drawn < 1.5


def test_refracted_rays_cost_more_than_straight_ones():
    """The same scene in layered water: as many scatterers to a fifth, and more time for their legs."""
    layers = {"noise_level_db": None, "profile": [(0, 1500), (10, 1495), (20, 1490)]}
    straight, refracted = (
        estimate_cost(nominal(water=water, track={"window": (0.02, 0.1)}, paths=CHEAP))
        for water in ({"noise_level_db": None}, layers)
    )
    assert refracted.scatterers == pytest.approx(straight.scatterers, rel=0.2) and refracted.seconds > straight.seconds


def test_labels_are_part_of_the_estimate():
    """Requested on the command line or in the file: the same, more time, memory and disk, and the line reports it."""
    plain, requested, written = (
        estimate_cost(nominal(track={"window": (0.02, 0.1)}, paths=CHEAP, output={"labels": inside}), labels=outside)
        for inside, outside in ((False, False), (False, True), (True, False))
    )
    assert requested == written and requested.seconds > plain.seconds and requested.disk > 1.5 * plain.disk
    assert "labels included" in requested.summary() and "labels" not in plain.summary()


def test_labels_of_pressures_in_sub_bands_are_part_of_the_estimate():
    """Labels are made by an expectation, which has no sub-bands: their work is counted all the same."""
    bands = {"receiver": {"sub_bands": 3}}
    plain, labelled = (
        estimate_cost(nominal(track={"window": (0.02, 0.1)}, paths=CHEAP, sonar=bands), labels=labels)
        for labels in (False, True)
    )
    assert labelled.seconds > plain.seconds


def test_kernels_that_no_cache_holds_are_reported(monkeypatch):
    """Nothing where all are in the cache; without them, the time to compile those that the scenario calls."""
    monkeypatch.setattr(kernel_signatures, "cache_folder", lambda package: lambda folder: package / "nowhere")
    cold = estimate_cost(nominal(track={"window": (0.02, 0.1)}, paths=CHEAP))
    monkeypatch.setattr(compile_time, "missing_kernels", lambda features: [])
    warm = estimate_cost(nominal(track={"window": (0.02, 0.1)}, paths=CHEAP))
    assert warm.compiling == 0 and "compile" not in warm.summary()
    assert 10 < cold.compiling < 120 and cold.seconds == warm.seconds
    assert " to compile, once" in cold.summary()


def test_relief_has_more_to_compile(monkeypatch):
    """Features add the kernels that they call, labels too."""
    monkeypatch.setattr(kernel_signatures, "cache_folder", lambda package: lambda folder: package / "nowhere")
    plain, rough = nominal(), nominal(seabed=ROUGH)
    seconds = [compile_time.estimate_compile_seconds(*of) for of in ((plain,), (rough,))]
    assert seconds[1] > seconds[0] + 10
    assert compile_time.estimate_compile_seconds(plain, labels=True) > seconds[0]


def test_a_slice_and_rays_have_a_price():
    """One line of points is not free, and ten times as many rays take ten times as long."""
    slim = estimate_cost(nominal(track={"window": (0.02, 0.1)}, paths={**CHEAP, "geometry": "slice"}))
    assert slim.scatterers > 100
    start = unit_costs.START_SECONDS
    few, many = (
        estimate_cost(
            nominal(field="incoherent", track={"window": (0.02, 0.1)}, paths={"engine": "tracer", "rays": rays})
        )
        for rays in (100_000, 1_000_000)
    )
    assert many.seconds - start == pytest.approx(10 * (few.seconds - start), rel=0.1)


@pytest.mark.parametrize("changes", [{}, {"heading": np.pi / 4, "position": (0.0, 40.5)}], ids=["abeam", "oblique"])
def test_legs_off_faces_are_counted_to_a_factor_of_two(changes):
    """As many as the scatterers of one ping have, of a wall across the beam and of one that turns it aside."""
    wall = {"shape": "box", "size": (30.0, 1.0, 20.0), "position": (0.0, 60.5), "face_reflection_coefficient": 0.9}
    paths = {"face_reflections": True, "max_reflections": 1, "contributions": ["seabed"]}
    scenario = nominal(targets=[{**wall, **changes}], paths=paths, track={"window": (0.02, 0.08)})
    simulator = build_simulator(scenario)
    here, families = simulator.ping_geometry(0), ("D", "S")
    made = np.zeros(2)
    for block in simulator.engine.blocks(here):
        scatterers = block()
        lit = sum(simulator.engine._insonified_by_face(one, here.transmit_position, scatterers, here) for one in
                  simulator.engine.faces(here))  # fmt: skip
        made += np.sum(lit), np.sum((len(families) + lit) ** 2) / len(families) ** 2
    found = boundary_points.points_on_boundary(
        here, 20.0, simulator.engine.rays, families, ping_scatterers(
            scenario.scene, scenario.paths, 1, here, simulator.engine.rays).resolution, scenario, 0.0,
        face_images(scenario.scene, scenario.paths, here, "seabed"),
    )  # fmt: skip
    points = found.number
    seconds, fold = ping_work._off_hull_and_faces(simulator, here, "seabed", families, points, found.distance)
    each = unit_costs.SECONDS_PER_FACE_LEG + ping_work._legs(simulator, here, "D")
    assert 0.5 < seconds / each / made[0] < 2
    assert 0.5 < fold * points.sum() / made[1] < 2


@pytest.mark.parametrize("hull", [None, {"length": 20.0, "width": 6.0, "offset": (0.0, 0.0, -0.5)}])
def test_a_hull_and_faces_leave_the_memory_of_a_block_bounded(hull):
    """Blocks that faces light, or under a hull, are cut so that legs and pairs of each take no more than the bound."""
    plain = nominal(paths={"max_reflections": 3})
    simulator = build_simulator(nominal(paths={"max_reflections": 3}, sonar={"hull": hull} if hull else {}))
    scatterers = next(block() for block in simulator.engine.blocks(simulator.ping_geometry(0)))
    for further in (0, 3, 40):
        legs = legs_per_point(plain.scene, plain.paths, scatterers.boundary, drawn=True, further=further)
        assert legs == legs_per_point(plain.scene, plain.paths, scatterers.boundary, drawn=True) + further
        held = points_at_once(plain.scene, plain.paths, scatterers, further)
        assert held * (legs * BYTES_PER_LEG + legs**2 * BYTES_PER_PAIR) <= BYTES_AT_ONCE
    pairs = next(simulator.engine.pair_batches(simulator.ping_geometry(0), lambda: scatterers))
    drawn = legs_per_point(plain.scene, plain.paths, scatterers.boundary, drawn=True)
    assert (len(pairs.transmit_legs.families) > drawn) == bool(hull)


def test_each_sub_band_of_beams_is_a_pass_over_the_pairs():
    """From 4 to 16 frequencies a ping of one beam is estimated to take 2.5 to 4 times as long."""
    few, many = (
        ping_work.ping_work(build_simulator(nominal(sonar={"receiver": {"sub_bands": count}}, paths=CHEAP))).seconds
        for count in (4, 16)
    )
    assert 2.5 < many / few < 4


def test_glints_are_diffracted_around_targets_as_other_legs_are():
    """Direct and surface legs past rocks: two of each point under a calm sea, four under a moving one."""
    rocks = [{"shape": "library", "name": "rock", "label": f"{n}", "position": (0.0, 30.0 + 4 * n)} for n in range(4)]
    seconds = []
    for surface in ({}, {"reflection": "statistical", "wind_speed": 4.0}):
        paths = {"max_reflections": 1, "edge_diffraction": "knife-edge"}
        scene = nominal(targets=rocks, surface=surface, paths=paths, track={"window": (0.02, 0.08)})
        simulator = build_simulator(scene)
        side, families = simulator.ping_geometry(0), ("D", "S")
        seconds.append(diffraction_seconds_on_targets(simulator, side, families))
    assert 1.5 < seconds[1] / seconds[0] < 3.0
