"""Claims about scatterers requested more densely than their finest grid holds."""

import warnings

import numpy as np
import pytest

from insonify.engines.ping_scatterers import ping_scatterers
from insonify.engines.resolution import tiles_in_view
from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator

LINE = {"kind": "line", "length": 0.5}


def fine(per_cell: float, **changes: object) -> tuple[Scenario, list[str]]:
    """A short wide-band scene near the bed, and its warnings about the density."""
    made = {
        "seabed": {"depth": 3, "scattering": {"law": "lambert", "strength_db": -27}},
        "sonar": {
            "source_level_db": 200, "pulse": {"kind": "lfm", "frequency": 900e3, "bandwidth": 60e3, "duration": 2e-4},
            "transmit": LINE, "receive": LINE, "receiver": {"bandwidth": 90e3},
        },
        "track": {"kind": "static", "position": (0, 0, 1.5), "window": (0.0, 0.006)},
        "paths": {"scatterers_per_cell": per_cell, "max_reflections": 0},
    } | changes  # fmt: skip
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scenario = Scenario(**made)
    return scenario, [str(one.message) for one in caught if "scatterers_per_cell" in str(one.message)]


def smallest_count(scenario: Scenario) -> float:
    """Scatterers in the resolution cell that holds the fewest, by the tiles of the first ping."""
    ready = build_simulator(scenario)
    here = ready.ping_geometries(0)[0]
    cells = ping_scatterers(scenario.scene, scenario.paths, 1, here, ready.engine.rays).resolution
    tiles, density = tiles_in_view(here, scenario.seabed.scatterer_grid, 3.0, ready.engine.rays, ("D",), cells, 1e-2)
    away = np.linalg.norm(tiles.centre - here.transmit_position[:2], axis=1)
    area = cells.cell_area(away, 1.5) * scenario.paths.scatterers_per_cell
    return float(np.min(area / tiles.pitch**2 * density))


@pytest.mark.parametrize("per_cell", [400, 1000])
def test_a_density_beyond_the_finest_grid_is_warned_of_with_the_count_that_is_reached(per_cell):
    """The warning names what the tiles hold, to two digits, and following its advice removes it."""
    scenario, (word,) = fine(per_cell)
    most = float(word.partition("Give ")[2].split()[0])
    assert smallest_count(scenario) == pytest.approx(most, rel=0.1)
    assert f"{per_cell} are requested" in word and "0.625 mm apart" in word and "seabed" in word
    again, words = fine(most)
    assert words == []
    assert smallest_count(again) == pytest.approx(most, rel=0.01)


@pytest.mark.parametrize(
    "changes", [{"field": "incoherent"}, {"paths": {"scatterers_per_cell": 1000, "geometry": "slice"}}, {}]
)
def test_nothing_is_reported_where_the_grid_sets_no_limit(changes):
    """Even points and slices have cells of any size; a usual density fits into the grid."""
    assert fine(1000 if changes else 5, **changes)[1] == []
