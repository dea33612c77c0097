"""Coherent sidescan past a body: its echoes by each pair of families, and the shadow with multipath."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.paper.checked_numbers import CheckedNumber
from insonify.plotting.multipath_view import PassByLevels, TargetEcho, multipath_view
from insonify.plotting.target_view import middle
from insonify.propagation.families import image_depth
from insonify.scenario.scenario import Scenario
from insonify.scene.target import Box
from insonify.simulator import build_simulator, simulate
from insonify.units import level_db

Floats = NDArray[np.float64]

PAIRS = (("D", "D"), ("D", "S"), ("S", "S"), ("D", "BS"), ("S", "BS"), ("BS", "BS"))
"""Pairs of families whose echoes of a body are separate in time."""
LIT = 0.4
"""Largest distance of averaged pings from the centre of the body, relative to its half length [1]."""
BESIDE = 4.0
"""Least along-track distance of the undisturbed seabed from the centre of the box [m]."""
BEHIND = 0.15, 0.9
"""Part of the shadow's length over which its level is averaged [1]."""


def coherent_sidescan(recording: xr.Dataset, scenario: Scenario) -> tuple[Figure, list[CheckedNumber]]:
    """Draw the image beside that of direct paths only, and the mean echo of the body with its numbers.

    Args:
        recording: Complete recording of one beam that looks east from a track to the north.
        scenario: Scenario with a box; it is simulated again without reflections, and as expected intensity.
    """
    box = next(target for target in scenario.targets if isinstance(target, Box))
    pings, north = recording["ping"].values, recording["position"].values[:, 0]
    on = np.flatnonzero(np.abs(north - box.position[0]) <= LIT * box.size[0] / 2)
    direct = scenario.model_copy(update={"paths": scenario.paths.model_copy(update={"max_reflections": 0})})
    direct_recording = simulate(direct, pings=pings.tolist())
    every, single = (np.abs(r["pressure"].values[:, 0].astype(complex)) ** 2 for r in (recording, direct_recording))
    expected = []
    for modelled in (scenario, direct):
        incoherent = modelled.model_copy(update={"field": "incoherent"})
        expected.append(simulate(incoherent, pings=pings[on].tolist())["intensity"].values[:, 0])
    time, echoes, dark = recording["time"].values, echo_times(scenario, box), shadow(scenario, box)
    passing = PassByLevels(time, north - box.position[0], every, single, every[on].mean(axis=0),
                           single[on].mean(axis=0), expected[0].mean(axis=0), expected[1].mean(axis=0))  # fmt: skip
    title = f"{scenario.title}: {scenario.sonar.pulse.frequency / 1e3:g} kHz, {len(pings)} pings"
    figure = multipath_view(passing, echoes, dark, scenario.water.sound_speed, title)
    return figure, [*echo_numbers(passing, echoes, scenario), *shadow_numbers(passing, dark, echoes)]


def echo_times(scenario: Scenario, box: Box) -> list[TargetEcho]:
    """Start times of the echoes of a box's near face, by image sources.

    Args:
        scenario: Scenario of the recording.
        box: Box whose near face is turned west to the track.
    """
    position = _start(scenario)
    floor, source = scenario.seabed.depth, position[2]
    near = box.position[1] - box.size[1] / 2 - position[1]
    foot = float(middle(box, scenario.scene)[2]) + box.size[2] / 2
    face = np.array([foot - box.size[2], foot])
    leg = {f: np.hypot(near, face - image_depth(f, source, floor)) for pair in PAIRS for f in pair}
    both = [(leg[out] + leg[back]) / scenario.water.sound_speed for out, back in PAIRS]
    return [
        TargetEcho(f"{out}-{back}", float(d.min()), float(np.ptp(d)))
        for (out, back), d in zip(PAIRS, both, strict=True)
    ]


def shadow(scenario: Scenario, box: Box) -> tuple[float, float]:
    """Start and end of the shadow of a box for direct paths on a flat seabed [s]."""
    position = _start(scenario)
    height = scenario.seabed.depth - position[2]
    far = box.position[1] + box.size[1] / 2 - position[1]
    ends = np.array([far, far * height / (height - box.size[2])])
    first, last = 2 * np.hypot(ends, height) / scenario.water.sound_speed
    return float(first + scenario.sonar.pulse.duration), float(last)


def echo_numbers(passing: PassByLevels, echoes: list[TargetEcho], scenario: Scenario) -> list[CheckedNumber]:
    """Times at which each echo rises to half its maximum, compared with image sources to the face.

    Args:
        passing: Mean-square pressures of the pass.
        echoes: Echoes with their start times.
        scenario: Scenario of the recording.
    """
    numbers, pulse = [], scenario.sonar.pulse.duration
    for echo in echoes:
        near = (passing.time > echo.delay - pulse / 2) & (passing.time < echo.delay + echo.spread + pulse)
        time, power = passing.time[near], passing.trace[near]
        after = int(np.argmax(power > power.max() / 2))
        numbers.append(CheckedNumber(f"echo {echo.pair}: rises", float(time[after]) * 1e3, "ms",
                                     (echo.delay + echo.spread / 2) * 1e3, (echo.spread + pulse) / 2 * 1e3,
                                     "image sources to the near face"))  # fmt: skip
    return numbers


def shadow_numbers(passing: PassByLevels, dark: tuple[float, float], echoes: list[TargetEcho]) -> list[CheckedNumber]:
    """Level of the shadow with and without multipath, compared with the expected intensity.

    Args:
        passing: Mean-square pressures of the pass.
        dark: Start and end of the shadow of direct sound [s].
        echoes: Echoes of the box with their start times.
    """
    first = max(dark[0] + BEHIND[0] * (dark[1] - dark[0]), echoes[-1].delay + echoes[-1].spread + 1e-3)
    inside = (passing.time > first) & (passing.time < dark[0] + BEHIND[1] * (dark[1] - dark[0]))
    numbers = []
    for name, image, trace, expected in (
        ("direct paths alone", passing.direct, passing.direct_trace, passing.direct_expected),
        ("with multipath", passing.image, passing.trace, passing.expected),
    ):
        bed = float(image[np.abs(passing.along) > BESIDE][:, inside].mean())
        value, target = (float(level_db(row[inside].mean() / bed)) for row in (trace, expected))
        label = f"shadow re the bed beside it, {name}"
        numbers.append(CheckedNumber(label, value, "dB", target, 1.5, "expected intensity"))
    return numbers


def _start(scenario: Scenario) -> tuple[float, float, float]:
    """North, east, depth of the sonar at the first ping [m]."""
    north, east, depth = (float(x) for x in build_simulator(scenario).platforms.transmitter_poses.position[0])
    return north, east, depth
