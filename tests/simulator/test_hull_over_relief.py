"""A hull over relief: each bottom bounce of its paths loses the coherent part that the relief's heights take."""

import numpy as np
import pytest

from insonify.simulator import arrivals
from oracles.scenes import nominal, point

C, Z, DEPTH = 1500.0, 6.0, 0.6
HURST, OUTER, RMS = 0.8, 0.5, 0.01
ASIDE, DOWN = (1.0, 0.5), 3.4
"""Place of a point, and its depth below the hull [m]."""
OMNI = {"kind": "point", "element": "omni", "length": None}
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")


def afloat(rms, frequency):
    """A point transducer at the depth of a wide hull, 6 m above a smooth interface over relief of some rms height."""
    relief = {"kind": "power-law", "hurst": HURST, "rms": rms, "outer_scale": OUTER}
    return nominal(
        transmit=OMNI, receive=OMNI, water={"absorption_db_per_m": 0.0},
        sonar={"hull": {"length": 400.0, "width": 100.0, "reflection": 0.9},
               "pulse": {"kind": "cw", "frequency": frequency, "duration": 3e-4}},
        seabed={"depth": Z + DEPTH, "scattering": None, "reflection": 0.5, **({"relief": relief} if rms else {})},
        track={"position": (0.0, 0.0, DEPTH), "window": (1e-3, 0.05)},
        paths={"max_reflections": 4, "contributions": ["boundary echo", "target"]},
        targets=[point(*ASIDE, 4.0)],
    )  # fmt: skip


def pressures(rms, frequency):
    """Pressure of the paths by object and family."""
    found = arrivals(afloat(rms, frequency))
    names = zip(found.object, found.transmit_family, found.receive_family, strict=True)
    return {tuple(map(str, name)): abs(found.amplitude[row]) for row, name in enumerate(names)}


def coherent(vertical, places, aside, frequency):
    """exp(-2 Gamma^2), Gamma = k h sin, of bounces at some of the vertical way: h of the waves between the two lengths.

    Those from the Fresnel zone's, pi / sqrt(area) of the ellipse's axes, to the sound's, of the von Karman spectrum.
    """
    k, length = 2 * np.pi * frequency / C, np.hypot(vertical, aside)
    sine, product, outer = vertical / length, 1.0, 2 * np.pi / OUTER
    for place in places:
        before = place / sine
        low = np.pi / np.sqrt(C / frequency * before * (length - before) / length / sine)
        band = (1 + (low / outer) ** 2) ** -HURST - (1 + (k / outer) ** 2) ** -HURST
        product *= np.exp(-2 * (k * RMS * sine) ** 2 * band)
    return product


@pytest.mark.parametrize("frequency", [15e3, 20e3, 30e3])
def test_each_bottom_bounce_of_a_path_off_the_hull_has_the_relief_s_coherent_loss(frequency):
    """Pressure re that over a plane, of legs, pairs of them and the echo: the product over their bottom bounces, 1e-4.

    Paths without a bottom bounce are alike; without the loss of one bounce 30 kHz would be 20 dB too high.
    """
    plane, here = pressures(0.0, frequency), pressures(RMS, frequency)
    aside = np.hypot(*ASIDE)
    legs = {
        "D": 1.0,
        "BH": coherent(2 * Z + DOWN, [Z], aside, frequency),
        "BHB": coherent(4 * Z - DOWN, [Z, 3 * Z], aside, frequency),
        "BHBH": coherent(4 * Z + DOWN, [Z, 3 * Z], aside, frequency),
    }
    for out, sent in legs.items():
        for back, received in legs.items():
            path = ("point", out, back)
            assert here[path] / plane[path] == pytest.approx(sent * received, rel=1e-4), path
    echo = ("boundary echo", "BHB", "")
    assert here[echo] / plane[echo] == pytest.approx(coherent(4 * Z, [Z, 3 * Z], 0.0, frequency), rel=1e-4)


def test_relief_without_height_leaves_the_paths_of_a_plane():
    """A micrometre of relief: paths as over a plane, to 1e-4, but those through the hull's shadow."""
    plane, here = pressures(0.0, 15e3), pressures(1e-6, 15e3)
    assert plane.keys() == here.keys() and any("H" in out for _, out, _ in plane)
    for path, strength in plane.items():
        if "S" not in "".join(path[1:]):
            assert here[path] == pytest.approx(strength, rel=1e-4), path
