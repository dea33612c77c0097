"""Scatterers in reach of one ping: sufficient, and no more."""

import numpy as np
import pytest

from insonify.simulator import build_simulator, simulate
from oracles.scenes import nominal

WINDOW = {"window": (0.15, 0.16)}


def evaluate(scenario, ping=0):
    """Positions and areas of all seabed scatterers of one ping, and its ping_geometry."""
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(ping)
    found = [pairs.scatterers for pairs in simulator.engine.all_pairs(here)]
    return np.concatenate([f.position for f in found]), np.concatenate([f.area for f in found]), here


def test_the_ground_in_beam_and_window_is_covered_once():
    """Seabed within the two-way beam's main lobe and the window.

    The scatterers' areas add up to its area within 1 %.
    """
    place, area, _ = evaluate(nominal(paths={"max_reflections": 0}, track=WINDOW))
    slant, bearing = np.linalg.norm(place - [0, 0, 11], axis=1), np.arctan2(place[:, 1], place[:, 0]) - np.pi / 2
    rows = (np.abs(bearing) < 0.01) & (slant > 113) & (slant < 119)
    assert area[rows].sum() == pytest.approx(0.01 * (119**2 - 113**2), rel=0.01)


def test_there_are_as_many_scatterers_to_a_cell_as_requested():
    """Five per resolution cell (0.12 m by the half-power beam) on the beam's axis, a tenth more as tiles are cut."""
    scenario = nominal(paths={"max_reflections": 0}, track=WINDOW)
    place, area, here = evaluate(scenario)
    slant = 750 * here.pulse.resolution_time
    cell = slant * np.linalg.norm(place - [0, 0, 11], axis=1) * 0.638 * 0.015 / 1.5
    axis = np.abs(np.arctan2(place[:, 0], place[:, 1])) < 0.003
    count = cell[axis] / area[axis]
    assert count.min() >= 4.99 and count.max() < 5.5


def test_a_lower_floor_of_the_beam_changes_little():
    """Echoes below the beam cutoff of 50 dB are below -40 dB of the rest; scatterers above it are the same."""
    received = [
        simulate(nominal(paths={"max_reflections": 0, "beam_cutoff_db": floor}, track=WINDOW)).pressure.values
        for floor in (-50, -70)
    ]
    assert 20 * np.log10(np.linalg.norm(received[0] - received[1]) / np.linalg.norm(received[1])) < -40


def test_the_draw_of_positions_does_not_change_the_level():
    """Twice or half the scatterers to a cell: the same mean level within 0.1 dB over 10 ms."""
    level = [
        10 * np.log10(simulate(nominal(field="incoherent", paths={"max_reflections": 0, "scatterers_per_cell": n},
                                       track=WINDOW)).intensity.values.mean())
        for n in (2.5, 5, 10)
    ]  # fmt: skip
    assert np.ptp(level) < 0.1


def test_a_slice_has_the_level_of_the_whole_scene():
    """The paper's plane: each point represents its part of the beam's footprint; 0 +- 0.2 dB re three dimensions."""
    flat, whole = (
        simulate(nominal(field="incoherent", track=WINDOW, paths={"families": ("D", "S"), "geometry": geometry}))
        .intensity.values.mean()
        for geometry in ("slice", "3d")
    )  # fmt: skip
    assert 10 * np.log10(flat / whole) == pytest.approx(0, abs=0.2)


def test_a_scene_without_scattering_has_no_echo():
    """Purely specular seabed and surface: no scatterers, no echo."""
    scenario = nominal(seabed={"depth": 20, "scattering": None}, track=WINDOW)
    assert not build_simulator(scenario).engine.blocks(build_simulator(scenario).ping_geometry(0))
    assert np.all(simulate(scenario).pressure.values == 0)


def test_contributions_left_out_are_not_received_but_still_cast_shadows():
    """The box's own echo goes; its shadow on the seabed stays."""
    shadow = {"window": (0.2145, 0.2255)}
    free, hidden = (
        simulate(nominal(
            field="incoherent", box=box, track=shadow, paths={"max_reflections": 0, "contributions": ["seabed"]}))
        .intensity.values.mean()
        for box in (None, {"size": (6.0, 1.0, 1.0)})
    )  # fmt: skip
    assert hidden < 1e-3 * free
