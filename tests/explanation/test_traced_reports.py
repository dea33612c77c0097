"""Pages of tracer recordings of both sides along a line: the echoes of each side, at the delays of each ping."""

import numpy as np
import pytest
import xarray as xr

from insonify import simulate
from insonify.explanation.sample_report import explain_sample
from insonify.sonar.received_pulse import received_pulse
from oracles.scenes import nominal, point

PINGS, SPEED, INTERVAL, DOWN = 5, 10.0, 0.5, 8.0
PATHS = {
    "engine": "tracer", "rays": 1000, "edge_diffraction": "none", "contributions": ["target", "boundary echo"],
    "max_reflections": 1,
}  # fmt: skip
POLES = {1: ("east", 21.0), 0: ("west", -30.0)}
"""Label and easting of the pole that each channel looks at; port is the first."""
PULSE = received_pulse(nominal().sonar)


@pytest.fixture(scope="module")
def passed():
    """Pings of a two-sided sonar of wide beams past two poles, one on each side of a line to the north."""
    wide = {"kind": "planar", "length": None, "width": 0.02, "height": 0.02}
    track = {"kind": "line", "start": (0.0, 0.0, 11.0), "heading": 0.0, "speed": SPEED, "pings": PINGS,
             "interval": INTERVAL, "window": (0.01, 0.06)}  # fmt: skip
    return simulate(nominal(
        targets=[point(2 * SPEED * INTERVAL, east, 19.0, label=name, strength=20.0) for name, east in POLES.values()],
        field="incoherent", paths=PATHS, line=wide,
        sonar={"sides": ["port", "starboard"], "mounting": {"bearing": "90 deg", "tilt": "15 deg"}},
    ).with_("track", track))  # fmt: skip


def delay_to(ping, channel):
    """Travel time from a ping's place to the pole of a side and back: stop and hop [s]."""
    return 2 * np.sqrt(((2 - ping) * SPEED * INTERVAL) ** 2 + POLES[channel][1] ** 2 + DOWN**2) / 1500


@pytest.mark.parametrize("channel", POLES)
@pytest.mark.parametrize("ping", range(PINGS))
def test_each_ping_has_its_own_delay_to_the_pole_of_each_side(passed: xr.Dataset, ping: int, channel: int) -> None:
    """D-D at the time of travel from where that ping was, to half a microsecond; its level at the peak is recorded.

    That of the strongest sample, times the highest power of the received pulse over the one at that sample: to 0.1 dB.
    """
    due = delay_to(ping, channel)
    page = explain_sample(passed, ping, due + 1e-4, channel=channel)
    (line,) = (line for line in page.splitlines() if f"  {POLES[channel][0]} by D-D: arrives at" in line)
    assert page.startswith(f"ping {ping}, beam {channel}, ")
    assert float(line.split()[5]) == pytest.approx(due * 1e3, abs=6e-4)
    time, intensity = passed["time"].values, passed["intensity"].values[ping, channel]
    row = int(np.argmax(intensity * (np.abs(time - due - 1e-4) < 1e-4)))
    power = np.abs(PULSE.samples(np.append(time[row] - due, np.linspace(0, 2e-4, 1000)))) ** 2
    at_peak = intensity[row] * power.max() / power[0]
    assert float(line.split()[7]) == pytest.approx(10 * np.log10(at_peak), abs=0.1)
    total, recorded = (float(one.split()[-5]) for one in page.splitlines() if one[:3] in ("all", "rec"))
    assert total == pytest.approx(recorded, abs=0.1)


def test_the_strongest_side_is_taken_unless_one_is_named(passed: xr.Dataset) -> None:
    """At the delay of each pole, its own side."""
    for channel in POLES:
        assert explain_sample(passed, 2, delay_to(2, channel) + 1e-4).startswith(f"ping 2, beam {channel}, ")
