"""Time of a sidescan ping against real time: 100 kHz, 200 m to either side, fractal terrain, a mesh on it."""

import tempfile
import time
from pathlib import Path

from insonify.recording_run import record
from insonify.scenario.load import load_scenario
from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator
from measure import THREADS, Result, ping_seconds, ratios_in_turns

WINDOW = 0.267
"""Of one ping [s]: 200 m there and back."""
GOALS = {0: 50.0, 2: 15.0, 4: 7.0}
"""Times real time on two cores, by the most bounces of a leg."""
CHANGED_ORDERS = (0, 2)
SURVEYS = {0: 4.0, 2: 6.0}
"""Seconds for a thousand pings, written."""
WARM, PINGS = 100, 300
"""Pings simulated before the clock starts, and timed: to the target, past it and away."""
SCENE = """
title: Sidescan of fractal ground
seed: 1
field: incoherent
seabed: {depth: 20 m, scattering: {law: lambert, strength_db: -27}, relief: {kind: power-law, hurst: 0.8, rms: 5 cm}}
targets: [{shape: library, name: tyre, position: [60 m, 60 m]}]
sonar:
  source_level_db: 220
  pulse: {kind: cw, frequency: 100 kHz, duration: 0.1 ms}
  transmit: {kind: planar, width: 1 m, height: 0.02 m}
  receive: {kind: planar, width: 1 m, height: 0.02 m}
  receiver: {sub_bands: 1}
  mounting: {bearing: 90 deg, tilt: 20 deg}
  sides: [port, starboard]
track:
  {kind: line, start: [0 m, 0 m, 12 m], heading: 0 deg, speed: 2 m/s, pings: 1000, interval: 0.267 s,
   window: [0 ms, 267 ms]}
paths: {max_reflections: ORDER}
"""
ROLLING = (
    "window: [0 ms, 267 ms]",
    "window: [0 ms, 267 ms], motion: {roll: {rms: 1 deg, period: 5 s}, heave: {rms: 5 cm, period: 5 s}}",
)
"""Part of the scene, and what takes its place where the platform rolls and heaves."""
LAYERED = (
    "seabed: {",
    "water: {profile: [[0 m, 1505 m/s], [8 m, 1500 m/s], [20 m, 1490 m/s]], smoothing: 1 m}\nseabed: {",
)
"""The same where the sound speed changes with depth."""
CHANGED = {"rolling platform": ROLLING, "layered water": LAYERED}
CHANGED_FACTOR = 1.5
"""Processor time of these scenes over that of the scene as it is, at most [1]."""


def sidescan(order: int) -> Scenario:
    """The scene with legs of at most so many bounces."""
    return loaded(SCENE.replace("ORDER", str(order)))


def loaded(text: str) -> Scenario:
    """A scenario from its text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sidescan.yaml"
        path.write_text(text)
        return load_scenario(path)


def pings() -> list[Result]:
    """Real-time factor of each order, and its processor time: that counts the same on a busy machine."""
    found = []
    for order, goal in GOALS.items():
        name = f"sidescan ping, up to {order} bounces"
        wall, cores = ping_seconds(build_simulator(sidescan(order)), WARM, PINGS)
        found += [
            Result(f"{name}, {THREADS} threads", WINDOW / wall, "x real time", f"goal {goal:g}"),
            Result(f"{name}, processor time", 1e3 * cores, "ms", f"goal {2e3 * WINDOW / goal:.1f}"),
        ]
    return found


def changed() -> list[Result]:
    """Processor time where the platform rolls, and in layered water, re that of the scene as it is."""
    found = []
    for order in CHANGED_ORDERS:
        scene = SCENE.replace("ORDER", str(order))
        found += changed_ratios(f"sidescan ping, up to {order} bounces", scene, rounds=60)
    return found


def changed_ratios(case: str, scene: str, rounds: int) -> list[Result]:
    """Processor time of a ping of each of `CHANGED`, re that of the scene, in turns.

    Args:
        case: What is measured.
        scene: Text of the scene.
        rounds: Rounds of batches of pings.
    """
    scenes = [scene, *(scene.replace(*parts) for parts in CHANGED.values())]
    ratios = ratios_in_turns([loaded(text) for text in scenes], warm=10, batch=5, rounds=rounds)
    return [
        Result(f"{case}, {name}", ratio, "x the plain scene", f"goal {CHANGED_FACTOR:g}")
        for name, ratio in zip(CHANGED, ratios[1:], strict=True)
    ]


def surveys() -> list[Result]:
    """A thousand pings, to disk."""
    found = []
    for order, goal in SURVEYS.items():
        with tempfile.TemporaryDirectory() as folder:
            begin = time.perf_counter()
            record(sidescan(order), Path(folder) / "survey.zarr", threads=THREADS)
            taken = time.perf_counter() - begin
        found.append(Result(f"1000 pings written, up to {order} bounces", taken, "s", f"goal {goal:g}"))
    return found


SMALL = {
    "SCENE": SCENE.replace("pings: 1000", "pings: 3").replace("[0 ms, 267 ms]", "[20 ms, 40 ms]"),
    "SURVEYS": {0: 10.0},
    "GOALS": {0: 50.0, 2: 15.0},
    "CHANGED_ORDERS": (0,),
}
BENCHES = [pings, changed, surveys]
