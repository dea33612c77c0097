"""The first return under a sonar that looks aside: from the steep side lobes of its panels, by counting the seabed."""

import numpy as np
import pytest

from insonify.scenario.scenario import Scenario
from insonify.scene.scatterers import Scatterers
from insonify.simulator import build_simulator

PANEL = {"kind": "planar", "width": 0.3, "height": 0.1}
SCENE = {
    "field": "incoherent",
    "seabed": {"depth": 10.0, "scattering": {"law": "lambert", "strength_db": -27}},
    "sonar": {
        "source_level_db": 220, "pulse": {"kind": "cw", "frequency": "100 kHz", "duration": "0.2 ms"},
        "transmit": PANEL, "receive": PANEL, "mounting": {"bearing": "90 deg", "tilt": "20 deg"},
    },
    "track": {"kind": "static", "position": [0.0, 0.0, 4.0], "window": [0.0, "10 ms"]},
}  # fmt: skip
RINGS, SECTORS, FARTHEST = 700, 1100, 5.0


def counted(simulator):
    """The ping from 770 000 cells of equal area and width, rings and sectors about the point under the sonar."""
    here = simulator.ping_geometry(0)
    reading = simulator.incoherent_accumulator(here)
    received = reading.empty()
    law = simulator.engine.scene.seabed.law(1e5, 1500.0)
    edge = FARTHEST * np.sqrt(np.linspace(0, 1, RINGS + 1))
    area = np.pi * FARTHEST**2 / RINGS / SECTORS
    for start in range(0, RINGS, 50):
        ring = np.arange(start, start + 50)
        r = np.sqrt((edge[ring] ** 2 + edge[ring + 1] ** 2) / 2)[:, None]
        turn = 2 * np.pi / SECTORS * (np.arange(SECTORS) + np.mod(0.618 * ring, 1)[:, None])
        place = np.stack([r * np.cos(turn), r * np.sin(turn), np.full(turn.shape, 10.0)], axis=-1).reshape(-1, 3)
        ones = np.ones(len(place))
        key = (np.arange(len(place)) + start * SECTORS).astype(np.uint64)
        cells = Scatterers("seabed", "seabed", law, place, np.tile([0.0, 0.0, -1.0], (len(place), 1)), area * ones,
                           ones.astype(complex), key)  # fmt: skip
        reading.add(received, simulator.engine.path_pairs(here, cells))
    return np.asarray(reading.time_series(received))[0]


@pytest.mark.parametrize(("floor_db", "low", "high"), [(-100.0, -0.3, 0.3), (-50.0, -12.0, -3.0)])
def test_the_first_return_is_whole_where_the_floor_lies_below_its_side_lobes(floor_db, low, high):
    """Panels 10 cm high, tilted by 20 degrees: the seabed below them is received by lobes of -50 dB and less.

    With `paths.beam_cutoff_db` at -100 the level at 8.1 ms is that of all cells counted, to 0.3 dB; at its default
    of -50 much of that ground is left out, and the return with it.
    """
    scenario = Scenario.model_validate({**SCENE, "paths": {"max_reflections": 0, "beam_cutoff_db": floor_db}})
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    reading = simulator.incoherent_accumulator(here)
    received = reading.empty()
    for pairs in simulator.engine.all_pairs(here, quadrature=True):
        reading.add(received, pairs)
    series = np.asarray(reading.time_series(received))[0]
    first = (simulator.grid.time > 8.05e-3) & (simulator.grid.time < 8.25e-3)
    assert low < 10 * np.log10(series[first].mean() / counted(simulator)[first].mean()) < high
