"""Energies of many beams from rows of directions."""

import numpy as np
import pytest

from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator
from insonify.synthesis import direction_powers
from insonify.synthesis._gridding import deposit_energy_on_rows
from insonify.synthesis.time_grid import convolve_energy


def receiver(beams=256, **changes):
    """A receiver of 64 elements that forms beams over 130 deg at 900 kHz."""
    scenario = Scenario(**{
        "seabed": {"depth": 5.0, "scattering": {"law": "lambert"}},
        "sonar": {
            "source_level_db": 200,
            "pulse": {"kind": "lfm", "frequency": 900e3, "bandwidth": 30e3, "duration": 0.5e-3},
            "transmit": {"kind": "planar", "width": 0.8e-3, "height": 5e-3, "steer": (0.0,)},
            "receive": {"kind": "planar", "width": 53.3e-3, "height": 5e-3, "columns": 64,
                        "steer": tuple(np.radians(np.linspace(-65, 65, beams)))},
        },
        "track": {"kind": "static", "position": (0.0, 0.0, 3.0), "window": (0.0, 5e-3)},
        **changes,
    })  # fmt: skip
    return build_simulator(scenario)


@pytest.fixture(scope="module")
def simulator():
    """A receiver with 256 beams."""
    return receiver()


@pytest.fixture(scope="module")
def powers(simulator):
    """The receiver's rows of directions."""
    return simulator.incoherent_accumulator(simulator.ping_geometry(0)).directions


def test_series_of_tasks_in_any_order_are_those_of_all_beams_at_once(simulator):
    """Random energies in rows and beams: tasks done last to first give the bits of one sum and one convolution."""
    accumulator = simulator.incoherent_accumulator(simulator.ping_geometry(0))
    energies, rng = accumulator.empty(), np.random.default_rng(1)
    energies.rows[:, ::3], energies.cells[:, ::5] = rng.random(energies.rows[:, ::3].shape), 1 / 3
    energies.intensity[...] = rng.random(energies.intensity.shape)
    backwards = accumulator.time_series(energies, lambda task, parts: [task(part) for part in reversed(parts)])
    cells = energies.cells + accumulator.directions.to_beams(energies.rows)
    grid, geometry = accumulator.grid, accumulator.ping_geometry
    whole = convolve_energy(cells, grid, geometry.pulse.spectrum(grid.frequencies)) + energies.intensity
    np.testing.assert_array_equal(backwards, whole)
    np.testing.assert_array_equal(backwards, accumulator.time_series(energies))


@pytest.mark.parametrize(("beams", "max_bytes", "on_rows"), [(64, 1 << 29, True), (64, 1 << 20, False), (256, 0, True)])
def test_recording_and_labels_have_rows_that_fit_in_memory(beams, max_bytes, on_rows, monkeypatch):
    """514 rows for an aperture of 32 wavelengths: for 64 beams where memory suffices, for 256 beams in any case."""
    monkeypatch.setattr(direction_powers, "MAX_BYTES", max_bytes)
    simulator = receiver(beams, field="incoherent", paths={"scatterers_per_cell": 1})
    geometry = simulator.ping_geometry(0)
    directions = simulator.incoherent_accumulator(geometry).directions
    assert (directions is not None) == on_rows
    label_sums = simulator.label_accumulator(geometry)
    buffer = label_sums.empty()
    for pairs in simulator.engine.pair_batches(geometry, simulator.engine.blocks(geometry)[0]):
        label_sums.add(buffer, pairs)
    rows = 514 if on_rows else beams
    assert {len(cells.cells) for cells in buffer.cells.values()} == {rows}
    assert buffer.nbytes > 8 * rows * len(label_sums.names.pairs) * simulator.grid.energy_cell_count


def test_energies_in_rows_are_the_squared_weights_of_the_legs(simulator):
    """Cells of every row: the energies of weights with their carriers, deposited at the same delays and directions."""
    geometry, engine = simulator.ping_geometry(0), simulator.engine
    accumulator = simulator.incoherent_accumulator(geometry)
    powers, grid = accumulator.directions, accumulator.grid
    energies = accumulator.empty()
    expected = np.zeros_like(energies.rows)
    assert energies.nbytes == energies.rows.nbytes + energies.row_intensity.nbytes + energies.cells.nbytes
    for block in engine.blocks(geometry, quadrature=True)[:2]:
        for pairs in engine.pair_batches(geometry, block):
            direct = pairs.select(np.array([pairs.names().index(("D", "D"))]))
            accumulator.add(energies, direct)
            i, j = direct.pair[0]
            transmit, receive = accumulator.weights(direct, None, powers.common)
            energy = np.abs(transmit[0, i] * receive[0, j] * direct.strength[0]) ** 2
            delay = direct.transmit_legs.delay[i] + direct.receive_legs.delay[j]
            row = powers.rows(direct.receive_legs.departure[j])
            deposit_energy_on_rows(expected, grid.first_time, grid.energy_rate, delay, energy, row)
    assert np.count_nonzero(expected) > 1000
    np.testing.assert_allclose(energies.rows, expected, rtol=0, atol=1e-6 * expected.max())
