"""How long one ping takes, from the scene to the series: the nominal flat scene, three families on the seabed."""

from collections.abc import Callable

import insonify
from insonify.propagation.choice import PathChoice
from insonify.scenario.scenario import Scenario
from insonify.simulation import prepare
from measure import Result, best_seconds

NOMINAL = insonify.load_scenario("examples/nominal.yaml")
ABOUT_300K = 2.5
"""Scatterers per resolution cell at which the nominal ping has about 300 thousand."""


def nominal(per_cell: float, **changes: object) -> Scenario:
    """The nominal scene with another density of scatterers."""
    paths = PathChoice(scatterers_per_cell=per_cell, reflections=2)
    return NOMINAL.model_copy(update={"paths": paths, **changes})


def scatterers(scenario: Scenario) -> int:
    """Scatterers that one ping of a scenario meets."""
    listening = prepare(scenario)
    return sum(len(block()) for block in listening.engine.blocks(listening.stance(0)))


def coherent_ping() -> list[Result]:
    """One and two threads, with the goal of 0.3 s for 300 thousand scatterers on two cores."""
    scenario = nominal(ABOUT_300K)
    count = scatterers(scenario)
    times = best_seconds({"1": _ping(scenario, 1), "2": _ping(scenario, 2)})
    return [
        Result(f"coherent ping, {count / 1e3:.0f} k scatterers, 9 pairs, 1 core", times["1"], "s"),
        Result(f"coherent ping, {count / 1e3:.0f} k scatterers, 9 pairs, 2 cores", times["2"], "s",
               f"{times['1'] / times['2']:.2f} x one core; goal 0.3 s at 300 k"),
    ]  # fmt: skip


def incoherent_ping() -> list[Result]:
    """The expected intensity of the same ping, and of the full density."""
    dense, sparse = nominal(5.0, field="incoherent"), nominal(ABOUT_300K, field="incoherent")
    times = best_seconds({"dense": _ping(dense, 2), "sparse": _ping(sparse, 2)})
    return [
        Result(f"incoherent ping, {scatterers(sparse) / 1e3:.0f} k scatterers, 2 cores", times["sparse"], "s"),
        Result(f"incoherent ping, {scatterers(dense) / 1e3:.0f} k scatterers, 2 cores", times["dense"], "s"),
    ]


def _ping(scenario: Scenario, threads: int) -> Callable[[], object]:
    return lambda: insonify.simulate(scenario, threads=threads)


BENCHES = [coherent_ping, incoherent_ping]
