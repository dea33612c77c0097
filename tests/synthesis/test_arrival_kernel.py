"""Claims about the meeting of legs: every pair, every channel, and nothing for those that have no echo."""

import numpy as np
import pytest

from insonify.synthesis._arrival_kernel import ReceiveBeams, ReceiveLegs, Reception, TransmitLegs
from insonify.synthesis._arrival_time_kernel import ArrayWater, ArrivalColumns, ElementMotion, arrival_moving
from insonify.synthesis._element_arrivals_kernel import PairedLegs
from insonify.synthesis._gridding import deposit_pressure
from insonify.synthesis._waveform_basis_kernel import group_layout
from oracles.echoes import spread_echoes
from oracles.waveforms import chebyshev_basis

CARRIER, RATE, COUNT = 100e3, 40e3, 1300


def legs(rng, rows):
    """Complex weights of some legs, a third of them nothing."""
    weight = rng.normal(size=(rows, COUNT)) + 1j * rng.normal(size=(rows, COUNT))
    return (weight * (rng.uniform(size=weight.shape) > 1 / 3)).astype(np.complex64)


def reception(middle, basis):
    """Water of one speed without absorption, and a grid that begins at 0."""
    return Reception(0.0, RATE, CARRIER, basis.weight_table, ArrayWater(1 / 1500, 0.0, 0.0, False, middle))


@pytest.mark.parametrize(("beams", "patterns"), [(1, 3), (3, 3), (3, 1)])
def test_beams_receive_the_sum_over_pairs(beams, patterns):
    """Two legs out, three back, at rest: cells as of each pair's echoes, weighed and turned one by one, to 1e-6."""
    rng = np.random.default_rng(beams + 7 * patterns)
    sent, received = legs(rng, 2), legs(rng, 3)
    out, back = rng.uniform(0.005, 0.02, (2, COUNT)), rng.uniform(0.005, 0.02, (3, COUNT))
    shading, gain = rng.normal(size=(beams, 2, COUNT)), rng.normal(size=(3, patterns, COUNT)).astype(np.float32)
    pair = np.array([[i, j, j] for i in range(2) for j in range(3)])
    strength, centre = rng.uniform(0.5, 1, (6, COUNT)), np.zeros((1, 3))
    way = np.tile([1.0, 0, 0], (3, COUNT, 1))
    channel = np.arange(3)
    receive_beams = ReceiveBeams(centre, centre, centre, np.array([[0, 3]]), channel % beams, channel % patterns)
    cells = np.zeros((3, 1, 4000, 1), np.complex64)
    out_legs = TransmitLegs(out, np.ones_like(out), (sent * shading).astype(np.complex64))
    back_legs = ReceiveLegs(back, 1 / (1500 * back), back, np.empty((3, 0, COUNT)), way, received, gain)
    paired = PairedLegs(pair, out_legs, back_legs, strength)
    spread_echoes(cells, paired, receive_beams, reception(0.0, chebyshev_basis(1, 0.0)))
    expected = np.zeros((3, 4000), np.complex64)
    for row, (i, j, _) in enumerate(pair):
        delay = out[i] + back[j]
        turned = sent[i] * received[j] * strength[row] * np.exp(-2j * np.pi * CARRIER * delay)
        for c in range(3):
            weight = turned * shading[c % beams, i] * gain[j, c % patterns]
            deposit_pressure(expected[c], 0.0, RATE, delay, weight.astype(np.complex64))
    assert np.linalg.norm(cells[:, 0, :, 0] - expected) < 1e-6 * np.linalg.norm(expected)


def test_channels_without_gain_record_nothing():
    """An element of no pattern receives nothing, the one beside it what is there."""
    one, place = np.ones((1, 5)), np.zeros((2, 3))
    own = np.array([[0, 1], [1, 2]])
    receive_beams = ReceiveBeams(place, place, place, own, np.zeros(2, int), np.array([-1, 0]))
    cells = np.zeros((2, 1, 4000, 1), np.complex64)
    single = one.astype(np.complex64)
    receive_legs = ReceiveLegs(
        0.01 * one, one, one, np.empty((1, 0, 5)), np.ones((1, 5, 3)), single, np.ones((1, 1, 5), np.float32)
    )
    pair = np.zeros((1, 3), np.int64)
    paired = PairedLegs(pair, TransmitLegs(0.01 * one, one, single[None]), receive_legs, one)
    spread_echoes(cells, paired, receive_beams, reception(0.0, chebyshev_basis(1, 0.0)))
    assert not cells[0].any() and cells[1].any()


@pytest.mark.parametrize("shapes", [2, 3, 4, 5])
def test_an_echo_of_a_moving_sonar_is_shared_among_its_shapes(shapes):
    """Two elements at 3 m/s: each grid holds the echo times Lagrange's polynomial of its Doppler factor, to 2e-5."""
    rng = np.random.default_rng(shapes)
    made = chebyshev_basis(shapes)
    weight, away = legs(rng, 1), rng.uniform(10, 25, (1, COUNT))
    way = rng.normal(size=(1, COUNT, 3))
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    place, velocity = np.array([[0.2, 0, 0], [-0.2, 0.1, 0]]), np.tile([3.0, 0.5, 0], (2, 1))
    one, still, number = np.ones((1, COUNT)), np.zeros((2, 3)), np.arange(2)
    receive_beams = ReceiveBeams(place, velocity, still, np.stack([number, number + 1], axis=1), 0 * number, 0 * number)
    none = np.empty((1, 0, COUNT))
    receive_legs = ReceiveLegs(
        away / 1500, 1 / away, away, none, way, one.astype(np.complex64), one[None].astype(np.float32)
    )
    groups, together = group_layout(shapes)
    cells, middle = np.zeros((2, groups, 4000, together), np.complex64), 1e-3
    paired = PairedLegs(np.zeros((1, 3), np.int64), TransmitLegs(away / 1500, one, weight[None]), receive_legs, one)
    spread_echoes(cells, paired, receive_beams, reception(middle, made))
    for e in range(2):
        when, fade, doppler = np.empty(COUNT), np.empty(COUNT, np.float32), np.empty(COUNT)
        echoes = ArrivalColumns(2 * away[0] / 1500, 1 / away[0], away[0], away[0], *np.ascontiguousarray(way[0].T),
                                one[0], none[0])  # fmt: skip
        motion = ElementMotion(place[e], velocity[e], still[e])
        arrival_moving(echoes, COUNT, motion, reception(middle, made).water, when, fade, doppler)
        turned = weight[0] * fade * np.exp(-2j * np.pi * CARRIER * when)
        grids = np.moveaxis(cells[e], 2, 1).reshape(-1, 4000)
        for grid, part in zip(grids, made.weights(doppler), strict=False):
            expected = np.zeros(4000, np.complex64)
            deposit_pressure(expected, 0.0, RATE, when, (turned * part).astype(np.complex64))
            assert np.linalg.norm(grid - expected) < 2e-5 * np.linalg.norm(expected)
