"""Time of a coherent ping against real time: the sidescan of `bench_sidescan`, its echoes added in phase.

Pings of a survey in progress are timed: kernels are compiled, the ground about the track is drawn and memory has been
touched by earlier pings. Many pings are timed together, as in a survey: at the end of a few, one thread waits.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from bench_sidescan import SCENE, WINDOW, changed_ratios, loaded
from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator
from measure import THREADS, Result, ping_seconds, recorded_seconds
from oracles.direct_sum import direct_sum_error

GOALS = {2: 10.0, 4: 8.0}
"""Times real time on two cores, both sides, by the most bounces of a leg."""
ELEMENTS_GOALS = {(32, 2): 2.5, (128, 0): 3.0}
"""The same for one side, by the number of recorded elements and the most bounces of a leg."""
WARM, PINGS = 6, 24
"""Pings simulated before the clock starts, and timed, by all threads."""
COMPARED_AT = 0.060
"""Start of the part of the ping that is compared with the sum over its arrivals [s]."""
RECORDED = 8
"""Pings of the recording re those timed."""


def sidescan(order: int) -> Scenario:
    """The scene with legs of at most so many bounces, both sides, recorded by beams."""
    return loaded(SCENE.replace("ORDER", str(order)).replace("incoherent", "coherent"))


def elements(count: int = 32, order: int = 2) -> Scenario:
    """The same to starboard, by each element of a line of 1 m; legs of at most so many bounces."""
    text = SCENE.replace("ORDER", str(order)).replace("incoherent", "coherent")
    text = text.replace("  sides: [port, starboard]\n", "").replace(
        "{sub_bands: 1}", "{sub_bands: 1, record: elements}"
    )
    receive = "receive: {kind: planar, width: 1 m, height: 0.02 m}"
    return loaded(text.replace(receive, f"receive: {{kind: line, length: 1 m, elements: {count}}}"))


def pings() -> list[Result]:
    """Real-time factor, processor time and scatterers of one ping."""
    found = []
    for order, goal in GOALS.items():
        found += _measured(f"coherent ping, up to {order} bounces", sidescan(order), goal)
    for (count, order), goal in ELEMENTS_GOALS.items():
        found += _measured(f"{count} elements, up to {order} bounces", elements(count, order), goal)
    return found


def changed() -> list[Result]:
    """Processor time where the platform rolls, and in layered water, re that of the scene as it is; 2 bounces."""
    scene = SCENE.replace("ORDER", "2").replace("incoherent", "coherent")
    return changed_ratios("coherent ping, up to 2 bounces", scene, rounds=20)


def _measured(name: str, scenario: Scenario, goal: float) -> list[Result]:
    simulator = build_simulator(scenario)
    wall, cores = ping_seconds(simulator, WARM, PINGS)
    written = recorded_seconds(scenario, RECORDED * PINGS)
    blocks = [block for here in simulator.ping_geometries(WARM) for block in simulator.engine.blocks(here)]
    channels = (0, scenario.sonar.channel_count - 1)
    accuracy = f"{direct_sum_error(scenario, WARM, channels, COMPARED_AT):.1e} rms"
    return [
        Result(f"{name}, {THREADS} threads", WINDOW / wall, "x real time", f"goal {goal:g}", accuracy),
        Result(f"{name}, recorded by {THREADS} processes", WINDOW / written, "x real time", f"goal {goal:g}"),
        Result(f"{name}, processor time", 1e3 * cores, "ms", f"goal {2e3 * WINDOW / goal:.0f}"),
        Result(f"{name}, scatterers", sum(len(block()) for block in blocks) / 1e3, "k", ""),
    ]


SMALL = {
    "SCENE": SCENE.replace("pings: 1000", "pings: 3").replace("[0 ms, 267 ms]", "[20 ms, 30 ms]"),
    "GOALS": {2: 4.0},
    "WARM": 1,
    "COMPARED_AT": 0.024,
}
BENCHES = [pings, changed]
