"""Claims about echoes along an aperture at the edges of its tiles, parts and windows, and about dead elements."""

import numpy as np
import pytest

from insonify.synthesis._arrival_kernel import ReceiveBeams, ReceiveLegs, Reception, TransmitLegs
from insonify.synthesis._arrival_time_kernel import ArrayWater
from insonify.synthesis._element_arrivals_kernel import _PART, PairedLegs, deposit_on_elements
from insonify.synthesis._waveform_basis_kernel import group_layout
from insonify.synthesis.chebyshev_nodes import aperture_nodes
from insonify.synthesis.sector_interpolation import NO_SECTOR
from oracles.echoes import spread_echoes
from oracles.waveforms import chebyshev_basis
from synthesis.oracle import relative_rms

CARRIER, RATE, SPEED = 100e3, 40e3, 1500.0


def echoes(seed, count, elements, *, moving=1.0, dopplers=2, none=0.2):
    """One leg out and two back between so many scatterers 6 to 25 m away and a line of 0.6 m."""
    rng = np.random.default_rng(seed)
    place = np.linspace(-0.3, 0.3, elements)[:, None] * np.array([0.6, 0.8, 0.0])
    speed = np.tile(moving * np.array([2.0, 0.5, 0.1]), (elements, 1))
    away, way = rng.uniform(6, 25, (2, count)), rng.normal(size=(2, count, 3))
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    weight = rng.normal(size=(3, count)) * (rng.uniform(size=(3, count)) > none) + 0j
    gain = rng.normal(size=(2, 1, count)).astype(np.float32)
    number = np.arange(elements)
    channels = ReceiveBeams(place, speed, 0 * speed, np.stack([number, number + 1], axis=1), 0 * number, 0 * number)
    sent = TransmitLegs(away[:1] / SPEED, 1 + 1e-3 * rng.normal(size=(1, count)), weight[None, :1].astype(np.complex64))
    back = ReceiveLegs(
        away / SPEED, 1 / away, away, np.zeros((2, 0, count)), way, weight[1:].astype(np.complex64), gain
    )
    basis = chebyshev_basis(dopplers, moving * 3e-3).weight_table
    return channels, sent, back, rng.uniform(0.5, 1, (2, count)), 1e-3 * moving, basis


def deposited(paired, *, kernel=deposit_on_elements, first_time=0.0, cells=2000, channels=None):
    """Grids of all elements."""
    own, sent, back, strength, middle, basis = paired
    channels, pair = own if channels is None else channels, np.array([[0, 0, 0], [0, 1, 1]])
    groups, together = group_layout(len(basis.node_coordinate))
    grid = np.zeros((len(channels.position), groups, cells, together), np.complex64)
    nodes = (aperture_nodes(*own[:3], 6.0, 0.04, SPEED / CARRIER), NO_SECTOR) if kernel is deposit_on_elements else ()
    reception = Reception(first_time, RATE, CARRIER, basis, ArrayWater(1 / SPEED, 0.0, 1e-3, False, middle))
    grids = (grid, grid[:0]) if nodes else (grid,)
    kernel(*grids, PairedLegs(pair, sent, back, strength), channels, *nodes, reception)
    return grid


def reordered(paired, rows):
    """The same scatterers in another order, or some of them."""
    channels, sent, back, strength, middle, basis = paired
    own = np.ascontiguousarray
    sent = TransmitLegs(*(own(column[..., rows]) for column in sent))
    back = ReceiveLegs(*(own(column[:, rows]) if k == 4 else own(column[..., rows]) for k, column in enumerate(back)))
    return channels, sent, back, own(strength[:, rows]), middle, basis


@pytest.mark.parametrize(
    ("count", "elements"),
    [(1, 1), (1, 17), (127, 7), (128, 8), (129, 9), (255, 16), (257, 33), (512, 4), (1023, 3), (1025, 5)],
)
def test_tiles_and_sides_of_any_size(count, elements):
    """Tiles of 1024 echoes and 4 elements, one less and one more: as element by element, 3e-6 of the rms."""
    for dopplers in (2, 5):
        paired = echoes(count, count, elements, dopplers=dopplers, none=0.0)
        assert relative_rms(deposited(paired), deposited(paired, kernel=spread_echoes)) < 3e-6


def test_a_block_larger_than_a_part_is_the_sum_of_its_scatterers():
    """32 768 scatterers and 300 more, three quarters of them silent: as in two blocks, to 2e-6."""
    paired = echoes(2, _PART + 300, 5, none=0.5)
    whole = deposited(paired)
    parts = [deposited(reordered(paired, rows)) for rows in (slice(0, _PART), slice(_PART, None))]
    assert parts[1].any() and relative_rms(parts[0] + parts[1], whole) < 2e-6


@pytest.mark.parametrize("dopplers", [2, 5])
def test_scatterers_may_come_in_any_order(dopplers):
    """They are put in the order of their delays: shuffled, reversed, the same sound to 2e-6."""
    paired = echoes(3, 600, 12, dopplers=dopplers)
    whole = deposited(paired)
    for rows in (np.random.default_rng(1).permutation(600), np.arange(600)[::-1]):
        assert relative_rms(deposited(reordered(paired, rows)), whole) < 2e-6


def test_echoes_off_the_grid_are_passed_over():
    """A grid that begins late and ends early holds what it has room for: the cells of the long one, 2e-6."""
    paired = echoes(4, 500, 9)
    whole = deposited(paired)
    late = deposited(paired, first_time=500 / RATE, cells=400)
    assert relative_rms(late[:, :, 10:-10], whole[:, :, 510:890]) < 2e-6
    assert not deposited(paired, first_time=1.0).any()


def test_dead_elements_record_nothing_and_do_not_affect_others():
    """Two of nine insensitive: not one cell of theirs; the cells of the others as before, to 1e-6."""
    paired = echoes(5, 400, 9)
    whole, pattern = deposited(paired), np.zeros(9, int)
    pattern[[0, 5]] = -1
    some = deposited(paired, channels=paired[0]._replace(pattern=pattern))
    alive = pattern == 0
    assert not some[~alive].any()
    assert relative_rms(some[alive], whole[alive]) < 1e-6
    assert not deposited(paired, channels=paired[0]._replace(pattern=np.full(9, -1))).any()


def test_no_arrivals_give_a_zero_recording():
    """Scatterers that bring, return or scatter nothing: silence."""
    channels, sent, back, strength, middle, basis = paired = echoes(6, 50, 5)
    assert deposited(paired).any()
    assert not deposited((channels, sent._replace(weight=0 * sent.weight), back, strength, middle, basis)).any()
    assert not deposited((channels, sent, back._replace(weight=0 * back.weight), strength, middle, basis)).any()
    assert not deposited((channels, sent, back._replace(gain=0 * back.gain), strength, middle, basis)).any()
    assert not deposited((channels, sent, back, 0 * strength, middle, basis)).any()


def test_each_element_at_rest_receives_where_it_stands():
    """One scatterer: the cells of an element are strongest at the way there and back by geometry, to one cell."""
    paired = echoes(7, 1, 33, moving=0.0, dopplers=1, none=0.0)
    channels, sent, back, strength, _, _ = paired
    grid = deposited((channels, sent, back, strength * [[1.0], [0.0]], 0.0, chebyshev_basis(1, 0.0).weight_table))[
        :, 0, :, 0
    ]
    away = float(back.horizontal_distance[0, 0])
    there = np.linalg.norm(away * back.direction[0, 0] - channels.position, axis=1)
    delay = float(sent.delay[0, 0]) + there / SPEED
    assert np.abs(np.abs(grid).argmax(axis=1) - delay * RATE).max() < 1
    peak = np.abs(grid).max(axis=1) * there / (1 - 1e-3 * (there - away))
    np.testing.assert_allclose(peak, peak.mean(), rtol=0.2)  # spikes lie anywhere between cells
