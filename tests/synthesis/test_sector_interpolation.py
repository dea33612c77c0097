"""Claims about narrow sectors: a few points along an array give what comes from there to all its elements."""

import numpy as np
import pytest

from insonify.synthesis._arrival_kernel import ReceiveBeams, ReceiveLegs, Reception, TransmitLegs
from insonify.synthesis._arrival_time_kernel import ArrayWater
from insonify.synthesis._element_arrivals_kernel import PairedLegs, deposit_on_elements
from insonify.synthesis._waveform_basis_kernel import group_layout
from insonify.synthesis.chebyshev_nodes import aperture_nodes
from insonify.synthesis.sector_interpolation import (
    MAX_LINEAR_PHASE,
    MAX_RESIDUAL_PHASE,
    MIN_ELEMENTS,
    NO_SECTOR,
    POINT_COUNT,
    sector_interpolation,
)
from insonify.synthesis.time_grid import convolve_waveforms, grid_factors, time_grid
from oracles.echoes import spread_echoes
from oracles.waveforms import chebyshev_basis

CARRIER, SPEED, COUNT = 100e3, 1500.0, 3000
GRID = time_grid(0.0, 0.06, 20e3, 0.0, 1e-3)


def echoes(elements, dopplers, spread, faults=0):
    """Scatterers 8 to 40 m off a line of 1 m that turns while it goes ahead, so far to either side of its beam."""
    rng = np.random.default_rng(elements)
    along = np.linspace(-0.5, 0.5, elements)[:, None]
    place, velocity = along * [0.8, 0.6, 0.0], [2.0, 0.5, 0.1] + along * [0.0, 0.1, 0.05]
    growth = np.tile([0.0, 0.2, 0.0], (elements, 1))
    away, aside = rng.uniform(8, 40, (1, COUNT)), rng.uniform(-spread, spread, COUNT)
    rest = np.sqrt(1 - aside**2)
    tilt = rng.uniform(0, 1, COUNT)
    level, down = rest * np.cos(tilt), rest * np.sin(tilt)
    way = np.stack([0.8 * aside - 0.6 * level, 0.6 * aside + 0.8 * level, down], axis=-1)[None]
    weight = rng.normal(size=(2, 1, COUNT)).astype(np.complex64)
    number = np.arange(elements)
    own = np.stack([number, number + 1], axis=1)
    receive_beams = ReceiveBeams(place, velocity, growth, own, 0 * number, np.where(number < faults, -1, 0))
    sent = TransmitLegs(away / SPEED, 1 + 1e-5 * rng.normal(size=away.shape), weight[None, 0])
    receive_legs = ReceiveLegs(
        away / SPEED, 1 / away, away, np.empty((1, 0, COUNT)), way, weight[1], np.ones((1, 1, COUNT), np.float32)
    )
    shapes = chebyshev_basis(dopplers)
    begin = PairedLegs(np.zeros((1, 3), np.int64), sent, receive_legs, np.ones((1, COUNT))), receive_beams
    water = ArrayWater(1 / SPEED, 0.0, 1e-3, False, 1e-3)
    return receive_beams, begin, (Reception(GRID.first_time, GRID.cell_rate, CARRIER, shapes.weight_table, water),)


def silence(elements, dopplers):
    """Grids with nothing in them."""
    groups, together = group_layout(dopplers)
    return GRID.cells(elements * groups * together).reshape(elements, groups, -1, together)


def series_of(cells, dopplers):
    """What is received of cells by a pulse that fills the band up to where it is not flat any more."""
    band = np.abs(GRID.frequencies) < 0.4 * GRID.sample_rate
    return convolve_waveforms(cells[None], GRID, grid_factors(GRID, np.tile(band + 0j, (1, dopplers, 1))))


@pytest.mark.parametrize(("dopplers", "spread"), [(1, 0.03), (4, 0.03), (4, 0.3), (6, 0.1)])
def test_nodes_interpolate_to_each_element(dopplers, spread):
    """A line of 30 elements: as deposited one by one, to 3e-6 of the rms; within 1.7 degrees at places alone."""
    elements = 30
    receive_beams, begin, end = echoes(elements, dopplers, spread)
    few = sector_interpolation(*receive_beams[:3], GRID, CARRIER, SPEED)
    nodes = aperture_nodes(*receive_beams[:3], 8.0, 0.06, SPEED / CARRIER, few.point_position)
    interpolated, each = silence(elements + POINT_COUNT, dopplers), silence(elements, dopplers)
    deposit_on_elements(interpolated, *begin, nodes, few.sector, *end)
    assert np.abs(interpolated[elements:]).max() > 0.3
    assert spread > 0.03 or not interpolated[:elements].any()
    spread_echoes(each, *begin, *end)
    found = series_of(few.to_elements(interpolated[None], GRID, 1e-3)[0], dopplers)
    expected = series_of(each, dopplers)
    assert not interpolated[elements:].any()
    assert np.linalg.norm(found - expected) < 3e-6 * np.linalg.norm(expected)


def test_weights_interpolate_waves_of_the_whole_sector():
    """Waves of any turn and bow of the sector, at 2000 places along a line: from 16 places to 1e-6."""
    x = np.linspace(-1, 1, 2000)
    place = np.outer(0.5 * x, [1.0, 0, 0])
    few = sector_interpolation(place, 0 * place, 0 * place, GRID, CARRIER, SPEED)
    turn, bow = (
        part.ravel()
        for part in np.meshgrid(
            np.linspace(-MAX_LINEAR_PHASE, MAX_LINEAR_PHASE, 77),
            np.linspace(-MAX_RESIDUAL_PHASE, MAX_RESIDUAL_PHASE, 7),
        )
    )
    known, interpolated = (np.exp(1j * (at[:, None] * turn + at[:, None] ** 2 * bow)) for at in (few.point_position, x))
    assert np.abs(few.weights.astype(float) @ known - interpolated).max() < 1e-6


def test_arrays_that_are_bent_or_short_have_no_sector():
    """Elements off a line, or so few that places would save nothing, each receive all their echoes."""
    place = np.outer(np.linspace(-0.5, 0.5, MIN_ELEMENTS), [1.0, 0, 0])
    bent = place + np.outer(np.linspace(-1, 1, MIN_ELEMENTS) ** 2, [0, 0, 0.01])
    assert sector_interpolation(place, 0 * place, 0 * place, GRID, CARRIER, SPEED) is not None
    for other in (bent, place[1:]):
        assert sector_interpolation(other, 0 * other, 0 * other, GRID, CARRIER, SPEED) is None


def test_a_dead_element_leaves_all_echoes_to_the_others():
    """Where one element is insensitive, none is interpolated.

    It receives nothing, and the others what they received.
    """
    receive_beams, begin, end = echoes(30, 2, 0.03, faults=1)
    few = sector_interpolation(*receive_beams[:3], GRID, CARRIER, SPEED)
    nodes = aperture_nodes(*receive_beams[:3], 8.0, 0.06, SPEED / CARRIER, few.point_position)
    interpolated, each = silence(30 + POINT_COUNT, 2), silence(30, 2)
    deposit_on_elements(interpolated, *begin, nodes, few.sector, *end)
    deposit_on_elements(each, *begin, nodes, NO_SECTOR, *end)
    assert not interpolated[0].any() and not interpolated[30:].any() and np.array_equal(interpolated[:30], each)
