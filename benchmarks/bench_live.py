"""Time from a pose to a ping: a scanning sonar, a fan of 256 beams, a sidescan; directly, over TCP and over UDP.

Percentiles over some pings of one after the other, by two threads. Wall times include waiting for
other work of the machine, see its load; processor times count the same on a busy machine.
"""

import json
import os
import socket
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from bench_sidescan import SCENE, loaded
from insonify.real_time import LiveSonar, TcpServer, live, ping_protocol
from insonify.real_time.ping360 import DEVICE_DATA, MEASURED, SETTINGS, TRANSDUCER, Ping360
from insonify.scenario.scenario import Scenario
from measure import THREADS, Result

SCANNING = """
title: Scanning sonar
seed: 1
field: incoherent
water: {noise_level_db: 30 dB}
seabed: {depth: 10 m, scattering: {law: lambert, strength_db: -27}}
targets: [{shape: library, name: tyre, position: [8 m, 6 m]}]
sonar:
  source_level_db: 200
  pulse: {kind: cw, frequency: 750 kHz, duration: 0.05 ms}
  transmit: {kind: planar, width: 0.05 m, height: 0.004 m}
  receive: {kind: planar, width: 0.05 m, height: 0.004 m}
  receiver: {bandwidth: 30 kHz}
  mounting: {bearing: 0 deg, tilt: 0 deg}
track: {kind: line, start: [0 m, 0 m, 6 m], heading: 0 deg, speed: 0.2 m/s, pings: 400, interval: 0.05 s,
        window: [0 ms, 32 ms]}
paths: {max_reflections: 0}
"""
"""1200 samples, 24 m."""
FORWARD_LOOKING = """
title: Forward-looking sonar
seed: 1
field: incoherent
water: {noise_level_db: 30 dB}
seabed: {depth: 10 m, scattering: {law: lambert, strength_db: -27}}
targets: [{shape: library, name: tyre, position: [8 m, 2 m]}]
sonar:
  source_level_db: 200
  pulse: {kind: cw, frequency: 750 kHz, duration: 0.04 ms}
  transmit: {kind: planar, width: 0.0015 m, height: 0.005 m, steer: 0 deg}
  receive: {kind: planar, width: 0.1 m, height: 0.005 m, steer: {from: -60 deg, to: 60 deg, step: 0.470588235 deg}}
  receiver: {bandwidth: 30 kHz}
  mounting: {bearing: 0 deg, tilt: 15 deg}
track: {kind: line, start: [0 m, 0 m, 7 m], heading: 0 deg, speed: 0.5 m/s, pings: 400, interval: 0.1 s,
        window: [0 ms, 18.7 ms]}
paths: {max_reflections: 0}
"""
"""256 beams, 700 ranges, 14 m."""
CASES: dict[str, tuple[str, float, int]] = {
    "scanning": (SCANNING, 25.0, 200),
    "forward-looking": (FORWARD_LOOKING.replace("max_", "edge_diffraction: none, max_"), 200.0, 50),
    "forward-looking, edge diffraction": (FORWARD_LOOKING, 200.0, 10),
    "sidescan": (SCENE.replace("ORDER", "0"), 267.0, 100),
}
"""Scene, bar of the 99th percentile [ms] and number of pings; a sidescan's bar is its ping interval."""
SMALL = {"CASES": {"scanning": (SCANNING.replace("32 ms", "8 ms"), 25.0, 2)}}


def directly() -> list[Result]:
    """Pings of `insonify.live`."""
    found = []
    for name, (text, bar, count) in CASES.items():
        with _sonar(loaded(text)) as sonar:
            poses = [sonar.track_ping(ping) for ping in range(count)]
            found += _percentiles(f"live {name} ping", bar, [lambda p=pose: sonar.ping(**p) for pose in poses])
    return found


def over_tcp() -> list[Result]:
    """The same by a client of the TCP server, with all samples received."""
    found = []
    for name, (text, bar, count) in CASES.items():
        with (
            _sonar(loaded(text)) as sonar,
            TcpServer(sonar, port=0).start() as server,
            socket.create_connection(server.address) as connection,
            connection.makefile("rwb") as stream,
        ):
            stream.readline()
            lines = [_request(sonar.track_ping(ping)) for ping in range(count)]
            found += _percentiles(f"TCP {name} ping", bar, [lambda p=line: _reply(stream, p) for line in lines])
    return found


def over_udp() -> list[Result]:
    """Measurements of 1200 samples by a client of a Ping360, one angle after the other."""
    text, bar, count = CASES["scanning"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        device = Ping360(loaded(text), threads=THREADS)
    with device.start(), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.connect(device.address)
        *_, duration, period, frequency, samples, _ = MEASURED.unpack_from(device.report(DEVICE_DATA) or b"")
        sent = [
            SETTINGS.pack(1, 1, angle % 400, duration, period, frequency, samples, 1, 0) for angle in range(count)
        ]  # fmt: skip

        def measured(payload: bytes) -> None:
            client.send(ping_protocol.packed(ping_protocol.Message(TRANSDUCER, payload)))
            (reply,) = ping_protocol.messages(client.recv(1 << 16))
            assert reply.number != ping_protocol.NACK, reply.payload

        return _percentiles("UDP scanning ping", bar, [lambda p=payload: measured(p) for payload in sent])


def _sonar(scenario: Scenario) -> LiveSonar:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return live(scenario, threads=THREADS)


def _request(pose: dict[str, Any]) -> bytes:
    pose = {"method": "ping"} | pose
    return json.dumps(pose, default=lambda values: np.asarray(values).tolist()).encode() + b"\n"


def _reply(stream: Any, line: bytes) -> None:
    stream.write(line)
    stream.flush()
    head = json.loads(stream.readline())
    assert len(stream.read(head["bytes"])) == head["bytes"] > 0, head


def _percentiles(name: str, bar: float, pings: list[Callable[[], object]]) -> list[Result]:
    """Median and 99th percentile of wall and processor time of some pings, the first included."""
    wall, cores = [], []
    for ping in pings:
        begin, spent = time.perf_counter(), time.process_time()
        ping()
        wall.append(1e3 * (time.perf_counter() - begin))
        cores.append(1e3 * (time.process_time() - spent))
    found = [Result(f"{name}, load of the machine", os.getloadavg()[0], "1")]
    for kind, times in (("", wall), (", processor time", cores)):
        for part in (50, 99):
            goal = f"goal {bar * (THREADS if kind else 1):g}" if part == 99 else ""
            found.append(Result(f"{name}{kind}, {part} %", float(np.percentile(times, part)), "ms", goal))
    return found


BENCHES = [directly, over_tcp, over_udp]
