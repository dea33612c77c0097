"""Claims about the height map's part of a run: tiles that scatterers' lines and rays read, synthesised once."""

import numpy as np
import pytest

import insonify
from insonify.estimates import terrain_work, unit_costs
from insonify.estimates.ping_work import ping_work
from insonify.estimates.run_cost import estimate_cost
from insonify.scene.heightmap_cache import HALF_BYTES, NODES
from insonify.scene.heightmap_synthesis import HeightmapSynthesizer
from insonify.simulator import build_simulator
from oracles.scenes import nominal

FINE = {"relief": {"kind": "power-law", "hurst": 0.6, "rms": 0.02}}
TRACER = {"engine": "tracer", "rays": 20_000}
BISTATIC = {"kind": "static", "position": (3.0, 2.0, 12.0)}
WIDE = {"transmit": {"kind": "line", "length": 0.02}, "receive": {"kind": "line", "length": 0.02}}


def rough(seed, **changes):
    """A rough seabed that no other test has synthesised."""
    changes = {
        "track": {"window": (0.015, 0.03)},
        "paths": {"max_reflections": 0, "scatterers_per_cell": 0.5},
    } | changes
    return nominal(seabed={**FINE, "seed": seed}, **changes)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"sonar": WIDE},
        {"sonar": {"sides": ["port", "starboard"]}},
        {"sonar": WIDE, "receiver_track": BISTATIC},
        {"field": "incoherent"},
        {"field": "incoherent", "paths": TRACER},
    ],
    ids=["line", "wide", "two sides", "two platforms", "expected", "tracer"],
)
def test_tiles_of_the_height_map_are_counted_before_they_are_synthesised(monkeypatch, request, changes):
    """To a factor of two, for narrow and wide beams, one and two platforms, and rays."""
    drawn, draw = [], HeightmapSynthesizer.synthesize
    scenario = rough(1000 + len(request.node.name), **changes)
    estimated = ping_work(build_simulator(scenario)).terrain_tiles
    monkeypatch.setattr(
        HeightmapSynthesizer,
        "synthesize",
        lambda own, rows, *others: drawn.append(len(rows)) or draw(own, rows, *others),
    )
    insonify.simulate(scenario, pings=0)
    assert sum(drawn) > 10 and 0.5 < estimated / sum(drawn) < 2


def test_tiles_are_synthesised_once_for_pings_from_one_position():
    """A hundred pings of a sonar that stands still need no more of them than one; a moving one needs more."""
    track = {"window": (0.015, 0.03), "pings": 100, "interval": 0.05}
    line = {"kind": "line", "start": (0.0, 0.0, 11.0), "speed": 2.0}
    still, moving = build_simulator(rough(7, track=track)), build_simulator(rough(7).with_(track=track | line))
    first = terrain_work.terrain_seconds(build_simulator(rough(7)), 50.0)
    assert terrain_work.terrain_seconds(still, 50.0) == pytest.approx(first)
    assert first < terrain_work.terrain_seconds(moving, 50.0) < 100 * first


def test_the_height_map_is_part_of_time_and_memory():
    """Relief in wide beams takes the time and the memory of its tiles."""
    scenario = rough(8, sonar=WIDE, track={"window": (0.02, 0.05)})
    simulator, cost = build_simulator(scenario), estimate_cost(scenario)
    work = ping_work(simulator)
    seconds = terrain_work.terrain_seconds(simulator, work.terrain_tiles)
    assert work.terrain_tiles > 300 and seconds > 0.02
    assert cost.seconds == pytest.approx(
        unit_costs.START_SECONDS + unit_costs.WRITE_SECONDS + work.seconds + seconds, rel=0.002
    )
    assert terrain_work.terrain_bytes(work.terrain_tiles) == pytest.approx(work.terrain_tiles * 4 * NODES**2)
    assert np.isfinite(cost.memory) and cost.memory > 300e6 + 0.9 * work.terrain_tiles * 4 * NODES**2


def test_no_tile_lasts_where_one_ping_reads_more_than_are_stored():
    """Tiles of half the memory of the height map are synthesised in every ping; those of less, once."""
    track = {"window": (0.015, 0.03), "pings": 10, "interval": 0.05}
    one, ten = build_simulator(rough(9)), build_simulator(rough(9, track=track))
    few, many = 1000.0, 1.01 * HALF_BYTES / terrain_work.TILE_BYTES
    assert terrain_work.terrain_seconds(ten, few) == pytest.approx(terrain_work.terrain_seconds(one, few))
    assert terrain_work.terrain_seconds(ten, many) == pytest.approx(10 * terrain_work.terrain_seconds(one, many))
    assert terrain_work.terrain_bytes(10 * many) == 2 * HALF_BYTES


def test_flat_ground_has_no_height_map():
    """No tiles, no time."""
    flat = build_simulator(nominal(track={"window": (0.015, 0.03)}))
    assert ping_work(flat).terrain_tiles == 0 and terrain_work.terrain_seconds(flat, 0.0) == 0


def test_more_scatterers_cross_more_tiles_but_not_more_than_there_are():
    """Lines to one scatterer, to a hundred and to a million of a full circle; the area over that of a tile at most."""
    terrain = build_simulator(rough(10)).engine.scene.seabed.terrain
    radius, in_beam = np.linspace(1.0, 40.0, 40), np.ones((40, 360), bool)
    one, some, all_of_them = (
        terrain_work.tiles_under_rings(terrain, np.full(40, number / 40), radius, in_beam, 40.0, 0.002)
        for number in (1, 100, 1e6)
    )
    side = 64 * terrain.heightmap_cell_size
    area = np.pi * 40.0**2 / side**2
    assert 0.5 * 40 / side < one < 2 * 40 / side
    assert one < some / 10 and some < all_of_them and 0.9 * area < all_of_them < 1.2 * area


def test_a_narrower_beam_crosses_fewer_tiles():
    """A tenth of all directions has about a tenth of the tiles."""
    terrain = build_simulator(rough(11)).engine.scene.seabed.terrain
    radius, whole, tenth = np.linspace(1.0, 40.0, 40), np.ones((40, 360), bool), np.zeros((40, 360), bool)
    tenth[:, :36] = True
    points = np.full(40, 1e5)
    some, every = (
        terrain_work.tiles_under_rings(terrain, points, radius, in_beam, 40.0, 0.002) for in_beam in (tenth, whole)
    )
    assert some == pytest.approx(every / 10, rel=0.5)


def test_a_near_target_of_few_beams_does_not_read_the_far_terrain():
    """Lines end at the edge of the zone of their scatterers: those to 2 m cross no more than the tiles within 5 m."""
    terrain = build_simulator(rough(12)).engine.scene.seabed.terrain
    radius, in_beam = np.array([2.0]), np.ones((1, 360), bool)
    near = terrain_work.tiles_under_rings(terrain, np.array([1e5]), radius, in_beam, 40.0, 1e-4)
    side = 64 * terrain.heightmap_cell_size
    assert near < 1.2 * np.pi * 5.0**2 / side**2 + 4 * 5.0 / side
