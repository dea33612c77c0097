"""The engine against a sum over echoes, frequency by frequency, that shares nothing with it but the scatterers."""

from functools import cache

import finufft
import numpy as np
import pytest

from insonify.records.arrivals import concatenate_arrivals, expand_arrivals
from insonify.scattering.lambert import Lambert
from insonify.scattering.point_target import PointTargetLaw
from insonify.scattering.sediments import Sediment
from insonify.scene.scatterers import Scatterers
from insonify.simulator import arrivals, build_simulator, simulate
from oracles.arrival_sum import coherent_from_arrivals
from oracles.scenes import nominal, point, receive_blocks
from oracles.time_series import pulse_spectrum, received, relative_rms, row
from oracles.water import Block, cut, fold, letters

DEPTH, SPEED, CARRIER, LEVEL = 20.0, 1490.0, 100e3, 220.0
SAND = Sediment.named("medium sand")
WINDOW = (0.115, 0.215)
BOX_AT, BOX_HEADING, BOX_SIZE = (1.5, 112.0), 0.6, (3.0, 2.0, 2.5)
BLOCK = Block(BOX_AT, BOX_HEADING, (1.5, 1.0), DEPTH - 2.5, DEPTH)
PITCH, ROLL, HEADING, BEARING, TILT = 0.05, -0.08, 0.3, 1.2, 0.1
STEER = (-0.06, 0.1)


def scenario(pulse, compress, perturbed):
    """Everything at once: separate ends, steered shaded beams on a leaning platform, a sand bed, a box."""
    shaken = {"jitter": 0.4, "amplitude_perturbation": 0.3} if perturbed else {}
    return nominal(
        box={"position": BOX_AT, "size": BOX_SIZE, "heading": BOX_HEADING},
        transmit={"length": 0.4, "elements": 60, "shading": "hamming", "element": "cosine", "steer": STEER,
                  "offset": (0.4, 0.1, -0.3)},
        receive={"kind": "planar", "length": None, "width": 0.3, "height": 0.02, "shading": "hann",
                 "shading_down": "uniform", "element": "baffled", "steer": STEER, "steer_down": 0.05,
                 "offset": (-0.2, 0.0, 0.5)},
        sonar={"pulse": pulse, "receiver": {"bandwidth": 20e3, "matched_filter": compress},
               "mounting": {"bearing": BEARING, "tilt": TILT}},
        track={"heading": HEADING, "pitch": PITCH, "roll": ROLL, "window": WINDOW, "position": (1.0, -2.0, 11.0)},
        paths={"max_reflections": 2, **shaken},
        water={"noise_level_db": None, "sound_speed": SPEED, "absorption_db_per_m": 0.035},
        seabed={"depth": DEPTH, "reflection": "medium sand"},
    )  # fmt: skip


def scatterers():
    """Two hundred points: seabed (some in the box's shadow), surface, the box's faces, and points in the water."""
    random = np.random.default_rng(5)

    def block(label, position, normal, law, *, drawn=True, occluder=-1):
        n = len(position)
        phase = np.exp(2j * np.pi * random.random(n)) if drawn else np.ones(n, complex)
        boundary = label if label in ("seabed", "surface") else "target"
        area = random.uniform(0.5, 2, n) if drawn else np.ones(n)
        place = random.integers(0, 2**62, n).astype(np.uint64)
        return Scatterers(label, boundary, law, position, normal, area, phase, place, drawn, occluder)

    def spot(n, depth):
        return np.column_stack([random.uniform(-6, 9, n), random.uniform(95, 130, n), np.broadcast_to(depth, n)])

    c, s = np.cos(BOX_HEADING), np.sin(BOX_HEADING)
    axes = np.array([[c, s, 0], [-s, c, 0], [0, 0, -1]])
    sides = np.repeat([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], 12, axis=0)
    inside = np.where(sides == 0, random.uniform(-1, 1, sides.shape), sides)
    faces = [*BOX_AT, DEPTH - 1.25] + inside * np.array(BOX_SIZE) / 2 @ axes
    up, flat = np.array([0.0, 0.0, -1.0]), Lambert(strength_db=-20)
    return [
        block("seabed", spot(80, DEPTH), np.tile(up, (80, 1)), flat),
        block("surface", spot(40, 0.0), np.tile(-up, (40, 1)), flat),
        block("box", faces, sides @ axes, Lambert(strength_db=-10), occluder=0),
        block("buoy", spot(20, random.uniform(3, 19, 20)), np.zeros((20, 3)), PointTargetLaw(-10.0), drawn=False),
    ]


def turn(angle, first, second):
    """Rotation by an angle in the plane of two axes, from the first towards the second."""
    matrix = np.eye(3)
    matrix[[first, second], [first, second]] = np.cos(angle)
    matrix[second, first], matrix[first, second] = np.sin(angle), -np.sin(angle)
    return matrix


BODY = turn(HEADING, 0, 1) @ turn(-PITCH, 0, 2) @ turn(ROLL, 1, 2)
ARRAY = BODY @ turn(BEARING, 0, 1) @ turn(TILT, 0, 2)


def transmit_gain(way, steer):
    """A row of 60 cosine elements over 0.4 m, unit gain on its steered axis."""
    w, u, _ = way @ ARRAY
    wide = 0.4 / (SPEED / CARRIER)
    return row(wide, 60, "hamming", [u], np.sin(steer))[0] * max(w, 0) / np.cos(steer)


def receive_gain(way, steer):
    """A continuous baffled panel of 0.3 m by 0.02 m."""
    w, u, v = way @ ARRAY
    wave = SPEED / CARRIER
    across = row(0.3 / wave, None, "hann", [u], np.sin(steer) * np.cos(0.05))[0]
    return across * row(0.02 / wave, None, "uniform", [v], np.sin(0.05))[0] * (w >= 0)


def mirror(sine):
    """Rayleigh's coefficient of medium sand for exp(+j omega t), a fluid half space written with impedances."""
    wave = (1 - 1j * SAND.loss) / SAND.speed_ratio
    below = np.sqrt(wave**2 - (1 - sine**2) + 0j)
    below = below if below.imag < 0 else -below
    water, sand = 1 / sine, SAND.density_ratio / below
    return (sand - water) / (sand + water)


def leg(end, place, family, block, row):
    """Delay, complex amplitude, direction at the sonar and sine of grazing at the point; None where there is none."""
    own = {"seabed": "B", "surface": "S"}.get(block.object)
    if letters(family).endswith(own or "-"):
        return None
    path = fold(end, place, family, DEPTH)
    if cut(path, BLOCK):
        return None
    sine = 1.0 if block.object == "buoy" else -path.arrival @ block.normal[row]
    if sine <= 0:
        return None
    bounced = (-1) ** family.count("S") * mirror(path.sine) ** family.count("B")
    return path.length / SPEED, bounced / path.length * 10 ** (-0.035 * path.length / 20), path.departure, sine


@cache
def echoes():
    """Delay, weight in each channel, and which block, row and families, of every echo of `scatterers`."""
    ends = [np.array([1.0, -2.0, 11.0]) + BODY @ offset for offset in ([0.4, 0.1, -0.3], [-0.2, 0.0, 0.5])]
    strength = {"seabed": -20, "surface": -20, "box": -10}
    found = []
    for which, block in enumerate(scatterers()):
        for n, place in enumerate(block.position):
            names = ("D", "S", "B", "SB", "BS")
            out, back = (
                {f: (*one, np.array([gain(one[2], s) for s in STEER]))
                 for f in names if (one := leg(end, place, f, block, n))}
                for end, gain in zip(ends, (transmit_gain, receive_gain), strict=True)
            )  # fmt: skip
            for f, (t1, a1, _, sine1, sent) in out.items():
                for g, (t2, a2, _, sine2, caught) in back.items():
                    sigma = 0.1 if block.object == "buoy" else 10 ** (strength[block.object] / 10) * sine1 * sine2
                    echo = a1 * a2 * np.sqrt(sigma * block.area[n]) * block.phase[n] * 10 ** (LEVEL / 20)
                    found.append((t1 + t2, echo * sent * caught, (which, n, f, g)))
    return found


def brute_force(blocks, shaken):
    """Delay, and weight in each channel, of every echo."""
    factor = cache(lambda which, f, g: shaken(blocks[which], f, g))
    delay, weight = [], []
    for when, echo, (which, n, f, g) in echoes():
        delay.append(when)
        weight.append(echo * factor(which, f, g)[n])
    return np.array(delay), np.array(weight).T


CASES = {
    "tone, still": ({"kind": "cw", "frequency": CARRIER, "duration": 0.2e-3, "taper_fraction": 0.2}, False, False),
    "tone, shaken": ({"kind": "cw", "frequency": CARRIER, "duration": 1e-3, "taper_fraction": 0.5}, False, True),
    "sweep, shaken": ({"kind": "lfm", "frequency": CARRIER, "duration": 2e-3, "bandwidth": 15e3}, False, True),
    "compressed sweep, shaken": (
        {"kind": "lfm", "frequency": CARRIER, "duration": 2e-3, "bandwidth": 15e3}, True, True,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_the_engine_is_the_sum_over_all_echoes(case):
    """The coherent series of 200 scatterers is a float64 sum over frequencies.

    Legs mirrored at the scatterer and walked, boxes clipped by slabs, apertures summed point by point, pulse
    integrated. Relative rms 1e-5; seen: 3e-7.
    """
    pulse, compress, perturbed = CASES[case]
    case, blocks = scenario(pulse, compress, perturbed), scatterers()
    simulator = build_simulator(case)
    moved = simulator.coherent_accumulator(simulator.ping_geometry(0)).replica_jitter
    delay, weight = brute_force(blocks, lambda block, f, g: moved.factor(block.scatterer_id, f, g))
    assert len(delay) > 1500
    assert delay.min() > WINDOW[0] + 5e-3 and delay.max() < WINDOW[1] - 5e-3

    def spectrum(offset):
        return pulse_spectrum(offset, duration=pulse["duration"], fraction=pulse.get("taper_fraction", 0.1),
                              bandwidth=pulse.get("bandwidth", 0.0), band=20e3, matched_filter=compress)  # fmt: skip

    time = WINDOW[0] + np.arange(round((WINDOW[1] - WINDOW[0]) * 25e3)) / 25e3
    truth = np.array([received(delay, w, time, CARRIER, spectrum, 25e3, 4096) for w in weight])
    assert relative_rms(receive_blocks(case, blocks), truth) < 1e-5


def test_a_non_uniform_transform_of_the_arrivals_agrees():
    """The arrivals through finufft (type 1, 1e-12) give the same series.

    Relative rms 1e-5 of the fast path; and `coherent_from_arrivals` makes of them what the fast path makes of the
    pairs.
    """
    case, blocks = scenario(*CASES["sweep, shaken"]), scatterers()
    simulator = build_simulator(case)
    here = simulator.ping_geometry(0)
    moved = simulator.coherent_accumulator(here).replica_jitter
    rows = []
    for block in blocks:
        pairs = simulator.engine.path_pairs(here, block)
        rows.append(
            expand_arrivals(pairs, 0, {names: moved.factor(block.scatterer_id, *names) for names in pairs.names()})
        )
    found = concatenate_arrivals(rows)
    fast = receive_blocks(case, blocks)
    assert relative_rms(coherent_from_arrivals(found, here, simulator.grid), fast) < 1e-5
    bins, start, count = 4096, WINDOW[0], simulator.grid.sample_count
    turns = 2 * np.pi * 25e3 / bins * (found.delay - start)
    gain = 10 ** (LEVEL / 20) * here.transmit_beams.gain(found.departure) * here.receive_beams.gain(found.arrival)
    carried = gain * found.amplitude * np.exp(-2j * np.pi * (CARRIER * found.delay % 1))
    offset = (np.arange(bins) - bins // 2) * 25e3 / bins
    shaped = finufft.nufft1d1(turns, carried, bins, eps=1e-12, isign=-1) * simulator.pulse.spectrum(offset)
    series = np.fft.ifft(np.fft.ifftshift(shaped, axes=-1), axis=-1)[:, :count] * 25e3
    assert relative_rms(fast, series) < 1e-5


def test_a_scenario_in_full_is_the_sum_over_its_arrivals():
    """From models to series through the public doors.

    A small window with seabed, box and point, against the frequency-domain sum over the arrivals that the same
    doors hand out. Relative rms 1e-5.
    """
    case = nominal(
        box={},
        paths={"max_reflections": 1, "beam_cutoff_db": -25},
        track={"window": (0.2010, 0.2022)},
        line={"shading": "hann"},
    )
    case = case.model_copy(update={"targets": (*case.targets, *nominal(targets=[point(1, 148, 15)]).targets)})
    found, here = arrivals(case, window=(0.19, 0.215)), build_simulator(case).ping_geometry(0)
    assert set(found.object) == {"seabed", "box", "point"}
    gain = here.transmit_beams.gain(found.departure)[0] * here.receive_beams.gain(found.arrival)[0]
    received_pulse = build_simulator(case).pulse.spectrum
    recorded_ping = simulate(case)
    kept = np.abs(gain) > 0
    truth = received(found.delay[kept], 1e11 * (gain * found.amplitude)[kept], recorded_ping.time.values, CARRIER,
                  received_pulse, 25e3, 2048)  # fmt: skip
    assert len(found) > 1000
    assert relative_rms(recorded_ping.pressure.values[0, 0], truth) < 1e-5
