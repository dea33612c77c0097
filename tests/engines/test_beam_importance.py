"""Scatterers are left out where the gain is low, and the received levels do not change."""

import numpy as np
import pytest

from insonify import random_keys
from insonify.engines import beam_importance
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.scenario.scenario import Scenario
from insonify.scene.drawn_tiles import DrawnTiles
from insonify.scene.scatterer_grid import ScattererGrid, Tiles
from insonify.simulator import build_simulator, simulate
from insonify.sonar import beam
from oracles.jittered_points import jittered_points
from oracles.scenes import each_ping, nominal

WINDOW = {"window": (0.12, 0.16)}
QUIET = {"noise_level_db": None}
LENGTH, WAVELENGTH = 1.5, 0.015


def bed(seed=1, *, window=(0.12, 0.16), order=0, **top):
    """The nominal bed without targets."""
    return nominal(seed=seed, water=QUIET, track={"window": window}, paths={"max_reflections": order}, **top)


def passing(*, step, pings=2, order=2, window=(0.12, 0.16)):
    """The nominal bed under a sonar that stops and hops northward."""
    expected = bed(order=order).model_dump()
    expected["track"] = {"kind": "line", "start": (0, 0, 11.0), "speed": 1.0, "pings": pings, "interval": step,
                     "window": window, "stop_and_hop": True}  # fmt: skip
    return Scenario(**expected)


def evaluate(scenario, ping=0):
    """Position, key and area of all scatterers of one ping."""
    simulator = build_simulator(scenario)
    found = [block() for block in simulator.engine.blocks(simulator.ping_geometry(ping))]
    return (np.concatenate([getattr(part, name) for part in found]) for name in ("position", "scatterer_id", "area"))


def off_axis(place, here=(0.0, 0.0, 11.0)):
    """Sine off the beam's axis in wavelengths of the aperture [1]: one at the first zero."""
    way = place - here
    return np.abs(way[:, 0]) / np.linalg.norm(way, axis=1) * LENGTH / WAVELENGTH


def unthinned(monkeypatch):
    """Every scatterer of every beam."""
    monkeypatch.setattr(beam_importance, "BEAM_EDGE_DB", -300.0)
    monkeypatch.setattr(beam_importance, "ELEMENT_EDGE_DB", -300.0)


def test_the_main_lobe_keeps_all_and_side_lobes_few(monkeypatch):
    """Within 13 dB of the axis the very scatterers of an endless share; of what lies beyond the first zero, a tenth."""
    place, key, area = evaluate(bed())
    unthinned(monkeypatch)
    every, known, whole = evaluate(bed())
    axis, all_axis = off_axis(place), off_axis(every)
    lobe = np.sinc(0.62) ** 2  # 13 dB down
    assert lobe == pytest.approx(10 ** (-13 / 20), rel=0.05)
    np.testing.assert_array_equal(np.sort(key[axis < 0.62]), np.sort(known[all_axis < 0.62]))
    assert area[axis < 0.62].sum() == pytest.approx(whole[all_axis < 0.62].sum(), rel=1e-12)
    assert np.sum(axis > 1) < 0.1 * np.sum(all_axis > 1)


def test_what_is_kept_stands_for_what_is_not(monkeypatch):
    """Beyond the first zero, areas times the beam's envelope: those kept come to all, within 4 standard errors.

    Each is kept or left out by itself at worst, so the variance of the sum is no more than that of all the squares.
    """
    place, _, area = evaluate(bed(window=(0.08, 0.16)))
    unthinned(monkeypatch)
    every, _, whole = evaluate(bed(window=(0.08, 0.16)))
    for low, high in ((1.0, 2.0), (2.0, 5.0)):
        kept, there = ((off_axis(some) > low) & (off_axis(some) < high) for some in (place, every))
        part = area[kept] * off_axis(place[kept]) ** -4
        total = (whole[there] * off_axis(every[there]) ** -4).sum()
        assert kept.sum() > 100
        assert part.sum() == pytest.approx(total, abs=4 * np.sqrt(np.sum(part**2)))


def test_what_is_kept_is_what_the_lattice_draws():
    """60 tiles of high and low gain: the positions and phases of the scatterer grid, each by its priority.

    A scatterer that represents 1/p of a cell has a priority below p; the phase is the turn's to 3e-7.
    """
    scenario = bed(order=2)
    lattice, simulator = ScattererGrid(heading=0.3), build_simulator(scenario)
    here, rays = simulator.ping_geometry(0), simulator.engine.rays
    along, across = np.meshgrid(np.arange(-2, 4), np.arange(-1, 9))
    tiles = Tiles(np.full(60, 2), along.ravel() * 4, across.ravel() * 4)
    importance = beam_importance.BeamImportance(here, 20.0, rays, ("D", "S"), lattice, 100.0)
    density = np.full(60, 0.7)
    kept = importance.kept_scatterers(tiles, importance.bounds(tiles, density), DrawnTiles("seabed", 7), density)
    cell = jittered_points(tiles, 7, random_keys.SEABED)
    order = np.argsort(cell.scatterer_id)
    rows = order[np.searchsorted(cell.scatterer_id, kept.key, sorter=order)]
    np.testing.assert_array_equal(cell.scatterer_id[rows], kept.key)
    np.testing.assert_array_equal(kept.position[:, :2], lattice.to_world(cell.along, cell.across)[rows])
    np.testing.assert_allclose(kept.phase, np.exp(2j * np.pi * cell.turn[rows]), atol=3e-7)
    assert len(set(kept.key.tolist())) == len(rows) > 500
    assert np.all(cell.priority[rows] < cell.area[rows] / kept.area)
    assert np.ptp(kept.area) > 20 * kept.area.min()


def test_no_scatterer_left_over_is_stronger_than_those_at_the_edge():
    """Area times two-way energy gain, of an aperture sinc^4: off the main lobe no more than 11 dB down.

    14 dB, and 3 dB for the parts of tiles between whose corners gains are interpolated.
    """
    place, _, area = evaluate(bed())
    axis = off_axis(place)
    far = axis > 1
    assert np.max(area[far] * np.sinc(axis[far]) ** 4) < 8e-2 * area[axis < 0.5].max()


def test_pings_nearby_keep_the_same():
    """A sonar that moves by 5 cm keeps nearly all; a scatterer that stays has the same key, position and phase.

    Nine in ten represent as much ground as before, to a quarter, and those of the main lobe, down to 12 dB below its
    axis, to 1e-3: at its flank and beyond weights follow the beam.
    """
    simulator = build_simulator(passing(step=0.05))
    pings = [
        {int(k): (*p, a) for part in (block() for block in simulator.engine.blocks(simulator.ping_geometry(ping)))
         for k, p, a in zip(part.scatterer_id, part.position, part.area, strict=True)}
        for ping in (0, 1)
    ]  # fmt: skip
    both = pings[0].keys() & pings[1].keys()
    assert len(both) > 0.93 * len(pings[0])
    assert all(pings[0][key][:3] == pings[1][key][:3] for key in both)
    change = np.array([pings[1][key][3] / pings[0][key][3] for key in both])
    assert np.mean(np.abs(change - 1) < 0.25) > 0.9
    lobe = off_axis(np.array([pings[0][key][:3] for key in both])) < 0.6
    np.testing.assert_allclose(change[lobe], 1, rtol=1e-3)


def test_tables_of_beams_that_are_made_again_change_nothing():
    """Both ends' patterns in tables of their own, as after other scenarios in one process: the same scatterers."""
    scenario = bed(order=2)
    made = [list(evaluate(scenario))]
    sonar = build_simulator(scenario).scenario.sonar
    beam._beams_in_array_frame.cache_clear()
    for array in sonar.beam_arrays:
        beam._table.cache_clear()
        beam.beams(array, sonar.pulse.frequency, scenario.water.sound_speed)
    made.append(list(evaluate(scenario)))
    for one, other in zip(*made, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_coherence_of_pings_is_that_of_all_scatterers(monkeypatch):
    """Ping to ping, 10 and 30 cm on: within 0.01 of that without any left out; the sound itself within -20 dB."""

    def received(step):
        return simulate(passing(step=step), threads=2).pressure.values[:, 0]

    def coherence(pair):
        return np.abs(np.vdot(*pair)) / np.prod([np.linalg.norm(one) for one in pair])

    sampled = [received(step) for step in (0.1, 0.3)]
    unthinned(monkeypatch)
    full = [received(step) for step in (0.1, 0.3)]
    for some, every in zip(sampled, full, strict=True):
        assert coherence(some) == pytest.approx(coherence(every), abs=0.01)
        assert np.linalg.norm(some[0] - every[0]) < 0.1 * np.linalg.norm(every[0])


@pytest.mark.slow
def test_a_shadow_that_side_lobes_fill_is_as_strong_and_speckles():
    """A wall 4 m wide cuts the main lobe: behind it 48 beds come to the expectation within 0.5 dB, 20 dB down or more.

    12 ms of 0.155 ms, N = 3700: 0.1 dB if Rayleigh; its index is 2 to 4, for few scatterers share the work.
    """
    wall = {"box": {"size": (4.0, 1.0, 1.0)}, "window": (0.19, 0.2225)}
    received = each_ping(
        [bed(seed, **wall) for seed in range(48)], lambda s: simulate(s, threads=1).pressure.values[0, 0]
    )
    scenario = bed(**wall)
    expected = simulate(scenario.model_copy(update={"field": "incoherent"})).intensity.values[0, 0]
    time = build_simulator(scenario).grid.time
    dark = (time > 0.2145) & (time < 0.2220)
    assert expected[dark].mean() < 1e-2 * expected[time < 0.2].mean()
    power = np.abs(received[:, dark]) ** 2 / expected[dark]
    assert 10 * np.log10(power.mean()) == pytest.approx(0, abs=0.5)
    assert 1.8 < np.mean(power**2) / np.mean(power) ** 2 < 4


def test_recorded_elements_keep_what_they_are_sent():
    """All that the transmitter insonifies within 6 dB, and its second side lobe, 17.8 dB down, in proportion.

    42 %, and 30 % of that: where few are kept the middle of a tile stands for positions up to 3 dB stronger.
    """
    line = {"receive": {"kind": "line", "length": 0.24, "elements": 4}}
    place, _, area = evaluate(bed(**line, sonar={"receiver": {"record": "elements"}}))
    axis = off_axis(place)
    whole = area[axis < 0.6]
    assert whole.max() < 1.5 * whole.min()
    lobe = area[(axis > 2.4) & (axis < 2.52)]
    assert whole.mean() / lobe.mean() == pytest.approx(10**-1.78 / 10**-1.4, rel=0.3)


def test_a_scene_moved_keeps_its_choice():
    """Sonar and lattice moved by kilometres and turned: the same keys are kept."""
    shift, turn = np.array([3000.0, -700.0]), 0.7
    moved = nominal(
        water=QUIET, track={**WINDOW, "position": (*shift, 11.0), "heading": turn}, paths={"max_reflections": 2},
        seabed={"scatterer_grid": {"origin": tuple(shift), "heading": turn}},
    )  # fmt: skip
    _, here, _ = evaluate(bed(order=2))
    _, there, _ = evaluate(moved)
    assert len(here) == len(there) and np.mean(here == there) == 1.0


def test_a_ping_fills_the_cells_that_it_has_itself():
    """Right below the sonar cells are larger than the track has them at 45 degrees: no more are kept than fill them.

    In the main lobe each scatterer represents half of its part of a cell to all of it; those of the whole track would
    represent 0.3 of it on the average.
    """
    scenario = passing(step=0.5, window=(0.011, 0.02), pings=40)
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(20)
    seen = ping_scatterers(scenario.scene, scenario.paths, scenario.seed, here, simulator.engine.rays)
    height = scenario.seabed.depth - here.transmit_position[2]
    place, _, area = evaluate(scenario, 20)
    distance = np.linalg.norm(place[:, :2] - here.transmit_position[:2], axis=1)
    below = (off_axis(place, here.transmit_position) < 0.6) & (distance < 0.3 * height)
    part = area[below] / seen.resolution.cell_area(distance[below], height)
    assert below.sum() > 30
    assert part.max() <= 1.0
    assert part.mean() > 0.5


def test_the_mean_keep_probability_is_that_of_all_bearings():
    """Beams half a degree wide, 100 rings: the sum is that over 72 000 bearings of each, to 1 %; a ring's, to 15 %."""
    simulator = build_simulator(bed())
    ping_geometry = simulator.ping_geometry(0)
    importance = beam_importance.BeamImportance(
        ping_geometry, 20.0, simulator.engine.rays, ("D",), simulator.scenario.seabed.scatterer_grid, 120.0, True
    )
    distance = np.linspace(40.0, 110.0, 100)
    bearing = np.linspace(0, 2 * np.pi, 72_000, endpoint=False)
    round_about = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
    expected = [
        importance.keep_probability_of(importance.gain_at(ping_geometry.midpoint + one * round_about)).mean()
        for one in distance
    ]
    mean = importance.mean_keep_probability(distance)
    assert mean.sum() == pytest.approx(np.sum(expected), rel=0.01)
    np.testing.assert_allclose(mean, expected, rtol=0.15)
