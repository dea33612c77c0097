"""Beams that differ in horizontal steering alone: the product of what they share and what they do not."""

import math

import numpy as np
import pytest

from insonify.sonar.array import PlanarArray, PointTransducer
from insonify.sonar.beam import beams
from insonify.sonar.shared_directions import common_pattern, horizontal_patterns, row_step, share_directions
from insonify.sonar.sub_bands import lagrange_weights, node_count

FAN = tuple(np.radians(np.linspace(-60, 60, 61)))
WIDE = PlanarArray(width=0.8e-3, height=5e-3, steer=(0.0,))


def planar(**changes):
    """61 beams of 64 elements, 53 mm by 5 mm."""
    return PlanarArray(**{"width": 53e-3, "height": 5e-3, "columns": 64, "steer": FAN, **changes})


@pytest.mark.parametrize("element", ["omni", "cosine", "baffled", "piston"])
def test_a_beam_is_its_horizontal_pattern_times_what_all_have_in_common(element):
    """In 500 directions, tilted by 20 degrees, for every directivity of the elements."""
    array = planar(element=element, steer_down=math.radians(20))
    whole, random = beams(array, 900e3, 1500.0), np.random.default_rng(2)
    direction = random.normal(size=(500, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    horizontal = horizontal_patterns(whole)(direction[:, 1]) * whole.scale[:, None]
    product = common_pattern(whole).gain(direction)[0] * horizontal
    np.testing.assert_allclose(product, whole.gain(direction), atol=1e-12)


def test_beams_share_rows_where_horizontal_steering_alone_differs():
    """Many beams of one tilt; not few, not a point, not a narrow transmitter steered along, not many rows."""
    transmit = beams(WIDE, 900e3, 1500.0)

    def shared(array, transmit=transmit):
        return share_directions(transmit, beams(array, 900e3, 1500.0))

    assert shared(planar())
    assert not shared(planar(steer=FAN[:20]))
    assert not shared(PointTransducer())
    assert not shared(planar(width=0.5))
    assert not shared(planar(), beams(planar(), 900e3, 1500.0))
    assert shared(planar(), beams(WIDE.model_copy(update={"steer": FAN}), 900e3, 1500.0))


def test_rows_are_half_a_wavelength_over_the_apertures_apart():
    """Of the receiver alone, or of both where the transmitter is steered along: patterns multiply, lengths add."""
    receive, wavelength = beams(planar(), 900e3, 1500.0), 1500 / 900e3
    assert row_step(beams(WIDE, 900e3, 1500.0), receive) == pytest.approx(wavelength / (2 * 53e-3))
    steered = beams(PlanarArray(width=5e-3, height=5e-3, steer=FAN), 900e3, 1500.0)
    assert row_step(steered, receive) == pytest.approx(wavelength / (2 * 58e-3))


@pytest.mark.parametrize("phase", [0.3, 3.0, 35.0])
def test_so_many_nodes_keep_the_error_and_fewer_do_not(phase):
    """exp(j phase x) through Chebyshev nodes on -1..1: within 1e-3, and beyond it with two thirds of them."""
    x = np.linspace(-1, 1, 2001)

    def error(count):
        node = -np.cos((np.arange(count) + 0.5) * np.pi / count)
        return np.abs(lagrange_weights(node, x).T @ np.exp(1j * phase * node) - np.exp(1j * phase * x)).max()

    count = node_count(phase, 1e-3, 128)
    assert error(count) < 1e-3 < error(2 * count // 3)
    assert node_count(phase, 1e-3, 2) <= 2 and node_count(1e4, 1e-3, 128) == 128 and node_count(0.0, 1e-3, 128) == 1
