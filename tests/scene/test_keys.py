"""Every place has a key and a draw of its own: no two places of a scene are one, by accident or by arithmetic."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chisquare, kstest

from insonify import random_keys
from insonify.scene.box import box_scatterers
from insonify.scene.scatterer_grid import BASE_PITCH, TILE, Tiles
from insonify.scene.scatterers import grid_scatterer_id, target_scatterer_id
from insonify.scene.scene import point_scatterer
from insonify.scene.target import Box, PointTarget
from insonify.simulator import build_simulator
from oracles.jittered_points import jittered_points
from oracles.scenes import nominal, point

CELLS = st.integers(-(2**26), 2**26 - 1)
LATTICES = (random_keys.SEABED, random_keys.SURFACE)


def patch(level: int = 3, side: int = 10, *, seed: int = 1, stream: int = random_keys.SEABED) -> tuple[Tiles, object]:
    """A square of tiles about the origin, and what is drawn in them."""
    along, across = (index.ravel() - side // 2 for index in np.indices((side, side)))
    tiles = Tiles(np.full(along.size, level), along, across)
    return tiles, jittered_points(tiles, seed, stream)


def test_a_hundred_thousand_cells_have_a_hundred_thousand_keys() -> None:
    """Seabed and surface, levels 0 to 9, both sides of the origin: no key is given twice."""
    keys = [patch(level, 4, stream=stream)[1].scatterer_id for level, stream in itertools.product(range(10), LATTICES)]
    every = np.concatenate(keys)
    assert every.size > 300_000
    assert np.unique(every).size == every.size


@given(st.sampled_from(LATTICES), st.integers(0, 31), CELLS, CELLS)
def test_a_key_can_be_read_back(stream: int, level: int, along: int, across: int) -> None:
    """Stream, level and cell are packed side by side: each comes out as it went in, so no two keys can meet."""
    key = int(grid_scatterer_id(stream, level, np.array([along]), np.array([across]))[0])
    half = 1 << 26
    assert key >> 59 == stream
    assert (key >> 54) & 31 == level
    assert ((key >> 27) & (2**27 - 1)) - half == along
    assert (key & (2**27 - 1)) - half == across


def test_the_kernels_keys_are_those_of_the_page() -> None:
    """The packing is written twice, for the kernel and for people: the same keys."""
    tiles, drawn = patch(5, 2)
    pitch = BASE_PITCH * 2**5
    along, across = (np.floor(x / pitch).astype(np.int64) for x in (drawn.along, drawn.across))
    np.testing.assert_array_equal(drawn.scatterer_id, grid_scatterer_id(random_keys.SEABED, 5, along, across))
    assert len(drawn.scatterer_id) == len(tiles.scale) * TILE**2


@pytest.mark.parametrize("level", [0, 4, 9])
def test_each_point_lies_in_its_own_cell(level: int) -> None:
    """Reading the cell back from the position gives as many different cells as there are points."""
    _, drawn = patch(level, 6)
    pitch = BASE_PITCH * 2.0**level
    cells = np.floor(np.stack([drawn.along, drawn.across]) / pitch).astype(np.int64)
    assert np.unique(cells, axis=1).shape[1] == drawn.along.size
    np.testing.assert_allclose(drawn.area, pitch**2)
    # cells are counted from both sides of the origin
    assert cells.min() == -3 * TILE and cells.max() == 3 * TILE - 1


def test_places_in_their_cells_are_uniform_and_so_are_their_phases() -> None:
    """102 400 draws: Kolmogorov-Smirnov distance of each below 0.006 (99.9 % quantile: 1.95 / sqrt(n))."""
    _, drawn = patch()
    pitch = BASE_PITCH * 2.0**3
    for offset in (drawn.along / pitch % 1, drawn.across / pitch % 1):
        assert kstest(offset, "uniform").statistic < 0.0061
    assert kstest(np.angle(drawn.phase), "uniform", (-np.pi, 2 * np.pi)).statistic < 0.0061
    np.testing.assert_allclose(np.abs(drawn.phase), 1)


def test_place_and_phase_of_a_cell_are_independent_of_each_other() -> None:
    """A table of 8 x 8 classes of any two of the three draws is even: chi-square above its 0.1 % quantile."""
    _, drawn = patch()
    pitch = BASE_PITCH * 2.0**3
    parts = [drawn.along / pitch % 1, drawn.across / pitch % 1, np.angle(drawn.phase) / (2 * np.pi) % 1]
    for first, second in itertools.combinations(parts, 2):
        table = np.histogram2d(first, second, bins=8, range=[(0, 1), (0, 1)])[0]
        assert chisquare(table.ravel()).pvalue > 1e-3


def test_neighbours_are_strangers() -> None:
    """Phases of a cell and of its neighbour at any step to 3 are unrelated: mean product below 4 / sqrt(n)."""
    tiles, drawn = patch(3, 6)
    order = np.lexsort((np.floor(drawn.across / 0.08), np.floor(drawn.along / 0.08)))
    field = drawn.phase[order].reshape(6 * TILE, 6 * TILE)
    for i, j in itertools.product(range(4), repeat=2):
        if i or j:
            product = field[i:, j:] * np.conj(field[: field.shape[0] - i, : field.shape[1] - j])
            assert abs(product.mean()) < 4 / np.sqrt(product.size), (i, j)
    assert len(tiles.scale) == 36


def test_a_finer_level_of_the_same_ground_is_another_draw() -> None:
    """Cells with the same numbers at two levels, two streams or two seeds share neither offset nor phase."""
    base = patch(3, 4)[1].phase
    for other in (patch(4, 4), patch(3, 4, stream=random_keys.SURFACE), patch(3, 4, seed=2)):
        assert abs(np.mean(base * np.conj(other[1].phase))) < 4 / np.sqrt(base.size)


def test_every_face_of_every_box_has_keys_of_its_own() -> None:
    """Three labels, every face, 300 000 cells: all different, and different from every point target's."""
    boxes = [Box(label=label, position=(0, 0), size=(4, 3, 2)) for label in ("box", "box 2", "wreck")]
    keys = [box_scatterers(box, 20.0, 1, 0.02, 0).scatterer_id for box in boxes]
    points = [
        point_scatterer(PointTarget(label=label, position=(0, 0, 5))).scatterer_id for label in ("box", "box 2", "mine")
    ]
    every = np.concatenate([*keys, *points])
    assert every.size > 250_000
    assert np.unique(every).size == every.size


def test_faces_and_labels_do_not_share_their_draws() -> None:
    """The top of one box is not the top of another, nor a side of itself."""
    draws = {}
    for label in ("port buoy", "starboard buoy"):
        points = box_scatterers(Box(label=label, position=(0, 0), size=(2, 2, 2)), 20.0, 1, 0.1, 0)
        facing = np.round(points.normal).astype(int)
        for face in np.unique(facing, axis=0):
            draws[label, tuple(face)] = points.phase[(facing == face).all(axis=1)]
    assert len(draws) >= 10
    for one, other in itertools.combinations(draws.values(), 2):
        assert abs(np.mean(one * np.conj(other))) < 5 / np.sqrt(one.size)


@given(st.text(min_size=1, max_size=30), st.integers(0, 7), st.integers(0, 4095), st.integers(0, 4095))
def test_a_targets_key_states_face_and_cell(label: str, face: int, row: int, column: int) -> None:
    """Twelve bits each for row and column, three for the face: read back as they went in, under any label."""
    key = int(target_scatterer_id(label, face, np.array([row]), np.array([column]))[0])
    assert (key & 4095, (key >> 12) & 4095, (key >> 24) & 7, key >> 59) == (column, row, face, random_keys.TARGET)


def test_no_key_of_a_whole_ping_is_given_twice() -> None:
    """Bed, surface, two boxes and a buoy in one ping: as many keys as scatterers."""
    scenario = nominal(
        box={}, surface={"scattering": {"strength_db": -30}}, track={"window": (0.19, 0.21)},
        paths={"beam_cutoff_db": -30},
    )  # fmt: skip
    more = nominal(targets=[{"shape": "box", "label": "other", "position": (0, 145), "size": (1, 1, 1)},
                            point(0, 148, 12)]).targets  # fmt: skip
    scenario = scenario.model_copy(update={"targets": (*scenario.targets, *more)})
    simulator = build_simulator(scenario)
    blocks = [block() for block in simulator.engine.blocks(simulator.ping_geometry(0))]
    keys = np.concatenate([block.scatterer_id for block in blocks])
    assert {block.object for block in blocks} == {"seabed", "surface", "box", "other", "point"}
    assert np.unique(keys).size == keys.size


def test_a_slice_has_keys_of_its_own_for_bed_and_surface() -> None:
    """Along the plane each cell has one key, the surface's apart from the bed's and both from the lattice's."""
    scenario = nominal(
        surface={"scattering": {"strength_db": -30}}, track={"window": (0.1, 0.12)}, paths={"geometry": "slice"}
    )
    simulator = build_simulator(scenario)
    blocks = [block() for block in simulator.engine.blocks(simulator.ping_geometry(0))]
    keys = np.concatenate([block.scatterer_id for block in blocks])
    assert np.unique(keys).size == keys.size
    assert set((keys >> np.uint64(59)).tolist()) == {random_keys.SLICE}
