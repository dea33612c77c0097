"""Claims that a ping in layered water is the sum over its rays: rays that were shot, in a sum over frequencies."""

import numpy as np

from insonify.scattering.lambert import Lambert
from insonify.scattering.point_target import PointTargetLaw
from insonify.scattering.sediments import Sediment
from insonify.scene.scatterers import Scatterers
from insonify.simulator import build_simulator
from oracles import layered
from oracles.scenes import nominal, receive_blocks
from oracles.time_series import pulse_spectrum, received, relative_rms, row

DEPTH, CARRIER, LEVEL = 20.0, 100e3, 220.0
KNOTS, SPEEDS = (0.0, 8.0, 14.0, 20.0), (1510.0, 1510.0, 1490.0, 1490.0)
SAND = Sediment.named("medium sand")
WINDOW = (0.055, 0.215)
ENDS = ((1.0, -2.0, 10.6), (0.7, -1.9, 11.3))
PULSE = {"kind": "lfm", "frequency": CARRIER, "duration": 2e-3, "bandwidth": 15e3}


def scenario(**paths):
    """A thermocline over a sand bed, the two ends of the sonar apart, looking east."""
    base = np.array([0.0, 0.0, 11.0])
    # heading north, no lean: forward is north, starboard east, down down
    offsets = [tuple(map(float, np.array(end) - base)) for end in ENDS]
    return nominal(
        transmit={"length": 0.4, "elements": 60, "shading": "hamming", "element": "cosine", "offset": offsets[0]},
        receive={"length": 0.3, "shading": "hann", "offset": offsets[1]},
        sonar={
            "pulse": PULSE, "receiver": {"bandwidth": 20e3, "matched_filter": False},
            "mounting": {"bearing": np.pi / 2}},
        track={"position": tuple(base), "window": WINDOW},
        paths={"max_reflections": 1, **paths},
        water={"noise_level_db": None, "absorption_db_per_m": 0.035,
               "profile": [list(knot) for knot in zip(KNOTS, SPEEDS, strict=True)]},
        seabed={"depth": DEPTH, "reflection": "medium sand"},
    )  # fmt: skip


def scatterers():
    """Fifty points on the seabed, on the surface and in the water, the last of them beyond the direct path's end."""
    random = np.random.default_rng(8)

    def block(label, n, depth, normal, law, drawn):
        position = np.column_stack([random.uniform(-3, 5, n), random.uniform(55, 140, n), np.broadcast_to(depth, n)])
        position[-1, 1] = 145.0
        phase = np.exp(2j * np.pi * random.random(n)) if drawn else np.ones(n, complex)
        boundary = label if label in ("seabed", "surface") else "target"
        area = random.uniform(0.5, 2, n) if drawn else np.ones(n)
        place = random.integers(0, 2**62, n).astype(np.uint64)
        return Scatterers(label, boundary, law, position, np.tile(normal, (n, 1)), area, phase, place, drawn)

    flat = Lambert(strength_db=-20)
    return [
        block("seabed", 22, DEPTH, [0.0, 0.0, -1.0], flat, True),
        block("surface", 12, 0.0, [0.0, 0.0, 1.0], flat, True),
        block("buoy", 16, random.uniform(2, 19, 16), [0.0, 0.0, 0.0], PointTargetLaw(-10.0), False),
    ]


def sound_speed_at(depth):
    """Straight lines between the knots."""
    return float(np.interp(depth, KNOTS, SPEEDS))


def mirror(sine):
    """Rayleigh's coefficient of medium sand for exp(+j omega t), a fluid half space written with impedances."""
    wave = (1 - 1j * SAND.loss) / SAND.speed_ratio
    below = np.sqrt(wave**2 - (1 - sine**2) + 0j)
    below = below if below.imag < 0 else -below
    water, sand = 1 / sine, SAND.density_ratio / below
    return (sand - water) / (sand + water)


def legs(end, place, label):
    """Delay, complex amplitude, direction at the sonar and sine of grazing at the point of every ray there is."""
    offset = np.array(place[:2]) - np.array(end[:2])
    away = float(np.hypot(*offset))
    ahead = offset / away
    own = {"seabed": "B", "surface": "S"}.get(label, "-")
    for family in ("D", "S", "B"):
        if family == own:
            continue
        for ray in layered.rays(KNOTS, SPEEDS, end[2], family, float(place[2]), away):
            bounced = 1.0 + 0j
            if family == "S":
                bounced = -1.0 + 0j
            if family == "B":
                bounced = mirror(np.sqrt(1 - (ray.slowness * SPEEDS[-1]) ** 2))
            lost = 10 ** (-0.035 * ray.length / 20)
            way = np.append(np.cos(ray.launch) * ahead, np.sin(ray.launch))
            sine = 1.0 if label == "buoy" else abs(np.sin(ray.arrival))
            yield ray.delay, ray.amplitude * bounced * lost * 1j**ray.caustics, way, sine


def transmit_gain(way):
    """A row of 60 cosine elements over 0.4 m, looking east, at the speed of sound of its own depth."""
    wave = sound_speed_at(ENDS[0][2]) / CARRIER
    return row(0.4 / wave, 60, "hamming", [-way[0]], 0.0)[0] * max(way[1], 0)


def receive_gain(way):
    """A continuous line of 0.3 m, elements that receive all around in front and behind."""
    wave = sound_speed_at(ENDS[1][2]) / CARRIER
    return row(0.3 / wave, None, "hann", [-way[0]], 0.0)[0]


def brute_force(blocks):
    """Delay and weight of every echo."""
    delay, weight = [], []
    for block in blocks:
        for n, place in enumerate(block.position):
            out, back = (list(legs(end, place, block.object)) for end in ENDS)
            for t1, a1, way1, sine1 in out:
                for t2, a2, way2, sine2 in back:
                    sigma = 0.1 if block.object == "buoy" else 0.01 * sine1 * sine2
                    echo = a1 * a2 * np.sqrt(sigma * block.area[n]) * block.phase[n] * 10 ** (LEVEL / 20)
                    delay.append(t1 + t2)
                    weight.append(echo * transmit_gain(way1) * receive_gain(way2))
    return np.array(delay), np.array(weight)


def test_a_ping_through_a_thermocline_is_the_sum_over_its_rays():
    """The coherent series of 50 scatterers is a float64 sum over frequencies of rays that were shot in 50 digits.

    Ends apart at unlike depths and sound speeds, beams, a sand bed, direct and once reflected rays out and back.
    Relative rms 1e-5.
    """
    case, blocks = scenario(), scatterers()
    delay, weight = brute_force(blocks)
    assert len(delay) > 200
    assert delay.min() > WINDOW[0] + 5e-3 and delay.max() < WINDOW[1] - 5e-3

    def spectrum(offset):
        return pulse_spectrum(offset, duration=2e-3, fraction=0.1, bandwidth=15e3, band=20e3, matched_filter=False)

    time = WINDOW[0] + np.arange(round((WINDOW[1] - WINDOW[0]) * 25e3)) / 25e3
    truth = received(delay, weight, time, CARRIER, spectrum, 25e3, 8192)
    assert build_simulator(case).ping_geometry(0).sound_speed == sound_speed_at(ENDS[0][2])
    assert relative_rms(receive_blocks(case, blocks), truth) < 1e-5
