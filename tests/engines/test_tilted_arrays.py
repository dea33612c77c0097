"""Arrays of every kind, on ships that lean, received through the whole engine against a sum over their points."""

import warnings

import numpy as np
import pytest

from insonify.simulator import build_simulator, simulate
from oracles import beams
from oracles.scenes import nominal, point
from oracles.time_series import pulse_spectrum, received, relative_rms
from oracles.water import fold

SPEED, CARRIER, DEPTH, LEVEL = 1500.0, 100e3, 20.0, 220.0
WAVE = SPEED / CARRIER
HERE = np.array([0.0, 0.0, 11.0])
WINDOW = (0.07, 0.12)
BUOYS = ((-9.0, 60.0, 4.0), (-3.0, 63.0, 18.0), (0.5, 66.0, 9.0), (4.0, 58.0, 15.0), (12.0, 61.0, 12.0))
LEVEL_SHIP = {"heading": 0.0, "pitch": 0.0, "roll": 0.0}
LEANING = {"heading": 0.2, "pitch": -0.07, "roll": 0.11}


def panel(**changes: object) -> dict[str, object]:
    """A panel array as the scenario describes it."""
    return {"kind": "planar", "length": None, "width": 0.2, "height": 0.05, **changes}


ARRAYS = {
    "pistons": {"length": 0.3, "elements": 40, "element": "piston"},
    "taylor": {"length": 0.3, "shading": "taylor"},
    "hamming elements": {"length": 0.3, "elements": 40, "shading": "hamming", "element": "cosine"},
    "cosine, all round": {"length": 0.3, "shading": "cosine", "element": "omni"},
    "panel steered down": panel(steer_down=np.radians(6), steer=[np.radians(-4)], shading="hann"),
    "panel of pistons": panel(columns=27, rows=7, element="piston", shading_down="hamming"),
    "taylor panel": panel(columns=30, shading="taylor", shading_down="taylor", element="baffled"),
}


def described(array: dict[str, object]) -> dict[str, object]:
    """The same array in the oracle's words."""
    one = {"width": array.get("length") or array.get("width"), "columns": array.get("elements", array.get("columns"))}
    kept = ("height", "rows", "shading", "shading_down", "element")
    return one | {name: array[name] for name in kept if name in array}


def described_of(
    transmit: dict[str, object], receive: dict[str, object], lean: dict[str, float], tilt: float
) -> object:
    """Five buoys in clear water received by one sonar, direct paths and one bounce."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return nominal(
            targets=[point(*place, label=f"buoy {n}", strength=-5.0) for n, place in enumerate(BUOYS)],
            water={"noise_level_db": None, "absorption_db_per_m": 0.03},
            paths={"max_reflections": 1, "contributions": ["target"]},
            track={"position": tuple(HERE), "window": WINDOW, **lean},
            sonar={"mounting": {"tilt": tilt}},
            transmit=transmit,
            receive=receive,
        )


def summed(transmit: dict[str, object], receive: dict[str, object], lean: dict[str, float], tilt: float,
           steers: list[tuple[tuple[float, float], tuple[float, float]]], time: np.ndarray) -> np.ndarray:  # fmt: skip
    """The same by adding up every point of both apertures for every echo."""
    body = beams.axes(**lean, bearing=0.0)
    frame = beams.axes(**lean, tilt=tilt)
    ends = [HERE + body @ np.array(array.get("offset", (0.0, 0.0, 0.0))) for array in (transmit, receive)]
    arrays = described(transmit), described(receive)
    delay, weight = [], []
    for place in BUOYS:
        ways = [{f: fold(end, place, f, DEPTH) for f in ("D", "S", "B")} for end in ends]
        for f, out in ways[0].items():
            for g, back in ways[1].items():
                way = out.length + back.length
                bounced = np.prod([{"D": 1, "S": -1, "B": 0.35}[name] for name in (f, g)])
                echo = bounced / (out.length * back.length) * 10 ** ((LEVEL - 5 - 0.03 * way) / 20)
                gains = [
                    beams.gain(out.departure, frame, WAVE, sent, **arrays[0])
                    * beams.gain(back.departure, frame, WAVE, listened, **arrays[1])
                    for sent, listened in steers
                ]
                delay.append(way / SPEED)
                weight.append(echo * np.array(gains))

    def spectrum(offset: np.ndarray) -> np.ndarray:
        return pulse_spectrum(offset, duration=0.2e-3, fraction=0.2, bandwidth=0.0, band=20e3, matched_filter=False)

    rows = np.array(weight).T
    return np.array([received(np.array(delay), row, time, CARRIER, spectrum, 25e3, 2048) for row in rows])


def steer_of(array: dict[str, object]) -> tuple[float, float]:
    """Direction of the only beam of an array."""
    return (array.get("steer") or [0.0])[0], array.get("steer_down") or 0.0


@pytest.mark.parametrize("lean", [LEVEL_SHIP, LEANING], ids=["level", "leaning"])
@pytest.mark.parametrize("name", ARRAYS)
def test_an_array_is_the_sum_of_its_points(name: str, lean: dict[str, float]) -> None:
    """45 echoes of five buoys through two like arrays, off axis and on: relative rms 1e-5 of the sum over points.

    Patterns from tables are good to 1e-7, the time grid to 1e-5.
    """
    array = ARRAYS[name]
    scenario = described_of(array, array, lean, 0.05)
    pressure = simulate(scenario)
    truth = summed(array, array, lean, 0.05, [(steer_of(array), steer_of(array))], pressure.time.values)
    assert relative_rms(pressure.pressure.values[0], truth) < 1e-5


def test_many_receivers_share_one_transmitter() -> None:
    """One wide transmit beam ahead, three narrow receive beams, ends 3 m apart, ship leaning: each channel its sum."""
    steer = [-0.12, 0.0, 0.15]
    transmit = {"length": 0.06, "shading": "uniform", "steer": [0.0], "offset": (2.0, 0.0, -0.5)}
    receive = {"length": 0.5, "shading": "hann", "steer": steer, "offset": (-1.0, 0.4, 0.3)}
    scenario = described_of(transmit, receive, LEANING, 0.1)
    pressure = simulate(scenario)
    pairs = [((0.0, 0.0), (angle, 0.0)) for angle in steer]
    truth = summed(transmit, receive, LEANING, 0.1, pairs, pressure.time.values)
    assert pressure.sizes["channel"] == 3
    for channel in range(3):
        assert relative_rms(pressure.pressure.values[0, channel], truth[channel]) < 1e-5, channel
    np.testing.assert_allclose(pressure.steer, steer)


def test_a_transmitter_without_a_steer_follows_the_receivers() -> None:
    """Transmit beams fall in with the receive beams, pair by pair; a panel that looks down takes a line along.

    A line can only look along a cone: asin(sin right cos down) off its cross plane.
    """
    down, steer = 0.1, [-0.1, 0.2]
    transmit = {"length": 0.3}
    receive = panel(steer=steer, steer_down=down)
    scenario = described_of(transmit, receive, LEVEL_SHIP, 0.0)
    pressure = simulate(scenario)
    cones = [np.arcsin(np.sin(angle) * np.cos(down)) for angle in steer]
    pairs = [((cone, 0.0), (angle, down)) for cone, angle in zip(cones, steer, strict=True)]
    truth = summed(transmit, receive, LEVEL_SHIP, 0.0, pairs, pressure.time.values)
    for channel in range(2):
        assert relative_rms(pressure.pressure.values[0, channel], truth[channel]) < 1e-5, channel


def test_a_rolled_ship_receives_as_one_with_its_array_tilted() -> None:
    """Roll to starboard dips a starboard array: 0.2 rad of roll is 0.2 rad of tilt, to rounding."""
    array = panel()
    rolled = simulate(described_of(array, array, {**LEVEL_SHIP, "roll": 0.2}, 0.0)).pressure.values
    tilted = simulate(described_of(array, array, LEVEL_SHIP, 0.2)).pressure.values
    assert relative_rms(rolled, tilted) < 1e-6


def test_heading_and_bearing_are_one_turn() -> None:
    """A ship that heads 0.3 rad to the right with an array 0.3 rad less: the same sound."""
    array = {"length": 0.3}
    turned = nominal(line=array, targets=[point(*BUOYS[1])], track={"heading": 0.3, "window": WINDOW},
                     sonar={"mounting": {"bearing": np.pi / 2 - 0.3}}, paths={"contributions": ["target"]})  # fmt: skip
    plain = nominal(
        line=array, targets=[point(*BUOYS[1])], track={"window": WINDOW}, paths={"contributions": ["target"]}
    )
    assert relative_rms(simulate(turned).pressure.values, simulate(plain).pressure.values) < 1e-6


def test_taylors_side_lobes_are_where_taylor_put_them() -> None:
    """The recorded pattern of a taylor line: no lobe above -29.5 dB, several near -30 (n-bar 4, 1955)."""
    simulator = build_simulator(nominal(line={"length": 1.5, "shading": "taylor", "element": "omni"}))
    angle = np.arcsin(np.linspace(2.2 / 100, 5 / 100, 4000))
    way = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=-1)
    level = 20 * np.log10(np.abs(simulator.ping_geometry(0).receive_beams.gain(way)[0]))
    lobes = level[1:-1][(level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])]
    assert len(lobes) >= 2
    assert -32 < lobes.max() < -29.5
