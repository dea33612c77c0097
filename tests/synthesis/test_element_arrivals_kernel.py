"""Claims about echoes along an aperture: a few nodes give every element what each would receive by itself."""

import numpy as np
import pytest

from insonify.synthesis._arrival_kernel import ReceiveBeams, ReceiveLegs, Reception, TransmitLegs
from insonify.synthesis._arrival_time_kernel import ArrayWater
from insonify.synthesis._echo_series_kernel import ApertureNodes
from insonify.synthesis._element_arrivals_kernel import PairedLegs, deposit_on_elements
from insonify.synthesis._waveform_basis_kernel import group_layout
from insonify.synthesis.chebyshev_nodes import aperture_nodes, chebyshev_node_count
from insonify.synthesis.sector_interpolation import NO_SECTOR
from oracles.echoes import spread_echoes
from oracles.waveforms import chebyshev_basis

CARRIER, RATE, COUNT, SPEED = 100e3, 40e3, 700, 1500.0
NEAREST = 6.0


def drawn_legs(elements, *, refracted, patterns, dopplers, velocity, count=COUNT, farthest=25.0):
    """Two legs out and two back between some scatterers and a line of 1 m that turns while it goes ahead."""
    rng = np.random.default_rng(elements)
    along = np.linspace(-0.5, 0.5, elements)[:, None]
    place = along * np.array([0.8, 0.6, 0.0])
    speed = velocity * (np.array([2.0, 0.5, 0.1]) + along * np.array([0.0, 0.1, 0.05]))
    growth = velocity * (np.array([0.0, 0.2, 0.0]) + along * np.array([0.1, 0.0, 0.0]))
    away = rng.uniform(NEAREST, farthest, (2, count))
    way = rng.normal(size=(2, count, 3))
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    terms = 13 if refracted else 0
    beside = 1e-12 * rng.normal(size=(2, terms, count))
    weight = (rng.normal(size=(2, 2, count)) * (rng.uniform(size=(2, 2, count)) > 1 / 3)).astype(np.complex64)
    gain = rng.normal(size=(2, patterns, count)).astype(np.float32)
    number = np.arange(elements)
    receive_beams = ReceiveBeams(
        place, speed, growth, np.stack([number, number + 1], axis=1), 0 * number, number % patterns
    )
    level = away * np.hypot(way[..., 0], way[..., 1])
    sent = TransmitLegs(away / SPEED, 1 + 1e-3 * rng.normal(size=away.shape), weight[:1] + 0j * weight[:1])
    sent = sent._replace(weight=weight[None, 0])
    receive_legs = ReceiveLegs(away / SPEED, 1 / away, level, beside, way, weight[1], gain)
    pair = np.array([[i, j, j] for i in range(2) for j in range(2)])
    shapes = chebyshev_basis(dopplers, velocity * 3e-3)
    middle = 1e-3 if velocity else 0.0
    water = ArrayWater(1 / SPEED, 0.02 * refracted, 1e-3, refracted, middle)
    end = (Reception(0.0, RATE, CARRIER, shapes.weight_table, water),)
    return receive_beams, (PairedLegs(pair, sent, receive_legs, rng.uniform(0.5, 1, (4, count))), receive_beams), end


def silence(elements, dopplers):
    """Grids with nothing in them."""
    groups, together = group_layout(dopplers)
    return np.zeros((elements, groups, 2000, together), np.complex64)


@pytest.mark.parametrize(
    ("elements", "refracted", "patterns", "dopplers", "velocity"),
    [(20, False, 1, 4, 1.0), (20, False, 3, 6, 1.0), (33, True, 1, 2, 1.0), (20, False, 1, 1, 0.0)],
)
def test_nodes_interpolate_to_each_element(elements, refracted, patterns, dopplers, velocity):
    """A line of 1 m from 6 m on, moving and at rest: as deposited element by element, to 2e-6 of the rms."""
    receive_beams, begin, end = drawn_legs(
        elements, refracted=refracted, patterns=patterns, dopplers=dopplers, velocity=velocity
    )
    nearest = float(begin[0].receive.horizontal_distance.min()) if refracted else NEAREST
    nodes = aperture_nodes(*receive_beams[:3], nearest, 0.04, SPEED / CARRIER)
    assert refracted or len(nodes.position) < elements / 2
    few, each = silence(elements, dopplers), silence(elements, dopplers)
    deposit_on_elements(few, few[:0], *begin, nodes, NO_SECTOR, *end)
    spread_echoes(each, *begin, *end)
    assert np.linalg.norm(few - each) < 2e-6 * np.linalg.norm(each)


@pytest.mark.parametrize(("dopplers", "velocity"), [(4, 1.0), (1, 0.0)])
@pytest.mark.parametrize(("refracted", "count"), [(False, 5000), (False, 300), (True, 5000)])
def test_crowded_echoes_come_to_each_element(dopplers, velocity, refracted, count):
    """Some tens of echoes in each cell, and a few, from 6 to 8 m: as deposited element by element, 3e-6 of the rms."""
    receive_beams, begin, end = drawn_legs(
        20, refracted=refracted, patterns=1, dopplers=dopplers, velocity=velocity, count=count, farthest=8.0
    )
    nearest = float(begin[0].receive.horizontal_distance.min()) if refracted else NEAREST
    nodes = aperture_nodes(*receive_beams[:3], nearest, 0.04, SPEED / CARRIER)
    few, each = silence(20, dopplers), silence(20, dopplers)
    deposit_on_elements(few, few[:0], *begin, nodes, NO_SECTOR, *end)
    spread_echoes(each, *begin, *end)
    assert np.linalg.norm(few - each) < 3e-6 * np.linalg.norm(each)


def test_echoes_before_the_grid_are_not_received_by_way_of_a_second_part():
    """Of 33,000 scatterers, more than are taken at once, most echo before the grid: as one by one, none before it."""
    receive_beams, begin, end = drawn_legs(6, refracted=False, patterns=1, dopplers=1, velocity=0.0, count=33_000)
    end = (end[0]._replace(first_time=0.028),)
    nodes = aperture_nodes(*receive_beams[:3], NEAREST, 0.04, SPEED / CARRIER)
    few, each = silence(8, 1), silence(6, 1)
    deposit_on_elements(few[1:7], few[:0], *begin, nodes, NO_SECTOR, *end)
    spread_echoes(each, *begin, *end)
    assert not few[0].any() and not few[7].any() and each.any()
    assert np.linalg.norm(few[1:7] - each) < 1e-5 * np.linalg.norm(each)


def test_elements_off_a_line_are_evaluated_one_by_one():
    """A bow has no line of nodes: all its elements are nodes, and receive what they receive by themselves, to 1e-6."""
    receive_beams, begin, end = drawn_legs(12, refracted=False, patterns=1, dopplers=3, velocity=1.0)
    place = receive_beams.position + np.outer(np.linspace(-1, 1, 12) ** 2, [0.0, 0.0, 0.01])
    nodes = aperture_nodes(place, *receive_beams[1:3], NEAREST, 0.04, SPEED / CARRIER)
    assert isinstance(nodes, ApertureNodes) and len(nodes.position) == 12
    begin = (*begin[:-1], receive_beams._replace(position=place))
    few, each = silence(12, 3), silence(12, 3)
    deposit_on_elements(few, few[:0], *begin, nodes, NO_SECTOR, *end)
    spread_echoes(each, *begin, *end)
    assert np.linalg.norm(few - each) < 1e-6 * np.linalg.norm(each)


def test_nodes_are_as_many_as_the_wavefront_is_curved():
    """Far off 4 do; at 8 m a line of 1 m takes 7; none are enough where the wavefront is no larger than the line."""
    assert [chebyshev_node_count(away, 0.5, 0.015) for away in (1e4, 8.0)] == [4, 7]
    assert chebyshev_node_count(0.9, 0.5, 0.015) > 10_000
