"""Claims about smooth bodies received by elements: canonical levels and whole wavefields, from scenario to pressure."""

import numpy as np
import pytest

from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from oracles.smooth import ROUGH, SPEED, brute, upright_face

CARRIER, TONE = 100e3, 1e-3
RIGHT = np.array([0.0, -0.1, 0.25, 0.5])
"""Of the elements: one where the sound comes from, the others along a line [m]."""


def received(body, far, depth=10.0, **paths):
    """Pressure re the source at 1 m of a smooth body when all its echoes are there: in the middle of a tone of 1 ms."""
    middle = 2 * far / SPEED + TONE / 2
    described = {
        "water": {"sound_speed": SPEED, "absorption_db_per_m": 0.0, "noise_level_db": None},
        "seabed": {"depth": 20.0, "scattering": {"law": "lambert", "strength_db": -27.0}, "reflection": 0.35},
        "targets": [{"face_reflection_coefficient": 1.0, "scattering": ROUGH, "label": "body", **body}],
        "sonar": {
            "source_level_db": 200, "pulse": {"kind": "cw", "frequency": CARRIER, "duration": TONE},
            "transmit": {"kind": "point", "element": "omni"},
            "receive": {"kind": "elements", "positions": [(0.0, float(r), 0.0) for r in RIGHT], "element": "omni"},
            "receiver": {"bandwidth": 40e3, "record": "elements"},
        },
        "track": {"kind": "static", "position": (0.0, 0.0, depth), "window": (middle - TONE, middle + TONE)},
        "paths": {"max_reflections": 0, "contributions": ["target"], "edge_diffraction": "none", **paths},
    }  # fmt: skip
    sound = simulate(Scenario(**described))
    return np.array([np.interp(middle, sound.time.values, row) for row in sound.pressure.values[0]]) / 1e10


def summed(places, area, pairs, depth):
    """The same of a face that looks west, patch by patch, to every element."""
    ends = [(-r, 0.0, depth) for r in RIGHT]  # facing east, the right is south
    normal, source = np.array([0.0, -1.0, 0.0]), (0.0, 0.0, depth)
    return np.array([sum(brute(places, area, normal, *pair, CARRIER, source, end) for pair in pairs) for end in ends])


@pytest.mark.parametrize(("far", "width", "height"), [(12.0, 2.0, 1.0), (60.0, 0.4, 0.3)], ids=["near", "far"])
def test_a_plate_is_received_by_every_element_as_the_sum_of_its_patches(far, width, height):
    """2 x 1 m at 12 m, deep in its near field, and 0.4 x 0.3 m at 60 m: level within 0.1 dB, phase within 0.02 rad."""
    plate = {
        "shape": "box",
        "position": (0.0, far + 0.005),
        "size": (width, 0.01, height),
        "base_depth": 10 + height / 2,
    }
    found = received(plate, far)
    expected = summed(*upright_face(width, height, far, 10 + height / 2, CARRIER), [("D", "D")], 10.0)
    np.testing.assert_allclose(20 * np.log10(np.abs(found / expected)), 0, atol=0.1)
    np.testing.assert_allclose(np.angle(found / expected), 0, atol=0.02)


def test_a_face_on_the_bed_is_received_by_every_element_as_a_corner():
    """2 x 1 m upright at 150 m, R_b = 0.35, all four pairs of D and B at once: 33 dB; each element within 0.1 dB.

    Its target strength as stated for the project's reference: 11.8 (D-D) and 33.1 dB (D-B and B-D), out of phase.
    """
    box = {"shape": "box", "position": (0.0, 150.5), "size": (2.0, 1.0, 1.0)}
    found = received(box, np.hypot(150, 8.5), depth=11.0, max_reflections=1, families=["D", "B"])
    pairs = [("D", "D"), ("D", "B"), ("B", "D"), ("B", "B")]
    expected = summed(*upright_face(2.0, 1.0, 150.0, 20.0, CARRIER), pairs, 11.0)
    np.testing.assert_allclose(20 * np.log10(np.abs(found / expected)), 0, atol=0.1)
    assert 20 * np.log10(np.abs(found[0]) * (150**2 + 8.5**2)) == pytest.approx(33.1, abs=1.0)


@pytest.mark.parametrize(
    ("body", "far", "level_db", "bar"),
    [
        ({"shape": "sphere", "position": (0.0, 60.0), "diameter": 0.5, "base_depth": 10.25}, 59.75, -18.06, 0.5),
        ({"shape": "cylinder", "position": (0.0, 100.0), "length": 0.6, "diameter": 0.5, "base_depth": 10.25}, 99.75,
         10 * np.log10(0.25 * 0.6**2 / (2 * 0.015)), 0.7),
        ({"shape": "box", "position": (0.0, 100.005), "size": (0.4, 0.01, 0.3), "base_depth": 10.15}, 100.0,
         20 * np.log10(0.12 / 0.015), 0.5),
    ],
    ids=["sphere", "cylinder", "plate"],
)  # fmt: skip
def test_canonical_bodies_are_received_at_their_levels(body, far, level_db, bar):
    """Sphere 20 log(a / 2), cylinder 10 log(a L^2 / 2 wavelength), plate 20 log(A / wavelength), in the recording.

    Source: Urick (1983), Principles of Underwater Sound, table 9.1 (not verified); the engine's legs by themselves are
    held to the same forms elsewhere.
    """
    assert 20 * np.log10(np.abs(received(body, far)[0]) * far**2) == pytest.approx(level_db, abs=bar)
