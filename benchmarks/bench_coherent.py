"""How long a coherent ping takes against the sea: the sidescan of `bench_sidescan`, its echoes added in phase."""

import time

from bench_sidescan import SCENE, WINDOW, loaded
from insonify.scenario.scenario import Scenario
from insonify.simulation import listen, prepare
from measure import Result

GOALS = {2: 4.0, 4: 2.0}
"""Times real time on two cores, both sides, by the most bounces of a leg."""
ELEMENTS_GOAL = 1.0
"""The same for 32 recorded elements, one side."""
PINGS = 4
"""Pings timed, each by all threads."""


def sidescan(order: int) -> Scenario:
    """The scene with legs of at most so many bounces, both sides, heard by beams."""
    return loaded(SCENE.replace("ORDER", str(order)).replace("incoherent", "coherent"))


def elements() -> Scenario:
    """The same to starboard, by each of 32 elements of a line of 1 m; legs of at most 2 bounces."""
    text = SCENE.replace("ORDER", "2").replace("incoherent", "coherent")
    text = text.replace("  sides: [port, starboard]\n", "  receiver: {record: elements}\n")
    receive = "receive: {kind: planar, width: 1 m, height: 0.02 m}"
    return loaded(text.replace(receive, "receive: {kind: line, length: 1 m, elements: 32}"))


def pings() -> list[Result]:
    """Real-time factor, processor time and scatterers of one ping."""
    found = []
    for order, goal in GOALS.items():
        found += _told(f"coherent ping, up to {order} bounces", sidescan(order), goal)
    return found + _told("32 elements, up to 2 bounces", elements(), ELEMENTS_GOAL)


def _told(name: str, scenario: Scenario, goal: float) -> list[Result]:
    listening = prepare(scenario)
    for _ in listen(listening, range(1), 2):
        pass
    wall, cores = time.perf_counter(), time.process_time()
    for _ in listen(listening, range(1, 1 + PINGS), 2):
        pass
    wall, cores = (time.perf_counter() - wall) / PINGS, (time.process_time() - cores) / PINGS
    blocks = [block for here in listening.stances(1) for block in listening.engine.blocks(here)]
    return [
        Result(f"{name}, 2 threads", WINDOW / wall, "x real time", f"goal {goal:g}"),
        Result(f"{name}, processor time", 1e3 * cores, "ms", f"goal {2e3 * WINDOW / goal:.0f}"),
        Result(f"{name}, scatterers", sum(len(block()) for block in blocks) / 1e3, "k", ""),
    ]


BENCHES = [pings]
