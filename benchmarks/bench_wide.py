"""Time of a frame of a wide, fine sonar: 900 kHz, 130 deg, 64 elements, 10 m over a flat bed, pressures.

Processor time of one ping, on one thread. The sonar records its 64 elements, or 256 beams; its sweep is 30 kHz or
300 kHz wide, with range cells of 2.5 cm and 2.5 mm.
"""

import time

from bench_sidescan import loaded
from insonify.scenario.scenario import Scenario
from insonify.simulator import Simulator, build_simulator, simulate_pings
from measure import Result

SCENE = """
title: Imaging sonar
seed: 1
seabed: {depth: 5 m, scattering: {law: lambert, strength_db: -27}}
sonar:
  source_level_db: 200
  pulse: {kind: lfm, frequency: 900 kHz, bandwidth: SWEEP kHz, duration: 0.5 ms}
  transmit: {kind: planar, width: 0.8 mm, height: 5 mm, steer: 0 deg}
  receive: {kind: planar, width: 53.3 mm, height: 5 mm, columns: 64BEAMS}
  receiver: {bandwidth: BAND kHz, record: CHANNELS, sub_bands: 1}
  mounting: {bearing: 0 deg, tilt: 20 deg}
track: {kind: static, position: [0 m, 0 m, 3 m], window: [0 ms, 14.5 ms], pings: 8}
paths: {max_reflections: ORDER}
"""
STEER = ", steer: {from: -65 deg, to: 65 deg, step: 0.509803922 deg}"
SWEEPS = (30, 300)
"""Bandwidths [kHz]."""
GOALS = {0: 2.0, 2: 5.0}
"""Seconds of processor time for a frame, by the most bounces of a leg."""
FRAMES = 3
"""Frames that are timed, one after the other: the quickest counts."""
SMALL = {
    "SCENE": SCENE.replace("[0 ms, 14.5 ms]", "[4 ms, 5 ms]"),
    "STEER": ", steer: {from: -10 deg, to: 10 deg, step: 5 deg}",
    "SWEEPS": (30,), "GOALS": {0: 2.0}, "FRAMES": 1,
}  # fmt: skip


def imaging(sweep: int, channels: str, order: int) -> Scenario:
    """The scene with so wide a sweep [kHz], recorded as beams or elements, legs of at most so many bounces."""
    text = SCENE.replace("SWEEP", str(sweep)).replace("BAND", str(sweep * 6 // 5)).replace("ORDER", str(order))
    return loaded(text.replace("CHANNELS", channels).replace("BEAMS", STEER if channels == "beams" else ""))


def frames() -> list[Result]:
    """Processor time and scatterers of a frame."""
    found = []
    for sweep in SWEEPS:
        for channels in ("elements", "beams"):
            for order, goal in GOALS.items():
                simulator = build_simulator(imaging(sweep, channels, order))
                name = f"{sweep} kHz, {simulator.scenario.sonar.channel_count} {channels}, up to {order} bounces"
                found.append(Result(f"{name}, processor time", _seconds(simulator), "s", f"goal {goal:g}"))
                if channels == "elements" and order == 0:
                    blocks = simulator.engine.blocks(simulator.ping_geometry(0))
                    found.append(Result(f"{name}, scatterers", sum(len(block()) for block in blocks) / 1e3, "k", ""))
    return found


def _seconds(simulator: Simulator) -> float:
    """Least processor time of some frames, after one that compiles and fills caches [s]."""
    times = []
    for ping in range(1 + FRAMES):
        begin = time.process_time()
        for _ in simulate_pings(simulator, [ping], 1):
            pass
        times.append(time.process_time() - begin)
    return min(times[1:])


BENCHES = [frames]
