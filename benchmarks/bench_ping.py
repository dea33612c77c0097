"""Time of one ping, from the scene to the series: the nominal flat scene, three families on the seabed."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import insonify
from insonify.ocean.water import Water
from insonify.propagation.path_settings import PathSettings
from insonify.scenario.scenario import Scenario
from insonify.simulator import accumulate_ping, build_simulator
from measure import Result, best_seconds

THERMOCLINE = [[0.0, 1510.0], [8.0, 1510.0], [14.0, 1490.0], [20.0, 1490.0]]
"""Depth [m] and sound speed [m/s]."""
NOMINAL = insonify.load_scenario(Path(__file__).parents[1] / "examples" / "nominal.yaml")
ABOUT_300K = 2.5
"""Scatterers per resolution cell at which the nominal ping has about 300 thousand."""


def nominal(per_cell: float, **changes: object) -> Scenario:
    """The nominal scene with another density of scatterers."""
    paths = PathSettings(scatterers_per_cell=per_cell, max_reflections=2)
    return NOMINAL.with_("sonar.receiver.sub_bands", 1).model_copy(update={"paths": paths, **changes})


def scatterers(scenario: Scenario) -> int:
    """Scatterers of one ping of a scenario."""
    simulator = build_simulator(scenario)
    return sum(len(block()) for block in simulator.engine.blocks(simulator.ping_geometry(0)))


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


def layered_ping() -> list[Result]:
    """The coherent ping through a thermocline, beside the one in water of one speed; tables are made once, before."""
    plain = nominal(ABOUT_300K)
    water = {key: value for key, value in plain.water.model_dump().items() if key not in ("sound_speed", "profile")}
    layered = nominal(ABOUT_300K, water=Water(**water, profile=THERMOCLINE))
    times = best_seconds({"plain": _accumulated(plain), "layered": _accumulated(layered)})
    return [
        Result(f"coherent ping through a thermocline, {scatterers(layered) / 1e3:.0f} k scatterers, 1 core",
               times["layered"], "s", f"{times['layered'] / times['plain']:.2f} x one sound speed; goal 1.3"),
    ]  # fmt: skip


def incoherent_ping() -> list[Result]:
    """The expected intensity of the same ping, and of the full density."""
    dense, sparse = nominal(5.0, field="incoherent"), nominal(ABOUT_300K, field="incoherent")
    times = best_seconds({"dense": _ping(dense, 2), "sparse": _ping(sparse, 2)})
    return [
        Result(f"incoherent ping, {scatterers(sparse) / 1e3:.0f} k scatterers, 2 cores", times["sparse"], "s"),
        Result(f"incoherent ping, {scatterers(dense) / 1e3:.0f} k scatterers, 2 cores", times["dense"], "s"),
    ]


def _accumulated(scenario: Scenario) -> Callable[[], object]:
    """One ping of a survey in progress: what is computed once for all pings is cached."""
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)

    def ping() -> object:
        with ThreadPoolExecutor(1) as pool:
            return accumulate_ping(simulator, simulator.coherent_accumulator(here), here, pool)

    return ping


def _ping(scenario: Scenario, threads: int) -> Callable[[], object]:
    return lambda: insonify.simulate(scenario, threads=threads)


SMALL = {
    "NOMINAL": NOMINAL.model_copy(update={"track": NOMINAL.track.model_copy(update={"window": (0.19, 0.2)})}),
    "ABOUT_300K": 0.5,
}
BENCHES = [coherent_ping, layered_ping, incoherent_ping]
