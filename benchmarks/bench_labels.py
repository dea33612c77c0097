"""Processor time of a recording with labels over that of one without, written to disk by one thread.

Both runs of a scene take turns in one process; each keeps its best time. Kernels are compiled, and the ground drawn, by
a run of each before the clock starts. Sonars look to starboard; sidescans pass targets.
"""

import tempfile
import time
from pathlib import Path

from bench_live import FORWARD_LOOKING
from bench_sidescan import SCENE as NOMINAL
from bench_sidescan import loaded
from bench_wide import imaging
from insonify.recording_run import record
from insonify.scenario.scenario import Scenario
from measure import Result

SIDESCAN = """
title: Sidescan past targets
seed: 1
field: FIELD
seabed: {depth: 15 m, scattering: {law: lambert, strength_db: -27}RELIEF}
targets:
  - {shape: library, name: tyre, position: [4 m, 22 m]}
  - {shape: box, label: crate, position: [12 m, 35 m], size: [2 m, 1 m, 1 m]}
  - {shape: cylinder, label: drum, position: [20 m, 28 m], diameter: 0.6 m, length: 1 m}
sonar:
  source_level_db: 220
  pulse: {kind: cw, frequency: 400 kHz, duration: 0.05 ms}
  transmit: {kind: planar, width: 0.5 m, height: 0.01 m}
  receive: {kind: planar, width: 0.5 m, height: 0.01 m}
  receiver: {sub_bands: 1}
  mounting: {bearing: 90 deg, tilt: 20 deg}
track:
  {kind: line, start: [0 m, 0 m, 8 m], heading: 0 deg, speed: 2 m/s, pings: 200, interval: 0.1 s, window: [0 ms, 80 ms]}
paths: {max_reflections: ORDER}
"""
RELIEF = ", relief: {kind: power-law, hurst: 0.8, rms: 3 cm}"
GOAL = 1.5
ROUNDS = 3
"""Rounds of both runs: the best of each counts."""
PINGS = 100
"""Pings of a sidescan."""
FRAMES = 8
"""Frames of a wide sonar."""
CASES = ("100 kHz expected", "400 kHz flat", "400 kHz relief", "750 kHz expected", "900 kHz wide")
SMALL = {
    "SIDESCAN": SIDESCAN.replace("[0 ms, 80 ms]", "[25 ms, 35 ms]"), "ROUNDS": 1, "PINGS": 2, "FRAMES": 1,
    "CASES": ("400 kHz flat, order 0",),
}  # fmt: skip


def passing(relief: str, order: int, field: str = "coherent") -> Scenario:
    """The 400 kHz sidescan over a bed with or without relief, with legs of at most so many bounces."""
    return loaded(SIDESCAN.replace("RELIEF", relief).replace("ORDER", str(order)).replace("FIELD", field))


def nominal(order: int) -> Scenario:
    """The 100 kHz sidescan, both sides, with legs of at most so many bounces."""
    return loaded(NOMINAL.replace("ORDER", str(order)))


def scenes() -> dict[str, tuple[Scenario, range]]:
    """Scenarios by name, and the pings that are recorded."""
    along, frames = range(0, 200, 200 // PINGS), range(FRAMES)
    near = range(300 - 2 * PINGS, 300 + 2 * PINGS)
    made = {f"100 kHz expected relief, order {order}": (nominal(order), near) for order in (0, 1, 2)}
    for name, relief in (("flat", ""), ("relief", RELIEF)):
        for order in (0, 1, 2):
            made[f"400 kHz {name}, order {order}"] = passing(relief, order), along
    for order in (0, 1):
        scene = loaded(FORWARD_LOOKING.replace("max_reflections: 0", f"max_reflections: {order}"))
        made[f"750 kHz expected frame, order {order}"] = scene, frames
    made |= {f"900 kHz wide, order {order}": (imaging(30, "beams", order), frames) for order in (0, 1)}
    return {name: scene for name, scene in made.items() if name.startswith(CASES)}


def ratios() -> list[Result]:
    """Processor time of a ping without labels, and the ratio with them."""
    found = []
    for name, (scenario, pings) in scenes().items():
        best = {False: float("inf"), True: float("inf")}
        # removed after the last run: ext4 creates files slowly, 1 ms each, for half a minute after many were deleted
        with tempfile.TemporaryDirectory() as folder:
            for labelled in best:  # compiles, and draws the ground
                _seconds(scenario, pings, labelled, Path(folder) / f"warm-{labelled}")
            for k in range(ROUNDS):
                for labelled in best:
                    taken = _seconds(scenario, pings, labelled, Path(folder) / f"{k}-{labelled}")
                    best[labelled] = min(best[labelled], taken / len(pings))
        found.append(Result(f"{name}, without labels", 1e3 * best[False], "ms"))
        found.append(Result(f"{name}, with labels", best[True] / best[False], "x", f"goal {GOAL:g}"))
    return found


def _seconds(scenario: Scenario, pings: range, labelled: bool, path: Path) -> float:
    """Processor time of a recording, written [s]."""
    begin = time.process_time()
    record(scenario, path, pings=pings, threads=1, with_labels=labelled)
    return time.process_time() - begin


BENCHES = [ratios]
