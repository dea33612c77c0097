"""Claims about narrow sectors: a few points along an array give what comes from there to all its elements."""

import numpy as np
import pytest

import insonify
from insonify.synthesis import sector_interpolation as sectors
from insonify.synthesis._arrival_kernel import ReceiveBeams, ReceiveLegs, Reception, TransmitLegs
from insonify.synthesis._arrival_time_kernel import ArrayWater
from insonify.synthesis._element_arrivals_kernel import ArraySector, PairedLegs, deposit_on_elements
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
PULSE = -1.2e-3, -0.8e-3
"""Start and end of the pulse re its delay, which is that of a middle 1 ms after it."""


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


def series_of(cells, basis):
    """What is received of cells by a pulse as short as the filter lets it be, 3 times as strong at 1e-3 of Doppler."""
    offset = np.abs(GRID.frequencies) / GRID.sample_rate
    band = np.cos(np.pi / 2 * np.clip((offset - 0.4) / 0.1, 0, 1)) ** 2
    waveforms = (1 + 2e3 * basis.doppler[:, None]) * band + 0j
    return convolve_waveforms(cells[None], GRID, grid_factors(GRID, waveforms[None]))


@pytest.mark.parametrize(
    ("dopplers", "of_sector", "spread"),
    [(1, 1, 0.03), (4, 2, 0.03), (4, 4, 0.3), (6, 3, 0.1), (6, 5, 0.1), (4, 2, 0.1)],
)
def test_points_interpolate_to_each_element(dopplers, of_sector, spread):
    """A line of 30 elements: as deposited one by one, to 3e-6 of the rms; within 1.7 degrees at points alone."""
    elements = 30
    receive_beams, begin, end = echoes(elements, dopplers, spread)
    few = sector_interpolation(*receive_beams[:3], GRID, CARRIER, SPEED, PULSE)
    nodes = aperture_nodes(*receive_beams[:3], 8.0, 0.06, SPEED / CARRIER, few.point_position)
    basis = basis_of_sector = chebyshev_basis(dopplers)
    if of_sector > 1:
        basis_of_sector = chebyshev_basis(of_sector, 3e-4, -4e-4)
    sector = ArraySector(few.limits, basis_of_sector.weight_table)
    direct, points, each = silence(elements, dopplers), silence(POINT_COUNT, of_sector), silence(elements, dopplers)
    deposit_on_elements(direct, points, *begin, nodes, sector, *end)
    assert np.abs(points).max() > 0.3
    assert spread > 0.03 or not direct.any()
    spread_echoes(each, *begin, *end)
    found, expected = series_of(direct, basis), series_of(each, basis)
    few.add_to_elements(series_of(points, basis_of_sector), found)
    assert np.linalg.norm(found - expected) < 3e-6 * np.linalg.norm(expected)


def test_weights_interpolate_waves_of_the_whole_sector():
    """Waves of any turn and bow of the sector, at 2000 places along a line: from 16 places to 1e-6."""
    x = np.linspace(-1, 1, 2000)
    place = np.outer(0.5 * x, [1.0, 0, 0])
    few = sector_interpolation(place, 0 * place, 0 * place, GRID, CARRIER, SPEED, PULSE)
    turn, bow = (
        part.ravel()
        for part in np.meshgrid(
            np.linspace(-MAX_LINEAR_PHASE, MAX_LINEAR_PHASE, 77),
            np.linspace(-MAX_RESIDUAL_PHASE, MAX_RESIDUAL_PHASE, 7),
        )
    )
    known, interpolated = (np.exp(1j * (at[:, None] * turn + at[:, None] ** 2 * bow)) for at in (few.point_position, x))
    assert np.abs(few.weights.astype(float) @ known - interpolated).max() < 1e-6


def test_arrays_that_are_curved_or_short_have_no_sector():
    """Elements off a line, or so few that places would save nothing, each receive all their echoes."""
    place = np.outer(np.linspace(-0.5, 0.5, MIN_ELEMENTS), [1.0, 0, 0])
    curved = place + np.outer(np.linspace(-1, 1, MIN_ELEMENTS) ** 2, [0, 0, 0.01])
    assert sector_interpolation(place, 0 * place, 0 * place, GRID, CARRIER, SPEED, PULSE) is not None
    for other in (curved, place[1:]):
        assert sector_interpolation(other, 0 * other, 0 * other, GRID, CARRIER, SPEED, PULSE) is None


def test_a_dead_element_leaves_all_echoes_to_the_others():
    """Where one element is insensitive, none is interpolated.

    It receives nothing, and the others what they received.
    """
    receive_beams, begin, end = echoes(30, 2, 0.03, faults=1)
    few = sector_interpolation(*receive_beams[:3], GRID, CARRIER, SPEED, PULSE)
    nodes = aperture_nodes(*receive_beams[:3], 8.0, 0.06, SPEED / CARRIER, few.point_position)
    sector = ArraySector(few.limits, chebyshev_basis(2).weight_table)
    direct, points, each = silence(30, 2), silence(POINT_COUNT, 2), silence(30, 2)
    deposit_on_elements(direct, points, *begin, nodes, sector, *end)
    deposit_on_elements(each, each[:0], *begin, nodes, NO_SECTOR, *end)
    assert not direct[0].any() and not points.any() and np.array_equal(direct, each)


def test_echoes_beyond_the_waveforms_of_a_sector_come_to_each_element():
    """An echo whose Doppler factor lies outside of the sector's waveforms is not deposited at its points."""
    receive_beams, begin, end = echoes(30, 4, 0.03)
    few = sector_interpolation(*receive_beams[:3], GRID, CARRIER, SPEED, PULSE)
    nodes = aperture_nodes(*receive_beams[:3], 8.0, 0.06, SPEED / CARRIER, few.point_position)
    found = []
    for middle in (-4e-4, 1e-3):
        direct, points = silence(30, 4), silence(POINT_COUNT, 2)
        sector = ArraySector(few.limits, chebyshev_basis(2, 3e-4, middle).weight_table)
        deposit_on_elements(direct, points, *begin, nodes, sector, *end)
        found.append((direct.any(), points.any()))
    assert found == [(False, True), (True, False)]


def test_early_samples_hold_no_more_than_the_ringing():
    """Before the first echo, where the curvature of the samples' own times would exceed all bounds."""
    receive_beams, begin, end = echoes(30, 1, 0.03)
    few = sector_interpolation(*receive_beams[:3], GRID, CARRIER, SPEED, PULSE)
    nodes = aperture_nodes(*receive_beams[:3], 8.0, 0.06, SPEED / CARRIER, few.point_position)
    basis = chebyshev_basis(1)
    direct, points, each = silence(30, 1), silence(POINT_COUNT, 1), silence(30, 1)
    deposit_on_elements(direct, points, *begin, nodes, ArraySector(few.limits, basis.weight_table), *end)
    spread_echoes(each, *begin, *end)
    found, expected = series_of(direct, basis), series_of(each, basis)
    few.add_to_elements(series_of(points, basis), found)
    early = slice(0, int(few.limits.min_delay * GRID.sample_rate))
    assert np.abs(found - expected)[:, early].max() < 3e-7 * np.sqrt(np.mean(np.abs(expected) ** 2))


@pytest.mark.parametrize(
    "motion", [{}, {"roll": {"rms": "3 deg", "period": "4 s"}, "yaw": {"rms": "2 deg", "period": "3 s"}}]
)
def test_pings_of_elements_are_those_without_a_sector(monkeypatch, motion):
    """A sidescan's 32 elements with bottom and surface bounces, from 8 m on: 3e-6 of the rms pressure apart."""
    scenario = insonify.Scenario(
        seed=3,
        seabed={"depth": "20 m", "scattering": {"law": "lambert", "strength_db": -27}},
        sonar={
            "source_level_db": 220,
            "pulse": {"kind": "cw", "frequency": "100 kHz", "duration": "0.1 ms"},
            "transmit": {"kind": "planar", "width": "1 m", "height": "2 cm"},
            "receive": {"kind": "line", "length": "1 m", "elements": 32},
            "receiver": {"sub_bands": 1, "record": "elements"},
            "mounting": {"bearing": "90 deg", "tilt": "20 deg"},
        },
        track={
            "kind": "line", "start": [0, 0, 12], "heading": 0, "speed": "3 m/s", "pings": 1, "interval": 0.1,
            "window": [0.008, 0.05], "motion": motion,
        },
        paths={"max_reflections": 1, "scatterers_per_cell": 1},
    )  # fmt: skip
    found = insonify.simulate(scenario, threads=1).pressure.values
    monkeypatch.setattr(sectors, "MIN_ELEMENTS", 1000)
    expected = insonify.simulate(scenario, threads=1).pressure.values
    assert not np.array_equal(found, expected)
    assert np.linalg.norm(found - expected) < 3e-6 * np.linalg.norm(expected)
